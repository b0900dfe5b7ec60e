//! [`Truth`]: the simulated world as it really is, on `truth/pose`. Real robots do not publish it.

use lager_floor::Heading;
use lager_orders::Levels;

use super::SERVO_UNKNOWN;
use lager_sample::{Tag, coded, payload};

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
    /// A thing that stands in the middle of an edge.
    pub struct TruthObstacle: 4 bytes {
        /// Column of the edge's left or lower node.
        pub x: u8,
        /// Row of the edge's left or lower node.
        pub y: u8,
        /// The direction of the edge from that node: right or up.
        pub heading: Tag<Heading>,
        /// 1 = it came by chance and goes away by itself.
        pub by_chance: u8,
    }
}

payload! {
    /// The world. This is enough to resume the world in another process.
    pub struct Truth: 5464 bytes {
        /// Robot time since the start of the world in ns.
        pub time_ns: u64,
        /// Middle of the axle in mm, x to the right.
        pub x_mm: f64,
        /// Middle of the axle in mm, y up.
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
        /// The part of the battery's charge that is left, 0 to 1.
        pub battery_charge: f32 = 1.0,
        /// How often the robot has run into something since the start of the world.
        pub collisions: u32,
        /// The goods.
        #[serde(with = "lager_sample::list")]
        pub goods: [TruthGood; 256],
        /// The things that stand on edges.
        #[serde(with = "lager_sample::list")]
        pub obstacles: [TruthObstacle; 64],
        /// How many of `obstacles` are used.
        pub obstacle_count: u16,
        /// 1 = the contact of the reset button is closed.
        pub reset_closed: u8,
        /// 1 = the contact of the mode switch or mode button is closed.
        pub mode_closed: u8,
        /// A bit for each line of the Pi that a button pulls low.
        pub lines_low: u32,
        /// A bit for each line of the Pi that a button pulls high.
        pub lines_high: u32,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
    }
}

impl Truth {
    /// The goods in use.
    pub fn goods(&self) -> &[TruthGood] {
        &self.goods[..usize::from(self.good_count).min(self.goods.len())]
    }

    /// What the Pi's lines for buttons show.
    pub const fn levels(&self) -> Levels {
        Levels {
            low: self.lines_low,
            high: self.lines_high,
        }
    }

    /// The things that stand on edges.
    pub fn obstacles(&self) -> &[TruthObstacle] {
        &self.obstacles[..usize::from(self.obstacle_count).min(self.obstacles.len())]
    }
}
