//! The listener's end: [`Remote`], a connection to a robot's gateway, and [`Hub`], one to a router
//! that has the gateways of many robots.
//!
//! ```text
//!   Zenoh's thread ──> queue ──> thread `gateway`: beats, round trips, topics ──> Known ──> tools
//! ```
//!
//! No tool waits for the link: the thread asks the gateway, and tools see what it told last.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lager_home::{Clock, UnitName};
use lager_ports::StampTime;
use lager_wake::Shutdown;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::ConsolidationMode;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::causes;
use crate::clocks::{Clocks, Offset};
use crate::endpoint::Endpoint;
use crate::error::{PATIENCE, RemoteError};
use crate::heard::LastHeard;
use crate::key::{EVERY_ALIVE, Keys, alive_of};
use crate::listener::{Listening, bytes, telling};
use crate::session::{self, ZenohError};
use crate::settings::Proof;
use crate::told::{About, Beat, Time, boot};

/// How long the other end has to answer the call.
const CALLED: Duration = Duration::from_secs(5);
/// How often a call looks whether somebody ends it.
const LOOK: Duration = Duration::from_millis(20);
/// After how long without a beat the gateway counts as lost; it has one each second.
const SILENT: Duration = Duration::from_secs(3);
/// How many round trips are made at first, so that the offset of the clocks is a good one.
const TRIPS: usize = 5;
/// How long one round trip may take; a longer one would tell little.
const TRIP: Duration = Duration::from_secs(1);
/// The shortest span that tells the pace of the robot's time.
const SPAN: Duration = Duration::from_millis(500);
/// How many messages wait for the thread. Another beat comes soon.
const QUEUE: usize = 16;

/// A connection to a robot's gateway.
#[derive(Debug)]
pub struct Remote {
    session: Session,
    keys: Keys,
    robot: UnitName,
    endpoint: Endpoint,
    known: Arc<Known>,
    _subscribers: [Subscriber<()>; 2],
}

/// What is known of the gateway.
#[derive(Debug, Default)]
struct Known {
    now: Mutex<Now>,
    heard: LastHeard,
}

#[derive(Debug, Default)]
struct Now {
    topics: BTreeMap<String, About>,
    /// How often they have changed here.
    changes: u64,
    /// Of which gateway they are, and how often they had changed there.
    version: Option<(u64, u64)>,
    clocks: Clocks,
    /// Whether the gateway's machine is this one, as it says.
    is_here: bool,
    unix_offset_ns: i64,
    /// The robot's own time at a moment of the stamps' clock, as the gateway told it last.
    robot_time: Option<(u64, Duration)>,
    /// Seconds of robot time in a second, if it was told twice.
    pace: Option<f64>,
    /// Since when it has not been heard any more.
    lost: Option<Instant>,
    is_quiet: bool,
}

impl Known {
    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Now {
    /// The offset of the stamps' clock. On this machine it is the same clock, unless a namespace of
    /// the kernel or a library shows one of both programs another time.
    fn offset(&self) -> Option<Offset> {
        let offset = self.clocks.offset(Clock::monotonic_ns())?;
        let is_same = self.is_here && offset.ns.unsigned_abs() <= offset.unsure_ns;
        Some(match is_same {
            true => Offset::default(),
            false => offset,
        })
    }

    fn take_robot_time(&mut self, at_ns: u64, robot: Duration) {
        if let Some((then_ns, then)) = self.robot_time {
            let real = Duration::from_nanos(at_ns.saturating_sub(then_ns)).as_secs_f64();
            if real < SPAN.as_secs_f64() {
                return;
            }
            let pace = robot.saturating_sub(then).as_secs_f64() / real;
            // None of a clock that stands still.
            self.pace = Some(pace)
                .filter(|pace| pace.is_finite() && *pace > 0.0)
                .or(self.pace);
        }
        self.robot_time = Some((at_ns, robot));
    }
}

impl Remote {
    /// Connects to the gateway of `robot` at `endpoint`, and learns its topics and its clock.
    ///
    /// # Errors
    /// The certificates cannot be used, there is no connection, no gateway of the robot answers, or
    /// somebody has requested `shutdown` meanwhile.
    pub fn open(
        endpoint: &Endpoint,
        robot: &UnitName,
        proof: Option<&Proof>,
        shutdown: &Shutdown,
    ) -> Result<Self, RemoteError> {
        let session = connect(endpoint, Some(robot), proof, shutdown)?;
        let (session, robot, endpoint) = (session, robot.clone(), endpoint.clone());
        unless_ended(shutdown, PATIENCE * 2, move || {
            Self::of(session, robot, endpoint)
        })
        .unwrap_or(Err(RemoteError::Ended))
    }

