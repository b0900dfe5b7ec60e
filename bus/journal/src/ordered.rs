//! The messages of a file by their log time, found through its index.

use mcap::sans_io::indexed_reader::{
    IndexedReadEvent, IndexedReader, IndexedReaderOptions, ReadOrder,
};

use crate::overview::Overview;
use crate::read::{Part, ReadError};
use crate::unpack::Zstd;
use crate::walk::LONGEST;
use crate::write::Times;

/// Which messages to read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Topics by name; `None` for all.
    pub topics: Option<Vec<String>>,
    /// Only log times from here on, in ns since 1970.
    pub from_ns: Option<u64>,
    /// Only log times before this, in ns since 1970.
    pub before_ns: Option<u64>,
    /// The latest first.
    pub is_backwards: bool,
}

/// Reads messages by their log time.
pub struct Ordered<'file> {
    overview: &'file Overview,
    /// `None` if the file has none of the topics.
    reader: Option<IndexedReader>,
    wanted: u64,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step<'a> {
    /// The reader needs these bytes, all of them.
    Wants(Part),
    /// A message.
    Message(Placed<'a>),
}

/// A message with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placed<'a> {
    /// The topic's name.
    pub topic: &'a str,
    /// Whether it is the topic's last sample from before the file.
    pub is_repeated: bool,
    /// Its log time.
    pub times: Times,
    /// The message.
    pub message: &'a [u8],
}

impl<'file> Ordered<'file> {
    /// A reader of the file that `overview` describes.
    ///
    /// # Errors
    /// The index is damaged, the selection ends before it begins, or messages stand outside of
    /// chunks, where the index cannot find them.
    pub fn new(overview: &'file Overview, selection: &Selection) -> Result<Self, ReadError> {
        if overview.has_loose {
            return Err(ReadError::Loose);
        }
        let mut options = IndexedReaderOptions::new();
        options.record_length_limit = Some(LONGEST);
        if selection.is_backwards {
            options = options.with_order(ReadOrder::ReverseLogTime);
        }
        if let Some(topics) = &selection.topics {
            let mut channels = overview.summary.channels.values();
            if !channels.any(|channel| topics.contains(&channel.topic)) {
                // The reader takes "no channel" as "every channel".
                return Ok(Self {
                    overview,
                    reader: None,
                    wanted: 0,
                });
            }
            options = options.include_topics(topics.iter().map(String::as_str));
        }
        if let Some(from) = selection.from_ns {
            options = options.starting_at(from);
        }
        if let Some(before) = selection.before_ns {
            options = options.ending_before(before);
        }
        let mut reader = IndexedReader::new_with_options(&overview.summary, options)?;
        reader.add_decompressor(Zstd)?;
        Ok(Self {
            overview,
            reader: Some(reader),
            wanted: 0,
        })
    }

    /// What comes next; `None` at the end.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn step(&mut self) -> Option<Result<Step<'_>, ReadError>> {
        let step = match self.reader.as_mut()?.next_event()? {
            Ok(IndexedReadEvent::ReadChunkRequest { offset, length }) => {
                self.wanted = offset;
                Step::Wants(Part { at: offset, length })
            }
            Ok(IndexedReadEvent::Message { header, data }) => {
                let channel = self.overview.summary.channels.get(&header.channel_id);
                Step::Message(Placed {
                    topic: channel.map_or("", |channel| channel.topic.as_str()),
                    is_repeated: self.overview.repeated.contains(&header.channel_id),
                    times: Times {
                        log: header.log_time,
                        publish: header.publish_time,
                    },
                    message: data,
                })
            }
            Err(error) => return Some(Err(error.into())),
        };
        Some(Ok(step))
    }

    /// Takes the bytes that it needed.
    ///
    /// # Errors
    /// They are damaged, or their number is wrong.
    pub fn supply(&mut self, bytes: &[u8]) -> Result<(), ReadError> {
        match &mut self.reader {
            Some(reader) => Ok(reader.insert_chunk_record_data(self.wanted, bytes)?),
            None => Ok(()),
        }
    }
}
