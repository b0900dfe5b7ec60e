//! The state of the links and of the arbiter: `link/health`.

use lager_wire::ResetCause;

use super::steering::{Finish, Origin, Refusal};
use super::stop::StopCause;
use crate::role::Role;
use crate::schema::payload;
use crate::tag::{Tag, coded, coded_as_is};

coded_as_is!(ResetCause {
    Unknown,
    PowerOn,
    External,
    BrownOut,
    Watchdog,
    Panic,
    Jtag,
});

coded! {
    /// Who may drive.
    pub enum Mode {
        /// The operator.
        Manual = 0,
        /// The navigator.
        Autonomous = 1,
    }
}

coded! {
    /// What the steering board says to the arm's profile (`[arm]` of the configuration).
    pub enum ArmProfileState {
        /// No board is up that knows profiles.
        NoBoard = 0,
        /// It is being told; the arm stands meanwhile.
        Telling = 1,
        /// It obeys the profile.
        Accepted = 2,
        /// It does not take the profile; the arm is not moved.
        Refused = 3,
        /// It does not answer; the arm is not moved until it does.
        Unanswered = 4,
    }
}

coded! {
    /// How the last calibration of the line sensors went.
    pub enum Calibration {
        /// There was none since the robot was started.
        Never = 0,
        /// The sensor board watches its sensors.
        Running = 1,
        /// Every sensor has a new threshold.
        Done = 2,
        /// Only some have; the others have not seen both floor and tape.
        Partly = 3,
        /// The board fell silent or restarted before the end.
        BrokenOff = 4,
    }
}

payload! {
    /// One board's link, as the bridge sees it. Counters wrap.
    pub struct BoardHealth: 48 bytes {
        /// Life of the link: grows with each handshake.
        pub epoch: u32,
        /// Good packets received in this epoch.
        pub packets: u32,
        /// Packets missing by their ids in this epoch, a lower bound.
        pub lost: u32,
        /// Packets missing by their ids in all epochs, over ports and lives of the bridge.
        pub lost_total: u32,
        /// Packets refused by their CRC.
        pub bad_crc: u32,
        /// Bytes passed over while looking for a packet.
        pub skipped_bytes: u32,
        /// Times the board has restarted.
        pub reboots: u32,
        /// Speed of the port in baud.
        pub baud: u32,
        /// 1 = the handshake is done and packets come.
        pub up: u8,
        /// Version of the wire protocol, `0xFF` = unknown.
        pub version: u8 = Self::UNKNOWN,
        /// Why the board last restarted.
        pub reset_cause: Tag<ResetCause>,
        /// Port it was found on: 0 = configured as sensor, 1 = as steering, `0xFF` = none.
        pub port: u8 = Self::UNKNOWN,
        /// The board's own count of packets it refused; saturates.
        pub board_bad_packets: u8,
        /// The board's own count of packets missing by id; saturates.
        pub board_lost: u8,
        /// The board's own count of commands it refused; saturates.
        pub board_refused: u8,
        /// The board's own count of ExDe errors; saturates.
        pub board_exde_errors: u8,
        /// The board's own count of unanswered servos; saturates.
        pub board_servo_timeouts: u8,
        /// Processor load of the board in percent.
        pub board_load_percent: u8,
        /// Longest main loop of the board in units of 100 us.
        pub board_longest_loop_100us: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 5],
    }
}

impl BoardHealth {
    /// `version` and `port` before they are known.
    pub const UNKNOWN: u8 = 0xFF;
}

payload! {
    /// What one line sensor has read in a calibration, 0 to 255; tape reads higher than floor. The
    /// least is above the most as long as nothing has been heard of it.
    pub struct CalibratedSensor: 4 bytes {
        /// What it read last.
        pub reading: u8,
        /// The least that it has read.
        pub lowest: u8 = u8::MAX,
        /// The most that it has read.
        pub highest: u8,
        /// 1 = the two lie so far apart that the board takes them for floor and tape.
        pub tells_apart: u8,
    }
}

