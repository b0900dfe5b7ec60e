//! [`Failure`]: what goes wrong on a mission. It has a kind, a place, what was expected, what was
//! seen, and what would end it. It travels in `mission/event` and `nav/status`, and becomes a
//! [`Reason`] for people to read.
//!
//! This file has the kinds: their codes, the meaning of their two values, and their remedies. Their
//! sentences are in the table of `lager-orders`.

use core::fmt;

use lager_orders::Reason;
use lager_sample::{Tag, coded, payload};

use super::said;

coded! {
    /// What has gone wrong, or cannot be done. Each kind says what `expected` and `seen` mean.
    pub enum FailureKind {
        /// Nothing.
        None = 0,
        /// No line was seen for `seen` mm; `expected` is the most that is tolerated.
        LineLost = 1,
        /// The node that should come after `expected` mm has not come after `seen` mm.
        NodeMissing = 2,
        /// The cross bar of the delivery has not come after `seen` mm; `expected` is the longest
        /// possible way out.
        BarMissing = 3,
        /// The mark of the pick station has not been found on `seen` of `expected` passages.
        StationMissing = 4,
        /// No open way leads to the robot's goal.
        NoWay = 5,
        /// The steering board has not carried out an order in `seen` attempts of `expected`.
        BoardRefuses = 6,
        /// The wheels were turned by hand for `seen` mm; up to `expected` mm are no problem.
        DrivenByHand = 7,
        /// The place of the robot, or what it fetches, is not on the map.
        OffTheMap = 8,
        /// The navigator was restarted, and nobody has kept the robot's place.
        StateLost = 9,
        /// An order came before the map.
        NoMap = 10,
        /// An order is for product `seen`, which is not on the map.
        UnknownProduct = 11,
        /// An order came while the robot waits for a reset.
        NeedsReset = 12,
        /// An order came while `seen` others wait already, which is the most.
        QueueFull = 13,
        /// The order was given up because a person has put the robot down elsewhere.
        PutDown = 14,
        /// The claw's servo has not reported, so it is not known what the claw holds.
        ClawUnheard = 15,
        /// The claw stands at `seen`; when it is closed on nothing it stands at `expected`.
        ClawEmpty = 16,
        /// The claw presses with `seen`; to hold something it needs `expected` at least.
        ClawSlack = 17,
        /// A joint of the arm stands at `seen` and does not reach `expected`.
        ArmJammed = 18,
        /// The claw closed on nothing in `seen` attempts of `expected`.
        GoodsMissing = 19,
        /// A map has no square in one direction.
        MapEmpty = 20,
        /// A map has `seen` crossings along one side; `expected` is the most.
        MapTooLarge = 21,
        /// The delivery station of a map, at (`x`, `y`), is not at a corner.
        DeliveryOffCorner = 22,
        /// A map does not say how long the sides of its squares are.
        SideUnknown = 23,
        /// The squares of a map have sides of `seen` cm; `expected` is the least or the most.
        SideWrong = 24,
        /// A map has `seen` products; `expected` is the most.
        TooManyProducts = 25,
        /// Product `seen` of a map does not stand at a side of one of its squares.
        ProductOutside = 26,
        /// A map has product `seen` twice.
        ProductTwice = 27,
        /// No open way leads to the robot's goal, and the robot has tried all ways that it had
        /// found blocked `seen` times again.
        Unreachable = 28,
        /// Neither the pick station's mark nor its edge is in sight after `seen` turns of
        /// `expected`.
        MarkUnseen = 29,
        /// The delivery corner's mark has not come on the way back, and the way on is blocked.
        CornerUnseen = 30,
        /// No tape has been seen since the robot was put down, for `seen` mm; `expected` is the
        /// most that is tolerated.
        LineUnseen = 31,
        /// An order is for product `seen`, but another order is for it already.
        AlreadyOrdered = 32,
        /// An order is for product `seen`, which was delivered `expected` s ago.
        GoodsDelivered = 33,
        /// An order is for product `seen`, known for `expected` s to be out of its place.
        GoodsAway = 34,
        /// The servo with the id `seen` has not answered since the steering board started, and
        /// `expected` of the arm's servos have not.
        ServoSilent = 35,
    }
}

