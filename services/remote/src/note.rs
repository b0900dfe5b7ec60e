//! [`Note`]: what stands beside each sample, as the attachment of a Zenoh message.
//!
//! ```text
//!  byte  0       version of this layout: 1
//!        1       bit 0: an answer to a query, which repeats what was sent before
//!                bit 1: the topic has a limit of its rate
//!        2..8    0
//!        8..64   the sample's stamp as on the bus:
//!                sequence, source, cause's publication and reception, publication, epoch: u64
//!                writer, cause's topic: u32
//!       64..72   run: when the gateway began, in ns of the robot's CLOCK_MONOTONIC
//!       72..80   number: of this message among those of its topic in this run, from 0
//!       80..88   how many samples of the topic the gateway has left out by its limit in this run
//!       88..96   how many samples of the topic the bus had lost before the gateway in this run
//!       96..104  the layout of the payload, as a number
//! ```
//!
//! All numbers are little-endian. Both counts include everything before this sample, so a listener
//! that misses messages still knows them ([`Ledger`](crate::Ledger)).

use core::fmt;

use lager_sample::{Stamp, id};

/// The version of the layout.
const VERSION: u8 = 1;
const ANSWER: u8 = 1;
const LIMITED: u8 = 2;

/// What stands beside a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    /// The sample's stamp on the bus.
    pub stamp: Stamp,
    /// Whether it is the answer to a query, and repeats a message that was sent before.
    pub is_answer: bool,
    /// Whether the topic's rate is limited.
    pub is_limited: bool,
    /// What the gateway has counted up to this message; [`Counts::next`] is this message's number
    /// and one more.
    pub counts: Counts,
    /// The payload's layout, as [`layout_number`] makes it.
    pub layout: u64,
}

/// What a gateway has counted of one topic since it began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// When this gateway began, in ns of the robot's `CLOCK_MONOTONIC`: which gateway has counted.
    pub run: u64,
    /// How many messages it has sent, and so the next one's number.
    pub next: u64,
    /// How many samples it has left out by its limit.
    pub left_out: u64,
    /// How many samples the bus had lost before it.
    pub lost: u64,
}

/// The bytes are no note.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoteError {
    /// There are too few or too many.
    Length(usize),
    /// Another version wrote them.
    Version(u8),
    /// The number is one that no message can have.
    Number,
}

impl fmt::Display for NoteError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(bytes) => write!(
                formatter,
                "a sample's attachment has {bytes} bytes and not {}, so no gateway of a robot sent it",
                Note::SIZE
            ),
            Self::Version(version) => write!(
                formatter,
                "a sample's attachment has version {version}, and this program reads version {VERSION}; \
                 use the same version on both machines"
            ),
            Self::Number => formatter.write_str(
                "a sample's attachment has a number that no sample can have, so no gateway of a robot sent it",
            ),
        }
    }
}

impl std::error::Error for NoteError {}

/// A layout as a number, by its text.
pub fn layout_number(text: &str) -> u64 {
    // Two halves that are mixed well, each by the hash of a topic's name.
    let back: String = text.chars().rev().collect();
    (u64::from(id(text)) << 32) | u64::from(id(&back))
}

impl Note {
    /// How many bytes a note has.
    pub const SIZE: usize = 104;

    /// This message's number, from 0.
    pub fn number(&self) -> u64 {
        self.counts.next.saturating_sub(1)
    }

