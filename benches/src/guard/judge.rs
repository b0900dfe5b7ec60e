//! Compares figures with their limits, as a pure function. A ratio breaks its limit if even the
//! favourable end of its interval does. A limit without a measured figure is broken, so the guard
//! notices a renamed bench.

use core::fmt;

use serde::Serialize;

use crate::figures::Figures;
use crate::limits::{Counted, Limit, Limits};

/// The result of one limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    /// The figure keeps the limit.
    Kept,
    /// The figure exceeds the limit.
    Broken,
    /// There is no such figure.
    Missing,
    /// The limit does not apply to this target, or this machine cannot measure the figure. A note
    /// gives the reason.
    NotJudged,
}

impl Verdict {
    /// Whether this result makes the guard fail.
    pub(crate) fn fails(self) -> bool {
        matches!(self, Self::Broken | Self::Missing)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Kept => "kept",
            Self::Broken => "BROKEN",
            Self::Missing => "MISSING",
            Self::NotJudged => "not judged",
        })
    }
}

/// One limit and its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Judgement {
    pub(crate) source: String,
    pub(crate) figure: String,
    pub(crate) measured: Option<f64>,
    /// Between which ends it lies, if it is a ratio.
    pub(crate) interval: Option<[f64; 2]>,
    pub(crate) limit: f64,
    /// The figure must be at least the limit, not at most.
    pub(crate) at_least: bool,
    pub(crate) goal: Option<f64>,
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
}

/// Judges the figures of one source by its limits; also returns notes for the reader.
pub(crate) fn judge(limits: &Limits, figures: &Figures) -> (Vec<Judgement>, Vec<String>) {
    let counted = limits.counted.get(&figures.source);
    let (margin, mut notes) = conditions(counted, figures);
    let judgements: Vec<_> = limits
        .of(&figures.source)
        .map(|limit| one(limit, figures, margin))
        .collect();
    if counted.is_some() {
        notes.extend(notes_on_counts(limits, figures));
    }
    notes.extend(figures.no_real_time.clone());
    (judgements, notes)
}

/// How far a count may exceed the measured one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Margin {
    /// The limit's own percentage, or this one if it has none.
    OrElse(f64),
    /// This percentage, whatever the limit says.
    All(f64),
    /// The counts are of another target.
    NotJudged,
}

fn one(limit: &Limit, figures: &Figures, margin: Margin) -> Judgement {
    let at_least = limit.at_least.is_some();
    let bound = limit.at_most.or(limit.at_least).unwrap_or_else(|| {
        let count = limit
            .measured
            .expect("a limit has one of them, checked when read");
        let margin_percent = match margin {
            Margin::OrElse(percent) => limit.margin_percent.unwrap_or(percent),
            Margin::All(percent) => percent,
            Margin::NotJudged => 0.0,
        };
        // A count is a whole number.
        (count * (1.0 + margin_percent / 100.0)).floor()
    });
    let measured = figures.values.get(&limit.figure);
    let verdict = match measured {
        None if figures.cannot_be_measured(&limit.figure) => Verdict::NotJudged,
        None => Verdict::Missing,
        Some(_) if margin == Margin::NotJudged => Verdict::NotJudged,
        // NaN matches neither condition, so it breaks the limit.
        Some([.., high]) if at_least && *high >= bound => Verdict::Kept,
        Some([low, ..]) if !at_least && *low <= bound => Verdict::Kept,
        Some(_) => Verdict::Broken,
    };
    Judgement {
        source: limit.source.clone(),
        figure: limit.figure.clone(),
        measured: measured.map(|[_, value, _]| *value),
        interval: measured
            .map(|[low, _, high]| [*low, *high])
            .filter(|[low, high]| low < high),
        limit: bound,
        at_least,
        goal: limit.goal,
        verdict,
        reason: limit.reason.clone(),
    }
}

