//! The overview of a file: topics, times and counts. The file's end has it; without an end, a
//! reader needs the whole file.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};
use std::io::SeekFrom;
use std::sync::Arc;

use mcap::Summary;
use mcap::records::{ChunkIndex, Record, Statistics};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use crate::calendar::{self, Step};
use crate::counts::{self, Count, Counts};
use crate::envelope::Content;
use crate::read::{Part, ReadError};
use crate::walk::{Damage, LONGEST, Learnt, Message, Topic, Visit};
use crate::write::{RECORDING, Start};

/// A topic of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicOverview {
    /// Its name.
    pub name: String,
    /// Its payload's name; empty if the file does not say.
    pub schema: String,
    /// The schema; empty if the file has none.
    pub schema_text: Arc<[u8]>,
    /// Whether its messages are derived from other topics, and are not samples.
    pub is_derived: bool,
    /// Messages in the file.
    pub messages: u64,
    /// How many of them are repeated from an earlier file.
    pub repeated: u64,
    /// The losses that the file admits; `None` if another program wrote it.
    pub count: Option<Count>,
}

/// What a file contains.
#[derive(Clone, Debug)]
pub struct Overview {
    /// The robot that it is of; `None` if another program wrote it.
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
    /// When the machine's calendar was set meanwhile, or in an earlier file of the recording.
    pub steps: Vec<Step>,
    pub(crate) summary: Summary,
    /// The channels of repeated samples.
    pub(crate) repeated: HashSet<u16>,
    /// Whether messages stand outside of chunks.
    pub(crate) has_loose: bool,
}

/// Reads an [`Overview`]. Ask it which bytes it needs and supply them, until it needs no more.
#[derive(Default)]
pub struct OverviewReader {
    file: u64,
    at: u64,
    summary: SummaryReader,
    read: Option<Summary>,
    notes: VecDeque<Part>,
    known: Known,
}

impl OverviewReader {
    /// For a file of this length in bytes.
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
                    let ours = [
                        (RECORDING, 1),
                        (counts::NAME, 1),
                        (calendar::NAME, calendar::MOST),
                    ];
                    // A damaged index may lead to the same place any number of times.
                    let of = |(name, most): (&'static str, usize)| {
                        let notes = summary.metadata_indexes.iter();
                        let notes = notes.filter(move |index| index.name == name).take(most);
                        let longest = (LONGEST / most) as u64;
                        let notes = notes.filter(move |index| index.length <= longest);
                        notes.map(|index| Part {
                            at: index.offset,
                            length: index.length as usize,
                        })
                    };
                    self.notes = ours.into_iter().flat_map(of).collect();
                    self.read = Some(summary);
                }
            }
        }
        Ok(self.notes.front().copied())
    }

    /// Takes the bytes that it needed. Fewer bytes mean that the file ends there.
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
        if let Some(Record::Metadata(note)) = record {
            self.known.note(&note.name, &note.metadata);
        }
    }

    /// What the file is.
    ///
    /// # Errors
    /// The file's end does not say everything, or some bytes were not supplied.
    pub fn finish(self) -> Result<Overview, ReadError> {
        let summary = self.read.ok_or(ReadError::NoIndex)?;
        let stats = summary.stats.clone().ok_or(ReadError::NoIndex)?;
        let has_counts = !stats.channel_message_counts.is_empty() || stats.message_count == 0;
        // Each record of an index is optional, so a missing one must be found in the file.
        let says_all = has_counts
            && stats.channel_count as usize == summary.channels.len()
            && stats.chunk_count as usize == summary.chunk_indexes.len()
            && stats.metadata_count as usize == summary.metadata_indexes.len();
        if !says_all {
            return Err(ReadError::NoIndex);
        }
        let mut schemas: HashMap<u16, Arc<[u8]>> = HashMap::new();
        let channels = summary.channels.values().map(|channel| {
            let (schema, schema_text) = match &channel.schema {
                Some(schema) => {
                    let text = schemas
                        .entry(schema.id)
                        .or_insert_with(|| schema.data.as_ref().into());
                    (schema.name.as_str().into(), Arc::clone(text))
                }
                None => Default::default(),
            };
            let topic = Topic {
                name: channel.topic.clone(),
                schema,
                schema_text,
                content: Content::of_notes(&channel.metadata),
            };
            (channel.id, topic)
        });
        let channels: Vec<_> = channels.collect();
        let has_loose = stats.message_count > 0 && stats.chunk_count == 0;
        let channels = channels.iter().map(|(number, topic)| (*number, topic));
        Ok(self.known.overview(channels, &stats, summary, has_loose))
    }
}

