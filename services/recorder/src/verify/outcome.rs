//! What came of a verification, for the program that asked for it to say.

use lager_topics::{NavInputs, Told, Topic};

use crate::bag::BagError;

/// Why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// It has no inputs.
    #[error(
        "it has no {}, so nothing says what the navigator was told; record it with all topics, or \
         with --topic {}",
        NavInputs::NAME,
        NavInputs::NAME
    )]
    NoInputs,
    /// Samples of then have other fields.
    #[error(
        "{topic} was recorded by another build, whose samples have other fields; verify it with that build"
    )]
    Layout {
        /// The topic.
        topic: &'static str,
    },
    /// A message is not readable.
    #[error("{topic}: a message is not readable ({error}); `lager bag check` says more")]
    Message {
        /// The topic.
        topic: &'static str,
        /// Why.
        error: serde_json::Error,
    },
    /// The navigator cannot be told.
    #[error("{0}")]
    Rerun(String),
}

/// Samples of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OfTopic {
    /// What the navigators have sent while they were followed.
    pub sent: u64,
    /// Those of them that the recording has, up to the first difference: byte by byte the same.
    pub same: u64,
    /// What navigators have sent, is in the recording, and follows from no input there: from the
    /// last moments of one that was killed, from the recording's begin or end, or from a gap.
    pub unexplained: u64,
}

/// What was compared, by topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// `steering/command`.
    pub commands: OfTopic,
    /// `nav/status`.
    pub statuses: OfTopic,
    /// `mission/event`.
    pub events: OfTopic,
}

/// What differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Number of the entry, counted from its navigator's begin.
    pub number: u64,
    /// When its piece was published, in ns since the recording's begin.
    pub at_ns: u64,
    /// The entry as it is in the recording.
    pub recorded: Told,
    /// The entry as the navigator has it now.
    pub now: Told,
    /// The topic of which a sample differs, if the entry is the same.
    pub sample: Option<SampleDifference>,
}

/// A sample that is not what the navigator says now, both in JSON.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleDifference {
    /// Its topic.
    pub topic: &'static str,
    /// Its number.
    pub number: u64,
    /// As it is in the recording.
    pub recorded: String,
    /// As the navigator has it now; empty if it sends none.
    pub now: String,
}

impl Difference {
    /// Whether the order in force is another one.
    pub fn is_of_command(&self) -> bool {
        let order = |told: &Told| (told.command_id, told.code, told.arm_granted);
        order(&self.recorded) != order(&self.now)
    }
}

/// A part of the recording that nothing could be compared in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Where it begins, in ns since the recording's begin.
    pub at_ns: u64,
    /// Why.
    pub why: Why,
    /// Inputs in it that are in the recording.
    pub inputs: u64,
}

/// Why a part of a recording cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The navigator had begun before the recording did.
    BegunBefore,
    /// So many samples of `nav/inputs` are missing.
    Missing(u64),
    /// The numbers of the entries have a hole: the navigator's shell could not publish a piece.
    Unpublished,
}

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// Navigators that were followed from their begin.
    pub navigators: u64,
    /// Inputs that a navigator was told again.
    pub inputs: u64,
    /// Samples that were compared, by topic.
    pub compared: Compared,
    /// Where nothing could be compared.
    pub gaps: Vec<Gap>,
    /// What differs first.
    pub first: Option<Difference>,
    /// The first command that differs.
    pub first_command: Option<Difference>,
}

impl Verified {
    /// Whether all that the recording has of `nav/inputs` was compared and is the same.
    pub fn is_identical(&self) -> bool {
        self.navigators > 0 && self.gaps.is_empty() && self.first.is_none()
    }
}
