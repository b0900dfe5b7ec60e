//! Tests the protocol of `watch.rs` with three threads, under every interleaving that the memory
//! model allows with at most three preemptions, as `interleaving_tests.rs` does for `word.rs`.
//!
//! A watcher here has no time-out, so one that sleeps through a sample is a deadlock, which loom
//! reports.

use core::sync::atomic::Ordering;
use core::time::Duration;

use loom::sync::atomic::{AtomicU32, fence};
use loom::sync::{Arc, Condvar, Mutex};
use loom::thread;

use super::interleaving_tests::under_bounded_interleavings;
use super::watch::{self, Watched};
use super::word::{Ended, Word};

struct Modelled {
    word: AtomicU32,
    queue: Mutex<()>,
    sleepers: Condvar,
    /// The samples that the writers have published.
    samples: AtomicU32,
    /// How often the writer has asked the crier to cry, and whether it has ended.
    asked: Mutex<(u32, bool)>,
    crier: Condvar,
}

impl Word for Modelled {
    fn load(&self, order: Ordering) -> u32 {
        self.word.load(order)
    }

    fn exchange(&self, current: u32, new: u32, success: Ordering, failure: Ordering) -> bool {
        self.word
            .compare_exchange(current, new, success, failure)
            .is_ok()
    }

    fn sleep_while(&self, value: u32, _: Duration) -> Ended {
        let queue = self.queue.lock().unwrap();
        if self.word.load(Ordering::Relaxed) == value {
            drop(self.sleepers.wait(queue).unwrap());
        }
        Ended::Awake
    }

    fn wake(&self) -> u32 {
        let _queue = self.queue.lock().unwrap();
        self.sleepers.notify_all();
        1
    }
}

impl Watched for Modelled {
    fn fence(&self) {
        fence(Ordering::SeqCst);
    }
}

impl Modelled {
    fn new() -> Arc<Self> {
        Arc::new(Self {
            word: AtomicU32::new(0),
            queue: Mutex::new(()),
            sleepers: Condvar::new(),
            samples: AtomicU32::new(0),
            asked: Mutex::new((0, false)),
            crier: Condvar::new(),
        })
    }

    /// Publishes a sample; returns whether somebody is to be woken.
    fn publish(&self) -> bool {
        // Relaxed: the fences must make it visible.
        self.samples.fetch_add(1, Ordering::Relaxed);
        watch::is_awaited(self)
    }

    /// A writer that is its own crier.
    fn publish_and_cry(&self) {
        if self.publish() {
            watch::cry(self);
        }
    }

    /// A watcher's loop until that many samples have come.
    fn receive(&self, wanted: u32) {
        loop {
            let announced = watch::announce(self);
            if self.samples.load(Ordering::Relaxed) >= wanted {
                return;
            }
            watch::sleep(self, announced, Duration::MAX);
        }
    }
}

fn beside(
    modelled: &Arc<Modelled>,
    run: impl FnOnce(&Modelled) + 'static,
) -> thread::JoinHandle<()> {
    let modelled = Arc::clone(modelled);
    thread::spawn(move || run(&modelled))
}

#[test]
fn two_watchers_miss_no_sample() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let other = beside(&modelled, |modelled| modelled.receive(2));
        let writer = beside(&modelled, |modelled| {
            modelled.publish_and_cry();
            modelled.publish_and_cry();
        });
        modelled.receive(2);
        other.join().unwrap();
        writer.join().unwrap();
    });
}

#[test]
fn a_watcher_misses_no_sample_of_two_writers() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let writers = [(); 2].map(|()| beside(&modelled, Modelled::publish_and_cry));
        modelled.receive(2);
        for writer in writers {
            writer.join().unwrap();
        }
    });
}

#[test]
fn a_watcher_is_woken_by_a_crier_that_is_not_the_writer() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let crier = beside(&modelled, |modelled| {
            let mut heard = (0, false);
            while !heard.1 {
                let mut asked = modelled.asked.lock().unwrap();
                while *asked == heard {
                    asked = modelled.crier.wait(asked).unwrap();
                }
                heard = *asked;
                drop(asked);
                watch::cry(modelled);
            }
        });
        let writer = beside(&modelled, |modelled| {
            let ask = |rings, ends| {
                let mut asked = modelled.asked.lock().unwrap();
                *asked = (asked.0 + rings, ends);
                modelled.crier.notify_one();
            };
            for _ in 0..2 {
                if modelled.publish() {
                    ask(1, false);
                }
            }
            ask(0, true);
        });
        modelled.receive(2);
        writer.join().unwrap();
        crier.join().unwrap();
    });
}

#[test]
fn a_watcher_that_stops_before_or_after_it_is_woken_holds_nobody_up() {
    for sleeps in [false, true] {
        under_bounded_interleavings(move || {
            let modelled = Modelled::new();
            let stopped = beside(&modelled, move |modelled| {
                let announced = watch::announce(modelled);
                if sleeps && modelled.samples.load(Ordering::Relaxed) == 0 {
                    watch::sleep(modelled, announced, Duration::MAX);
                }
                // It goes no further.
            });
            let writer = beside(&modelled, Modelled::publish_and_cry);
            modelled.receive(1);
            stopped.join().unwrap();
            writer.join().unwrap();
        });
    }
}

#[test]
fn a_writer_killed_before_its_cry_silences_only_itself() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let killed = beside(&modelled, |modelled| {
            modelled.publish();
        });
        let next = beside(&modelled, Modelled::publish_and_cry);
        // Whichever was first, the sample of the one that lives has come.
        modelled.receive(1);
        killed.join().unwrap();
        next.join().unwrap();
    });
}
