//! A stop that somebody has ordered, in words.

use lager_home::Clock;
use lager_stop::StopTold;
pub use lager_stop::span;
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
