//! What the navigator knows of the robot and its ways: `nav/status`, `nav/route`, `nav/blocks`.

use lager_floor::Heading;
use lager_orders::{Mode, Pick};

use super::failure::{Failure, Remedy};
use lager_sample::{Tag, coded, payload};

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
        /// It backs away from the goods that it has let go.
        BackingOff = 10,
        /// It turns round at the place of delivery.
        TurningRound = 11,
        /// It comes back into the warehouse.
        Returning = 12,
        /// It cannot go on without help (AMB-49).
        Stuck = 13,
        /// It was restarted and nobody kept its place: it needs a reset to know where it is.
        Lost = 14,
        /// It stands at a node and checks whether the way ahead is open (L6).
        Looking = 15,
        /// It stands between two nodes in front of something and checks whether that stays there.
        Halted = 16,
        /// It turns round between two nodes, because the way ahead is blocked.
        TurningBack = 17,
    }
}

impl Phase {
    /// Whether only a person can end this phase, who puts the robot down somewhere and says where.
    /// A robot without a way is an exception ([`NavigatorStatus::needs_reset`]).
    pub const fn needs_reset(self) -> bool {
        matches!(self, Self::Stuck | Self::Lost)
    }
}

coded! {
    /// Why the navigator stands although its phase would turn the wheels.
    pub enum Hold {
        /// Nothing keeps it.
        None = 0,
        /// No line frames come, or no distances although the robot must look ahead.
        Blind = 1,
        /// The steering board does not report.
        Unheard = 2,
        /// The arm is not in its carrying position while the robot drives with goods.
        Arm = 3,
        /// The battery is low.
        Battery = 4,
        /// The external computer is out of reach, and the robot must then stand.
        Link = 5,
        /// Nobody has said how this robot is built, so nobody knows which way it would drive.
        Undescribed = 6,
    }
}

impl Hold {
    /// What ends this hold.
    pub const fn remedy(self) -> Remedy {
        match self {
            Self::None => Remedy::None,
            Self::Blind => Remedy::Light,
            Self::Unheard => Remedy::Report,
            Self::Arm => Remedy::Arm,
            Self::Battery => Remedy::Charge,
            Self::Link => Remedy::Link,
            Self::Undescribed => Remedy::Describe,
        }
    }
}

coded! {
    /// What the navigator looks for on the line along which it drives.
    pub enum Step {
        /// The next mark that it expects.
        Seeking = 0,
        /// The pick station's mark has been seen; the axle has yet to come to it.
        ToStation = 1,
        /// The node's mark has been seen; the axle has yet to come to it.
        ToNode = 2,
        /// A mark to both sides has been seen on the way out. If the line ends now, the mark was
        /// the cross bar.
        AtBar = 3,
        /// The node is so near that the axle drives to it whether or not its mark is seen.
        NearNode = 4,
    }
}

