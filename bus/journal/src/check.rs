//! Checks that a file is undamaged: every CRC, every sample's number, and the file's own counts.
//!
//! Each topic's numbers must rise within each stream. No more of them may be missing than the file
//! says were lost or dropped. This finds too many missing numbers, not too few: if a stream began
//! before the recording, nobody knows its earlier samples. A sample that is repeated from an
//! earlier file counts only there.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;

use mcap::records::{ChunkIndex, Statistics};
use serde::de::IgnoredAny;

use crate::calendar::{self, Step};
use crate::counts::{self, Count, Counts};
use crate::envelope::{Content, Envelope};
use crate::numbers::Numbers;
use crate::walk::{Damage, Message, Visit};
use crate::write::{RECORDING, Start};

/// At most so many faults are kept. A file with more is not worth reading.
const MOST: usize = 100;

/// What is wrong with a file.
#[derive(Debug)]
pub enum Fault {
    /// Its bytes have changed since they were written.
    Damage(Damage),
    /// The index counts other messages than the file has.
    Statistics {
        /// The topic.
        topic: String,
        /// How many messages the index counts.
        told: u64,
        /// How many messages the file has.
        there: u64,
    },
    /// The index names chunks that do not exist, or does not name all.
    Index {
        /// How many chunks only the index or only the file has.
        chunks: usize,
    },
    /// A message is not JSON as the recorder writes it.
    Message {
        /// The topic.
        topic: String,
        /// Why it cannot be read.
        why: String,
    },
    /// A sample's number is not greater than the one before it.
    Backwards {
        /// The topic.
        topic: String,
        /// The number.
        number: u64,
        /// The smallest number that could follow.
        expected: u64,
    },
    /// More samples are missing than the file says.
    Missing {
        /// The topic.
        topic: String,
        /// Numbers that were skipped.
        gaps: u64,
        /// Samples that the file says were lost or dropped.
        told: u64,
    },
    /// The file does not say how many samples were lost.
    NoCounts,
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damage(damage) => damage.fmt(formatter),
            Self::Statistics { topic, told, there } => write!(
                formatter,
                "{topic}: the index says {told} messages, and {there} are there"
            ),
            Self::Index { chunks } => {
                write!(formatter, "the index is wrong about {chunks} chunks")
            }
            Self::Message { topic, why } => {
                write!(formatter, "{topic}: a message cannot be read: {why}")
            }
            Self::Backwards {
                topic,
                number,
                expected,
            } => write!(
                formatter,
                "{topic}: number {number} comes where {expected} or a greater one should"
            ),
            Self::Missing { topic, gaps, told } => write!(
                formatter,
                "{topic}: {gaps} samples are missing, and the file says {told}"
            ),
            Self::NoCounts => write!(formatter, "it does not say what was lost"),
        }
    }
}

/// What the check found of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TopicReport {
    /// Messages that are there.
    pub messages: u64,
    /// How many of them are repeated from an earlier file.
    pub repeated: u64,
    /// Numbers that were skipped between them.
    pub gaps: u64,
    /// How many the file says are missing.
    pub count: Option<Count>,
}

/// What was found.
#[derive(Debug, Default)]
pub struct Report {
    /// Whether `lager bag record` or `recover` wrote the file. The check reads no numbers of
    /// others.
    pub is_ours: bool,
    /// By topic.
    pub topics: BTreeMap<String, TopicReport>,
    /// Chunks that are whole.
    pub chunks: u64,
    /// Whether messages stand outside of chunks.
    pub has_loose: bool,
    /// Log time of the first message, in ns since 1970; 0 without messages.
    pub begin_ns: u64,
    /// When the machine's calendar was set meanwhile.
    pub steps: Vec<Step>,
    /// The faults, at most so many as are kept.
    pub faults: Vec<Fault>,
    /// How many faults there are.
    pub faults_found: u64,
}

/// Looks at a file that a [`crate::Walk`] goes through.
#[derive(Debug, Default)]
pub struct Check {
    report: Report,
    start: Option<Start>,
    counts: Option<Counts>,
    numbers: BTreeMap<String, Numbers>,
    /// Names and messages of the topics, by their numbers in the file.
    channels: HashMap<u16, (String, u64)>,
    chunks: HashSet<u64>,
    in_chunks: u64,
    begin_ns: Option<u64>,
    indexed: HashSet<u64>,
    statistics: Option<Statistics>,
}

impl Check {
    /// The robot that the file is of.
    pub fn start(&self) -> Option<&Start> {
        self.start.as_ref()
    }

