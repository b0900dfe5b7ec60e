//! What the robot must fetch and how far it is: `mission/order`, `mission/queue`, `mission/event`.

use core::fmt;

use lager_floor::{Heading, ProductId};
use lager_orders::{Code, EventKind, Reason};

use super::failure::Failure;
use lager_sample::{Tag, coded, payload};

payload! {
    /// Fetch one product (G6).
    pub struct Order: 8 bytes {
        /// Distinguishes this order from earlier ones for the same product.
        pub id: u32,
        /// The product's number on the map.
        pub product: i32,
    }
}

payload! {
    /// An order that waits for its turn.
    pub struct WaitingOrder: 12 bytes {
        /// The order's number.
        pub id: u32,
        /// The product's number on the map.
        pub product: i32,
        /// 1 = there was no way to it; it is tried again when a way may be open.
        pub put_off: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}

coded! {
    /// Why goods are not in their place.
    pub enum GoneWhy {
        /// They were delivered.
        Delivered = 0,
        /// They were picked up, and not delivered.
        PickedUp = 1,
        /// They were not found there.
        NotFound = 2,
        /// A person has said so.
        Told = 3,
        /// They were not there in an earlier run of the robot.
        EarlierRun = 4,
    }
}

payload! {
    /// Goods that are not in their place on the map.
    pub struct GoneGoods: 12 bytes {
        /// The product's number on the map.
        pub product: i32,
        /// Since when, in seconds of robot time.
        pub since_s: u32,
        /// Why they are not in their place.
        pub why: Tag<GoneWhy>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}

payload! {
    /// All orders that are not carried out yet (F3), and the goods that no order can be for.
    /// Observers show it, and a restarted navigator needs it.
    pub struct OrderQueue: 1548 bytes {
        /// The order under way, if `under_way` is 1.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// 1 = an order is under way.
        pub under_way: u8,
        /// How many of `orders` are used.
        pub count: u8,
        /// How many of `gone` are used.
        pub gone_count: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// The orders that wait, the next one first.
        #[serde(with = "lager_sample::list")]
        pub orders: [WaitingOrder; 32],
        /// The goods that are not in their place, those first that have been away longest.
        #[serde(with = "lager_sample::list")]
        pub gone: [GoneGoods; 96],
    }
}

impl OrderQueue {
    /// The orders that wait.
    pub fn orders(&self) -> &[WaitingOrder] {
        &self.orders[..usize::from(self.count).min(self.orders.len())]
    }

    /// The goods that are not in their place.
    pub fn gone(&self) -> &[GoneGoods] {
        &self.gone[..usize::from(self.gone_count).min(self.gone.len())]
    }

    /// Whether the goods of `product`, or any goods, are not in their place.
    pub fn is_gone(&self, product: Option<ProductId>) -> bool {
        let mut gone = self.gone().iter();
        gone.any(|gone| product.is_none_or(|product| product.get() == gone.product))
    }

    /// Whether the order `id` is under way.
    pub fn is_under_way(&self, id: u32) -> bool {
        self.under_way != 0 && self.order_id == id
    }

    /// Whether the order `id` is under way or waits.
    pub fn has(&self, id: u32) -> bool {
        self.is_under_way(id) || self.before(id).is_ok()
    }

    /// How many orders the robot carries out before the waiting order `id`.
    ///
    /// # Errors
    /// The order does not wait.
    pub fn before(&self, id: u32) -> Result<usize, NotWaiting> {
        let place = self.orders().iter().position(|order| order.id == id);
        place.ok_or(match self.is_under_way(id) {
            true => NotWaiting::UnderWay(id),
            false => NotWaiting::Unknown(id),
        })
    }
}

/// Why an order is not waiting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotWaiting {
    /// The robot is carrying the order out.
    UnderWay(u32),
    /// There is no order with this number.
    Unknown(u32),
}

impl From<NotWaiting> for Reason {
    fn from(why: NotWaiting) -> Self {
        match why {
            NotWaiting::UnderWay(id) => Self::new(Code::OrderUnderWay, &[&id]),
            NotWaiting::Unknown(id) => Self::new(Code::OrderUnknown, &[&id]),
        }
    }
}

impl fmt::Display for NotWaiting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

impl core::error::Error for NotWaiting {}

payload! {
    /// Something that happened on a mission.
    pub struct Event: 24 bytes {
        /// What happened.
        pub kind: Tag<EventKind>,
        /// Column of the node last passed.
        pub x: u8,
        /// Row of the node last passed.
        pub y: u8,
        /// Where the robot looks.
        pub heading: Tag<Heading>,
        /// The order to which it belongs.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// Why, if the order was refused or something failed.
        pub failure: Failure,
    }
}
