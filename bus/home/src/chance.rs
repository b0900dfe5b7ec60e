//! [`Chance`]: how long a thread could have run in a span of time, as it waited for no core.
//!
//! A program that judges a silent process needs this. A hung process sleeps or runs in an endless
//! loop. A process on a busy machine is ready but gets no core. By the wall clock both are equally
//! silent. The kernel counts how long each thread waits for a core (`schedstat`), and the thread's
//! state shows a wait that has not ended yet. Some kernels do not count the waits. They show the
//! state and how long the thread has run, so a thread that was ready and did not run has waited.

use core::time::Duration;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

/// The clock tick of `/proc/PID/stat` on every Linux in common use.
const TICK: Duration = Duration::from_millis(10);

/// A thread that is looked at again and again.
#[derive(Debug)]
pub struct Chance {
    folder: PathBuf,
    before: Option<Counted>,
}

/// The kernel's counts for a thread at one look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counted {
    ran: Duration,
    /// How long it was ready while another thread had the core.
    waited: Duration,
    /// Whether it runs, or would run if it had a core.
    is_ready: bool,
}

impl Chance {
    /// For the first thread of a process.
    #[must_use]
    pub fn of_process(pid: u32) -> Self {
        Self::at(format!("/proc/{pid}/task/{pid}"))
    }

    /// For a thread of this process, by its number.
    pub fn of_own_thread(thread: u32) -> Self {
        Self::at(format!("/proc/self/task/{thread}"))
    }

    fn at(folder: String) -> Self {
        Self {
            folder: folder.into(),
            before: None,
        }
    }

    /// How much of `piece`, the time since the last look, the thread could have run. Returns all of
    /// `piece` at the first look and if the thread is gone, because nothing is known then.
    pub fn of(&mut self, piece: Duration) -> Duration {
        let now = self.counted();
        let before = core::mem::replace(&mut self.before, now);
        match (before, now) {
            (Some(before), Some(now)) => now.chance_since(&before, piece),
            _ => piece,
        }
    }

    fn counted(&self) -> Option<Counted> {
        let stat = fs::read_to_string(self.folder.join("stat")).ok()?;
        let waits = fs::read_to_string(self.folder.join("schedstat")).ok();
        Counted::read(&stat, waits.as_deref())
    }
}

/// How long a process could have run in all, since this clock was made.
#[derive(Debug)]
pub struct ChanceClock {
    chance: Chance,
    looked: Instant,
    shown: Duration,
}

impl ChanceClock {
    /// Begins at zero.
    #[must_use]
    pub fn of_process(pid: u32) -> Self {
        Self {
            chance: Chance::of_process(pid),
            looked: Instant::now(),
            shown: Duration::ZERO,
        }
    }

    /// Looks at the process. A pause since the last look counts for at most `longest`, because the
    /// caller itself may have slept.
    pub fn look(&mut self, longest: Duration) -> Duration {
        let now = Instant::now();
        let piece = (now - self.looked).min(longest);
        self.looked = now;
        self.shown += self.chance.of(piece);
        self.shown
    }
}

impl Counted {
    /// Reads `stat`, and `schedstat` if the kernel has it.
    fn read(stat: &str, waits: Option<&str>) -> Option<Self> {
        // The state follows the name. The name is in parentheses and may contain anything.
        let (_, rest) = stat.rsplit_once(") ")?;
        let mut fields = rest.split(' ');
        let is_ready = fields.next()? == "R";
        // User time and system time are the eleventh and twelfth fields after the state.
        let ticks = |text: Option<&str>| text?.parse::<u32>().ok();
        let mut fields = fields.skip(10);
        let ran = TICK * (ticks(fields.next())? + ticks(fields.next())?);
        let mut counts = waits.unwrap_or_default().split_ascii_whitespace();
        let ns = |text: Option<&str>| text?.parse().ok().map(Duration::from_nanos);
        Some(match (ns(counts.next()), ns(counts.next())) {
            (Some(ran), Some(waited)) => Self {
                ran,
                waited,
                is_ready,
            },
            _ => Self {
                ran,
                waited: Duration::ZERO,
                is_ready,
            },
        })
    }

    fn chance_since(&self, before: &Self, piece: Duration) -> Duration {
        let waited = self.waited.saturating_sub(before.waited);
        // The kernel counts a wait only when it is over.
        let waits =
            self.is_ready && before.is_ready && (self.ran, waited) == (before.ran, Duration::ZERO);
        match waits {
            true => Duration::ZERO,
            false => piece.saturating_sub(waited),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAT: &str = "7 (a) b) R 1 7 7 0 -1 4194304 1 0 0 0 30 12 0 0 20 0 1 0 5 3 4 5";

    fn ms(count: u64) -> Duration {
        Duration::from_millis(count)
    }

    fn counted(ran: u64, waited: u64, is_ready: bool) -> Counted {
        Counted {
            ran: ms(ran),
            waited: ms(waited),
            is_ready,
        }
    }

    #[test]
    fn what_the_kernel_has_counted_is_read_with_and_without_the_waits() {
        let with = Counted::read(STAT, Some("400000000 50000000 9\n"));
        assert_eq!(with, Some(counted(400, 50, true)));
        for waits in [None, Some(""), Some("what")] {
            assert_eq!(Counted::read(STAT, waits), Some(counted(420, 0, true)));
        }
        let sleeps = STAT.replace(") R", ") S");
        assert_eq!(Counted::read(&sleeps, None), Some(counted(420, 0, false)));
        for other in ["", "7 (a) R", "no stat at all"] {
            assert_eq!(Counted::read(other, None), None, "{other}");
        }
    }

    #[test]
    fn a_thread_that_sleeps_or_runs_had_its_chance_and_one_that_waited_had_none() {
        let before = counted(100, 10, true);
        for (now, chance) in [
            // The thread slept, was stopped, or ran in a circle.
            (counted(100, 10, false), 500),
            (counted(600, 10, true), 500),
            // It waited for a core for a part of the time, or for nearly all, and got one.
            (counted(150, 210, true), 300),
            (counted(101, 509, false), 1),
            // It still waits, or has waited since before the look.
            (counted(100, 10, true), 0),
            (counted(101, 900, true), 0),
        ] {
            assert_eq!(now.chance_since(&before, ms(500)), ms(chance), "{now:?}");
        }
        // The kernel counts no waits.
        let before = counted(100, 0, true);
        assert_eq!(before.chance_since(&before, ms(500)), ms(0));
    }

    #[test]
    fn a_thread_that_is_stopped_had_its_chance_and_so_had_one_that_is_gone() {
        let mut own = Chance::of_process(std::process::id());
        assert_eq!(own.of(ms(3)), ms(3), "nothing is known of before");
        assert!(own.counted().is_some());
        let mut gone = Chance::of_process(u32::MAX);
        assert_eq!([gone.of(ms(3)), gone.of(ms(4))], [ms(3), ms(4)]);
    }
}
