//! [`Board`]: the contents of the bell board in shared memory, and the operations on them.
//!
//! ```text
//!     0    head      magic and layout version
//!     64   callers   for each part: which seats to ring            read by every ring
//!     320  spinners  which seats look without pause                written now and then
//!     384  seat 0    the word, its reasons, its process id         written by every ring
//!     512  seat 1    …                                             64 seats of 128 bytes
//!     8576 watched   the words on which watchers sleep             read at every sample
//! ```
//!
//! A seat has 128 bytes because processors fetch cache lines in pairs: ringing a neighbour must not
//! disturb a waiter that looks without pause. Watchers have no seats: any number of them sleep on the
//! word of their topic. If two topics share a word, a sample of one wakes the watchers of both.
//!
//! **Invariant:** nothing here makes a system call. The locks of `segment.rs` decide who may write:
//! only the holder of a seat's lock writes its callers, its spinner bit and its process id.

use core::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering};

use lager_sample::Part;

use super::word;

/// The most waiters on one board at the same time.
pub(crate) const SEATS: usize = 64;

/// The most waiters of one part at a time, so that one part cannot take the seats of all others.
pub const SEATS_PER_PART: usize = 32;

/// The number of words for watchers.
pub(crate) const WATCHED: usize = 1024;

/// "lagerbel" and the layout's version. Change the version whenever [`Board`] or the word changes.
const MAGIC: u64 = u64::from_be_bytes(*b"lagerbel") ^ VERSION;
const VERSION: u64 = 3;

#[repr(C, align(64))]
struct Line<T>(T);

/// The place of one waiter.
#[repr(C, align(128))]
pub(crate) struct Seat {
    pub(super) word: AtomicU32,
    pid: AtomicU32,
    pub(super) reasons: [AtomicU8; REASONS],
}

impl Default for Seat {
    fn default() -> Self {
        Self {
            word: AtomicU32::new(0),
            pid: AtomicU32::new(0),
            reasons: [const { AtomicU8::new(0) }; REASONS],
        }
    }
}

/// The word on which the watchers of a topic sleep.
#[repr(transparent)]
pub(crate) struct WatchWord(pub(super) AtomicU32);

/// The number of reasons of a seat: as many as fit into the word's cache line.
pub(crate) const REASONS: usize = 56;

/// The board. Every bit pattern of the right size is a valid one.
#[repr(C)]
pub(crate) struct Board {
    magic: Line<AtomicU64>,
    callers: Line<[AtomicU64; Part::MOST]>,
    spinners: Line<AtomicU64>,
    seats: [Seat; SEATS],
    watched: [WatchWord; WATCHED],
}

const _: () = assert!(size_of::<Board>() == 384 + 128 * SEATS + 4 * WATCHED);
const _: () = assert!(core::mem::offset_of!(Seat, reasons) + REASONS == 64);
const _: () = assert!(SEATS <= 64);

/// The layout of a board that another process has made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// The board was never finished: all bytes are zero.
    Blank,
    Ours,
    Other,
}

impl Board {
    pub(crate) fn layout(&self) -> Layout {
        match self.magic.0.load(Ordering::Acquire) {
            0 => Layout::Blank,
            MAGIC => Layout::Ours,
            _ => Layout::Other,
        }
    }

    /// Marks the board as complete.
    pub(crate) fn sign(&self) {
        self.magic.0.store(MAGIC, Ordering::Release);
    }

    /// One of the seats.
    #[inline]
    pub(crate) fn seat(&self, seat: usize) -> &Seat {
        &self.seats[seat % SEATS]
    }

    /// One of the words for watchers.
    #[inline]
    pub(crate) fn watched(&self, word: usize) -> &WatchWord {
        &self.watched[word % WATCHED]
    }

    /// Rings every waiter of `part`.
    #[inline]
    pub(crate) fn ring(&self, part: Part, reason: usize) {
        self.each_of(part, |seat| word::ring(seat, reason));
    }

    /// Leaves every waiter of `part` a reason, without a ring.
    #[inline]
    pub(crate) fn leave(&self, part: Part, reason: usize) {
        self.each_of(part, |seat| word::leave(seat, reason));
    }

    /// Rings every waiter.
    pub(crate) fn ring_all(&self, reason: usize) {
        self.each_in(self.taken(), |seat| word::ring(seat, reason));
    }

    #[inline]
    fn each_of(&self, part: Part, does: impl Fn(&Seat)) {
        // Relaxed: `take` deals with a waiter that is taking its seat at this moment.
        self.each_in(self.callers_of(part).load(Ordering::Relaxed), does);
    }

    #[inline]
    fn each_in(&self, mut seats: u64, does: impl Fn(&Seat)) {
        while seats != 0 {
            does(self.seat(seats.trailing_zeros() as usize));
            seats &= seats - 1;
        }
    }

