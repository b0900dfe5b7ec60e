//! Reads the limits in `benches/limits.toml`. It is strict, because a mistyped limit would guard
//! nothing. It neither measures nor judges.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Deserialize;

use crate::error::{GuardError, read};
use crate::estimates::parts;
use crate::figures::LATENCY;

/// The content of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limits {
    /// The sources whose figures are counted rather than timed, by name.
    #[serde(default)]
    pub(crate) counted: BTreeMap<String, Counted>,
    /// The limits.
    #[serde(default, rename = "limit")]
    pub(crate) limits: Vec<Limit>,
}

/// How far the counts of a source may be from the measured ones. Counts do not depend on the
/// machine's load, but they depend on the compiler.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Counted {
    /// The compiler that built the counted program.
    pub(crate) rustc: String,
    /// The target of that program. Counts of another target are shown and not judged.
    pub(crate) target: String,
    /// How far a count may exceed the measured one, in percent.
    pub(crate) margin_percent: f64,
    /// The same if another compiler built the program.
    pub(crate) margin_percent_other_rustc: f64,
}

/// One limit: on a ratio (`at_most`), on a count (`measured`, and the margin of its source), or on
/// a figure beside the counts that depends on the machine (`at_least`).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limit {
    /// [`LATENCY`], or one of [`Limits::counted`].
    pub(crate) source: String,
    /// The figure's name within its source.
    pub(crate) figure: String,
    /// The largest allowed value.
    pub(crate) at_most: Option<f64>,
    /// The smallest allowed value.
    pub(crate) at_least: Option<f64>,
    /// The count at the time when this line was written.
    pub(crate) measured: Option<f64>,
    /// The limit's own margin, if the margin of its source would hide too much.
    pub(crate) margin_percent: Option<f64>,
    /// The project's goal, if it is not the same as the limit.
    pub(crate) goal: Option<f64>,
    /// The reason for this value.
    pub(crate) reason: String,
}

impl Limits {
    /// Reads and checks a file.
    pub(crate) fn load(file: &Path) -> Result<Self, GuardError> {
        Self::parse(&read(file)?).map_err(|why| GuardError::Unusable(file.to_owned(), why))
    }

    /// The limits in a file's text, or a sentence why some of them would guard nothing.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let limits: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        if limits.limits.is_empty() {
            return Err("it has no limit and would guard nothing; write one [[limit]]".to_owned());
        }
        for (source, counted) in &limits.counted {
            let (margin, other) = (counted.margin_percent, counted.margin_percent_other_rustc);
            if !(0.0 <= margin && margin <= other && other <= 100.0) {
                return Err(format!(
                    "[counted.{source}]: the margins must be percentages from 0 to 100, and margin_percent_other_rustc must not be the smaller one"
                ));
            }
        }
        let mut seen = BTreeSet::new();
        for limit in &limits.limits {
            let refused = |why: String| format!("`{}` of `{}` {why}", limit.figure, limit.source);
            limit.check(&limits.counted).map_err(refused)?;
            if !seen.insert((&limit.source, &limit.figure)) {
                return Err(refused("has two limits; keep one".to_owned()));
            }
        }
        Ok(limits)
    }

    /// The limits of one source.
    pub(crate) fn of(&self, source: &str) -> impl Iterator<Item = &Limit> {
        self.limits
            .iter()
            .filter(move |limit| limit.source == source)
    }
}

