//! A new file of what is whole in another one that was cut off or damaged.
//!
//! Every chunk whose CRC is right is copied, message by message, and the new file gets an index,
//! its counts and an end. The old file is not touched. Whoever uses this reads the new file again
//! with a [`crate::Check`] before it says that anything was saved.

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

/// Messages that stand outside of chunks are put into chunks of so many bytes.
const CHUNK: u64 = 1 << 20;
/// So many faults of the old file are kept.
const MOST: usize = 100;

/// What was recovered.
#[derive(Debug, Default)]
pub struct Recovered {
    /// Messages that were copied.
    pub messages: u64,
    /// Chunks that were copied.
    pub chunks: u64,
    /// What is wrong with the old file, as far as it was kept; empty if nothing is.
    pub damage: Vec<Damage>,
}

/// Makes the new file of the old one that a [`crate::Walk`] goes through, the second time: the
/// first learns the topics, should the chunk that names them be damaged.
#[derive(Default)]
pub struct Recovery {
    journal: Option<Journal>,
    start: Start,
    channels: HashMap<u16, Channel>,
    /// The schemas that the new file has, each found by where the walk keeps it: many topics may
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

    /// The last bytes of the new file, and what is in it. No bytes mean that the old file is no
    /// recording of ours, or that nothing of it is left.
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
        // What the old file says itself is right as long as all of it was copied. That is counted,
        // as a chunk whose kind was changed by a flipped bit is no damaged chunk.
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
        // Whoever wrote another message than the recorder gets it back, and no number is counted.
        let is_repeated = message.topic.content == Content::Repeated;
        let envelope = serde_json::from_slice::<Envelope<IgnoredAny>>(message.data);
        let stamp = envelope.map(|envelope| {
            if !is_repeated {
                let numbers = self.numbers.entry(message.topic.name.clone()).or_default();
                // A number that is not above the last one stays as it is; `check` tells.
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
