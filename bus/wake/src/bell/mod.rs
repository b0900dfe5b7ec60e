//! How one thread wakes another, in its own or another process: a board of bells in shared memory.
//!
//! It replaces iceoryx2's events. Each waiter has a seat on the board of its unit: one futex word
//! in shared memory, on which it sleeps for all its topics at once. A publisher adds to the words
//! of the parts that act on its topic. It makes a system call only if a word says that its owner
//! sleeps. Observers have no seat and cost a ringer nothing. Nothing has to be connected: the next
//! sample rings a waiter that starts late, restarts or replaces a killed one.
//!
//! An observer that wants to be woken is a watcher. Any number of watchers sleep on one word for
//! their topic. The writer looks at that word when it has served everybody, and lets a thread that
//! is not on the path wake them.
//!
//! | file | contents |
//! |---|---|
//! | `word` | the ring and sleep protocol; `interleaving_tests` checks it with three threads |
//! | `watch` | the same for watchers; `watch_interleaving_tests` checks it |
//! | `futex` | both words as futexes |
//! | `board` | the shared memory: who is rung for what, who may look without pause |
//! | `crier` | the thread that wakes watchers |
//! | `mapping`, `segment`, `locks` | its file: joining, leaving, seats, and what killed processes leave |
//! | `rhythm` | when it is worth looking without pause |
//!
//! **Invariant:** a ring is a hint, and so are its reasons (the topics for which it was). A waiter
//! has a time-out and looks at everything now and then. Ringing and waiting do not allocate.

mod board;
mod crier;
mod futex;
#[cfg(test)]
mod interleaving_tests;
mod locks;
mod mapping;
mod rhythm;
mod segment;
mod watch;
#[cfg(test)]
mod watch_interleaving_tests;
mod word;

use core::time::Duration;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use lager_home::{Home, UnitName};
use lager_sample::Part;
use rustix::thread::futex::Wait;

pub use board::SEATS_PER_PART;
pub(crate) use rhythm::{Plan, Rhythm};
pub use segment::BoardFault;
use segment::Segment;
use word::Sleeper;

/// The reason of a ring from a thread of the waiter's own process.
pub(crate) const INSIDE: usize = 0;

/// The reason of a ring for the topic or request with the number `id`, the same in every process
/// and build. If two topics share a reason, a ring for one makes the waiter look at both.
pub(crate) const fn reason(id: u32) -> usize {
    1 + id as usize % (board::REASONS - 1)
}

/// The word for watchers of the topic with the number `id`, the same in every process and build.
const fn watched(id: u32) -> usize {
    id as usize % board::WATCHED
}

/// A unit's board. The first port of this process that needs it opens it, the last one closes it.
pub struct Board {
    home: Home,
    unit: UnitName,
    segment: Mutex<Weak<Segment>>,
}

impl Board {
    /// The board of `unit`, not opened yet.
    pub fn of(home: &Home, unit: &UnitName) -> Self {
        Self {
            home: home.clone(),
            unit: unit.clone(),
            segment: Mutex::default(),
        }
    }

    fn open(&self) -> Result<Arc<Segment>, BoardFault> {
        let mut known = self.segment.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(segment) = known.upgrade() {
            return Ok(segment);
        }
        // Makes the unit's folder if it is missing.
        self.home.unit(&self.unit);
        let path = self.home.bells(&self.unit);
        let segment = Arc::new(Segment::join(&path)?);
        *known = Arc::downgrade(&segment);
        Ok(segment)
    }
}

/// Clears the seats of killed processes on one unit's board, and removes a board that nobody uses.
pub fn sweep(home: &Home, unit: &UnitName) {
    sweep_at(&home.bells(unit));
}

/// Does this for every unit of the bus.
pub fn sweep_all(home: &Home) {
    for unit in home.units() {
        sweep(home, &unit);
    }
}

fn sweep_at(path: &std::path::Path) {
    // A board that cannot be swept now, because a process is just joining, is swept the next time.
    // The last process that leaves removes the file.
    if let Ok(Some(segment)) = Segment::existing(path) {
        let _ = segment.sweep();
    }
}

/// The living processes with a waiter for `part`, each once for every such waiter.
pub fn woken(home: &Home, unit: &UnitName, part: Part) -> Vec<u32> {
    match Segment::existing(&home.bells(unit)) {
        Ok(Some(segment)) => segment.woken(part),
        _ => Vec::new(),
    }
}

/// The actor's side: one seat on a board.
pub(crate) struct Bell {
    segment: Arc<Segment>,
    seat: usize,
    sleeper: Sleeper,
}

impl Bell {
    /// Takes a seat for `part`.
    pub(crate) fn hang(board: &Board, part: Part) -> Result<Self, BoardFault> {
        let segment = board.open()?;
        let seat = segment.take_seat(part)?;
        let sleeper = Sleeper::new(segment.seat(seat));
        Ok(Self {
            segment,
            seat,
            sleeper,
        })
    }

    /// Whether it has been rung since the last call. Makes no system call.
    #[inline]
    pub(crate) fn rung(&self) -> bool {
        self.sleeper.rung(self.segment.seat(self.seat))
    }

    /// Whether it has been rung for `reason` since the last call. Call it after a ring was noticed.
    #[inline]
    pub(crate) fn rung_for(&self, reason: usize) -> bool {
        word::rung_for(self.segment.seat(self.seat), reason)
    }

