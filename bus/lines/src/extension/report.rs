//! Robot to station: what became of orders, and what goes on.

use core::fmt;

use lager_floor::{Node, Place, ProductId};
use lager_orders::{EventKind, Reason};
use lager_wire::LineReading;

use super::commission::{Commissioning, FoundOut, KeptLine};
use super::fields::{Degrees, number};
use super::health::Health;
use super::listed::{Block, Listed, Queued};
use super::state::State;
use super::thinks::Thinks;
use crate::floor::{Spelled as _, Words};
use crate::misread::Misread;
use crate::reader::Reader;
use crate::text::Text;

/// What a robot tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Report {
    /// The steering board reports both motors off under the stop. An original board reports
    /// nothing, so nobody says this for it.
    Stopped {
        /// The stop's number.
        number: u32,
        /// How long that took from its receipt, in ms.
        after_ms: u32,
    },
    /// The action is done.
    Done {
        /// Its number.
        number: u32,
    },
    /// The action is not done.
    Refused {
        /// Its number.
        number: u32,
        /// Why.
        reason: Reason,
    },
    /// What it is doing. Boxed: it is much larger than all others.
    State(Box<State>),
    /// The nodes of its way, the next one first.
    Route(Listed<Node>),
    /// Ways that it does not take.
    Blocked(Listed<Block>),
    /// What it fetches next, in this order.
    Queue(Listed<Queued>),
    /// What stands on ways of a simulated world.
    Obstacles(Listed<Place>),
    /// Products whose goods are not in their place: delivered, or not found there.
    Gone(Listed<ProductId>),
    /// Something has happened.
    Event(Event),
    /// Something has happened, or was thought, before this connection was there.
    Past {
        /// How long ago, in ms.
        ago_ms: u64,
        /// What: an [`Event`](Self::Event) or a thought's values.
        report: Box<Report>,
    },
    /// The thought that comes next, in values.
    Thinks(Box<Thinks>),
    /// Why it says the thought that comes next.
    Because(Reason),
    /// How long it takes to react.
    Latency(Box<Latency>),
    /// Where a simulated robot really is.
    Truth(TruePose),
    /// What each line sensor has read in the calibration that runs, the leftmost first.
    Sensors([LineReading; 11]),
    /// How its machine, its services and its boards are.
    Health(Box<Health>),
    /// How far the commissioning is.
    Commission(Box<Commissioning>),
    /// What the commissioning has found out.
    Found(FoundOut),
    /// A line of the description that it has saved.
    Kept(KeptLine),
}

/// What has happened on a mission (C8).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// What.
    pub kind: Happened,
    /// The node last passed; with `next_node` the one to which the robot goes.
    pub node: Node,
    /// The order it belongs to.
    pub order: Option<u32>,
    /// The product of that order.
    pub product: Option<ProductId>,
    /// The reason, where there is one; with `way_blocked` the direction of the way. With `stopped`
    /// the cause and who has set it, with `mode` the mode, with `ended` and `restarted` the service,
    /// with `asked` the part by which a person has asked, and the words of the action.
    pub text: Text,
}

/// A kind of event: on a mission, or of the robot itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Happened {
    /// Something on a mission.
    Mission(EventKind),
    /// A stop is in force.
    Stopped,
    /// It is not any more.
    Resumed,
    /// Somebody else may drive.
    Mode,
    /// A person has asked the robot for something, but not through the external computer.
    Asked,
    /// A service of the robot has ended although nobody asked it to.
    Ended,
    /// It has been started anew, and runs.
    Restarted,
    /// The external computer is out of reach.
    LinkLost,
    /// It is there again.
    LinkBack,
}

impl Happened {
    /// Every kind.
    pub fn all() -> impl Iterator<Item = Self> {
        let own = [
            Self::Stopped,
            Self::Resumed,
            Self::Mode,
            Self::Asked,
            Self::Ended,
            Self::Restarted,
            Self::LinkLost,
            Self::LinkBack,
        ];
        EventKind::ALL.into_iter().map(Self::Mission).chain(own)
    }

    /// The word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Mission(kind) => kind.as_str(),
            Self::Stopped => "stopped",
            Self::Resumed => "resumed",
            Self::Mode => "mode",
            Self::Asked => "asked",
            Self::Ended => "ended",
            Self::Restarted => "restarted",
            Self::LinkLost => "link_lost",
            Self::LinkBack => "link_back",
        }
    }

    fn from_word(word: &str) -> Option<Self> {
        Self::all().find(|kind| kind.as_str() == word)
    }
}

/// How long it takes from the reading of a sensor's frame until logic has decided, as a histogram
/// of the frames since such a report was made before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Latency {
    /// The longest, in us.
    pub max_us: u32,
    /// How many frames fell into each bucket, from 0 to [`MOST`](Self::MOST). The counts are not
    /// cumulative.
    pub buckets: [u32; Self::BUCKETS],
}

impl Latency {
    /// How many buckets there are.
    pub const BUCKETS: usize = 90;

    /// The most that a bucket counts. So all of them fit in a line, whatever they count.
    pub const MOST: u32 = 999_999;

