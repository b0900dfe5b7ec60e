//! Reads a file from its first byte to its last, without its index.
//!
//! Bytes come in pieces of any size. The walk opens a chunk and compares its CRC before it hands on
//! any message, so every message is undamaged. The walk reports a damaged chunk and continues after
//! it.
//!
//! The names of the topics stand in a file's first chunk and again in its index. If the first chunk
//! is damaged, a first walk takes them from the index ([`Learnt`]), and a second walk uses them.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::sync::Arc;

use mcap::records::{ChunkHeader, ChunkIndex, MessageHeader, Record, Statistics, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};

use crate::envelope::Content;
use crate::unpack::{Budget, ZSTD, unpack};
use crate::write::Times;

/// A longer record or chunk counts as damage.
pub(crate) const LONGEST: usize = 256 << 20;
/// Bytes of an operation code and a length in front of each record.
const PREFIX: u64 = 9;

/// What is wrong with a file's bytes.
#[derive(Debug)]
pub enum Damage {
    /// It does not begin as an MCAP file does.
    NotMcap,
    /// It stops before its end.
    Cut {
        /// Bytes from the start that are whole.
        whole: u64,
    },
    /// A chunk cannot be opened.
    Chunk {
        /// Where it begins, in bytes.
        at: u64,
        /// Why.
        why: McapError,
    },
    /// A chunk is packed in a way that this program cannot open.
    Packed {
        /// Where it begins, in bytes.
        at: u64,
        /// The packing's name.
        with: String,
    },
    /// A chunk has messages of topics whose names were in a damaged chunk.
    Nameless {
        /// Where it begins, in bytes.
        at: u64,
        /// How many.
        messages: u64,
    },
    /// The rest cannot be read.
    Record {
        /// Where it begins, in bytes.
        at: u64,
        /// Why.
        why: McapError,
    },
}

impl fmt::Display for Damage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMcap => write!(formatter, "it is not an MCAP file"),
            Self::Cut { whole } => write!(
                formatter,
                "it was cut off: {whole} bytes are whole, and the end is missing"
            ),
            Self::Chunk { at, why } => {
                write!(formatter, "the chunk at byte {at} is damaged: {why}")
            }
            Self::Packed { at, with } => write!(
                formatter,
                "the chunk at byte {at} is packed with `{with}`, which this program does not read"
            ),
            Self::Nameless { at, messages } => write!(
                formatter,
                "the chunk at byte {at} has {messages} messages of topics whose names are lost"
            ),
            Self::Record { at, why } => {
                write!(formatter, "what stands at byte {at} is damaged: {why}")
            }
        }
    }
}

/// A topic of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The schema's name; empty without one.
    pub schema: Arc<str>,
    /// The schema, which several topics may share.
    pub schema_text: Arc<[u8]>,
    /// What its messages are.
    pub content: Content,
}

/// A message as it stands in a file.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// The topic's number in the file.
    pub channel: u16,
    /// The topic.
    pub topic: &'a Topic,
    /// Its time.
    pub times: Times,
    /// Whether it stands in a chunk.
    pub is_in_chunk: bool,
    /// The message.
    pub data: &'a [u8],
}

/// What the walk reports of a file.
pub trait Visit {
    /// A message of a chunk that is whole.
    fn message(&mut self, message: &Message<'_>);
    /// A metadata record.
    fn note(&mut self, name: &str, texts: &BTreeMap<String, String>);
    /// The chunk has no more messages; this was their number. `found` is what an index would say of
    /// it, without message indexes.
    fn chunk(&mut self, _found: &ChunkIndex, _messages: u64) {}
    /// What the index says of a chunk.
    fn chunk_index(&mut self, _index: &ChunkIndex) {}
    /// What the index says of all.
    fn statistics(&mut self, _statistics: &Statistics) {}
    /// A chunk that cannot be read, or why the walk ends here.
    fn damage(&mut self, damage: Damage);
}

/// A walk through one file.
pub struct Walk {
    reader: LinearReader,
    known: Learnt,
    at: u64,
    /// The CRC over all bytes so far. The reader computes it as well, but stops when it is wrong.
    crc: crc32fast::Hasher,
    is_over: bool,
}

/// The topics of a file that a walk has met.
#[derive(Clone, Debug, Default)]
pub struct Learnt {
    schemas: HashMap<u16, (Arc<str>, Arc<[u8]>)>,
    topics: HashMap<u16, Topic>,
    /// Messages since the last chunk whose topic is not known.
    nameless: u64,
    /// Messages since the last chunk, and the first and last of their times.
    messages: u64,
    times: Option<(u64, u64)>,
    budget: Budget,
}

impl Default for Walk {
    fn default() -> Self {
        Self::knowing(Learnt::default())
    }
}

impl Walk {
    /// A second walk through a file; the first one has learnt the topics.
    pub fn knowing(known: Learnt) -> Self {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true)
            .with_record_length_limit(LONGEST);
        let mut crc = crc32fast::Hasher::new();
        crc.update(MAGIC);
        // Each walk may unpack the file once.
        let known = Learnt {
            budget: Budget::default(),
            ..known
        };
        Self {
            reader: LinearReader::new_with_options(options),
            known,
            at: MAGIC.len() as u64,
            crc,
            is_over: false,
        }
    }

