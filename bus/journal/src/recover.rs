//! Makes a new file from the undamaged parts of one that was cut off or damaged.
//!
//! It copies every chunk whose CRC is right, message by message. The new file gets an index, counts
//! and an end. The old file stays as it is. The caller must read the new file with a
//! [`crate::Check`] before it says that anything was saved.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use mcap::records::ChunkIndex;
use serde::de::IgnoredAny;

use crate::calendar::Step;
use crate::counts::{self, Count, Counts};
use crate::envelope::{Content, Envelope, EnvelopeSchema};
use crate::numbers::Numbers;
use crate::walk::{Damage, Message, Topic, Visit};
use crate::write::{Channel, Journal, RECORDING, Schema, Start, WriteError};

/// Messages that stand outside of chunks go into new chunks of this size in bytes.
const CHUNK: u64 = 1 << 20;
/// At most so many faults of the old file are kept.
const MOST: usize = 100;

/// What was recovered.
#[derive(Debug, Default)]
pub struct Recovered {
    /// Messages that were copied.
    pub messages: u64,
    /// Chunks that were copied.
    pub chunks: u64,
    /// The faults of the old file, at most so many as are kept; empty if it has none.
    pub damage: Vec<Damage>,
}

/// Makes the new file while a [`crate::Walk`] goes through the old one for the second time. The
/// first walk learns the topics, in case the chunk that names them is damaged.
#[derive(Default)]
pub struct Recovery {
    journal: Option<Journal>,
    start: Start,
    channels: HashMap<u16, Channel>,
    /// The schemas of the new file, each by the address at which the walk keeps it: many topics may
    /// share a large one.
    schemas: HashMap<usize, (Arc<[u8]>, Schema)>,
    numbers: BTreeMap<String, Numbers>,
    counts: Option<Counts>,
    recovered: Recovered,
    failed: Option<WriteError>,
}

impl Recovery {
    /// Moves the new file's bytes that are ready to the end of `into`.
    pub fn take(&mut self, into: &mut Vec<u8>) {
        if let Some(journal) = &mut self.journal {
            journal.take(into);
        }
    }

    /// The last bytes of the new file, and its counts. No bytes mean that the old file is not a
    /// recording of this project, or that nothing of it is left.
    ///
    /// # Errors
    /// A message cannot be packed again.
    pub fn finish(mut self) -> Result<(Vec<u8>, Recovered), WriteError> {
        if let Some(failed) = self.failed {
            return Err(failed);
        }
        let Some(journal) = self.journal.take() else {
            return Ok((Vec::new(), self.recovered));
        };
        // The counts of the old file are right only if all of it was copied. The messages decide
        // that, since a flipped bit may turn a chunk into another record without any damaged chunk.
        let is_copied = |(name, count): (&String, &Count)| {
            let stored = self.numbers.get(name).map_or(0, |numbers| numbers.stored);
            stored == count.received.saturating_sub(count.dropped)
        };
        let told = self.counts.filter(|told| told.iter().all(is_copied));
        let counts = told.unwrap_or_else(|| {
            let numbers = self.numbers.iter();
            let is_first = self.start.part == 0;
            numbers
                .map(|(name, numbers)| (name.clone(), numbers.count(is_first)))
                .collect()
        });
        Ok((journal.end(&counts)?, self.recovered))
    }

    fn copy(&mut self, message: &Message<'_>) -> Result<(), WriteError> {
        let Some(journal) = &mut self.journal else {
            return Ok(());
        };
        // A message of another program is copied as it is, and its numbers do not count.
        let is_repeated = message.topic.content == Content::Repeated;
        let envelope = serde_json::from_slice::<Envelope<IgnoredAny>>(message.data);
        let stamp = envelope.map(|envelope| {
            if !is_repeated {
                let numbers = self.numbers.entry(message.topic.name.clone()).or_default();
                // A number that is not greater than the last one stays as it is; `check` reports
                // it.
                let _ = numbers.note(&envelope.stamp, envelope.lost, envelope.dropped);
            }
            envelope.stamp.sequence
        });
        let channel = match self.channels.get(&message.channel) {
            Some(channel) => *channel,
            None => {
                let topic = message.topic;
                let schema = schema(journal, &mut self.schemas, topic)?;
                let channel = journal.channel(&topic.name, schema, &topic.content)?;
                self.channels.insert(message.channel, channel);
                channel
            }
        };
        let number = stamp.unwrap_or_default();
        journal.write(channel, message.times, number, message.data)?;
        if journal.open() >= CHUNK && !message.is_in_chunk {
            journal.flush()?;
        }
        self.recovered.messages += 1;
        Ok(())
    }

    fn note_failure(&mut self, done: Result<(), WriteError>) {
        if let Err(error) = done {
            self.failed.get_or_insert(error);
        }
    }
}

impl Visit for Recovery {
    fn message(&mut self, message: &Message<'_>) {
        let copied = self.copy(message);
        self.note_failure(copied);
    }

    fn note(&mut self, name: &str, texts: &BTreeMap<String, String>) {
        if name == counts::NAME {
            self.counts = Some(counts::of_texts(texts));
        } else if let Some(step) = Step::of_note(name, texts) {
            let noted = self
                .journal
                .as_mut()
                .map_or(Ok(()), |journal| journal.step(&step));
            self.note_failure(noted);
        } else if name == RECORDING && self.journal.is_none() {
            self.start = Start::of_texts(texts);
            match Journal::begin(&self.start) {
                Ok(journal) => self.journal = Some(journal),
                Err(error) => self.note_failure(Err(error)),
            }
        }
    }

    fn chunk(&mut self, _found: &ChunkIndex, _messages: u64) {
        let flushed = self.journal.as_mut().map_or(Ok(()), Journal::flush);
        self.note_failure(flushed);
        self.recovered.chunks += 1;
    }

    fn damage(&mut self, damage: Damage) {
        if self.recovered.damage.len() < MOST {
            self.recovered.damage.push(damage);
        }
    }
}

/// The topic's schema in the new file.
fn schema(
    journal: &mut Journal,
    known: &mut HashMap<usize, (Arc<[u8]>, Schema)>,
    topic: &Topic,
) -> Result<Schema, WriteError> {
    let place = topic.schema_text.as_ptr() as usize;
    if let Some((_, schema)) = known.get(&place) {
        return Ok(*schema);
    }
    let schema = journal.schema(&EnvelopeSchema {
        name: topic.schema.to_string(),
        text: Arc::clone(&topic.schema_text),
    })?;
    known.insert(place, (Arc::clone(&topic.schema_text), schema));
    Ok(schema)
}
