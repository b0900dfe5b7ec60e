//! [`Carrier`]: the robot's end, which sends the samples that a gateway has read from the bus.
//!
//! ```text
//!   gateway's thread: take() ──> limit ──> put, never waits ──> Zenoh's threads ──> listeners
//!                       └──> shelf: layouts and last states <── thread `answers` <── queries
//! ```
//!
//! It has no bus and knows no way to write to one. `take` never waits for a listener: what does not
//! fit into a listener's queue is dropped for that listener alone, and the numbers show it.

use std::collections::{BTreeMap, HashMap};
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use std::{fs, io};

use lager_home::{Clock, UnitName};
use lager_sample::{Description, Stamp};
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::allowed::Allowed;
use crate::certificates::{self, Named};
use crate::endpoint::{Endpoint, HostPort};
use crate::key::Keys;
use crate::limit::{Limit, Verdict};
use crate::note::{Counts, Note, layout_number};
use crate::session::{self, ZenohError};
use crate::settings::{Proof, Settings};
use crate::told::{About, Beat, Ends, Kind, RobotTime, Time};

/// How often it tells what it has counted.
const BEAT: Duration = Duration::from_secs(1);
/// How many queries wait for an answer. One more gets none.
const QUERIES: usize = 64;

fn priority(kind: Kind) -> Priority {
    match kind {
        Kind::Event => Priority::InteractiveHigh,
        Kind::State => Priority::InteractiveLow,
        Kind::Stream => Priority::Data,
    }
}

/// Why a gateway cannot listen.
#[derive(Debug, thiserror::Error)]
pub enum CarrierError {
    /// The address or the file cannot be had.
    #[error("{endpoint} cannot be had: {error}; choose another with --zenoh")]
    Listen {
        /// Where.
        endpoint: Endpoint,
        /// Why.
        error: io::Error,
    },
    /// There is a file that is no socket.
    #[error(
        "{0} is there and is no socket, so it is left as it is; choose another file with --zenoh"
    )]
    NoSocket(PathBuf),
    /// A file of the certificates cannot be read.
    #[error("cannot read {file}: {error}; `lager keys` makes it")]
    Proof {
        /// Which.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The certificate is not this robot's.
    #[error(
        "{file} names {named}, and this robot is `{robot}`, so no listener would believe it; \
         `lager keys` makes one that names it"
    )]
    OtherRobot {
        /// The certificate.
        file: PathBuf,
        /// What it names.
        named: String,
        /// The robot.
        robot: String,
    },
    /// The certificate is not a router's.
    #[error("{0} is no router's certificate; `lager keys router` makes one")]
    NoRouter(PathBuf),
    /// The certificate holds no more, or not yet.
    #[error(
        "{0} has expired, or is not valid yet by this machine's clock; `lager keys` makes another"
    )]
    Expired(PathBuf),
    /// Zenoh cannot.
    #[error("Zenoh cannot work at {endpoint}: {error}")]
    Zenoh {
        /// Where.
        endpoint: String,
        /// Why.
        error: ZenohError,
    },
    /// The system does not let it run.
    #[error("no thread can be started for the answers to listeners: {0}")]
    Thread(io::Error),
}

/// Refuses what could not listen at this moment.
///
/// # Errors
/// The address is taken, the file is no socket, or a certificate cannot be read or is not `robot`'s.
pub fn may_be_had(settings: &Settings, robot: &UnitName) -> Result<(), CarrierError> {
    let mut ways = [&settings.endpoint, &settings.router].into_iter().flatten();
    if ways.any(|way| matches!(way, Endpoint::Tls(_)))
        && let Some(proof) = &settings.proof
    {
        proves(proof, robot.as_str())?;
    }
    settings.endpoint.as_ref().map_or(Ok(()), may_listen)
}

/// Refuses what could not be listened at.
pub(crate) fn may_listen(endpoint: &Endpoint) -> Result<(), CarrierError> {
    let had = match endpoint {
        Endpoint::Tcp(at) | Endpoint::Tls(at) => free(at),
        // Zenoh removes what is there before it listens.
        Endpoint::Unix(file) => match fs::symlink_metadata(file) {
            Ok(found) if !found.file_type().is_socket() => {
                return Err(CarrierError::NoSocket(file.clone()));
            }
            _ => has_folder(file),
        },
    };
    had.map_err(|error| CarrierError::Listen {
        endpoint: endpoint.clone(),
        error,
    })
}