    /// Takes the next bytes of the file.
    pub fn feed(&mut self, bytes: &[u8], visit: &mut impl Visit) {
        if bytes.is_empty() || self.is_over {
            return;
        }
        self.reader.insert(bytes.len()).copy_from_slice(bytes);
        self.reader.notify_read(bytes.len());
        self.go_on(visit);
    }

    /// The file ends here. Returns the topics that it has learnt.
    pub fn finish(mut self, visit: &mut impl Visit) -> Learnt {
        if !self.is_over {
            self.reader.notify_read(0);
            self.go_on(visit);
        }
        self.known
    }

    fn go_on(&mut self, visit: &mut impl Visit) {
        loop {
            match self.reader.next_event() {
                Some(Ok(LinearReadEvent::ReadRequest(_))) => return,
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    let at = self.at;
                    self.at += PREFIX + data.len() as u64;
                    if let Some(saved) = data_crc(opcode, data) {
                        let calculated = self.crc.clone().finalize();
                        if ![0, calculated].contains(&saved) {
                            let why = McapError::BadDataCrc { saved, calculated };
                            visit.damage(Damage::Record { at, why });
                        }
                    }
                    self.crc.update(&[opcode]);
                    self.crc.update(&(data.len() as u64).to_le_bytes());
                    self.crc.update(data);
                    if opcode == op::CHUNK {
                        self.known.tell_chunk(at, data, visit);
                        continue;
                    }
                    match mcap::parse_record(opcode, data) {
                        Ok(record) => self.known.tell(record, visit),
                        // Its length was right, or what follows is no record and ends the walk.
                        Err(why) => visit.damage(Damage::Record { at, why }),
                    }
                }
                Some(Err(why)) => {
                    visit.damage(match why {
                        McapError::BadMagic if self.at == MAGIC.len() as u64 => Damage::NotMcap,
                        McapError::UnexpectedEof => Damage::Cut { whole: self.at },
                        why => Damage::Record { at: self.at, why },
                    });
                    break;
                }
                None => break,
            }
        }
        self.is_over = true;
    }
}

impl Learnt {
    /// The topics, by their numbers in the file.
    pub fn topics(&self) -> impl Iterator<Item = (u16, &Topic)> {
        self.topics.iter().map(|(number, topic)| (*number, topic))
    }

    /// Hands on the chunk that stands at `at`.
    fn tell_chunk(&mut self, at: u64, chunk: &[u8], visit: &mut impl Visit) {
        (self.messages, self.times) = (0, None);
        let header = match self.open(chunk, visit) {
            Ok(header) => header,
            Err(McapError::UnsupportedCompression(with)) => {
                return visit.damage(Damage::Packed { at, with });
            }
            Err(why) => return visit.damage(Damage::Chunk { at, why }),
        };
        let messages = std::mem::take(&mut self.nameless);
        if messages > 0 {
            visit.damage(Damage::Nameless { at, messages });
        }
        let (first, last) = self.times.unwrap_or_default();
        let found = ChunkIndex {
            message_start_time: first,
            message_end_time: last,
            chunk_start_offset: at,
            chunk_length: PREFIX + chunk.len() as u64,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: header.compression,
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        };
        visit.chunk(&found, self.messages);
    }

