//! What the robot is to fetch and how it goes: `mission/order`, `mission/queue`, `mission/event`,
//! `operator/input`.

use core::fmt;

use super::failure::Failure;
use super::nav::Heading;
use crate::schema::payload;
use crate::tag::{Tag, coded};

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
        /// Its number.
        pub id: u32,
        /// The product's number on the map.
        pub product: i32,
        /// 1 = its turn had come and there was no way: it is tried again when one may be open.
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
        /// A person has said so, or an earlier run of the robot has seen it.
        Told = 3,
    }
}

payload! {
    /// Goods that are not in their place on the map.
    pub struct GoneGoods: 12 bytes {
        /// The product's number on the map.
        pub product: i32,
        /// Since when, in seconds of robot time.
        pub since_s: u32,
        /// Why.
        pub why: Tag<GoneWhy>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}

payload! {
    /// All orders that are not carried out yet (F3), and the goods that none can be for: what
    /// observers want to see and a restarted navigator needs.
    pub struct OrderQueue: 1548 bytes {
        /// The order under way, if `under_way` is 1.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// 1 = there is one.
        pub under_way: u8,
        /// How many of `orders` are used.
        pub count: u8,
        /// How many of `gone` are used.
        pub gone_count: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// The orders that wait, the next one first.
        #[serde(with = "crate::list")]
        pub orders: [WaitingOrder; 32],
        /// The goods that are not in their place, those first of which it has been known longest.
        #[serde(with = "crate::list")]
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

    /// Whether the order `id` is under way.
    pub fn is_under_way(&self, id: u32) -> bool {
        self.under_way != 0 && self.order_id == id
    }

    /// Whether the order `id` is under way or waits.
    pub fn has(&self, id: u32) -> bool {
        self.is_under_way(id) || self.before(id).is_ok()
    }

    /// How many orders are carried out before the order `id`, which waits.
    ///
    /// # Errors
    /// It does not wait.
    pub fn before(&self, id: u32) -> Result<usize, NotWaiting> {
        let place = self.orders().iter().position(|order| order.id == id);
        place.ok_or(match self.is_under_way(id) {
            true => NotWaiting::UnderWay(id),
            false => NotWaiting::Unknown(id),
        })
    }
}

/// Why an order does not wait for its turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotWaiting {
    /// It is being carried out.
    UnderWay(u32),
    /// There is none with this number.
    Unknown(u32),
}

impl fmt::Display for NotWaiting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnderWay(id) => write!(formatter, "order {id} is under way and waits no more"),
            Self::Unknown(id) => write!(
                formatter,
                "no order {id} waits; `lager queue` shows those that do"
            ),
        }
    }
}

impl core::error::Error for NotWaiting {}

coded! {
    /// What happened on a mission (C8).
    pub enum EventKind {
        /// The robot stands at the goods.
        InPosition = 0,
        /// The robot is on its way to the goods.
        GettingItem = 1,
        /// The goods lie at the place of delivery.
        ItemDelivered = 2,
        /// The robot passed a node.
        NextNode = 3,
        /// The order cannot be carried out.
        Refused = 4,
        /// The goods are not felt in the claw, so the robot does not leave the pick station.
        PickupRefused = 5,
        /// The robot cannot go on with what it was doing; `failure` says why and what would end it.
        Failed = 6,
        /// The robot has found the way from the node along `heading` blocked (L6).
        WayBlocked = 7,
    }
}

payload! {
    /// Something that happened on a mission.
    pub struct Event: 24 bytes {
        /// What.
        pub kind: Tag<EventKind>,
        /// Column of the node last passed.
        pub x: u8,
        /// Row of the node last passed.
        pub y: u8,
        /// Where the robot looks.
        pub heading: Tag<Heading>,
        /// The order it belongs to.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// Why, if it was refused or has failed.
        pub failure: Failure,
    }
}

coded! {
    /// What a person at the robot or at the station did.
    pub enum InputKind {
        /// The goods are in the gripper (L7).
        PickupDone = 0,
        /// The switch button was pressed (E14).
        SwitchPressed = 1,
        /// The reset button was pressed (B1): the robot has been put on the delivery node, looking
        /// into the warehouse.
        ResetPressed = 2,
        /// The robot has been put on node (`x`, `y`), looking along `heading`.
        Placed = 3,
        /// The goods are in the gripper, whether or not it feels them.
        PickupForced = 4,
        /// The order `order_id`, which waits or whose goods are not held yet, is not to be carried
        /// out.
        OrderCancelled = 5,
        /// The waiting order `order_id` is to change places with the one before it.
        OrderMovedUp = 6,
        /// No waiting order is to be carried out.
        QueueCleared = 7,
        /// The external computer is out of reach, and the robot is to stand at the next node.
        LinkLost = 8,
        /// It is there again.
        LinkBack = 9,
        /// The switch of the robot has been moved to manual mode.
        SwitchedToManual = 10,
        /// The switch of the robot has been moved to autonomous mode.
        SwitchedToAutonomous = 11,
        /// A person picks the goods up from now on ([`Pick::Manual`](super::Pick)).
        PickByHand = 12,
        /// The robot picks the goods up by itself from now on ([`Pick::Auto`](super::Pick)).
        PickByItself = 13,
        /// The goods of a product are not in their place; `order_id` is the product's number.
        GoodsGone = 14,
        /// They are there again; [`Input::ALL_GOODS`] = all of them.
        GoodsBack = 15,
    }
}

payload! {
    /// Input of a person.
    pub struct Input: 12 bytes {
        /// What was done.
        pub kind: Tag<InputKind>,
        /// Column of the node the robot was put on.
        pub x: u8,
        /// Row of the node the robot was put on.
        pub y: u8,
        /// Where the robot looks that was put down.
        pub heading: Tag<Heading>,
        /// The order it concerns, 0 = none; of goods the product's number.
        pub order_id: u32,
        /// Distinguishes this press from another one; a repeated sample has the same. A switch
        /// without one (0) is not taken.
        pub id: u32,
    }
}

impl Input {
    /// The `order_id` of [`InputKind::GoodsBack`] that means all goods. No product has it, since
    /// their numbers are not negative.
    pub const ALL_GOODS: u32 = u32::MAX;
}
