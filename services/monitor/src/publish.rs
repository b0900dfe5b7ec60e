//! `topic pub`: samples of any topic from JSON, on the command line or from standard input.
//!
//! **What moves a robot is not published beside it by mistake.** A topic of the table is published
//! under the locks of the robot's name and of its bridge, as a player does, so while a robot of
//! that name is up it is refused, and none can start. Beside a robot that is up, only `--live`
//! publishes, and only what the table lets several write (orders and inputs, which the arbiter and
//! the navigator judge like anybody's). What one service alone writes, such as `sensor/line` or
//! `nav/status`, is never published beside a robot: readers would see two worlds, and a successor
//! would resume from the wrong one. Other people's topics move no robot of ours; one that somebody
//! else writes takes `--live` as well.

use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use lager_ports::{
    AnyPublisher, Bus, IntrospectError, Lock, LockError, Peer, PortError, SendError,
};
use lager_topics::{Role, TOPICS, TopicEntry};
use serde_json::{Value, json};

use crate::measure::Limits;
use crate::{Count, Tools};

/// How long readers get to find the writer before its first sample, and to take the last one.
const MEET: Duration = Duration::from_millis(300);
/// How often the wish to end is looked at, and late readers get the states.
const LOOK: Duration = Duration::from_millis(10);

/// Where payloads come from.
#[derive(Debug)]
pub enum Payloads {
    /// This one, again and again.
    One(Value),
    /// Each that somebody hands over, or the sentence that says why there are no more.
    Each(Receiver<Result<Value, String>>),
}

/// What is published and how.
#[derive(Debug)]
pub struct Publishing {
    /// The payloads.
    pub payloads: Payloads,
    /// How many a second; `None`: as soon as they come.
    pub rate: Option<f64>,
    /// When to end.
    pub limits: Limits,
    /// Whether to publish beside a robot or another writer.
    pub live: bool,
}

/// Why something is not published.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// There is no such topic.
    #[error(
        "nobody has a topic `{0}` open, and this build's table has none; start whoever reads it first"
    )]
    Unknown(String),
    /// A robot is up that the topic may move.
    #[error("{topic} is not published beside a robot: {remedy}")]
    Up {
        /// The topic.
        topic: String,
        /// What would do.
        remedy: String,
        /// Which robot.
        #[source]
        lock: LockError,
    },
    /// Somebody else writes it.
    #[error("{topic} is written by {writer}; --live publishes beside it")]
    Written {
        /// The topic.
        topic: String,
        /// Who.
        writer: String,
    },
    /// A payload does not fit.
    #[error("payload {number} of {topic}: {error}")]
    Payload {
        /// The topic.
        topic: String,
        /// Which one, from 1.
        number: u64,
        /// What is wrong, and what it may be.
        error: serde_json::Error,
    },
    /// No more can be read.
    #[error("payload {number}: {why}")]
    Input {
        /// Which one, from 1.
        number: u64,
        /// Why.
        why: String,
    },
    /// The bus cannot be looked at.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// The topic cannot be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// A sample cannot be sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// The output could not be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] std::io::Error),
}

