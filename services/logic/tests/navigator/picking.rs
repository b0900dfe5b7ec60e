//! Tests of a robot that picks by itself: it grips the goods, aims elsewhere if it grips nothing,
//! and reports the goods as missing in the end.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::LogicConfig;
use lager_orders::Pick;
use lager_topics::{EventKind, FailureKind, Hold, InputKind, Phase, Remedy};
use lager_wire::Command;

use crate::double::{CARRYING, Trouble};
use crate::floor::Exit;
use crate::trial::{Trial, warehouse};

const SECOND: Duration = Duration::from_secs(1);

/// A robot whose base must be at `goods_at` to grip the goods; `None` = there are no goods.
fn at_the_goods(goods_at: Option<u16>) -> Trial {
    let config = LogicConfig {
        pick: Pick::Auto,
        ..LogicConfig::default()
    };
    let map = warehouse((1, 1), (0, 0), 45, &[(0, 0, Heading::Up)]);
    let mut trial = Trial::with(config, map, Exit::Straight(450.0), Trouble::NONE, 3);
    trial.body.goods_at = goods_at;
    trial.order(1, 1);
    let came = trial.run_until(SECOND * 90, |trial| trial.phase() == Phase::Picking);
    assert!(came, "{}", trial.story());
    trial
}

#[test]
fn goods_ahead_or_to_either_side_are_picked_and_delivered() {
    for at in [512, 533, 491, 554, 470] {
        let mut trial = at_the_goods(Some(at));
        let order = trial.navigator.current_order().unwrap();
        assert_eq!(order.arm_granted, 0, "the arm is the robot's own");
        trial.deliver(1);
        assert_eq!(trial.count(EventKind::ItemDelivered), 1);
    }
}

/// Brings a robot that leaves picking to a person to its goods.
fn waiting_at_the_goods() -> Trial {
    let map = warehouse((1, 1), (0, 0), 45, &[(0, 0, Heading::Up)]);
    let config = LogicConfig::default();
    let mut trial = Trial::with(config, map, Exit::Straight(450.0), Trouble::NONE, 3);
    trial.body.goods_at = Some(512);
    trial.order(1, 1);
    let came = trial.run_until(SECOND * 90, |trial| trial.phase() == Phase::Picking);
    assert!(came, "{}", trial.story());
    // The claw is empty.
    trial.body.claw_load = 0;
    trial.run_for(SECOND / 5);
    trial
}

fn grants_the_arm(trial: &Trial) -> bool {
    trial.navigator.current_order().unwrap().arm_granted != 0
}

#[test]
fn who_picks_may_change_while_it_waits_at_the_goods_and_outlives_the_navigator() {
    let mut trial = waiting_at_the_goods();
    assert!(grants_the_arm(&trial));
    trial.kill(SECOND / 5);
    trial.run_for(SECOND / 5);
    assert!(
        grants_the_arm(&trial),
        "nobody has told the successor to pick"
    );
    trial.press(InputKind::PickByItself, 0);
    trial.run_for(SECOND / 5);
    assert!(!grants_the_arm(&trial), "the arm is the robot's own");
    trial.kill(SECOND / 5);
    assert_eq!(trial.navigator.status().pick, Pick::Auto);
    // A person who changes the way of picking does not stop the arm half-way.
    trial.run_for(SECOND / 2);
    trial.press(InputKind::PickByHand, 0);
    let left = trial.run_until(SECOND * 60, |trial| trial.phase() != Phase::Picking);
    assert!(left, "{}", trial.story());
    assert_eq!(trial.navigator.status().pick, Pick::Manual);
}

#[test]
fn goods_that_a_person_holds_in_the_claw_are_not_put_down_to_be_picked_again() {
    let mut trial = waiting_at_the_goods();
    trial.body.claw_load = -311;
    trial.run_for(SECOND / 5);
    trial.press(InputKind::PickByItself, 0);
    trial.run_for(SECOND / 10);
    assert!(grants_the_arm(&trial), "they are the person's to hand over");
}

#[test]
fn where_there_is_nothing_a_hand_is_waited_for() {
    let mut trial = at_the_goods(None);
    let gave_up = trial.run_until(SECOND * 300, |trial| {
        !trial.navigator.status().failure.is_none()
    });
    assert!(gave_up, "{}", trial.story());
    let failure = trial.navigator.status().failure;
    assert_eq!(
        (failure.kind.get(), failure.remedy.get(), failure.seen),
        (Some(FailureKind::GoodsMissing), Some(Remedy::Hand), 5)
    );
    assert_eq!(trial.count(EventKind::Failed), 1);
    assert_eq!(trial.phase(), Phase::Picking);
    // A successor does not begin again, and a person may move the arm.
    trial.kill(SECOND / 5);
    trial.run_for(SECOND);
    let order = trial.navigator.current_order().unwrap();
    assert_eq!((order.code, order.arm_granted), (1, 1));
    trial.body.servos = CARRYING;
    trial.body.claw_load = -311;
    trial.run_for(SECOND / 5);
    let order_id = trial.status.order_id;
    trial.press(InputKind::PickupDone, order_id);
    assert!(trial.navigator.status().failure.is_none());
    trial.deliver(1);
}

/// Disturbs copies of the trial with `harm` at moments that are `apart` from each other, and lets
/// each copy deliver. Returns the number of moments.
fn harmed_at_any_moment(
    mut trial: Trial,
    apart: Duration,
    goes_on: impl Fn(&Trial) -> bool,
    harm: impl Fn(&mut Trial, Duration),
) -> usize {
    let outages = [20, 90, 130, 250, 700].map(Duration::from_millis);
    let mut moments = 0;
    while goes_on(&trial) {
        let mut fork = trial.clone();
        harm(&mut fork, outages[moments % outages.len()]);
        fork.thoughts
            .push(format!("(harmed at {:?})", trial.body.now));
        fork.deliver(1);
        moments += 1;
        trial.run_for(apart);
    }
    moments
}

