//! What a person does to the robot: `operator/input`; and how the bus carries an operator's action, as
//! such an input for logic, as a request to the bridge, or as a request to the simulated world.

use lager_floor::Heading;
use lager_orders::{Action, Pick, Put};
use lager_sample::{Tag, coded, payload};

use super::request::{Ask, AskKind, WorldAsk, WorldAskKind};

coded! {
    /// An action of a person at the robot or at the station.
    pub enum InputKind {
        /// The goods are in the gripper (L7).
        PickupDone = 0,
        /// The reset button was pressed (B1): the robot has been put on the delivery node, looking
        /// into the warehouse.
        ResetPressed = 1,
        /// The robot has been put on node (`x`, `y`), looking along `heading`.
        Placed = 2,
        /// The goods are in the gripper, whether or not the gripper feels them.
        PickupForced = 3,
        /// Cancel the order `order_id`, which waits or whose goods are not held yet.
        OrderCancelled = 4,
        /// Move the waiting order `order_id` one place forward.
        OrderMovedUp = 5,
        /// Cancel all waiting orders.
        QueueCleared = 6,
        /// The external computer is out of reach, and the robot must stand at the next node.
        LinkLost = 7,
        /// The external computer is in reach again.
        LinkBack = 8,
        /// The switch of the robot has been moved to manual mode.
        SwitchedToManual = 9,
        /// The switch of the robot has been moved to autonomous mode.
        SwitchedToAutonomous = 10,
        /// A person picks the goods up from now on ([`Pick::Manual`](lager_orders::Pick)).
        PickByHand = 11,
        /// The robot picks the goods up by itself from now on ([`Pick::Auto`](lager_orders::Pick)).
        PickByItself = 12,
        /// The goods of a product are not in their place; `order_id` is the product's number.
        GoodsGone = 13,
        /// The goods are in their place again; [`Input::ALL_GOODS`] = all goods are.
        GoodsBack = 14,
        /// Sound the horn.
        Horn = 15,
        /// Something stands on the way from node (`x`, `y`) along `heading`.
        WayBlocked = 16,
        /// Nothing stands on that way any more.
        WayOpened = 17,
        /// In an earlier run of the robot, the goods of a product were not in their place; `order_id`
        /// is the product's number.
        GoodsGoneEarlier = 18,
        /// The reset button was pressed on a robot that stood on the delivery node already, to end
        /// the stop of a fresh start. Its place and its orders stay.
        StartPressed = 19,
    }
}

payload! {
    /// Input of a person.
    pub struct Input: 12 bytes {
        /// What the person did.
        pub kind: Tag<InputKind>,
        /// Column of the node on which the robot was put, or where the way begins.
        pub x: u8,
        /// Row of that node.
        pub y: u8,
        /// Where the robot looks that was put down, or where the way leads.
        pub heading: Tag<Heading>,
        /// The order that it concerns, 0 = none; for goods, the product's number.
        pub order_id: u32,
        /// Distinguishes this input from another one; a repeated sample has the same number.
        pub id: u32,
    }
}

impl Input {
    /// The `order_id` of [`InputKind::GoodsBack`] that means all goods. No product has this number,
    /// because products' numbers are not negative.
    pub const ALL_GOODS: u32 = u32::MAX;

    /// The input that tells logic of `action`; `under_way` is the order that logic carries out.
    /// `None` if the action is not for logic.
    pub fn of(action: Action, under_way: u32) -> Option<Self> {
        let (kind, order_id) = match action {
            Action::Cancel { order } => (InputKind::OrderCancelled, order),
            Action::First { order } | Action::Up { order } => (InputKind::OrderMovedUp, order),
            Action::Clear => (InputKind::QueueCleared, 0),
            Action::Back { product } => {
                let number = product.map_or(Self::ALL_GOODS, |id| id.get().cast_unsigned());
                (InputKind::GoodsBack, number)
            }
            Action::Reset => (InputKind::ResetPressed, 0),
            Action::Place(_) => (InputKind::Placed, 0),
            Action::Picked { force: false } => (InputKind::PickupDone, under_way),
            Action::Picked { force: true } => (InputKind::PickupForced, under_way),
            Action::Pick(Pick::Manual) => (InputKind::PickByHand, 0),
            Action::Pick(Pick::Auto) => (InputKind::PickByItself, 0),
            Action::Horn => (InputKind::Horn, 0),
            _ => return None,
        };
        let mut input = Self {
            kind: kind.into(),
            order_id,
            ..Self::default()
        };
        if let Action::Place(on) = action {
            (input.x, input.y, input.heading) = (on.node.x, on.node.y, on.heading.into());
        }
        Some(input)
    }
}

impl Ask {
    /// The request that asks the bridge for `action`; `None` if the action is not for the bridge.
    pub fn of(action: Action) -> Option<Self> {
        let kind = |kind: AskKind| Self {
            kind: kind.into(),
            ..Self::default()
        };
        Some(match action {
            Action::Mode(mode) => Self {
                mode: mode.into(),
                ..kind(AskKind::SetMode)
            },
            Action::Resume { stop } => Self {
                stop_word: stop,
                ..kind(AskKind::Resume)
            },
            Action::Gains { p, d } => Self {
                gain_p: p,
                gain_d: d,
                ..kind(AskKind::SetGains)
            },
            Action::Calibrate => kind(AskKind::Calibrate),
            Action::Restart(board) => Self {
                board: board.into(),
                ..kind(AskKind::Restart)
            },
            _ => return None,
        })
    }
}

impl WorldAsk {
    /// The request that asks the simulated world for `action`; `None` if the action is not for it.
    pub fn of(action: Action) -> Option<Self> {
        let (kind, on) = match action {
            Action::Place(on) => (WorldAskKind::Place, on),
            Action::Obstacle { put: Put::Put, way } => (WorldAskKind::Put, way),
            Action::Obstacle {
                put: Put::Take,
                way,
            } => (WorldAskKind::Take, way),
            _ => return None,
        };
        Some(Self {
            kind: kind.into(),
            x: on.node.x,
            y: on.node.y,
            heading: on.heading.into(),
            ..Self::default()
        })
    }
}
