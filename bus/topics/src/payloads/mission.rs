//! What the robot is to fetch and how it goes: `mission/order`, `mission/event`, `operator/input`.

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
    }
}

payload! {
    /// Something that happened on a mission.
    pub struct Event: 12 bytes {
        /// What.
        pub kind: Tag<EventKind>,
        /// Column of the node last passed.
        pub x: u8,
        /// Row of the node last passed.
        pub y: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// The order it belongs to.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
    }
}

coded! {
    /// What a person at the robot or at the station did.
    pub enum InputKind {
        /// The goods are in the gripper (L7).
        PickupDone = 0,
        /// The switch button was pressed (E14).
        SwitchPressed = 1,
        /// The reset button was pressed (B1).
        ResetPressed = 2,
    }
}

payload! {
    /// Input of a person.
    pub struct Input: 8 bytes {
        /// What was done.
        pub kind: Tag<InputKind>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
        /// The order it concerns, 0 = none.
        pub order_id: u32,
    }
}