coded! {
    /// What ends a failure.
    pub enum Remedy {
        /// Nothing has to be done.
        None = 0,
        /// A person puts the robot on a node and says which: the reset button, or `lager place`.
        Reset = 1,
        /// A blocked way is opened.
        Way = 2,
        /// Another map is sent.
        Map = 3,
        /// The order is given again later.
        Later = 4,
        /// A person helps by hand, or the operator says that all is well.
        Hand = 5,
        /// Light on the floor: line frames come again.
        Light = 6,
        /// The steering board reports again.
        Report = 7,
        /// The arm moves to its carrying position.
        Arm = 8,
        /// The battery is charged.
        Charge = 9,
        /// The stop is released.
        Resume = 10,
        /// The robot is given the autonomous mode.
        Mode = 11,
        /// The external computer is in reach again.
        Link = 12,
        /// The line sensors are calibrated, and the robot is put on a node as for a reset.
        Calibrate = 13,
        /// A person puts goods back in their place and says so.
        PutBack = 14,
    }
}

payload! {
    /// A failure with its values; [`FailureKind`] says what they mean.
    pub struct Failure: 12 bytes {
        /// What has gone wrong.
        pub kind: Tag<FailureKind>,
        /// What would end it.
        pub remedy: Tag<Remedy>,
        /// Column of the node last passed.
        pub x: u8,
        /// Row of the node last passed.
        pub y: u8,
        /// What was expected.
        pub expected: i32,
        /// What was seen.
        pub seen: i32,
    }
}

impl FailureKind {
    /// What ends a failure of this kind.
    pub const fn remedy(self) -> Remedy {
        match self {
            Self::None | Self::PutDown => Remedy::None,
            Self::LineLost
            | Self::NodeMissing
            | Self::BarMissing
            | Self::StationMissing
            | Self::MarkUnseen
            | Self::CornerUnseen
            | Self::BoardRefuses
            | Self::ServoSilent
            | Self::DrivenByHand
            | Self::OffTheMap
            | Self::StateLost
            | Self::NeedsReset => Remedy::Reset,
            Self::LineUnseen => Remedy::Calibrate,
            Self::NoWay | Self::Unreachable => Remedy::Way,
            Self::NoMap
            | Self::UnknownProduct
            | Self::MapEmpty
            | Self::MapTooLarge
            | Self::DeliveryOffCorner
            | Self::SideUnknown
            | Self::SideWrong
            | Self::TooManyProducts
            | Self::ProductOutside
            | Self::ProductTwice => Remedy::Map,
            Self::QueueFull | Self::AlreadyOrdered => Remedy::Later,
            Self::GoodsDelivered | Self::GoodsAway => Remedy::PutBack,
            Self::ClawUnheard
            | Self::ClawEmpty
            | Self::ClawSlack
            | Self::ArmJammed
            | Self::GoodsMissing => Remedy::Hand,
        }
    }
}

impl Failure {
    /// A failure near the node (`x`, `y`).
    pub fn new(kind: FailureKind, (x, y): (u8, u8), expected: i32, seen: i32) -> Self {
        Self {
            kind: kind.into(),
            remedy: kind.remedy().into(),
            x,
            y,
            expected,
            seen,
        }
    }

    /// Whether it is no failure.
    pub fn is_none(&self) -> bool {
        self.kind == FailureKind::None
    }
}

impl From<Failure> for Reason {
    fn from(failure: Failure) -> Self {
        let Failure {
            x,
            y,
            expected,
            seen,
            ..
        } = failure;
        Self::of(&said::name("failure", failure.kind), |key| match key {
            "node" => Some(format!("({x}, {y})")),
            "expected" => Some(expected.to_string()),
            _ => Some(seen.to_string()),
        })
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}

impl core::error::Error for Failure {}

impl fmt::Display for Remedy {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        said::reason("remedy", Tag::from(*self)).fmt(formatter)
    }
}
