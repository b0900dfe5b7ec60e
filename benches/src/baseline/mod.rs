//! The barest ways to hand 64 bytes to another process, each as one end of a line.
//!
//! Baselines do no more than they must: no header, no count of losses, no protection against a
//! killed process. What they lack is what the typed ports are compared for.

pub(crate) mod iceoryx;
pub(crate) mod memory;
pub(crate) mod stream;
#[cfg(feature = "zenoh")]
pub(crate) mod zenoh;

use core::time::Duration;
use std::time::Instant;

use crate::error::BenchError;
use crate::sample::Sample;

/// How long a sleeping receiver sleeps before it looks whether it was forgotten: the same for the
/// typed ports and for every baseline that has a time-out.
pub(crate) const TIME_OUT: Duration = Duration::from_millis(100);

/// How long a receiver waits for a sample before it gives up the measurement.
pub(crate) const LIMIT: Duration = Duration::from_secs(5);

/// One end of a line between two processes; stays in its thread.
pub(crate) trait End {
    /// Hands the sample over.
    fn send(&mut self, sample: &Sample) -> Result<(), Fault>;

    /// Waits for the next sample in the end's own way.
    fn receive(&mut self) -> Result<Sample, Fault>;
}

/// Why an end does not work.
#[derive(Debug)]
pub(crate) enum Fault {
    /// Nothing came within [`LIMIT`].
    Silent,
    /// The carrier failed; it says why.
    Broken(String),
}

impl Fault {
    /// As the fault of what carries sample number `expected`.
    pub(crate) fn of(self, contender: &str, expected: u64) -> BenchError {
        let contender = contender.to_owned();
        match self {
            Self::Silent => BenchError::NoSample {
                contender,
                expected: expected & u64::from(u32::MAX),
                limit: LIMIT,
            },
            Self::Broken(detail) => BenchError::Carrier { contender, detail },
        }
    }
}

/// A fault of a port of ours.
pub(crate) fn broken(error: impl core::fmt::Display) -> Fault {
    Fault::Broken(error.to_string())
}

impl From<rustix::io::Errno> for Fault {
    fn from(error: rustix::io::Errno) -> Self {
        Self::Broken(error.to_string())
    }
}

/// Looks without pause until `look` finds something, at most [`LIMIT`]. Between two looks it tells
/// the processor that it spins, as a waiter of the typed ports does.
pub(crate) fn spin<T>(mut look: impl FnMut() -> Result<Option<T>, Fault>) -> Result<T, Fault> {
    // Reading the clock costs as much as looking, so it is read now and then.
    const LOOKS: u32 = 10_000;
    let start = Instant::now();
    loop {
        for _ in 0..LOOKS {
            if let Some(found) = look()? {
                return Ok(found);
            }
            core::hint::spin_loop();
        }
        if start.elapsed() > LIMIT {
            return Err(Fault::Silent);
        }
    }
}

/// How a sleep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slept {
    /// Somebody may have something.
    Woken,
    /// Nobody called for [`TIME_OUT`].
    TimedOut,
}

/// Looks and sleeps in turn until `look` finds something; gives up after as many time-outs as
/// make up [`LIMIT`].
pub(crate) fn sleep_until<T>(
    mut look: impl FnMut() -> Result<Option<T>, Fault>,
    mut sleep: impl FnMut() -> Result<Slept, Fault>,
) -> Result<T, Fault> {
    let mut left = LIMIT.as_millis() / TIME_OUT.as_millis();
    loop {
        if let Some(found) = look()? {
            return Ok(found);
        }
        if sleep()? == Slept::TimedOut {
            left -= 1;
            if left == 0 {
                return Err(Fault::Silent);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_receiver_gives_up_when_nobody_ever_sends() {
        let mut sleeps = 0;
        let silent = sleep_until(
            || Ok(None::<()>),
            || {
                sleeps += 1;
                Ok(Slept::TimedOut)
            },
        );
        assert!(matches!(silent, Err(Fault::Silent)));
        assert_eq!(sleeps, 50);
    }

    #[test]
    fn a_receiver_bears_any_number_of_wakes_in_vain() {
        let mut looks = 0;
        let found = sleep_until(
            || {
                looks += 1;
                Ok((looks > 1000).then_some(looks))
            },
            || Ok(Slept::Woken),
        );
        assert_eq!(found.unwrap(), 1001);
    }
}
