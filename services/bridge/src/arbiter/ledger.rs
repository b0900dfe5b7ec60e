//! Remembers ended orders, so that each order is executed exactly once.
//!
//! Origin and id name an order. Origins renew an order until they hear how it ended, and they can
//! miss a report. So the arbiter must recognise a renewal of an ended order, answer with the same
//! end, and never carry it out again. The ledger is a ring of fixed size: it never allocates, and
//! forgets the oldest first.

use lager_topics::{Finish, Origin};

/// Origin and id of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderKey {
    /// On whose behalf the order was given.
    pub origin: Origin,
    /// The origin's number for it.
    pub id: u32,
}

/// An order that is over and how it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Which order.
    pub key: OrderKey,
    /// How it ended. [`Finish::None`] for a setpoint that a newer order replaced; nobody is told of
    /// that end.
    pub finish: Finish,
}

/// How many orders it remembers: more than all eight publishers together can have on their way at
/// one time.
const CAPACITY: usize = 16;

/// The orders that ended last.
#[derive(Clone, Debug, Default)]
pub(super) struct Ledger {
    entries: [Option<Ended>; CAPACITY],
    next: usize,
}

impl Ledger {
    /// Adds an ended order, over an earlier entry of the same order or over the oldest entry.
    pub(super) fn enter(&mut self, ended: Ended) {
        let known = self
            .entries
            .iter_mut()
            .flatten()
            .find(|entry| entry.key == ended.key);
        if let Some(entry) = known {
            *entry = ended;
            return;
        }
        self.entries[self.next] = Some(ended);
        self.next = (self.next + 1) % CAPACITY;
    }

    /// The entry of an order, if it is over.
    pub(super) fn find(&self, key: OrderKey) -> Option<Ended> {
        self.entries
            .iter()
            .flatten()
            .find(|entry| entry.key == key)
            .copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(id: u32, finish: Finish) -> Ended {
        let key = OrderKey {
            origin: Origin::Logic,
            id,
        };
        Ended { key, finish }
    }

    #[test]
    fn an_order_is_found_until_sixteen_others_have_ended() {
        let mut ledger = Ledger::default();
        for id in 0..16 {
            ledger.enter(ended(id, Finish::Done));
        }
        assert_eq!(
            ledger.find(ended(0, Finish::None).key),
            Some(ended(0, Finish::Done))
        );
        ledger.enter(ended(16, Finish::Done));
        assert_eq!(ledger.find(ended(0, Finish::None).key), None);
        assert!(ledger.find(ended(1, Finish::None).key).is_some());
    }

    #[test]
    fn the_same_id_of_another_origin_is_another_order() {
        let mut ledger = Ledger::default();
        ledger.enter(ended(7, Finish::Done));
        let other = OrderKey {
            origin: Origin::Operator,
            id: 7,
        };
        assert_eq!(ledger.find(other), None);
    }

    #[test]
    fn a_second_end_replaces_the_first() {
        let mut ledger = Ledger::default();
        ledger.enter(ended(7, Finish::None));
        ledger.enter(ended(7, Finish::Aborted));
        let found = ledger.find(ended(7, Finish::None).key);
        assert_eq!(found, Some(ended(7, Finish::Aborted)));
    }
}
