//! The history: what robots told and people asked in the last day, in files that have a limit.
//!
//! ```text
//!   kind      what                                     a part lasts   is kept   most
//!   fine      states, true places and latencies        1 min          10 min    28 MiB
//!   coarse    the same at 1 Hz, and ways and orders    10 min         1 day     136 MiB
//!   events    what the log of a page shows             1 hour         1 day     28 MiB
//!
//!   FOLDER/fine-1795449546000.log     a part, named by its first moment in ms since 1970
//!
//!   5f0a11c3 1795449546120 r1 state x_mm=400 ...
//!   ──────── ───────────── ── ───────────────────
//!   CRC-32   ms since 1970 robot a line of the extension, `thought`, or `asked`
//!   of what follows, in hexadecimal
//! ```
//!
//! - `keeper.rs` writes it, and `parts.rs` decides what is dropped.
//! - A station never appends to a part of an earlier one. A line whose end is missing, or whose CRC
//!   is wrong, is left out when somebody reads it, and the log says so once.
//! - When the disk refuses a part, the station says so once, keeps no history for a while, and
//!   tries again. Everything else goes on.
//! - Only regular files of these names and sizes are parts. The history never opens or removes
//!   another file, nor a link.

mod part;
pub(crate) mod parts;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::ops::{ControlFlow, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use lager_lines::Name;

use crate::files;
use parts::{Kind, Part};

pub use part::Entry;

/// How much earlier than its first moment a part may have something, in ms.
const EARLIER_MS: u64 = 1_000;

/// The history of a station's robots, to be read. All clones read the same folder.
#[derive(Clone, Debug)]
pub struct History {
    pub(crate) folder: PathBuf,
    /// The damaged parts that the log has named already.
    told: Arc<Mutex<BTreeSet<PathBuf>>>,
}

impl History {
    /// How many events [`History::events`] gives at most.
    pub const MOST_EVENTS: usize = 20_000;

