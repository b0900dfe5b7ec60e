//! The timed measurements by name, for `lager bench` and for criterion.

use clap::ValueEnum;

use crate::error::BenchError;
use crate::group::Group;
use crate::load::Loaded;
use crate::machine;
use crate::report::{Options, Report, shown_by_name};
use crate::{hop, path, publish, watch};
use lager_machine::{Machine, Observed};

/// A timed measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scenario {
    /// One way between two processes, and the time that a writer needs to wake one.
    Hop,
    /// From a sensor frame to the command that it causes.
    Path,
    /// The time that a writer needs to publish to many subscribers, and what many watchers cost.
    Fanout,
}

shown_by_name!(Scenario);

impl Scenario {
    /// The rows that `options` choose, in groups that take turns.
    #[must_use]
    pub fn groups(self, options: &Options) -> Vec<Group> {
        let of_regime = |regime: &_| match self {
            Self::Hop => {
                // It has neither a pace nor a size of its own.
                let ring = publish::ring(*regime, options)
                    .filter(|_| options.pace.is_none() && options.words().is_none());
                hop::groups(*regime, options)
                    .into_iter()
                    .chain(ring)
                    .collect()
            }
            Self::Path => path::groups(*regime, options),
            Self::Fanout => {
                let mut groups = publish::fan_out(*regime, options);
                groups.extend(watch::groups(*regime, options));
                groups.extend(path::watched(*regime, options));
                groups
            }
        };
        options.regimes.iter().flat_map(of_regime).collect()
    }

    /// Measures all that `options` choose, beside the baselines.
    ///
    /// # Errors
    /// See [`BenchError`].
    pub fn measure(self, options: &Options) -> Result<Report, BenchError> {
        let cores = options.regimes.first();
        let cores = cores
            .map(|regime| machine::cores_for(*regime, options.cores))
            .transpose()?;
        let observed = Observed::begin(cores);
        let place = options.regimes.first().copied().zip(cores);
        let loaded = options
            .load
            .zip(place)
            .map(|(load, (regime, (_, core)))| Loaded::begin(load, core, regime));
        let loaded = loaded.transpose()?;
        let mut rows = Vec::new();
        for group in self.groups(options) {
            rows.extend(group.measure(options)?);
        }
        if rows.is_empty() {
            return Err(BenchError::NothingToMeasure(match self {
                Self::Hop => "nothing works in these modes and regimes",
                Self::Path => "the path is measured blocking and adaptive, the latter on two cores",
                Self::Fanout => "readers look without pause, and watchers block on two cores",
            }));
        }
        if self == Self::Hop {
            hop::beside_its_parts(&mut rows);
        }
        if let Some(loaded) = loaded {
            loaded.end(&mut rows)?;
        }
        Ok(Report {
            machine: Machine::here().to_string(),
            conditions: Some(observed.end()),
            rows,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_row_is_compared_with_is_in_its_group_once() {
        let all = Scenario::value_variants().iter();
        for group in all.flat_map(|scenario| scenario.groups(&Options::default())) {
            for label in group.entries.iter().flat_map(|entry| entry.against) {
                let found = group.entries.iter().filter(|other| other.label == *label);
                assert_eq!(found.count(), 1, "{} against {label}", group.what);
            }
        }
    }
}