coded! {
    /// The navigator's goal.
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
    /// The navigator's state. Observers show it, and a restarted navigator needs it.
    pub struct NavigatorStatus: 96 bytes {
        /// Samples that the navigator has missed, of `sensor/line`, `sensor/distance`,
        /// `steering/state`, `mission/order` and `operator/input`.
        pub frames_lost: u64,
        /// Samples of `sensor/line` that the navigator has read.
        pub frames: u64,
        /// The value of [`Health::driven_by_hand`](crate::Health::driven_by_hand) when the
        /// navigator was last sure of its place.
        pub driven_by_hand: u64 = Self::NEVER_HEARD,
        /// The order that it carries out, or carried out last.
        pub order_id: u32,
        /// The product of that order.
        pub product: i32,
        /// The steering order that it gave last.
        pub command_id: u32,
        /// Products delivered.
        pub delivered: u32,
        /// How far the axle has come since the node last passed, in mm; on the way back from the
        /// place of delivery, since the cross bar there.
        pub travelled_mm: i32,
        /// The distance from the delivery corner to the cross bar, measured on the way out, in mm;
        /// 0 = never driven.
        pub exit_mm: i32,
        /// Why the robot cannot go on, and what would end that.
        pub failure: Failure,
        /// Node last passed.
        pub x: i16,
        /// Node last passed.
        pub y: i16,
        /// Degrees turned since the last sure heading, positive = clockwise.
        pub turned_deg: i16,
        /// How old `distance_cm` is, in ms; 65535 = that or older, or never heard.
        pub distance_age_ms: u16 = u16::MAX,
        /// What it is doing.
        pub phase: Tag<Phase>,
        /// Step within a drive.
        pub step: Tag<Step>,
        /// Where the robot looks.
        pub heading: Tag<Heading>,
        /// Where the robot turns to.
        pub target: Tag<Heading>,
        /// The robot's goal.
        pub goal: Tag<Goal>,
        /// How often the mark under the sensors has been seen to the left (bits 0..=1) and to the
        /// right (bits 2..=3), each up to 3; bit 4 = a cross bar has been judged.
        pub mark: u8,
        /// The command code that it wants.
        pub code: u8,
        /// How often it has begun the present turn or drop again.
        pub tries: u8,
        /// How often the robot has passed the pick station without finding it.
        pub misses: u8,
        /// How many orders wait; `mission/queue` lists them.
        pub waiting: u8,
        /// Distance to the next thing in front, in cm; 255 = nothing seen.
        pub distance_cm: u8 = 255,
        /// Who may drive.
        pub mode: Tag<Mode>,
        /// 1 = a stop is latched.
        pub stopped: u8,
        /// Why the robot stands although its phase would turn the wheels.
        pub hold: Tag<Hold>,
        /// 1 = a person said that the goods are held although the claw did not feel them.
        pub forced: u8,
        /// Headings that are possible besides `heading` since a turn was disturbed: bit n = n
        /// quarters further to the right; bit 0 = the present turn was disturbed; bit 4 = the
        /// quarter before ended without tape. In a search for a station's mark, bit 5 = half a turn
        /// without tape lies behind the last tape; bit 6 = it turns to the right; bit 7 = there is
        /// no mark.
        pub doubt: u8,
        /// For each of these headings, from one quarter on, the column of the node last passed.
        pub doubt_x: [u8; 3],
        /// For each of these headings, from one quarter on, the row of the node last passed.
        pub doubt_y: [u8; 3],
        /// The present attempt to pick, from 0.
        pub arm_attempt: u8,
        /// How many moves of the arm's routine are done.
        pub arm_moves: u8,
        /// What would end the standstill: of its failure, its hold, a stop, or the manual mode.
        pub remedy: Tag<Remedy>,
        /// Who picks the goods up.
        pub pick: Tag<Pick>,
        /// 1 = the robot stands on the delivery node, looks into the warehouse, sees tape, and has
        /// not moved since somebody put it there. A change of it is told with the next state.
        pub at_start: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
    }
}

impl NavigatorStatus {
    /// `driven_by_hand` before the bridge has reported it.
    pub const NEVER_HEARD: u64 = u64::MAX;

    /// Whether the robot can only go on after a person has put it down and said where. A robot that
    /// has no way knows where it is, and goes on by itself.
    pub fn needs_reset(&self) -> bool {
        let is_out = self.phase.get().is_some_and(Phase::needs_reset);
        is_out && self.failure.remedy != Remedy::Way
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
        /// The direction of the way from that node.
        pub heading: Tag<Heading>,
        /// Who says that the way is blocked.
        pub source: Tag<BlockSource>,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
    }
}

payload! {
    /// All blocked ways. Observers show them, and a restarted navigator needs them.
    pub struct BlockedWays: 1032 bytes {
        /// Squares of the floor from left to right.
        pub width: u8,
        /// Squares of the floor from bottom to top.
        pub height: u8,
        /// How often the robot has tried all ways again that it had found blocked, for this goal.
        pub tries: u8,
        /// How many of `ways` are used.
        pub count: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 4],
        /// The ways; the one that has been blocked longest comes first.
        #[serde(with = "lager_sample::list")]
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
    /// The way that the navigator has planned, next node first.
    pub struct Route: 1028 bytes {
        /// How many nodes the way has.
        pub length: u16,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u16,
        /// The nodes, as many as fit.
        #[serde(with = "lager_sample::list")]
        pub nodes: [RouteNode; 512],
    }
}

impl Route {
    /// The nodes in use.
    pub fn nodes(&self) -> &[RouteNode] {
        &self.nodes[..usize::from(self.length).min(self.nodes.len())]
    }
}
