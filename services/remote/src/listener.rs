//! The listener's end of one topic: [`Listening`].
//!
//! ```text
//!   Zenoh's thread ──> queue ──> Listening::next ──> the caller
//!      samples, beats, the token        └─ Ledger
//! ```
//!
//! Zenoh's thread never waits for the caller: what does not fit into the queue is dropped, and the
//! ledger shows it as any other loss of the link. After a gateway was replaced, Zenoh connects again
//! by itself, and a state is asked for again.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Instant;

use lager_ports::{Look, Raw, ReceiveError, Source};
use lager_sample::Description;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, Reply};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::error::{LARGEST, PATIENCE, RemoteError};
use crate::heard::LastHeard;
use crate::key::Keys;
use crate::ledger::{Account, Heard, Ledger};
use crate::note::{Note, layout_number};
use crate::session::ZenohError;
use crate::told::{About, Beat};

/// How many messages of a topic wait for the caller.
const QUEUE: usize = 4_096;

fn subscribe(
    session: &Session,
    keys: &Keys,
    key: &str,
    to: &SyncSender<Message>,
) -> Result<[Subscriber<()>; 3], zenoh::Error> {
    let samples = session.declare_subscriber(key.to_owned());
    let samples = samples.callback(telling(to, Message::of)).wait()?;
    let beats = session.declare_subscriber(keys.counts());
    let beats = beats.callback(telling(to, |sample| Message::Beat(bytes(sample.payload()))));
    let beats = beats.wait()?;
    let token = session.liveliness();
    let token = token.declare_subscriber(keys.alive()).history(true);
    let token = token.callback(telling(to, |sample| match sample.kind() {
        SampleKind::Put => Message::There,
        SampleKind::Delete => Message::Gone,
    }));
    Ok([samples, beats, token.wait()?])
}

/// A callback that never waits for whoever reads the queue: what does not fit is lost, and for
/// samples the ledger shows it.
pub(crate) fn telling<T: Send + 'static>(
    to: &SyncSender<T>,
    of: fn(&Sample) -> T,
) -> impl Fn(Sample) + Send + Sync + 'static {
    let to = to.clone();
    move |sample| drop(to.try_send(of(&sample)))
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

pub(crate) fn bytes(of: &ZBytes) -> Vec<u8> {
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
    /// What the whole connection knows of it.
    link: LastHeard,
    key: String,
    to: SyncSender<Message>,
    from: Receiver<Message>,
    _subscribers: [Subscriber<()>; 3],
    session: Session,
}

impl Listening {
    /// Listens to `topic`, of which the gateway has told `about`.
    ///
    /// # Errors
    /// Its layout cannot be read, or Zenoh cannot.
    pub(crate) fn open(
        session: &Session,
        keys: &Keys,
        (topic, key): (&str, String),
        about: &About,
        link: &LastHeard,
    ) -> Result<Self, RemoteError> {
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
        let subscribers = subscribe(session, keys, &key, &to).map_err(ZenohError::of)?;
        Ok(Self {
            topic: topic.to_owned(),
            layout: layout_number(&about.layout),
            is_state: about.state,
            description,
            ledger: Ledger::new(),
            unreadable: None,
            heard: None,
            is_there: None,
            link: link.clone(),
            key,
            to,
            from,
            _subscribers: subscribers,
            session: session.clone(),
        })
    }

    /// The topic's name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The layout of its samples.
    pub fn layout(&self) -> &Description {
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
                    Ok((note, Heard::New)) => {
                        self.link.now();
                        return Some((note, payload));
                    }
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
        let raw = Raw {
            bytes: &payload,
            typed: None,
        };
        Ok(Some(look.look_at(&note.stamp, lost, &described, raw)))
    }

    fn description(&self) -> Description {
        self.description.clone()
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
