//! The listener's end: [`Remote`], a connection to a robot's gateway, and [`Listening`], one topic.
//!
//! ```text
//!   Zenoh's thread ──> queue ──> Listening::next ──> the caller
//!      samples, beats, the token        └─ Ledger
//! ```
//!
//! Zenoh's thread never waits for the caller: what does not fit into the queue is dropped, and the
//! ledger shows it as any other loss of the link. After a gateway was replaced, Zenoh connects again
//! by itself, and a state is asked for again.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use lager_home::UnitName;
use lager_ports::{Look, ReceiveError, Source};
use lager_sample::{Description, DescriptionError};
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, Reply};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::causes;
use crate::endpoint::Endpoint;
use crate::key::Keys;
use crate::ledger::{Account, Heard, Ledger};
use crate::note::{Note, layout_number};
use crate::session::{self, ZenohError};
use crate::settings::Proof;
use crate::told::{About, Beat, boot};

/// How many messages of a topic wait for the caller.
const QUEUE: usize = 4_096;
/// How long a gateway has for an answer.
const PATIENCE: Duration = Duration::from_secs(3);
/// The largest payload that is read, in bytes. The largest of the robot's table is far smaller.
const LARGEST: usize = 16 << 20;

/// Why nothing can be heard of a robot.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// TLS needs certificates.
    #[error(
        "{0} needs certificates; name authority, certificate and key of this listener in \
         [gateway.zenoh], as `lager keys` makes them"
    )]
    NoProof(Endpoint),
    /// A file of the certificates cannot be read.
    #[error("cannot read {file}: {error}; `lager keys` makes it")]
    Proof {
        /// Which.
        file: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// There is no connection.
    #[error(
        "no connection to {endpoint}: {cause}; `lager gateway --zenoh ENDPOINT` on the robot says \
         where it listens"
    )]
    Connect {
        /// Where.
        endpoint: Endpoint,
        /// Why, in Zenoh's words if it has told no more.
        cause: String,
    },
    /// The gateway is there and says nothing of this robot.
    #[error(
        "no gateway of the robot `{robot}` answers at {endpoint}: another robot is there, or its \
         certificate is not that of `{robot}`; --name chooses another robot"
    )]
    Silent {
        /// Which robot.
        robot: UnitName,
        /// Where.
        endpoint: Endpoint,
    },
    /// The gateway does not carry the topic.
    #[error("`{topic}` is not sent by the gateway of `{robot}`; it sends {}", .carried.join(", "))]
    NotCarried {
        /// Which.
        topic: String,
        /// Of which robot.
        robot: UnitName,
        /// What it carries.
        carried: Vec<String>,
    },
    /// The layout is none.
    #[error("`{topic}`: {error}")]
    Layout {
        /// Of which topic.
        topic: String,
        /// Why.
        error: DescriptionError,
    },
    /// A payload would be too large.
    #[error("`{topic}` has payloads of {bytes} bytes, more than {LARGEST}, and is not read")]
    TooLarge {
        /// Which.
        topic: String,
        /// How large.
        bytes: usize,
    },
    /// Zenoh cannot.
    #[error("Zenoh cannot: {0}")]
    Zenoh(#[from] ZenohError),
}

/// A connection to a robot's gateway.
#[derive(Debug)]
pub struct Remote {
    session: Session,
    keys: Keys,
    robot: UnitName,
    endpoint: Endpoint,
    /// Whether the robot is this machine, so that its stamps are of this machine's clock.
    is_here: AtomicBool,
}

impl Remote {
    /// Connects to the gateway of `robot` at `endpoint`.
    ///
    /// # Errors
    /// The certificates cannot be used, or there is no connection.
    pub fn open(
        endpoint: &Endpoint,
        robot: &UnitName,
        proof: Option<&Proof>,
    ) -> Result<Self, RemoteError> {
        if let Endpoint::Tls(_) = endpoint {
            let proof = proof.ok_or_else(|| RemoteError::NoProof(endpoint.clone()))?;
            for file in [&proof.authority, &proof.certificate, &proof.key] {
                fs::read(file).map_err(|error| RemoteError::Proof {
                    file: file.clone(),
                    error,
                })?;
            }
        }
        let config = session::of_listener(endpoint, robot, proof);
        causes::forget();
        let session = session::open(&config).map_err(|error| RemoteError::Connect {
            endpoint: endpoint.clone(),
            cause: causes::told().map_or_else(|| error.to_string(), str::to_owned),
        })?;
        Ok(Self {
            session,
            keys: Keys::of(robot),
            robot: robot.clone(),
            endpoint: endpoint.clone(),
            is_here: AtomicBool::new(false),
        })
    }