    fn of(session: Session, robot: UnitName, endpoint: Endpoint) -> Result<Self, RemoteError> {
        let keys = Keys::of(&robot);
        let known = Arc::new(Known::default());
        let (to, from) = sync_channel(QUEUE);
        let beats = session.declare_subscriber(keys.counts());
        let beats = beats.callback(telling(&to, |sample| Told::Beat(bytes(sample.payload()))));
        let beats = beats.wait().map_err(ZenohError::of)?;
        let token = session.liveliness().declare_subscriber(keys.alive());
        let token = token.callback(telling(&to, |sample| match sample.kind() {
            SampleKind::Put => Told::There,
            SampleKind::Delete => Told::Gone,
        }));
        let token = token.wait().map_err(ZenohError::of)?;
        let remote = Self {
            session,
            keys,
            robot,
            endpoint,
            known,
            _subscribers: [beats, token],
        };
        let topics = remote.topics()?;
        {
            let mut now = remote.known.now();
            (now.topics, now.changes) = (topics, 1);
        }
        let asker = remote.asker();
        (0..TRIPS).for_each(|_| asker.make_a_trip());
        let thread = std::thread::Builder::new().name("gateway".to_owned());
        let thread = thread.spawn(move || asker.keep_up(&from));
        thread.map_err(RemoteError::Thread)?;
        Ok(remote)
    }

    fn asker(&self) -> Asker {
        Asker {
            session: self.session.clone(),
            keys: self.keys.clone(),
            robot: self.robot.clone(),
            known: Arc::clone(&self.known),
        }
    }

    /// The robot.
    pub fn robot(&self) -> &UnitName {
        &self.robot
    }

    /// Every topic that the gateway carries, with what it tells of it now.
    ///
    /// # Errors
    /// No gateway of the robot answers.
    pub fn topics(&self) -> Result<BTreeMap<String, About>, RemoteError> {
        let found = self.asker().topics()?;
        match found.is_empty() {
            true => Err(RemoteError::Silent {
                robot: self.robot.clone(),
                endpoint: self.endpoint.clone(),
            }),
            false => Ok(found),
        }
    }

    /// The same as it was told last, without asking.
    ///
    /// # Errors
    /// None; as [`Remote::topics`] before the first answer.
    pub(crate) fn known_topics(&self) -> Result<BTreeMap<String, About>, RemoteError> {
        let known = self.known.now().topics.clone();
        match known.is_empty() {
            true => self.topics(),
            false => Ok(known),
        }
    }

    /// Listens to a topic.
    ///
    /// # Errors
    /// The gateway does not carry it, or its layout cannot be read.
    pub fn listen(&self, topic: &str) -> Result<Listening, RemoteError> {
        match self.listen_to_known(topic)? {
            Some(heard) => Ok(heard),
            None => {
                // It may have come this moment.
                let topics = self.topics()?;
                self.known.now().topics.clone_from(&topics);
                let heard = self.listen_to_known(topic)?;
                heard.ok_or_else(|| RemoteError::NotCarried {
                    topic: topic.to_owned(),
                    robot: self.robot.clone(),
                    carried: topics.into_keys().collect(),
                })
            }
        }
    }

    /// Listens to a topic of which the gateway has told already; `None` if it has not.
    pub(crate) fn listen_to_known(&self, topic: &str) -> Result<Option<Listening>, RemoteError> {
        let about = self.known_topics()?.remove(topic);
        let (Some(about), Some(key)) = (about, self.keys.topic(topic)) else {
            return Ok(None);
        };
        let heard = &self.known.heard;
        Listening::open(&self.session, &self.keys, (topic, key), &about, heard).map(Some)
    }

