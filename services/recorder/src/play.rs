//! `bag play`: plays a recording onto the bus of a robot that is not up.
//!
//! **A player never moves a robot.** While it plays, it holds the locks of that robot's supervisor
//! and bridge, and only the bridge writes to the boards. So it refuses a robot that is up, and no
//! robot of that name can start until it ends. It also refuses a topic that somebody else writes,
//! because readers would see two worlds at once. Programs that only read may run. For them the
//! recording looks like a robot.
//!
//! The player makes new stamps, so readers that check a sample's age see a living robot. With
//! `--stamps recorded` readers see the writer, number and times of the recording. Those times count
//! from the start of the machine: after a restart of the machine they may lie in the future, and
//! readers count no losses in such a stream.
//!
//! If the player begins later than the recording, it first publishes the last earlier sample of
//! every topic that carries a state. So readers know the warehouse, the orders and the mode of that
//! moment.
//!
//! The player plays a topic of other programs only if such a program has it open, and with the
//! layout of the program that created it. If nobody has it open when the player starts, nobody
//! would read it; and a recording does not say how many programs may write and read it.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_home::LockError;
use lager_journal::{Envelope, EnvelopeSchema, Overview, Selection};
use lager_ports::{AnyPublisher, Bus, IntrospectError, PortError, SendError};
use lager_topics::Role;
use lager_wake::{Shutdown, Watchdog};
use serde_json::Value;

use crate::bag::{Bag, BagError};

/// How long the player waits for readers before its first sample and after its last one.
const MEET: Duration = Duration::from_millis(300);
/// How often the player checks for its end, and sends the states to late readers.
const LOOK: Duration = Duration::from_millis(10);

/// Which stamps samples get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stamps {
    /// New stamps of this moment.
    #[default]
    New,
    /// Those of the recording.
    Recorded,
}

/// What to play, and how.
#[derive(Clone, Debug)]
pub struct PlayConfig {
    /// The recording.
    pub file: PathBuf,
    /// Names of topics. Empty means all that this build knows or somebody has open.
    pub topics: Vec<String>,
    /// The speed; 1 is that of the recording.
    pub rate: f64,
    /// Whether to begin again after the end, until somebody ends it.
    pub repeat: bool,
    /// Where to begin, from the recording's beginning.
    pub from: Duration,
    /// Where to end, from the recording's beginning.
    pub to: Option<Duration>,
    /// Which stamps.
    pub stamps: Stamps,
}

/// Why a recording cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The file cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The robot is up, or another player plays onto its name.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// Somebody else writes a topic.
    #[error(
        "{topic} of robot `{robot}` is written by {writer}; end that one, or play onto another \
         robot's name with --name, or play other topics with --topic"
    )]
    Written {
        /// The topic.
        topic: String,
        /// The robot.
        robot: String,
        /// Who writes it.
        writer: String,
    },
    /// The recording's samples have another layout than today's.
    #[error(
        "{topic} was recorded by another version of lager, whose samples have other fields; play it \
         with that version, or play other topics with --topic"
    )]
    Layout {
        /// The topic.
        topic: String,
    },
    /// None of the wished topics can be played.
    #[error("there is nothing to play: {why}")]
    Nothing {
        /// Why.
        why: String,
    },
    /// A message cannot be read.
    #[error("{topic}: a message cannot be read ({error}); `lager bag check` says more")]
    Message {
        /// The topic.
        topic: String,
        /// Why.
        error: serde_json::Error,
    },
    /// A topic cannot be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// A sample cannot be sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// The state of the bus cannot be read.
    #[error(transparent)]
    Look(#[from] IntrospectError),
}

/// What the player has played.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Played {
    /// Samples.
    pub samples: u64,
    /// Whether it reached the end, and nobody ended it before.
    pub is_done: bool,
}

/// Plays until the end, or until `shutdown` is requested. Calls `begun` once, with what it does not
/// play.
///
/// # Errors
/// The file cannot be read, the robot is up, or somebody else writes one of the topics.
pub fn play(
    bus: &Bus,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
    config: &PlayConfig,
    begun: &mut dyn FnMut(&[String]),
) -> Result<Played, PlayError> {
    let bag = Bag::open(&config.file)?;
    let overview = bag.overview()?;
    bag.must_have(&overview, &config.topics)?;
    let robot = bus.unit();
    // Held until the last sample has left. The player waits for a bridge that is just ending.
    let _name = bus.home().lock_name(robot)?;
    let _bridge = bus.home().lock(robot, Role::Bridge)?;
    let is_wanted = |name: &String| config.topics.is_empty() || config.topics.contains(name);
    // The messages for viewers are derived from the other topics.
    let topics = overview.topics.iter().filter(|topic| !topic.is_derived);
    let topics = topics.map(|topic| topic.name.clone());
    let wanted: Vec<String> = topics.filter(is_wanted).collect();
    watchdog.over("looking at the topics", || must_be_free(bus, &wanted))?;
    let writers = watchdog.over("opening the topics", || open(bus, &overview, &wanted))?;
    let selection = select(config, &overview, &writers)?;
    let is_left_out = |name: &&String| !writers.contains_key(*name);
    let left_out: Vec<String> = wanted.iter().filter(is_left_out).cloned().collect();
    begun(&left_out);

    let held = held(&bag, &overview, &selection, &writers)?;
    let mut played = Played::default();
    let pace = RealTime {
        shutdown,
        writers: &writers,
        ticked: Cell::new(Instant::now()),
    };
    if !pace.rest_until(Instant::now() + MEET) {
        return Ok(played);
    }
    loop {
        let begun = Instant::now();
        let mut first = None;
        let mut is_done = true;
        let mut publish = |topic: &str, message: &[u8]| {
            if let Some(writer) = pace.writers.get(topic) {
                let send = || send(writer, message, config.stamps);
                watchdog.over("publishing a sample", send)?;
                played.samples += 1;
            }
            Ok::<(), PlayError>(())
        };
        for (topic, message) in &held {
            publish(topic, message)?;
        }
        bag.ordered(&overview, &selection, |placed| {
            let first = *first.get_or_insert(placed.times.log);
            let after = Duration::from_nanos(placed.times.log.saturating_sub(first));
            is_done = pace.rest_until(begun + after.div_f64(config.rate));
            if is_done {
                publish(placed.topic, placed.message)?;
            }
            Ok::<bool, PlayError>(is_done)
        })?;
        if first.is_none() && held.is_empty() {
            let why = "no sample lies between --from and --to".to_owned();
            return Err(PlayError::Nothing { why });
        }
        played.is_done = is_done;
        if !is_done || !config.repeat || first.is_none() {
            break;
        }
    }
    pace.rest_until(Instant::now() + MEET);
    Ok(played)
}

