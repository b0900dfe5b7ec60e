//! [`Watch`]: the longest time for which this machine gave a core to nobody here.
//!
//! Other virtual machines, or other programs, can take a core for a second. What was measured
//! meanwhile says nothing, and a robot rightly stands, because its commands are late. A thread that
//! only sleeps sees it: it wakes late by that time.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Instant;

use crate::schedule::{pin, usable_cores};

/// How long a watching thread sleeps. It takes some microseconds of its core each time, which a
/// measurement beside it does not notice.
const EVERY: Duration = Duration::from_millis(50);

/// Watches every core that this thread may use, until it is dropped or asked for the end.
#[derive(Debug)]
pub struct Watch {
    shared: Arc<Seen>,
    watchers: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Seen {
    ends: AtomicBool,
    longest_ns: AtomicU64,
}

impl Watch {
    /// Starts a thread on each core.
    #[must_use]
    pub fn begin() -> Self {
        let shared = Arc::new(Seen::default());
        let start = |core| {
            let seen = Arc::clone(&shared);
            std::thread::spawn(move || {
                // Without this right it watches wherever it runs.
                let _ = pin(core);
                while !seen.ends.load(Ordering::Relaxed) {
                    let slept = Instant::now();
                    std::thread::sleep(EVERY);
                    let late = slept.elapsed().saturating_sub(EVERY);
                    let late = u64::try_from(late.as_nanos()).unwrap_or(u64::MAX);
                    seen.longest_ns.fetch_max(late, Ordering::Relaxed);
                }
            })
        };
        let watchers = usable_cores().into_iter().map(start).collect();
        Self { shared, watchers }
    }

    /// Ends the watch; returns the longest time for which a core was held up. A time that is not
    /// over yet counts.
    #[must_use]
    pub fn end(mut self) -> Duration {
        self.join();
        Duration::from_nanos(self.shared.longest_ns.load(Ordering::Relaxed))
    }

    fn join(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        for watcher in self.watchers.drain(..) {
            // It only sleeps and counts, so it cannot panic.
            let _ = watcher.join();
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.join();
    }
}
