//! One file of a recording.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::time::{Duration, Instant};

use lager_journal::{Channel, Count, Counts, Journal, Scene, Shown, Start, View};

use crate::disk::{Disk, is_full};
use crate::error::RecordError;
use crate::tally::{Item, Topics};

/// A chunk is ended when it has so many bytes, flush or not.
const CHUNK: u64 = 1 << 20;
/// Room for whatever describes one topic, in a chunk and again in the index. A topic describes
/// itself in 1792 bytes at most, and its schema takes less than ten times as many.
const DESCRIBED: u64 = 128 << 10;

/// One file of a recording.
pub(crate) struct Part {
    journal: Journal,
    disk: Disk,
    topics: Topics,
    channels: HashMap<usize, Kept>,
    views: BTreeMap<View, Channel>,
    /// Whether this file has what viewers were shown before it began.
    has_lasting: bool,
    begun: Instant,
    bytes: Vec<u8>,
}

/// What the file has of one topic.
struct Kept {
    channel: Channel,
    stored: u64,
}

/// Why a sample is not in the file.
pub(crate) enum Refused {
    /// There is no room for it, and there is room for the file's end.
    Full,
    /// The file cannot be written.
    Failed(RecordError),
}

impl Part {
    pub(crate) fn begin(path: &Path, start: &Start, topics: &Topics) -> Result<Self, RecordError> {
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
            has_lasting: false,
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

    /// How long it has been written to.
    pub(crate) fn age(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Adds a sample, and what `scene` makes of it.
    pub(crate) fn write(&mut self, item: &Item, scene: &mut Scene) -> Result<(), Refused> {
        let mut shown = Vec::new();
        if !self.has_lasting {
            self.has_lasting = true;
            shown.extend_from_slice(scene.lasting());
        }
        let topic = self.topics.at(item.topic);
        shown.extend(scene.take(&topic.name, item.times.publish, &item.message));
        let bytes = shown.iter().map(|shown| shown.message.len());
        let bytes = bytes.sum::<usize>() + item.message.len();
        let more = bytes as u64 + 2 * DESCRIBED;
        let room = self.journal.length() + self.journal.room(more);
        match self.disk.reserve(room) {
            Ok(()) => {}
            Err(error) if is_full(&error) => return Err(Refused::Full),
            Err(error) => return Err(Refused::Failed(self.failed(error))),
        }
        let kept = self.keep(item).and_then(|()| self.show(item, &shown));
        kept.map_err(Refused::Failed)
    }

    /// What is derived stands beside the samples and is counted as none.
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
            self.channels.insert(item.topic, Kept { channel, stored });
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

    /// Ends the chunk that is open and waits until it is on the disk.
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

    /// Ends the file. `missing` says of each topic, by its place, how many of its samples were lost
    /// and dropped while this file was written.
    pub(crate) fn end(mut self, missing: &HashMap<usize, (u64, u64)>) -> Result<u64, RecordError> {
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