fn picks(trial: &Trial) -> bool {
    trial.phase() == Phase::Picking
}

#[test]
fn picking_survives_a_kill_at_any_moment() {
    let trial = at_the_goods(Some(533));
    let moments = harmed_at_any_moment(trial, SECOND / 28, picks, Trial::kill);
    assert!(moments > 100, "only {moments} moments");
}

#[test]
fn picking_survives_a_restart_of_the_steering_board_at_any_moment() {
    let trial = at_the_goods(Some(533));
    let restart = |trial: &mut Trial, _| trial.body.restart_board();
    let moments = harmed_at_any_moment(trial, SECOND / 10, picks, restart);
    assert!(moments > 50, "only {moments} moments");
}

#[test]
fn picking_survives_a_restart_of_the_board_that_the_navigator_does_not_live_to_see() {
    let trial = at_the_goods(Some(533));
    let restart = |trial: &mut Trial, outage| {
        trial.body.restart_board();
        trial.kill(outage);
    };
    let moments = harmed_at_any_moment(trial, SECOND / 10, picks, restart);
    assert!(moments > 50, "only {moments} moments");
}

#[test]
fn refused_and_aborted_steps_are_given_again() {
    let mut trial = at_the_goods(Some(512));
    trial.run_for(SECOND);
    trial.body.refuse = 3;
    trial.run_for(SECOND * 2);
    trial.body.end_work(lager_topics::Finish::Aborted);
    trial.deliver(1);
    assert_eq!(trial.body.refuse, 0);
}

#[test]
fn an_arm_that_never_obeys_ends_in_a_failure() {
    let mut trial = at_the_goods(Some(512));
    trial.body.refuse = u32::MAX;
    let gave_up = trial.run_until(SECOND * 30, |trial| {
        trial.navigator.status().failure.kind == FailureKind::BoardRefuses
    });
    assert!(gave_up, "{}", trial.story());
}

/// A robot that has found nothing at product 1, with its arm over the empty shelf. Then that order
/// is cancelled. The next one is for product 2, which is there.
fn sent_away_from_nothing() -> Trial {
    let config = LogicConfig {
        pick: Pick::Auto,
        ..LogicConfig::default()
    };
    let products = [(0, 0, Heading::Up), (0, 0, Heading::Right)];
    let map = warehouse((1, 1), (0, 0), 45, &products);
    let mut trial = Trial::with(config, map, Exit::Straight(450.0), Trouble::NONE, 3);
    trial.order(1, 1);
    let gave_up = trial.run_until(SECOND * 400, |trial| {
        trial.navigator.status().failure.kind == FailureKind::GoodsMissing
    });
    assert!(gave_up, "{}", trial.story());
    trial.run_for(SECOND / 5);
    trial.press(InputKind::OrderCancelled, 1);
    trial.order(2, 2);
    trial.body.goods_at = Some(512);
    trial
}

fn is_folded(trial: &Trial) -> bool {
    let off = |at: usize| trial.body.servos[at].abs_diff(CARRYING[at]);
    [0, 1, 3].into_iter().all(|servo| off(servo) <= 20)
}

#[test]
fn an_arm_that_found_nothing_is_brought_back_by_the_robot_before_it_leaves() {
    let mut trial = sent_away_from_nothing();
    assert!(!is_folded(&trial), "{:?}", trial.body.servos);
    assert_eq!(trial.phase(), Phase::Leaving);
    let turned = trial.body.begun.len();
    let is_turn =
        |code: &u8| Command::from_code(*code).is_some_and(|it| !matches!(it, Command::Arm(_)));
    while !is_folded(&trial) {
        assert!(
            !trial.body.begun[turned..].iter().any(is_turn),
            "{}",
            trial.story()
        );
        let order = trial.navigator.current_order().unwrap();
        let moves_arm = matches!(Command::from_code(order.code), Some(Command::Arm(_)));
        assert!(
            !moves_arm || order.arm_granted == 0,
            "the arm is the robot's own"
        );
        trial.step();
        assert!(trial.body.now < SECOND * 500, "{}", trial.story());
    }
    trial.deliver(1);
    assert_eq!(trial.count(EventKind::ItemDelivered), 1);
}

#[test]
fn an_arm_on_its_way_back_survives_a_kill_at_any_moment() {
    let folds = |trial: &Trial| trial.phase() == Phase::Leaving && !is_folded(trial);
    let trial = sent_away_from_nothing();
    let moments = harmed_at_any_moment(trial, SECOND / 28, folds, Trial::kill);
    assert!(moments > 20, "only {moments} moments");
}

#[test]
fn an_arm_that_does_not_come_back_is_left_to_a_hand() {
    let mut trial = sent_away_from_nothing();
    trial.run_for(SECOND / 2);
    trial.body.refuse = u32::MAX;
    trial.run_for(SECOND * 10);
    let (status, order) = (
        trial.navigator.status(),
        trial.navigator.current_order().unwrap(),
    );
    assert_eq!(status.hold, Hold::Arm, "{}", trial.story());
    assert_eq!((order.code, order.arm_granted), (1, 1), "{}", trial.story());
    trial.body.refuse = 0;
    trial.body.servos = CARRYING;
    trial.deliver(1);
}
