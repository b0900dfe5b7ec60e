//! `bag play --verify`: gives the recorded inputs of a navigator to a new one, and compares.
//!
//! ```text
//!   nav/inputs ──> navigator of this build ──> its answer <── compared ──> the entry's order, proof
//!                                                  │
//!                     steering/command, nav/status, mission/event <── compared, byte by byte
//! ```
//!
//! `nav/inputs` alone proves a run: each entry has the order that was in force after it, and a
//! check value of everything else. The verifier also compares the samples of the three topics,
//! where the recording has them. `nav/inputs` says the number of each such sample, so a lost one
//! does not shift the others.
//!
//! The verifier follows a navigator from its start, because only there the recording has all of its
//! state. A later `nav/status` holds only the part that a successor needs. It does not say how far
//! a manoeuvre has come, nor what the navigator has seen of wheels, line and distance. Without
//! these the same inputs lead to other orders. So if a recording begins later, or pieces are
//! missing, the verifier waits for the next start of a navigator; [`Verified::gaps`] says where.
//!
//! `frames_lost` in a status counts frames that the shell has missed. No navigator knows them, so
//! the verifier does not compare this count.

mod outcome;
mod rerun;
mod samples;

use std::path::Path;

use lager_journal::{Envelope, Selection, Times};
use lager_sample::{Topic, bytes_of};
use lager_topics::{NavInputs, NavigatorInput, NavigatorInputKind, NavigatorInputs, TextKind};

use crate::bag::Bag;
pub use outcome::{
    Compared, Difference, Gap, OfTopic, SampleDifference, Verified, VerifyError, Why,
};
pub use rerun::{Did, Rerun};
use samples::{Samples, must_fit, read};

/// Gives a navigator the recorded inputs, and compares what it does, until a command differs or the
/// recording ends.
///
/// # Errors
/// The file cannot be read or has no inputs, or another version of this program wrote it.
pub fn verify(file: &Path, rerun: &mut dyn Rerun) -> Result<Verified, VerifyError> {
    let bag = Bag::open(file)?;
    let overview = bag.overview()?;
    bag.must_have(&overview, &[])?;
    let topic = overview
        .topics
        .iter()
        .find(|topic| topic.name == NavInputs::NAME);
    let topic = topic.ok_or(VerifyError::NoInputs)?;
    must_fit::<NavigatorInputs>(NavInputs::NAME, &topic.schema_text)?;
    for topic in &overview.topics {
        samples::must_fit_as_compared(&topic.name, &topic.schema_text)?;
    }
    let mut topics = vec![NavInputs::NAME.to_owned()];
    topics.extend(samples::TOPICS.map(str::to_owned));
    let selection = Selection {
        topics: Some(topics),
        ..Selection::default()
    };
    let mut follower = Follower {
        rerun,
        begin_ns: overview.begin_ns,
        stream: None,
        next_sample: 0,
        follows: Follows::Nothing,
        next_entry: 0,
        text: Vec::new(),
        samples: Samples::default(),
        verified: Verified::default(),
    };
    bag.ordered(&overview, &selection, |placed| {
        // Samples from before the file have no inputs in it.
        if placed.is_repeated {
            return Ok(true);
        }
        if placed.topic == NavInputs::NAME {
            let envelope = read::<NavigatorInputs>(NavInputs::NAME, placed.message)?;
            follower.piece(&envelope, placed.times)
        } else {
            follower.samples.keep(placed.topic, placed.message)?;
            Ok(true)
        }
    })?;
    follower.verified.compared = follower.samples.finish();
    Ok(follower.verified)
}

/// Whose inputs the verifier follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Follows {
    /// Nobody's, until the next navigator starts.
    Nothing,
    /// Those of a navigator whose pieces have come without a gap since its start.
    Navigator,
    /// The same, after a first difference. The verifier now looks only for the first command that
    /// differs, of this navigator or of the next one.
    Apart,
}

struct Follower<'a> {
    rerun: &'a mut dyn Rerun,
    begin_ns: u64,
    /// Writer and epoch of the pieces.
    stream: Option<(u32, u64)>,
    next_sample: u64,
    follows: Follows,
    next_entry: u64,
    text: Vec<u8>,
    samples: Samples,
    verified: Verified,
}