impl<W: Write> Tools<'_, W> {
    /// `topic pub`: publishes on `name` until there is no more, a limit or the shutdown, and says
    /// how much that was.
    ///
    /// # Errors
    /// A robot is up or somebody else writes the topic, nobody knows it, or a payload does not fit
    /// it.
    pub fn publish(&mut self, name: &str, what: &Publishing) -> Result<(), PublishError> {
        let permit = || permit(self.bus, name, what.live);
        let _locks = self.watchdog.over("looking at the topic", permit)?;
        let open = || self.bus.any_publisher(name);
        let publisher = self.watchdog.over("opening the topic", open)?;
        let publisher = publisher.ok_or_else(|| PublishError::Unknown(name.to_owned()))?;
        // What does not fit is refused before anybody waits.
        let one = match &what.payloads {
            Payloads::One(value) => Some(made(&publisher, value, 1)?),
            Payloads::Each(_) => None,
        };
        let mut sent = 0;
        if self.rest(&publisher, MEET) {
            let began = Instant::now();
            while !what.limits.are_reached(began, sent) && !self.shutdown.is_requested() {
                if let Some(rate) = what.rate {
                    let due = began + Duration::from_secs_f64(sent as f64 / rate);
                    let left = due.saturating_duration_since(Instant::now());
                    let end = what.limits.duration.map(|duration| began + duration);
                    let ends_first = end.is_some_and(|end| end < due);
                    if ends_first || !self.rest(&publisher, left) {
                        break;
                    }
                }
                let payload = match (&one, &what.payloads) {
                    (Some(one), _) => one.clone(),
                    (None, Payloads::Each(from)) => {
                        let ends = || what.limits.are_reached(began, sent);
                        match self.next(&publisher, from, ends) {
                            Some(Ok(value)) => made(&publisher, &value, sent + 1)?,
                            Some(Err(why)) => {
                                let number = sent + 1;
                                return Err(PublishError::Input { number, why });
                            }
                            None => break,
                        }
                    }
                    (None, Payloads::One(_)) => unreachable!("it was made"),
                };
                let send = || publisher.send(&payload);
                self.watchdog.over("publishing a sample", send)?;
                sent += 1;
            }
            self.rest(&publisher, MEET);
        }
        if self.as_json {
            writeln!(self.out, "{}", json!({"topic": name, "samples": sent}))?;
        } else {
            let samples = Count(usize::try_from(sent).unwrap_or(usize::MAX), "sample");
            writeln!(self.out, "{samples} published on {name}")?;
        }
        Ok(())
    }

    /// Whether so long has passed before the wish to end.
    fn rest(&self, publisher: &AnyPublisher, long: Duration) -> bool {
        let end = Instant::now() + long;
        loop {
            if self.shutdown.is_requested() {
                return false;
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return true;
            }
            if left > LOOK {
                publisher.tick();
            }
            std::thread::sleep(left.min(LOOK));
        }
    }

    /// What is handed over next; `None` at the end, or when the end is wished for.
    fn next(
        &self,
        publisher: &AnyPublisher,
        from: &Receiver<Result<Value, String>>,
        ends: impl Fn() -> bool,
    ) -> Option<Result<Value, String>> {
        while !self.shutdown.is_requested() && !ends() {
            match from.recv_timeout(LOOK) {
                Ok(value) => return Some(value),
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) => publisher.tick(),
            }
        }
        None
    }
}

/// The bytes of a payload.
fn made(publisher: &AnyPublisher, value: &Value, number: u64) -> Result<Vec<u8>, PublishError> {
    let mut payload = publisher.blank().to_vec();
    let filled = publisher.description().fill(value, &mut payload);
    filled.map_err(|error| PublishError::Payload {
        topic: publisher.name().to_owned(),
        number,
        error,
    })?;
    Ok(payload)
}

/// What is held while the topic is written, if it may be.
fn permit(bus: &Bus, name: &str, live: bool) -> Result<Vec<Lock>, PublishError> {
    bus.sweep();
    let entry = TOPICS.iter().find(|entry| entry.name == name);
    let has_one_writer = entry.is_some_and(|entry| entry.qos.publishers == 1);
    let locks = match entry {
        Some(entry) if !live || has_one_writer => {
            let refused = |lock| PublishError::Up {
                topic: name.to_owned(),
                remedy: remedy(entry),
                lock,
            };
            let robot = bus.robot();
            vec![
                bus.place().lock_name(robot).map_err(refused)?,
                bus.place().lock(robot, Role::Bridge).map_err(refused)?,
            ]
        }
        _ => Vec::new(),
    };
    let mut topics = bus.topics()?.into_iter();
    let topic = topics.find(|topic| topic.robot == *bus.robot() && topic.name == name);
    let writers = topic.map(|topic| topic.writers).unwrap_or_default();
    match writers.first() {
        Some(writer) if !live || has_one_writer => Err(PublishError::Written {
            topic: name.to_owned(),
            writer: described(writer),
        }),
        _ => Ok(locks),
    }
}

/// How one gets what one wants although a robot is up.
fn remedy(entry: &TopicEntry) -> String {
    if entry.qos.publishers == 1 {
        return "one service alone writes it; publish it under another name with --name".to_owned();
    }
    let actors: Vec<String> = entry.qos.actors.iter().map(ToString::to_string).collect();
    match actors.is_empty() {
        true => "--live does it all the same".to_owned(),
        false => format!(
            "{} would act on it, and the robot may move; --live does it all the same",
            actors.join(" and ")
        ),
    }
}

fn described(peer: &Peer) -> String {
    match peer.role {
        Some(role) => format!("{role}, process {}", peer.pid),
        None => "a stranger".to_owned(),
    }
}