impl CalibratedSensor {
    /// Whether the board has told what it reads.
    pub const fn is_heard(&self) -> bool {
        self.lowest <= self.highest
    }
}

payload! {
    /// Both links and the arbiter: all that a restarted bridge needs to go on.
    pub struct Health: 232 bytes {
        /// The sensor board's link.
        pub sensor: BoardHealth,
        /// The steering board's link.
        pub steering: BoardHealth,
        /// Samples of the bus the bridge itself has missed, and board data that it dropped
        /// because its main loop was behind.
        pub bus_lost: u64,
        /// What the wheels have turned in manual mode, whatever the direction: duty × µs, summed
        /// over both motors. It grows over all lives of the bridge.
        pub driven_by_hand: u64,
        /// When the stop that is latched was set, in ns of `CLOCK_MONOTONIC`; 0 = none is.
        pub stopped_at_ns: u64,
        /// The word of that stop, which a request to release it names; 0 = none is latched.
        pub stop_word: u64,
        /// The order in force.
        pub current_id: u32,
        /// The order that ended last.
        pub finished_id: u32,
        /// Orders refused by the arbiter.
        pub orders_refused: u32,
        /// Orders that ended because nobody renewed them.
        pub leases_expired: u32,
        /// The order refused last.
        pub refused_id: u32,
        /// The presses of the switch taken last, by their ids, the last one first; 0 = none.
        pub switch_ids: [u32; 4],
        /// Until the lease of the order in force ends, in ms; 0 = none runs.
        pub next_lease_ms: u16,
        /// Gain on the error that was set by request, -1 = never set.
        pub gain_p: i16 = Self::NEVER_SET,
        /// Gain on the change of the error that was set by request, -1 = never set.
        pub gain_d: i16 = Self::NEVER_SET,
        /// Who may drive.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Who gave the order in force.
        pub current_origin: Tag<Origin>,
        /// Who gave the order that ended last.
        pub finished_origin: Tag<Origin>,
        /// Command code in force.
        pub current_code: u8,
        /// Sequence byte of the last command on the wire.
        pub wire_seq: u8,
        /// How the last order ended.
        pub finish: Tag<Finish>,
        /// Who gave the order refused last.
        pub refused_origin: Tag<Origin>,
        /// Why it was refused.
        pub refusal: Tag<Refusal>,
        /// Why nobody may move the robot at present.
        pub blocked: Tag<Refusal>,
        /// What the steering board says to the arm's profile.
        pub arm_profile: Tag<ArmProfileState>,
        /// How the last calibration of the line sensors went.
        pub calibration: Tag<Calibration>,
        /// Line sensors that it gave a new threshold, 0..=11.
        pub calibrated_sensors: u8,
        /// Calibrations that have ended; wraps.
        pub calibrations_ended: u8,
        /// What each line sensor has read in the last one, the leftmost first.
        pub calibrated: [CalibratedSensor; 11],
        /// Why a stop is latched.
        pub stop_cause: Tag<StopCause>,
        /// Who has set the stop that is latched; without meaning if none is.
        pub stop_origin: Tag<Role>,
        /// 1 once somebody has set the mode since the robot was switched on.
        pub mode_chosen: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 1],
    }
}

impl Health {
    /// `gain_p` and `gain_d` before a request has set them. 0 is a gain.
    pub const NEVER_SET: i16 = -1;

    /// Why the last calibration has not ended well, as a sentence; `None` if it has.
    pub fn calibration_failure(&self) -> Option<String> {
        match self.calibration.get() {
            Some(Calibration::Done) => None,
            Some(Calibration::Partly) => Some(format!(
                "only {} of the 11 line sensors have seen both floor and tape, and the others keep \
                 their thresholds; calibrate again and move the robot to and fro across the tape \
                 meanwhile",
                self.calibrated_sensors
            )),
            _ => Some(
                "the sensor board fell silent or restarted before the calibration had ended; \
                 `lager doctor` looks for the cause"
                    .to_owned(),
            ),
        }
    }
}
