//! Ratios of criterion's estimates. `benches/guard` runs the benches several times, each time with a
//! folder of its own:
//!
//! ```text
//!   FOLDER/1/latency_hop_spin_plain/iceoryx2_header/new/estimates.json
//!          |  the group             the row
//!          the repetition
//! ```
//!
//! criterion estimates the median of a row and an interval around it. In a repetition a ratio lies
//! between the lower end of its row over the upper end of the baseline, and the other way round. The
//! medians over the repetitions count, so none of them decides alone.

use std::path::{Path, PathBuf};

use lager_benches::{may_have_real_time, median};

use crate::error::{GuardError, read};
use crate::figures::{Figures, Interval, LATENCY};

/// The group, the row and the baseline of a ratio: `latency/hop/spin/plain: lager / iceoryx2/header`.
/// `None` if that is not the name of a ratio.
pub(crate) fn parts(figure: &str) -> Option<[&str; 3]> {
    let (group, rows) = figure.split_once(": ")?;
    let (row, baseline) = rows.split_once(" / ")?;
    Some([group, row, baseline])
}

/// The ratios with these names; one that is absent from a repetition is no figure.
pub(crate) fn ratios<'a>(
    folder: &Path,
    names: impl Iterator<Item = &'a str>,
) -> Result<Figures, GuardError> {
    let unreadable = |error| GuardError::Unreadable(folder.to_owned(), error);
    let entries = std::fs::read_dir(folder).map_err(unreadable)?;
    let repetitions = entries.map(|entry| Ok(entry?.path()));
    let repetitions: Vec<PathBuf> = repetitions.collect::<Result<_, _>>().map_err(unreadable)?;
    let mut figures = Figures::from_source(LATENCY);
    for name in names {
        let each = repetitions.iter().map(|one| ratio(one, name));
        let each: Option<Vec<Interval>> = each.collect::<Result<_, _>>()?;
        let of = |part: usize| median(each.iter().flatten().map(|one| one[part]).collect());
        if let (Some(low), Some(value), Some(high)) = (of(0), of(1), of(2)) {
            figures.values.insert(name.to_owned(), [low, value, high]);
        }
    }
    if figures.values.is_empty() {
        return Err(not_estimates(folder, "no ratio has a limit"));
    }
    figures.no_real_time = may_have_real_time().err().map(|error| error.to_string());
    Ok(figures)
}

/// A ratio in one repetition; `None` if one of the rows was not measured.
fn ratio(repetition: &Path, name: &str) -> Result<Option<Interval>, GuardError> {
    let [group, row, baseline] = parts(name).expect("checked when the limits were read");
    let of = |row| estimate(&file(repetition, group, row));
    let ratio = |(own, other): (Interval, Interval)| [0, 1, 2].map(|end| own[end] / other[2 - end]);
    Ok(of(row)?.zip(of(baseline)?).map(ratio))
}

/// Where criterion writes the newest estimates of a row.
fn file(repetition: &Path, group: &str, row: &str) -> PathBuf {
    let [group, row] = [group, row].map(|name| name.replace('/', "_"));
    repetition.join(group).join(row).join("new/estimates.json")
}

/// A row's median, in ns; `None` if there is no such file.
fn estimate(file: &Path) -> Result<Option<Interval>, GuardError> {
    if !file.exists() {
        return Ok(None);
    }
    let estimates: serde_json::Value = serde_json::from_str(&read(file)?)
        .map_err(|error| not_estimates(file, &error.to_string()))?;
    let median = &estimates["median"];
    let ends = &median["confidence_interval"];
    let values = [
        &ends["lower_bound"],
        &median["point_estimate"],
        &ends["upper_bound"],
    ];
    let values = values.map(|value| value.as_f64().unwrap_or(f64::NAN));
    match 0.0 < values[0] && values.is_sorted() {
        true => Ok(Some(values)),
        false => Err(not_estimates(file, "its median is no interval of times")),
    }
}

