//! The simulated world as it really is: `truth/pose`. Only a simulator publishes it.

use super::SERVO_UNKNOWN;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// Where a piece of goods is.
    pub enum GoodState {
        /// On its shelf.
        Shelf = 0,
        /// In the gripper.
        Held = 1,
        /// On the floor.
        Lying = 2,
        /// At the place of delivery.
        Delivered = 3,
    }
}

payload! {
    /// One piece of goods.
    pub struct TruthGood: 20 bytes {
        /// The product's number.
        pub id: i32,
        /// Position in mm, x to the right of node (0, 0).
        pub x_mm: f32,
        /// Position in mm, y up from node (0, 0).
        pub y_mm: f32,
        /// Height over the floor in mm.
        pub z_mm: f32,
        /// Where it is.
        pub state: Tag<GoodState>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 3],
    }
}

payload! {
    /// The world: enough to resume it in another process.
    pub struct Truth: 1344 bytes {
        /// Robot time since the start of the world in ns.
        pub time_ns: u64,
        /// Middle of the axle in mm.
        pub x_mm: f64,
        /// Middle of the axle in mm.
        pub y_mm: f64,
        /// Heading in rad, counter-clockwise from +x.
        pub heading_rad: f64,
        /// Speed of the left wheel in mm/s.
        pub left_mm_per_s: f32,
        /// Speed of the right wheel in mm/s.
        pub right_mm_per_s: f32,
        /// Product in the gripper, -1 = none.
        pub carrying: i32 = -1,
        /// How many of `goods` are used.
        pub good_count: u16,
        /// Duty at the left motor driver, 0..=255.
        pub left_duty: u8,
        /// Duty at the right motor driver, 0..=255.
        pub right_duty: u8,
        /// Position 0..=1023 of servo n at index n - 1.
        pub servo_position: [u16; 8] = [SERVO_UNKNOWN; 8],
        /// The goods.
        #[serde(with = "crate::list")]
        pub goods: [TruthGood; 64],
    }
}

impl Truth {
    /// The goods in use.
    pub fn goods(&self) -> &[TruthGood] {
        &self.goods[..usize::from(self.good_count).min(self.goods.len())]
    }
}
