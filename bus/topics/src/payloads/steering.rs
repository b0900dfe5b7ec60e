//! What the steering board is told and what it reports: `steering/command`, `steering/state`.

use core::fmt;

use super::SERVO_UNKNOWN;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// On whose behalf a command is given.
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
        /// It was cut short.
        Aborted = 2,
        /// It was not begun.
        Refused = 3,
        /// The steering board gave up following: no word came from the sensor board.
        NoWord = 4,
        /// The steering board gave up following: there was no tape for too long.
        NoTape = 5,
    }
}

impl fmt::Display for Finish {
    /// What became of the order, as the end of a sentence that begins with it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::None => "has not ended",
            Self::Done => "is done",
            Self::Aborted => {
                "was cut short: a board was reset, another order took its place, or it was not \
                 renewed in time"
            }
            Self::Refused => {
                "is refused by the steering board: the arm moves only while the robot stands, and \
                 no joint beyond its limits in [arm]"
            }
            Self::NoWord => {
                "was given up: the sensor board's words do not reach the steering board; look at \
                 the cable between the two boards"
            }
            Self::NoTape => "was given up: the steering board has seen no tape for too long",
        })
    }
}

coded! {
    /// Why the bridge does not carry an order out.
    pub enum Refusal {
        /// It does: nothing is refused.
        None = 0,
        /// Origin or command code have no meaning (AMB-52).
        Undefined = 1,
        /// Only logic may give this command (AMB-2, AMB-27).
        LogicOnly = 2,
        /// The arm is locked while the wheels move (T4, AMB-28).
        ArmLocked = 3,
        /// The id in force came again with another code.
        CodeChanged = 4,
        /// The mode gives the wheel to the other origin.
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
        /// A person gave it too long ago: it was held up on its way.
        Stale = 11,
        /// The steering board does not obey the arm's profile, so nothing limits the arm.
        ArmUnlimited = 12,
    }
}

impl fmt::Display for Refusal {
    /// The reason as the end of a sentence, with what to do where something can be done.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::None => "nothing is refused",
            Self::Undefined => "origin or command code have no meaning",
            Self::LogicOnly => "only logic may give this command",
            Self::ArmLocked => "the arm is locked while the wheels move",
            Self::CodeChanged => "its number is in use for another command",
            Self::NotInCharge => {
                "somebody else steers in this mode; `lager mode` changes who steers"
            }
            Self::StopLatched => "the robot is stopped; `lager resume` releases the stop",
            Self::ShuttingDown => "the bridge is shutting down",
            Self::NoBoard => "no steering board is connected; `lager doctor` looks for the cause",
            Self::BoardSilent => {
                "the steering board does not report; look at its cable and its power"
            }
            Self::OriginalBoard => {
                "the steering board is an original one, whose commands have no age limit; \
                 `[serial] original_boards = true` accepts that"
            }
            Self::Stale => "it was held up for too long on its way; give it anew",
            Self::ArmUnlimited => {
                "the steering board has not taken [arm] of the configuration; flash the image of this program's version"
            }
        })
    }
}

payload! {
    /// An order to the arbiter in the bridge. A stop is none: it is a word in memory, see
    /// [`StopCause`](super::StopCause).
    pub struct SteeringOrder: 16 bytes {
        /// When a person first gave the order of this id, in ns of `CLOCK_MONOTONIC`; renewals
        /// repeat it. An order that is not in force is begun within 200 ms of it or never. Without
        /// meaning for logic's orders, which are as old as their sample.
        pub given_ns: u64,
        /// The same id renews the lease, a new id executes.
        pub id: u32,
        /// Who gives it.
        pub origin: Tag<Origin>,
        /// The firmware's command code.
        pub code: u8,
        /// 1 while logic stands at a pick station and lets the operator move the arm.
        pub arm_granted: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
    }
}

payload! {
    /// The steering board's report, with the arm's servos as last heard.
    pub struct SteeringReport: 56 bytes {
        /// Which life of the link to the board this came from.
        pub link_epoch: u32,
        /// The order that ended last.
        pub finished_id: u32,
        /// The order the board is on.
        pub current_id: u32,
        /// Who gave the order that ended last.
        pub finished_origin: Tag<Origin>,
        /// Who gave the order the board is on.
        pub current_origin: Tag<Origin>,
        /// How the last order ended.
        pub finish: Tag<Finish>,
        /// The command code the board reports.
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
        /// How old the board's own words in this sample are, in ms of robot time: 0 = they have
        /// just come, 65 535 = it has said nothing in this life of its link. An original board's
        /// sample is the bridge's own word, and never old.
        pub age_ms: u16 = Self::NEVER_HEARD,
        /// Position 0..=1023 of servo n at index n - 1, `0xFFFF` = not heard yet.
        pub servo_position: [u16; 8] = [SERVO_UNKNOWN; 8],
        /// Load -1023..=1023 of servo n at index n - 1.
        pub servo_load: [i16; 8],
    }
}

impl SteeringReport {
    /// `age_ms` before the board has reported.
    pub const NEVER_HEARD: u16 = u16::MAX;
}
