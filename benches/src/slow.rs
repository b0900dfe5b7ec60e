//! Deliberate slow-downs beside what is measured, so that the guard's own test can show that the
//! guard notices them.
//!
//! They stand where the code of `lager-ports` would do the same: in the bench code around its
//! calls, never in a crate that runs on the robot. Without the feature `slow-downs` every function
//! here is empty, so that the figures anybody else sees are of the code alone; with it,
//! `LAGER_BENCH_SLOW` says which one is at work, in all processes of a measurement.

pub use at_work::{publish, receive, refuse_in_vain};

/// Names the slow-down: `allocation`, `spin` or `system-call`.
pub const VARIABLE: &str = "LAGER_BENCH_SLOW";

#[cfg(not(feature = "slow-downs"))]
mod at_work {
    /// To be called beside each publishing on a topic that so many observers read.
    #[inline(always)]
    pub fn publish(_observers: usize) {}

    /// To be called beside each receiving.
    #[inline(always)]
    pub fn receive() {}

    /// Ends the process if a slow-down is asked for: measuring without it would prove nothing.
    pub fn refuse_in_vain() {
        if std::env::var_os(super::VARIABLE).is_some() {
            eprintln!(
                "{} is set, but this was built without the feature `slow-downs`; build it with that feature, or unset the variable",
                super::VARIABLE
            );
            std::process::exit(2);
        }
    }
}

#[cfg(feature = "slow-downs")]
mod at_work {
    use core::sync::atomic::AtomicU32;
    use core::time::Duration;
    use std::hint::black_box;
    use std::sync::OnceLock;
    use std::time::Instant;

    #[derive(Clone, Copy, PartialEq)]
    enum Slow {
        Not,
        Allocation,
        Spin,
        SystemCall,
    }

    /// To be called beside each publishing on a topic that so many observers read.
    #[inline]
    pub fn publish(observers: usize) {
        match which() {
            Slow::Not => {}
            Slow::Allocation => allocate(),
            Slow::Spin => spin(),
            Slow::SystemCall => (0..observers).for_each(|_| wake_nobody()),
        }
    }

    /// To be called beside each receiving.
    #[inline]
    pub fn receive() {
        if which() == Slow::Allocation {
            allocate();
        }
    }

    /// Ends the process if the variable names no slow-down: measuring without it would prove
    /// nothing.
    pub fn refuse_in_vain() {
        which();
    }

    fn which() -> Slow {
        static WHICH: OnceLock<Slow> = OnceLock::new();
        *WHICH.get_or_init(|| match std::env::var(super::VARIABLE).as_deref() {
            Err(_) => Slow::Not,
            Ok("allocation") => Slow::Allocation,
            Ok("spin") => Slow::Spin,
            Ok("system-call") => Slow::SystemCall,
            Ok(other) => {
                eprintln!(
                    "{} is `{other}`; set it to allocation, spin or system-call",
                    super::VARIABLE
                );
                std::process::exit(2);
            }
        })
    }

    /// What `loan` of plain iceoryx2 does: a small cell on the heap for each sample.
    fn allocate() {
        drop(black_box(Box::new([0_u8; 64])));
    }

    /// Five microseconds of nothing.
    fn spin() {
        let start = Instant::now();
        while start.elapsed() < Duration::from_micros(5) {
            core::hint::spin_loop();
        }
    }

    /// What ringing an observer would cost even when nobody sleeps.
    fn wake_nobody() {
        static WORD: AtomicU32 = AtomicU32::new(0);
        // Nobody waits on the word, which is what the kernel then says.
        let _ = rustix::thread::futex::wake(&WORD, rustix::thread::futex::Flags::PRIVATE, 1);
    }
}
