//! [`Thought`]: what the services are doing, on `log/thought` (G9). A thought travels as a kind
//! with values. Its `Display` makes a sentence of it where a person reads it.
//!
//! This file has the kinds: their codes, and the meaning of their values. Their sentences are in
//! the table of `lager-orders`. A failure is a [`Failure`] and has its own file.

use lager_floor::Heading;

use core::fmt;

use lager_orders::{Language, Reason, Sentence};

use super::failure::Failure;
use super::said;
use crate::role::Role;
use lager_sample::{Tag, coded, payload};

coded! {
    /// The kind of a thought. In brackets: the fields of [`Thought`] that it fills.
    pub enum ThoughtKind {
        /// Nothing.
        None = 0,
        /// A map has come.
        MapTaken = 1,
        /// The robot cannot drive on a map (`failure`).
        MapRefused = 2,
        /// A map came during a mission and was not taken.
        MapKept = 3,
        /// Another map has replaced the first one.
        MapChanged = 4,
        /// A person has put the robot on a node that does not exist (`x`, `y`).
        NoSuchNode = 5,
        /// A person has put the robot on its starting place.
        PutAtStart = 6,
        /// A person has put the robot on a node (`x`, `y`).
        PutDown = 7,
        /// A person has put the robot down while it moves by itself, which is not believed.
        MovesAlone = 8,
        /// A way is blocked (`x`, `y`, `heading`).
        WayBlocked = 9,
        /// A way is open again (`x`, `y`, `heading`).
        WayOpen = 10,
        /// An order is taken for later (`product`), after `seen` others.
        OrderWaits = 11,
        /// An order waits for the battery (`product`).
        OrderWaitsForCharge = 12,
        /// An order is refused (`product`, `failure`).
        OrderRefused = 13,
        /// An order is begun (`product`); `seen` crossings to go.
        Fetching = 14,
        /// The robot stands at the goods and picks them up (`product`).
        Picking = 15,
        /// The robot stands at the goods and waits for the operator (`product`).
        AwaitsPickup = 16,
        /// The operator says that the goods are held and is not believed (`product`, `failure`).
        PickupRefused = 17,
        /// The goods are held (`product`).
        HasGoods = 18,
        /// The goods are delivered (`product`).
        Delivered = 19,
        /// The steering board sends no reports.
        BoardUnheard = 20,
        /// The steering board sends reports again.
        BoardHeard = 21,
        /// The sensor board sends no line frames.
        Blind = 22,
        /// The sensor board sends line frames again.
        SeesAgain = 23,
        /// The battery has `seen` tenths of a volt, which is little.
        BatteryLow = 24,
        /// The battery has `seen` tenths of a volt, which is enough.
        BatteryCharged = 25,
        /// The robot stands at a node because of the battery (`x`, `y`).
        Parked = 26,
        /// A joint of the arm has not been heard (`joint`).
        JointUnheard = 27,
        /// A joint stands at `seen` instead of at `expected` (`joint`).
        JointOff = 28,
        /// The arm is in its carrying position.
        ArmCarried = 29,
        /// A node is passed (`x`, `y`); `seen` crossings to go.
        NodePassed = 30,
        /// The robot turns to the left at a node (`x`, `y`).
        TurnsLeft = 31,
        /// The robot turns to the right at a node (`x`, `y`).
        TurnsRight = 32,
        /// The robot looks for the station of the goods (`product`).
        SeeksStation = 33,
        /// The robot leaves the warehouse with the goods.
        LeavesToDeliver = 34,
        /// The robot is back and waits.
        IsBack = 35,
        /// The robot stands before the cross bar.
        AtBar = 36,
        /// The robot sees the mark of the station.
        StationSeen = 37,
        /// The mark of the station did not come.
        StationMissed = 38,
        /// A mark (`sides`) after `seen` mm is not on the map.
        MarkUnexpected = 39,
        /// A mark (`sides`) on the way out.
        MarkOnWayOut = 40,
        /// A crossing on the way out.
        CrossingOnWayOut = 41,
        /// A turn was disturbed; the robot probably looks along `heading`.
        TurnDisturbed = 42,
        /// A mark shows that the robot looks another way (`x`, `y`, `heading`).
        PlaceCorrected = 43,
        /// The robot cannot go on (`failure`).
        Failed = 44,
        /// Something stands `seen` cm ahead, between two nodes.
        Halts = 45,
        /// The robot tries the ways again that it had found blocked.
        TriesAgain = 46,
        /// The order cannot be carried out now and waits (`product`).
        OrderPutOff = 47,
        /// An order is cancelled (`product`).
        OrderCancelled = 48,
        /// A waiting order is carried out earlier (`product`).
        OrderMovedUp = 49,
        /// All waiting orders are cancelled.
        QueueCleared = 50,
        /// The robot has turned past the mark of the station.
        StationPassed = 51,
        /// The external computer is out of reach; the robot stands at the next node.
        LinkLost = 52,
        /// The external computer is in reach again.
        LinkBack = 53,
        /// The robot stands at the node (`x`, `y`) until the external computer is in reach again.
        ParkedWithoutLink = 54,
        /// The delivery corner's mark has not come on the way back.
        CornerMissed = 55,
        /// A person picks the goods up from now on.
        PicksByHand = 56,
        /// The robot picks the goods up by itself from now on.
        PicksByItself = 57,
        /// An order is cancelled too late: its goods are held, or being gripped (`product`).
        OrderKept = 58,
        /// The goods are in their place again (`product`).
        GoodsBack = 59,
        /// All goods are in their places again.
        AllGoodsBack = 60,
        /// A person has said, or it is known of an earlier run, that the goods are not in their place
        /// (`product`).
        GoodsGone = 61,
        /// The robot sounds its horn.
        Honks = 62,
        /// Reset was pressed at the delivery node, and the stop of the fresh start has ended.
        StartedByReset = 63,
        /// Reset was pressed, and does not end the stop in force.
        ResetKeepsStop = 64,
        /// Reset was pressed while a board or logic was silent; the stop stays.
        ResetUnheard = 65,
        /// Reset was pressed before there was a map; the stop stays.
        ResetWithoutMap = 66,
        /// Reset was pressed on a robot that did not know that it stands on the delivery node; the
        /// stop stays, and the next press may end it.
        ResetElsewhere = 67,
        /// A commissioning in a terminal has saved how the robot is built; `seen` is the number of the
        /// user.
        SetUpInTerminal = 68,
        /// The same at a page, by whoever has its wheel.
        SetUpAtPage = 69,
    }
}

