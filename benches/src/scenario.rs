//! What can be measured, by name: for `lager bench`, the guard and criterion alike.

use crate::error::BenchError;
use crate::group::Group;
use crate::machine;
use crate::names::named;
use crate::report::{Options, Report};
use crate::{fanout, hop, path, ring};

named! {
    /// What is measured by its time.
    pub enum Scenario {
        /// One way between two processes, and what it costs a writer to wake one.
        Hop = "hop",
        /// From a sensor frame to the command that it causes.
        Path = "path",
        /// What publishing costs the writer when many read.
        Fanout = "fanout",
    }
}

impl Scenario {
    /// The rows that `options` want, in groups that take turns.
    #[must_use]
    pub fn groups(self, options: &Options) -> Vec<Group> {
        let mut groups = Vec::new();
        for regime in &options.regimes {
            groups.extend(match self {
                Self::Hop => [
                    hop::groups(*regime, options),
                    ring::groups(*regime, options),
                ]
                .into_iter()
                .flatten()
                .collect(),
                Self::Path => path::groups(*regime, options),
                Self::Fanout => fanout::groups(*regime, options),
            });
        }
        groups.retain(|group| !group.entries.is_empty());
        groups
    }

    /// Measures all that `options` want, beside what it is compared with.
    ///
    /// # Errors
    /// See [`BenchError`].
    pub fn measure(self, options: &Options) -> Result<Report, BenchError> {
        let mut rows = Vec::new();
        for group in self.groups(options) {
            rows.extend(group.measure(options)?);
        }
        if rows.is_empty() {
            let why = match self {
                Self::Hop => "nothing works in these modes and regimes",
                Self::Path => "the path is measured blocking and adaptive, the latter on two cores",
                Self::Fanout => "the readers look without pause, so it is measured in mode spin",
            };
            return Err(BenchError::NothingToMeasure(why.to_owned()));
        }
        if self == Self::Hop {
            hop::beside_its_parts(&mut rows);
        }
        Ok(Report {
            machine: machine::describe(),
            rows,
        })
    }
}
