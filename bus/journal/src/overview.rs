//! What a file is, from its end alone: topics, times and counts.

use std::collections::{BTreeMap, VecDeque};
use std::io::SeekFrom;

use mcap::Summary;
use mcap::records::Record;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use crate::counts::{self, Count, Counts};
use crate::envelope::derived_from;
use crate::read::{Part, ReadError};
use crate::write::{RECORDING, Start};

/// Longer records are taken for damage.
const LONGEST: usize = 64 << 20;

/// A topic of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicOverview {
    /// Its name.
    pub name: String,
    /// Its payload's name; empty if the file does not say.
    pub schema: String,
    /// The schema; empty if the file has none.
    pub schema_text: Vec<u8>,
    /// Whether its messages are made of another topic's, and are no samples.
    pub is_derived: bool,
    /// Messages in the file.
    pub messages: u64,
    /// What the file says of its losses; `None` if another program wrote it.
    pub count: Option<Count>,
}

/// What a file is.
#[derive(Clone, Debug)]
pub struct Overview {
    /// Of which robot it is; `None` if another program wrote it.
    pub start: Option<Start>,
    /// By name.
    pub topics: Vec<TopicOverview>,
    /// All messages.
    pub messages: u64,
    /// Log time of the first message, in ns since 1970; 0 without messages.
    pub begin_ns: u64,
    /// Log time of the last message.
    pub end_ns: u64,
    /// How many chunks there are.
    pub chunks: usize,
    pub(crate) summary: Summary,
}

/// Reads an [`Overview`]. Ask what it wants, give it that, until it wants nothing.
#[derive(Default)]
pub struct OverviewReader {
    file: u64,
    at: u64,
    summary: SummaryReader,
    read: Option<Summary>,
    notes: VecDeque<Part>,
    start: Option<Start>,
    counts: Counts,
}

impl OverviewReader {
    /// For a file of so many bytes.
    pub fn new(file: u64) -> Self {
        let options = SummaryReaderOptions::default()
            .with_file_size(file)
            .with_record_length_limit(LONGEST);
        Self {
            file,
            summary: SummaryReader::new_with_options(options),
            ..Self::default()
        }
    }

    /// The bytes that it needs next; `None` when it has all.
    ///
    /// # Errors
    /// The file is cut off or damaged, or has no index.
    pub fn wants(&mut self) -> Result<Option<Part>, ReadError> {
        while self.read.is_none() {
            match self.summary.next_event() {
                Some(Ok(SummaryReadEvent::ReadRequest(length))) => {
                    return Ok(Some(Part {
                        at: self.at,
                        length,
                    }));
                }
                Some(Ok(SummaryReadEvent::SeekRequest(to))) => {
                    self.at = match to {
                        SeekFrom::Start(at) => at,
                        SeekFrom::Current(by) => self.at.saturating_add_signed(by),
                        SeekFrom::End(by) => self.file.saturating_add_signed(by),
                    };
                    self.summary.notify_seeked(self.at);
                }
                Some(Err(error)) => return Err(error.into()),
                None => {
                    let summary = std::mem::take(&mut self.summary).finish();
                    let summary = summary.ok_or(ReadError::NoIndex)?;
                    let ours = [RECORDING, counts::NAME];
                    let notes = summary.metadata_indexes.iter();
                    self.notes = notes
                        .filter(|index| ours.contains(&index.name.as_str()))
                        .filter(|index| index.length <= LONGEST as u64)
                        .map(|index| Part {
                            at: index.offset,
                            length: index.length as usize,
                        })
                        .collect();
                    self.read = Some(summary);
                }
            }
        }
        Ok(self.notes.front().copied())
    }

    /// Takes what it wanted; fewer bytes mean that the file ends there.
    pub fn supply(&mut self, bytes: &[u8]) {
        if self.read.is_none() {
            self.summary.insert(bytes.len()).copy_from_slice(bytes);
            self.summary.notify_read(bytes.len());
            self.at += bytes.len() as u64;
            return;
        }
        self.notes.pop_front();
        // An operation code and a length stand before the record.
        let record = bytes.split_at_checked(9);
        let record = record.and_then(|(head, body)| mcap::parse_record(head[0], body).ok());
        match record {
            Some(Record::Metadata(note)) if note.name == RECORDING => {
                self.start = Some(Start::of_texts(&note.metadata));
            }
            Some(Record::Metadata(note)) if note.name == counts::NAME => {
                self.counts = counts::of_texts(&note.metadata);
            }
            _ => {}
        }
    }

    /// What the file is.
    ///
    /// # Errors
    /// It has no index, or not all was supplied.
    pub fn finish(self) -> Result<Overview, ReadError> {
        let summary = self.read.ok_or(ReadError::NoIndex)?;
        let stats = summary.stats.clone().ok_or(ReadError::NoIndex)?;
        let mut topics: BTreeMap<String, TopicOverview> = BTreeMap::new();
        for channel in summary.channels.values() {
            let messages = stats.channel_message_counts.get(&channel.id).copied();
            let schema = channel.schema.as_ref();
            let topic = topics
                .entry(channel.topic.clone())
                .or_insert_with(|| TopicOverview {
                    name: channel.topic.clone(),
                    schema: schema.map(|schema| schema.name.clone()).unwrap_or_default(),
                    schema_text: schema
                        .map(|schema| schema.data.to_vec())
                        .unwrap_or_default(),
                    is_derived: derived_from(&channel.metadata).is_some(),
                    messages: 0,
                    count: self.counts.get(&channel.topic).copied(),
                });
            topic.messages += messages.unwrap_or_default();
        }
        Ok(Overview {
            start: self.start,
            topics: topics.into_values().collect(),
            messages: stats.message_count,
            begin_ns: stats.message_start_time,
            end_ns: stats.message_end_time,
            chunks: summary.chunk_indexes.len(),
            summary,
        })
    }
}