    /// Whether the stamps are of this machine's clock, as the robot is this machine. Known when the
    /// gateway has told its topics.
    pub fn has_this_clock(&self) -> bool {
        self.is_here.load(Ordering::Relaxed)
    }

    /// The part that a process plays on the robot, if it writes a topic that is carried.
    pub fn role_of(&self, pid: u32) -> Option<String> {
        let topics = self.topics().ok()?;
        topics
            .into_values()
            .find_map(|mut about| about.writers.remove(&pid))
    }

    /// The robot.
    pub fn robot(&self) -> &UnitName {
        &self.robot
    }

    /// Every topic that the gateway carries, with what it tells of it.
    ///
    /// # Errors
    /// No gateway of the robot answers.
    pub fn topics(&self) -> Result<BTreeMap<String, About>, RemoteError> {
        let replies = self
            .session
            .get(self.keys.layouts())
            .consolidation(ConsolidationMode::None)
            .timeout(PATIENCE)
            .wait()
            .map_err(ZenohError::of)?;
        let mut found = BTreeMap::new();
        for reply in replies {
            if let Ok(sample) = reply.result()
                && let Some(topic) = self.keys.layout_of(sample.key_expr())
                && let Ok(about) = serde_json::from_slice::<About>(&sample.payload().to_bytes())
            {
                self.is_here.store(about.boot == boot(), Ordering::Relaxed);
                found.insert(topic.to_owned(), about);
            }
        }
        match found.is_empty() {
            true => Err(RemoteError::Silent {
                robot: self.robot.clone(),
                endpoint: self.endpoint.clone(),
            }),
            false => Ok(found),
        }
    }

    /// Listens to a topic.
    ///
    /// # Errors
    /// The gateway does not carry it, or its layout cannot be read.
    pub fn listen(&self, topic: &str) -> Result<Listening, RemoteError> {
        let mut topics = self.topics()?;
        let (Some(about), Some(key)) = (topics.remove(topic), self.keys.topic(topic)) else {
            return Err(RemoteError::NotCarried {
                topic: topic.to_owned(),
                robot: self.robot.clone(),
                carried: topics.into_keys().collect(),
            });
        };
        let description =
            Description::parse(&about.layout).map_err(|error| RemoteError::Layout {
                topic: topic.to_owned(),
                error,
            })?;
        let bytes = description.size();
        if bytes > LARGEST {
            let topic = topic.to_owned();
            return Err(RemoteError::TooLarge { topic, bytes });
        }
        let (to, from) = sync_channel(QUEUE);
        let subscribers = self.subscribe(&key, &to).map_err(ZenohError::of)?;
        Ok(Listening {
            topic: topic.to_owned(),
            layout: layout_number(&about.layout),
            is_state: about.state,
            description,
            ledger: Ledger::new(),
            unreadable: None,
            heard: None,
            is_there: None,
            key,
            to,
            from,
            _subscribers: subscribers,
            session: self.session.clone(),
        })
    }

    fn subscribe(
        &self,
        key: &str,
        to: &SyncSender<Message>,
    ) -> Result<[Subscriber<()>; 3], zenoh::Error> {
        let put = |to: &SyncSender<Message>, of: fn(&Sample) -> Message| {
            let to = to.clone();
            // If the caller is slow, this is lost, and the ledger shows it.
            move |sample: Sample| drop(to.try_send(of(&sample)))
        };
        let samples = self.session.declare_subscriber(key.to_owned());
        let samples = samples.callback(put(to, Message::of)).wait()?;
        let beats = self.session.declare_subscriber(self.keys.counts());
        let beats = beats.callback(put(to, |sample| Message::Beat(bytes(sample.payload()))));
        let beats = beats.wait()?;
        let token = self.session.liveliness();
        let token = token.declare_subscriber(self.keys.alive()).history(true);
        let token = token.callback(put(to, |sample| match sample.kind() {
            SampleKind::Put => Message::There,
            SampleKind::Delete => Message::Gone,
        }));
        Ok([samples, beats, token.wait()?])
    }
}

