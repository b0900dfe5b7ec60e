//! `bag play`: a recording onto the bus of a robot that is not up.
//!
//! **A player never moves a robot.** While it plays it holds the locks of that robot's supervisor
//! and of its bridge, which alone writes to the boards. So it refuses a robot that is up, and none
//! of that name can be started until it ends. It also refuses a topic that somebody else writes,
//! because readers would see two worlds at once. Programs that only read may run: they see the
//! recording as if the robot were there.
//!
//! Stamps are new unless told otherwise, so that what looks at a sample's age sees a living robot.
//! With the recorded ones readers see writer, number and times of then. Those times are of the
//! machine's clock since its start: after a restart of the machine they may lie ahead, and readers
//! count no losses in such a stream.
//!
//! Where it begins later than the recording, it first publishes the last sample before that moment
//! of every topic that holds, so that readers know the warehouse, the orders and the mode of then.
//!
//! A user's own topic is played onto the bus of those who have it open, laid out as its creator
//! says. One that nobody has open when the player starts is not played: nobody would hear it, and a
//! recording does not say how many may write and read it, nor how many samples may wait there.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_journal::{Envelope, EnvelopeSchema, Overview, Selection};
use lager_ports::{
    AnyPublisher, Bus, IntrospectError, LockError, PortError, SendError, Shutdown, Watchdog,
};
use lager_topics::Role;
use serde_json::Value;

use crate::bag::{Bag, BagError};

/// How long readers get to find the player before its first sample, and to take the last ones.
const MEET: Duration = Duration::from_millis(300);
/// How often the wish to end is looked at, and late readers get the states.
const LOOK: Duration = Duration::from_millis(10);

/// Which stamps samples get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stamps {
    /// The player's own, as of now.
    #[default]
    New,
    /// Those of the recording.
    Recorded,
}

/// What is played and how.
#[derive(Clone, Debug)]
pub struct PlayConfig {
    /// The recording.
    pub file: PathBuf,
    /// Names of topics; empty for all that this build knows or somebody has open.
    pub topics: Vec<String>,
    /// How many times as fast as it was recorded.
    pub rate: f64,
    /// Begin anew at the end, until somebody wishes the end.
    pub repeat: bool,
    /// Where to begin, from the recording's begin.
    pub from: Duration,
    /// Where to end, from the recording's begin.
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
    /// Samples of then do not fit into samples of now.
    #[error(
        "{topic} was recorded by another build, whose samples have other fields; play it with that \
         build, or play other topics with --topic"
    )]
    Layout {
        /// The topic.
        topic: String,
    },
    /// None of what was asked for can be played.
    #[error("there is nothing to play: {why}")]
    Nothing {
        /// Why.
        why: String,
    },
    /// A message is not readable.
    #[error("{topic}: a message is not readable ({error}); `lager bag check` says more")]
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
    /// The bus cannot be looked at.
    #[error(transparent)]
    Look(#[from] IntrospectError),
}

/// What was played.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Played {
    /// Samples.
    pub samples: u64,
    /// Whether it came to the end, rather than to somebody's wish.
    pub is_done: bool,
}

/// Plays until the end, or until `shutdown` is requested. `begun` is told once what is not played.
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
    let robot = bus.robot();
    // Held until the last sample is out. A bridge that is just ending is waited for.
    let _name = bus.place().lock_name(robot)?;
    let _bridge = bus.place().lock(robot, Role::Bridge)?;
    let is_wanted = |name: &String| config.topics.is_empty() || config.topics.contains(name);
    // What viewers look at is made of the other topics.
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
    let pace = Pace {
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

/// Opens the topics that this build or somebody on the bus knows.
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

/// The topics that are played, and the times between which.
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

/// The last sample before the selection begins of each topic that holds, the oldest first: who
/// looks at a state then sees what it was.
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
        let is_wanted = topic.robot == *bus.robot() && wanted.contains(&topic.name);
        let Some(writer) = topic.writers.first().filter(|_| is_wanted) else {
            continue;
        };
        let role = writer
            .role
            .map_or("a stranger".to_owned(), |role| role.to_string());
        return Err(PlayError::Written {
            topic: topic.name,
            robot: bus.robot().to_string(),
            writer: format!("{role}, process {}", writer.pid),
        });
    }
    Ok(())
}

/// The topics that are played, by their names.
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
struct Pace<'a> {
    shutdown: &'a Shutdown,
    writers: &'a Writers,
    /// When readers who have come were last looked for.
    ticked: Cell<Instant>,
}

impl Pace<'_> {
    /// Whether that moment came before the wish to end.
    fn rest_until(&self, moment: Instant) -> bool {
        loop {
            // However many samples there are: a reader of a topic that holds gets its last one by
            // this, and no sample of it may come any more.
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
