//! The state of the links and of the arbiter: `link/health`.

use core::fmt;

use lager_orders::{Code, Mode, Reason};
use lager_sample::{Tag, coded, payload};
use lager_wire::{BUILD, Callsign, ResetCause, Version};

use super::steering::{Finish, Origin, Refusal};
use super::stop::StopCause;
use crate::role::Role;

coded! {
    /// How far a board has got with a part of the robot's description.
    pub enum ProfileState {
        /// No board that knows profiles is connected.
        NoBoard = 0,
        /// The bridge is sending the profile; what depends on it stands meanwhile.
        Telling = 1,
        /// The board obeys the profile.
        Accepted = 2,
        /// The board does not accept the profile; what depends on it is not moved.
        Refused = 3,
        /// The board does not answer; what depends on it is not moved until it does.
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
        /// Only some sensors have; the others have not seen both floor and tape.
        Partly = 3,
        /// The board stopped sending or restarted before the end.
        BrokenOff = 4,
    }
}

payload! {
    /// One board's link, as the bridge sees it. Counters wrap.
    pub struct BoardHealth: 48 bytes {
        /// Number of the link's life: grows with each handshake.
        pub epoch: u32,
        /// Good packets received in this epoch.
        pub packets: u32,
        /// Packets missing by their ids in this epoch; there may be more.
        pub lost: u32,
        /// Packets missing by their ids in all epochs, over all ports and all runs of the bridge.
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
        /// Port on which it was found: 0 = configured as sensor, 1 = as steering, `0xFF` = none.
        pub port: u8 = Self::UNKNOWN,
        /// Build number of the board's image; 0 is an original board, or an image without one.
        pub build: u16,
        /// The board's own count of packets that it refused; saturates.
        pub board_bad_packets: u8,
        /// The board's own count of packets missing by id; saturates.
        pub board_lost: u8,
        /// The board's own count of commands that it refused; saturates.
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
        pub reserved: [u8; 3],
    }
}

impl BoardHealth {
    /// `version` and `port` before they are known.
    pub const UNKNOWN: u8 = 0xFF;

    /// What is wrong with the board's image, if that is known not to fit this program.
    pub fn misfit(&self) -> Option<Misfit> {
        match self.version {
            Self::UNKNOWN => None,
            version => Misfit::of(version, self.build),
        }
    }
}

/// The image of a board of ours has another build number than the images that fit this program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Misfit {
    build: u16,
}

impl Misfit {
    /// Judges an image by the version of its packets and its build number. An original board, which
    /// has version 0, has no number, and is none of ours.
    pub fn of(version: u8, build: u16) -> Option<Self> {
        (version != Version::Original as u8 && build != BUILD).then_some(Self { build })
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { build } = self;
        write!(
            formatter,
            "its image has build {build}, and this program goes with build {BUILD}; "
        )?;
        formatter.write_str(if *build < BUILD {
            "`lager board update` gives it the image that fits"
        } else {
            "install the newer program that came with that image"
        })
    }
}

payload! {
    /// The readings of one line sensor in a calibration, 0 to 255; tape reads higher than floor. As
    /// long as the board has not reported them, `lowest` is above `highest`.
    pub struct CalibratedSensor: 4 bytes {
        /// The last reading.
        pub reading: u8,
        /// The lowest reading.
        pub lowest: u8 = u8::MAX,
        /// The highest reading.
        pub highest: u8,
        /// 1 = the two lie so far apart that the board takes them for floor and tape.
        pub tells_apart: u8,
    }
}

impl CalibratedSensor {
    /// Whether the board has reported the readings.
    pub const fn is_heard(&self) -> bool {
        self.lowest <= self.highest
    }
}

payload! {
    /// Both links and the arbiter: all that a restarted bridge needs to go on.
    pub struct Health: 224 bytes {
        /// The sensor board's link.
        pub sensor: BoardHealth,
        /// The steering board's link.
        pub steering: BoardHealth,
        /// Samples of the bus that the bridge itself has missed, and board data that it dropped
        /// because its main loop was late.
        pub bus_lost: u64,
        /// How far the wheels have turned in manual mode, in any direction: duty × µs, summed over
        /// both motors. It grows over all runs of the bridge.
        pub driven_by_hand: u64,
        /// When the latched stop was set, in ns of `CLOCK_MONOTONIC`; 0 = no stop is latched.
        pub stopped_at_ns: u64,
        /// The word of that stop, which a request to release it must name; 0 = none is latched.
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
        /// Time until the lease of the order in force ends, in ms; 0 = no lease runs.
        pub next_lease_ms: u16,
        /// Gain on the error, as a request has set it; -1 = never set.
        pub gain_p: i16 = Self::NEVER_SET,
        /// Gain on the change of the error, as a request has set it; -1 = never set.
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
        /// Why that order was refused.
        pub refusal: Tag<Refusal>,
        /// Why nobody may move the robot at present.
        pub blocked: Tag<Refusal>,
        /// How far the steering board has got with the arm's profile.
        pub arm_profile: Tag<ProfileState>,
        /// How the last calibration of the line sensors went.
        pub calibration: Tag<Calibration>,
        /// Line sensors to which it gave a new threshold, 0..=11.
        pub calibrated_sensors: u8,
        /// Calibrations that have ended; wraps.
        pub calibrations_ended: u8,
        /// The readings of each line sensor in the last calibration, the leftmost first.
        pub calibrated: [CalibratedSensor; 11],
        /// Why a stop is latched.
        pub stop_cause: Tag<StopCause>,
        /// Who has set the latched stop; without meaning if no stop is latched.
        pub stop_origin: Tag<Role>,
        /// 1 = somebody has set the mode since the robot was switched on.
        pub mode_chosen: u8,
        /// How far the steering board has got with motors and battery.
        pub steering_profile: Tag<ProfileState>,
        /// How far the sensor board has got with its sensors.
        pub sensor_profile: Tag<ProfileState>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
        /// A hash of everything that the boards are told of their robot, by which a successor knows
        /// whether they were told the same.
        pub description: u32,
    }
}

impl Health {
    /// `gain_p` and `gain_d` before a request has set them. 0 is a valid gain.
    pub const NEVER_SET: i16 = -1;

    /// The link of a board, [`Callsign::Sensor`] or [`Callsign::Steering`].
    pub const fn of(&self, board: Callsign) -> &BoardHealth {
        match board {
            Callsign::Sensor => &self.sensor,
            _ => &self.steering,
        }
    }

    /// Whether both boards are up, and nobody is telling them how their robot is built.
    pub fn boards_are_ready(&self) -> bool {
        let told = [self.sensor_profile, self.steering_profile, self.arm_profile];
        self.sensor.up != 0
            && self.steering.up != 0
            && told.iter().all(|told| *told != ProfileState::Telling)
    }

    /// Why the last calibration did not end well; `None` if it did.
    pub fn calibration_failure(&self) -> Option<Reason> {
        match self.calibration.get() {
            Some(Calibration::Done) => None,
            Some(Calibration::Partly) => Some(Reason::new(
                Code::CalibrationPartly,
                &[&self.calibrated_sensors],
            )),
            _ => Some(Code::CalibrationBroken.into()),
        }
    }
}