coded! {
    /// A joint of the arm.
    pub enum Joint {
        /// The base.
        Base = 0,
        /// The shoulder.
        Shoulder = 1,
        /// The elbow.
        Elbow = 2,
        /// The wrist.
        Wrist = 3,
    }
}

payload! {
    /// One thought. Its kind says which of the values have a meaning.
    pub struct Thought: 32 bytes {
        /// The kind.
        pub kind: Tag<ThoughtKind>,
        /// The service that thinks it.
        pub from: Tag<Role>,
        /// Column of the node that it is about.
        pub x: u8,
        /// Row of the node that it is about.
        pub y: u8,
        /// The direction that it is about.
        pub heading: Tag<Heading>,
        /// The joint that it is about.
        pub joint: Tag<Joint>,
        /// Sides of a mark: bit 0 = left, bit 1 = right.
        pub sides: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// The product that it is about.
        pub product: i32,
        /// What was expected.
        pub expected: i32,
        /// What was seen.
        pub seen: i32,
        /// What has gone wrong.
        pub failure: Failure,
    }
}

impl From<ThoughtKind> for Thought {
    fn from(kind: ThoughtKind) -> Self {
        Self {
            kind: kind.into(),
            ..Self::default()
        }
    }
}

impl fmt::Display for Thought {
    /// The English sentence.
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            expected,
            seen,
            ..
        } = self;
        let name = match self.kind.get() {
            Some(ThoughtKind::OrderWaits) if *seen == 0 => "thought_order_waits_next".into(),
            _ => said::name("thought", self.kind),
        };
        let Some(sentence) = Sentence::of(&name) else {
            return write!(to, "I think something unknown.");
        };
        sentence.put(Language::English, to, &mut |key, to| match key {
            "node" => write!(to, "({x}, {y})"),
            "looks" => write!(to, "{}", said::reason("looks", self.heading)),
            "joint" => write!(to, "{}", said::reason("joint", self.joint)),
            "sides" => write!(to, "{}", Reason::read(&format!("sides_{}", self.sides & 3))),
            "product" => write!(to, "{}", self.product),
            "expected" => write!(to, "{expected}"),
            "volts" => write!(to, "{}.{}", seen / 10, seen % 10),
            "failure" => write!(to, "{}", self.failure),
            "remedy" => write!(to, "{}", said::reason("remedy", self.failure.remedy)),
            _ => write!(to, "{seen}"),
        })
    }
}
