//! What a robot that speaks the extension shows of itself, and what it answers.

use std::time::Duration;

use lager_lines::extension::{
    Block, Edge, Event, Latency, Listed, Queued, Report, State, Thinks, TruePose,
};
use lager_lines::{Coord, ProductId, Text};
use lager_wire::LineReading;

/// A value that a robot has told, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen<T> {
    /// What was told.
    pub value: T,
    /// When, by the station's clock.
    pub at: Duration,
}

impl<T> Seen<T> {
    /// How long ago it was told.
    pub fn age(&self, now: Duration) -> Duration {
        now.saturating_sub(self.at)
    }
}

/// The last of each kind that a robot has shown. It stays when the robot has gone, and grows old.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// What it is doing, twenty times a second.
    pub state: Option<Seen<State>>,
    /// Where a simulated one really is.
    pub truth: Option<Seen<TruePose>>,
    /// The nodes of its way. Of this and what follows only changes are told.
    pub route: Option<Seen<Listed<Coord>>>,
    /// The ways that it does not take.
    pub blocked: Option<Seen<Listed<Block>>>,
    /// What it fetches next by itself, after what it is on.
    pub queue: Option<Seen<Listed<Queued>>>,
    /// What stands on ways of its simulated world.
    pub obstacles: Option<Seen<Listed<Edge>>>,
    /// The products whose goods are not in their place.
    pub gone: Option<Seen<Listed<ProductId>>>,
    /// How long it takes to react, about once a second.
    pub latency: Option<Seen<Box<Latency>>>,
    /// What each line sensor has read in the last calibration, the leftmost first.
    pub sensors: Option<Seen<[LineReading; 11]>>,
}

/// What has become of an action or of a stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// It is done.
    Done,
    /// The steering board shows both motors off under the stop.
    Stopped {
        /// How long that took from its receipt, in ms.
        after_ms: u32,
    },
    /// It is not done.
    Refused(Text),
    /// Nobody knows: the connection has ended, or the robot does not answer.
    Lost,
}

/// What a robot has just said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Told {
    /// Something has happened on a mission.
    Event(Event),
    /// The thought that comes next, in values.
    Thinks(Box<Thinks>),
    /// It has thought something.
    Thought(Text),
    /// One of these, so long before it was told.
    Past {
        /// How long, by the robot's clock.
        ago: Duration,
        /// What.
        told: Box<Told>,
    },
    /// Somebody here has asked something of it, which is under way.
    Asked {
        /// Who, as the station calls him.
        by: String,
        /// What: the words of an action, `stop`, `take` or `free`.
        what: String,
    },
    /// It has answered the action or the stop with this number.
    Replied {
        /// The number.
        number: u32,
        /// What has become of it.
        reply: Reply,
    },
}

impl Shown {
    /// Takes what a robot has told at this moment; what only passes by is handed back.
    pub(crate) fn take(&mut self, report: Report, at: Duration) -> Option<Told> {
        let replied = |number, reply| Some(Told::Replied { number, reply });
        match report {
            Report::State(state) => self.state = Some(Seen { value: *state, at }),
            Report::Truth(value) => self.truth = Some(Seen { value, at }),
            Report::Route(value) => self.route = Some(Seen { value, at }),
            Report::Blocked(value) => self.blocked = Some(Seen { value, at }),
            Report::Queue(value) => self.queue = Some(Seen { value, at }),
            Report::Gone(value) => self.gone = Some(Seen { value, at }),
            Report::Latency(value) => self.latency = Some(Seen { value, at }),
            Report::Sensors(value) => self.sensors = Some(Seen { value, at }),
            Report::Obstacles(value) => self.obstacles = Some(Seen { value, at }),
            Report::Past { ago_ms, report } => {
                let ago = Duration::from_millis(ago_ms);
                let told = Box::new(self.take(*report, at)?);
                return Some(Told::Past { ago, told });
            }
            Report::Event(event) => return Some(Told::Event(event)),
            Report::Thinks(thinks) => return Some(Told::Thinks(thinks)),
            Report::Done { number } => return replied(number, Reply::Done),
            Report::Refused { number, reason } => return replied(number, Reply::Refused(reason)),
            Report::Stopped { number, after_ms } => {
                return replied(number, Reply::Stopped { after_ms });
            }
        }
        None
    }
}