/// What the records of this project in a file say.
#[derive(Default)]
struct Known {
    start: Option<Start>,
    counts: Counts,
    steps: Vec<Step>,
}

impl Known {
    fn note(&mut self, name: &str, texts: &BTreeMap<String, String>) {
        if name == RECORDING {
            self.start = Some(Start::of_texts(texts));
        } else if name == counts::NAME {
            self.counts = counts::of_texts(texts);
        } else if self.steps.len() < calendar::MOST {
            self.steps.extend(Step::of_note(name, texts));
        }
    }

    fn overview<'a>(
        self,
        channels: impl Iterator<Item = (u16, &'a Topic)>,
        stats: &Statistics,
        summary: Summary,
        has_loose: bool,
    ) -> Overview {
        let mut topics: BTreeMap<String, TopicOverview> = BTreeMap::new();
        let mut repeated = HashSet::new();
        for (number, channel) in channels {
            let messages = stats.channel_message_counts.get(&number).copied();
            let messages = messages.unwrap_or_default();
            let topic = topics
                .entry(channel.name.clone())
                .or_insert_with(|| TopicOverview {
                    name: channel.name.clone(),
                    schema: channel.schema.to_string(),
                    schema_text: Arc::clone(&channel.schema_text),
                    is_derived: matches!(channel.content, Content::Derived(_)),
                    messages: 0,
                    repeated: 0,
                    count: self.counts.get(&channel.name).copied(),
                });
            topic.messages += messages;
            if channel.content == Content::Repeated {
                topic.repeated += messages;
                repeated.insert(number);
            }
        }
        Overview {
            start: self.start,
            topics: topics.into_values().collect(),
            messages: stats.message_count,
            begin_ns: stats.message_start_time,
            end_ns: stats.message_end_time,
            chunks: summary.chunk_indexes.len(),
            steps: self.steps,
            summary,
            repeated,
            has_loose,
        }
    }
}

/// Makes an [`Overview`] of a file whose end does not say everything, with a [`crate::Walk`]
/// through the whole file.
#[derive(Default)]
pub struct Scan {
    known: Known,
    stats: Statistics,
    times: Option<(u64, u64)>,
    chunks: Vec<ChunkIndex>,
    in_chunks: u64,
    damage: Option<Damage>,
}

impl Scan {
    /// What the file contains; `learnt` comes from the walk.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn finish(self, learnt: &Learnt) -> Result<Overview, ReadError> {
        if let Some(damage) = self.damage {
            return Err(damage.into());
        }
        let (first, last) = self.times.unwrap_or_default();
        let stats = Statistics {
            message_start_time: first,
            message_end_time: last,
            ..self.stats
        };
        let channels = learnt.topics().map(|(id, topic)| {
            let channel = mcap::Channel {
                id,
                topic: topic.name.clone(),
                schema: None,
                message_encoding: String::new(),
                metadata: BTreeMap::new(),
            };
            (id, Arc::new(channel))
        });
        let summary = Summary {
            channels: channels.collect(),
            chunk_indexes: self.chunks,
            ..Summary::default()
        };
        let has_loose = stats.message_count > self.in_chunks;
        Ok(self
            .known
            .overview(learnt.topics(), &stats, summary, has_loose))
    }
}

impl Visit for Scan {
    fn message(&mut self, message: &Message<'_>) {
        self.stats.message_count += 1;
        let counts = &mut self.stats.channel_message_counts;
        *counts.entry(message.channel).or_default() += 1;
        let log = message.times.log;
        let (first, last) = self.times.unwrap_or((log, log));
        self.times = Some((first.min(log), last.max(log)));
    }

    fn note(&mut self, name: &str, texts: &BTreeMap<String, String>) {
        self.known.note(name, texts);
    }

    fn chunk(&mut self, found: &ChunkIndex, messages: u64) {
        self.in_chunks += messages;
        self.chunks.push(found.clone());
    }

    fn damage(&mut self, damage: Damage) {
        self.damage.get_or_insert(damage);
    }
}
