//! One file of a recording.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::time::{Duration, Instant};

use lager_journal::{
    CalendarStep, Channel, Count, Counts, Journal, Scene, Shown, Start, Times, View,
};

use crate::disk::{Disk, Fate, is_full};
use crate::error::RecordError;
use crate::tally::{Held, Item, Topic, Topics};

/// The recorder ends a chunk that has so many bytes, without waiting for the flush.
const CHUNK: u64 = 1 << 20;
/// Room for the description of one topic, in a chunk and again in the index. A topic describes
/// itself in at most 1792 bytes, and its schema takes less than ten times as many.
const DESCRIBED: u64 = 128 << 10;

/// One file of a recording.
pub(crate) struct Part {
    journal: Journal,
    disk: Disk,
    topics: Topics,
    channels: HashMap<usize, StoredTopic>,
    views: BTreeMap<View, Channel>,
    /// The state from before this file. The file gets it with its first sample.
    earlier: Option<Earlier>,
    begun: Instant,
    bytes: Vec<u8>,
}

/// The state from before a file.
#[derive(Clone, Default)]
pub(crate) struct Earlier {
    /// The last sample of each topic that carries a state.
    pub(crate) held: Vec<Held>,
    /// When the calendar was set.
    pub(crate) steps: Vec<CalendarStep>,
    /// Log time of the last sample.
    pub(crate) log: u64,
}

/// What the file knows of one topic.
struct StoredTopic {
    channel: Channel,
    stored: u64,
}

/// Why a sample is not in the file.
pub(crate) enum Refused {
    /// The disk has no room for it. There is room for the file's end.
    Full(RecordError),
    /// The file cannot be written.
    Failed(RecordError),
}

impl Part {
    pub(crate) fn begin(
        path: &Path,
        start: &Start,
        topics: &Topics,
        earlier: Earlier,
    ) -> Result<Self, RecordError> {
        let journal = Journal::begin(start)?;
        let mut disk = Disk::create(path).map_err(|error| RecordError::create(path, error))?;
        let room = journal.length() + journal.room(DESCRIBED);
        if let Err(error) = disk.reserve(room) {
            disk.remove();
            return Err(RecordError::create(path, error));
        }
        Ok(Self {
            journal,
            disk,
            topics: topics.clone(),
            channels: HashMap::new(),
            views: BTreeMap::new(),
            earlier: Some(earlier),
            begun: Instant::now(),
            bytes: Vec::new(),
        })
    }

    pub(crate) fn path(&self) -> &Path {
        self.disk.path()
    }

    /// Bytes on the disk.
    pub(crate) fn length(&self) -> u64 {
        self.disk.length()
    }