/// Refuses a certificate that does not name `robot` or holds no more.
pub(crate) fn proves(proof: &Proof, robot: &str) -> Result<(), CarrierError> {
    let read = |file: &PathBuf| {
        fs::read(file).map_err(|error| CarrierError::Proof {
            file: file.clone(),
            error,
        })
    };
    read(&proof.authority)?;
    read(&proof.key)?;
    let file = proof.certificate.clone();
    let named = certificates::named(&read(&file)?);
    match named {
        Some(Named { name, holds }) if name == robot => match holds {
            true => Ok(()),
            false => Err(CarrierError::Expired(file)),
        },
        other => Err(CarrierError::OtherRobot {
            file,
            named: other.map_or("nobody".to_owned(), |other| format!("`{}`", other.name)),
            robot: robot.to_owned(),
        }),
    }
}

/// The group of a socket's file may listen as well; nobody else.
pub(crate) fn open_to_group(endpoint: &Endpoint) -> Result<(), CarrierError> {
    let Some(file) = endpoint.file() else {
        return Ok(());
    };
    let opened = fs::set_permissions(file, fs::Permissions::from_mode(0o660));
    opened.map_err(|error| CarrierError::Listen {
        endpoint: endpoint.clone(),
        error,
    })
}

fn free(at: &HostPort) -> io::Result<()> {
    let address = at.address().ok_or(io::ErrorKind::AddrNotAvailable)?;
    TcpListener::bind(SocketAddr::new(address, at.port)).map(drop)
}

fn has_folder(file: &Path) -> io::Result<()> {
    match file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        Some(folder) => fs::read_dir(folder).map(drop),
        None => Ok(()),
    }
}

/// Sends samples to listeners.
pub struct Carrier {
    robot: UnitName,
    keys: Keys,
    allowed: Allowed,
    run: u64,
    outlets: BTreeMap<String, Outlet>,
    shelf: Arc<Shelf>,
    beats: Publisher<'static>,
    beat: u64,
    /// [`Beat::about`].
    about: u64,
    next_beat: Instant,
    has_failed: bool,
    // What listeners find. It goes before the session does.
    alive: Option<LivelinessToken>,
    queries: Vec<Queryable<()>>,
    answers: Option<JoinHandle<()>>,
    session: Session,
}

/// What listeners find of a robot, whatever topics it has.
struct Found {
    queries: Vec<Queryable<()>>,
    beats: Publisher<'static>,
    alive: LivelinessToken,
}

impl Found {
    /// Makes it known. Queries go to `to`.
    fn declare(
        session: &Session,
        keys: &Keys,
        to: &SyncSender<Query>,
    ) -> Result<Self, zenoh::Error> {
        let mut queries = Vec::new();
        for key in [keys.topics(), keys.layouts(), keys.time()] {
            let to = to.clone();
            let queryable = session
                .declare_queryable(key)
                // Never waits: Zenoh's thread serves all listeners.
                .callback(move |query| drop(to.try_send(query)))
                .wait()?;
            queries.push(queryable);
        }
        let beats = session
            .declare_publisher(keys.counts())
            .congestion_control(CongestionControl::Drop)
            // Behind all samples that it counts.
            .priority(Priority::Background)
            .wait()?;
        let alive = session.liveliness().declare_token(keys.alive()).wait()?;
        Ok(Self {
            queries,
            beats,
            alive,
        })
    }
}

/// A topic that is sent.
struct Outlet {
    publisher: Publisher<'static>,
    limit: Limit,
    counts: Counts,
    layout: u64,
    layout_text: String,
    is_state: bool,
    /// A state that is not due yet: its stamp, what the bus had lost before it, and the payload.
    held: Option<(Stamp, u64, Vec<u8>)>,
}

/// What queries are answered with.
#[derive(Default)]
struct Shelf {
    answers: Mutex<HashMap<KeyExpr<'static>, Answer>>,
    robot: Mutex<RobotTime>,
}

#[derive(Clone, PartialEq)]
struct Answer {
    payload: Vec<u8>,
    note: Option<Vec<u8>>,
}

impl Shelf {
    fn lock(&self) -> MutexGuard<'_, HashMap<KeyExpr<'static>, Answer>> {
        self.answers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, robot: RobotTime) {
        *self.robot.lock().unwrap_or_else(PoisonError::into_inner) = robot;
    }

