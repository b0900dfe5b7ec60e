//! Rings millions of times and searches for a ring that is lost.
//!
//! Rounds of random length: two ringers ring four waiters at random, with random pauses. Then they
//! stop until every waiter has answered its last ring. No later ring can make up for a lost one,
//! nor can a time-out, because three of the waiters wait a minute. So a waiter that has not
//! answered a second after the round has slept through a ring. The fourth waiter waits for short,
//! random times, so that time-outs and rings meet, and answers only when a ring ends its wait.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use lager_topics::Role;
use lager_wake::{Policy, Ringer, Wake};

use crate::domain::Domain;

/// Rings in an ordinary test run. `tests/run` makes more in a release build, and a soak many more.
const RINGS: u64 = 1_000_000;
const RINGS_VARIABLE: &str = "LAGER_SOAK_RINGS";

const RINGERS: usize = 2;
const WAITERS: usize = 4;

/// A waiter that still sleeps this long after its last ring has lost it.
const LOST: Duration = Duration::from_secs(1);

/// xorshift64, which is random enough for pauses.
struct Dice(u64);

impl Dice {
    fn new(player: usize) -> Self {
        Self(0x9e37_79b9_7f4a_7c15 ^ (player as u64 + 1) << 32)
    }

    fn below(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % sides
    }

    /// Mostly no pause, sometimes a short spin, and now and then a yield to all other threads.
    fn pause(&mut self) {
        match self.below(256) {
            0 => std::thread::yield_now(),
            1..64 => (0..self.below(200)).for_each(|_| std::hint::spin_loop()),
            _ => (),
        }
    }
}

#[derive(Default)]
struct Seat {
    /// Rings given to this waiter; counted before the ring.
    asked: AtomicU64,
    /// The value of `asked` after the last wait that a ring ended.
    answered: AtomicU64,
    /// The waiter's thread.
    thread: AtomicI32,
}

impl Seat {
    fn is_silent(&self) -> bool {
        self.answered.load(Ordering::Acquire) != self.asked.load(Ordering::Acquire)
    }

    /// Whether the kernel lets it sleep. A waiter that only waits for a core has lost nothing.
    fn is_asleep(&self) -> bool {
        let thread = self.thread.load(Ordering::Acquire);
        let state = std::fs::read_to_string(format!("/proc/self/task/{thread}/stat")).unwrap();
        // The state follows the name. The name is in parentheses.
        state[state.rfind(')').unwrap() + 1..]
            .trim()
            .starts_with('S')
    }
}

#[test]
fn no_waiter_sleeps_through_a_ring() {
    let rings = std::env::var(RINGS_VARIABLE).map_or(RINGS, |text| {
        text.replace('_', "").parse().expect("a number of rings")
    });
    let domain = Domain::new();
    let seats: [Seat; WAITERS] = Default::default();
    let stop = AtomicBool::new(false);
    let given = AtomicU64::new(0);
    let lost = AtomicU64::new(0);
    let sleeps = AtomicU64::new(0);
    let together = Barrier::new(RINGERS);
    let (send, ringers) = std::sync::mpsc::channel();

    std::thread::scope(|scope| {
        for (index, seat) in seats.iter().enumerate() {
            let (send, domain, stop, sleeps) = (send.clone(), &domain, &stop, &sleeps);
            scope.spawn(move || {
                let policy = [
                    Policy::Block,
                    Policy::Block,
                    Policy::ADAPTIVE,
                    Policy::Block,
                ];
                // Each waiter is on a bus of its own, like processes.
                let bus = domain.open([Role::Logic, Role::Bridge][index % 2]);
                let waiter = bus.waiter(policy[index]).unwrap();
                send.send((index, waiter.ringer())).unwrap();
                let thread = rustix::thread::gettid().as_raw_nonzero().get();
                seat.thread.store(thread, Ordering::Release);
                let mut dice = Dice::new(index);
                while !stop.load(Ordering::Acquire) {
                    let timeout = if index == 3 {
                        Duration::from_nanos(dice.below(60_000))
                    } else {
                        Duration::from_secs(60)
                    };
                    if waiter.wait(timeout) == Wake::Rung {
                        let asked = seat.asked.load(Ordering::Acquire);
                        seat.answered.store(asked, Ordering::Release);
                    }
                    dice.pause();
                }
                sleeps.fetch_add(waiter.sleeps(), Ordering::Relaxed);
            });
        }
        let mut ringers: Vec<(usize, Ringer)> = ringers.iter().take(WAITERS).collect();
        ringers.sort_by_key(|(index, _)| *index);
        let players: Vec<_> = (0..RINGERS)
            .map(|player| {
                let ringers: Vec<_> = ringers.iter().map(|(_, ringer)| ringer.clone()).collect();
                let (seats, given, lost, together) = (&seats, &given, &lost, &together);
                scope.spawn(move || {
                    let mut dice = Dice::new(WAITERS + player);
                    while given.load(Ordering::Acquire) < rings && lost.load(Ordering::Acquire) == 0
                    {
                        together.wait();
                        let round = 1 + dice.below(500);
                        for _ in 0..round {
                            let index = dice.below(WAITERS as u64) as usize;
                            seats[index].asked.fetch_add(1, Ordering::AcqRel);
                            ringers[index].ring();
                            dice.pause();
                        }
                        given.fetch_add(round, Ordering::AcqRel);
                        if together.wait().is_leader() {
                            lost.fetch_add(unanswered(seats), Ordering::AcqRel);
                        }
                        // So that both see the same state and leave in the same round.
                        together.wait();
                    }
                })
            })
            .collect();
        for player in players {
            player.join().unwrap();
        }
        stop.store(true, Ordering::Release);
        ringers.iter().for_each(|(_, ringer)| ringer.ring());
    });

    let (given, sleeps) = (given.into_inner(), sleeps.into_inner());
    println!("{given} rings, {sleeps} sleeps");
    assert_eq!(lost.into_inner(), 0, "waiters slept through a ring");
    assert!(given >= rings);
    // Otherwise the test would not have tested sleeping.
    assert!(sleeps > rings / 1000, "only {sleeps} sleeps");
}

/// Waits until all waiters have answered the last ring; returns how many sleep instead.
fn unanswered(seats: &[Seat]) -> u64 {
    let start = Instant::now();
    while seats.iter().any(Seat::is_silent) {
        if start.elapsed() > LOST {
            let lost = |seat: &&Seat| seat.is_silent() && seat.is_asleep() && seat.is_silent();
            let lost = seats.iter().filter(lost).count() as u64;
            if lost > 0 {
                return lost;
            }
        }
        std::thread::yield_now();
    }
    0
}
