//! The goods that are not in their place. For an order of such goods the robot would drive to an
//! empty shelf.
//!
//! ```text
//!   in its place ── picked up ──> PickedUp ── delivered ──> Delivered
//!     ^      └── the claw closes on nothing ──> NotFound        │
//!     └──── a person says so, or describes another place <──────┘
//! ```
//!
//! This file only remembers them. The mission notices when goods leave their place, and refuses an
//! order for them.

use core::time::Duration;

use lager_topics::{FailureKind, GoneGoods, GoneWhy, OrderQueue};

use crate::map::Map;

/// How many goods are remembered. When more are gone, those that are gone for the longest time are
/// forgotten; the robot finds out again when it tries to fetch them.
const MOST: usize = 96;

/// The goods that are not in their place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gone {
    list: heapless::Vec<GoneGoods, MOST>,
}

impl Gone {
    /// These goods are gone from now on, for this reason.
    pub(crate) fn add(&mut self, product: i32, why: GoneWhy, now: Duration) {
        self.remove(product);
        if self.list.is_full() {
            self.list.remove(0);
        }
        // There is room now.
        let _ = self.list.push(GoneGoods {
            product,
            since_s: seconds(now),
            why: why.into(),
            ..GoneGoods::default()
        });
    }

    /// They are in their place again. Returns whether they were gone.
    pub(crate) fn remove(&mut self, product: i32) -> bool {
        let before = self.list.len();
        self.list.retain(|gone| gone.product != product);
        self.list.len() < before
    }

    /// All are in their places again. Returns whether any were gone.
    pub(crate) fn clear(&mut self) -> bool {
        let had_some = !self.list.is_empty();
        self.list.clear();
        had_some
    }

    /// A person has described the floor again. Goods that have another place now, or are not on the
    /// floor any more, are where the person says. Returns whether that changes anything.
    pub(crate) fn follow(&mut self, before: &Map, now: &Map) -> bool {
        let known = self.list.len();
        self.list
            .retain(|gone| before.station(gone.product) == now.station(gone.product));
        self.list.len() < known
    }

    /// Why an order for `product` would be in vain, with the reason's values.
    pub(crate) fn why(&self, product: i32, now: Duration) -> Option<(FailureKind, i32)> {
        let gone = self.list.iter().find(|gone| gone.product == product)?;
        let ago = seconds(now).saturating_sub(gone.since_s);
        let kind = match gone.why.get() {
            Some(GoneWhy::Delivered) => FailureKind::GoodsDelivered,
            _ => FailureKind::GoodsAway,
        };
        Some((kind, i32::try_from(ago).unwrap_or(i32::MAX)))
    }

    /// Writes them into a published state.
    pub(crate) fn fill(&self, queue: &mut OrderQueue) {
        queue.gone_count = self.list.len() as u8;
        queue.gone[..self.list.len()].copy_from_slice(&self.list);
    }

    /// The goods that an earlier navigator published.
    pub(crate) fn from_payload(queue: &OrderQueue) -> Self {
        Self {
            list: queue.gone().iter().copied().take(MOST).collect(),
        }
    }
}

fn seconds(now: Duration) -> u32 {
    u32::try_from(now.as_secs()).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Duration = Duration::from_secs(100);

    #[test]
    fn goods_are_gone_until_they_are_back() {
        let mut gone = Gone::default();
        assert_eq!(gone.why(3, NOW), None);
        gone.add(3, GoneWhy::PickedUp, Duration::from_secs(40));
        assert_eq!(gone.why(3, NOW), Some((FailureKind::GoodsAway, 60)));
        gone.add(3, GoneWhy::Delivered, Duration::from_secs(65));
        assert_eq!(gone.why(3, NOW), Some((FailureKind::GoodsDelivered, 35)));
        assert!(gone.remove(3) && !gone.remove(3));
        assert_eq!(gone.why(3, NOW), None);
    }

    #[test]
    fn a_successor_knows_the_same_ones_and_more_than_fit_forget_the_first() {
        let mut gone = Gone::default();
        for product in 0..=MOST as i32 {
            gone.add(product, GoneWhy::NotFound, NOW);
        }
        let mut queue = OrderQueue::default();
        gone.fill(&mut queue);
        let mut successor = Gone::from_payload(&queue);
        assert_eq!(successor.why(0, NOW), None);
        assert!(successor.why(1, NOW).is_some());
        assert!(successor.why(MOST as i32, NOW).is_some());
        assert!(successor.clear());
    }
}
