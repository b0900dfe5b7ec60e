//! The baselines: the simplest ways to hand 64 bytes to another process, each as one end of a line.
//!
//! A baseline has no header, no count of losses and no protection against a killed process, so the
//! comparison shows the cost of these in the typed ports.

pub(crate) mod iceoryx;
pub(crate) mod memory;
pub(crate) mod stream;
#[cfg(feature = "zenoh")]
pub(crate) mod zenoh;

use core::time::Duration;
use std::time::Instant;

use crate::error::Fault;
use crate::sample::Sample;

/// How long a sleeping receiver sleeps before it looks for a sample without a wake-up. It is the
/// same for the typed ports and for every baseline with a time-out.
pub(crate) const TIME_OUT: Duration = Duration::from_millis(100);

/// How long a receiver waits for a sample before the measurement fails.
pub(crate) const LIMIT: Duration = Duration::from_secs(5);

/// One end of a line between two processes: how it sends, and how it receives.
pub(crate) trait End {
    /// Sends the sample to the other end.
    fn send(&mut self, sample: &Sample) -> Result<(), Fault>;

    /// Waits for the next sample in the end's own way.
    fn receive(&mut self) -> Result<Sample, Fault>;
}

impl<S, R> End for (S, R)
where
    S: FnMut(&Sample) -> Result<(), Fault>,
    R: FnMut() -> Result<Sample, Fault>,
{
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        self.0(sample)
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        self.1()
    }
}

/// Looks without pause until `look` finds something, at most [`LIMIT`]. Between two looks it gives
/// the processor the hint that it spins, as a waiter of the typed ports does.
pub(crate) fn spin<T>(mut look: impl FnMut() -> Result<Option<T>, Fault>) -> Result<T, Fault> {
    // Reading the clock takes as long as a look, so it is read once in this number of looks.
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
            return Err(Fault::Silent(LIMIT));
        }
    }
}

/// How a sleep has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slept {
    /// Another process rang, so there may be a sample.
    Woken,
    /// Nobody rang for [`TIME_OUT`].
    TimedOut,
}

/// Looks and sleeps in turn until `look` finds something. Gives up when the time-outs add up to
/// [`LIMIT`].
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
                return Err(Fault::Silent(LIMIT));
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Sends samples from one end to the other and back.
    pub(crate) fn pass(mut first: impl End, mut second: impl End + Send) {
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for _ in 0..100 {
                    let sample = second.receive().unwrap();
                    second.send(&sample).unwrap();
                }
            });
            for number in 1..=100 {
                first.send(&Sample::new(number)).unwrap();
                assert_eq!(first.receive().unwrap(), Sample::new(number));
            }
        });
    }

    #[test]
    fn a_receiver_gives_up_when_nobody_ever_sends_and_bears_any_number_of_wakes_in_vain() {
        let mut sleeps = 0;
        let time_out = || {
            sleeps += 1;
            Ok(Slept::TimedOut)
        };
        let silent = sleep_until(|| Ok(None::<()>), time_out);
        assert!(matches!(silent, Err(Fault::Silent(_))));
        assert_eq!(sleeps, 50);
        let mut looks = 0;
        let look = || {
            looks += 1;
            Ok((looks > 1000).then_some(looks))
        };
        assert_eq!(sleep_until(look, || Ok(Slept::Woken)).unwrap(), 1001);
    }
}