    fn time(&self) -> Time {
        let robot = *self.robot.lock().unwrap_or_else(PoisonError::into_inner);
        Time::now(robot)
    }

    /// Returns whether it was not there or another one.
    fn put(&self, key: KeyExpr<'static>, payload: Vec<u8>, note: Option<Vec<u8>>) -> bool {
        let answer = Answer { payload, note };
        let mut shelf = self.lock();
        let is_new = shelf.get(&key) != Some(&answer);
        shelf.insert(key, answer);
        is_new
    }

    fn answers(&self, to: &KeyExpr<'_>) -> Vec<(KeyExpr<'static>, Answer)> {
        let shelf = self.lock();
        let asked = shelf.iter().filter(|(key, _)| to.intersects(key));
        asked
            .map(|(key, answer)| (key.clone(), answer.clone()))
            .collect()
    }
}

impl Carrier {
    /// Listens as `settings` say, for listeners to `robot`.
    ///
    /// # Errors
    /// It cannot listen there.
    pub fn open(settings: &Settings, robot: &UnitName) -> Result<Self, CarrierError> {
        may_be_had(settings, robot)?;
        let config = session::of_robot(settings);
        let ways = [&settings.endpoint, &settings.router].into_iter().flatten();
        let failed = |error| CarrierError::Zenoh {
            endpoint: ways
                .map(Endpoint::to_string)
                .collect::<Vec<_>>()
                .join(" and "),
            error,
        };
        let session = match session::open(&config) {
            Ok(session) => session,
            Err(error) => return Err(failed(error)),
        };
        if let Some(endpoint) = &settings.endpoint {
            open_to_group(endpoint)?;
        }
        let keys = Keys::of(robot);
        let shelf = Arc::new(Shelf::default());
        let (to, asked) = sync_channel(QUERIES);
        let found = Found::declare(&session, &keys, &to);
        let Found {
            queries,
            beats,
            alive,
        } = found.map_err(|error| failed(ZenohError::of(error)))?;
        let answers = {
            let (shelf, time) = (Arc::clone(&shelf), keys.time());
            let thread = std::thread::Builder::new().name("answers".to_owned());
            let answers = thread.spawn(move || answer(&asked, &shelf, &time));
            answers.map_err(CarrierError::Thread)?
        };
        Ok(Self {
            robot: robot.clone(),
            keys,
            allowed: settings.allowed.clone(),
            run: Clock::monotonic_ns(),
            outlets: BTreeMap::new(),
            shelf,
            beats,
            beat: 0,
            about: 0,
            next_beat: Instant::now(),
            has_failed: false,
            alive: Some(alive),
            queries,
            answers: Some(answers),
            session,
        })
    }

    /// Carries a topic from now on, if the list has it.
    pub fn open_topic(&mut self, name: &str, description: &Description, kind: Kind) {
        let Some(key) = self.keys.topic(name).filter(|_| self.allowed.has(name)) else {
            return;
        };
        let is_state = kind == Kind::State;
        let declared = self
            .session
            .declare_publisher(key)
            .congestion_control(CongestionControl::Drop)
            .priority(priority(kind))
            .wait();
        let publisher = match declared {
            Ok(publisher) => publisher,
            Err(error) => return self.fail(&error),
        };
        let counts = Counts {
            run: self.run,
            ..Counts::default()
        };
        let outlet = Outlet {
            publisher,
            limit: self.allowed.limit(name, is_state),
            counts,
            layout: layout_number(description.text()),
            layout_text: description.text().to_owned(),
            is_state,
            held: None,
        };
        self.outlets.insert(name.to_owned(), outlet);
        self.tell_of(name, Ends::default());
    }

    /// Tells listeners who is at the ends of a topic.
    pub fn tell_of(&mut self, name: &str, ends: Ends) {
        let key = self
            .keys
            .layout(name)
            .and_then(|key| KeyExpr::new(key).ok());
        let (Some(key), Some(outlet)) = (key, self.outlets.get(name)) else {
            return;
        };
        let about = About {
            layout: outlet.layout_text.clone(),
            state: outlet.is_state,
            rate: self.allowed.rate(name),
            ends,
        };
        let text = serde_json::to_vec(&about).expect("it is JSON");
        self.about += u64::from(self.shelf.put(key, text, None));
    }

