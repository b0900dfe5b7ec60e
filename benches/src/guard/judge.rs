//! Figures against limits, as a pure function. A limit that nothing was measured for is broken:
//! a renamed bench must not slip out of the guard's sight.

use core::fmt;

use serde::Serialize;

use crate::figures::Figures;
use crate::limits::{Counted, Limit, Limits};

/// What became of one limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    /// The figure keeps it.
    Kept,
    /// The figure exceeds it.
    Broken,
    /// There is no such figure.
    Missing,
    /// The figure is of a target for which the limit says nothing, or this machine cannot measure
    /// it; a note says why.
    NotJudged,
}

impl Verdict {
    /// Whether the guard fails.
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

/// One limit and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Judgement {
    pub(crate) source: String,
    pub(crate) figure: String,
    pub(crate) measured: Option<f64>,
    pub(crate) limit: f64,
    /// Whether the limit is one from below.
    pub(crate) at_least: bool,
    pub(crate) goal: Option<f64>,
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
}

/// Judges the figures of one source by its limits, and says what else a reader should know.
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
    notes.extend(figures.unmeasured.values().cloned());
    (judgements, notes)
}

/// How far counts may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Margin {
    /// As far as the limit itself says, or else this many percent.
    OrElse(f64),
    /// This many percent, whatever the limit says.
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
        // Counts are whole.
        (count * (1.0 + margin_percent / 100.0)).floor()
    });
    let measured = figures.figures.get(&limit.figure).copied();
    let verdict = match measured {
        None if figures.cannot_be_measured(&limit.figure) => Verdict::NotJudged,
        None => Verdict::Missing,
        Some(_) if margin == Margin::NotJudged => Verdict::NotJudged,
        // Written so that a figure that is no number breaks the limit.
        Some(value) if at_least && value >= bound => Verdict::Kept,
        Some(value) if !at_least && value <= bound => Verdict::Kept,
        Some(_) => Verdict::Broken,
    };
    Judgement {
        source: limit.source.clone(),
        figure: limit.figure.clone(),
        measured,
        limit: bound,
        at_least,
        goal: limit.goal,
        verdict,
        reason: limit.reason.clone(),
    }
}

/// The margin that counts get, and a sentence if it is another one than usual.
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

