//! Times of many repetitions, as people read them: what is measured on a whole robot prints such
//! rows, `lager bench stop`, `command` and `link` as well as `tests/soak panel`.

use std::fmt;

use serde::Serialize;

use crate::stats::at;

/// A distribution, in milliseconds.
#[derive(Debug, Serialize)]
pub struct Times {
    p50_ms: f64,
    p95_ms: f64,
    p99_ms: f64,
    max_ms: f64,
}

impl Times {
    /// Of these times, in ns.
    ///
    /// # Panics
    /// When there are none.
    #[must_use]
    pub fn of(mut ns: Vec<u64>) -> Self {
        ns.sort_unstable();
        let at = |permille| at(&ns, permille).expect("some times") as f64 / 1e6;
        Self {
            p50_ms: at(500),
            p95_ms: at(950),
            p99_ms: at(990),
            max_ms: at(1000),
        }
    }
}

/// Writes a row for each of `rows`, under a first column's head.
///
/// # Errors
/// When they cannot be written.
pub fn table(
    formatter: &mut fmt::Formatter<'_>,
    head: &str,
    rows: &[(&str, &Times)],
) -> fmt::Result {
    writeln!(formatter, "{head:26}     p50      p95      p99      max")?;
    for (name, times) in rows {
        let cells = [times.p50_ms, times.p95_ms, times.p99_ms, times.max_ms];
        let cells = cells.map(|ms| format!("{ms:7.1}")).join("  ");
        writeln!(formatter, "{name:26} {cells}")?;
    }
    Ok(())
}
