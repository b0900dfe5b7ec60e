//! The result of a verification. The program that called the verifier makes sentences of it.

use lager_sample::Topic;
use lager_topics::{NavInputs, NavigatorInput};

use crate::bag::BagError;

/// Why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// It has no `nav/inputs`.
    #[error(
        "it has no {}, so nothing says what the navigator was told; record it with all topics, or \
         with --topic {}",
        NavInputs::NAME,
        NavInputs::NAME
    )]
    NoInputs,
    /// The recording's samples have another layout than today's.
    #[error(
        "{topic} was recorded by another version of lager, whose samples have other fields; verify \
         it with that version"
    )]
    Layout {
        /// The topic.
        topic: &'static str,
    },
    /// A message cannot be read.
    #[error("{topic}: a message cannot be read ({error}); `lager bag check` says more")]
    Message {
        /// The topic.
        topic: &'static str,
        /// Why.
        error: serde_json::Error,
    },
    /// This build's navigator cannot take the recorded input.
    #[error("{0}")]
    Rerun(String),
}

/// Samples of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OfTopic {
    /// Samples that the followed navigators have sent.
    pub sent: u64,
    /// How many of them are equal in the recording, byte by byte, up to the first difference.
    pub same: u64,
    /// Samples in the recording that follow from no input there. They come from the last moments of
    /// a killed navigator, from the recording's beginning or end, or from a gap.
    pub unexplained: u64,
}

/// The compared samples, by topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// `steering/command`.
    pub commands: OfTopic,
    /// `nav/status`.
    pub statuses: OfTopic,
    /// `mission/event`.
    pub events: OfTopic,
}

/// A difference.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The number of the entry, counted from its navigator's start.
    pub number: u64,
    /// When its piece was published, in ns since the recording's beginning.
    pub at_ns: u64,
    /// The entry in the recording.
    pub recorded: NavigatorInput,
    /// The navigator's entry now.
    pub now: NavigatorInput,
    /// The sample that differs, if the entry itself is equal.
    pub sample: Option<SampleDifference>,
}

/// A sample that differs from the navigator's sample now, both in JSON.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleDifference {
    /// Its topic.
    pub topic: &'static str,
    /// Its number.
    pub number: u64,
    /// The sample in the recording.
    pub recorded: String,
    /// The navigator's sample now; empty if it sends none.
    pub now: String,
}

impl Difference {
    /// Whether the orders in force differ.
    pub fn is_of_command(&self) -> bool {
        let order = |entry: &NavigatorInput| (entry.command_id, entry.code, entry.arm_granted);
        order(&self.recorded) != order(&self.now)
    }
}

/// A part of the recording that the verifier could not compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Where it begins, in ns since the recording's beginning.
    pub at_ns: u64,
    /// Why.
    pub why: Why,
    /// How many recorded inputs it has.
    pub inputs: u64,
}

/// Why a part of a recording cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The navigator had started before the recording began.
    BegunBefore,
    /// So many samples of `nav/inputs` are missing.
    Missing(u64),
    /// The numbers of the entries have a hole: the navigator's shell could not publish a piece.
    Unpublished,
}

/// The result.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// Navigators that the verifier followed from their start.
    pub navigators: u64,
    /// Inputs that a navigator got again.
    pub inputs: u64,
    /// Compared samples, by topic.
    pub compared: Compared,
    /// The parts that could not be compared.
    pub gaps: Vec<Gap>,
    /// The first difference.
    pub first: Option<Difference>,
    /// The first command that differs.
    pub first_command: Option<Difference>,
}

impl Verified {
    /// Whether all of the recording's `nav/inputs` was compared and is equal.
    pub fn is_identical(&self) -> bool {
        self.navigators > 0 && self.gaps.is_empty() && self.first.is_none()
    }
}