/// What Zenoh's threads tell the caller's.
enum Message {
    Sample { payload: Vec<u8>, note: Vec<u8> },
    Beat(Vec<u8>),
    There,
    Gone,
}

impl Message {
    fn of(sample: &Sample) -> Self {
        Self::Sample {
            payload: bytes(sample.payload()),
            note: sample.attachment().map(bytes).unwrap_or_default(),
        }
    }
}

fn bytes(of: &ZBytes) -> Vec<u8> {
    of.to_bytes().into_owned()
}

/// A topic that is listened to.
pub struct Listening {
    topic: String,
    description: Description,
    layout: u64,
    is_state: bool,
    ledger: Ledger,
    unreadable: Option<String>,
    /// When the last beat came.
    heard: Option<Instant>,
    /// Whether the gateway's token is there; `None` before that is known.
    is_there: Option<bool>,
    key: String,
    to: SyncSender<Message>,
    from: Receiver<Message>,
    _subscribers: [Subscriber<()>; 3],
    session: Session,
}

impl Listening {
    /// The topic's name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The layout of its samples.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// What has become of its samples.
    pub fn account(&self) -> Account {
        self.ledger.account()
    }

    /// Whether the robot's gateway is there; `None` before that is known.
    pub fn is_there(&self) -> Option<bool> {
        self.is_there
    }

    /// When the gateway was last heard to live, by this machine's clock.
    pub fn heard(&self) -> Option<Instant> {
        self.heard
    }

    /// Why the last message could not be read, if one could not.
    pub fn unreadable(&self) -> Option<&str> {
        self.unreadable.as_deref()
    }

    /// What stands beside the next sample that was not shown before, and its payload, which has as
    /// many bytes as its layout says; `None` if none has come.
    pub fn receive(&mut self) -> Option<(Note, Vec<u8>)> {
        loop {
            match self.from.try_recv().ok()? {
                Message::Sample { payload, note } => match self.read(&payload, &note) {
                    Ok((note, Heard::New)) => return Some((note, payload)),
                    Ok((_, Heard::Repeated)) => {}
                    Err(why) => {
                        if self.unreadable.as_deref() != Some(&*why) {
                            tracing::warn!("{why}");
                        }
                        self.unreadable = Some(why);
                    }
                },
                Message::Beat(text) => self.enter(&text),
                Message::There => {
                    self.is_there = Some(true);
                    self.ask();
                }
                Message::Gone => self.is_there = Some(false),
            }
        }
    }

    fn read(&mut self, payload: &[u8], note: &[u8]) -> Result<(Note, Heard), String> {
        let note = Note::from_bytes(note).map_err(|error| error.to_string())?;
        if note.layout != self.layout || payload.len() != self.description.size() {
            return Err(format!(
                "`{}` has another layout than when this began; start it again",
                self.topic
            ));
        }
        Ok((note, self.ledger.hear(&note)))
    }

    fn enter(&mut self, text: &[u8]) {
        // Whatever else stands under that key is no beat.
        let Ok(beat) = serde_json::from_slice::<Beat>(text) else {
            return;
        };
        if let Some(counts) = beat.counts(&self.topic) {
            self.ledger.tell(&counts);
        }
        self.heard = Some(Instant::now());
    }

    /// Asks for the last sample of a state. The answer comes as any other message.
    fn ask(&self) {
        if !self.is_state {
            return;
        }
        let to = self.to.clone();
        let asked = self
            .session
            .get(&*self.key)
            .consolidation(ConsolidationMode::None)
            // Not behind streams, and if the link is full, better late than never.
            .priority(Priority::InteractiveLow)
            .congestion_control(CongestionControl::Drop)
            .timeout(PATIENCE)
            .callback(move |reply: Reply| {
                if let Ok(sample) = reply.result() {
                    drop(to.try_send(Message::of(sample)));
                }
            })
            .wait();
        if let Err(error) = asked {
            tracing::debug!("{} could not be asked for: {error}", self.topic);
        }
    }
}

impl Source for Listening {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let Some((note, payload)) = self.receive() else {
            return Ok(None);
        };
        let lost = Source::lost(self);
        let described = self.description.read(&payload);
        let described = described.expect("as many bytes as the layout says");
        Ok(Some(look.look(&note.stamp, lost, &described)))
    }

    fn lost(&self) -> u64 {
        self.account().missing()
    }

    fn holds(&self) -> bool {
        self.is_state
    }

    fn queue(&self) -> usize {
        QUEUE
    }
}
