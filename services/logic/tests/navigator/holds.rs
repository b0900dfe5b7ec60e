//! Tests of the reasons for which a robot stands instead of driving: a silent board, an arm that is
//! not in the carry pose, an empty claw, a low battery, a lost link, an unknown place.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::{Input, LogicConfig, Navigator};
use lager_topics::{EventKind, Hold, InputKind, Phase, Remedy};

use crate::double::{CARRYING, Trouble};
use crate::floor::Exit;
use crate::trial::{Trial, warehouse};

const EXIT: Exit = Exit::Straight(450.0);
const SECOND: Duration = Duration::from_secs(1);

fn mission() -> Trial {
    let map = warehouse(
        (2, 1),
        (0, 0),
        45,
        &[(1, 0, Heading::Right), (0, 0, Heading::Up)],
    );
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.order(1, 1);
    trial
}

fn run_to(phase: Phase) -> Trial {
    let mut trial = mission();
    let came = trial.run_until(SECOND * 90, |trial| trial.phase() == phase);
    assert!(came, "{}", trial.story());
    trial
}

fn hold(trial: &Trial) -> Option<Hold> {
    trial.navigator.status().hold.get()
}

fn said(trial: &Trial, words: &str) -> bool {
    trial.thoughts.iter().any(|thought| thought.contains(words))
}

fn assert_stands(trial: &mut Trial, span: Duration) {
    let (x, y, angle) = (trial.body.x, trial.body.y, trial.body.angle);
    trial.run_for(span);
    assert!(trial.body.distance_to((x, y)) < 0.1, "{}", trial.story());
    assert!((trial.body.angle - angle).abs() < 0.1, "{}", trial.story());
}

/// The operator presses repeatedly that the goods are in the claw.
fn picked(trial: &mut Trial, forced: bool) {
    let order_id = trial.status.order_id;
    let kind = match forced {
        true => InputKind::PickupForced,
        false => InputKind::PickupDone,
    };
    trial.press(kind, order_id);
}

#[test]
fn a_silent_steering_board_lets_nothing_move_whatever_it_was_doing() {
    for phase in [
        Phase::Driving,
        Phase::Turning,
        Phase::Approaching,
        Phase::Positioning,
        Phase::Leaving,
        Phase::Exiting,
        Phase::BackingOff,
        Phase::TurningRound,
        Phase::Returning,
    ] {
        let mut trial = run_to(phase);
        trial.run_for(SECOND / 3);
        trial.body.silent = true;
        trial.run_for(Duration::from_millis(210));
        let order = trial.navigator.current_order().map(|order| order.code);
        assert_eq!(order, Some(1), "{phase:?}: {}", trial.story());
        assert_eq!(hold(&trial), Some(Hold::Unheard));
        trial.run_for(SECOND / 2);
        assert_stands(&mut trial, SECOND);
        assert!(said(&trial, "steering board does not report"), "{phase:?}");
        trial.body.silent = false;
        trial.deliver(1);
        assert_eq!(trial.count(EventKind::ItemDelivered), 1);
        assert_eq!(hold(&trial), Some(Hold::None));
    }
}

#[test]
fn a_robot_that_nobody_has_described_stands_and_says_so_until_a_successor_knows_it() {
    for mut trial in [mission(), run_to(Phase::Driving)] {
        trial.config.is_described = false;
        trial.kill(SECOND);
        assert_stands(&mut trial, SECOND * 10);
        assert_eq!(hold(&trial), Some(Hold::Undescribed), "{}", trial.story());
        assert_eq!(trial.status.remedy, Remedy::Describe);
        trial.config.is_described = true;
        trial.kill(SECOND);
        trial.deliver(1);
    }
}

#[test]
fn a_mission_survives_a_silence_of_the_steering_board_at_any_moment() {
    let silences = [90, 190, 230, 350, 800, 1_500].map(Duration::from_millis);
    let mut trial = mission();
    let mut count = 0;
    while trial.status.delivered == 0 {
        trial.run_for(Duration::from_millis(65));
        let mut fork = trial.clone();
        fork.body.silent = true;
        fork.run_for(silences[count % silences.len()]);
        fork.body.silent = false;
        fork.thoughts
            .push(format!("(silent at {:?})", trial.body.now));
        fork.deliver(1);
        count += 1;
    }
    assert!(count > 500, "only {count} moments");
}

