//! What the scenarios send between two processes: 64 bytes whose every word is checked, and the
//! topics of the typed ports for them.

use lager_topics::{Qos, Role, SensorLine, Topic, payload};

payload! {
    /// A payload of 64 bytes.
    pub struct Sample: 64 bytes {
        /// Which one it is, unique within a measurement.
        pub number: u64,
        /// What follows from the number.
        pub rest: [u64; 7],
    }
}

/// Bytes of a sample.
pub(crate) const SIZE: usize = size_of::<Sample>();

impl Sample {
    /// The sample with that number.
    pub(crate) fn new(number: u64) -> Self {
        Self {
            number,
            rest: core::array::from_fn(|index| number ^ index as u64),
        }
    }

    /// Whether every word is what [`Sample::new`] wrote.
    pub(crate) fn is_whole(&self) -> bool {
        *self == Self::new(self.number)
    }

    /// As eight words.
    pub(crate) fn words(&self) -> [u64; 8] {
        let mut words = [self.number; 8];
        words[1..].copy_from_slice(&self.rest);
        words
    }

    /// From eight words.
    pub(crate) fn from_words(words: [u64; 8]) -> Self {
        let [number, rest @ ..] = words;
        Self { number, rest }
    }

    /// As bytes, for what carries bytes only.
    pub(crate) fn bytes(&self) -> [u8; SIZE] {
        let mut bytes = [0; SIZE];
        for (to, word) in bytes.chunks_exact_mut(8).zip(self.words()) {
            to.copy_from_slice(&word.to_ne_bytes());
        }
        bytes
    }

    /// From bytes.
    pub(crate) fn from_bytes(bytes: &[u8; SIZE]) -> Self {
        Self::from_words(core::array::from_fn(|index| {
            let mut word = [0; 8];
            word.copy_from_slice(&bytes[8 * index..8 * index + 8]);
            u64::from_ne_bytes(word)
        }))
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_the_same_whatever_carried_it() {
        let sample = Sample::new(0x0123_4567_89ab_cdef);
        assert_eq!(SIZE, 64);
        assert_eq!(Sample::from_words(sample.words()), sample);
        assert_eq!(Sample::from_bytes(&sample.bytes()), sample);
    }

    #[test]
    fn a_changed_word_is_noticed() {
        let mut words = Sample::new(9).words();
        assert!(Sample::from_words(words).is_whole());
        words[5] ^= 1 << 40;
        assert!(!Sample::from_words(words).is_whole());
    }
}