    /// The longest time that counts in a bucket, in ns; `None` for the last bucket, which has no
    /// end. These are the buckets of the topic `latency/path`: the lines know no topics, so a test of
    /// comm compares each.
    pub const fn upper_ns(bucket: usize) -> Option<u64> {
        match bucket {
            0 => Some(256),
            1..89 => Some((5 + (bucket as u64 - 1) % 4) << (6 + (bucket - 1) / 4)),
            _ => None,
        }
    }
}

impl Default for Latency {
    fn default() -> Self {
        Self {
            max_us: 0,
            buckets: [0; Self::BUCKETS],
        }
    }
}

/// Where a simulated robot really is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TruePose {
    /// Middle of the axle, in mm to the right of node (0, 0).
    pub x_mm: i32,
    /// Middle of the axle, in mm up from node (0, 0).
    pub y_mm: i32,
    /// Where it looks.
    pub heading: Degrees,
    /// The product in its gripper.
    pub carrying: Option<ProductId>,
}

impl Report {
    /// Reads a line; `None` if its first word is another one.
    ///
    /// # Errors
    ///
    /// When something else stands behind the first word than belongs there.
    pub fn read(line: &str) -> Option<Result<Self, Misread>> {
        let mut reader = Reader::new(line);
        let read = match reader.word().text {
            "stopped" => read_stopped,
            "done" => |reader: &mut Reader<'_>| {
                let number = number(reader)?;
                Ok(Self::Done { number })
            },
            "refused" => |reader: &mut Reader<'_>| {
                Ok(Self::Refused {
                    number: number(reader)?,
                    reason: read_reason(reader)?,
                })
            },
            "state" => |reader: &mut Reader<'_>| Ok(Self::State(Box::new(State::read(reader)?))),
            "health" => |reader: &mut Reader<'_>| Ok(Self::Health(Box::new(Health::read(reader)?))),
            "thinks" => |reader: &mut Reader<'_>| Ok(Self::Thinks(Box::new(Thinks::read(reader)?))),
            "because" => |reader: &mut Reader<'_>| read_reason(reader).map(Self::Because),
            "route" => |reader: &mut Reader<'_>| Ok(Self::Route(Listed::<Node>::read(reader)?)),
            "blocked" => {
                |reader: &mut Reader<'_>| Ok(Self::Blocked(Listed::<Block>::read(reader)?))
            }
            "queue" => |reader: &mut Reader<'_>| Ok(Self::Queue(Listed::<Queued>::read(reader)?)),
            "obstacles" => {
                |reader: &mut Reader<'_>| Ok(Self::Obstacles(Listed::<Place>::read(reader)?))
            }
            "gone" => |reader: &mut Reader<'_>| Ok(Self::Gone(Listed::<ProductId>::read(reader)?)),
            "event" => |reader: &mut Reader<'_>| Event::read(reader).map(Self::Event),
            "past" => read_past,
            "latency" => {
                |reader: &mut Reader<'_>| Ok(Self::Latency(Box::new(Latency::read(reader)?)))
            }
            "truth" => |reader: &mut Reader<'_>| TruePose::read(reader).map(Self::Truth),
            "commission" => |reader: &mut Reader<'_>| {
                Ok(Self::Commission(Box::new(Commissioning::read(reader)?)))
            },
            "found" => |reader: &mut Reader<'_>| FoundOut::read(reader).map(Self::Found),
            "kept" => |reader: &mut Reader<'_>| KeptLine::read(reader).map(Self::Kept),
            "sensors" => |reader: &mut Reader<'_>| read_sensors(reader).map(Self::Sensors),
            _ => return None,
        };
        Some(read(&mut reader).and_then(|report| reader.end().map(|()| report)))
    }
}

fn read_reason(reader: &mut Reader<'_>) -> Result<Reason, Misread> {
    Ok(Reason::read(reader.rest_as_text()?.as_str()))
}

fn read_stopped(reader: &mut Reader<'_>) -> Result<Report, Misread> {
    let number = number(reader)?;
    let wanted = "a time from 0 to 4294967295 ms";
    let after_ms = reader.word().number(wanted, 0, i64::from(u32::MAX))?;
    Ok(Report::Stopped { number, after_ms })
}

fn read_past(reader: &mut Reader<'_>) -> Result<Report, Misread> {
    let wanted = "a time from 0 to 9223372036854775807 ms";
    let ago_ms = reader.word().number(wanted, 0, i64::MAX)?;
    let report = match reader.ahead().text {
        "event" => {
            reader.word();
            Event::read(reader).map(Report::Event)?
        }
        "thinks" => {
            reader.word();
            Report::Thinks(Box::new(Thinks::read(reader)?))
        }
        _ => return Err(reader.ahead().misread("event or thinks")),
    };
    let report = Box::new(report);
    Ok(Report::Past { ago_ms, report })
}