/// What has become so much less that its limit would let a regression through, and what nobody
/// has limited.
fn notes_on_counts(limits: &Limits, figures: &Figures) -> Vec<String> {
    // Below the measured count by more than this the limit has come loose.
    const LOOSE: f64 = 0.9;
    figures
        .figures
        .iter()
        .filter_map(|(name, value)| {
            let source = &figures.source;
            match limits.of(source).find(|limit| limit.figure == *name) {
                None => Some(format!("{source}: `{name}` ({value}) has no limit")),
                Some(limit) if *value < limit.measured.unwrap_or(0.0) * LOOSE => Some(format!(
                    "{source}: `{name}` has come down to {value}; write that into the file of limits, so that it stays there"
                )),
                Some(_) => None,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::Built;

    fn limits() -> Limits {
        let limit = |source: &str, figure: &str, at_most, measured| Limit {
            source: source.to_owned(),
            figure: figure.to_owned(),
            at_most,
            at_least: None,
            measured,
            margin_percent: None,
            goal: None,
            reason: "because".to_owned(),
        };
        Limits {
            counted: [(
                "counts".to_owned(),
                Counted {
                    rustc: "1".to_owned(),
                    target: "here".to_owned(),
                    margin_percent: 5.0,
                    margin_percent_other_rustc: 20.0,
                },
            )]
            .into(),
            limits: vec![
                limit("hop", "ratio", Some(1.2), None),
                limit("counts", "send", None, Some(1000.0)),
            ],
        }
    }

    fn ratio(value: f64) -> Verdict {
        let figures = Figures {
            source: "hop".to_owned(),
            built: None,
            figures: [("ratio".to_owned(), value)].into(),
            ..Figures::default()
        };
        judge(&limits(), &figures).0[0].verdict
    }

    fn count(name: &str, value: f64, rustc: &str, target: &str) -> (Verdict, String) {
        let figures = Figures {
            source: "counts".to_owned(),
            built: Some(Built {
                rustc: rustc.to_owned(),
                target: target.to_owned(),
            }),
            figures: [(name.to_owned(), value)].into(),
            ..Figures::default()
        };
        let (judgements, notes) = judge(&limits(), &figures);
        assert_eq!(judgements.len(), 1, "only its own source's limits");
        (judgements[0].verdict, notes.join("\n"))
    }

    #[test]
    fn a_ratio_is_kept_up_to_its_limit() {
        assert_eq!(ratio(1.2), Verdict::Kept);
        assert_eq!(ratio(1.21), Verdict::Broken);
        assert_eq!(ratio(f64::NAN), Verdict::Broken);
    }

    #[test]
    fn a_count_is_kept_up_to_its_margin() {
        assert_eq!(
            count("send", 1050.0, "1", "here"),
            (Verdict::Kept, String::new())
        );
        assert_eq!(count("send", 1051.0, "1", "here").0, Verdict::Broken);
    }

    #[test]
    fn a_limits_own_margin_comes_first_unless_the_compiler_is_another() {
        let mut limits = limits();
        limits.limits[1].margin_percent = Some(1.0);
        for (rustc, bound) in [("1", 1010.0), ("2", 1200.0)] {
            let figures = Figures {
                source: "counts".to_owned(),
                built: Some(Built {
                    rustc: rustc.to_owned(),
                    target: "here".to_owned(),
                }),
                figures: [("send".to_owned(), 1000.0)].into(),
                ..Figures::default()
            };
            assert_eq!(judge(&limits, &figures).0[0].limit, bound);
        }
    }

    #[test]
    fn what_is_to_be_reached_is_judged_from_below_whatever_the_compiler() {
        let mut limits = limits();
        limits.limits[1].measured = None;
        limits.limits[1].at_least = Some(0.5);
        for (value, verdict) in [
            (0.5, Verdict::Kept),
            (2.0, Verdict::Kept),
            (0.49, Verdict::Broken),
            (f64::NAN, Verdict::Broken),
        ] {
            let figures = Figures {
                source: "counts".to_owned(),
                built: Some(Built {
                    rustc: "2".to_owned(),
                    target: "here".to_owned(),
                }),
                figures: [("send".to_owned(), value)].into(),
                ..Figures::default()
            };
            assert_eq!(judge(&limits, &figures).0[0].verdict, verdict, "{value}");
        }
    }

    #[test]
    fn what_this_machine_cannot_measure_is_told_and_not_judged() {
        let figures = Figures {
            source: "hop".to_owned(),
            unmeasured: [("rat".to_owned(), "no right".to_owned())].into(),
            ..Figures::default()
        };
        let (judgements, notes) = judge(&limits(), &figures);
        assert_eq!(judgements[0].verdict, Verdict::Missing, "another scenario");
        assert_eq!(notes, ["no right"]);
        let figures = Figures {
            unmeasured: [("ratio".to_owned(), "no right".to_owned())].into(),
            ..figures
        };
        assert_eq!(judge(&limits(), &figures).0[0].verdict, Verdict::NotJudged);
    }

    #[test]
    fn another_compiler_widens_the_margin_and_is_told() {
        let (verdict, notes) = count("send", 1200.0, "2", "here");
        assert_eq!(verdict, Verdict::Kept);
        assert!(notes.contains("rustc 1, this is 2"), "{notes}");
        assert_eq!(count("send", 1201.0, "2", "here").0, Verdict::Broken);
    }

    #[test]
    fn another_target_is_shown_and_not_judged() {
        let (verdict, notes) = count("send", 9000.0, "1", "there");
        assert_eq!(verdict, Verdict::NotJudged);
        assert!(!verdict.fails());
        assert!(notes.contains("not judged"), "{notes}");
    }

    #[test]
    fn a_limit_without_its_figure_fails_even_on_another_target() {
        for target in ["here", "there"] {
            let (verdict, notes) = count("sent", 1000.0, "1", target);
            assert_eq!(verdict, Verdict::Missing);
            assert!(verdict.fails());
            assert!(notes.contains("`sent` (1000) has no limit"), "{notes}");
        }
    }

    #[test]
    fn a_limit_that_has_come_loose_is_told() {
        let (verdict, notes) = count("send", 800.0, "1", "here");
        assert_eq!(verdict, Verdict::Kept);
        assert!(notes.contains("come down to 800"), "{notes}");
    }
}
