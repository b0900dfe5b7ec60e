//! The topic tools: list, info, echo and hz, for any topic of any robot, by name.
//!
//! They are observers: they poll, hold no listener and never slow the path. They know no topic
//! by itself; the table leads from a name to its static type. Each tool writes to a writer it is
//! given, as text or as one JSON value a line, and tells how many samples it lost.

mod rate;

use std::io::{self, Write};
use std::time::Duration;

use lager_ports::{Bus, IntrospectError, Layout, PortError, ReceiveError, Shutdown, Subscriber};
use lager_topics::{Stamp, TOPICS, Topic, TopicVisitor, UnknownTopic, by_id, visit};
use serde_json::{Value, json};

pub use rate::hz;

impl ToolError {
    /// Whether only the reader of the output has gone, as after `| head`.
    pub fn is_closed_output(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// The pace at which an observer polls.
const POLL: Duration = Duration::from_millis(5);

/// Why a tool could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum ToolError {
    /// No topic has that name.
    #[error(transparent)]
    Unknown(#[from] UnknownTopic),
    /// The bus could not be looked at.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// The topic could not be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// The topic could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The output could not be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
    /// A sample could not be put into JSON.
    #[error("cannot put a sample into JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// `topic list`: every topic that is open on the bus, of every robot.
pub fn list(bus: &Bus, as_json: bool, out: &mut impl Write) -> Result<(), ToolError> {
    let topics = bus.topics()?;
    if topics.is_empty() && !as_json {
        writeln!(
            out,
            "no topic is open on this bus; `lager up` starts a robot"
        )?;
    }
    for topic in topics {
        if as_json {
            let value = json!({
                "robot": topic.robot.as_str(), "topic": topic.name,
                "publishers": topic.publishers, "subscribers": topic.subscribers,
                "observers": topic.observers, "ours": topic.layout == Layout::Ours,
            });
            writeln!(out, "{value}")?;
            continue;
        }
        let name = format!("lager/{}/{}", topic.robot, topic.name);
        match topic.layout {
            Layout::Ours => writeln!(
                out,
                "{name:36} {:2} publishers {:2} subscribers, {} of them observers",
                topic.publishers, topic.subscribers, topic.observers
            )?,
            _ => writeln!(
                out,
                "{name:36} of another build: its layout is not this one's"
            )?,
        }
    }
    Ok(())
}

/// `topic info`: what one topic carries, its limits, and who is on it now.
pub fn info(bus: &Bus, name: &str, as_json: bool, out: &mut impl Write) -> Result<(), ToolError> {
    let entry = TOPICS
        .iter()
        .find(|entry| entry.name == name)
        .ok_or_else(|| UnknownTopic(name.to_owned()))?;
    let live = bus
        .topics_of(bus.robot())
        .into_iter()
        .find(|topic| topic.name == name);
    let (publishers, subscribers) = live
        .as_ref()
        .map_or((0, 0), |topic| (topic.publishers, topic.subscribers));
    let woken: Vec<u32> = live
        .iter()
        .flat_map(|topic| topic.woken.iter().map(|peer| peer.pid))
        .collect();
    let actors: Vec<String> = entry.qos.actors.iter().map(ToString::to_string).collect();
    if as_json {
        let fields: Vec<_> = entry
            .fields
            .iter()
            .map(|field| json!({"name": field.name, "type": field.type_name, "offset": field.offset}))
            .collect();
        let value = json!({
            "name": name, "summary": entry.summary, "type": entry.type_name,
            "hash": format!("{:016x}", entry.hash), "size": entry.size, "fields": fields,
            "buffer": entry.qos.buffer, "history": entry.qos.history, "actors": actors,
            "publishers": publishers, "subscribers": subscribers, "woken": woken,
        });
        writeln!(out, "{value}")?;
        return Ok(());
    }
    writeln!(out, "{name}: {}", entry.summary)?;
    writeln!(
        out,
        "  carries     {}, {} bytes, schema {:016x}",
        entry.type_name, entry.size, entry.hash
    )?;
    for field in entry.fields {
        writeln!(
            out,
            "    {:4}  {:24} {}",
            field.offset, field.name, field.type_name
        )?;
    }
    writeln!(
        out,
        "  keeps       {} samples for each subscriber, {}",
        entry.qos.buffer,
        match entry.qos.history {
            0 => "nothing for late joiners",
            _ => "the last one for late joiners",
        }
    )?;
    let awake = if actors.is_empty() {
        "nobody".to_owned()
    } else {
        actors.join(", ")
    };
    writeln!(out, "  wakes       {awake}")?;
    writeln!(
        out,
        "  has now     {publishers} publishers, {subscribers} subscribers"
    )?;
    let ends = live.iter().flat_map(|topic| {
        let writers = topic.writers.iter().map(|peer| ("written", peer));
        let readers = topic.readers.iter().map(|peer| ("read", peer));
        let woken = topic.woken.iter().map(|peer| ("woken", peer));
        writers.chain(readers).chain(woken)
    });
    for (done, peer) in ends {
        let role = peer
            .role
            .map_or("a stranger".into(), |role| role.to_string());
        let by = if done == "woken" { "is" } else { "by" };
        writeln!(out, "    {done:7} {by} {role}, process {}", peer.pid)?;
    }
    Ok(())
}

/// `topic echo`: each sample with its stamp, until `count` samples or the shutdown.
pub fn echo(
    bus: &Bus,
    name: &str,
    count: Option<u64>,
    as_json: bool,
    shutdown: &Shutdown,
    out: &mut impl Write,
) -> Result<(), ToolError> {
    visit(
        name,
        Echo {
            bus,
            count,
            as_json,
            shutdown,
            out,
        },
    )?
}

/// What a sample followed from, for people and programs; null = from no sample.
fn cause(stamp: &Stamp) -> Value {
    if stamp.cause_topic == 0 {
        return Value::Null;
    }
    json!({
        // A newer build may have topics that this one does not know.
        "topic": by_id(stamp.cause_topic).map(|entry| entry.name),
        "publish_time_ns": stamp.cause_publish_time_ns,
        "receive_time_ns": stamp.cause_receive_time_ns,
    })
}

struct Echo<'a, W> {
    bus: &'a Bus,
    count: Option<u64>,
    as_json: bool,
    shutdown: &'a Shutdown,
    out: &'a mut W,
}

impl<W: Write> TopicVisitor for Echo<'_, W> {
    type Output = Result<(), ToolError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let mut subscriber: Subscriber<T> = self.bus.subscriber()?;
        let (mut shown, mut lost) = (0, 0);
        while !self.shutdown.is_requested() && self.count.is_none_or(|count| shown < count) {
            let Some(sample) = subscriber.receive()? else {
                self.out.flush()?;
                std::thread::sleep(POLL);
                continue;
            };
            let stamp = *sample.stamp();
            let payload = serde_json::to_value(*sample)?;
            drop(sample);
            if self.as_json {
                let value = json!({
                    "topic": T::NAME, "sequence": stamp.sequence, "epoch": stamp.epoch,
                    "writer": stamp.writer, "source_time_ns": stamp.source_time_ns,
                    "publish_time_ns": stamp.publish_time_ns, "cause": cause(&stamp),
                    "lost": subscriber.lost(), "payload": payload,
                });
                writeln!(self.out, "{value}")?;
            } else {
                if subscriber.lost() > lost {
                    writeln!(self.out, "-- {} samples lost", subscriber.lost() - lost)?;
                }
                writeln!(self.out, "#{} {payload}", stamp.sequence)?;
            }
            lost = subscriber.lost();
            shown += 1;
        }
        self.out.flush()?;
        Ok(())
    }
}