fn read_sensors(reader: &mut Reader<'_>) -> Result<[LineReading; 11], Misread> {
    let mut sensors = [LineReading::default(); 11];
    for (sensor, read) in (0..).zip(&mut sensors) {
        let mut next = || reader.word().number("a reading from 0 to 255", 0, 255);
        *read = LineReading {
            sensor,
            reading: next()?,
            lowest: next()?,
            highest: next()?,
            tells_apart: reader
                .word()
                .number("0 or 1", 0, 1)
                .map(|bit: u8| bit == 1)?,
        };
    }
    Ok(sensors)
}

/// What stands behind the next word, `None` for a `-`.
fn read_or_dash<T>(
    reader: &mut Reader<'_>,
    read: impl FnOnce(&mut Reader<'_>) -> Result<T, Misread>,
) -> Result<Option<T>, Misread> {
    if reader.ahead().text == "-" {
        reader.word();
        return Ok(None);
    }
    read(reader).map(Some)
}

impl Event {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "one of in_position, getting_item, item_delivered, next_node, refused, \
                      pickup_refused, failed, way_blocked, stopped, resumed, mode, asked, \
                      ended, restarted, link_lost and link_back";
        Ok(Self {
            kind: reader.word().read(wanted, Happened::from_word)?,
            node: Node::read(reader)?,
            order: read_or_dash(reader, number)?,
            product: read_or_dash(reader, ProductId::read)?,
            text: reader.rest_as_text()?,
        })
    }
}

impl Latency {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let time = "a time from 0 to 4294967295 us";
        let mut latency = Self {
            max_us: reader.word().number(time, 0, i64::from(u32::MAX))?,
            ..Self::default()
        };
        let mut least = 0;
        while !reader.ahead().text.is_empty() {
            let wanted = "a bucket from 0 to 89, above the one before it";
            let bucket: usize = reader.word().number(wanted, least, 89)?;
            let wanted = "how many frames it holds, 1 to 999999";
            latency.buckets[bucket] = reader.word().number(wanted, 1, i64::from(Self::MOST))?;
            least = bucket as i64 + 1;
        }
        Ok(latency)
    }
}

impl TruePose {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let mut way = || {
            let (least, most) = (i64::from(i32::MIN), i64::from(i32::MAX));
            reader.word().number("a way in mm", least, most)
        };
        Ok(Self {
            x_mm: way()?,
            y_mm: way()?,
            heading: reader.word().read(Degrees::WANTED, Degrees::of)?,
            carrying: read_or_dash(reader, ProductId::read)?,
        })
    }
}

/// What there is, or a `-`.
struct OrDash<T>(Option<T>);

impl<T: fmt::Display> fmt::Display for OrDash<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Some(value) => value.fmt(formatter),
            None => formatter.write_str("-"),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped { number, after_ms } => write!(formatter, "stopped {number} {after_ms}"),
            Self::Done { number } => write!(formatter, "done {number}"),
            Self::Refused { number, reason } => {
                write!(formatter, "refused {number} {}", reason.as_str())
            }
            Self::State(state) => write!(formatter, "state{state}"),
            Self::Route(nodes) => write!(formatter, "route {nodes}"),
            Self::Blocked(ways) => write!(formatter, "blocked {ways}"),
            Self::Queue(orders) => write!(formatter, "queue {orders}"),
            Self::Obstacles(ways) => write!(formatter, "obstacles {ways}"),
            Self::Gone(products) => write!(formatter, "gone {products}"),
            Self::Event(event) => write!(formatter, "event {event}"),
            Self::Past { ago_ms, report } => write!(formatter, "past {ago_ms} {report}"),
            Self::Thinks(thinks) => write!(formatter, "thinks{thinks}"),
            Self::Because(reason) => write!(formatter, "because {}", reason.as_str()),
            Self::Latency(latency) => write!(formatter, "latency {latency}"),
            Self::Health(health) => write!(formatter, "health{health}"),
            Self::Truth(truth) => write!(formatter, "truth {truth}"),
            Self::Commission(how) => write!(formatter, "commission{how}"),
            Self::Found(found) => write!(formatter, "found {found}"),
            Self::Kept(line) => write!(formatter, "kept {line}"),
            Self::Sensors(sensors) => {
                formatter.write_str("sensors")?;
                sensors.iter().try_for_each(|sensor| {
                    let LineReading {
                        reading,
                        lowest,
                        highest,
                        tells_apart,
                        ..
                    } = sensor;
                    let tells_apart = u8::from(*tells_apart);
                    write!(formatter, " {reading} {lowest} {highest} {tells_apart}")
                })
            }
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            kind,
            node,
            order,
            product,
            text,
        } = self;
        let (order, product) = (OrDash(*order), OrDash(*product));
        write!(
            formatter,
            "{} {} {order} {product}",
            kind.as_str(),
            Words(node)
        )?;
        if !text.as_str().is_empty() {
            write!(formatter, " {text}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.max_us)?;
        let counted = self.buckets.iter().enumerate();
        counted
            .filter(|(_, count)| **count > 0)
            .try_for_each(|(bucket, count)| write!(formatter, " {bucket} {count}"))
    }
}

impl fmt::Display for TruePose {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            x_mm,
            y_mm,
            heading,
            carrying,
        } = self;
        write!(formatter, "{x_mm} {y_mm} {heading} {}", OrDash(*carrying))
    }
}
