//! The thread that writes: it takes samples from the listener's queue and puts them on the disk.
//!
//! It sleeps for a flush period and then writes all samples that have come. So it wakes seldom, and
//! a slow disk only fills the queue. It sorts the samples of one flush by time, so a file is in
//! order except between two flushes.
//!
//! At each flush it checks whether its file is still in its place. If somebody has removed or moved
//! the file, it ends that file, reports it, and goes on in a new one in the same folder. If the
//! folder is gone or is on another disk now, the recording ends, because nobody has chosen that
//! disk.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::time::Instant;

use lager_journal::{CalendarStep, Scene, Start};

use crate::config::RecordConfig;
use crate::disk::Fate;
use crate::error::RecordError;
use crate::part::{Earlier, Part, Refused};
use crate::tally::{Held, Item, Notes, QueueOut, Topics};

/// How many samples it takes at a time.
const BATCH: usize = 20_000;

/// How many samples a topic had lost when a file began, and by the file's last sample.
#[derive(Clone, Copy, Default)]
struct Missing {
    before: (u64, u64),
    now: (u64, u64),
}

/// The result of a keeper.
pub(crate) struct KeeperEnd {
    /// Its files.
    pub(crate) files: Vec<PathBuf>,
    /// Why the recording ended early, or what happened to one of its files.
    pub(crate) result: Result<(), RecordError>,
    /// Its end of the queue. The listener may have put samples there after the last write.
    pub(crate) from: QueueOut,
}

/// Writes the files of one recording.
pub(crate) struct Keeper {
    config: RecordConfig,
    start: Start,
    topics: Topics,
    from: QueueOut,
    notes: Notes,
    part: Part,
    ended: Vec<PathBuf>,
    /// Bytes of the finished files.
    ended_bytes: u64,
    missing: HashMap<usize, Missing>,
    /// Draws the messages for viewers.
    scene: Scene,
    /// The last sample of each topic that carries a state, by the topic's place.
    held: BTreeMap<usize, Held>,
    /// When the calendar was set.
    steps: Vec<CalendarStep>,
    /// Log time of the last sample.
    log: u64,
    /// What happened to files that somebody took away.
    gone: Option<RecordError>,
}

impl Keeper {
    /// Begins the first file.
    pub(crate) fn new(
        config: &RecordConfig,
        start: Start,
        topics: &Topics,
        from: QueueOut,
        notes: &Notes,
    ) -> Result<Self, RecordError> {
        let begin = |config: &RecordConfig| {
            Part::begin(&config.path(0), &start, topics, Earlier::default())
        };
        let (config, part) = match config.or_another {
            true => first_free(config.names(), begin)?,
            false => (config.clone(), begin(config)?),
        };
        Ok(Self {
            part,
            config,
            start,
            topics: topics.clone(),
            from,
            notes: notes.clone(),
            ended: Vec::new(),
            ended_bytes: 0,
            missing: HashMap::new(),
            scene: Scene::default(),
            held: BTreeMap::new(),
            steps: Vec::new(),
            log: 0,
            gone: None,
        })
    }

    /// Writes until the listener has ended, or until it cannot go on.
    pub(crate) fn run(mut self) -> KeeperEnd {
        let result = loop {
            let flush = Instant::now() + self.config.flush;
            let (items, is_over) = self.from.take(BATCH);
            let is_behind = items.len() == BATCH;
            match self.write(items) {
                Ok(()) if is_over => break Ok(()),
                Ok(()) => {}
                Err(error) => break Err(error),
            }
            if !is_behind {
                // The listener wakes it at the end.
                std::thread::park_timeout(flush.saturating_duration_since(Instant::now()));
            }
        };
        let mut files = std::mem::take(&mut self.ended);
        files.extend(place_of(&self.part, self.part.fate().as_ref()));
        self.topics.drop_waiting(&self.from);
        let gone = self.gone.take();
        // A file that could not be written cannot be ended either.
        let (from, ended) = match &result {
            Err(RecordError::Write { .. }) => (self.from, Ok(())),
            _ => self.end(),
        };
        KeeperEnd {
            files,
            result: result.and(ended).and(gone.map_or(Ok(()), Err)),
            from,
        }
    }

