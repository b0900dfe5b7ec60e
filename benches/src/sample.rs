//! The samples that the scenarios send between processes: blocks of words that the receiver checks,
//! and the topics of the typed ports for them.

use iceoryx2::prelude::ZeroCopySend;
use lager_ports::Subscriber;
use lager_sample::{Field, FieldInfo, LARGEST_COPY, Make, Payload, Qos, Schema, StructInfo, Topic};
use lager_topics::{Role, SensorLine};
use serde::{Deserialize, Serialize};

use crate::error::{Fault, broken};

/// A payload of `WORDS` words of 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ZeroCopySend)]
#[type_name("lager::bench::Block")]
pub(crate) struct Block<const WORDS: usize> {
    /// The first word is the number of the block.
    #[serde(with = "lager_sample::list")]
    pub(crate) words: [u64; WORDS],
}

/// Calls a function for a sample of so many words, one of [`SIZES`].
macro_rules! for_words {
    ($words:expr, $function:ident($($argument:expr),*)) => {
        match $words {
            1 => $function::<1>($($argument),*),
            2 => $function::<2>($($argument),*),
            8 => $function::<8>($($argument),*),
            32 => $function::<32>($($argument),*),
            128 => $function::<128>($($argument),*),
            512 => $function::<512>($($argument),*),
            2_048 => $function::<2_048>($($argument),*),
            8_192 => $function::<8_192>($($argument),*),
            32_768 => $function::<32_768>($($argument),*),
            _ => $function::<131_072>($($argument),*),
        }
    };
}
pub(crate) use for_words;

/// The sizes of a sample that a hop can have, in bytes. Each is a type of its own.
pub const SIZES: [usize; 10] = [
    8, 16, 64, 256, 1_024, 4_096, 16_384, 65_536, 262_144, 1_048_576,
];

/// A payload of 64 bytes.
pub(crate) type Sample = Block<8>;

/// The size of a sample in bytes.
pub(crate) const SIZE: usize = size_of::<Sample>();

impl<const WORDS: usize> Block<WORDS> {
    /// The block with that number. All its words follow from the number.
    pub(crate) fn new(number: u64) -> Self {
        Self {
            words: core::array::from_fn(|index| number ^ index as u64),
        }
    }

    /// The block's number, unique within a measurement.
    pub(crate) const fn number(&self) -> u64 {
        self.words[0]
    }

    /// Gives it another number in its first and last word, without a look at those between.
    pub(crate) const fn mark(&mut self, number: u64) {
        self.words[0] = number;
        self.words[WORDS - 1] = number ^ (WORDS as u64 - 1);
    }

    /// The number, if first and last word agree on it.
    pub(crate) const fn marked(&self) -> Option<u64> {
        let last = self.words[WORDS - 1] ^ (WORDS as u64 - 1);
        if last == self.words[0] {
            Some(last)
        } else {
            None
        }
    }

    /// Whether every word is the one that [`Block::new`] wrote.
    pub(crate) fn is_whole(&self) -> bool {
        *self == Self::new(self.number())
    }

    /// The block with these bytes ([`lager_sample::bytes_of`]); missing bytes are 0.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Self {
        let mut block = Self::default();
        for (word, bytes) in block.words.iter_mut().zip(bytes.chunks_exact(8)) {
            *word = u64::from_ne_bytes(bytes.try_into().expect("chunks of eight"));
        }
        block
    }
}

// SAFETY: it is an array of words without padding, and every bit pattern is a valid word.
#[allow(unsafe_code)]
unsafe impl<const WORDS: usize> Field for Block<WORDS> {
    const MAKE: Make = Make::Record(StructInfo::of::<Self>());
    const SHAPE: u64 = <Self as Schema>::HASH;
    const BLANK: Self = Self { words: [0; WORDS] };
}

impl<const WORDS: usize> Default for Block<WORDS> {
    fn default() -> Self {
        Self::BLANK
    }
}

impl<const WORDS: usize> Schema for Block<WORDS> {
    const TYPE_NAME: &'static str = "lager::bench::Block";
    // All processes of a measurement run the same program, so any constant will do.
    const HASH: u64 = WORDS as u64;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo {
        name: "words",
        type_name: "[u64]",
        offset: 0,
        size: 8 * WORDS,
        make: <[u64; WORDS]>::MAKE,
    }];
}

impl<const WORDS: usize> Payload for Block<WORDS> {}

/// The queue for blocks of so many words. Small ones have `sensor/line`'s depth. Large ones have depth
/// 1, because a publisher keeps memory for every sample that could lie in a subscriber's queue.
pub(crate) const fn depth(words: usize) -> usize {
    match words {
        ..=512 => SensorLine::QOS.buffer,
        _ => 1,
    }
}

/// From the sender to the receiver; as wide as `sensor/line`.
pub(crate) struct Ping<const WORDS: usize = 8>;

impl<const WORDS: usize> Topic for Ping<WORDS> {
    const NAME: &'static str = "bench/ping";
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        buffer: depth(WORDS),
        copied: 8 * WORDS <= LARGEST_COPY,
        actors: &[RECEIVER.part()],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the sender of a measurement to the receiver.";
}

/// From the receiver back to the sender; as wide as `sensor/line`.
pub(crate) struct Pong<const WORDS: usize = 8>;

impl<const WORDS: usize> Topic for Pong<WORDS> {
    const NAME: &'static str = "bench/pong";
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        buffer: depth(WORDS),
        copied: 8 * WORDS <= LARGEST_COPY,
        actors: &[SENDER.part()],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the receiver of a measurement back to the sender.";
}

/// The sender's role on the bus.
pub(crate) const SENDER: Role = Role::Bridge;

/// The receiver's role on the bus.
pub(crate) const RECEIVER: Role = Role::Logic;

/// Receives and drops all samples in the queue.
pub(crate) fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), Fault> {
    while subscriber.receive().map_err(broken)?.is_some() {}
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_sample::bytes_of;

    #[test]
    fn a_sample_is_the_same_whatever_carried_it_and_a_changed_word_is_noticed() {
        let mut sample = Sample::new(0x0123_4567_89ab_cdef);
        assert_eq!(SIZE, 64);
        assert_eq!(Sample::from_bytes(bytes_of(&sample)), sample);
        assert!(sample.is_whole());
        sample.words[5] ^= 1 << 40;
        assert!(!sample.is_whole());
    }

    #[test]
    fn a_block_of_any_size_is_marked_at_both_ends() {
        fn check<const WORDS: usize>() {
            let mut block = Block::<WORDS>::new(1 << 40);
            assert_eq!(block.marked(), Some(1 << 40));
            block.mark(7);
            assert_eq!((block.number(), block.marked()), (7, Some(7)));
            block.words[WORDS - 1] ^= 1 << 9;
            assert_eq!(block.marked(), (WORDS == 1).then_some(7 ^ (1 << 9)));
        }
        check::<1>();
        check::<2>();
        check::<512>();
    }

    #[test]
    #[allow(unsafe_code)]
    fn bare_iceoryx2_knows_it_by_the_name_that_the_ports_use() {
        // SAFETY: the function only returns a name.
        let bare = unsafe { <Sample as ZeroCopySend>::type_name() };
        assert_eq!(bare, Sample::TYPE_NAME);
    }
}
