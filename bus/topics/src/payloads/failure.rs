//! What goes wrong on a mission: its kind, its place, what was expected, what was seen, and what
//! would end it. A failure travels in `mission/event` and `nav/status`. [`Failure`]'s `Display`
//! makes a sentence of it where a person reads it.
//!
//! This file has everything about a kind: its code, what its two values mean, its remedy and its
//! sentence.

use core::fmt;

use crate::schema::payload;
use crate::tag::{Tag, coded};

coded! {
    /// What has gone wrong, or cannot be done. `expected` and `seen` mean what the kind says.
    pub enum FailureKind {
        /// Nothing.
        None = 0,
        /// No line was seen for `seen` mm; `expected` is the most that is borne.
        LineLost = 1,
        /// The node that should come after `expected` mm has not come after `seen` mm.
        NodeMissing = 2,
        /// The cross bar of the delivery has not come after `seen` mm; `expected` is the longest
        /// way out that is believed.
        BarMissing = 3,
        /// The mark of the pick station has not been found on `seen` of `expected` passages.
        StationMissing = 4,
        /// No open way leads to where the robot must go.
        NoWay = 5,
        /// The steering board has not carried out an order in `seen` attempts of `expected`.
        BoardRefuses = 6,
        /// The wheels were turned by hand for `seen` mm; `expected` do not matter.
        DrivenByHand = 7,
        /// The place of the robot, or what it fetches, is not on the map.
        OffTheMap = 8,
        /// The navigator was restarted and nobody kept where the robot is.
        StateLost = 9,
        /// An order came before the map.
        NoMap = 10,
        /// An order is for product `seen`, which is not on the map.
        UnknownProduct = 11,
        /// An order came while the robot waits for a reset.
        NeedsReset = 12,
        /// An order came while `seen` others wait already, which is the most.
        QueueFull = 13,
        /// The order was given up since a person has put the robot down elsewhere.
        PutDown = 14,
        /// Of the claw's servo nothing has been heard, so nobody knows what it holds.
        ClawUnheard = 15,
        /// The claw stands at `seen`; closed on nothing it stands at `expected`.
        ClawEmpty = 16,
        /// The claw presses with `seen`; to hold something it is at least `expected`.
        ClawSlack = 17,
        /// A joint of the arm stands at `seen` and does not get to `expected`.
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
        /// The squares of a map have sides of `seen` cm; `expected` is the least.
        SideTooShort = 24,
        /// A map has `seen` products; `expected` is the most.
        TooManyProducts = 25,
        /// Product `seen` of a map does not stand at a side of one of its squares.
        ProductOutside = 26,
        /// A map has product `seen` twice.
        ProductTwice = 27,
        /// No open way leads to where the robot must go, and all that it had found blocked were
        /// tried again `seen` times.
        Unreachable = 28,
        /// Neither the pick station's mark nor its edge is in sight after `seen` turns of
        /// `expected`.
        MarkUnseen = 29,
        /// The delivery corner's mark has not come on the way back, and the way on is blocked.
        CornerUnseen = 30,
        /// No tape has been seen since the robot was put down, in `seen` mm; `expected` is the most
        /// that is borne.
        LineUnseen = 31,
        /// An order is for product `seen`, which another order is for already.
        AlreadyOrdered = 32,
        /// An order is for product `seen`, which was delivered `expected` s ago.
        GoodsDelivered = 33,
        /// An order is for product `seen`, which is not in its place, as is known since `expected`
        /// s.
        GoodsAway = 34,
    }
}