impl Follower<'_> {
    /// Takes a piece. Returns whether to go on.
    fn piece(
        &mut self,
        envelope: &Envelope<NavigatorInputs>,
        times: Times,
    ) -> Result<bool, VerifyError> {
        let (stamp, piece) = (&envelope.stamp, &envelope.payload);
        let at_ns = times.log.saturating_sub(self.begin_ns);
        let is_new = self.stream != Some((stamp.writer, stamp.epoch));
        if is_new {
            self.stream = Some((stamp.writer, stamp.epoch));
            (self.next_sample, self.next_entry) = (0, 0);
            self.follows = Follows::Navigator;
            self.text.clear();
        }
        let missing = stamp.sequence.saturating_sub(self.next_sample);
        self.next_sample = stamp.sequence + 1;
        if missing > 0 {
            let is_old = is_new && self.verified.navigators == 0 && self.verified.gaps.is_empty();
            self.lose(
                at_ns,
                match is_old {
                    true => Why::BegunBefore,
                    false => Why::Missing(missing),
                },
            );
        }
        if self.follows == Follows::Nothing {
            let gap = self
                .verified
                .gaps
                .last_mut()
                .expect("why nothing is followed");
            gap.inputs += u64::from(piece.entries_used);
            return Ok(true);
        }
        if piece.text_used > 0 {
            self.take_text(piece)?;
        }
        if piece.first != self.next_entry {
            self.lose(at_ns, Why::Unpublished);
            return Ok(true);
        }
        if piece.entries_used > 0 {
            let moved = self.samples.begin_piece(piece);
            if self.follows == Follows::Navigator && moved.is_some() {
                let first = piece.entries[0];
                self.differ(at_ns, &first, &first, moved);
            }
        }
        self.entries(piece, at_ns)
    }

    fn lose(&mut self, at_ns: u64, why: Why) {
        self.follows = Follows::Nothing;
        let inputs = 0;
        self.verified.gaps.push(Gap { at_ns, why, inputs });
    }

    fn take_text(&mut self, piece: &NavigatorInputs) -> Result<(), VerifyError> {
        self.text.extend_from_slice(piece.text());
        if piece.text_left > 0 {
            return Ok(());
        }
        let text = std::mem::take(&mut self.text);
        match piece.text_kind.get() {
            Some(TextKind::Began) => {
                self.rerun.begin(&text).map_err(VerifyError::Rerun)?;
                self.verified.navigators += 1;
                self.samples.begin(piece);
            }
            Some(TextKind::Map) => self.rerun.take_map(&text).map_err(VerifyError::Rerun)?,
            _ => {}
        }
        Ok(())
    }

    fn entries(&mut self, piece: &NavigatorInputs, at_ns: u64) -> Result<bool, VerifyError> {
        for (entry, beside) in piece.entries() {
            let did = self.rerun.handle(entry, beside);
            let did = did.map_err(VerifyError::Rerun)?;
            let kind = entry.kind.get();
            if !matches!(
                kind,
                Some(NavigatorInputKind::Renewed | NavigatorInputKind::Repeated)
            ) {
                self.verified.inputs += 1;
            }
            let sample = match self.follows {
                Follows::Navigator => self.samples.compare(&did),
                _ => None,
            };
            if bytes_of(entry) != bytes_of(&did.entry) || sample.is_some() {
                self.differ(at_ns, entry, &did.entry, sample);
            }
            self.next_entry += 1;
            if self.verified.first_command.is_some() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn differ(
        &mut self,
        at_ns: u64,
        recorded: &NavigatorInput,
        now: &NavigatorInput,
        sample: Option<SampleDifference>,
    ) {
        let difference = Difference {
            number: self.next_entry,
            at_ns,
            recorded: *recorded,
            now: *now,
            sample,
        };
        self.follows = Follows::Apart;
        let is_command = |sample: &SampleDifference| sample.topic == samples::COMMANDS;
        if difference.is_of_command() || difference.sample.as_ref().is_some_and(is_command) {
            self.verified.first_command = Some(difference.clone());
        }
        self.verified.first.get_or_insert(difference);
    }
}
