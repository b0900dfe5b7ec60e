//! Tests of interventions in a mission: stop, manual mode, refusals, a lost line, a moved robot.

use std::time::Duration;

use lager_floor::{Heading, Node};
use lager_logic::{Input, LogicConfig, Navigator};
use lager_orders::Mode;
use lager_topics::{EventKind, FailureKind, Finish, InputKind, Phase, Remedy, WarehouseMap};
use lager_wire::LineState;

use crate::double::{Body, Trouble};
use crate::floor::{Exit, Floor};
use crate::trial::{Trial, warehouse};

const EXIT: Exit = Exit::Straight(450.0);
const SECOND: Duration = Duration::from_secs(1);

fn mission() -> Trial {
    let products = [(0, 0, Heading::Right), (0, 0, Heading::Up)];
    let map = warehouse((1, 1), (0, 0), 45, &products);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.order(1, 1);
    trial
}

fn run_to(phase: Phase) -> Trial {
    let mut trial = mission();
    assert!(
        trial.run_until(SECOND * 90, |trial| trial.phase() == phase),
        "{}",
        trial.story()
    );
    trial
}

fn said(trial: &Trial, words: &str) -> bool {
    trial.thoughts.iter().any(|thought| thought.contains(words))
}

fn stop(trial: &mut Trial, stopped: bool) {
    trial.body.stopped = stopped;
    trial.tell_mode();
}

fn set_autonomous(trial: &mut Trial, autonomous: bool) {
    trial.body.autonomous = autonomous;
    trial.tell_mode();
}

/// Puts the robot in the place of a new one, at the start.
fn carry_to_start(trial: &mut Trial) {
    let fresh = Body::new(&trial.published, EXIT, Trouble::NONE, 3);
    (trial.body.x, trial.body.y, trial.body.angle) = (fresh.x, fresh.y, fresh.angle);
    trial.press(InputKind::ResetPressed, 0);
}

#[test]
fn a_stop_at_any_moment_holds_and_the_mission_goes_on_after_the_resume() {
    let mut trial = mission();
    while trial.status.delivered == 0 {
        trial.run_for(Duration::from_millis(85));
        let mut fork = trial.clone();
        stop(&mut fork, true);
        fork.run_for(SECOND / 2);
        assert_eq!(fork.navigator.current_order(), None);
        let (x, y) = (fork.body.x, fork.body.y);
        fork.run_for(SECOND);
        assert!(fork.body.distance_to((x, y)) < 0.1, "{}", fork.story());
        stop(&mut fork, false);
        fork.deliver(1);
        assert_eq!(fork.count(EventKind::ItemDelivered), 1, "{}", fork.story());
    }
}

#[test]
fn manual_mode_silences_logic_and_an_unmoved_robot_goes_on() {
    for phase in [
        Phase::Turning,
        Phase::Approaching,
        Phase::Picking,
        Phase::Exiting,
    ] {
        let mut trial = run_to(phase);
        set_autonomous(&mut trial, false);
        assert_eq!(trial.navigator.current_order(), None);
        trial.run_for(SECOND);
        set_autonomous(&mut trial, true);
        trial.deliver(1);
    }
}

#[test]
fn a_robot_driven_by_hand_asks_for_a_reset_and_fetches_again_after_it() {
    let mut trial = run_to(Phase::Exiting);
    set_autonomous(&mut trial, false);
    trial.body.manual_duty = 100.0;
    trial.run_for(SECOND);
    trial.body.manual_duty = 0.0;
    assert_eq!(trial.phase(), Phase::Stuck);
    assert!(said(&trial, "driven by hand"), "{}", trial.story());
    set_autonomous(&mut trial, true);
    trial.run_for(SECOND);
    assert_eq!(trial.phase(), Phase::Stuck);
    assert_eq!(trial.status.code, 1, "it stands");
    trial.order(2, 2);
    assert_eq!(
        trial.events.last().map(|event| event.0),
        Some(EventKind::Refused)
    );

    carry_to_start(&mut trial);
    let abandoned = trial.events.last().map(|event| (event.0, event.1));
    assert_eq!(abandoned, Some((EventKind::Refused, 1)));
    trial.order(3, 2);
    trial.deliver(1);
}