    /// The result, when the walk is over.
    pub fn finish(mut self) -> Report {
        for (name, numbers) in std::mem::take(&mut self.numbers) {
            let count = self.counts.as_ref().and_then(|counts| counts.get(&name));
            let count = count.copied();
            let told = count.unwrap_or_default().missing();
            if self.counts.is_some() && numbers.gaps > told {
                self.fault(Fault::Missing {
                    topic: name.clone(),
                    gaps: numbers.gaps,
                    told,
                });
            }
            let topic = self.report.topics.entry(name).or_default();
            (topic.gaps, topic.count) = (numbers.gaps, count);
        }
        let is_whole = self.report.faults.is_empty();
        if is_whole && self.report.is_ours && self.counts.is_none() {
            self.fault(Fault::NoCounts);
        }
        self.compare_with_index();
        let topics = self.report.topics.values();
        let messages: u64 = topics.map(|topic| topic.messages).sum();
        self.report.has_loose = messages > self.in_chunks;
        self.report.begin_ns = self.begin_ns.unwrap_or_default();
        self.report
    }

    /// Compares the index, if the walk reached it. Each of its records is optional, and so is each
    /// count of a channel, so a missing one is no fault.
    fn compare_with_index(&mut self) {
        if let Some(statistics) = self.statistics.take() {
            let mut told = statistics.channel_message_counts;
            let mut all = 0;
            for (id, (topic, there)) in std::mem::take(&mut self.channels) {
                all += there;
                let has_none = told.is_empty() && statistics.message_count > 0;
                let told = told.remove(&id).unwrap_or_default();
                if told != there && !has_none {
                    self.fault(Fault::Statistics { topic, told, there });
                }
            }
            if all != statistics.message_count {
                self.fault(Fault::Statistics {
                    topic: "all topics".to_owned(),
                    told: statistics.message_count,
                    there: all,
                });
            }
        }
        let chunks = self.chunks.symmetric_difference(&self.indexed).count();
        if chunks > 0 && !self.indexed.is_empty() {
            self.fault(Fault::Index { chunks });
        }
    }

    fn fault(&mut self, fault: Fault) {
        self.report.faults_found += 1;
        if self.report.faults.len() < MOST {
            self.report.faults.push(fault);
        }
    }
}

impl Visit for Check {
    fn message(&mut self, message: &Message<'_>) {
        let name = &message.topic.name;
        let topic = self.report.topics.entry(name.clone()).or_default();
        topic.messages += 1;
        let log = message.times.log;
        self.begin_ns = Some(self.begin_ns.map_or(log, |begin_ns| begin_ns.min(log)));
        let channel = self.channels.entry(message.channel);
        channel.or_insert_with(|| (name.clone(), 0)).1 += 1;
        let content = &message.topic.content;
        let is_repeated = *content == Content::Repeated;
        topic.repeated += u64::from(is_repeated);
        if !self.report.is_ours || matches!(content, Content::Derived(_)) {
            return;
        }
        let fault = match serde_json::from_slice::<Envelope<IgnoredAny>>(message.data) {
            Ok(_) if is_repeated => None,
            Ok(envelope) => {
                let numbers = self.numbers.entry(name.clone()).or_default();
                let noted = numbers.note(&envelope.stamp, envelope.lost, envelope.dropped);
                noted.err().map(|backwards| Fault::Backwards {
                    topic: name.clone(),
                    number: envelope.stamp.sequence,
                    expected: backwards.expected,
                })
            }
            Err(error) => Some(Fault::Message {
                topic: name.clone(),
                why: error.to_string(),
            }),
        };
        if let Some(fault) = fault {
            self.fault(fault);
        }
    }

    fn note(&mut self, name: &str, texts: &BTreeMap<String, String>) {
        if name == RECORDING {
            self.report.is_ours = true;
            self.start = Some(Start::of_texts(texts));
        } else if name == counts::NAME {
            self.counts = Some(counts::of_texts(texts));
        } else if self.report.steps.len() < calendar::MOST {
            self.report.steps.extend(Step::of_note(name, texts));
        }
    }

    fn chunk(&mut self, found: &ChunkIndex, messages: u64) {
        self.report.chunks += 1;
        self.in_chunks += messages;
        self.chunks.insert(found.chunk_start_offset);
    }

    fn chunk_index(&mut self, index: &ChunkIndex) {
        self.indexed.insert(index.chunk_start_offset);
    }

    fn statistics(&mut self, statistics: &Statistics) {
        self.statistics = Some(statistics.clone());
    }

    fn damage(&mut self, damage: Damage) {
        self.fault(Fault::Damage(damage));
    }
}
