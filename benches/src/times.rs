//! The distribution of many repetitions' times, as a row for people. `lager bench stop`, `command`
//! and `link` print such rows.

use std::fmt;

use serde::Serialize;

use crate::stats::Distribution;

/// A distribution, in milliseconds. A percentile with fewer than ten times beyond it is absent.
#[derive(Debug, Serialize)]
pub struct Times {
    p50_ms: Option<f64>,
    p95_ms: Option<f64>,
    p99_ms: Option<f64>,
    max_ms: f64,
}

impl Times {
    /// The distribution of these times, in ns.
    #[must_use]
    pub fn of(ns: Vec<u64>) -> Self {
        let times: Distribution = ns.into_iter().collect();
        let at = |percent| times.percentile(percent).map(|ns| ns as f64 / 1e6);
        Self {
            p50_ms: at(50.0),
            p95_ms: at(95.0),
            p99_ms: at(99.0),
            max_ms: times.quantiles().max_ns as f64 / 1e6,
        }
    }
}

/// Writes a table with these rows; `head` is the title of the first column.
///
/// # Errors
/// When the table cannot be written.
pub fn table(
    formatter: &mut fmt::Formatter<'_>,
    head: &str,
    rows: &[(&str, &Times)],
) -> fmt::Result {
    writeln!(formatter, "{head:26}     p50      p95      p99      max")?;
    for (name, times) in rows {
        let cells = [times.p50_ms, times.p95_ms, times.p99_ms, Some(times.max_ms)];
        let cell = |ms: f64| format!("{ms:7.1}");
        let cells = cells
            .map(|ms| ms.map_or_else(|| "      -".to_owned(), cell))
            .join("  ");
        writeln!(formatter, "{name:26} {cells}")?;
    }
    Ok(())
}
