//! [`Ask`] and [`WorldAsk`]: requests to the bridge and to the simulated world, and their answers.

use lager_floor::Heading;

use core::fmt;
use core::time::Duration;

use lager_orders::{Levels, Mode, Reason};
use lager_sample::{Tag, coded, payload};
use lager_wire::{Callsign, Profile, RobotProfile};

use super::said;

/// More values than describe a part of a robot.
const MOST_VALUES: usize = 40;

coded! {
    /// What the client asks for.
    pub enum AskKind {
        /// Change the mode to `mode`.
        SetMode = 0,
        /// Release the stop `stop_word`.
        Resume = 1,
        /// Set the gains of the line control to `gain_p` and `gain_d`.
        SetGains = 2,
        /// Calibrate the line sensors on the tape under the robot.
        Calibrate = 3,
        /// Let logic drive from the start. Answered `Done`, but without effect, if somebody has set
        /// the mode since the robot was switched on.
        Begin = 4,
        /// Tell a board how `part` of the robot is built, to try it: for `trial_ms` or, with 0, until
        /// this bridge ends, and its successor tells what is configured. Answered when the board has
        /// taken `values` or not. The same request again prolongs a trial; when its time is over, the
        /// board is told what it was told before.
        Describe = 5,
        /// Restart `board`, while the robot stands. "Done" means that it was told to; `link/health`
        /// shows when it is up again.
        Restart = 6,
        /// Tell what the lines of the robot's own buttons show, and let these do nothing for
        /// `trial_ms`. The same request again prolongs that. Refused while the robot is autonomous.
        Listen = 7,
        /// Let the sensor board have the thresholds from before its last calibration.
        Uncalibrate = 8,
    }
}

coded! {
    /// What is known of the lines at which buttons may be.
    pub enum ButtonLines {
        /// Nobody has looked at them yet.
        Unread = 0,
        /// The answer says what they show.
        Read = 1,
        /// The robot's machine has no such lines, or they cannot be read.
        Absent = 2,
    }
}

coded! {
    /// A part of the robot's description, which one board is told as a whole.
    pub enum Part {
        /// Motors, wheels and battery: the steering board's.
        Steering = 0,
        /// Line sensors and IR ranger: the sensor board's.
        Sensors = 1,
        /// The arm: the steering board's.
        Arm = 2,
    }
}

impl Part {
    /// All parts. Of one board's, the one that it hears first comes first.
    pub const ALL: [Self; 3] = [Self::Steering, Self::Sensors, Self::Arm];

    /// The board that is told.
    pub const fn board(self) -> Callsign {
        match self {
            Self::Steering | Self::Arm => Callsign::Steering,
            Self::Sensors => Callsign::Sensor,
        }
    }

    /// The sections of the configuration that say it.
    pub const fn sections(self) -> &'static str {
        match self {
            Self::Steering => "[wheels] and [battery]",
            Self::Sensors => "[line] and [distance]",
            Self::Arm => "[arm]",
        }
    }
}

coded! {
    /// The result of a request.
    pub enum Outcome {
        /// The change is in force.
        Done = 0,
        /// The request is not allowed now, or a value is out of range.
        Refused = 1,
        /// No connected board can do it.
        NoBoard = 2,
        /// The bridge read it too late and did nothing.
        Late = 3,
        /// Not possible while the robot drives by itself.
        UnderWay = 4,
    }
}

impl From<Outcome> for Reason {
    fn from(outcome: Outcome) -> Self {
        said::reason("outcome", Tag::from(outcome))
    }
}

