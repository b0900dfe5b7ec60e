//! What is published: blocks of several sizes, and a topic for each.

use iceoryx2::prelude::ZeroCopySend;
use lager_topics::{Field, FieldInfo, Make, Payload, Qos, Schema, SensorLine, StructInfo, Topic};
use serde::{Deserialize, Serialize};

/// A payload of `WORDS` words of eight bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Block<const WORDS: usize> {
    /// The first one is the number of the block.
    #[serde(with = "lager_topics::list")]
    pub(crate) words: [u64; WORDS],
}

// SAFETY: `repr(C)`, words without padding, no pointer inside.
#[allow(unsafe_code)]
unsafe impl<const WORDS: usize> ZeroCopySend for Block<WORDS> {
    unsafe fn type_name() -> &'static str {
        <Self as Schema>::TYPE_NAME
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

/// The topic of blocks of that size. Small ones have `sensor/line`'s depth; large ones the least
/// there is, since a publisher keeps memory for every place that a subscriber could fill.
pub(crate) struct Fan<const WORDS: usize>;

impl<const WORDS: usize> Topic for Fan<WORDS> {
    const NAME: &'static str = "bench/fan";
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        buffer: if WORDS > 512 {
            1
        } else {
            SensorLine::QOS.buffer
        },
        actors: &[],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the publisher of a measurement to all that read.";
}
