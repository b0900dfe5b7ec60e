//! The distribution of many repetitions' times, as a row for people. `lager bench stop`, `command`
//! and `link` print such rows.

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
    /// The distribution of these times, in ns.
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
        let cells = [times.p50_ms, times.p95_ms, times.p99_ms, times.max_ms];
        let cells = cells.map(|ms| format!("{ms:7.1}")).join("  ");
        writeln!(formatter, "{name:26} {cells}")?;
    }
    Ok(())
}