    /// How often its topics, writers or readers have changed so far.
    pub(crate) fn changes(&self) -> u64 {
        self.known.now().changes
    }

    /// How long nothing has come from the gateway, if that is longer than it should be.
    pub fn silence(&self) -> Option<Duration> {
        let silent = self.known.heard.silence().unwrap_or_default();
        (self.known.now().lost.is_some() || silent >= SILENT).then_some(silent)
    }

    /// From now on whoever asks [`Remote::silence`] tells a person of it, and this does not.
    pub fn be_quiet(&self) {
        self.known.now().is_quiet = true;
    }

    /// What has to be added to this machine's clock for the robot's; `None` if they are the same.
    pub fn offset(&self) -> Option<Offset> {
        let offset = self.known.now().offset()?;
        (offset != Offset::default()).then_some(offset)
    }

    pub(crate) fn stamp_time(&self) -> StampTime {
        let here = StampTime::here();
        let now = self.known.now();
        // Without a round trip nobody knows; then no sample has an age.
        let unknown = Offset {
            ns: 0,
            unsure_ns: u64::MAX,
        };
        let offset = now.offset().unwrap_or(unknown);
        StampTime {
            now_ns: here.now_ns.saturating_add_signed(offset.ns),
            unsure_ns: offset.unsure_ns,
            unix_offset_ns: now.unix_offset_ns,
        }
    }

    /// Seconds of robot time in a second.
    pub(crate) fn pace(&self) -> f64 {
        self.known.now().pace.unwrap_or(1.0)
    }