impl Limit {
    fn check(&self, counted: &BTreeMap<String, Counted>) -> Result<(), String> {
        if self.reason.trim().is_empty() {
            return Err("has no reason; say why the limit is what it is".to_owned());
        }
        let numbers = [
            ("at_most", self.at_most),
            ("at_least", self.at_least),
            ("measured", self.measured),
            ("margin_percent", self.margin_percent),
            ("goal", self.goal),
        ];
        for (what, value) in numbers {
            if let Some(value) = value
                && !(value.is_finite() && value > 0.0)
            {
                return Err(format!("has {what} = {value}; give a positive number"));
            }
        }
        let is_timed = self.source == LATENCY;
        if !is_timed && !counted.contains_key(&self.source) {
            return Err(format!(
                "has a source that is neither `{LATENCY}` nor described under [counted.{}]",
                self.source
            ));
        }
        let margin = self.margin_percent.is_some();
        let why = match (is_timed, self.at_most, self.at_least, self.measured) {
            (true, Some(_), None, None) if !margin => match parts(&self.figure) {
                Some(_) => return Ok(()),
                None => {
                    "names no ratio; write it as `group: row / row` with criterion's names, for instance `latency/hop/block/same-core: lager / iceoryx2/event`"
                }
            },
            (true, ..) => {
                "is a ratio; give the limit itself (`at_most = …`), without `measured`, `margin_percent` and `at_least`"
            }
            (false, None, None, Some(_)) => return Ok(()),
            (false, None, Some(_), None) if !margin => return Ok(()),
            (false, ..) => {
                "is a count; give the measured count (`measured = …`; its source has the margin), or the smallest allowed value (`at_least = …`)"
            }
        };
        Err(why.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTED: &str = "[counted.instructions]\nrustc = '1.95.0'\ntarget = 't'\n\
                           margin_percent = 5\nmargin_percent_other_rustc = 15\n";
    const RATIO: &str = "[[limit]]\nsource = 'latency'\n\
                         figure = 'latency/hop/spin/plain: lager / iceoryx2/header'\n\
                         at_most = 1.2\ngoal = 1.05\nreason = 'because'\n";
    const COUNT: &str = "[[limit]]\nsource = 'instructions'\nfigure = 'decode'\n\
                         measured = 480\nreason = 'because'\n";

    #[test]
    fn the_checked_in_limits_are_sound() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("limits.toml");
        let limits = Limits::load(&file).unwrap_or_else(|error| panic!("{error}"));
        for source in [LATENCY, "instructions", "cycles"] {
            assert!(limits.of(source).count() > 0, "nothing guards {source}");
        }
    }

    #[test]
    fn ratios_and_counts_are_read() {
        let limits = Limits::parse(&format!("{COUNTED}{RATIO}{COUNT}")).unwrap();
        assert_eq!(limits.limits.len(), 2);
        assert_eq!(limits.of(LATENCY).next().unwrap().at_most, Some(1.2));
        assert_eq!(
            limits.of("instructions").next().unwrap().measured,
            Some(480.0)
        );
        assert_eq!(limits.of("path").count(), 0);
    }

    #[test]
    fn what_would_guard_nothing_is_refused_with_a_sentence() {
        let cases = [
            (String::new(), "no limit"),
            (COUNTED.to_owned(), "no limit"),
            (format!("{RATIO}{RATIO}"), "two limits"),
            (format!("{RATIO}at_moost = 3\n"), "at_moost"),
            (format!("limits = 3\n{RATIO}"), "limits"),
            (RATIO.replace("reason = 'because'", ""), "reason"),
            (RATIO.replace("because", " "), "has no reason"),
            (RATIO.replace("1.2", "nan"), "positive"),
            (RATIO.replace("1.2", "-1.0"), "positive"),
            (RATIO.replace("at_most = 1.2", ""), "is a ratio"),
            (RATIO.replace("goal", "measured"), "is a ratio"),
            (RATIO.replace("goal", "margin_percent"), "is a ratio"),
            (RATIO.replace("'latency'", "'hop'"), "neither `latency`"),
            (RATIO.replace(" / ", " "), "group: row / row"),
            (RATIO.replace(": ", " "), "group: row / row"),
            (COUNT.to_owned(), "[counted.instructions]"),
            (format!("{COUNTED}{COUNT}at_most = 500\n"), "is a count"),
            (format!("{COUNTED}{COUNT}").replace("15", "3"), "margins"),
            (format!("{COUNTED}{COUNT}at_least = 2\n"), "is a count"),
            (format!("{RATIO}at_least = 2\n"), "is a ratio"),
        ];
        for (text, expected) in cases {
            let refusal = Limits::parse(&text).unwrap_err();
            assert!(refusal.contains(expected), "{text}\n-> {refusal}");
        }
    }
}