fn not_estimates(path: &Path, why: &str) -> GuardError {
    let why = format!("these are no estimates ({why}); run `benches/guard`, which makes them");
    GuardError::Unusable(path.to_owned(), why)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: &str = "latency/hop/block/same-core: lager / iceoryx2/event";

    fn estimates([low, value, high]: Interval) -> String {
        let one = |value| {
            format!(
                r#"{{"confidence_interval":{{"confidence_level":0.95,"lower_bound":{low},
                "upper_bound":{high}}},"point_estimate":{value},"standard_error":0.0}}"#
            )
        };
        // A mean of its own: only the median counts.
        format!(r#"{{"mean":{},"median":{}}}"#, one(9.0), one(value))
    }

    /// Repetitions, each with the estimates of the row and of its baseline; `change` removes some.
    fn read_from(
        test: &str,
        repetitions: &[[Interval; 2]],
        change: impl Fn(&Path),
    ) -> Result<Option<Interval>, String> {
        let folder = std::env::temp_dir().join(format!("guard-{test}-{}", std::process::id()));
        let [group, row, baseline] = parts(NAME).unwrap();
        for (number, rows) in repetitions.iter().enumerate() {
            for (row, values) in [row, baseline].into_iter().zip(rows) {
                let new = file(&folder.join(number.to_string()), group, row);
                // Those of the run before, and what has changed since then.
                for (state, values) in [("new", *values), ("base", [7.0; 3]), ("change", [-0.2; 3])]
                {
                    let folder = new.parent().unwrap().with_file_name(state);
                    std::fs::create_dir_all(&folder).unwrap();
                    std::fs::write(folder.join("estimates.json"), estimates(values)).unwrap();
                }
            }
        }
        change(&folder);
        let read = ratios(&folder, [NAME, "a: b / c"].into_iter());
        let _ = std::fs::remove_dir_all(&folder);
        let ratio = |figures: Figures| figures.values.get(NAME).copied();
        read.map(ratio).map_err(|error| error.to_string())
    }

    #[test]
    fn a_ratio_lies_between_the_ends_of_both_intervals() {
        // Times below 1 ns are not cut off.
        let ratio = read_from("ends", &[[[0.3, 0.4, 0.6], [0.5, 0.5, 1.0]]], |_| ());
        assert_eq!(ratio, Ok(Some([0.3, 0.8, 1.2])));
    }

    #[test]
    fn of_several_repetitions_the_medians_count_and_all_must_be_there() {
        let one = |value: f64| [[value - 0.25, value, value + 0.25], [1.0; 3]];
        let several = [one(0.5), one(1.25), one(9.0)];
        let ratio = read_from("medians", &several, |_| ());
        assert_eq!(ratio, Ok(Some([1.0, 1.25, 1.5])));
        let absent = read_from("absent", &several, |folder| {
            let row = folder.join("1/latency_hop_block_same-core/lager");
            std::fs::remove_dir_all(row).unwrap();
        });
        assert!(absent.unwrap_err().contains("no ratio"));
    }

    #[test]
    fn what_is_empty_or_cut_or_no_time_is_refused_with_its_path() {
        let good = estimates([1.0; 3]);
        for text in [
            String::new(),
            good[..good.len() / 2].to_owned(),
            good.replace("median", "mode"),
            estimates([2.0, 1.0, 3.0]),
            estimates([0.0, 1.0, 3.0]),
        ] {
            let path = "0/latency_hop_block_same-core/lager/new/estimates.json";
            let refusal = read_from("refused", &[[[1.0; 3]; 2]], |folder| {
                std::fs::write(folder.join(path), &text).unwrap();
            });
            assert!(refusal.unwrap_err().contains(path), "{text}");
        }
        for there in [false, true] {
            let nothing = read_from("nothing", &[], |folder| {
                there.then(|| std::fs::create_dir(folder).unwrap());
            });
            assert!(nothing.unwrap_err().contains("guard-nothing"));
        }
    }
}
