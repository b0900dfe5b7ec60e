//! The orders that wait (F3), in the order in which they were given, unless a person moves one up
//! or cancels one.
//!
//! It only keeps the orders. The mission decides which one is next and which station it can reach.
//! An order that was under way and has to wait goes back to the first place; one place is always
//! free for it.

use lager_topics::{Order, OrderQueue, WaitingOrder};

/// Places in the queue.
const PLACES: usize = 32;

/// How many orders can wait when another one comes.
pub const MOST_ORDERS: usize = PLACES - 1;

/// An order that waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waiting {
    /// What was ordered.
    pub order: Order,
    /// Its turn came, but there was no way to its goods.
    pub put_off: bool,
}

/// All orders that wait, the next one first.
#[derive(Clone, Debug, Default)]
pub struct Queue {
    list: heapless::Vec<Waiting, PLACES>,
    /// Counts changes of what waits and in which order.
    revision: u32,
}

impl Queue {
    /// The orders, the next one first.
    pub fn waiting(&self) -> &[Waiting] {
        &self.list
    }

    /// How often the orders or their places have changed.
    pub fn revision(&self) -> u32 {
        self.revision
    }

    /// Whether an order with this number waits. No order has the number 0.
    pub fn has(&self, id: u32) -> bool {
        self.place(id).is_some()
    }

    /// Adds an order at the last place. Returns whether there was a place.
    pub fn push(&mut self, order: Order) -> bool {
        if self.list.len() >= MOST_ORDERS {
            return false;
        }
        self.insert(self.list.len(), order, false);
        true
    }

    /// Puts an order that cannot be carried out now back to the first place.
    pub fn put_back(&mut self, order: Order) {
        self.insert(0, order, true);
    }

    fn insert(&mut self, index: usize, order: Order, put_off: bool) {
        // One place is kept free for the present order.
        let _ = self.list.insert(index, Waiting { order, put_off });
        self.changed();
    }

    /// Takes the order at a place out.
    pub fn take(&mut self, index: usize) -> Option<Order> {
        let order = self.list.get(index)?.order;
        self.list.remove(index);
        self.changed();
        Some(order)
    }

    /// Takes the order with this number out.
    pub fn cancel(&mut self, id: u32) -> Option<Order> {
        self.take(self.place(id)?)
    }

    /// Moves the order with this number before the previous one. Returns whether it did.
    pub fn move_up(&mut self, id: u32) -> bool {
        let Some(index) = self.place(id).filter(|index| *index > 0) else {
            return false;
        };
        self.list.swap(index, index - 1);
        self.changed();
        true
    }

    /// Takes all orders out. Returns whether there were any.
    pub fn clear(&mut self) -> bool {
        let had_some = !self.list.is_empty();
        self.list.clear();
        self.changed();
        had_some
    }

    /// Marks the first `count` orders as waiting for a way. Returns whether one of them was not
    /// marked before.
    pub fn put_off(&mut self, count: usize) -> bool {
        let mut is_new = false;
        for waiting in self.list.iter_mut().take(count) {
            is_new |= !core::mem::replace(&mut waiting.put_off, true);
        }
        is_new
    }

    /// The published form, with the present order.
    pub fn to_payload(&self, under_way: Option<Order>) -> OrderQueue {
        let mut queue = OrderQueue {
            under_way: under_way.is_some().into(),
            order_id: under_way.unwrap_or_default().id,
            product: under_way.unwrap_or_default().product,
            count: self.list.len() as u8,
            ..OrderQueue::default()
        };
        for (place, waiting) in queue.orders.iter_mut().zip(&self.list) {
            *place = WaitingOrder {
                id: waiting.order.id,
                product: waiting.order.product,
                put_off: waiting.put_off.into(),
                ..WaitingOrder::default()
            };
        }
        queue
    }

    /// Takes the orders that an earlier navigator published. It may have been killed before it
    /// published a change: `known` is the order that its status names. Any other order that was
    /// under way then waits again.
    pub fn from_payload(queue: &OrderQueue, known: Order) -> Self {
        let under_way = (queue.under_way != 0).then_some(Waiting {
            order: Order {
                id: queue.order_id,
                product: queue.product,
            },
            put_off: false,
        });
        let waiting = queue.orders().iter().map(|waiting| Waiting {
            order: Order {
                id: waiting.id,
                product: waiting.product,
            },
            put_off: waiting.put_off != 0,
        });
        let others = under_way.into_iter().chain(waiting);
        Self {
            list: others
                .filter(|waiting| waiting.order != known)
                .take(PLACES)
                .collect(),
            revision: 0,
        }
    }

    /// The product of the order with this number.
    pub fn product_of(&self, id: u32) -> Option<i32> {
        Some(self.list[self.place(id)?].order.product)
    }

    fn place(&self, id: u32) -> Option<usize> {
        let is_it = |waiting: &Waiting| id != 0 && waiting.order.id == id;
        self.list.iter().position(is_it)
    }

    fn changed(&mut self) {
        self.revision = self.revision.wrapping_add(1);
    }
}
