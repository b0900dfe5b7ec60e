//! Where the robot is, where it goes and in what world: `nav/status`, `nav/map`, `nav/route`.

use super::failure::{Failure, Remedy};
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
        /// It was restarted and nobody kept where it was: it knows no place until a reset.
        Lost = 14,
        /// It stands at a node and looks whether the way ahead is open (L6).
        Looking = 15,
        /// It stands between two nodes before something and looks whether that stays.
        Halted = 16,
        /// It turns round between two nodes, since the way ahead is blocked.
        TurningBack = 17,
    }
}

impl Phase {
    /// Whether only a person who puts the robot down somewhere and says where leads out of it, but
    /// for a robot without a way ([`NavigatorStatus::needs_reset`]).
    pub const fn needs_reset(self) -> bool {
        matches!(self, Self::Stuck | Self::Lost)
    }
}

coded! {
    /// Why the navigator stands although its phase would turn the wheels.
    pub enum Hold {
        /// Nothing keeps it.
        None = 0,
        /// No line frames come, or no distances where the robot has to look ahead.
        Blind = 1,
        /// The steering board does not report.
        Unheard = 2,
        /// The arm is not where it is carried while the robot drives with goods.
        Arm = 3,
        /// The battery is low.
        Battery = 4,
        /// The external computer is out of reach, and the robot is to stand then.
        Link = 5,
    }
}

impl Hold {
    /// What ends it.
    pub const fn remedy(self) -> Remedy {
        match self {
            Self::None => Remedy::None,
            Self::Blind => Remedy::Light,
            Self::Unheard => Remedy::Report,
            Self::Arm => Remedy::Arm,
            Self::Battery => Remedy::Charge,
            Self::Link => Remedy::Link,
        }
    }
}

coded! {
    /// Who picks the goods up at a station.
    pub enum Pick {
        /// A person moves the arm and says when it is done.
        Manual = 0,
        /// The robot, by itself.
        Auto = 1,
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
    pub struct NavigatorStatus: 96 bytes {
        /// Samples the navigator has missed, of `sensor/line`, `sensor/distance`,
        /// `steering/state`, `mission/order` and `operator/input`.
        pub frames_lost: u64,
        /// Samples of `sensor/line` the navigator has read.
        pub frames: u64,
        /// What [`Health::driven_by_hand`](crate::Health::driven_by_hand) was when it last was
        /// sure of its place.
        pub driven_by_hand: u64 = Self::NEVER_HEARD,
        /// The order it is on, or was on last.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
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
        /// Why it cannot go on, and what would end that.
        pub failure: Failure,
        /// Node last passed.
        pub x: i16,
        /// Node last passed.
        pub y: i16,
        /// Degrees turned since the last heading it is sure of, positive = clockwise.
        pub turned_deg: i16,
        /// How old `distance_cm` is, in ms; 65535 = that or older, or never heard.
        pub distance_age_ms: u16 = u16::MAX,
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
        /// How many orders wait; `mission/queue` has them.
        pub waiting: u8,
        /// Distance to what is in front, in cm, 255 = nothing seen.
        pub distance_cm: u8 = 255,
        /// Who may drive.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Why it stands although its phase would turn the wheels.
        pub hold: Tag<Hold>,
        /// 1 = a person said that the goods are held although the claw did not feel them.
        pub forced: u8,
        /// Headings that are possible besides `heading` since a turn was disturbed: bit n = n
        /// quarters further to the right; bit 0 = the turn under way was disturbed; bit 4 = its
        /// quarter before ended without tape.
        pub doubt: u8,
        /// For each of these headings, from one quarter on, the node last passed.
        pub doubt_x: [u8; 3],
        /// For each of these headings, from one quarter on, the node last passed.
        pub doubt_y: [u8; 3],
        /// The attempt to pick that is under way, from 0.
        pub arm_attempt: u8,
        /// How many moves of the arm's routine are done.
        pub arm_moves: u8,
        /// What would end that it stands: its failure, what holds it, a stop, or the manual mode.
        pub remedy: Tag<Remedy>,
        /// Who picks the goods up.
        pub pick: Tag<Pick>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 2],
    }
}

impl NavigatorStatus {
    /// `driven_by_hand` before the bridge has told it.
    pub const NEVER_HEARD: u64 = u64::MAX;

    /// Whether only a person who puts the robot down and says where leads on. One that has no way
    /// knows where it is, and goes on by itself.
    pub fn needs_reset(&self) -> bool {
        let is_out = self.phase.get().is_some_and(Phase::needs_reset);
        is_out && self.failure.remedy != Remedy::Way
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
    pub struct WarehouseMap: 2056 bytes {
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
        pub products: [MapProduct; 256],
    }
}

impl WarehouseMap {
    /// The products in use.
    pub fn products(&self) -> &[MapProduct] {
        &self.products[..usize::from(self.product_count).min(self.products.len())]
    }
}

coded! {
    /// Who says that a way is blocked.
    pub enum BlockSource {
        /// The robot has seen something there.
        Sensor = 0,
        /// A person.
        Person = 1,
    }
}

payload! {
    /// A way between two nodes on which something stands.
    pub struct BlockedWay: 16 bytes {
        /// Since when, in ns of robot time.
        pub since_ns: u64,
        /// Column of the node at one end.
        pub x: u8,
        /// Row of the node at one end.
        pub y: u8,
        /// Where the way leads from there.
        pub heading: Tag<Heading>,
        /// Who says so.
        pub source: Tag<BlockSource>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
    }
}

payload! {
    /// All ways that are blocked: what observers want to see and a restarted navigator needs.
    pub struct BlockedWays: 1032 bytes {
        /// Squares of the floor from left to right.
        pub width: u8,
        /// Squares of the floor from bottom to top.
        pub height: u8,
        /// How often all ways that the robot had found blocked were tried again for its goal.
        pub tries: u8,
        /// How many of `ways` are used.
        pub count: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
        /// The ways, the one that has been blocked for longest first.
        #[serde(with = "crate::list")]
        pub ways: [BlockedWay; 64],
    }
}

impl BlockedWays {
    /// The ways in use.
    pub fn ways(&self) -> &[BlockedWay] {
        &self.ways[..usize::from(self.count).min(self.ways.len())]
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
    pub struct Route: 1028 bytes {
        /// How many nodes the way has.
        pub length: u16,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u16,
        /// The nodes, as far as there is room for them.
        #[serde(with = "crate::list")]
        pub nodes: [RouteNode; 512],
    }
}

impl Route {
    /// The nodes in use.
    pub fn nodes(&self) -> &[RouteNode] {
        &self.nodes[..usize::from(self.length).min(self.nodes.len())]
    }
}
