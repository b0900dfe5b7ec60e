//! `bag record`: runs the listener in this thread and the keeper in another, until somebody ends
//! it.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::{Duration, Instant};

use lager_journal::{Calendar, Count, Start};
use lager_ports::{Place, Watched};
use lager_wake::{Pace, Shutdown, Watchdog};

use crate::config::RecordConfig;
use crate::error::RecordError;
use crate::keeper::Keeper;
use crate::listener::{Listener, Timing};
use crate::look::{doubt, set};
use crate::tally::{Notes, Topics, queue};

/// How often it reports, and looks for new topics.
const TELL: Duration = Duration::from_secs(1);

/// One topic while it is recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveCount {
    /// Its name.
    pub name: String,
    /// What happened to its samples so far.
    pub count: Count,
}

/// The state of a recording.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// How long it runs.
    pub time: Duration,
    /// Bytes on the disk, in all files.
    pub bytes: u64,
    /// In the order in which they were found.
    pub topics: Vec<LiveCount>,
    /// Warnings: topics that cannot be recorded, a file that somebody has taken away, doubtful
    /// dates. Each comes once.
    pub news: Vec<String>,
}

impl Progress {
    /// All topics together.
    pub fn total(&self) -> Count {
        let mut total = Count::default();
        for topic in &self.topics {
            total.received += topic.count.received;
            total.lost += topic.count.lost;
            total.dropped += topic.count.dropped;
        }
        total
    }
}

/// A recording that has ended.
#[derive(Debug)]
pub struct Recorded {
    /// Its files.
    pub files: Vec<PathBuf>,
    /// Its state at the end.
    pub progress: Progress,
    /// Topics that the user has named and that never came.
    pub absent: Vec<String>,
    /// Why it ended before somebody ended it.
    pub ended_by: Option<RecordError>,
}

/// Records the samples of `place` until `shutdown` is requested, and calls `tell` once a second.
///
/// From a gateway, a sample counts as lost wherever it was lost on its way: on the bus, by a limit of
/// the rate, on the link, or while no gateway was there. Times are those of the robot.
///
/// # Errors
/// The file cannot be made, or a topic that the user has named cannot be opened. If a recording
/// ends later, the reason is in [`Recorded::ended_by`].
pub fn record<P: Place>(
    place: &P,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
    config: &RecordConfig,
    tell: &mut dyn FnMut(&Progress),
) -> Result<Recorded, RecordError> {
    let began = Instant::now();
    let topics = Topics::default();
    let time = place.time();
    let times = Timing {
        offset_ns: time.unix_offset_ns,
        began_ns: time.now_ns,
    };
    let start = Start {
        robot: place.unit().to_string(),
        part: 0,
        unix_offset_ns: times.offset_ns,
    };
    let (to, from) = queue(config.queue);
    let notes = Notes::default();
    let began_unix_ns = times.began_ns.saturating_add_signed(times.offset_ns);
    if let Some(doubt) = doubt(began_unix_ns) {
        notes.tell(doubt);
    }
    let keeper = {
        let (config, topics, notes) = (config.clone(), topics.clone(), notes.clone());
        // A journal stays in one thread, so that thread makes it and reports whether it could.
        let (ready, is_ready) = sync_channel(1);
        let run = move || match Keeper::new(&config, start, &topics, from, &notes) {
            Ok(keeper) => {
                let _ = ready.send(None);
                Some(keeper.run())
            }
            Err(error) => {
                let _ = ready.send(Some(error));
                None
            }
        };
        let thread = thread::Builder::new().name("keeper".to_owned());
        let thread = thread.spawn(run).map_err(RecordError::Thread)?;
        match is_ready.recv() {
            Ok(None) => thread,
            Ok(Some(error)) => return Err(error),
            Err(_) => unreachable!("it sends before it ends"),
        }
    };
    let mut listener = Listener {
        place,
        watchdog,
        topics: topics.clone(),
        wanted: &config.topics,
        times,
        queue: to,
        feeds: Vec::new(),
        known: BTreeSet::new(),
        watch: place.watch(Watched::Topics),
    };
    let mut calendar = Calendar::new(times.offset_ns);
    let mut stands = |refused: Vec<String>| {
        let time = place.time();
        if let Some(step) = calendar.look(time.now_ns, time.unix_offset_ns) {
            notes.step(step);
            notes.tell(set(&step, began_unix_ns));
        }
        let mut news = refused;
        news.append(&mut notes.news());
        let progress = Progress {
            time: began.elapsed(),
            bytes: notes.bytes(),
            topics: live(&topics),
            news,
        };
        tell(&progress);
        progress
    };
    let listened = listen(
        &mut listener,
        shutdown,
        || keeper.is_finished(),
        &mut stands,
    );
    let absent = listener.absent();
    // The queue ends with the listener.
    drop(listener);
    keeper.thread().unpark();
    let kept = keeper.join().expect("the keeper does not panic");
    let kept = kept.expect("it has said that it could begin");
    // If the keeper could not go on, the samples after its last write are still in the queue.
    topics.drop_waiting(&kept.from);
    Ok(Recorded {
        files: kept.files,
        progress: stands(Vec::new()),
        absent,
        ended_by: kept.result.err().or(listened.err()),
    })
}

fn listen<P: Place, R>(
    listener: &mut Listener<'_, P>,
    shutdown: &Shutdown,
    is_over: impl Fn() -> bool,
    stands: &mut impl FnMut(Vec<String>) -> R,
) -> Result<(), RecordError> {
    let (mut pace, mut refused) = (Pace::keeping(), listener.open_table()?);
    let mut told: Option<Instant> = None;
    while !shutdown.is_requested() && !is_over() {
        listener.drain(&mut pace)?;
        if told.is_none_or(|told| told.elapsed() >= TELL) {
            told = Some(Instant::now());
            if !listener.place.may_still_tell() {
                return Err(RecordError::Cleared);
            }
            refused.append(&mut listener.look_for_more()?);
            stands(std::mem::take(&mut refused));
        }
        thread::sleep(pace.wait());
    }
    listener.drain(&mut pace)
}

fn live(topics: &Topics) -> Vec<LiveCount> {
    let topics = topics.all();
    let live = topics.iter().map(|topic| LiveCount {
        name: topic.name.clone(),
        count: topic.count(),
    });
    live.collect()
}
