//! Lines for people: the form of a robot's line, and functions that write lines.

use std::io::{self, ErrorKind, Write as _};
use std::time::Duration;

use anyhow::Result;

/// A line of a robot that is up: `time  who  what`.
#[must_use]
pub fn line(time: Duration, who: &str, what: &str) -> String {
    format!("{:8.2} s  {who:9}  {what}", time.as_secs_f64())
}

/// The time at the beginning of a robot's line, if this is such a line.
#[must_use]
pub fn time(line: &str) -> Option<Duration> {
    let (seconds, _) = line.split_once(" s  ")?;
    Duration::try_from_secs_f64(seconds.trim_start().parse().ok()?).ok()
}

/// Writes a line on standard output. If its reader has gone, as after `| head`, that is no error.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(line: &str) -> Result<()> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Writes a line on standard error. A closed terminal does not stop a robot.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_line_is_read_as_it_was_written() {
        let at = Duration::from_millis(83_420);
        assert_eq!(time(&line(at, "bridge", "WARNING: 7 s  of it")), Some(at));
        for other in [
            "",
            "lager: 7",
            "thread 'main' panicked",
            "x s  y",
            "-1 s  y",
        ] {
            assert_eq!(time(other), None, "{other}");
        }
    }
}
