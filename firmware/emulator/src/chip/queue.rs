//! A chip's future events: those from outside and those of this crate's peripherals.
//!
//! They are not simavr's timers, because simavr forgets its timers at a reset, and a byte on a
//! cable arrives in spite of the reset.

use core::cell::{Cell, RefCell};
use core::cmp::Reverse;
use std::collections::BinaryHeap;

use super::usarts::UsartId;

/// One event. An event of a peripheral is void if that was reset since; then `life` differs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Event {
    /// A frame has left.
    Sent { usart: UsartId, life: u32 },
    /// A frame begins on RXD, sent with this many cycles a bit.
    StartBit { usart: UsartId, byte: u8, bit: f64 },
    /// The frame on RXD is complete.
    Received { usart: UsartId, life: u32 },
    /// The watchdog's second time-out, if nobody served the first.
    WatchdogAgain { life: u32 },
    /// The EEPROM has written its byte.
    EepromDone { life: u32 },
    /// A command to SPM is no longer obeyed.
    SpmExpired { life: u32 },
    /// A page of the flash is erased or written.
    FlashDone { life: u32 },
    /// An alarm that somebody outside has set.
    Alarm { tag: u32 },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    at: u64,
    order: u64,
    event: Event,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        (self.at, self.order).cmp(&(other.at, other.order))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Events in the order of their cycles; events of one cycle in the order in which they were made.
#[derive(Debug)]
pub(super) struct Queue {
    entries: RefCell<BinaryHeap<Reverse<Entry>>>,
    next: Cell<u64>,
    made: Cell<u64>,
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            entries: RefCell::default(),
            next: Cell::new(u64::MAX),
            made: Cell::new(0),
        }
    }
}

impl Queue {
    pub(super) fn push(&self, at: u64, event: Event) {
        let order = self.made.get();
        self.made.set(order + 1);
        self.entries
            .borrow_mut()
            .push(Reverse(Entry { at, order, event }));
        self.next.set(self.next.get().min(at));
    }

    /// The cycle of the next event.
    pub(super) fn next(&self) -> u64 {
        self.next.get()
    }

    /// The next event, if it is due.
    pub(super) fn pop(&self, now: u64) -> Option<Event> {
        if self.next.get() > now {
            return None;
        }
        let mut entries = self.entries.borrow_mut();
        let entry = entries.pop()?.0;
        let next = entries.peek().map_or(u64::MAX, |entry| entry.0.at);
        self.next.set(next);
        Some(entry.event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_in_the_order_of_their_cycles_and_then_of_their_making() {
        let queue = Queue::default();
        for (at, tag) in [(5, 1), (3, 2), (5, 3), (3, 4)] {
            queue.push(at, Event::Alarm { tag });
        }
        assert_eq!(queue.next(), 3);
        assert_eq!(queue.pop(2), None);
        let mut tags = Vec::new();
        while let Some(Event::Alarm { tag }) = queue.pop(5) {
            tags.push(tag);
        }
        assert_eq!(tags, [2, 4, 1, 3]);
        assert_eq!(queue.next(), u64::MAX);
    }
}
