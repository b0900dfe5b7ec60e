//! A stop that somebody has ordered, in words.

use std::time::Duration;

use lager_home::Clock;
use lager_stop::StopTold;
use lager_topics::{Role, StopCause};

/// Who has ordered a stop, when and why; `at_ns` is of `CLOCK_MONOTONIC`, 0 if it is not known.
#[must_use]
pub fn describe(origin: Option<Role>, cause: StopCause, at_ns: u64) -> String {
    let who = origin.map_or("nobody known", Role::as_author);
    let when = match at_ns {
        0 => String::new(),
        at_ns => format!(" {} ago", span(StopTold::age(Clock::monotonic_ns(), at_ns))),
    };
    format!("by {who}{when} ({cause})")
}

/// A length of time as a person says it.
#[must_use]
pub fn span(time: Duration) -> String {
    match time.as_secs() {
        0 => format!("{} ms", time.as_millis()),
        seconds @ 1..120 => format!("{seconds} s"),
        seconds @ 120..7_200 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3_600),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_told_as_people_say_them() {
        for (millis, said) in [
            (7, "7 ms"),
            (1_400, "1 s"),
            (200_000, "3 min"),
            (9_000_000, "2 h"),
        ] {
            assert_eq!(span(Duration::from_millis(millis)), said);
        }
    }
}
