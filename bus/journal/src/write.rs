//! Writing a file: samples in, bytes out.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};
use std::rc::Rc;

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions};

use crate::calendar::{self, Step};
use crate::counts::{self, Counts};
use crate::envelope::{Content, EnvelopeSchema};
use crate::scene::View;

/// The metadata record that says which robot a file is of.
pub(crate) const RECORDING: &str = "lager.recording";
/// MCAP's word for who laid out the channels.
const PROFILE: &str = "lager";
/// How schemas are written.
const SCHEMA_ENCODING: &str = "jsonschema";
/// How messages are written.
const MESSAGE_ENCODING: &str = "json";

/// Bytes of an operation code and a length in front of each record.
const PREFIX: u64 = 9;
/// Bytes of one topic in `lager.counts` besides its name: two lengths, and three numbers in JSON.
const COUNT: u64 = 8 + 110;
/// Bytes of what says that the calendar was set, at the most.
const STEP: u64 = PREFIX + 128;
/// Bytes of a metadata record's index at the end.
const NOTE_INDEX: u64 = PREFIX + 40;

/// What a file's first record says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// The robot's name.
    pub robot: String,
    /// Which file of the recording this is, from 0.
    pub part: u32,
    /// The difference between ns since 1970 and a stamp's time.
    pub unix_offset_ns: i64,
}

impl Start {
    pub(crate) fn to_texts(&self) -> BTreeMap<String, String> {
        [
            ("robot", self.robot.clone()),
            ("part", self.part.to_string()),
            ("unix_offset_ns", self.unix_offset_ns.to_string()),
        ]
        .map(|(name, text)| (name.to_owned(), text))
        .into()
    }

    /// A value that cannot be read is blank.
    pub(crate) fn of_texts(texts: &BTreeMap<String, String>) -> Self {
        let text = |name: &str| texts.get(name).map_or("", String::as_str);
        Self {
            robot: text("robot").to_owned(),
            part: text("part").parse().unwrap_or_default(),
            unix_offset_ns: text("unix_offset_ns").parse().unwrap_or_default(),
        }
    }
}

/// A topic within one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Channel(u16);

/// The times of a sample, in ns since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Its place in time within the recording.
    pub log: u64,
    /// When its writer published it.
    pub publish: u64,
}

/// Why a file cannot hold something.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The format numbers its topics with 16 bits.
    #[error("a recording has at most 65535 topics; record fewer with --topic")]
    TooManyTopics,
    /// It cannot be packed.
    #[error("the recording cannot be packed: {0}")]
    Format(McapError),
}

impl From<McapError> for WriteError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::TooManyChannels | McapError::TooManySchemas => Self::TooManyTopics,
            other => Self::Format(other),
        }
    }
}

/// One file that is being written. Bytes come out of [`Journal::take`] in their order.
pub struct Journal {
    out: Out,
    writer: mcap::Writer<Out>,
    /// Bytes of schemas and channels, which the end repeats.
    described: u64,
    /// Bytes of the names of all topics.
    names: u64,
    topics: u64,
    /// Bytes of the indexes of chunks and steps of the calendar, which stand at the end.
    indexes: u64,
    chunk: Chunk,
}

/// A schema within one file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Schema(u16);

/// The chunk that is open.
#[derive(Default)]
struct Chunk {
    /// Bytes before packing.
    bytes: u64,
    messages: u64,
}