    /// The seats of `part` as bits, including those of killed processes.
    pub(crate) fn seats_of(&self, part: Part) -> u64 {
        self.callers_of(part).load(Ordering::Acquire)
    }

    /// All taken seats as bits, including those of killed processes.
    pub(crate) fn taken(&self) -> u64 {
        let masks = self.callers.0.iter();
        masks.fold(0, |all, seats| all | seats.load(Ordering::Acquire))
            | self.spinners.0.load(Ordering::Acquire)
    }

    /// The process that has, or last had, a seat.
    pub(crate) fn pid(&self, seat: usize) -> u32 {
        self.seats[seat].pid.load(Ordering::Acquire)
    }

    /// Registers a waiter. From now on ringers ring it, and it owns the seat's word.
    pub(crate) fn take(&self, seat: usize, part: Part, pid: u32) {
        self.seats[seat].pid.store(pid, Ordering::Release);
        self.callers_of(part).fetch_or(1 << seat, Ordering::SeqCst);
    }

    /// Removes the waiter of a seat.
    pub(crate) fn clear(&self, seat: usize) {
        for seats in &self.callers.0 {
            // Most of these bits are 0, and a write would take the cache line from every ringer.
            if seats.load(Ordering::Acquire) & (1 << seat) != 0 {
                seats.fetch_and(!(1 << seat), Ordering::AcqRel);
            }
        }
        self.stop_spinning(seat);
        self.seats[seat].pid.store(0, Ordering::Release);
    }

    /// Asks for the right to look without pause, which at most `limit` waiters have at a time. A
    /// waiter that gets the right keeps it until [`Board::stop_spinning`].
    pub(crate) fn may_spin(&self, seat: usize, limit: usize) -> bool {
        let granted = |spinners: u64| {
            let with_me = spinners | 1 << seat;
            (with_me.count_ones() as usize <= limit).then_some(with_me)
        };
        let spinners = &self.spinners.0;
        spinners
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, granted)
            .is_ok()
    }

    pub(crate) fn stop_spinning(&self, seat: usize) {
        if self.spinners.0.load(Ordering::Acquire) & (1 << seat) != 0 {
            self.spinners.0.fetch_and(!(1 << seat), Ordering::AcqRel);
        }
    }

    fn callers_of(&self, part: Part) -> &AtomicU64 {
        &self.callers.0[usize::from(part.number()) % Part::MOST]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOGIC: Part = Part::new(1, "logic");
    const BRIDGE: Part = Part::new(0, "bridge");

    fn blank() -> Box<Board> {
        Box::new(Board {
            magic: Line(AtomicU64::new(0)),
            callers: Line([const { AtomicU64::new(0) }; Part::MOST]),
            spinners: Line(AtomicU64::new(0)),
            seats: core::array::from_fn(|_| Seat::default()),
            watched: [const { WatchWord(AtomicU32::new(0)) }; WATCHED],
        })
    }

    #[test]
    fn a_ring_reaches_the_seats_of_its_role_only() {
        let board = blank();
        board.take(3, LOGIC, 30);
        board.take(63, LOGIC, 630);
        board.take(4, BRIDGE, 40);
        board.ring(LOGIC, 5);
        let count = |seat| board.seat(seat).word.load(Ordering::Relaxed);
        let rung: Vec<_> = (0..SEATS).filter(|seat| count(*seat) != 0).collect();
        assert_eq!(rung, [3, 63]);
        board.clear(3);
        board.ring(LOGIC, 6);
        assert_eq!([count(3), count(63)], [2, 4]);
        let rung_for = |seat, reason| word::rung_for(board.seat(seat), reason);
        assert_eq!(
            [5, 6, 7].map(|reason| rung_for(3, reason)),
            [true, false, false]
        );
        assert_eq!(
            [5, 6, 7].map(|reason| rung_for(63, reason)),
            [true, true, false]
        );
        assert!(!rung_for(63, 5), "a reason is taken once");
    }

    #[test]
    fn no_more_spin_than_may() {
        let board = blank();
        assert!(!board.may_spin(0, 0));
        assert!(board.may_spin(0, 2) && board.may_spin(5, 2));
        assert!(!board.may_spin(6, 2));
        assert!(board.may_spin(5, 2), "who may already, may");
        board.clear(0);
        assert!(board.may_spin(6, 2));
    }

    #[test]
    fn a_board_is_blank_until_it_is_signed() {
        let board = blank();
        assert_eq!(board.layout(), Layout::Blank);
        board.sign();
        assert_eq!(board.layout(), Layout::Ours);
        board.magic.0.store(MAGIC ^ VERSION ^ 1, Ordering::Relaxed);
        assert_eq!(board.layout(), Layout::Other);
    }
}
