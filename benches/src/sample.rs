//! What travels in the scenarios between two processes: 64 bytes whose every word is checked, and
//! the topics they travel on when the typed ports carry them.

use iceoryx2::prelude::ZeroCopySend;
use lager_topics::{
    Field, FieldInfo, Make, Payload, Qos, Role, Schema, SensorLine, StructInfo, Topic,
};
use serde::{Deserialize, Serialize};

/// A payload of 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Ball {
    /// Which one it is, unique within a measurement.
    pub(crate) number: u64,
    /// What follows from the number.
    pub(crate) rest: [u64; 7],
}

/// Bytes of a ball.
pub(crate) const SIZE: usize = size_of::<Ball>();

impl Ball {
    /// The ball with that number.
    pub(crate) fn new(number: u64) -> Self {
        Self {
            number,
            rest: core::array::from_fn(|index| number ^ index as u64),
        }
    }

    /// Whether every word is what [`Ball::new`] wrote.
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

// SAFETY: `repr(C)`, eight words without padding, no pointer inside.
#[allow(unsafe_code)]
unsafe impl ZeroCopySend for Ball {
    unsafe fn type_name() -> &'static str {
        <Self as Schema>::TYPE_NAME
    }
}

// SAFETY: eight words, of which any bits are one, without padding.
#[allow(unsafe_code)]
unsafe impl Field for Ball {
    const MAKE: Make = Make::Record(StructInfo::of::<Self>());
    const SHAPE: u64 = <Self as Schema>::HASH;
    const BLANK: Self = Self {
        number: 0,
        rest: [0; 7],
    };
}

impl Schema for Ball {
    const TYPE_NAME: &'static str = "lager::bench::Ball";
    // It lives no longer than a measurement, in which all processes are one executable.
    const HASH: u64 = 0xba11;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo {
            name: "number",
            type_name: "u64",
            offset: 0,
            size: 8,
            make: u64::MAKE,
        },
        FieldInfo {
            name: "rest",
            type_name: "[u64; 7]",
            offset: 8,
            size: 56,
            make: <[u64; 7]>::MAKE,
        },
    ];
}

impl Payload for Ball {}

/// From the first process to the second; as wide and deep as `sensor/line`.
pub(crate) struct Ping;

impl Topic for Ping {
    const NAME: &'static str = "bench/ping";
    type Payload = Ball;
    const QOS: Qos = Qos {
        actors: &[SECOND],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the first process of a measurement to the second.";
}

/// From the second process to the first; as wide and deep as `sensor/line`.
pub(crate) struct Pong;

impl Topic for Pong {
    const NAME: &'static str = "bench/pong";
    type Payload = Ball;
    const QOS: Qos = Qos {
        actors: &[FIRST],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the second process of a measurement to the first.";
}

/// What the first process is on the bus.
pub(crate) const FIRST: Role = Role::Bridge;

/// What the second process is on the bus.
pub(crate) const SECOND: Role = Role::Logic;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_the_same_after_any_way_of_travelling() {
        let ball = Ball::new(0x0123_4567_89ab_cdef);
        assert_eq!(SIZE, 64);
        assert_eq!(Ball::from_words(ball.words()), ball);
        assert_eq!(Ball::from_bytes(&ball.bytes()), ball);
    }

    #[test]
    fn a_changed_word_is_noticed() {
        let mut words = Ball::new(9).words();
        assert!(Ball::from_words(words).is_whole());
        words[5] ^= 1 << 40;
        assert!(!Ball::from_words(words).is_whole());
    }
}