    /// Sleeps until a ring, at most `timeout`; true if a ring or a signal ended the sleep. If it
    /// has been rung since the last call, it does not sleep.
    pub(crate) fn sleep(&self, timeout: Duration) -> bool {
        self.sleeper.sleep(self.segment.seat(self.seat), timeout)
    }

    /// Asks for the right to look without pause, which at most `limit` waiters have at a time.
    pub(crate) fn may_spin(&self, limit: usize) -> bool {
        self.segment.may_spin(self.seat, limit)
    }

    /// Gives that right back.
    pub(crate) fn stop_spinning(&self) {
        self.segment.stop_spinning(self.seat);
    }

    /// A ringer for the threads of this process.
    pub(crate) fn seat_ringer(&self) -> SeatRinger {
        SeatRinger {
            segment: Arc::clone(&self.segment),
            seat: self.seat,
        }
    }
}

impl Drop for Bell {
    fn drop(&mut self) {
        self.segment.leave_seat(self.seat);
    }
}

/// The ringing side: rings all waiters of one part.
pub struct PartRinger {
    segment: Arc<Segment>,
    part: Part,
    reason: usize,
}

impl PartRinger {
    /// A ringer for the waiters of `part`, present and future. Its reason is the topic or request
    /// with the number `id`.
    ///
    /// # Errors
    /// The board cannot be used.
    pub fn to(board: &Board, part: Part, id: u32) -> Result<Self, BoardFault> {
        Ok(Self {
            segment: board.open()?,
            part,
            reason: reason(id),
        })
    }

    /// Rings every waiter of the part. Makes one system call for each waiter that sleeps.
    #[inline]
    pub fn ring(&self) {
        self.segment.ring(self.part, self.reason);
    }

    /// Lets every waiter of the part look when it next wakes. Makes no system call.
    #[inline]
    pub fn leave(&self) {
        self.segment.leave(self.part, self.reason);
    }
}

/// The ringing side for a process that does not know who acts: rings all waiters of a board.
pub struct AllRinger {
    segment: Arc<Segment>,
    reason: usize,
}

impl AllRinger {
    /// A ringer for all waiters. Its reason is the topic with the number `id`.
    ///
    /// # Errors
    /// The board cannot be used.
    pub fn to(board: &Board, id: u32) -> Result<Self, BoardFault> {
        Ok(Self {
            segment: board.open()?,
            reason: reason(id),
        })
    }

    /// Rings every waiter.
    pub fn ring(&self) {
        self.segment.ring_all(self.reason);
    }
}

/// A ringer of one waiter, for the threads of its own process; clones ring the same waiter. After
/// the waiter is gone, a ring may wake the next owner of its seat in vain.
#[derive(Clone)]
pub(crate) struct SeatRinger {
    segment: Arc<Segment>,
    seat: usize,
}

impl SeatRinger {
    /// Rings.
    pub(crate) fn ring(&self) {
        word::ring(self.segment.seat(self.seat), INSIDE);
    }
}

/// The ringing side for watchers of one topic.
pub struct WatchRinger {
    segment: Arc<Segment>,
    word: usize,
}

impl WatchRinger {
    /// A ringer for the watchers of the topic with the number `id`, present and future.
    ///
    /// # Errors
    /// The board cannot be used.
    pub fn to(board: &Board, id: u32) -> Result<Self, BoardFault> {
        Ok(Self {
            segment: board.open()?,
            word: watched(id),
        })
    }

    /// Lets all watchers be woken that sleep. Call it when the sample is in their queues. Makes one
    /// system call at most, whatever the number of watchers, and none if nobody sleeps. The first
    /// call that finds a sleeping watcher starts a thread, which wakes them.
    #[inline]
    pub fn ring(&self) {
        self.segment.ring_watchers(self.word);
    }
}

/// The watcher's side: the words of its topics. It stays in the thread that made it.
pub struct Watch {
    segment: Arc<Segment>,
    /// Each word, and its value when the sleep was announced.
    words: Vec<(usize, u32)>,
    waits: Vec<Wait>,
}

impl Watch {
    /// Watches nothing yet.
    ///
    /// # Errors
    /// The board cannot be used.
    pub fn on(board: &Board) -> Result<Self, BoardFault> {
        Ok(Self {
            segment: board.open()?,
            words: Vec::new(),
            waits: Vec::new(),
        })
    }

    /// Also watches the topic with the number `id`.
    pub fn add(&mut self, id: u32) {
        let word = watched(id);
        if self.words.iter().all(|(known, _)| *known != word) {
            self.words.push((word, 0));
            self.waits.reserve(self.words.len());
        }
    }

    /// Announces a sleep. Look into the queues of all topics after this, and sleep only if nothing
    /// is there.
    pub fn announce(&mut self) {
        for (word, announced) in &mut self.words {
            *announced = watch::announce(self.segment.watched(*word));
        }
    }

    /// Sleeps until a writer of one of the topics rings, at most `timeout`; true if a ring or a
    /// signal ended the sleep. Does not sleep if there was a ring since the announcement.
    pub fn sleep(&mut self, timeout: Duration) -> bool {
        let segment = &self.segment;
        let mut words = self
            .words
            .iter()
            .map(|(word, announced)| (segment.watched(*word), *announced));
        let ended = match words.len() {
            0 => {
                std::thread::sleep(timeout);
                word::Ended::TimedOut
            }
            1 => {
                let (word, announced) = words.next().expect("one");
                watch::sleep(word, announced, timeout)
            }
            _ => futex::sleep_while_all(words, &mut self.waits, timeout),
        };
        ended == word::Ended::Awake
    }
}