#[test]
fn a_robot_driven_away_from_its_goods_by_hand_does_not_leave_with_them() {
    let mut trial = run_to(Phase::Picking);
    set_autonomous(&mut trial, false);
    trial.body.manual_duty = 100.0;
    trial.run_for(SECOND / 2);
    trial.body.manual_duty = 0.0;
    set_autonomous(&mut trial, true);
    trial.run_for(SECOND * 2);
    assert_eq!(trial.phase(), Phase::Stuck, "{}", trial.story());
    let failure = trial.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::DrivenByHand, "{failure}");
}

#[test]
fn a_robot_driven_by_hand_while_its_navigator_was_away_asks_for_a_reset() {
    let mut trial = run_to(Phase::Exiting);
    set_autonomous(&mut trial, false);
    trial.run_for(SECOND / 10);
    trial.body.manual_duty = 100.0;
    trial.kill(SECOND);
    assert_eq!(trial.phase(), Phase::Stuck);
    assert!(said(&trial, "driven by hand"), "{}", trial.story());
}

#[test]
fn an_order_in_manual_mode_waits_for_the_autonomous_one() {
    let map = warehouse((1, 1), (0, 0), 45, &[(0, 0, Heading::Down)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    set_autonomous(&mut trial, false);
    trial.order(1, 1);
    trial.run_for(SECOND);
    assert_eq!(
        (trial.phase(), trial.status.waiting),
        (Phase::WaitingForOrder, 1)
    );
    set_autonomous(&mut trial, true);
    trial.deliver(1);
}

#[test]
fn refused_turns_and_drops_are_tried_again() {
    for phase in [
        Phase::Driving,
        Phase::Positioning,
        Phase::Exiting,
        Phase::BackingOff,
    ] {
        let mut trial = run_to(phase);
        trial.body.refuse = 3;
        trial.deliver(1);
        assert_eq!(trial.body.refuse, 0);
    }
}

#[test]
fn a_board_that_refuses_for_ever_is_reported() {
    let mut trial = mission();
    trial.body.refuse = u32::MAX;
    assert!(trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Stuck));
    assert!(
        said(&trial, "does not do what it is asked"),
        "{}",
        trial.story()
    );
    let tries = trial.body.begun.len();
    trial.run_for(SECOND * 10);
    assert_eq!(trial.body.begun.len(), tries, "it has given up");
}

#[test]
fn a_drive_that_is_refused_or_ignored_for_ever_is_reported_and_one_that_is_so_for_a_while_is_not() {
    for finish in [Finish::Refused, Finish::Aborted, Finish::None] {
        let mut trial = mission();
        trial.body.refuses_to_drive = Some(finish);
        trial.run_for(SECOND);
        let mut for_a_while = trial.clone();
        let gives_up = |trial: &Trial| trial.phase() == Phase::Stuck;
        assert!(
            trial.run_until(SECOND * 20, gives_up),
            "{finish:?}: {}",
            trial.story()
        );
        let failure = trial.navigator.status().failure;
        assert_eq!(
            (failure.kind.get(), failure.seen),
            (Some(FailureKind::BoardRefuses), 9)
        );
        trial.run_for(SECOND * 5);
        assert_eq!(trial.count(EventKind::Failed), 1, "{}", trial.story());

        for_a_while.body.refuses_to_drive = None;
        for_a_while.deliver(1);
    }
}

#[test]
fn who_needs_a_map_or_a_hand_says_so() {
    let remedy = |navigator: &Navigator| navigator.status().remedy.get();
    let mut navigator = Navigator::new(LogicConfig::default());
    let (mode, stopped) = (Mode::Autonomous, false);
    navigator.handle(SECOND, Input::Mode { mode, stopped });
    assert_eq!(remedy(&navigator), Some(Remedy::Map));
    let mut trial = run_to(Phase::Approaching);
    assert_eq!(remedy(&trial.navigator), Some(Remedy::None));
    assert!(trial.run_until(SECOND * 90, |trial| trial.phase() == Phase::Picking));
    assert_eq!(remedy(&trial.navigator), Some(Remedy::Hand));
    assert!(trial.run_until(SECOND * 90, |trial| trial.phase() == Phase::Leaving));
    assert_eq!(remedy(&trial.navigator), Some(Remedy::None));
}

#[test]
fn orders_that_cannot_be_carried_out_are_refused() {
    let mut trial = mission();
    let refused = |trial: &Trial| {
        trial
            .events
            .iter()
            .filter(|(kind, ..)| *kind == EventKind::Refused)
            .map(|(_, id, _)| *id)
            .collect::<Vec<_>>()
    };
    trial.run_for(SECOND);
    trial.order(2, 99);
    assert_eq!(refused(&trial), [2]);
    trial.order(1, 1);
    assert_eq!(
        refused(&trial),
        [2],
        "the order it is on, repeated, is no new one"
    );
    trial.order(3, 2);
    trial.order(3, 2);
    assert_eq!(
        refused(&trial),
        [2],
        "an order that waits, repeated, is no new one"
    );
    trial.deliver(2);
}

#[test]
fn the_signal_for_another_order_does_not_end_the_picking() {
    let mut trial = run_to(Phase::Picking);
    trial.press(InputKind::PickupDone, 77);
    assert_eq!(trial.phase(), Phase::Picking);
    trial.press(InputKind::PickupDone, 0);
    assert_eq!(trial.phase(), Phase::Leaving);
}

#[test]
fn a_lost_line_stops_the_robot() {
    let mut trial = run_to(Phase::Exiting);
    trial.body.y += 100.0;
    assert!(trial.run_until(SECOND * 10, |trial| trial.phase() == Phase::Stuck));
    assert!(said(&trial, "the line is lost"), "{}", trial.story());
    trial.run_for(SECOND);
    let (x, y) = (trial.body.x, trial.body.y);
    trial.run_for(SECOND);
    assert!(trial.body.distance_to((x, y)) < 0.1);
}

#[test]
fn a_crossing_that_does_not_come_stops_the_robot() {
    // The navigator's map has squares of half the real length.
    let map = warehouse((2, 1), (0, 0), 45, &[(1, 0, Heading::Down)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    let real = warehouse((2, 1), (0, 0), 90, &[(1, 0, Heading::Down)]);
    trial.body.floor = Floor::new(&real, EXIT);
    trial.order(1, 1);
    assert!(trial.run_until(SECOND * 20, |trial| trial.phase() == Phase::Stuck));
    assert!(said(&trial, "crossing did not come"), "{}", trial.story());
    assert!(trial.body.x < 450.0 * 1.4, "{}", trial.story());
}

#[test]
fn a_station_without_a_mark_is_looked_for_from_both_ends_and_given_up() {
    let map = warehouse((2, 2), (0, 0), 45, &[(1, 0, Heading::Left)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.body.floor = Floor::new(&warehouse((2, 2), (0, 0), 45, &[]), EXIT);
    trial.order(1, 1);
    assert!(trial.run_until(SECOND * 120, |trial| trial.phase() == Phase::Stuck));
    assert!(
        said(&trial, "mark of the pick station is not found"),
        "{}",
        trial.story()
    );
    let nodes: Vec<_> = trial
        .events
        .iter()
        .map(|(.., node)| (node.x, node.y))
        .collect();
    // The start, then near end and far end twice; at the last one it gives up.
    assert_eq!(nodes, [(0, 0), (1, 0), (1, 1), (1, 0), (1, 1), (1, 1)]);
}

#[test]
fn a_turn_past_the_pick_stations_mark_is_noticed_and_the_mark_looked_for() {
    let mut trial = run_to(Phase::Positioning);
    // The mark ends 170 mm from the edge, and the sensors are 160 mm ahead of the axle.
    trial.body.x -= 20.0;
    let seen = |trial: &Trial| said(trial, "turned past the pick station's mark");
    assert!(trial.run_until(SECOND * 10, seen), "{}", trial.story());
    trial.body.x += 20.0;
    trial.deliver(1);
    assert_eq!(trial.count(EventKind::InPosition), 1, "{}", trial.story());
}

/// A robot that was stopped half way in its turn to the goods.
fn stopped_in_the_turn_to_the_station() -> Trial {
    let mut trial = run_to(Phase::Positioning);
    trial.run_for(SECOND);
    stop(&mut trial, true);
    trial.run_for(SECOND / 2);
    trial
}

#[test]
fn a_disturbed_turn_that_passed_the_stations_mark_goes_back_to_it_or_comes_from_the_other_end() {
    let mut trial = stopped_in_the_turn_to_the_station();
    // The mark ends 170 mm from the edge, and the sensors are 160 mm ahead of the axle.
    trial.body.x -= 30.0;
    stop(&mut trial, false);
    let has_turned = |trial: &Trial| trial.status.heading == trial.status.target;
    assert!(
        trial.run_until(SECOND * 10, has_turned),
        "{}",
        trial.story()
    );
    assert_eq!(trial.phase(), Phase::Positioning, "{}", trial.story());
    let mut without = trial.clone();

    trial.body.x += 30.0;
    trial.deliver(1);
    assert_eq!(trial.count(EventKind::InPosition), 1, "{}", trial.story());

    // If the robot stays aside, it does not find the mark, and tries again from the other end.
    let goes_past = |trial: &Trial| trial.phase() == Phase::Driving;
    assert!(
        without.run_until(SECOND * 40, goes_past),
        "{}",
        without.story()
    );
    assert!(said(&without, "mark did not come"), "{}", without.story());
    without.deliver(1);
    assert_eq!(
        without.count(EventKind::InPosition),
        1,
        "{}",
        without.story()
    );
}

#[test]
fn a_station_out_of_sight_after_a_disturbed_turn_is_a_failure_that_says_so() {
    let mut trial = stopped_in_the_turn_to_the_station();
    // A person carries it to a place without tape.
    (trial.body.x, trial.body.y) = (1_000.0, 1_000.0);
    stop(&mut trial, false);
    assert!(trial.run_until(SECOND * 100, |trial| trial.phase() == Phase::Stuck));
    let failure = trial.navigator.status().failure;
    assert_eq!(
        failure.kind.get(),
        Some(FailureKind::MarkUnseen),
        "{failure}"
    );
    assert!(
        said(&trial, "does not see its mark; turns: 16"),
        "{}",
        trial.story()
    );
    assert_eq!(trial.count(EventKind::InPosition), 0, "{}", trial.story());
    carry_to_start(&mut trial);
    trial.order(3, 2);
    trial.deliver(1);
}

#[test]
fn a_silent_sensor_board_is_waited_for() {
    for phase in [Phase::Approaching, Phase::Exiting, Phase::Returning] {
        let mut trial = run_to(phase);
        trial.run_for(SECOND / 2);
        trial.body.trouble.lost = 1000;
        trial.run_for(SECOND / 2);
        let (x, y) = (trial.body.x, trial.body.y);
        trial.run_for(SECOND);
        assert!(trial.body.distance_to((x, y)) < 0.1, "{}", trial.story());
        trial.body.trouble.lost = 0;
        trial.deliver(1);
    }
}

#[test]
fn without_a_usable_map_nothing_is_done() {
    let mut navigator = Navigator::new(LogicConfig::default());
    let mut map = warehouse((1, 1), (0, 0), 0, &[(0, 0, Heading::Down)]);
    let mut hear = |map: &WarehouseMap| {
        let output = navigator.handle(SECOND, Input::Map(map));
        let phase = navigator.status().phase.get();
        (output.thought.map(|thought| thought.failure), phase)
    };
    let (thought, phase) = hear(&map);
    assert_eq!(phase, Some(Phase::WaitingForMap));
    assert_eq!(thought.unwrap().kind, FailureKind::SideUnknown);
    map.side_length_cm = 50;
    assert_eq!(hear(&map).1, Some(Phase::WaitingForOrder));
}

#[test]
fn a_new_map_is_taken_while_waiting_and_not_on_a_mission() {
    let mut trial = mission();
    trial.run_for(SECOND * 5);
    let larger = warehouse((3, 3), (3, 3), 60, &[(2, 1, Heading::Left)]);
    trial.tell(Input::Map(&larger));
    assert!(said(&trial, "keep my map"), "{}", trial.story());
    trial.deliver(1);
    trial.tell(Input::Map(&larger));
    let status = trial.navigator.status();
    assert_eq!(
        (status.x, status.y),
        (3, 3),
        "the start of the new warehouse"
    );
}

#[test]
fn a_changed_list_of_products_is_taken_on_the_way() {
    let mut trial = mission();
    trial.run_for(SECOND * 5);
    let products = [(0, 0, Heading::Right), (0, 0, Heading::Left)];
    let mut map = warehouse((1, 1), (0, 0), 45, &products);
    map.products[1].id = 5;
    trial.tell(Input::Map(&map));
    trial.order(2, 5);
    assert_eq!(trial.count(EventKind::Refused), 0, "{}", trial.story());
}

#[test]
fn the_route_leads_to_the_goal_and_gets_shorter() {
    let map = warehouse((3, 2), (0, 0), 45, &[(2, 1, Heading::Right)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.order(1, 1);
    let length = |trial: &Trial| trial.navigator.route().length;
    assert_eq!(length(&trial), 4);
    let last = trial.navigator.route().nodes()[3];
    assert_eq!((last.x, last.y), (3, 1));
    let mut before = length(&trial);
    while trial.phase() != Phase::Picking {
        trial.run_for(SECOND);
        assert!(length(&trial) <= before);
        before = length(&trial);
    }
    assert_eq!(before, 0);
    assert!(trial.run_until(SECOND * 10, |trial| trial.phase() == Phase::Leaving));
    let nodes = trial.navigator.route().nodes();
    assert_eq!((nodes[0].x, nodes[0].y), (3, 1), "back from where it came");
    assert_eq!(nodes.len(), 5);
    assert_eq!(trial.map().grid.delivery(), Node::new(0, 0));
}

#[test]
fn an_obstacle_free_distance_is_passed_on() {
    let mut trial = mission();
    trial.tell(Input::Distance(37));
    assert_eq!(trial.navigator.status().distance_cm, 37);
}

#[test]
fn it_says_whether_it_stands_at_the_start_and_a_press_that_starts_it_keeps_its_order() {
    let map = warehouse((1, 1), (0, 0), 45, &[(0, 0, Heading::Right)]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    let is_at_start = |trial: &Trial| trial.navigator.status().at_start == 1;
    assert!(!is_at_start(&trial), "it has not seen the tape");
    stop(&mut trial, true);
    trial.run_for(SECOND / 2);
    assert!(is_at_start(&trial), "{}", trial.story());

    // Somebody says that it stands elsewhere, and then that it stands at the start.
    trial.press_at(InputKind::Placed, (1, 1), Heading::Left);
    trial.run_for(SECOND / 10);
    assert!(!is_at_start(&trial));
    trial.press(InputKind::ResetPressed, 0);
    trial.run_for(SECOND / 10);
    assert!(is_at_start(&trial));

    // Beside the tape.
    let mut beside = trial.clone();
    for _ in 0..2 {
        beside.tell(Input::Line(LineState::NotOnLine));
    }
    assert!(!is_at_start(&beside));

    // It has begun an order and not moved, and the press is no reset.
    trial.order(1, 1);
    trial.run_for(SECOND / 2);
    assert!(is_at_start(&trial), "{}", trial.story());
    assert_ne!(trial.phase(), Phase::WaitingForOrder);
    trial.press(InputKind::StartPressed, 0);
    stop(&mut trial, false);
    trial.run_for(SECOND * 2);
    assert!(!is_at_start(&trial), "it has left");
    trial.deliver(1);
    assert_eq!(trial.count(EventKind::Refused), 0, "{}", trial.story());

    // Nobody knows where a navigator is whose predecessor left no state.
    let lost = Navigator::lost(LogicConfig::default());
    assert_eq!(lost.status().at_start, 0);
}