impl Journal {
    /// Begins a file.
    ///
    /// # Errors
    /// Never in practice: the beginning can always be packed.
    pub fn begin(start: &Start) -> Result<Self, WriteError> {
        let out = Out::default();
        let writer = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("lager ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            // The caller says where a chunk ends.
            .chunk_size(None)
            // A chunk is packed as a whole before it comes out.
            .disable_seeking(true)
            .create(out.clone())?;
        let mut journal = Self {
            out,
            writer,
            described: 0,
            names: 0,
            topics: 0,
            indexes: 0,
            chunk: Chunk::default(),
        };
        journal.note(RECORDING, start.to_texts())?;
        Ok(journal)
    }

    /// Adds a topic, in the open chunk or in the next one.
    ///
    /// # Errors
    /// There are too many.
    pub fn topic(&mut self, name: &str, schema: &EnvelopeSchema) -> Result<Channel, WriteError> {
        let id = self.schema(schema)?;
        self.channel(name, id, &Content::Samples)
    }

    /// Adds a channel for a topic's last sample from before the file. [`Content::Repeated`] says
    /// how to read it.
    ///
    /// # Errors
    /// There are too many.
    pub fn repeated(&mut self, name: &str, schema: &EnvelopeSchema) -> Result<Channel, WriteError> {
        let id = self.schema(schema)?;
        self.channel(name, id, &Content::Repeated)
    }

    /// Adds a channel for viewers. Its messages are not samples.
    ///
    /// # Errors
    /// There are too many.
    pub fn view(&mut self, view: View) -> Result<Channel, WriteError> {
        let from = view.made_of().join(" ");
        let id = self.schema(&view.schema())?;
        self.channel(view.topic(), id, &Content::Derived(from))
    }

    /// Adds a schema, unless the file has it already.
    pub(crate) fn schema(&mut self, schema: &EnvelopeSchema) -> Result<Schema, WriteError> {
        let id = self
            .writer
            .add_schema(&schema.name, SCHEMA_ENCODING, &schema.text)?;
        let described = PREFIX + 32 + (schema.name.len() + schema.text.len()) as u64;
        self.described += described;
        self.chunk.bytes += described;
        Ok(Schema(id))
    }

    /// Adds a channel of whatever content.
    pub(crate) fn channel(
        &mut self,
        name: &str,
        schema: Schema,
        content: &Content,
    ) -> Result<Channel, WriteError> {
        let notes = content.to_notes();
        let channel = self
            .writer
            .add_channel(schema.0, name, MESSAGE_ENCODING, &notes)?;
        let notes: usize = notes.iter().map(|(a, b)| 8 + a.len() + b.len()).sum();
        let described = PREFIX + 32 + (name.len() + notes) as u64;
        self.described += described;
        self.chunk.bytes += described;
        self.names += name.len() as u64;
        self.topics += 1;
        Ok(Channel(channel))
    }

    /// Adds a message to the open chunk, and begins a chunk if none is open.
    ///
    /// # Errors
    /// Never in practice: any bytes can be packed.
    pub fn write(
        &mut self,
        channel: Channel,
        times: Times,
        sequence: u64,
        message: &[u8],
    ) -> Result<(), WriteError> {
        let header = MessageHeader {
            channel_id: channel.0,
            // MCAP has 32 bits; the whole number stands in the stamp.
            sequence: sequence as u32,
            log_time: times.log,
            publish_time: times.publish,
        };
        self.writer.write_to_known_channel(&header, message)?;
        self.chunk.bytes += PREFIX + 22 + message.len() as u64;
        self.chunk.messages += 1;
        Ok(())
    }

    /// Writes that the calendar was set, and ends the open chunk.
    ///
    /// # Errors
    /// Never in practice.
    pub fn step(&mut self, step: &Step) -> Result<(), WriteError> {
        self.flush()?;
        self.note(calendar::NAME, step.to_texts())?;
        self.indexes += NOTE_INDEX;
        Ok(())
    }

    /// How many bytes [`Journal::step`] may add to the file, besides the open chunk.
    pub const fn room_for_a_step() -> u64 {
        STEP + NOTE_INDEX
    }

    /// Ends the open chunk. The caller can take its bytes then, so a later kill does not lose them.
    ///
    /// # Errors
    /// Never in practice.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        if self.chunk.bytes > 0 {
            self.writer.flush()?;
            self.chunk = Chunk::default();
            self.indexes += self.index();
        }
        Ok(())
    }

    /// Moves all bytes that are ready to the end of `into`.
    pub fn take(&mut self, into: &mut Vec<u8>) {
        into.append(&mut self.out.0.borrow_mut().ready);
    }

    /// Bytes of the file so far, without the chunk that is open.
    pub fn length(&self) -> u64 {
        self.out.0.borrow().length
    }

    /// Bytes in the chunk that is open, before they are packed.
    pub fn open(&self) -> u64 {
        self.chunk.bytes
    }

    /// How many bytes the file may grow if `more` bytes of messages come into the open chunk and
    /// the file then ends. A message is at least as long as a stamp in JSON, so a chunk's index is
    /// shorter than the chunk.
    pub fn room(&self, more: u64) -> u64 {
        let chunk = self.chunk.bytes + more;
        // LZ4 adds one byte for 255 that it cannot pack; the index has 16 bytes for each message.
        let packed = 2 * chunk + 1024;
        packed + self.indexes + self.index() + self.end_without_indexes()
    }

    /// Ends the file with `counts`, its index and its CRCs, and returns the last bytes.
    ///
    /// # Errors
    /// Never in practice.
    pub fn end(mut self, counts: &Counts) -> Result<Vec<u8>, WriteError> {
        self.flush()?;
        self.note(counts::NAME, counts::to_texts(counts))?;
        self.writer.finish()?;
        let mut last = Vec::new();
        self.take(&mut last);
        Ok(last)
    }

    fn note(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<(), WriteError> {
        let name = name.to_owned();
        self.writer.write_metadata(&Metadata { name, metadata })?;
        Ok(())
    }

    /// The bytes of one chunk's index at the end.
    fn index(&self) -> u64 {
        PREFIX + 80 + 10 * self.topics
    }

    fn end_without_indexes(&self) -> u64 {
        let counts = PREFIX + 32 + self.names + COUNT * self.topics;
        let statistics = PREFIX + 64 + 10 * self.topics;
        // Two metadata indexes, six offsets, end of data, footer and magic.
        counts + self.described + statistics + 2 * NOTE_INDEX + 6 * (PREFIX + 17) + 64
    }
}

/// Where the bytes wait until somebody takes them; all clones share it.
#[derive(Clone, Default)]
struct Out(Rc<RefCell<Waiting>>);

#[derive(Default)]
struct Waiting {
    ready: Vec<u8>,
    /// All bytes that ever came, taken or not.
    length: u64,
}

impl Write for Out {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut waiting = self.0.borrow_mut();
        waiting.ready.extend_from_slice(bytes);
        waiting.length += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Out {
    /// Tells its position and can do nothing else: bytes that somebody has taken cannot change.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.0.borrow().length),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
