//! Writes the history in a thread of its own. It only looks at the station, as a page does, so neither
//! a robot nor a page ever waits for the disk. It writes twice a second, so `kill -9` loses less than
//! 1 s. `sampler.rs` decides what is written.

mod sampler;

use std::fs::{self, DirBuilder, File};
use std::io::{self, Write as _};
use std::ops::Range;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::awaited::Subscription;
use crate::files::{HeldBy, Hold};
use crate::handle::Handle;
use crate::history::History;
use crate::history::parts::{self, Kind, Parts};
use sampler::{Lines, Sampler};

/// How often the thread looks whether it should end.
const LOOK: Duration = Duration::from_millis(100);
/// A robot tells several lines at a time; the thread takes all of them at once.
const GATHER: Duration = Duration::from_millis(20);
/// How often the thread writes.
const WRITE: Duration = Duration::from_millis(400);
/// How long it writes nothing after the disk has refused something.
const AGAIN: Duration = Duration::from_secs(10);

/// Why no history is kept.
#[derive(Debug, Error)]
enum Refused {
    #[error(transparent)]
    Held(#[from] HeldBy),
    #[error("{0}")]
    Disk(#[from] io::Error),
}

/// The thread. Dropping it writes the rest.
#[derive(Debug)]
pub(crate) struct Keeper {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Keeper {
    /// Keeps the history of this station from now on.
    ///
    /// # Errors
    /// The system starts no thread.
    pub(crate) fn new(history: History, handle: Handle) -> io::Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&ends);
        let news = handle.subscribe();
        let keep = move || keep(&history.folder, &handle, &news, &end);
        let thread = std::thread::Builder::new().name("history".into());
        Ok(Self {
            ends,
            thread: Some(thread.spawn(keep)?),
        })
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn keep(folder: &Path, handle: &Handle, news: &Subscription, end: &AtomicBool) {
    let (mut sampler, mut lines) = (Sampler::default(), Lines::default());
    let mut files: Option<Files> = None;
    let mut refused: Option<Instant> = None;
    let (mut seen, mut lost, mut written) = (0, 0, Instant::now());
    loop {
        let ends = end.load(Ordering::Relaxed);
        if !ends {
            seen = handle.wait(seen, LOOK);
            sleep(GATHER);
        }
        let (now_ms, now) = (History::now_ms(), handle.now());
        sampler.states(now_ms, &handle.robots(), &mut lines);
        while let Some(news) = news.next(Duration::ZERO) {
            Sampler::event(now_ms, now, &news, &mut lines);
        }
        let lost_before = std::mem::replace(&mut lost, news.lost());
        if lost > lost_before {
            let lost = lost - lost_before;
            tracing::warn!("the history misses {lost} events: the disk was too slow");
        }
        if ends || written.elapsed() >= WRITE {
            written = Instant::now();
            let lines = std::mem::take(&mut lines);
            if refused.is_some_and(|since| since.elapsed() < AGAIN) {
                sampler.begin_coarse();
            } else if !lines.are_none() {
                let is_over = write(&mut files, folder, now_ms, &lines);
                if !matches!(is_over, Ok(false)) {
                    sampler.begin_coarse();
                }
                refused = told(folder, is_over.err(), refused);
            }
        }
        if ends {
            return;
        }
    }
}

/// Writes the lines, and returns whether the coarse part is complete. After an error the files are
/// opened anew.
fn write(
    files: &mut Option<Files>,
    folder: &Path,
    now_ms: u64,
    lines: &Lines,
) -> Result<bool, Refused> {
    let mut open = match files.take() {
        Some(open) => open,
        None => Files::open(folder)?,
    };
    let mut is_over = false;
    let begin_ms = lines.begin_ms.unwrap_or(now_ms);
    for (files, lines) in open.kinds.iter_mut().zip(lines.of_kinds()) {
        let has_ended = files.write(folder, begin_ms..now_ms, lines)?;
        is_over |= has_ended && files.kind == Kind::Coarse;
    }
    *files = Some(open);
    Ok(is_over)
}

/// Says once that no history is kept, and once that it is again. Returns since when it is not.
fn told(folder: &Path, error: Option<Refused>, before: Option<Instant>) -> Option<Instant> {
    let folder = folder.display();
    match (error, before) {
        (None, None) => None,
        (None, Some(_)) => {
            tracing::info!("the history in {folder} goes on");
            None
        }
        (Some(error), None) => {
            tracing::error!(
                "no history is kept in {folder}: {error}; the station tries again, and everything \
                 else goes on"
            );
            Some(Instant::now())
        }
        (Some(_), Some(_)) => Some(Instant::now()),
    }
}

/// The files in which the history is written.
#[derive(Debug)]
struct Files {
    kinds: Vec<OfKind>,
    /// Only this station writes in this folder.
    _hold: Option<Hold>,
}

/// Those of one kind.
#[derive(Debug)]
struct OfKind {
    kind: Kind,
    parts: Parts,
    file: Option<File>,
}

impl Files {
    fn open(folder: &Path) -> Result<Self, Refused> {
        if !folder.exists() {
            DirBuilder::new().mode(0o700).create(folder)?;
        }
        let hold = Hold::of(folder)?;
        let mut strangers = 0;
        let mut kinds = Vec::new();
        for kind in Kind::ALL {
            let (found, others) = parts::found(folder, kind)?;
            strangers += others;
            kinds.push(OfKind {
                kind,
                parts: Parts::new(kind, found),
                file: None,
            });
        }
        if strangers > 0 {
            tracing::warn!(
                "{strangers} files in {} have the names of the history's files, but are links, \
                 folders or too large; the station leaves them as they are",
                folder.display()
            );
        }
        Ok(Self { kinds, _hold: hold })
    }
}

impl OfKind {
    /// Drops what is too old, writes the lines of this time, and returns whether the part is
    /// complete.
    fn write(&mut self, folder: &Path, taken: Range<u64>, lines: &str) -> io::Result<bool> {
        let Range { start, end: now_ms } = taken;
        for begin_ms in self.parts.dropped(now_ms) {
            let removed = fs::remove_file(parts::path(folder, self.kind, begin_ms));
            removed.or_else(|error| match error.kind() {
                io::ErrorKind::NotFound => Ok(()),
                _ => Err(error),
            })?;
        }
        if !lines.is_empty() {
            let path = parts::path(folder, self.kind, self.parts.open(start));
            let file = match &mut self.file {
                Some(file) => file,
                None => self.file.insert(File::create_new(&path)?),
            };
            let before = file.metadata()?.len();
            if let Err(error) = file.write_all(lines.as_bytes()) {
                // Half a line, or a file with nothing in it, is of no use.
                let _ = match before {
                    0 => fs::remove_file(&path),
                    before => file.set_len(before),
                };
                return Err(error);
            }
            self.parts.grows(lines.len() as u64);
        }
        let is_over = self.parts.is_over(now_ms);
        if is_over {
            self.file = None;
            self.parts.close();
        }
        Ok(is_over)
    }
}

#[cfg(test)]
mod tests {
    use lager_lines::Name;
    use lager_lines::extension::{Report, State};

    use super::*;
    use crate::handle::View;
    use crate::history::Entry;
    use crate::history::parts::MOST_OF_PART;
    use crate::robot::Doing;
    use crate::shown::{Dated, Shown};

    /// A state in which every field is known, with long values.
    fn state() -> State {
        let line = "state time_ms=86400000 x_mm=12345 y_mm=12345 heading_deg=270 unsure_mm=120 \
             node=12,12 looks=right next=13,12 phase=waiting_for_order hold=obstacle_ahead \
             failure=line_lost failure_expected=1 failure_seen=0 remedy=put_back_on_line \
             mode=autonomous pick=manual stopped=1 stop_cause=ordered stop_by=operator stop=123456 \
             stop_age_ms=86400000 stood_ms=12 order=12345 product=12345 delivered=123 \
             line_bits=00001110000 line_error=-10 distance_cm=79 left_duty=104 right_duty=104 \
             code=00000010 servos=1023,1023,1023,1023,1023,1023,1023,1023 \
             loads=-1023,-1023,-1023,-1023,-1023,-1023,-1023,-1023 servo_errors=00000000 \
             battery_dv=114 sensor_up=1 steering_up=1 sensor_lost=12345 steering_lost=12345 \
             bus_lost=12345 gain_p=120 gain_d=120";
        let line: Vec<_> = line.split_whitespace().collect();
        match Report::read(&line.join(" ")) {
            Some(Ok(Report::State(state))) => *state,
            other => panic!("{other:?}"),
        }
    }

    /// What a robot shows at this moment of the station's clock.
    fn view(name: &str, now: Duration) -> View {
        let mut value = state();
        value.time_ms = Some(now.as_millis() as u64);
        View {
            name: Name::new(name).unwrap(),
            doing: Doing::Fetching,
            is_extended: true,
            driver: None,
            uses: None,
            shown: Shown {
                state: Some(Dated { value, at: now }),
                ..Shown::default()
            },
            now,
        }
    }

    fn bytes(folder: &Path) -> u64 {
        let entries = fs::read_dir(folder).unwrap();
        entries
            .map(|entry| entry.unwrap().metadata().unwrap().len())
            .sum()
    }

    /// A day and an hour of two robots in virtual time: the states of a minute are written at a
    /// time, at 1 Hz at first and at 20 Hz in the last quarter of an hour.
    #[test]
    fn a_day_of_two_robots_takes_less_than_200_mib_and_what_is_older_is_dropped() {
        const START_MS: u64 = 1_795_449_546_000;
        const HOUR_MS: u64 = 3_600_000;
        let folder = std::env::temp_dir().join(format!("lager-history-day-{}", std::process::id()));
        let (mut files, mut sampler) = (None, Sampler::default());
        let end_ms = 25 * HOUR_MS;
        let mut passed_ms = 0;
        let mut most = 0;
        while passed_ms < end_ms {
            let mut lines = Lines::default();
            let minute = passed_ms / 60_000;
            while passed_ms / 60_000 == minute {
                let now = Duration::from_millis(passed_ms);
                let views = [view("r1", now), view("r2", now)];
                sampler.states(START_MS + passed_ms, &views, &mut lines);
                passed_ms += match passed_ms + 15 * 60_000 < end_ms {
                    true => 1_000,
                    false => 50,
                };
            }
            if write(&mut files, &folder, START_MS + passed_ms, &lines).unwrap() {
                sampler.begin_coarse();
            }
            most = most.max(bytes(&folder));
        }
        assert!(most < 200 << 20, "{} MiB", most >> 20);
        let history = History::new(folder.clone());
        let mut times = Vec::new();
        let name = Name::new("r2").unwrap();
        let span = 0..=u64::MAX;
        let read = history.states(&name, &span, |entry| {
            times.push(entry.at_ms - START_MS);
            std::ops::ControlFlow::Continue(())
        });
        read.unwrap();
        let (first, last) = (times[0], *times.last().unwrap());
        assert!((HOUR_MS / 2..=HOUR_MS).contains(&first), "{first}");
        assert_eq!(last, end_ms - 50);
        let day = times.iter().filter(|at| **at < end_ms - 900_000).count() as u64;
        assert_eq!(
            day,
            (end_ms - 900_000 - first) / 1_000,
            "none is missing or told twice"
        );
        let fine = times.iter().filter(|at| **at >= end_ms - 600_000).count();
        assert_eq!(fine, 20 * 600);
        // What is coarse before the fine ones has one a second.
        let before = end_ms - 900_000..end_ms - 720_000;
        assert_eq!(times.iter().filter(|at| before.contains(at)).count(), 180);
        drop(files);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn strangers_in_the_folder_are_left_as_they_are() {
        let name = format!("lager-history-strangers-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir(&folder).unwrap();
        let elsewhere = folder.join("letter.txt");
        fs::write(&elsewhere, "Dear Anna").unwrap();
        std::os::unix::fs::symlink(&elsewhere, folder.join("events-1.log")).unwrap();
        fs::create_dir(folder.join("events-2.log")).unwrap();
        let huge = File::create(folder.join("events-3.log")).unwrap();
        huge.set_len(MOST_OF_PART + 1).unwrap();
        fs::write(folder.join("events-notes.log"), "mine").unwrap();
        fs::write(folder.join("fine-4.log"), "no line of the history\n").unwrap();

        let mut files = None;
        let mut lines = Lines::default();
        let entry = Entry {
            at_ms: 1_795_449_546_000,
            robot: "r1",
            line: "thought still here",
        };
        entry.put(&mut lines.events);
        write(&mut files, &folder, entry.at_ms, &lines).unwrap();
        drop(files);
        let history = History::new(folder.clone());
        let events = history.events(None, &(0..=u64::MAX)).unwrap();
        assert_eq!(events, [("r1".into(), entry.at_ms, entry.line.into())]);
        let robot = Name::new("r1").unwrap();
        let none = |_: &Entry<'_>| panic!("it is no state");
        history.states(&robot, &(0..=u64::MAX), none).unwrap();
        assert_eq!(fs::read_to_string(&elsewhere).unwrap(), "Dear Anna");
        for name in [
            "events-1.log",
            "events-2.log",
            "events-3.log",
            "events-notes.log",
        ] {
            assert!(folder.join(name).symlink_metadata().is_ok(), "{name}");
        }
        fs::remove_dir_all(folder).unwrap();
    }
}
