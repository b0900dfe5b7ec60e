//! What the bridge can be asked for: `bridge/request`.

use super::link::Mode;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// What is asked.
    pub enum AskKind {
        /// Change the mode to `mode`.
        SetMode = 0,
        /// Release the latched stop.
        Resume = 1,
        /// Set the gains of the line control to `gain_p` and `gain_d`.
        SetGains = 2,
        /// Calibrate the line sensors on the tape under the robot.
        Calibrate = 3,
        /// Restart both boards.
        ResetBoards = 4,
    }
}

coded! {
    /// What became of it.
    pub enum Outcome {
        /// It is in force.
        Done = 0,
        /// It is not allowed now or out of range.
        Refused = 1,
        /// No board that could do it is connected.
        NoBoard = 2,
    }
}

payload! {
    /// A request to the bridge.
    pub struct Ask: 8 bytes {
        /// What is asked.
        pub kind: Tag<AskKind>,
        /// The mode to set.
        pub mode: Tag<Mode>,
        /// Gain on the error, in the firmware's unit.
        pub gain_p: u8,
        /// Gain on the change of the error, in the firmware's unit.
        pub gain_d: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
    }
}

payload! {
    /// The bridge's answer: the outcome and what is now in force.
    pub struct Answer: 8 bytes {
        /// What became of the request.
        pub outcome: Tag<Outcome>,
        /// The mode in force.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Gain in force, 0 = not known.
        pub gain_p: u8,
        /// Gain in force, 0 = not known.
        pub gain_d: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}
