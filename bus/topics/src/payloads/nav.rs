//! Where the robot is, where it goes and in what world: `nav/status`, `nav/map`, `nav/route`.

use super::link::Mode;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// A direction in the warehouse, clockwise from the left as in the goods string (M3).
    pub enum Heading {
        /// Towards smaller x.
        Left = 0,
        /// Towards greater y.
        Up = 1,
        /// Towards greater x.
        Right = 2,
        /// Towards smaller y.
        Down = 3,
    }
}

coded! {
    /// The side of a square a product stands at (M3).
    pub enum Side {
        /// The edge from (x, y) to (x, y + 1).
        Left = 0,
        /// The edge from (x, y + 1) to (x + 1, y + 1).
        Up = 1,
        /// The edge from (x + 1, y) to (x + 1, y + 1).
        Right = 2,
        /// The edge from (x, y) to (x + 1, y).
        Down = 3,
    }
}

coded! {
    /// What the navigator is doing.
    pub enum Phase {
        /// It has no map yet (L2, L3).
        WaitingForMap = 0,
        /// It stands and waits for an order.
        WaitingForOrder = 1,
        /// It follows the line between two nodes.
        Driving = 2,
        /// It turns at a node.
        Turning = 3,
        /// It drives towards the mark of a pick station.
        Approaching = 4,
        /// It turns in at a pick station.
        Positioning = 5,
        /// It stands at the goods; the operator moves the arm (L10).
        Picking = 6,
        /// It turns back from a pick station onto the line.
        Leaving = 7,
        /// It follows the way out to the place of delivery (L8).
        Exiting = 8,
        /// It lets go of the goods.
        Dropping = 9,
        /// It backs away from the goods it has let go.
        BackingOff = 10,
        /// It turns round at the place of delivery.
        TurningRound = 11,
        /// It comes back into the warehouse.
        Returning = 12,
        /// It cannot go on without help (AMB-49).
        Stuck = 13,
    }
}

coded! {
    /// What the navigator looks for on the line it drives along.
    pub enum Step {
        /// The next mark it expects.
        Seeking = 0,
        /// The pick station's mark has been seen; the axle has yet to come to it.
        ToStation = 1,
        /// The node's mark has been seen; the axle has yet to come to it.
        ToNode = 2,
        /// A mark to both sides has been seen on the way out; if the line ends it was the cross
        /// bar.
        AtBar = 3,
        /// The node is so near that the axle is driven to it whether or not its mark is seen.
        NearNode = 4,
    }
}

coded! {
    /// What the navigator is heading for.
    pub enum Goal {
        /// Nothing.
        None = 0,
        /// The product of the order.
        Product = 1,
        /// The place of delivery.
        Delivery = 2,
        /// The delivery corner, after a delivery: the place to wait for an order (AMB-50).
        Home = 3,
    }
}

payload! {
    /// The navigator's state: what observers want to see and a restarted navigator needs.
    pub struct NavigatorStatus: 72 bytes {
        /// Samples the navigator has missed, of `sensor/line`, `sensor/distance`,
        /// `steering/state`, `mission/order` and `operator/input`.
        pub frames_lost: u64,
        /// Samples of `sensor/line` the navigator has read.
        pub frames: u64,
        /// The order it is on, or was on last.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// The order that waits, if `pending` is 1.
        pub pending_id: u32,
        /// The product of the order that waits.
        pub pending_product: i32,
        /// The steering order it gave last.
        pub command_id: u32,
        /// Products delivered.
        pub delivered: u32,
        /// Way the axle has come since the node last passed, in mm; on the way back from the
        /// place of delivery, since its cross bar.
        pub travelled_mm: i32,
        /// From the delivery corner to the cross bar as measured on the way out, in mm; 0 =
        /// never driven.
        pub exit_mm: i32,
        /// Node last passed.
        pub x: i16,
        /// Node last passed.
        pub y: i16,
        /// Degrees turned since the last heading it is sure of, positive = clockwise.
        pub turned_deg: i16,
        /// What it does.
        pub phase: Tag<Phase>,
        /// Step within a drive.
        pub step: Tag<Step>,
        /// Where it looks.
        pub heading: Tag<Heading>,
        /// Where it turns to.
        pub target: Tag<Heading>,
        /// What it heads for.
        pub goal: Tag<Goal>,
        /// How often the mark under the sensors has been seen to the left (bits 0..=1) and to the
        /// right (bits 2..=3), each up to 3; bit 4 = a cross bar has been judged.
        pub mark: u8,
        /// Command code it wants.
        pub code: u8,
        /// How often the turn or the drop under way has been begun anew.
        pub tries: u8,
        /// How often it has passed the pick station without finding it.
        pub misses: u8,
        /// 1 = one more order waits.
        pub pending: u8,
        /// Distance to what is in front, in cm, 255 = nothing seen.
        pub distance_cm: u8 = 255,
        /// Who may drive.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 5],
    }
}

payload! {
    /// One place where a product is picked.
    pub struct MapProduct: 8 bytes {
        /// The product's number.
        pub id: i32,
        /// Column of its square, from 0.
        pub x: u8,
        /// Row of its square, from 0 at the bottom.
        pub y: u8,
        /// The side of the square it stands at.
        pub side: Tag<Side>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
    }
}

payload! {
    /// The warehouse as the external computer describes it (M1-M3).
    pub struct WarehouseMap: 520 bytes {
        /// Squares from left to right.
        pub width: u8,
        /// Squares from bottom to top.
        pub height: u8,
        /// Node of the delivery corner.
        pub delivery_x: u8,
        /// Node of the delivery corner.
        pub delivery_y: u8,
        /// Side of a square in cm; 0 = not known yet.
        pub side_length_cm: u16,
        /// How many of `products` are used.
        pub product_count: u16,
        /// The pick stations.
        #[serde(with = "crate::list")]
        pub products: [MapProduct; 64],
    }
}

impl WarehouseMap {
    /// The products in use.
    pub fn products(&self) -> &[MapProduct] {
        &self.products[..usize::from(self.product_count).min(self.products.len())]
    }
}

payload! {
    /// One node of a route.
    pub struct RouteNode: 2 bytes {
        /// Column of the crossing, from 0.
        pub x: u8,
        /// Row of the crossing, from 0 at the bottom.
        pub y: u8,
    }
}

payload! {
    /// The way the navigator has planned, next node first.
    pub struct Route: 516 bytes {
        /// How many of `nodes` are used.
        pub length: u16,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u16,
        /// The nodes.
        #[serde(with = "crate::list")]
        pub nodes: [RouteNode; 256],
    }
}

impl Route {
    /// The nodes in use.
    pub fn nodes(&self) -> &[RouteNode] {
        &self.nodes[..usize::from(self.length).min(self.nodes.len())]
    }
}
