//! The messages of a file by their log time, found through its index.

use mcap::sans_io::indexed_reader::{IndexedReadEvent, IndexedReader, IndexedReaderOptions};

use crate::overview::Overview;
use crate::read::{Part, ReadError};
use crate::write::Times;

/// Which messages are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Topics by name; `None` for all.
    pub topics: Option<Vec<String>>,
    /// No earlier log time, in ns since 1970.
    pub from_ns: Option<u64>,
    /// Only earlier log times, in ns since 1970.
    pub before_ns: Option<u64>,
}

/// Reads messages by their log time.
pub struct Ordered<'file> {
    overview: &'file Overview,
    reader: IndexedReader,
    wanted: u64,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step<'a> {
    /// These bytes are wanted, all of them.
    Wants(Part),
    /// A message.
    Message {
        /// The topic's name.
        topic: &'a str,
        /// When it was.
        times: Times,
        /// The message.
        message: &'a [u8],
    },
}

impl<'file> Ordered<'file> {
    /// For the file that `overview` is of.
    ///
    /// # Errors
    /// The index is damaged, or the selection ends before it begins.
    pub fn new(overview: &'file Overview, selection: &Selection) -> Result<Self, ReadError> {
        let mut options = IndexedReaderOptions::new();
        if let Some(topics) = &selection.topics {
            options = options.include_topics(topics.iter().map(String::as_str));
        }
        if let Some(from) = selection.from_ns {
            options = options.starting_at(from);
        }
        if let Some(before) = selection.before_ns {
            options = options.ending_before(before);
        }
        Ok(Self {
            overview,
            reader: IndexedReader::new_with_options(&overview.summary, options)?,
            wanted: 0,
        })
    }

    /// What comes next; `None` at the end.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn step(&mut self) -> Option<Result<Step<'_>, ReadError>> {
        let step = match self.reader.next_event()? {
            Ok(IndexedReadEvent::ReadChunkRequest { offset, length }) => {
                self.wanted = offset;
                Step::Wants(Part { at: offset, length })
            }
            Ok(IndexedReadEvent::Message { header, data }) => {
                let channel = self.overview.summary.channels.get(&header.channel_id);
                Step::Message {
                    topic: channel.map_or("", |channel| channel.topic.as_str()),
                    times: Times {
                        log: header.log_time,
                        publish: header.publish_time,
                    },
                    message: data,
                }
            }
            Err(error) => return Some(Err(error.into())),
        };
        Some(Ok(step))
    }

    /// Takes the bytes that were wanted last.
    ///
    /// # Errors
    /// They are damaged, or not as many as were wanted.
    pub fn supply(&mut self, bytes: &[u8]) -> Result<(), ReadError> {
        Ok(self.reader.insert_chunk_record_data(self.wanted, bytes)?)
    }
}
