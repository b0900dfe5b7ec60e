//! What the scenarios send between processes: blocks of words that are checked, and the topics of
//! the typed ports for them.

use iceoryx2::prelude::ZeroCopySend;
use lager_ports::Subscriber;
use lager_topics::{
    Field, FieldInfo, Make, Payload, Qos, Role, Schema, SensorLine, StructInfo, Topic,
};
use serde::{Deserialize, Serialize};

use crate::error::{Fault, broken};

/// A payload of `WORDS` words of eight bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ZeroCopySend)]
#[type_name("lager::bench::Block")]
pub(crate) struct Block<const WORDS: usize> {
    /// The first one is the number of the block.
    #[serde(with = "lager_topics::list")]
    pub(crate) words: [u64; WORDS],
}

/// A payload of 64 bytes.
pub(crate) type Sample = Block<8>;

/// Bytes of a sample.
pub(crate) const SIZE: usize = size_of::<Sample>();

impl<const WORDS: usize> Block<WORDS> {
    /// The block with that number, from which all its words follow.
    pub(crate) fn new(number: u64) -> Self {
        Self {
            words: core::array::from_fn(|index| number ^ index as u64),
        }
    }

    /// Which one it is, unique within a measurement.
    pub(crate) const fn number(&self) -> u64 {
        self.words[0]
    }

    /// Whether every word is what [`Block::new`] wrote.
    pub(crate) fn is_whole(&self) -> bool {
        *self == Self::new(self.number())
    }

    /// From its bytes ([`lager_topics::bytes_of`]); what is missing of them is 0.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Self {
        let mut block = Self::default();
        for (word, bytes) in block.words.iter_mut().zip(bytes.chunks_exact(8)) {
            *word = u64::from_ne_bytes(bytes.try_into().expect("chunks of eight"));
        }
        block
    }
}

// SAFETY: words, of which any bits are one, without padding.
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
    // It lives no longer than a measurement, in which all processes are one executable.
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

/// From the sender to the receiver; as wide and deep as `sensor/line`.
pub(crate) struct Ping;

impl Topic for Ping {
    const NAME: &'static str = "bench/ping";
    type Payload = Sample;
    const QOS: Qos = Qos {
        actors: &[RECEIVER],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the sender of a measurement to the receiver.";
}

/// From the receiver back to the sender; as wide and deep as `sensor/line`.
pub(crate) struct Pong;

impl Topic for Pong {
    const NAME: &'static str = "bench/pong";
    type Payload = Sample;
    const QOS: Qos = Qos {
        actors: &[SENDER],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the receiver of a measurement back to the sender.";
}

/// What the sender is on the bus.
pub(crate) const SENDER: Role = Role::Bridge;

/// What the receiver is on the bus.
pub(crate) const RECEIVER: Role = Role::Logic;

/// Receives all that there is.
pub(crate) fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), Fault> {
    while subscriber.receive().map_err(broken)?.is_some() {}
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_topics::bytes_of;

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
    #[allow(unsafe_code)]
    fn bare_iceoryx2_knows_it_by_the_name_that_the_ports_use() {
        // SAFETY: it returns a name.
        let bare = unsafe { <Sample as ZeroCopySend>::type_name() };
        assert_eq!(bare, Sample::TYPE_NAME);
    }
}