    fn write(&mut self, mut items: Vec<Item>) -> Result<(), RecordError> {
        if let Some(fate) = self.part.fate() {
            self.go_on(fate)?;
        }
        for step in self.notes.steps() {
            match self.part.step(&step) {
                // If the disk is full, the next sample reports it.
                Ok(()) | Err(Refused::Full(_)) => self.steps.push(step),
                Err(Refused::Failed(error)) => return Err(error),
            }
        }
        items.sort_by_key(|item| item.times.log);
        for (place, item) in items.iter().enumerate() {
            match self.part.write(item, &mut self.scene) {
                Ok(()) => {}
                Err(Refused::Failed(error)) => return Err(error),
                Err(Refused::Full(why)) => {
                    for item in &items[place..] {
                        self.topics.at(item.topic).drop_one();
                    }
                    return Err(why);
                }
            }
            self.log = item.times.log;
            if self.topics.at(item.topic).holds {
                self.held.insert(item.topic, Held::of(item));
            }
            let missing = self.missing.entry(item.topic).or_default();
            missing.now = (item.lost, item.dropped);
        }
        self.part.flush()?;
        let length = self.part.length();
        self.notes.set_bytes(self.ended_bytes + length);
        if self.config.split.is_due(length, self.part.age()) {
            self.next_part()?;
        }
        Ok(())
    }

    /// Ends this file and begins the next one. New samples wait in the queue meanwhile.
    fn next_part(&mut self) -> Result<(), RecordError> {
        self.start.part += 1;
        let next = self.begin(&self.config.path(self.start.part))?;
        self.go_on_in(next, None)
    }

    /// Goes on after somebody has taken the file away.
    fn go_on(&mut self, fate: Fate) -> Result<(), RecordError> {
        let path = self.part.path().to_owned();
        self.start.part += 1;
        let folder = path.parent().unwrap_or(Path::new(""));
        let next = match self.part.is_on_disk_of(folder) {
            // The next file gets the next number, or the same name if files have no numbers and it
            // is free.
            true => {
                let name = RecordConfig {
                    file: self.config.path(self.start.part),
                    ..self.config.clone()
                };
                first_free(name.names(), |config| self.begin(&config.file))
            }
            false => Err(RecordError::OtherDisk {
                path: folder.to_owned(),
            }),
        };
        let next = match next {
            Ok((_, next)) => next,
            Err(why) => {
                let why = Box::new(why);
                return Err(RecordError::GoneForGood { path, fate, why });
            }
        };
        let gone = RecordError::Gone {
            path,
            fate: fate.clone(),
            next: next.path().to_owned(),
        };
        self.notes.tell(gone.to_string());
        self.gone.get_or_insert(gone);
        self.go_on_in(next, Some(&fate))
    }

    /// Begins the next file with the last samples of the topics that carry a state.
    fn begin(&self, path: &Path) -> Result<Part, RecordError> {
        let mut held: Vec<Held> = self.held.values().cloned().collect();
        held.sort_by_key(|held| held.publish);
        let earlier = Earlier {
            held,
            steps: self.steps.clone(),
            log: self.log,
        };
        Part::begin(path, &self.start, &self.topics, earlier)
    }

    /// Ends this file and goes on in the next one.
    fn go_on_in(&mut self, next: Part, fate: Option<&Fate>) -> Result<(), RecordError> {
        let part = std::mem::replace(&mut self.part, next);
        self.ended.extend(place_of(&part, fate));
        let told = self.missing.iter();
        let told = told.map(|(place, missing)| (*place, since(missing.before, missing.now)));
        self.ended_bytes += part.end(&told.collect())?;
        for missing in self.missing.values_mut() {
            missing.before = missing.now;
        }
        Ok(())
    }

    /// Ends the last file, with the losses up to the listener's end.
    fn end(self) -> (QueueOut, Result<(), RecordError>) {
        let topics = self.topics.all().clone();
        let told = topics.iter().enumerate().map(|(place, topic)| {
            let count = topic.count();
            let missing = self.missing.get(&place).copied().unwrap_or_default();
            (place, since(missing.before, (count.lost, count.dropped)))
        });
        let told = told.collect();
        let ended = self.part.end(&told).map(|length| {
            self.notes.set_bytes(self.ended_bytes + length);
        });
        (self.from, ended)
    }
}

/// Begins a file with the first free name.
fn first_free(
    mut names: impl Iterator<Item = RecordConfig>,
    begin: impl Fn(&RecordConfig) -> Result<Part, RecordError>,
) -> Result<(RecordConfig, Part), RecordError> {
    let mut name = names.next().expect("one name");
    loop {
        match (begin(&name), names.next()) {
            (Err(RecordError::Exists { .. }), Some(next)) => name = next,
            (begun, _) => return begun.map(|part| (name, part)),
        }
    }
}

/// The full path of a file, if it has one.
fn place_of(part: &Part, fate: Option<&Fate>) -> Option<PathBuf> {
    match fate {
        None => Some(part.path().to_owned()),
        Some(Fate::Moved(to)) => to.clone(),
        Some(Fate::Removed) => None,
    }
}

fn since(before: (u64, u64), now: (u64, u64)) -> (u64, u64) {
    (
        now.0.saturating_sub(before.0),
        now.1.saturating_sub(before.1),
    )
}

#[cfg(test)]
mod tests;
