//! What the services are doing: `log/thought` (G9). A thought travels as a kind with its values.
//! [`Thought`]'s `Display` makes a sentence of it where a person reads it.
//!
//! This file has everything about a kind: its code, what its values mean, and its sentence. A
//! failure is a [`Failure`] and has its own file.

use core::fmt;

use super::failure::Failure;
use super::nav::Heading;
use crate::role::Role;
use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// What is thought. The names in brackets are the fields of [`Thought`] it fills.
    pub enum ThoughtKind {
        /// Nothing.
        None = 0,
        /// A map has come.
        MapTaken = 1,
        /// A map cannot be driven in (`failure`).
        MapRefused = 2,
        /// A map cannot be taken during a mission.
        MapKept = 3,
        /// Another map has taken the first one's place.
        MapChanged = 4,
        /// A person has put the robot on a node that there is not (`x`, `y`).
        NoSuchNode = 5,
        /// A person has put the robot on its start.
        PutAtStart = 6,
        /// A person has put the robot on a node (`x`, `y`).
        PutDown = 7,
        /// Nobody puts a robot down that moves.
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
        /// The operator is not believed (`product`, `failure`).
        PickupRefused = 17,
        /// The goods are held (`product`).
        HasGoods = 18,
        /// The goods are delivered (`product`).
        Delivered = 19,
        /// No reports of the steering board come.
        BoardUnheard = 20,
        /// They come again.
        BoardHeard = 21,
        /// No line frames come.
        Blind = 22,
        /// They come again.
        SeesAgain = 23,
        /// The battery has `seen` tenths of a volt, which is little.
        BatteryLow = 24,
        /// The battery has `seen` tenths of a volt, which is enough.
        BatteryCharged = 25,
        /// It stands at a node because of the battery (`x`, `y`).
        Parked = 26,
        /// A joint of the arm has not been heard (`joint`).
        JointUnheard = 27,
        /// A joint stands at `seen` instead of `expected` (`joint`).
        JointOff = 28,
        /// The arm is where it is carried.
        ArmCarried = 29,
        /// A node is passed (`x`, `y`); `seen` crossings to go.
        NodePassed = 30,
        /// It turns to the left at a node (`x`, `y`).
        TurnsLeft = 31,
        /// It turns to the right at a node (`x`, `y`).
        TurnsRight = 32,
        /// It looks for the station of the goods (`product`).
        SeeksStation = 33,
        /// It leaves the warehouse with the goods.
        LeavesToDeliver = 34,
        /// It is back and waits.
        IsBack = 35,
        /// It stands before the cross bar.
        AtBar = 36,
        /// The mark of the station is there.
        StationSeen = 37,
        /// The mark of the station did not come.
        StationMissed = 38,
        /// A mark (`sides`) after `seen` mm is not on the map.
        MarkUnexpected = 39,
        /// A mark (`sides`) on the way out.
        MarkOnWayOut = 40,
        /// A crossing on the way out.
        CrossingOnWayOut = 41,
        /// A turn was disturbed; it is believed to look along `heading`.
        TurnDisturbed = 42,
        /// A mark shows that it looks elsewhere (`x`, `y`, `heading`).
        PlaceCorrected = 43,
        /// It cannot go on (`failure`).
        Failed = 44,
        /// Something stands `seen` cm ahead, between two nodes.
        Halts = 45,
        /// It tries the ways again that it had found blocked.
        TriesAgain = 46,
        /// The order cannot be carried out now and waits (`product`).
        OrderPutOff = 47,
        /// An order is taken back (`product`).
        OrderCancelled = 48,
        /// A waiting order is carried out earlier (`product`).
        OrderMovedUp = 49,
        /// All waiting orders are taken back.
        QueueCleared = 50,
        /// The turn to the station has passed its mark.
        StationPassed = 51,
        /// The external computer is out of reach; the robot stands at the next node.
        LinkLost = 52,
        /// It is there again.
        LinkBack = 53,
        /// It stands at the node (`x`, `y`) until the external computer is there again.
        ParkedWithoutLink = 54,
        /// The delivery corner's mark has not come on the way back.
        CornerMissed = 55,
        /// A person picks the goods up from now on.
        PicksByHand = 56,
        /// It picks the goods up by itself from now on.
        PicksByItself = 57,
        /// The order is taken back too late: its goods are held, or being gripped (`product`).
        OrderKept = 58,
        /// The goods are in their place again (`product`).
        GoodsBack = 59,
        /// All goods are in their places again.
        AllGoodsBack = 60,
        /// The goods are not in their place, as it was told (`product`).
        GoodsGone = 61,
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
    /// One thought; its kind says which of the values mean something.
    pub struct Thought: 32 bytes {
        /// What.
        pub kind: Tag<ThoughtKind>,
        /// Who thinks it.
        pub from: Tag<Role>,
        /// Column of the node it is about.
        pub x: u8,
        /// Row of the node it is about.
        pub y: u8,
        /// The direction it is about.
        pub heading: Tag<Heading>,
        /// The joint it is about.
        pub joint: Tag<Joint>,
        /// Sides of a mark: bit 0 = left, bit 1 = right.
        pub sides: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: u8,
        /// The product it is about.
        pub product: i32,
        /// What was expected.
        pub expected: i32,
        /// What was seen.
        pub seen: i32,
        /// What is wrong.
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
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            heading,
            product,
            expected,
            seen,
            failure,
            ..
        } = self;
        let Some(kind) = self.kind.get() else {
            return write!(to, "I think something unknown.");
        };
        match kind {
            ThoughtKind::None => write!(to, "Nothing."),
            ThoughtKind::MapTaken => write!(to, "I have a map. Which product shall I fetch?"),
            ThoughtKind::MapRefused => write!(to, "I cannot use this map: {failure}."),
            ThoughtKind::MapKept => {
                write!(to, "I keep my map until I am back; send the new one then.")
            }
            ThoughtKind::MapChanged => write!(to, "The map has changed."),
            ThoughtKind::NoSuchNode => write!(
                to,
                "There is no crossing ({x}, {y}) on my map; I stay where I was."
            ),
            ThoughtKind::PutAtStart => write!(
                to,
                "Reset: I stand at the start. Which product shall I fetch?"
            ),
            ThoughtKind::PutDown => write!(
                to,
                "I have been put on crossing ({x}, {y}). Which product shall I fetch?"
            ),
            ThoughtKind::MovesAlone => write!(
                to,
                "I am moving, so nobody has put me down. Stop me, or take the manual mode, and \
                 tell me again."
            ),
            ThoughtKind::WayBlocked => {
                write!(to, "The way from ({x}, {y}) to the {heading} is blocked.")
            }
            ThoughtKind::WayOpen => write!(to, "The way from ({x}, {y}) to the {heading} is open."),
            ThoughtKind::OrderWaits if *seen == 0 => {
                write!(to, "I shall fetch product {product} next.")
            }
            ThoughtKind::OrderWaits => {
                write!(
                    to,
                    "I shall fetch product {product}; waiting before it: {seen}."
                )
            }
            ThoughtKind::OrderPutOff => write!(
                to,
                "There is no way to product {product} now; I fetch it later."
            ),
            ThoughtKind::OrderCancelled => write!(to, "I shall not fetch product {product}."),
            ThoughtKind::OrderKept => write!(
                to,
                "I bring product {product} all the same: it is in my claw, or about to be."
            ),
            ThoughtKind::GoodsBack => write!(to, "Product {product} is in its place again."),
            ThoughtKind::AllGoodsBack => write!(to, "All goods are in their places again."),
            ThoughtKind::GoodsGone => write!(to, "Product {product} is not in its place."),
            ThoughtKind::OrderMovedUp => write!(to, "I shall fetch product {product} earlier."),
            ThoughtKind::QueueCleared => write!(to, "I shall fetch none of what was waiting."),
            ThoughtKind::OrderWaitsForCharge => write!(
                to,
                "The battery is low; I fetch product {product} when it is charged."
            ),
            ThoughtKind::OrderRefused => write!(to, "I cannot fetch product {product}: {failure}."),
            ThoughtKind::Fetching => {
                write!(to, "I fetch product {product}; {seen} crossings to go.")
            }
            ThoughtKind::Picking => write!(to, "I stand at product {product} and pick it up."),
            ThoughtKind::AwaitsPickup => write!(
                to,
                "I stand at product {product}. Pick it up with the arm and tell me when it is done."
            ),
            ThoughtKind::PickupRefused => write!(
                to,
                "I do not believe that I have product {product}: {failure}."
            ),
            ThoughtKind::HasGoods => {
                write!(to, "I have product {product} and take it to delivery.")
            }
            ThoughtKind::Delivered => write!(to, "Product {product} is delivered. I go back."),
            ThoughtKind::BoardUnheard => write!(
                to,
                "The steering board does not report; I stand until it does."
            ),
            ThoughtKind::BoardHeard => write!(to, "The steering board reports again; I go on."),
            ThoughtKind::Blind => write!(to, "No line frames come; I stand until I see again."),
            ThoughtKind::SeesAgain => write!(to, "I see again and drive on."),
            ThoughtKind::BatteryLow => write!(
                to,
                "The battery is low, {}.{} V. I stand at the next crossing.",
                seen / 10,
                seen % 10
            ),
            ThoughtKind::BatteryCharged => {
                write!(to, "The battery has {}.{} V again.", seen / 10, seen % 10)
            }
            ThoughtKind::Parked => write!(
                to,
                "I stand at crossing ({x}, {y}): the battery is low. Charge it, or put me down \
                 anew and press reset."
            ),
            ThoughtKind::LinkLost => write!(
                to,
                "The external computer is out of reach. I stand at the next crossing."
            ),
            ThoughtKind::PicksByHand => {
                write!(to, "From now on a person picks the goods up.")
            }
            ThoughtKind::PicksByItself => {
                write!(to, "From now on I pick the goods up by myself.")
            }
            ThoughtKind::LinkBack => write!(to, "The external computer is there again."),
            ThoughtKind::ParkedWithoutLink => write!(
                to,
                "I stand at crossing ({x}, {y}) until the external computer is there again."
            ),
            ThoughtKind::JointUnheard => write!(
                to,
                "I do not know where the arm's {} is; I wait with the goods until it is heard.",
                self.joint_name()
            ),
            ThoughtKind::JointOff => write!(
                to,
                "The arm's {} is at {seen}; I wait with the goods until it is at {expected}.",
                self.joint_name()
            ),
            ThoughtKind::ArmCarried => write!(to, "The arm is where it is carried; I go."),
            ThoughtKind::NodePassed => write!(to, "Crossing ({x}, {y}), {seen} to go."),
            ThoughtKind::TurnsLeft => write!(to, "At crossing ({x}, {y}) I turn left."),
            ThoughtKind::TurnsRight => write!(to, "At crossing ({x}, {y}) I turn right."),
            ThoughtKind::SeeksStation => write!(to, "I look for product {product}."),
            ThoughtKind::LeavesToDeliver => write!(to, "I leave the warehouse to deliver."),
            ThoughtKind::IsBack => write!(to, "I am back. Which product shall I fetch?"),
            ThoughtKind::AtBar => write!(to, "I am at the place of delivery and let go."),
            ThoughtKind::StationSeen => write!(to, "There is the pick station's mark."),
            ThoughtKind::StationMissed => {
                write!(to, "The pick station's mark did not come; I try again.")
            }
            ThoughtKind::StationPassed => {
                write!(
                    to,
                    "I have turned past the pick station's mark; I look for it."
                )
            }
            ThoughtKind::MarkUnexpected => write!(
                to,
                "A mark to {} after {seen} mm is not on my map; I ignore it.",
                self.sides_name()
            ),
            ThoughtKind::MarkOnWayOut => write!(
                to,
                "A mark to {} on the way out; I ignore it.",
                self.sides_name()
            ),
            ThoughtKind::CrossingOnWayOut => write!(to, "A crossing on the way out; I ignore it."),
            ThoughtKind::TurnDisturbed => write!(
                to,
                "My turn was disturbed; I see by the next marks whether I look {heading}."
            ),
            ThoughtKind::PlaceCorrected => write!(
                to,
                "This mark shows that I turned too far or not far enough: I look {heading}, from \
                 crossing ({x}, {y})."
            ),
            ThoughtKind::Halts => write!(to, "Something stands {seen} cm ahead of me; I stop."),
            ThoughtKind::CornerMissed => write!(
                to,
                "I have not seen the mark of the delivery corner; I drive on to the next one."
            ),
            ThoughtKind::TriesAgain => {
                write!(to, "I try the ways again that I have found blocked.")
            }
            ThoughtKind::Failed => match failure.remedy.get() {
                Some(remedy) => write!(to, "{failure}. {remedy}"),
                None => write!(to, "{failure}."),
            },
        }
    }
}

impl Thought {
    fn joint_name(&self) -> &'static str {
        match self.joint.get() {
            Some(Joint::Base) => "base",
            Some(Joint::Shoulder) => "shoulder",
            Some(Joint::Elbow) => "elbow",
            Some(Joint::Wrist) => "wrist",
            None => "joint",
        }
    }

    fn sides_name(&self) -> &'static str {
        match self.sides & 3 {
            0 => "neither side",
            1 => "the left",
            2 => "the right",
            _ => "both sides",
        }
    }
}
