//! Tests the protocol of `word.rs` with one waiter and at most two ringers, three threads in all,
//! under every interleaving that the memory model allows with at most three preemptions, that is,
//! switches between threads where the running one could have gone on. The tests show nothing about
//! more threads or switches; `tests/bus/stress.rs` tries that with real processes.
//!
//! The word is loom's, and so is the futex: a queue behind a lock, which compares and goes to sleep
//! in one step, like the kernel's. A waiter has a time-out only if the model gives it one, so a
//! lost wake-up is a deadlock, which loom reports.

use core::sync::atomic::Ordering;
use core::time::Duration;

use loom::sync::atomic::{AtomicBool, AtomicU32};
use loom::sync::{Arc, Condvar, Mutex};
use loom::thread;

use super::word::{self, Ended, Rung, Sleeper, Word};

/// How many switches between threads that the code does not force there may be in one run. Loom's
/// authors find all known bugs with two or three; without a bound a run takes hours.
const PREEMPTIONS: usize = 3;

pub(super) fn under_bounded_interleavings(run: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(PREEMPTIONS);
    builder.check(run);
}

struct Modelled {
    word: AtomicU32,
    queue: Mutex<()>,
    sleeper: Condvar,
    reasons: [AtomicBool; 2],
    /// The next sleep ends at once, as if its time were over.
    impatient: AtomicBool,
    /// The samples that the ringers have published on two topics, one after the other.
    samples: [AtomicU32; 2],
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
        if self.impatient.swap(false, Ordering::Relaxed) {
            return Ended::TimedOut;
        }
        let queue = self.queue.lock().unwrap();
        if self.word.load(Ordering::Relaxed) == value {
            drop(self.sleeper.wait(queue).unwrap());
        }
        Ended::Awake
    }

    fn wake(&self) -> u32 {
        let _queue = self.queue.lock().unwrap();
        self.sleeper.notify_one();
        1
    }
}

impl Rung for Modelled {
    fn fetch_add(&self, value: u32, order: Ordering) -> u32 {
        self.word.fetch_add(value, order)
    }

    fn fetch_and(&self, mask: u32, order: Ordering) -> u32 {
        self.word.fetch_and(mask, order)
    }

    fn set_reason(&self, reason: usize, order: Ordering) {
        // A plain store in memory. Loom does not know that a store after a swap's read of the value
        // before it also comes after the swap; every machine keeps that order.
        self.reasons[reason].swap(true, order);
    }

    fn take_reason(&self, reason: usize, order: Ordering) -> bool {
        let reason = &self.reasons[reason];
        reason.load(Ordering::Relaxed) && reason.swap(false, order)
    }
}

impl Modelled {
    fn new() -> Arc<Self> {
        Arc::new(Self {
            word: AtomicU32::new(0),
            queue: Mutex::new(()),
            sleeper: Condvar::new(),
            reasons: [AtomicBool::new(false), AtomicBool::new(false)],
            impatient: AtomicBool::new(false),
            samples: [AtomicU32::new(0), AtomicU32::new(0)],
        })
    }

    fn publish(&self, topic: usize) {
        // Relaxed: the ring must make it visible.
        self.samples[topic].fetch_add(1, Ordering::Relaxed);
    }

    fn publish_and_ring(&self, topic: usize) {
        self.publish(topic);
        word::ring(self, topic);
    }

    /// A service's loop: drains everything, then waits and drains the topics that were rung for,
    /// until `wanted` samples have come.
    fn receive(&self, sleeper: &Sleeper, wanted: u32) {
        let mut received = [0, 1].map(|topic: usize| self.samples[topic].load(Ordering::Relaxed));
        while received.iter().sum::<u32>() < wanted {
            if !sleeper.rung(self) {
                sleeper.sleep(self, Duration::MAX);
            }
            for (topic, received) in received.iter_mut().enumerate() {
                if word::rung_for(self, topic) {
                    *received = self.samples[topic].load(Ordering::Relaxed);
                }
            }
        }
    }
}

/// Two ringers with one sample each, each on its own topic.
fn two_ringers(modelled: &Arc<Modelled>) -> [thread::JoinHandle<()>; 2] {
    [0, 1].map(|topic| {
        let modelled = Arc::clone(modelled);
        thread::spawn(move || modelled.publish_and_ring(topic))
    })
}

#[test]
fn no_ring_of_two_ringers_is_lost() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let sleeper = Sleeper::new(&*modelled);
        let ringers = two_ringers(&modelled);
        modelled.receive(&sleeper, 2);
        for ringer in ringers {
            ringer.join().unwrap();
        }
    });
}

#[test]
fn a_ringer_that_rings_again_and_again_is_heard_each_time() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let sleeper = Sleeper::new(&*modelled);
        let ringer = thread::spawn({
            let modelled = Arc::clone(&modelled);
            move || {
                for _ in 0..3 {
                    modelled.publish_and_ring(0);
                }
            }
        });
        modelled.receive(&sleeper, 3);
        ringer.join().unwrap();
    });
}

#[test]
fn a_sleep_that_ends_by_its_time_out_loses_nothing() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        modelled.impatient.store(true, Ordering::Relaxed);
        let sleeper = Sleeper::new(&*modelled);
        let ringers = two_ringers(&modelled);
        modelled.receive(&sleeper, 2);
        for ringer in ringers {
            ringer.join().unwrap();
        }
    });
}

#[test]
fn a_ringer_killed_before_its_wake_does_not_silence_the_next() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        let sleeper = Sleeper::new(&*modelled);
        let killed = thread::spawn({
            let modelled = Arc::clone(&modelled);
            move || {
                word::count(&*modelled, 0);
            }
        });
        let next = thread::spawn({
            let modelled = Arc::clone(&modelled);
            move || modelled.publish_and_ring(0)
        });
        modelled.receive(&sleeper, 1);
        killed.join().unwrap();
        next.join().unwrap();
    });
}

#[test]
fn a_waiter_killed_asleep_leaves_a_word_its_successor_can_use() {
    under_bounded_interleavings(|| {
        let modelled = Modelled::new();
        modelled.word.store(6 | word::SLEEPING, Ordering::Relaxed);
        let ringers = two_ringers(&modelled);
        let sleeper = Sleeper::new(&*modelled);
        modelled.receive(&sleeper, 2);
        for ringer in ringers {
            ringer.join().unwrap();
        }
    });
}