    /// For how long the recorder has written to it.
    pub(crate) fn age(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Adds a sample, and the messages that `scene` derives from it.
    pub(crate) fn write(&mut self, item: &Item, scene: &mut Scene) -> Result<(), Refused> {
        let mut shown = Vec::new();
        if self.earlier.is_some() {
            self.begin_with_earlier(Some(item.times.log))?;
            shown.extend_from_slice(scene.lasting());
        }
        let topic = self.topics.at(item.topic);
        shown.extend(scene.take(&topic.name, item.times.publish, &item.message));
        let bytes = shown.iter().map(|shown| shown.message.len());
        let bytes = bytes.sum::<usize>() + item.message.len();
        let more = bytes as u64 + 2 * DESCRIBED;
        self.reserve(more)?;
        let kept = self.keep(item).and_then(|()| self.show(item, &shown));
        kept.map_err(Refused::Failed)
    }

    /// Makes room for so many bytes more than the file would need if it ended now.
    fn reserve(&mut self, more: u64) -> Result<(), Refused> {
        let room = self.journal.length() + self.journal.room(more);
        match self.disk.reserve(room) {
            Ok(()) => Ok(()),
            Err(error) if is_full(&error) => {
                Err(Refused::Full(RecordError::full(self.path(), &error)))
            }
            Err(error) => Err(Refused::Failed(self.failed(error))),
        }
    }

    /// Writes the earlier state at the file's beginning, when its first sample comes, at `log`.
    fn begin_with_earlier(&mut self, log: Option<u64>) -> Result<(), Refused> {
        let Some(Earlier {
            held,
            steps,
            log: last,
        }) = self.earlier.take()
        else {
            return Ok(());
        };
        for step in &steps {
            self.step(step)?;
        }
        let log = log.unwrap_or(last);
        for held in &held {
            let topic = self.topics.at(held.topic);
            self.reserve(held.message.len() as u64 + 2 * described(&topic))?;
            self.repeat(&topic, held, log).map_err(Refused::Failed)?;
        }
        Ok(())
    }

    fn repeat(&mut self, topic: &Topic, held: &Held, log: u64) -> Result<(), RecordError> {
        let channel = self.journal.repeated(&topic.name, &topic.schema)?;
        let times = Times {
            log,
            publish: held.publish,
        };
        self.journal
            .write(channel, times, held.sequence, &held.message)?;
        Ok(())
    }

    /// Writes that the calendar was set.
    pub(crate) fn step(&mut self, step: &CalendarStep) -> Result<(), Refused> {
        self.reserve(Journal::room_for_a_step())?;
        let noted = self.journal.step(step);
        noted.map_err(|error| Refused::Failed(error.into()))
    }

    /// What happened to the file, if it is not in its place any more.
    pub(crate) fn fate(&self) -> Option<Fate> {
        self.disk.fate()
    }

    /// Whether `folder` is on the same disk.
    pub(crate) fn is_on_disk_of(&self, folder: &Path) -> bool {
        self.disk.is_on_disk_of(folder)
    }

    /// Writes derived messages beside the samples. No count has them.
    fn show(&mut self, item: &Item, shown: &[Shown]) -> Result<(), RecordError> {
        for Shown { view, message } in shown {
            let channel = match self.views.get(view) {
                Some(channel) => *channel,
                None => {
                    let channel = self.journal.view(*view)?;
                    self.views.insert(*view, channel);
                    channel
                }
            };
            let number = item.sequence;
            self.journal.write(channel, item.times, number, message)?;
        }
        Ok(())
    }

    fn keep(&mut self, item: &Item) -> Result<(), RecordError> {
        if !self.channels.contains_key(&item.topic) {
            let topic = self.topics.at(item.topic);
            let channel = self.journal.topic(&topic.name, &topic.schema)?;
            let stored = 0;
            self.channels
                .insert(item.topic, StoredTopic { channel, stored });
        }
        let kept = self.channels.get_mut(&item.topic).expect("just made");
        let number = item.sequence;
        self.journal
            .write(kept.channel, item.times, number, &item.message)?;
        kept.stored += 1;
        if self.journal.open() >= CHUNK {
            self.journal.flush()?;
            self.write_out()?;
        }
        Ok(())
    }

    /// Ends the open chunk and waits until it is on the disk.
    pub(crate) fn flush(&mut self) -> Result<(), RecordError> {
        self.journal.flush()?;
        if self.journal.length() > self.disk.length() {
            self.write_out()?;
            self.disk.sync().map_err(|error| self.failed(error))?;
        }
        Ok(())
    }

    fn write_out(&mut self) -> Result<(), RecordError> {
        self.bytes.clear();
        self.journal.take(&mut self.bytes);
        let written = self.disk.write(&self.bytes);
        written.map_err(|error| self.failed(error))
    }

    /// Ends the file. `missing` says for each topic, by its place, how many of its samples were
    /// lost and dropped while the recorder wrote this file.
    pub(crate) fn end(mut self, missing: &HashMap<usize, (u64, u64)>) -> Result<u64, RecordError> {
        if let Err(Refused::Failed(error)) = self.begin_with_earlier(None) {
            return Err(error);
        }
        self.journal.flush()?;
        self.write_out()?;
        let mut counts = Counts::new();
        let topics = self.topics.all().clone();
        for (place, topic) in topics.iter().enumerate() {
            let (lost, dropped) = missing.get(&place).copied().unwrap_or_default();
            let stored = self.channels.get(&place).map_or(0, |kept| kept.stored);
            if stored + lost + dropped > 0 {
                let received = stored + dropped;
                let count = Count {
                    received,
                    lost,
                    dropped,
                };
                counts.insert(topic.name.clone(), count);
            }
        }
        let path = self.disk.path().to_owned();
        let last = self.journal.end(&counts)?;
        let written = self.disk.write(&last);
        let length = self.disk.length();
        let finished = written.and_then(|()| self.disk.finish());
        finished.map_err(|error| RecordError::Write { path, error })?;
        Ok(length)
    }

    fn failed(&self, error: std::io::Error) -> RecordError {
        let path = self.disk.path().to_owned();
        RecordError::Write { path, error }
    }
}

/// Bytes of the description of one topic.
fn described(topic: &Topic) -> u64 {
    (topic.schema.text.len() + topic.schema.name.len() + 2 * topic.name.len()) as u64 + 512
}