/// The margin of the counts, and a sentence if it is not the usual one.
fn conditions(counted: Option<&Counted>, figures: &Figures) -> (Margin, Vec<String>) {
    let (Some(counted), Some(built)) = (counted, &figures.built) else {
        return (Margin::OrElse(0.0), Vec::new());
    };
    let source = &figures.source;
    if built.target != counted.target {
        let note = format!(
            "{source}: the limits were measured for {}, this is {}; its counts are shown and not judged",
            counted.target, built.target
        );
        return (Margin::NotJudged, vec![note]);
    }
    if built.rustc != counted.rustc {
        let wide = counted.margin_percent_other_rustc;
        let note = format!(
            "{source}: the limits were measured with rustc {}, this is {}, so every count gets {wide} %; measure anew and write the counts and the version into the file of limits",
            counted.rustc, built.rustc
        );
        return (Margin::All(wide), vec![note]);
    }
    (Margin::OrElse(counted.margin_percent), Vec::new())
}

/// Notes on the counts that are now so low that their limit would let a regression pass, and on the
/// counts that have no limit.
fn notes_on_counts(limits: &Limits, figures: &Figures) -> Vec<String> {
    // A limit is too loose when the count is below this part of the measured one.
    const LOOSE: f64 = 0.9;
    let source = &figures.source;
    let note = |name: &String| {
        let [value, ..] = figures.values[name];
        match limits.of(source).find(|limit| limit.figure == *name) {
            None => Some(format!("{source}: `{name}` ({value}) has no limit")),
            Some(limit) if value < limit.measured.unwrap_or(0.0) * LOOSE => Some(format!(
                "{source}: `{name}` has come down to {value}; write that into the file of limits, so that it stays low"
            )),
            Some(_) => None,
        }
    };
    figures.values.keys().filter_map(note).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::{Built, CYCLES, Interval, LATENCY};
    use std::path::Path;

    const RATIO: &str = "latency/hop/spin/plain: lager / futex";

    fn limits(of_send: &str) -> Limits {
        let text = format!(
            "[counted.counts]
             rustc = '1'
             target = 'here'
             margin_percent = 5
             margin_percent_other_rustc = 20
             [[limit]]
             source = 'latency'
             figure = '{RATIO}'
             at_most = 1.2
             reason = 'because'
             [[limit]]
             source = 'counts'
             figure = 'send'
             {of_send}
             reason = 'because'"
        );
        Limits::parse(&text).unwrap()
    }

    /// Judges the one limit of a source; returns the result and the notes.
    fn judged(
        limits: &Limits,
        source: &str,
        built: &str,
        figure: (&str, Interval),
    ) -> (Verdict, String) {
        let built = built.split_once(' ').map(|(rustc, target)| Built {
            rustc: rustc.to_owned(),
            target: target.to_owned(),
        });
        let figures = Figures {
            source: source.to_owned(),
            built,
            values: [(figure.0.to_owned(), figure.1)].into(),
            ..Figures::default()
        };
        let (judgements, notes) = judge(limits, &figures);
        assert_eq!(judgements.len(), 1, "only its own source's limits");
        (judgements[0].verdict, notes.join("\n"))
    }

    #[test]
    fn a_ratio_breaks_its_limit_if_even_the_favourable_end_does() {
        for (low, expected) in [
            (1.2, Verdict::Kept),
            (1.21, Verdict::Broken),
            (f64::NAN, Verdict::Broken),
        ] {
            let ratio = (RATIO, [low, 1.3, 1.4]);
            let (verdict, notes) = judged(&limits("measured = 1"), LATENCY, "", ratio);
            assert_eq!((verdict, notes.as_str()), (expected, ""), "{low}");
        }
    }

    #[test]
    fn a_count_is_judged_by_its_margin_its_compiler_and_its_target() {
        use Verdict::{Broken, Kept, Missing, NotJudged};
        let other = "rustc 1, this is 2";
        let (count, own) = ("measured = 1000", "measured = 1000\nmargin_percent = 1");
        let reached = "at_least = 0.5";
        for (limit, built, figure, value, expected, note) in [
            (count, "1 here", "send", 1050.0, Kept, ""),
            (count, "1 here", "send", 1051.0, Broken, ""),
            // The limit's own margin comes first, unless another compiler built the program.
            (own, "1 here", "send", 1010.0, Kept, ""),
            (own, "1 here", "send", 1011.0, Broken, ""),
            (own, "2 here", "send", 1200.0, Kept, other),
            (count, "2 here", "send", 1200.0, Kept, other),
            (count, "2 here", "send", 1201.0, Broken, other),
            // An `at_least` limit has no margin, whatever the compiler is.
            (reached, "2 here", "send", 0.5, Kept, other),
            (reached, "2 here", "send", 0.49, Broken, other),
            (reached, "2 here", "send", f64::NAN, Broken, other),
            (count, "1 there", "send", 9000.0, NotJudged, "not judged"),
            // A limit without its figure fails even for another target.
            (
                count,
                "1 here",
                "sent",
                1000.0,
                Missing,
                "`sent` (1000) has no limit",
            ),
            (
                count,
                "1 there",
                "sent",
                1000.0,
                Missing,
                "`sent` (1000) has no limit",
            ),
            (count, "1 here", "send", 800.0, Kept, "come down to 800"),
        ] {
            let (verdict, notes) = judged(&limits(limit), "counts", built, (figure, [value; 3]));
            let case = format!("{limit}, built by {built}: {figure} is {value}: {notes}");
            assert_eq!(verdict, expected, "{case}");
            assert!(
                notes.contains(note) && notes.is_empty() == note.is_empty(),
                "{case}"
            );
        }
        assert!([Broken, Missing].iter().all(|verdict| verdict.fails()));
        assert!(![Kept, NotJudged].iter().any(|verdict| verdict.fails()));
    }

    /// Makes each figure of the images alone 6 % worse than the measured value behind its limit.
    #[test]
    fn six_percent_more_cycles_are_noticed() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("limits.toml");
        let limits = Limits::load(&file).unwrap();
        let counted = &limits.counted[CYCLES];
        let (rustc, target) = (counted.rustc.clone(), counted.target.clone());
        let mut figures = Figures {
            source: CYCLES.to_owned(),
            built: Some(Built { rustc, target }),
            ..Figures::default()
        };
        let base = |limit: &Limit| limit.measured.or(limit.at_least).unwrap();
        for limit in limits.of(CYCLES) {
            figures
                .values
                .insert(limit.figure.clone(), [base(limit); 3]);
        }
        let failing = |figures: &Figures| {
            let (judgements, _) = judge(&limits, figures);
            let failing = judgements.into_iter().filter(|one| one.verdict.fails());
            failing.map(|one| one.figure).collect::<Vec<_>>()
        };
        assert!(figures.values.len() >= 11, "{figures:?}");
        assert_eq!(failing(&figures), Vec::<String>::new());
        for limit in limits.of(CYCLES) {
            let worse = match limit.at_least {
                Some(reached) => reached * 0.94,
                None => (base(limit) * 1.06).ceil(),
            };
            let mut changed = figures.clone();
            changed.values.insert(limit.figure.clone(), [worse; 3]);
            assert_eq!(failing(&changed), [limit.figure.as_str()]);
        }
    }

    #[test]
    fn what_this_machine_cannot_measure_is_told_and_not_judged() {
        for (figure, expected) in [
            ("path/block", Verdict::Missing),
            ("path@observed/block", Verdict::NotJudged),
        ] {
            let limits = format!(
                "[[limit]]\nsource = 'latency'\nfigure = 'latency/{figure}/plain: a / b'\n\
                 at_most = 1.2\nreason = 'because'"
            );
            let figures = Figures {
                no_real_time: Some("no right".to_owned()),
                ..Figures::from_source(LATENCY)
            };
            let (judgements, notes) = judge(&Limits::parse(&limits).unwrap(), &figures);
            assert_eq!(
                (judgements[0].verdict, notes),
                (expected, vec!["no right".to_owned()])
            );
        }
    }
}
