//! What only a station hears and orders that speaks the extension.

mod asked;
mod commissioned;
mod driven;
mod late;
mod ordered;
mod reported;

use lager_orders::{Mode, Reason};
use lager_topics::{
    BridgeAnswer, Finish, MapProduct, OrderQueue, Origin, Outcome, Phase, SteeringReport,
    WaitingOrder, WarehouseMap,
};

use crate::robot::Robot;

/// A robot that knows its warehouse and has a station that speaks the extension.
pub(super) fn extended(mode: Mode) -> Robot {
    let mut map = WarehouseMap {
        width: 4,
        height: 3,
        side_length_cm: 40,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 7,
        ..MapProduct::default()
    };
    let mut robot = Robot::with_map(mode, Some(map));
    robot.does(Phase::WaitingForOrder, None);
    robot.connect();
    robot.hears(&["lager 1 station"]);
    robot
}

/// Passes time with a station that gives its sign of life.
pub(super) fn pass(robot: &mut Robot, milliseconds: u64) -> Vec<String> {
    let mut said = Vec::new();
    for _ in 0..milliseconds / 10 {
        said.extend(robot.pass(10));
        said.extend(robot.hears(&["lager 1 station"]));
    }
    said.retain(|line| line != "lager 1 r1" && !line.starts_with("[renews"));
    said
}

/// The board says that the order given last is in force.
pub(super) fn in_force(robot: &mut Robot) -> Vec<String> {
    let report = SteeringReport {
        current_id: robot.steered.expect("an order").0,
        current_origin: Origin::Operator.into(),
        left_duty: 100,
        right_duty: 100,
        ..SteeringReport::default()
    };
    robot.reports(&report)
}

pub(super) fn ended(robot: &mut Robot, finish: Finish) -> Vec<String> {
    let report = SteeringReport {
        finished_id: robot.steered.expect("an order").0,
        finished_origin: Origin::Operator.into(),
        finish: finish.into(),
        ..SteeringReport::default()
    };
    robot.reports(&report)
}

pub(super) fn queue(waiting: &[u32]) -> OrderQueue {
    let mut queue = OrderQueue {
        order_id: 1,
        product: 7,
        under_way: 1,
        count: waiting.len() as u8,
        ..OrderQueue::default()
    };
    for (place, id) in queue.orders.iter_mut().zip(waiting) {
        *place = WaitingOrder {
            id: *id,
            product: 7,
            ..WaitingOrder::default()
        };
    }
    queue
}

pub(super) fn done(outcome: Outcome) -> Result<BridgeAnswer, Reason> {
    Ok(BridgeAnswer {
        outcome: outcome.into(),
        ..BridgeAnswer::default()
    })
}
