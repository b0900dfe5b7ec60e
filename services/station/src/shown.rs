//! The state that a robot tells by the extension, and the robot's answers.

use std::time::Duration;

use lager_floor::{Node, Place, ProductId};
use lager_lines::Text;
use lager_lines::extension::{
    Block, Commissioning, Event, FoundOut, Health, KeptLine, Latency, Listed, Queued, Report,
    State, Thinks, TruePose,
};
use lager_orders::Reason;
use lager_wire::LineReading;

/// More lines than a description has.
const MOST_KEPT: usize = 1_000;

/// Something that a robot has told, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Dated<T> {
    /// What was told.
    pub value: T,
    /// When, by the station's clock.
    pub at: Duration,
}

impl<T> Dated<T> {
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
    pub state: Option<Dated<State>>,
    /// Where a simulated robot really is.
    pub truth: Option<Dated<TruePose>>,
    /// The nodes of its way. The robot tells this and the following only when they change.
    pub route: Option<Dated<Listed<Node>>>,
    /// The ways that it avoids.
    pub blocked: Option<Dated<Listed<Block>>>,
    /// The products that it fetches next by itself, after the present one.
    pub queue: Option<Dated<Listed<Queued>>>,
    /// The things that stand on ways of its simulated world.
    pub obstacles: Option<Dated<Listed<Place>>>,
    /// The products whose goods are not in their place.
    pub gone: Option<Dated<Listed<ProductId>>>,
    /// How long it takes to react, about once a second.
    pub latency: Option<Dated<Box<Latency>>>,
    /// What each line sensor read in the last calibration, the leftmost first.
    pub sensors: Option<Dated<[LineReading; 11]>>,
    /// How its machine, its services and its boards are, once a second.
    pub health: Option<Dated<Box<Health>>>,
    /// How far the commissioning is, or how the last one has ended.
    pub commission: Option<Dated<Box<Commissioning>>>,
    /// What the commissioning has found out.
    pub found: Option<Dated<FoundOut>>,
    /// The description that the commissioning has saved, as far as it was told.
    pub kept: Option<Dated<Vec<KeptLine>>>,
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
        /// The wish: the words of an action, `stop`, `take`, `ask`, `keep`, `free` or `warehouse`.
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

impl Saying {
    /// As a line: one of the extension, `thought <text>`, or `asked <name> <what>`. `None` for what
    /// is not news by itself.
    pub fn line(&self) -> Option<String> {
        Some(match self {
            Self::Event(event) => Report::Event(event.clone()).to_string(),
            Self::Thinks(thinks) => Report::Thinks(thinks.clone()).to_string(),
            Self::Because(reason) => Report::Because(reason.clone()).to_string(),
            Self::Thought(text) => format!("thought {text}"),
            Self::Asked { by, what } => format!("asked {by} {what}"),
            Self::Replied { .. } | Self::Past { .. } => return None,
        })
    }

    /// Reads such a line.
    pub(crate) fn read(line: &str) -> Option<Self> {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "thought" => Some(Self::Thought(Text::new(rest).ok()?)),
            "asked" => {
                let (by, what) = rest.split_once(' ')?;
                let (by, what) = (by.to_owned(), what.to_owned());
                Some(Self::Asked { by, what })
            }
            _ => match Report::read(line)?.ok()? {
                Report::Event(event) => Some(Self::Event(event)),
                Report::Thinks(thinks) => Some(Self::Thinks(thinks)),
                Report::Because(reason) => Some(Self::Because(reason)),
                _ => None,
            },
        }
    }
}

/// What somebody has been told of a robot's [`Shown`], as the times of the last reports.
#[derive(Clone, Debug, Default)]
pub struct LastTold {
    at: [Option<Duration>; 13],
}

impl LastTold {
    /// The reports that are new since the last call, with their times by the station's clock.
    pub fn newer(&mut self, shown: &Shown) -> Vec<(Duration, Report)> {
        let mut newer = Vec::new();
        let mut last = self.at.iter_mut();
        let mut tell = |at: Option<Duration>, report: &dyn Fn() -> Option<Report>| {
            if let (Some(last), Some(at)) = (last.next(), at)
                && last.replace(at) != Some(at)
            {
                newer.extend(report().map(|report| (at, report)));
            }
        };
        macro_rules! tell {
            ($($field:ident => $report:expr),* $(,)?) => { $(
                let seen = shown.$field.as_ref();
                tell(seen.map(|seen| seen.at), &|| seen.map(|seen| $report(seen.value.clone())));
            )* };
        }
        tell! {
            state => |state| Report::State(Box::new(state)),
            truth => Report::Truth,
            route => Report::Route,
            blocked => Report::Blocked,
            queue => Report::Queue,
            latency => Report::Latency,
            sensors => Report::Sensors,
            obstacles => Report::Obstacles,
            gone => Report::Gone,
            health => Report::Health,
            commission => Report::Commission,
            found => Report::Found,
        }
        if let (Some(last), Some(kept)) = (last.next(), &shown.kept)
            && last.replace(kept.at) != Some(kept.at)
        {
            let lines = kept.value.iter().cloned();
            newer.extend(lines.map(|line| (kept.at, Report::Kept(line))));
        }
        newer
    }
}

impl Shown {
    /// Keeps a state that the robot tells at this moment. Returns news, which nobody keeps here.
    pub(crate) fn take(&mut self, report: Report, at: Duration) -> Option<Saying> {
        let replied = |number, reply| Some(Saying::Replied { number, reply });
        match report {
            Report::State(state) => self.state = Some(Dated { value: *state, at }),
            Report::Truth(value) => self.truth = Some(Dated { value, at }),
            Report::Route(value) => self.route = Some(Dated { value, at }),
            Report::Blocked(value) => self.blocked = Some(Dated { value, at }),
            Report::Queue(value) => self.queue = Some(Dated { value, at }),
            Report::Gone(value) => self.gone = Some(Dated { value, at }),
            Report::Latency(value) => self.latency = Some(Dated { value, at }),
            Report::Sensors(value) => self.sensors = Some(Dated { value, at }),
            Report::Health(value) => self.health = Some(Dated { value, at }),
            Report::Obstacles(value) => self.obstacles = Some(Dated { value, at }),
            Report::Commission(value) => self.commission = Some(Dated { value, at }),
            Report::Found(value) => self.found = Some(Dated { value, at }),
            Report::Kept(line) => {
                let before = self.kept.take().map(|kept| kept.value);
                let mut value = before.filter(|_| line.number > 1).unwrap_or_default();
                if value.len() < MOST_KEPT {
                    value.push(line);
                }
                self.kept = Some(Dated { value, at });
            }
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
