//! The last minutes of a recording, as lines of JSON: for a report to somebody who has neither the
//! robot nor the whole file.

use core::time::Duration;
use std::path::Path;

use lager_journal::{Selection, utc};

use crate::bag::{Bag, BagError};

/// The end of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Latest {
    /// A line of JSON for each sample, the oldest first.
    pub text: String,
    /// Whether there was no room for the whole time.
    pub is_cut: bool,
}

/// The samples of the last `span` before the end of a recording, in at most `most_bytes` of text.
/// The recording may still grow, or have lost its end.
///
/// # Errors
/// The file cannot be read, or holds no recording of this program.
pub fn latest(file: &Path, span: Duration, most_bytes: usize) -> Result<Latest, BagError> {
    let bag = Bag::open(file)?;
    let overview = bag.overview()?;
    bag.must_have(&overview, &[])?;
    let samples = overview.topics.iter().filter(|topic| !topic.is_derived);
    let span_ns = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
    let selection = Selection {
        topics: Some(samples.map(|topic| topic.name.clone()).collect()),
        from_ns: Some(overview.end_ns.saturating_sub(span_ns)),
        is_backwards: true,
        ..Selection::default()
    };
    let (mut lines, mut bytes, mut is_cut) = (Vec::new(), 0, false);
    bag.ordered(&overview, &selection, |placed| {
        let message = String::from_utf8_lossy(placed.message);
        let line = format!(
            "{{\"at\":\"{}\",\"topic\":\"{}\",\"message\":{message}}}\n",
            utc(placed.times.log),
            placed.topic
        );
        is_cut = bytes + line.len() > most_bytes;
        if !is_cut {
            bytes += line.len();
            lines.push(line);
        }
        Ok::<bool, BagError>(!is_cut)
    })?;
    lines.reverse();
    Ok(Latest {
        text: lines.concat(),
        is_cut,
    })
}
