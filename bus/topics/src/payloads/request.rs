//! What the bridge can be asked for: `bridge/request`.

use core::fmt;

use super::link::Mode;
use super::nav::Heading;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// What is asked.
    pub enum AskKind {
        /// Change the mode to `mode`.
        SetMode = 0,
        /// Release the stop `stop_word`.
        Resume = 1,
        /// Set the gains of the line control to `gain_p` and `gain_d`.
        SetGains = 2,
        /// Calibrate the line sensors on the tape under the robot.
        Calibrate = 3,
        /// Restart both boards.
        ResetBoards = 4,
        /// Let logic drive from the start: done, without effect, if somebody has set the mode since
        /// the robot was switched on.
        Begin = 5,
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
        /// It came when its time was over; nothing was done.
        Late = 3,
        /// Not while the robot drives by itself.
        UnderWay = 4,
    }
}

impl fmt::Display for Outcome {
    /// As a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Done => "it is done",
            Self::Refused => {
                "it is refused: the value is out of range, or the board is an original one without \
                 settings"
            }
            Self::NoBoard => {
                "the board that would have to do it is not connected; `lager topic echo \
                 link/health` shows the links"
            }
            Self::UnderWay => {
                "the robot is on its way by itself; stop it or drive it by hand before that"
            }
            Self::Late => {
                "it was found when its time was over, since somebody was held up; nothing was \
                 changed, try again"
            }
        })
    }
}

payload! {
    /// A request to the bridge.
    pub struct Ask: 24 bytes {
        /// When it was asked, in ns of `CLOCK_MONOTONIC`.
        pub issued_ns: u64,
        /// For how long it may be answered, in ms: as long as its asker waits.
        pub lifetime_ms: u32,
        /// What is asked.
        pub kind: Tag<AskKind>,
        /// The mode to set.
        pub mode: Tag<Mode>,
        /// Gain on the error, in the firmware's unit.
        pub gain_p: u8,
        /// Gain on the change of the error, in the firmware's unit.
        pub gain_d: u8,
        /// The stop to release, by its word; 0 = none is known. No other one is released.
        pub stop_word: u64,
    }
}

impl Ask {
    /// Whether its time is over at `now_ns`: its asker has given up, or never said when he asked.
    pub fn is_over(&self, now_ns: u64) -> bool {
        is_over(self.issued_ns, self.lifetime_ms, now_ns)
    }
}

fn is_over(issued_ns: u64, lifetime_ms: u32, now_ns: u64) -> bool {
    let lifetime_ns = u64::from(lifetime_ms) * 1_000_000;
    // What was asked in the future was not asked by this machine's clock.
    issued_ns.abs_diff(now_ns) >= lifetime_ns
}

coded! {
    /// What is done to the simulated world.
    pub enum WorldAskKind {
        /// The robot is taken up and put on a node, at rest.
        Place = 0,
        /// A thing is put on the edge that leaves the node towards `heading`.
        Put = 1,
        /// The thing on that edge is taken away.
        Take = 2,
    }
}

coded! {
    /// Why hands leave the simulated world as it is.
    pub enum WorldRefusal {
        /// They do not: it was done.
        None = 0,
        /// The warehouse has no such node or edge.
        NoPlace = 1,
        /// The robot is where a thing was to be put.
        RobotThere = 2,
        /// Nothing stands where a thing was to be taken from.
        NothingThere = 3,
        /// As many things stand as there is room for.
        Full = 4,
        /// The ways are too short for a robot to turn beside a thing.
        NoRoom = 5,
    }
}

impl fmt::Display for WorldRefusal {
    /// As a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::None => "nothing is refused",
            Self::NoPlace => "the warehouse has no such crossing or way",
            Self::RobotThere => {
                "the robot is there; wait until it has gone on, or `lager stop` it elsewhere"
            }
            Self::NothingThere => "nothing stands there; `lager obstacle` lists what stands",
            Self::Full => "no more things fit into the warehouse; `lager obstacle take` one first",
            Self::NoRoom => "the ways are so short that the robot could not turn beside a thing",
        })
    }
}

payload! {
    /// A request to whoever simulates the world: what a person would do with his hands.
    pub struct WorldAsk: 16 bytes {
        /// When it was asked, in ns of `CLOCK_MONOTONIC`.
        pub issued_ns: u64,
        /// For how long it may be answered, in ms: as long as its asker waits.
        pub lifetime_ms: u32,
        /// What is to be done.
        pub kind: Tag<WorldAskKind>,
        /// Column of the node.
        pub x: u8,
        /// Row of the node.
        pub y: u8,
        /// Where the robot is to look, or which of the node's edges is meant.
        pub heading: Tag<Heading>,
    }
}

impl WorldAsk {
    /// Whether its time is over at `now_ns`, as with [`Ask::is_over`].
    pub fn is_over(&self, now_ns: u64) -> bool {
        is_over(self.issued_ns, self.lifetime_ms, now_ns)
    }
}

payload! {
    /// What became of a request to the simulated world.
    pub struct WorldAnswer: 8 bytes {
        /// What became of it.
        pub outcome: Tag<Outcome>,
        /// Why it was refused.
        pub refusal: Tag<WorldRefusal>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 6],
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
