//! The state that a robot tells by the extension, and the robot's answers.

use std::time::Duration;

use lager_floor::{Node, Place, ProductId};
use lager_lines::Text;
use lager_lines::extension::{
    Block, Event, Latency, Listed, Queued, Report, State, Thinks, TruePose,
};
use lager_orders::Reason;
use lager_wire::LineReading;

/// Something that a robot has told, and when.
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

/// The last state of each kind that a robot has told. When the robot has gone, it stays and grows
/// old.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// What it is doing, twenty times a second.
    pub state: Option<Seen<State>>,
    /// Where a simulated robot really is.
    pub truth: Option<Seen<TruePose>>,
    /// The nodes of its way. The robot tells this and the following only when they change.
    pub route: Option<Seen<Listed<Node>>>,
    /// The ways that it avoids.
    pub blocked: Option<Seen<Listed<Block>>>,
    /// The products that it fetches next by itself, after the present one.
    pub queue: Option<Seen<Listed<Queued>>>,
    /// The things that stand on ways of its simulated world.
    pub obstacles: Option<Seen<Listed<Place>>>,
    /// The products whose goods are not in their place.
    pub gone: Option<Seen<Listed<ProductId>>>,
    /// How long it takes to react, about once a second.
    pub latency: Option<Seen<Box<Latency>>>,
    /// What each line sensor read in the last calibration, the leftmost first.
    pub sensors: Option<Seen<[LineReading; 11]>>,
}

/// What became of an action or of a stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// The robot has done it.
    Done,
    /// The robot is stopped, and the steering board shows both motors off.
    Stopped {
        /// How long that took after the robot got the stop, in ms.
        after_ms: u32,
    },
    /// The robot has not done it.
    Refused(Reason),
    /// Nobody knows: the connection has ended, or the robot does not answer.
    Lost,
}

/// Something that a robot has just said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Saying {
    /// Something happened on a mission.
    Event(Event),
    /// The values of the thought that comes next.
    Thinks(Box<Thinks>),
    /// The reason of the thought that comes next.
    Because(Reason),
    /// A thought as a sentence.
    Thought(Text),
    /// One of these that happened earlier than the robot told it.
    Past {
        /// How much earlier, by the robot's clock.
        ago: Duration,
        /// What happened.
        told: Box<Saying>,
    },
    /// Somebody here has asked the robot for something, and waits for the answer.
    Asked {
        /// The name by which the station knows this person.
        by: String,
        /// The wish: the words of an action, `stop`, `take` or `free`.
        what: String,
    },
    /// The robot has answered the action or the stop with this number.
    Replied {
        /// The number.
        number: u32,
        /// The answer.
        reply: Reply,
    },
}

impl Shown {
    /// Keeps a state that the robot tells at this moment. Returns news, which nobody keeps here.
    pub(crate) fn take(&mut self, report: Report, at: Duration) -> Option<Saying> {
        let replied = |number, reply| Some(Saying::Replied { number, reply });
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
                return Some(Saying::Past { ago, told });
            }
            Report::Event(event) => return Some(Saying::Event(event)),
            Report::Thinks(thinks) => return Some(Saying::Thinks(thinks)),
            Report::Because(reason) => return Some(Saying::Because(reason)),
            Report::Done { number } => return replied(number, Reply::Done),
            Report::Refused { number, reason } => return replied(number, Reply::Refused(reason)),
            Report::Stopped { number, after_ms } => {
                return replied(number, Reply::Stopped { after_ms });
            }
        }
        None
    }
}
