//! [`Crier`]: the thread that wakes watchers for the writers of its process.
//!
//! A writer rings it with one store and one addition, and wakes it with one system call if it
//! sleeps (`word`). It then wakes all watchers of the topic (`watch`). A process has no such thread
//! until a writer of it finds a watcher that sleeps.
//!
//! It never wakes more than 50 000 watchers a second: between two cries it leaves 20 us for each
//! watcher that the first one has woken. So 500 watchers of a topic with 1 000 samples a second do
//! not take all cores. They are woken a hundred times a second, each time for ten samples. Below
//! that rate the crier needs no timer.
//!
//! **Invariant:** the crier only wakes. It never reads a sample and never waits for a watcher.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::time::Instant;

use super::board::{Seat, WATCHED};
use super::mapping::Mapping;
use super::word::{self, Sleeper};
use super::{INSIDE, watch};
use crate::urgency;

/// The time that the crier leaves for each watcher that it has woken.
const EACH: Duration = Duration::from_micros(20);

/// Ends its thread when it is dropped.
pub(super) struct Crier {
    shared: Arc<Shared>,
}

struct Shared {
    bell: Seat,
    /// The words on which somebody sleeps, as bits.
    due: [AtomicU64; WATCHED / 64],
    ends: AtomicBool,
}

impl Crier {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system has no place for another thread.
    pub(super) fn start(board: Mapping) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            bell: Seat::default(),
            due: [const { AtomicU64::new(0) }; WATCHED / 64],
            ends: AtomicBool::new(false),
        });
        let heard = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("crier".to_owned())
            // It is kept in RAM where all of the process is.
            .stack_size(64 * 1024)
            .spawn(move || cry(&board, &heard))?;
        Ok(Self { shared })
    }

    /// Lets it wake all who sleep on that word.
    pub(super) fn ring(&self, word: usize) {
        let due = &self.shared.due[word / 64 % self.shared.due.len()];
        // The ring makes it visible.
        due.fetch_or(1 << (word % 64), Ordering::Relaxed);
        word::ring(&self.shared.bell, INSIDE);
    }
}

impl Drop for Crier {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        word::ring(&self.shared.bell, INSIDE);
    }
}

fn cry(board: &Mapping, shared: &Shared) {
    urgency::stand_back();
    // Rings from before this are found by the first look at what is due.
    let sleeper = Sleeper::new(&shared.bell);
    let mut rested = Instant::now();
    while !shared.ends.load(Ordering::Relaxed) {
        let early = rested.saturating_duration_since(Instant::now());
        if !early.is_zero() {
            std::thread::sleep(early);
        }
        let mut woken = 0;
        for (first, due) in shared.due.iter().enumerate() {
            if due.load(Ordering::Relaxed) == 0 {
                continue;
            }
            let mut words = due.swap(0, Ordering::Relaxed);
            while words != 0 {
                let word = 64 * first + words.trailing_zeros() as usize;
                woken += watch::cry(board.watched(word));
                words &= words - 1;
            }
        }
        rested = Instant::now() + EACH * woken;
        if !sleeper.rung(&shared.bell) {
            sleeper.sleep(&shared.bell, Duration::MAX);
        }
    }
}