impl fmt::Display for Outcome {
    /// Writes a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

payload! {
    /// A request to the bridge.
    pub struct Ask: 112 bytes {
        /// When the client asked, in ns of `CLOCK_MONOTONIC`.
        pub issued_ns: u64,
        /// How long after that it may be answered, in ms: as long as the client waits.
        pub lifetime_ms: u32,
        /// What the client asks for.
        pub kind: Tag<AskKind>,
        /// The mode to set.
        pub mode: Tag<Mode>,
        /// Gain on the error, in the firmware's unit.
        pub gain_p: u8,
        /// Gain on the change of the error, in the firmware's unit.
        pub gain_d: u8,
        /// The word of the stop to release; 0 = unknown. The bridge releases no other stop.
        pub stop_word: u64,
        /// The part of the robot that is described.
        pub part: Tag<Part>,
        /// How many values describe it.
        pub described: u8,
        /// What the board is told of it, value by value; the rest is 0.
        #[serde(with = "lager_sample::list")]
        pub values: [u16; MOST_VALUES] = [0; MOST_VALUES],
        /// For how long a description is tried, in ms of robot time; 0 = until the bridge ends.
        pub trial_ms: u16,
        /// The board to restart.
        pub board: Tag<Callsign>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}

impl Ask {
    /// How long a description is tried unless the request comes again, in robot time. Whoever tries
    /// it may have died.
    pub const TRIAL: Duration = Duration::from_secs(5);

    /// The request to try how a part of `robot` is built, for [`Ask::TRIAL`].
    pub fn try_out(part: Part, robot: &RobotProfile) -> Self {
        Self {
            trial_ms: Self::TRIAL.as_millis() as u16,
            ..Self::describe(part, robot)
        }
    }

    /// The request to tell what the buttons' lines show, and to let the buttons do nothing for
    /// [`Ask::TRIAL`].
    pub fn listen() -> Self {
        Self {
            kind: AskKind::Listen.into(),
            trial_ms: Self::TRIAL.as_millis() as u16,
            ..Self::default()
        }
    }

    /// The request to tell how a part of `robot` is built, until the bridge ends.
    pub fn describe(part: Part, robot: &RobotProfile) -> Self {
        let mut ask = Self {
            kind: AskKind::Describe.into(),
            part: part.into(),
            ..Self::default()
        };
        match part {
            Part::Steering => ask.tell(&robot.steering),
            Part::Sensors => ask.tell(&robot.sensors),
            Part::Arm => ask.tell(&robot.arm),
        }
        ask
    }

    fn tell(&mut self, profile: &impl Profile) {
        for (value, told) in self.values.iter_mut().zip(profile.told().as_ref()) {
            *value = *told;
            self.described += 1;
        }
    }

    /// The profile that it describes; `None` if no board could obey it.
    pub fn told<P: Profile>(&self) -> Option<P> {
        let values = self.values.get(..self.described.into())?;
        P::obeyed(&P::Values::try_from(values).ok()?)
    }

    /// Whether its time is over at `now_ns`: its client has given up, or did not say when it asked.
    pub fn is_over(&self, now_ns: u64) -> bool {
        is_over(self.issued_ns, self.lifetime_ms, now_ns)
    }
}

fn is_over(issued_ns: u64, lifetime_ms: u32, now_ns: u64) -> bool {
    let lifetime_ns = u64::from(lifetime_ms) * 1_000_000;
    // A request from the future was not dated by this machine's clock.
    issued_ns.abs_diff(now_ns) >= lifetime_ns
}

coded! {
    /// What a person's hands do in the simulated world.
    pub enum WorldAskKind {
        /// Take the robot up and put it on a node, at rest.
        Place = 0,
        /// Put a thing on the edge that leaves the node towards `heading`.
        Put = 1,
        /// Take the thing on that edge away.
        Take = 2,
        /// Lift the robot off the floor and hold it, until it is put on a node.
        Lift = 3,
        /// Hold something wide `x` cm in front of the ranger, until the robot is put on a node.
        Hold = 4,
        /// Put the robot down `x` - 128 mm to the left of where it stands.
        Shift = 5,
        /// Bring the joint of the arm whose first servo is number `x` + 1 to position 4 * `y`, as far
        /// as it goes, and hold it until its servos do.
        Bring = 6,
        /// Hold a piece of goods between the jaws (`x` = 1), or take it away (`x` = 0).
        Fill = 7,
        /// Close (`y` = 1) or open (`y` = 0) the contact of the reset button (`x` = 0), or that of the
        /// mode switch or mode button (`x` = 1), where the robot has them.
        Press = 8,
    }
}

coded! {
    /// Why the simulated world did not carry a request out.
    pub enum WorldRefusal {
        /// The request was carried out.
        None = 0,
        /// The warehouse has no such node or edge.
        NoPlace = 1,
        /// The robot is where a thing was to be put.
        RobotThere = 2,
        /// Nothing stands there to be taken away.
        NothingThere = 3,
        /// There is no room for another thing.
        Full = 4,
        /// The ways are too short for a robot to turn beside a thing.
        NoRoom = 5,
    }
}

impl From<WorldRefusal> for Reason {
    fn from(refusal: WorldRefusal) -> Self {
        said::reason("world", Tag::from(refusal))
    }
}

impl fmt::Display for WorldRefusal {
    /// Writes a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

payload! {
    /// A request to the simulator or the emulator: what a person would do by hand.
    pub struct WorldAsk: 16 bytes {
        /// When the client asked, in ns of `CLOCK_MONOTONIC`.
        pub issued_ns: u64,
        /// How long after that it may be answered, in ms: as long as the client waits.
        pub lifetime_ms: u32,
        /// What the hands do.
        pub kind: Tag<WorldAskKind>,
        /// Column of the node, or a length.
        pub x: u8,
        /// Row of the node.
        pub y: u8,
        /// Where the robot must look, or which of the node's edges is meant.
        pub heading: Tag<Heading>,
    }
}

impl WorldAsk {
    /// Whether its time is over at `now_ns`, as in [`Ask::is_over`].
    pub fn is_over(&self, now_ns: u64) -> bool {
        is_over(self.issued_ns, self.lifetime_ms, now_ns)
    }
}

payload! {
    /// The result of a request to the simulated world.
    pub struct WorldAnswer: 8 bytes {
        /// The result.
        pub outcome: Tag<Outcome>,
        /// Why the request was refused.
        pub refusal: Tag<WorldRefusal>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 6],
    }
}

payload! {
    /// The bridge's answer: the result and what is now in force.
    pub struct BridgeAnswer: 16 bytes {
        /// The result of the request.
        pub outcome: Tag<Outcome>,
        /// The mode in force.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Gain in force, 0 = not known.
        pub gain_p: u8,
        /// Gain in force, 0 = not known.
        pub gain_d: u8,
        /// What is known of the buttons' lines.
        pub button_lines: Tag<ButtonLines>,
        /// The number of their chip.
        pub button_chip: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// A bit for each line that something pulls low.
        pub lines_low: u32,
        /// A bit for each line that something pulls high.
        pub lines_high: u32,
    }
}

impl BridgeAnswer {
    /// What the buttons' lines show.
    pub const fn levels(&self) -> Levels {
        Levels {
            low: self.lines_low,
            high: self.lines_high,
        }
    }
}