/// Opens the topics that this build knows or somebody on the bus has open.
fn open(bus: &Bus, overview: &Overview, wanted: &[String]) -> Result<Writers, PlayError> {
    let mut writers = Writers::new();
    for topic in &overview.topics {
        if !wanted.contains(&topic.name) {
            continue;
        }
        let Some(publisher) = bus.any_publisher(&topic.name)? else {
            continue;
        };
        if !EnvelopeSchema::of(publisher.description()).fits(&topic.schema_text) {
            let topic = topic.name.clone();
            return Err(PlayError::Layout { topic });
        }
        writers.insert(topic.name.clone(), publisher);
    }
    Ok(writers)
}

/// The topics to play, and between which times.
fn select(
    config: &PlayConfig,
    overview: &Overview,
    writers: &Writers,
) -> Result<Selection, PlayError> {
    if writers.is_empty() {
        let why = "it has no topic that this build knows or that somebody has open".to_owned();
        return Err(PlayError::Nothing { why });
    }
    let at = |time: Duration| overview.begin_ns.saturating_add(time.as_nanos() as u64);
    Ok(Selection {
        topics: Some(writers.keys().cloned().collect()),
        from_ns: Some(at(config.from)),
        before_ns: config.to.map(at),
        is_backwards: false,
    })
}

/// The last sample before the selection of each topic that carries a state, the oldest first. So a
/// reader of a state sees what it was at that moment.
fn held(
    bag: &Bag,
    overview: &Overview,
    selection: &Selection,
    writers: &Writers,
) -> Result<Vec<(String, Vec<u8>)>, BagError> {
    let Some(from_ns) = selection.from_ns.filter(|from| *from <= overview.end_ns) else {
        return Ok(Vec::new());
    };
    let mut held = Vec::new();
    for (name, _) in writers.iter().filter(|(_, writer)| writer.holds()) {
        if let Some((times, message)) = bag.last_before(overview, name, from_ns)? {
            held.push((times, name.clone(), message));
        }
    }
    held.sort_by_key(|(times, ..)| times.publish);
    let held = held.into_iter();
    Ok(held.map(|(_, name, message)| (name, message)).collect())
}

fn must_be_free(bus: &Bus, wanted: &[String]) -> Result<(), PlayError> {
    bus.sweep();
    for topic in bus.topics()? {
        let is_wanted = topic.unit == *bus.unit() && wanted.contains(&topic.name);
        let Some(writer) = topic.writers.first().filter(|_| is_wanted) else {
            continue;
        };
        return Err(PlayError::Written {
            topic: topic.name,
            robot: bus.unit().to_string(),
            writer: format!("{}, process {}", writer.who(), writer.pid),
        });
    }
    Ok(())
}

/// The topics to play, by their names.
type Writers = BTreeMap<String, AnyPublisher>;

fn send(writer: &AnyPublisher, message: &[u8], stamps: Stamps) -> Result<(), PlayError> {
    let unreadable = |error| PlayError::Message {
        topic: writer.name().to_owned(),
        error,
    };
    let envelope: Envelope<Value> = serde_json::from_slice(message).map_err(unreadable)?;
    let mut payload = writer.blank().to_vec();
    let filled = writer.description().fill(&envelope.payload, &mut payload);
    filled.map_err(unreadable)?;
    match stamps {
        Stamps::New => writer.send(&payload)?,
        Stamps::Recorded => writer.replay(&payload, envelope.stamp)?,
    }
    Ok(())
}

/// Waits in real time.
struct RealTime<'a> {
    shutdown: &'a Shutdown,
    writers: &'a Writers,
    /// When the player last looked for new readers.
    ticked: Cell<Instant>,
}

impl RealTime<'_> {
    /// Waits for that moment. Returns false if somebody ends the player before.
    fn rest_until(&self, moment: Instant) -> bool {
        loop {
            // Do this however fast samples come: only here a new reader of a state gets the last
            // sample, and the topic may have no later one.
            if self.ticked.get().elapsed() >= LOOK {
                self.writers.values().for_each(AnyPublisher::tick);
                self.ticked.set(Instant::now());
            }
            if self.shutdown.is_requested() {
                return false;
            }
            let left = moment.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return true;
            }
            std::thread::sleep(left.min(LOOK));
        }
    }
}