    pub(crate) fn robot_time(&self) -> Option<(u64, Duration)> {
        self.known.now().robot_time
    }
}

/// What Zenoh's threads tell the one that asks.
enum Told {
    Beat(Vec<u8>),
    There,
    Gone,
}

/// Asks a gateway.
struct Asker {
    session: Session,
    keys: Keys,
    robot: UnitName,
    known: Arc<Known>,
}

impl Asker {
    /// Goes on until the [`Remote`] has gone.
    fn keep_up(&self, from: &Receiver<Told>) {
        loop {
            match from.recv_timeout(TRIP) {
                Ok(Told::Beat(text)) => self.hear(&text),
                Ok(Told::There) => {}
                Ok(Told::Gone) => self.lose(),
                Err(RecvTimeoutError::Timeout) => {
                    let silent = self.known.heard.silence();
                    match silent.is_some_and(|silent| silent >= SILENT) {
                        true => self.lose(),
                        // On a full link samples come, and no beat.
                        false => self.find_again(silent),
                    }
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn hear(&self, text: &[u8]) {
        // Whatever else stands under that key is no beat.
        let Ok(beat) = serde_json::from_slice::<Beat>(text) else {
            return;
        };
        let version = Some((beat.run, beat.about));
        self.known.heard.now();
        self.find_again(self.known.heard.silence());
        let is_new = self.known.now().version != version;
        if is_new
            && let Ok(topics) = self.topics()
            && !topics.is_empty()
        {
            let mut now = self.known.now();
            now.changes += u64::from(now.topics != topics);
            (now.topics, now.version) = (topics, version);
        }
        self.make_a_trip();
    }

    /// Says once that the gateway is heard again, if that was after it was lost.
    fn find_again(&self, silent: Option<Duration>) {
        let mut now = self.known.now();
        let Some(lost) = now.lost.map(|lost| lost.elapsed()) else {
            return;
        };
        if silent.is_none_or(|silent| silent >= lost) {
            return;
        }
        now.lost = None;
        if !now.is_quiet {
            let lost = lost.as_secs_f64();
            tracing::warn!(
                "the gateway of `{}` is heard again, after {lost:.1} s",
                self.robot
            );
        }
    }

    /// Says once that the gateway is not heard any more.
    fn lose(&self) {
        let mut now = self.known.now();
        if now.lost.is_some() {
            return;
        }
        now.lost = Some(Instant::now());
        if !now.is_quiet {
            tracing::warn!(
                "the gateway of `{}` is not heard any more; this goes on when it is back",
                self.robot
            );
        }
    }

    fn topics(&self) -> Result<BTreeMap<String, About>, RemoteError> {
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
                found.insert(topic.to_owned(), about);
            }
        }
        Ok(found)
    }

    /// Asks for the robot's time once.
    fn make_a_trip(&self) {
        let sent_ns = Clock::monotonic_ns();
        let replies = self
            .session
            .get(self.keys.time())
            .consolidation(ConsolidationMode::None)
            // Not behind streams.
            .priority(Priority::InteractiveHigh)
            .congestion_control(CongestionControl::Drop)
            .timeout(TRIP)
            .wait();
        let Ok(replies) = replies else { return };
        let Ok(reply) = replies.recv() else { return };
        let received_ns = Clock::monotonic_ns();
        if let Ok(sample) = reply.result()
            && let Ok(time) = serde_json::from_slice::<Time>(&sample.payload().to_bytes())
        {
            let mut now = self.known.now();
            now.clocks.exchange(sent_ns, time.now_ns, received_ns);
            now.is_here = time.boot == boot();
            now.unix_offset_ns = time.unix_offset_ns;
            now.take_robot_time(time.robot.at_ns, Duration::from_nanos(time.robot.ns));
        }
    }
}

/// A connection to a router, which has the gateways of many robots.
#[derive(Debug)]
pub struct Hub {
    session: Session,
    endpoint: Endpoint,
}

impl Hub {
    /// Connects to the router at `endpoint`.
    ///
    /// # Errors
    /// As [`Remote::open`].
    pub fn open(
        endpoint: &Endpoint,
        proof: Option<&Proof>,
        shutdown: &Shutdown,
    ) -> Result<Self, RemoteError> {
        Ok(Self {
            session: connect(endpoint, None, proof, shutdown)?,
            endpoint: endpoint.clone(),
        })
    }

    /// The robots whose gateways are there now.
    ///
    /// # Errors
    /// Zenoh cannot ask.
    pub fn robots(&self) -> Result<BTreeSet<UnitName>, RemoteError> {
        let asked = self.session.liveliness().get(EVERY_ALIVE).timeout(PATIENCE);
        let replies = asked.wait().map_err(ZenohError::of)?.into_iter();
        let found = replies.filter_map(|reply| alive_of(reply.result().ok()?.key_expr()));
        Ok(found.collect())
    }

    /// The gateway of one of them.
    ///
    /// # Errors
    /// It does not answer.
    pub fn remote(&self, robot: &UnitName) -> Result<Remote, RemoteError> {
        Remote::of(self.session.clone(), robot.clone(), self.endpoint.clone())
    }
}

/// A session at `endpoint`, which takes only what `robot` tells there, or a router.
fn connect(
    endpoint: &Endpoint,
    robot: Option<&UnitName>,
    proof: Option<&Proof>,
    shutdown: &Shutdown,
) -> Result<Session, RemoteError> {
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
    let failed = |cause: &str| RemoteError::Connect {
        endpoint: endpoint.clone(),
        cause: cause.to_owned(),
    };
    match unless_ended(shutdown, CALLED, move || session::open(&config)) {
        Some(Ok(session)) => Ok(session),
        Some(Err(error)) => Err(failed(causes::told().unwrap_or(&error.to_string()))),
        None if shutdown.is_requested() => Err(RemoteError::Ended),
        None => Err(failed("something listens there and does not answer")),
    }
}

/// What `call` returns, which cannot be stopped; `None` if it takes longer than this, or somebody
/// requests `shutdown` meanwhile.
fn unless_ended<T: Send + 'static>(
    shutdown: &Shutdown,
    most: Duration,
    call: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (to, from) = channel();
    let thread = std::thread::Builder::new().name("calling".to_owned());
    let _thread = thread.spawn(move || drop(to.send(call()))).ok()?;
    let began = Instant::now();
    while began.elapsed() < most && !shutdown.is_requested() {
        match from.recv_timeout(LOOK) {
            Ok(told) => return Some(told),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
    None
}