    /// The history in this folder, which need not exist yet.
    pub fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            told: Arc::default(),
        }
    }

    /// The folder of the history of a station that keeps its warehouse in the file `warehouse`.
    pub fn beside(warehouse: &Path) -> PathBuf {
        files::beside(warehouse, "history")
    }

    /// This moment, in ms since 1970.
    pub fn now_ms() -> u64 {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.unwrap_or_default().as_millis() as u64
    }

    /// Hands on what a robot told of its state in a time, in ms since 1970: at 20 Hz where that is
    /// still kept, and at 1 Hz before that. States come in the order of their times. Stops when
    /// `each` breaks.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn states(
        &self,
        robot: &Name,
        span: &RangeInclusive<u64>,
        mut each: impl FnMut(&Entry<'_>) -> ControlFlow<()>,
    ) -> io::Result<()> {
        let fine = self.overlapping(Kind::Fine, span)?;
        let fine_from = fine.first().map_or(u64::MAX, |part| part.begin_ms);
        let mut last_ms = None;
        let mut take = |entry: &Entry<'_>| {
            // A new part repeats the state of a robot that has gone.
            let is_old = entry.is_state() && last_ms.is_some_and(|last| entry.at_ms <= last);
            if is_old || entry.robot != robot.as_str() || !span.contains(&entry.at_ms) {
                return ControlFlow::Continue(());
            }
            if entry.is_state() {
                last_ms = Some(entry.at_ms);
            }
            each(entry)
        };
        for part in self.overlapping(Kind::Coarse, span)? {
            let coarse = |entry: &Entry<'_>| match entry.at_ms < fine_from {
                true => take(entry),
                false => ControlFlow::Continue(()),
            };
            if self.read(Kind::Coarse, part, coarse)?.is_break() {
                return Ok(());
            }
        }
        for part in fine {
            if self.read(Kind::Fine, part, &mut take)?.is_break() {
                return Ok(());
            }
        }
        Ok(())
    }

    /// What was last known of a robot at a moment, in ms since 1970: each kind of report once, as
    /// its time and its line.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn moment(&self, robot: &Name, at_ms: u64) -> io::Result<Vec<(u64, String)>> {
        let mut last: BTreeMap<String, (u64, String)> = BTreeMap::new();
        for kind in [Kind::Coarse, Kind::Fine] {
            let until = self.parts(kind)?;
            let until = until.iter().rev().filter(|part| part.begin_ms <= at_ms);
            let two: Vec<Part> = until.take(2).copied().collect();
            for part in two.into_iter().rev() {
                // Nothing breaks.
                let _ = self.read(kind, part, |entry| {
                    if entry.robot == robot.as_str() && entry.at_ms <= at_ms {
                        let seen = last.entry(entry.word().to_owned()).or_default();
                        if entry.at_ms >= seen.0 {
                            *seen = (entry.at_ms, entry.line.to_owned());
                        }
                    }
                    ControlFlow::Continue(())
                })?;
            }
        }
        Ok(last.into_values().collect())
    }

    /// What happened in a time, in ms since 1970, to one robot or to all: the robot, the time and
    /// the line, sorted by time. If there are too many, the newest [`History::MOST_EVENTS`].
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn events(
        &self,
        robot: Option<&Name>,
        span: &RangeInclusive<u64>,
    ) -> io::Result<Vec<(String, u64, String)>> {
        let mut events = VecDeque::new();
        // A robot may have told an event later than it happened.
        let later = *span.start()..=u64::MAX;
        for part in self.overlapping(Kind::Events, &later)? {
            self.read_events(part, robot, span, &mut events)?;
        }
        Ok(sorted(events))
    }

    /// The newest events of all robots, at most so many, from the last parts that have any.
    pub(crate) fn latest(&self, most: usize) -> io::Result<Vec<(String, u64, String)>> {
        let mut found = VecDeque::new();
        for part in self.parts(Kind::Events)?.into_iter().rev() {
            let mut before = VecDeque::new();
            self.read_events(part, None, &(0..=u64::MAX), &mut before)?;
            before.append(&mut found);
            found = before;
            if found.len() >= most {
                break;
            }
        }
        let mut events = sorted(found);
        events.drain(..events.len().saturating_sub(most));
        Ok(events)
    }

    fn read_events(
        &self,
        part: Part,
        robot: Option<&Name>,
        span: &RangeInclusive<u64>,
        events: &mut VecDeque<(String, u64, String)>,
    ) -> io::Result<()> {
        // Nothing breaks.
        let _ = self.read(Kind::Events, part, |entry| {
            let is_robots = robot.is_none_or(|robot| robot.as_str() == entry.robot);
            if is_robots && span.contains(&entry.at_ms) {
                let event = (entry.robot.to_owned(), entry.at_ms, entry.line.to_owned());
                events.push_back(event);
                if events.len() > Self::MOST_EVENTS {
                    events.pop_front();
                }
            }
            ControlFlow::Continue(())
        })?;
        Ok(())
    }

    fn parts(&self, kind: Kind) -> io::Result<Vec<Part>> {
        Ok(parts::found(&self.folder, kind)?.0)
    }

    /// The parts that may hold something of this time.
    fn overlapping(&self, kind: Kind, span: &RangeInclusive<u64>) -> io::Result<Vec<Part>> {
        let parts = self.parts(kind)?;
        let ends = parts.iter().skip(1).map(|next| next.begin_ms);
        let ends = ends.chain([u64::MAX]);
        let there = parts.iter().zip(ends);
        // What a robot told a moment before the part began may stand in it.
        let from = |part: &Part| part.begin_ms.saturating_sub(EARLIER_MS);
        let there = there.filter(|(part, end)| from(part) <= *span.end() && end > span.start());
        Ok(there.map(|(part, _)| *part).collect())
    }

    /// Reads a part up to its end, and says once if it is damaged. A part that was dropped
    /// meanwhile has nothing.
    fn read(
        &self,
        kind: Kind,
        part: Part,
        each: impl FnMut(&Entry<'_>) -> ControlFlow<()>,
    ) -> io::Result<ControlFlow<()>> {
        let path = parts::path(&self.folder, kind, part.begin_ms);
        let read = match part::read(&path, each) {
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(ControlFlow::Continue(()));
            }
            Err(error) => {
                self.tell(&path, || format!("cannot be read and is left out: {error}"));
                return Ok(ControlFlow::Continue(()));
            }
        };
        if read.damaged > 0 {
            let lines = read.damaged;
            self.tell(&path, || {
                format!("is damaged: {lines} of its lines cannot be read and are left out")
            });
        }
        // The newest part may be growing.
        let is_newest = || self.parts(kind).is_ok_and(|all| all.last() == Some(&part));
        if read.is_torn && !is_newest() {
            self.tell(&path, || {
                "ends within a line, because its station was killed or the disk was full; what \
                 stands before that counts"
                    .to_owned()
            });
        }
        Ok(read.flow)
    }

    fn tell(&self, path: &Path, what: impl FnOnce() -> String) {
        let told = self.told.lock();
        let is_new = told
            .unwrap_or_else(PoisonError::into_inner)
            .insert(path.to_owned());
        if is_new {
            tracing::warn!("the history's file {} {}", path.display(), what());
        }
    }
}

fn sorted(events: VecDeque<(String, u64, String)>) -> Vec<(String, u64, String)> {
    let mut events: Vec<_> = events.into();
    // Events of one time stay in their order.
    events.sort_by_key(|(_, at_ms, _)| *at_ms);
    events
}