#[test]
fn who_was_restarted_and_knows_no_place_waits_for_a_reset() {
    let map = warehouse((2, 1), (0, 0), 45, &[(1, 0, Heading::Right)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    put(&mut trial, (1, 1), 90.0);
    trial.navigator = Navigator::lost(LogicConfig::default());
    trial.tell(Input::Map(&map));
    trial.tell_mode();
    assert!(
        said(&trial, "nobody kept where it was"),
        "{}",
        trial.story()
    );
    trial.order(2, 1);
    let last = trial.events.last().map(|event| (event.0, event.1));
    assert_eq!(last, Some((EventKind::Refused, 2)));
    trial.run_for(SECOND);
    assert_eq!(trial.phase(), Phase::Lost);
    assert_stands(&mut trial, SECOND);

    put(&mut trial, (0, 0), 0.0);
    trial.press(InputKind::ResetPressed, 0);
    trial.order(3, 1);
    trial.deliver(1);
}

/// Puts the body down on a node.
fn put(trial: &mut Trial, (x, y): (u8, u8), angle: f64) {
    trial.body.x = f64::from(x) * 450.0;
    trial.body.y = f64::from(y) * 450.0;
    trial.body.angle = angle;
}

#[test]
fn a_robot_put_on_any_node_in_manual_mode_delivers_from_there() {
    let headings = [
        (Heading::Right, 0.0),
        (Heading::Up, 90.0),
        (Heading::Left, 180.0),
        (Heading::Down, 270.0),
    ];
    for (x, y) in [(0, 0), (2, 0), (1, 1), (0, 1)] {
        for (heading, angle) in headings {
            let mut trial = run_to(Phase::Driving);
            trial.body.autonomous = false;
            trial.tell_mode();
            trial.body.manual_duty = 100.0;
            trial.run_for(SECOND);
            trial.body.manual_duty = 0.0;
            trial.run_for(SECOND);
            assert_eq!(trial.phase(), Phase::Stuck);
            put(&mut trial, (x, y), angle);
            trial.press_at(InputKind::Placed, (x, y), heading);
            trial.body.autonomous = true;
            trial.tell_mode();
            trial.order(2, 2);
            trial.deliver(1);
        }
    }
}

#[test]
fn nobody_puts_a_driving_robot_down_nor_beside_the_map() {
    let mut trial = run_to(Phase::Approaching);
    trial.run_for(SECOND / 2);
    trial.press(InputKind::ResetPressed, 0);
    trial.press_at(InputKind::Placed, (0, 0), Heading::Up);
    assert_eq!(trial.phase(), Phase::Approaching);
    assert!(said(&trial, "nobody has put me down"), "{}", trial.story());
    trial.body.stopped = true;
    trial.tell_mode();
    trial.press_at(InputKind::Placed, (7, 0), Heading::Up);
    assert!(said(&trial, "no crossing (7, 0)"), "{}", trial.story());
    trial.body.stopped = false;
    trial.tell_mode();
    trial.deliver(1);
}

#[test]
fn an_empty_claw_is_not_believed_unless_the_operator_insists() {
    let unheard = lager_topics::SERVO_UNKNOWN;
    for (claw, load, why) in [
        (212, -20, "closed on nothing"),
        (512, 0, "does not squeeze"),
        (399, -40, "does not squeeze"),
        (unheard, 0, "not been heard"),
    ] {
        let mut trial = mission();
        (trial.body.servos[7], trial.body.claw_load) = (claw, load);
        assert!(trial.run_until(SECOND * 90, |trial| trial.phase() == Phase::Picking));
        assert!(trial.run_until(SECOND * 5, |trial| {
            trial.count(EventKind::PickupRefused) > 0
        }));
        assert!(said(&trial, why), "{}", trial.story());
        assert_eq!(trial.phase(), Phase::Picking);
        picked(&mut trial, true);
        trial.deliver(1);
    }
}

#[test]
fn goods_are_not_driven_until_every_joint_is_where_it_is_carried() {
    for (servo, name) in [(0, "base"), (1, "shoulder"), (3, "elbow"), (5, "wrist")] {
        let mut trial = run_to(Phase::Picking);
        trial.body.servos[servo] = 300;
        trial.step();
        picked(&mut trial, false);
        assert_eq!(trial.phase(), Phase::Leaving);
        assert_eq!(hold(&trial), Some(Hold::Arm));
        assert!(said(&trial, name), "{}", trial.story());
        let order = trial.navigator.current_order().unwrap();
        assert_eq!(
            (order.code, order.arm_granted),
            (1, 1),
            "a person can mend it"
        );
        // The robot still rolls to a stop.
        trial.run_for(SECOND / 2);
        assert_stands(&mut trial, SECOND * 3);
        // A successor of the navigator waits as well.
        trial.kill(Duration::from_millis(200));
        assert_stands(&mut trial, SECOND * 3);
        trial.body.servos = CARRYING;
        trial.deliver(1);
    }
}

#[test]
fn an_operator_who_insists_may_drive_with_the_arm_as_it_is() {
    let mut trial = run_to(Phase::Picking);
    trial.body.servos[1] = 300;
    trial.step();
    picked(&mut trial, true);
    trial.run_for(SECOND / 2);
    assert_eq!(hold(&trial), Some(Hold::None));
    trial.kill(Duration::from_millis(200));
    trial.deliver(1);
}

#[test]
fn with_a_low_battery_the_robot_ends_at_the_next_node_and_goes_on_when_it_is_charged() {
    for phase in [Phase::Driving, Phase::Leaving, Phase::Exiting] {
        let mut trial = run_to(phase);
        trial.body.battery = 99;
        assert!(
            trial.run_until(SECOND * 60, |trial| hold(trial) == Some(Hold::Battery)),
            "{}",
            trial.story()
        );
        assert!(said(&trial, "battery is low, 9.9 V"), "{}", trial.story());
        let side = 450.0;
        let off = [trial.body.x, trial.body.y].map(|mm| (mm - (mm / side).round() * side).abs());
        assert!(off.iter().all(|off| *off < 25.0), "at a node: {off:?}");
        trial.run_for(SECOND);
        assert_stands(&mut trial, SECOND * 5);
        trial.kill(Duration::from_millis(200));
        assert_stands(&mut trial, SECOND * 5);
        // A little more does not count as charged.
        trial.body.battery = 102;
        assert_stands(&mut trial, SECOND * 5);
        trial.body.battery = 111;
        trial.deliver(1);
    }
}

#[test]
fn without_its_link_the_robot_ends_the_edge_and_goes_on_when_it_is_back() {
    for phase in [Phase::Driving, Phase::Leaving, Phase::Exiting] {
        let mut trial = run_to(phase);
        trial.press(InputKind::LinkLost, 0);
        assert!(
            trial.run_until(SECOND * 60, |trial| hold(trial) == Some(Hold::Link)),
            "{}",
            trial.story()
        );
        let side = 450.0;
        let off = [trial.body.x, trial.body.y].map(|mm| (mm - (mm / side).round() * side).abs());
        assert!(off.iter().all(|off| *off < 25.0), "at a node: {off:?}");
        trial.run_for(SECOND);
        assert_stands(&mut trial, SECOND * 5);
        // A successor stands too, before anybody tells it about the link.
        trial.kill(Duration::from_millis(200));
        assert_stands(&mut trial, SECOND * 5);
        trial.press(InputKind::LinkBack, 0);
        trial.deliver(1);
    }
}

#[test]
fn without_its_link_no_order_is_begun_and_a_robot_that_stands_for_two_reasons_waits_for_both() {
    let mut trial = mission();
    trial.deliver(1);
    trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::WaitingForOrder);
    trial.press(InputKind::LinkLost, 0);
    trial.order(2, 2);
    trial.run_for(SECOND * 5);
    let waits = (Phase::WaitingForOrder, 1);
    let for_what = |trial: &Trial| {
        assert_eq!((trial.phase(), trial.status.waiting), waits);
        assert_eq!(Some(trial.status.hold), hold(trial).map(Into::into));
        hold(trial)
    };
    assert_eq!(for_what(&trial), Some(Hold::Link));
    trial.kill(Duration::from_millis(200));
    trial.run_for(SECOND);
    assert_eq!(for_what(&trial), Some(Hold::Link), "nobody has told it");
    trial.body.battery = 90;
    trial.run_for(SECOND * 5);
    trial.press(InputKind::LinkBack, 0);
    trial.run_for(SECOND * 5);
    assert_eq!(for_what(&trial), Some(Hold::Battery));
    trial.body.battery = 111;
    trial.deliver(2);
}

#[test]
fn a_short_dip_and_an_unknown_voltage_are_no_low_battery() {
    let mut trial = mission();
    for volts in [90, 0] {
        trial.body.battery = volts;
        trial.run_for(SECOND * 2);
        trial.body.battery = 111;
        trial.run_for(SECOND);
    }
    trial.body.battery = 0;
    trial.deliver(1);
    assert!(!said(&trial, "battery"), "{}", trial.story());
}

#[test]
fn with_a_low_battery_no_order_is_begun_until_a_person_wants_it() {
    let mut trial = mission();
    trial.deliver(1);
    trial.body.battery = 90;
    trial.run_for(SECOND * 5);
    trial.order(2, 2);
    trial.run_for(SECOND * 5);
    let told = |trial: &Trial| {
        let status = trial.navigator.status();
        (status.phase.get(), status.waiting, status.remedy.get())
    };
    let waits = (Some(Phase::WaitingForOrder), 1, Some(Remedy::Charge));
    assert_eq!(told(&trial), waits);
    trial.kill(Duration::from_millis(200));
    trial.run_for(SECOND);
    assert_eq!(told(&trial), waits);
    put(&mut trial, (0, 0), 0.0);
    trial.press(InputKind::ResetPressed, 0);
    trial.deliver(2);
}

#[test]
fn a_turn_that_went_a_quarter_wrong_is_found_out_by_the_next_mark() {
    // On the way to product 1 the robot turns at (2, 0), a border crossing.
    let map = warehouse(
        (3, 3),
        (0, 0),
        45,
        &[(2, 1, Heading::Left), (0, 0, Heading::Up)],
    );
    for wrong in [90.0, -90.0] {
        let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
        trial.order(1, 1);
        assert!(trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Turning));
        trial.run_for(SECOND);
        trial.body.end_work(lager_topics::Finish::Aborted);
        trial.body.angle += wrong;
        trial.deliver(1);
    }
}
