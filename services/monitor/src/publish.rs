//! `topic pub`: publishes samples of any topic from JSON, which comes from the command line or from
//! standard input.
//!
//! **Nobody moves a robot with it by mistake.** To publish a topic of the table, the tool takes the
//! locks of the robot's name and of its bridge, as a player does. So it refuses while a robot of
//! that name is up, and no such robot can start meanwhile. If a robot is up, the tool needs
//! `--live`. Then it publishes only topics that several programs may write: orders and inputs,
//! which the arbiter and the navigator judge as they judge everybody's. It never publishes what
//! only one service writes, such as `sensor/line` or `nav/status`: readers would see two worlds,
//! and the service's successor would resume from the wrong one. Topics of other programs move no
//! robot. If such a program writes the topic as well, the tool needs `--live`, too.

use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use lager_home::{Lock, LockError};
use lager_ports::{AnyPublisher, Bus, IntrospectError, Peer, PortError, SendError};
use lager_sample::TopicEntry;
use lager_topics::{Role, TOPICS};
use serde_json::{Value, json};

use crate::measure::Limits;
use crate::{Count, Tools};

/// How long the tool waits for readers before its first sample and after its last one.
const MEET: Duration = Duration::from_millis(300);
/// How often the tool checks for its end, and sends the states to late readers.
const LOOK: Duration = Duration::from_millis(10);

/// Where payloads come from.
#[derive(Debug)]
pub enum Payloads {
    /// This payload, again and again.
    One(Value),
    /// Each payload that comes through here, or the sentence that says why no more come.
    Each(Receiver<Result<Value, String>>),
}

/// What to publish, and how.
#[derive(Debug)]
pub struct Publishing {
    /// The payloads.
    pub payloads: Payloads,
    /// How many a second. `None`: each as soon as it comes.
    pub rate: Option<f64>,
    /// When to end.
    pub limits: Limits,
    /// Whether to publish although a robot is up or another program writes the topic.
    pub live: bool,
}

/// Why the tool does not publish.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// There is no such topic.
    #[error(
        "nobody has a topic `{0}` open, and this build's table has none; start its reader first"
    )]
    Unknown(String),
    /// A robot is up, which may move by the topic.
    #[error("{topic} is not published beside a robot: {remedy}")]
    Up {
        /// The topic.
        topic: String,
        /// What to do instead.
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
    /// A payload does not fit the topic.
    #[error("payload {number} of {topic}: {error}")]
    Payload {
        /// The topic.
        topic: String,
        /// Which one, from 1.
        number: u64,
        /// What is wrong, and what would fit.
        error: serde_json::Error,
    },
    /// No more payloads can be read.
    #[error("payload {number}: {why}")]
    Input {
        /// Which one, from 1.
        number: u64,
        /// Why.
        why: String,
    },
    /// The state of the bus cannot be read.
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
    /// `topic pub`: publishes on `name` until the payloads, a limit or the shutdown end it. Returns
    /// how many samples it published.
    ///
    /// # Errors
    /// A robot is up or somebody else writes the topic, nobody knows the topic, or a payload does
    /// not fit it.
    pub fn publish(&mut self, name: &str, what: &Publishing) -> Result<(), PublishError> {
        let permit = || permit(self.place, name, what.live);
        let _locks = self.watchdog.over("looking at the topic", permit)?;
        let open = || self.place.any_publisher(name);
        let publisher = self.watchdog.over("opening the topic", open)?;
        let publisher = publisher.ok_or_else(|| PublishError::Unknown(name.to_owned()))?;
        // Refuse a wrong payload before the wait for readers.
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

    /// Waits for this time. Returns false if somebody ends the tool before.
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

    /// The next payload; `None` at the end, or when somebody ends the tool.
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

/// Takes the locks that the tool holds while it writes the topic, if it may write it.
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
            let robot = bus.unit();
            vec![
                bus.home().lock_name(robot).map_err(refused)?,
                bus.home().lock(robot, Role::Bridge).map_err(refused)?,
            ]
        }
        _ => Vec::new(),
    };
    let mut topics = bus.topics()?.into_iter();
    let topic = topics.find(|topic| topic.unit == *bus.unit() && topic.name == name);
    let writers = topic.map(|topic| topic.writers).unwrap_or_default();
    match writers.first() {
        Some(writer) if !live || has_one_writer => Err(PublishError::Written {
            topic: name.to_owned(),
            writer: described(writer),
        }),
        _ => Ok(locks),
    }
}

/// What a user can do although a robot is up.
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
    match &peer.part {
        Some(role) => format!("{role}, process {}", peer.pid),
        None => "a stranger".to_owned(),
    }
}
