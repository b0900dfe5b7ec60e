//! Orders to the steering board and its reports: `steering/command`, `steering/state`.

use core::fmt;

use lager_orders::Reason;
use lager_sample::{Tag, coded, payload};

use super::{SERVO_UNKNOWN, said};

coded! {
    /// For whom a command is given.
    pub enum Origin {
        /// The navigator.
        Logic = 0,
        /// A person, or a script in a person's place.
        Operator = 1,
    }
}

coded! {
    /// How an order ended.
    pub enum Finish {
        /// Nothing has ended yet.
        None = 0,
        /// It was carried out.
        Done = 1,
        /// It was ended early.
        Aborted = 2,
        /// It was never begun.
        Refused = 3,
        /// The steering board stopped following the line: the sensor board sent nothing.
        NoWord = 4,
        /// The steering board stopped following the line: there was no tape for too long.
        NoTape = 5,
    }
}

impl Finish {
    /// The result of the command with that name, as a sentence.
    pub fn of(self, command: &str) -> Reason {
        Reason::of(&said::name("finish", Tag::from(self)), |_| {
            Some(command.into())
        })
    }
}

coded! {
    /// Why the bridge does not carry out an order.
    pub enum Refusal {
        /// The order is not refused.
        None = 0,
        /// Origin or command code have no meaning (AMB-52).
        Undefined = 1,
        /// Only logic may give this command (AMB-2, AMB-27).
        LogicOnly = 2,
        /// The arm is locked while the wheels move (T4, AMB-28).
        ArmLocked = 3,
        /// The id in force came again with another command code.
        CodeChanged = 4,
        /// The mode gives the wheels to the other origin.
        NotInCharge = 5,
        /// A stop is latched.
        StopLatched = 6,
        /// The bridge is shutting down.
        ShuttingDown = 7,
        /// No steering board is connected.
        NoBoard = 8,
        /// The steering board has not reported for 200 ms.
        BoardSilent = 9,
        /// The steering board is an original one, and `original_boards` is not set.
        OriginalBoard = 10,
        /// A person gave the order too long ago: it was late on its way.
        Stale = 11,
        /// The steering board does not obey the arm's profile, so nothing limits the arm.
        ArmUnlimited = 12,
        /// The steering board is an original one, which knows the full speed only.
        FullSpeedOnly = 13,
        /// A board does not obey the description of its robot (yet), so nobody knows which way it would
        /// drive.
        Undescribed = 14,
    }
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        said::reason("refusal", Tag::from(refusal))
    }
}

impl fmt::Display for Refusal {
    /// Writes the reason as the end of a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

payload! {
    /// An order to the arbiter in the bridge. A stop is not such an order: it is a word in memory,
    /// see [`StopCause`](super::StopCause).
    pub struct SteeringOrder: 16 bytes {
        /// When a person first gave the order with this id, in ns of `CLOCK_MONOTONIC`; renewals
        /// repeat this time. An order that is not in force yet begins within 200 ms after it or
        /// never. Without meaning for logic's orders, which are as old as their sample.
        pub given_ns: u64,
        /// The same id renews the lease, a new id is a new order.
        pub id: u32,
        /// Who gives the order.
        pub origin: Tag<Origin>,
        /// The firmware's command code.
        pub code: u8,
        /// 1 = logic stands at a pick station and lets the operator move the arm.
        pub arm_granted: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
    }
}

payload! {
    /// The steering board's report, with the last values of the arm's servos.
    pub struct SteeringReport: 56 bytes {
        /// The life of the link to the board from which this came.
        pub link_epoch: u32,
        /// The order that ended last.
        pub finished_id: u32,
        /// The order that the board carries out.
        pub current_id: u32,
        /// Who gave the order that ended last.
        pub finished_origin: Tag<Origin>,
        /// Who gave the order that the board carries out.
        pub current_origin: Tag<Origin>,
        /// How the last order ended.
        pub finish: Tag<Finish>,
        /// The command code that the board reports.
        pub code: u8,
        /// Duty of the left motor, 0..=255.
        pub left_duty: u8,
        /// Duty of the right motor, 0..=255.
        pub right_duty: u8,
        /// The board's flags as on the wire.
        pub flags: u8,
        /// Line error in half sensor steps, positive = the line is to the right.
        pub line_error: i8,
        /// Error bits of the servos, combined.
        pub servo_errors: u8,
        /// Battery in tenths of a volt, 0 = unknown.
        pub battery_decivolts: u8,
        /// How old the board's own data in this sample are, in ms of robot time: 0 = they have just
        /// come, 65 535 = the board has sent none in this life of its link. For an original board
        /// the bridge makes the sample itself, and it is never old.
        pub age_ms: u16 = Self::NEVER_HEARD,
        /// Position 0..=1023 of servo n at index n - 1, `0xFFFF` = not heard yet.
        pub servo_position: [u16; 8] = [SERVO_UNKNOWN; 8],
        /// Load -1023..=1023 of servo n at index n - 1.
        pub servo_load: [i16; 8],
    }
}

impl SteeringReport {
    /// The value of `age_ms` before the board has reported.
    pub const NEVER_HEARD: u16 = u16::MAX;
}