    /// Hands on a record outside of chunks.
    fn tell(&mut self, record: Record<'_>, visit: &mut impl Visit) {
        match record {
            Record::Metadata(note) => visit.note(&note.name, &note.metadata),
            Record::ChunkIndex(index) => visit.chunk_index(&index),
            Record::Statistics(statistics) => visit.statistics(&statistics),
            other => self.tell_content(&other, false, visit),
        }
    }

    /// Hands on what is in a chunk, once its CRC is right.
    ///
    /// It opens the chunk with a reader that compares the CRC first, because only such a reader
    /// does not trust the lengths in a damaged chunk.
    fn open(&mut self, chunk: &[u8], visit: &mut impl Visit) -> Result<ChunkHeader, McapError> {
        let Record::Chunk { header, data } = mcap::parse_record(op::CHUNK, chunk)? else {
            unreachable!("a record is of the kind that was asked for");
        };
        self.budget.take(&header, data.len() as u64)?;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LONGEST);
        let mut reader = LinearReader::new_with_options(options);
        let record = match header.compression == ZSTD {
            false => {
                let length = (chunk.len() as u64).to_le_bytes();
                [&[op::CHUNK][..], &length, chunk].concat()
            }
            true => {
                let size = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
                unpacked_record(&header, &unpack(&data, size.min(LONGEST))?)
            }
        };
        reader.insert(record.len()).copy_from_slice(&record);
        reader.notify_read(record.len());
        loop {
            match reader.next_event() {
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.tell_content(&mcap::parse_record(opcode, data)?, true, visit);
                }
                // The reader has the whole chunk, so it needs more only after the chunk's end.
                Some(Ok(LinearReadEvent::ReadRequest(_))) | None => return Ok(header),
                Some(Err(error)) => return Err(error),
            }
        }
    }

    /// Hands on a record that may stand in a chunk; files of other programs have it outside, too.
    fn tell_content(&mut self, record: &Record<'_>, is_in_chunk: bool, visit: &mut impl Visit) {
        match record {
            Record::Schema { header, data } => {
                let schema = (header.name.as_str().into(), data.as_ref().into());
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned();
                let (schema, schema_text) = schema.unwrap_or_default();
                let topic = Topic {
                    name: channel.topic.clone(),
                    schema,
                    schema_text,
                    content: Content::of_notes(&channel.metadata),
                };
                self.topics.insert(channel.id, topic);
            }
            Record::Message { header, data } => {
                self.tell_message(header, data, is_in_chunk, visit);
            }
            _ => {}
        }
    }

    fn tell_message(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
        is_in_chunk: bool,
        visit: &mut impl Visit,
    ) {
        let Some(topic) = self.topics.get(&header.channel_id) else {
            self.nameless += 1;
            return;
        };
        self.messages += 1;
        let (first, last) = self.times.unwrap_or((header.log_time, header.log_time));
        self.times = Some((first.min(header.log_time), last.max(header.log_time)));
        visit.message(&Message {
            channel: header.channel_id,
            topic,
            times: Times {
                log: header.log_time,
                publish: header.publish_time,
            },
            is_in_chunk,
            data,
        });
    }
}

/// The record of the same chunk without packing.
fn unpacked_record(header: &ChunkHeader, data: &[u8]) -> Vec<u8> {
    let mut body = Vec::with_capacity(40 + data.len());
    body.extend(header.message_start_time.to_le_bytes());
    body.extend(header.message_end_time.to_le_bytes());
    body.extend(header.uncompressed_size.to_le_bytes());
    body.extend(header.uncompressed_crc.to_le_bytes());
    body.extend(0_u32.to_le_bytes());
    body.extend((data.len() as u64).to_le_bytes());
    body.extend(data);
    let mut record = vec![op::CHUNK];
    record.extend((body.len() as u64).to_le_bytes());
    record.append(&mut body);
    record
}

/// The CRC that the end of the data has of all before it; 0 means that it has none.
fn data_crc(opcode: u8, record: &[u8]) -> Option<u32> {
    let saved = record.first_chunk().filter(|_| opcode == op::DATA_END)?;
    Some(u32::from_le_bytes(*saved))
}