    /// The note as bytes.
    pub fn to_bytes(&self) -> [u8; Self::SIZE] {
        let mut bytes = [0; Self::SIZE];
        bytes[0] = VERSION;
        bytes[1] = (u8::from(self.is_answer) * ANSWER) | (u8::from(self.is_limited) * LIMITED);
        let stamp = &self.stamp;
        let long = [
            stamp.sequence,
            stamp.source_time_ns,
            stamp.cause_publish_time_ns,
            stamp.cause_receive_time_ns,
            stamp.publish_time_ns,
            stamp.epoch,
            u64::from(stamp.writer) | (u64::from(stamp.cause_topic) << 32),
            self.counts.run,
            self.number(),
            self.counts.left_out,
            self.counts.lost,
            self.layout,
        ];
        for (place, number) in bytes[8..].chunks_exact_mut(8).zip(long) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    /// The note of these bytes, which may be anything.
    ///
    /// # Errors
    /// The bytes are no note of this version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NoteError> {
        let bytes: &[u8; Self::SIZE] = bytes
            .try_into()
            .map_err(|_| NoteError::Length(bytes.len()))?;
        if bytes[0] != VERSION {
            return Err(NoteError::Version(bytes[0]));
        }
        let mut long = [0; 12];
        for (number, place) in long.iter_mut().zip(bytes[8..].chunks_exact(8)) {
            *number = u64::from_le_bytes(place.first_chunk().copied().unwrap_or_default());
        }
        let [
            sequence,
            source,
            cause_publish,
            cause_receive,
            publish,
            epoch,
            ids,
            run,
            number,
            left_out,
            lost,
            layout,
        ] = long;
        Ok(Self {
            stamp: Stamp {
                sequence,
                source_time_ns: source,
                cause_publish_time_ns: cause_publish,
                cause_receive_time_ns: cause_receive,
                publish_time_ns: publish,
                epoch,
                // The lower and the upper half.
                writer: ids as u32,
                cause_topic: (ids >> 32) as u32,
            },
            is_answer: bytes[1] & ANSWER != 0,
            is_limited: bytes[1] & LIMITED != 0,
            counts: Counts {
                run,
                next: number.checked_add(1).ok_or(NoteError::Number)?,
                left_out,
                lost,
            },
            layout,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn note() -> Note {
        Note {
            stamp: Stamp {
                sequence: 1,
                source_time_ns: 2,
                cause_publish_time_ns: 3,
                cause_receive_time_ns: 4,
                publish_time_ns: 5,
                epoch: 6,
                writer: 7,
                cause_topic: 8,
            },
            is_answer: false,
            is_limited: true,
            counts: Counts {
                run: 9,
                next: 11,
                left_out: 11,
                lost: 12,
            },
            layout: 13,
        }
    }

    #[test]
    fn the_bytes_are_golden() {
        let mut expected = vec![1, 2, 0, 0, 0, 0, 0, 0];
        for number in [1_u64, 2, 3, 4, 5, 6] {
            expected.extend(number.to_le_bytes());
        }
        expected.extend([7, 0, 0, 0, 8, 0, 0, 0]);
        for number in [9_u64, 10, 11, 12, 13] {
            expected.extend(number.to_le_bytes());
        }
        assert_eq!(note().to_bytes().as_slice(), expected);
        // The stamp lies in it as on the bus, so that readers of the bus can read it.
        #[cfg(target_endian = "little")]
        assert_eq!(&expected[8..64], lager_sample::bytes_of(&note().stamp));
        assert_eq!(Note::from_bytes(&expected), Ok(note()));
    }

    #[test]
    fn what_is_no_note_is_refused_with_its_reason() {
        let mut bytes = note().to_bytes();
        for wrong in [0, 103] {
            let refused = Note::from_bytes(&bytes[..wrong]).expect_err("it is short");
            assert!(refused.to_string().contains(&format!("{wrong} bytes")));
        }
        bytes[0] = 2;
        let refused = Note::from_bytes(&bytes).expect_err("another version");
        assert!(
            refused.to_string().contains("the same version on both"),
            "{refused}"
        );
        bytes[0] = 1;
        bytes[72..80].fill(255);
        assert_eq!(Note::from_bytes(&bytes), Err(NoteError::Number));
    }

    #[test]
    fn layouts_that_differ_have_different_numbers() {
        assert_ne!(layout_number("A{a:u8}"), layout_number("A{a:i8}"));
        assert_ne!(
            layout_number("A{a:u8,b:u16}"),
            layout_number("A{b:u16,a:u8}")
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_note_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..220)) {
            let _ = Note::from_bytes(&bytes);
        }

        #[test]
        fn a_note_of_any_content_comes_back(mut bytes in proptest::collection::vec(any::<u8>(), Note::SIZE)) {
            bytes[0] = VERSION;
            bytes[1] &= ANSWER | LIMITED;
            bytes[2..8].fill(0);
            if let Ok(note) = Note::from_bytes(&bytes) {
                prop_assert_eq!(note.to_bytes().to_vec(), bytes);
            }
        }
    }
}