coded! {
    /// What ends a failure.
    pub enum Remedy {
        /// Nothing has to be done.
        None = 0,
        /// A person puts the robot on a node and says which: the reset button, or `lager place`.
        Reset = 1,
        /// A way is opened.
        Way = 2,
        /// Another map is sent.
        Map = 3,
        /// The order is given again later.
        Later = 4,
        /// A person's hand, or the operator's word that all is well.
        Hand = 5,
        /// Light on the floor: line frames come again.
        Light = 6,
        /// The steering board reports again.
        Report = 7,
        /// The arm is brought to where it is carried.
        Arm = 8,
        /// The battery is charged.
        Charge = 9,
        /// The stop is released.
        Resume = 10,
        /// The robot is given the autonomous mode.
        Mode = 11,
        /// The external computer is there again.
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
        /// What.
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
    /// What ends it.
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
            | Self::SideTooShort
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

    /// Whether it is none.
    pub fn is_none(&self) -> bool {
        self.kind == FailureKind::None
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            expected,
            seen,
            ..
        } = self;
        let Some(kind) = self.kind.get() else {
            return write!(formatter, "something unknown has gone wrong");
        };
        match kind {
            FailureKind::None => write!(formatter, "nothing is wrong"),
            FailureKind::LineLost => write!(
                formatter,
                "I have lost the line behind ({x}, {y}): {seen} mm without it"
            ),
            FailureKind::LineUnseen => write!(
                formatter,
                "I see no tape behind ({x}, {y}), in {seen} mm: calibrate the line sensors"
            ),
            FailureKind::NodeMissing => write!(
                formatter,
                "The next crossing did not come: {seen} mm behind ({x}, {y}), not {expected}"
            ),
            FailureKind::BarMissing => write!(
                formatter,
                "The cross bar of the delivery did not come in {seen} mm"
            ),
            FailureKind::StationMissing => write!(
                formatter,
                "I cannot find the mark of the pick station: passed {seen} times at ({x}, {y})"
            ),
            FailureKind::MarkUnseen => write!(
                formatter,
                "I stand at the pick station behind ({x}, {y}) and do not see its mark in {seen} turns"
            ),
            FailureKind::CornerUnseen => write!(
                formatter,
                "I came back to ({x}, {y}) and did not see its mark, and the way on is blocked"
            ),
            FailureKind::NoWay => write!(
                formatter,
                "There is no way from ({x}, {y}) to where I must go"
            ),
            FailureKind::BoardRefuses => write!(
                formatter,
                "The steering board does not do what I ask, in {seen} attempts"
            ),
            FailureKind::DrivenByHand => {
                write!(formatter, "I have been driven by hand, {seen} mm")
            }
            FailureKind::OffTheMap => write!(formatter, "My place is not on this map"),
            FailureKind::StateLost => {
                write!(formatter, "I was restarted and nobody kept where I was")
            }
            FailureKind::NoMap => write!(formatter, "I have no map yet"),
            FailureKind::UnknownProduct => write!(formatter, "product {seen} is not on my map"),
            FailureKind::NeedsReset => write!(formatter, "I am stuck and need a reset"),
            FailureKind::QueueFull => {
                write!(
                    formatter,
                    "{seen} orders are waiting already, which is the most"
                )
            }
            FailureKind::PutDown => write!(formatter, "I have been put down elsewhere"),
            FailureKind::ClawUnheard => write!(formatter, "the claw's servo has not been heard"),
            FailureKind::ClawEmpty => write!(
                formatter,
                "the claw is closed on nothing, at {seen} of {expected}"
            ),
            FailureKind::ClawSlack => write!(
                formatter,
                "the claw does not squeeze anything, with {seen} of {expected}"
            ),
            FailureKind::ArmJammed => write!(
                formatter,
                "A joint of my arm stands at {seen} and does not get to {expected}"
            ),
            FailureKind::GoodsMissing => {
                write!(formatter, "My claw closed on nothing {seen} times")
            }
            FailureKind::MapEmpty => write!(
                formatter,
                "a warehouse without a square has no way round; give at least 1 x 1"
            ),
            FailureKind::MapTooLarge => write!(
                formatter,
                "{seen} crossings along one side are more than {expected}; divide the warehouse"
            ),
            FailureKind::DeliveryOffCorner => write!(
                formatter,
                "the delivery station ({x}, {y}) is not at a corner of the warehouse"
            ),
            FailureKind::SideUnknown => write!(
                formatter,
                "the side length of the squares is missing; set it in centimetres"
            ),
            FailureKind::SideTooShort => write!(
                formatter,
                "squares of {seen} cm are too small; the side must be at least {expected} cm"
            ),
            FailureKind::TooManyProducts => write!(
                formatter,
                "{seen} products are more than {expected}; divide them among several maps"
            ),
            FailureKind::ProductOutside => write!(
                formatter,
                "product {seen} does not stand at a side of a square of this warehouse"
            ),
            FailureKind::Unreachable => write!(
                formatter,
                "I cannot get from ({x}, {y}) to where I must go: the ways are blocked, tried \
                 again {seen} times"
            ),
            FailureKind::ProductTwice => write!(formatter, "product number {seen} is given twice"),
            FailureKind::AlreadyOrdered => write!(formatter, "product {seen} is ordered already"),
            FailureKind::GoodsDelivered => write!(
                formatter,
                "product {seen} was delivered {expected} s ago; put it back and say \
                 `lager map back {seen}`"
            ),
            FailureKind::GoodsAway => write!(
                formatter,
                "product {seen} is not in its place, as known for {expected} s; put it back and \
                 say `lager map back {seen}`"
            ),
        }
    }
}

impl core::error::Error for Failure {}

impl fmt::Display for Remedy {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::None => "Nothing has to be done.",
            Self::Reset => {
                "Put me on the delivery node, looking into the warehouse, and press reset."
            }
            Self::Way => "I go on when a way is open.",
            Self::Map => "Send the right map.",
            Self::Later => "Order it again later.",
            Self::Hand => "Put the goods into the claw by hand and tell me that it is done.",
            Self::Light => "I go on when line frames come: look at the sensor board and the light.",
            Self::Report => "I go on when the steering board reports: look at its cable.",
            Self::Arm => "Bring the arm to where it is carried.",
            Self::Charge => "Charge the battery, or put me down anew and press reset.",
            Self::Resume => "Release the stop.",
            Self::Mode => "Give me the autonomous mode.",
            Self::Link => "I go on when the external computer is there again.",
            Self::Calibrate => {
                "Put me on the delivery node, looking into the warehouse, calibrate and press reset."
            }
            Self::PutBack => "Put the goods back in their place and say that they are there.",
        })
    }
}