    /// Takes a sample that was read from the bus, which had lost `lost` samples before it so far.
    pub fn take(&mut self, name: &str, stamp: &Stamp, lost: u64, payload: &[u8]) {
        let Some(outlet) = self.outlets.get_mut(name) else {
            return;
        };
        outlet.counts.lost = lost;
        // A stamp from the future must not hold up those that come after it.
        let published = stamp.publish_time_ns.min(Clock::monotonic_ns());
        let verdict = outlet.limit.offer(published);
        outlet.counts.left_out = outlet.limit.left_out();
        let sent = match verdict {
            Verdict::Send => {
                outlet.held = None;
                outlet.send(stamp, lost, payload, &self.shelf)
            }
            Verdict::Hold => {
                outlet.held = Some((*stamp, lost, payload.to_vec()));
                Ok(())
            }
            Verdict::LeaveOut => Ok(()),
        };
        if let Err(error) = sent {
            self.fail(&error);
        }
    }

    /// Sends what is due at this time, `robot` by the robot's own clock: states that were held, and a
    /// beat.
    pub fn tick(&mut self, robot: Duration) {
        let now_ns = Clock::monotonic_ns();
        self.shelf.show(RobotTime {
            ns: u64::try_from(robot.as_nanos()).unwrap_or(u64::MAX),
            at_ns: now_ns,
        });
        for outlet in self.outlets.values_mut() {
            if outlet.limit.is_due(now_ns)
                && let Some((stamp, lost, payload)) = outlet.held.take()
                && let Err(error) = outlet.send(&stamp, lost, &payload, &self.shelf)
            {
                tracing::warn!(
                    "a state could not be sent to listeners: {}",
                    ZenohError::of(error)
                );
            }
        }
        let now = Instant::now();
        if now < self.next_beat {
            return;
        }
        self.next_beat = now + BEAT;
        let outlets = self.outlets.iter();
        let beat = Beat {
            robot: self.robot.to_string(),
            run: self.run,
            number: self.beat,
            now_ns,
            about: self.about,
            topics: outlets
                .map(|(name, outlet)| (name.clone(), outlet.counts.into()))
                .collect(),
        };
        self.beat += 1;
        let text = serde_json::to_vec(&beat).expect("it is JSON");
        if let Err(error) = self.beats.put(text).wait() {
            self.fail(&error);
        }
    }

    /// Says once that Zenoh does not take what it is given.
    fn fail(&mut self, error: &zenoh::Error) {
        if !std::mem::replace(&mut self.has_failed, true) {
            tracing::warn!("listeners get nothing: {}", ZenohError::of(error));
        }
    }
}

impl Outlet {
    fn send(
        &mut self,
        stamp: &Stamp,
        lost: u64,
        payload: &[u8],
        shelf: &Shelf,
    ) -> Result<(), zenoh::Error> {
        self.counts.next += 1;
        // Of what came before this sample, also if it was held.
        let counts = Counts {
            lost,
            ..self.counts
        };
        let note = Note {
            stamp: *stamp,
            is_answer: false,
            is_limited: self.limit.is_set(),
            counts,
            layout: self.layout,
        };
        let put = self.publisher.put(payload.to_vec());
        let put = put.attachment(note.to_bytes().to_vec()).wait();
        if self.is_state {
            let answer = Note {
                is_answer: true,
                ..note
            };
            let key = self.publisher.key_expr().clone();
            shelf.put(key, payload.to_vec(), Some(answer.to_bytes().to_vec()));
        }
        put
    }
}

impl Drop for Carrier {
    fn drop(&mut self) {
        // Listeners learn at once that it ends.
        drop(self.alive.take());
        self.queries.clear();
        if let Err(error) = self.session.close().wait() {
            tracing::debug!("the session did not close: {error}");
        }
        if let Some(answers) = self.answers.take() {
            // It ends when the last query is answered.
            let _ = answers.join();
        }
    }
}

/// Answers queries until no more can come. Under `time` stand the clocks of the moment.
fn answer(asked: &Receiver<Query>, shelf: &Shelf, time: &str) {
    for query in asked {
        if query.key_expr().as_str() == time {
            let now = serde_json::to_vec(&shelf.time()).expect("it is JSON");
            let _ = query.reply(time, now).wait();
            continue;
        }
        for (key, Answer { payload, note }) in shelf.answers(query.key_expr()) {
            // May wait for the asker; nobody but other askers waits with it.
            let _ = query.reply(key, payload).attachment(note).wait();
        }
    }
}
