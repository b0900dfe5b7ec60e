//! Tests with a killed navigator, whose successor has only its last published state.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::{Input, LogicConfig, Navigator};
use lager_topics::{
    BlockedWays, EventKind, FailureKind, InputKind, NavigatorStatus, OrderQueue, Phase, Remedy,
};
use lager_wire::{Command, LineState};
use proptest::prelude::*;

use crate::double::{STEP, Trouble};
use crate::floor::Exit;
use crate::trial::{SIDES, Trial, corners, missions, warehouse};

const EXIT: Exit = Exit::Straight(450.0);

fn mission(size: (u8, u8), delivery: (u8, u8), product: (u8, u8, Heading)) -> Trial {
    let map = warehouse(size, delivery, 45, &[product]);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.order(1, 1);
    trial
}

/// A successor that has nothing but the status.
fn resumed(status: &NavigatorStatus) -> Navigator {
    let (blocks, queue) = (BlockedWays::default(), OrderQueue::default());
    Navigator::resume(LogicConfig::default(), status, &blocks, &queue)
}

/// Delivers, and checks the events of the mission.
fn finish(mut trial: Trial, killed_at: Duration) {
    trial.thoughts.push(format!("(killed at {killed_at:?})"));
    trial.deliver(1);
    // An event from just before the kill may come twice, but must not be missing.
    assert!(
        trial.count(EventKind::GettingItem) >= 1,
        "{}",
        trial.story()
    );
    assert!(trial.count(EventKind::InPosition) >= 1, "{}", trial.story());
    assert!(
        trial.count(EventKind::ItemDelivered) >= 1,
        "{}",
        trial.story()
    );
}

/// Kills the navigator at every step of the mission, with outages of all lengths in turn, and with
/// a map that comes at once or late.
fn killed_everywhere(mut trial: Trial) {
    let outages = [20, 90, 130, 250, 700, 1500].map(Duration::from_millis);
    let lates = [0, 10, 45, 90, 200].map(Duration::from_millis);
    let mut kills = 0;
    while !(trial.status.delivered == 1 && trial.is_home()) {
        trial.step();
        let mut fork = trial.clone();
        fork.kill_and_introduce_late(outages[kills % outages.len()], lates[kills % lates.len()]);
        finish(fork, trial.body.now);
        kills += 1;
        assert!(
            trial.body.now < Duration::from_secs(120),
            "{}",
            trial.story()
        );
    }
    assert!(kills > 4000, "only {kills} steps");
}

#[test]
fn a_mission_with_a_right_turn_survives_a_kill_at_every_step() {
    killed_everywhere(mission((1, 1), (0, 0), (0, 0, Heading::Up)));
}

#[test]
fn a_mission_with_a_left_turn_survives_a_kill_at_every_step() {
    killed_everywhere(mission((1, 1), (0, 1), (0, 0, Heading::Right)));
}

#[test]
fn a_status_goes_through_a_navigator_unchanged() {
    let mut trial = mission((2, 1), (2, 0), (0, 0, Heading::Left));
    while trial.status.delivered == 0 {
        trial.run_for(STEP * 7);
        // The values of a navigator that knows no mode yet and no distance.
        let status = NavigatorStatus {
            stopped: 1,
            mode: lager_orders::Mode::Manual.into(),
            remedy: Remedy::Mode.into(),
            distance_cm: 255,
            ..trial.navigator.status()
        };
        let again = resumed(&status).status();
        // A successor does not know the exact number of a setpoint.
        let order = Command::from_code(status.code).unwrap();
        let left_out = u32::from(!order.is_one_shot());
        assert_eq!(
            NavigatorStatus {
                stopped: 1,
                command_id: again.command_id - left_out,
                ..again
            },
            status
        );
    }
}

#[test]
fn a_waiting_order_survives() {
    let products = [(0, 0, Heading::Up), (0, 0, Heading::Right)];
    let map = warehouse((1, 1), (0, 0), 45, &products);
    let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
    trial.order(1, 1);
    trial.run_for(Duration::from_secs(3));
    trial.order(2, 2);
    trial.kill(Duration::from_millis(400));
    trial.deliver(2);
    let delivered = |id| {
        trial
            .events
            .iter()
            .any(|(kind, order, _)| *kind == EventKind::ItemDelivered && *order == id)
    };
    assert!(delivered(1) && delivered(2), "{}", trial.story());
}

#[test]
fn an_order_that_waits_for_its_mode_survives_whatever_is_told_first() {
    for mode_first in [false, true] {
        let map = warehouse((1, 1), (0, 0), 45, &[(0, 0, Heading::Up)]);
        let mut trial = Trial::new(map, EXIT, Trouble::NONE, 3);
        trial.body.autonomous = false;
        trial.tell_mode();
        trial.order(4, 1);
        assert_eq!((trial.status.waiting, trial.status.order_id), (1, 0));
        trial.navigator = Navigator::resume(
            LogicConfig::default(),
            &trial.status,
            &BlockedWays::default(),
            &trial.queue,
        );
        trial.body.autonomous = true;
        if mode_first {
            trial.tell_mode();
        }
        trial.tell(Input::Map(&map));
        trial.tell_mode();
        assert_eq!(trial.status.order_id, 4, "{}", trial.story());
    }
}

#[test]
fn a_granted_arm_stays_granted() {
    let mut trial = mission((1, 1), (0, 0), (0, 0, Heading::Down));
    assert!(
        trial.run_until(Duration::from_secs(60), |trial| trial.phase()
            == Phase::Picking)
    );
    trial.kill(Duration::from_millis(300));
    let order = trial.navigator.current_order().unwrap();
    assert_eq!((order.code, order.arm_granted), (1, 1));
}

#[test]
fn two_frames_of_noise_around_a_kill_are_not_the_cross_bar() {
    let mut trial = mission((1, 1), (0, 0), (0, 0, Heading::Down));
    let on_its_way_out = |trial: &Trial| {
        trial.phase() == Phase::Exiting && trial.navigator.status().travelled_mm > 100
    };
    assert!(trial.run_until(Duration::from_secs(60), on_its_way_out));
    trial.tell(Input::Line(LineState::FourWay));
    trial.run_for(Duration::from_millis(5));
    trial.status = trial.navigator.status();
    trial.kill(Duration::from_millis(100));
    trial.run_for(Duration::from_millis(50));
    trial.tell(Input::Line(LineState::NotOnLine));
    assert_eq!(trial.phase(), Phase::Exiting, "{}", trial.story());
    trial.deliver(1);
}

#[test]
fn order_ids_go_on_after_the_old_ones() {
    let mut trial = mission((1, 1), (0, 0), (0, 0, Heading::Up));
    trial.run_for(Duration::from_secs(6));
    let before = trial.status.command_id;
    trial.kill(Duration::from_millis(300));
    trial.run_for(Duration::from_millis(100));
    assert!(
        trial.status.command_id >= before,
        "{} < {before}",
        trial.status.command_id
    );
}

#[test]
fn without_the_map_nothing_is_ordered() {
    let mut trial = mission((1, 1), (0, 0), (0, 0, Heading::Up));
    trial.run_for(Duration::from_secs(6));
    let navigator = resumed(&trial.status);
    assert_eq!(navigator.current_order(), None);
}

#[test]
fn a_status_that_makes_no_sense_is_as_good_as_none() {
    let nonsense = NavigatorStatus {
        x: -4,
        delivered: 9,
        ..NavigatorStatus::default()
    };
    let status = resumed(&nonsense).status();
    assert_eq!(
        (status.phase.get(), status.delivered),
        (Some(Phase::Lost), 0)
    );
}

/// Orders a product; each pair of `kills` has the ms until a kill and the ms of its outage.
fn killed(mut trial: Trial, kills: impl IntoIterator<Item = (u64, u64)>) -> Trial {
    trial.order(1, 1);
    for (after, outage) in kills {
        trial.run_for(Duration::from_millis(after));
        trial.kill(Duration::from_millis(outage));
        trial.thoughts.push("(killed)".to_owned());
    }
    trial
}

/// Two robots on their way back, pushed aside just before the delivery corner. They pass it without
/// seeing its mark, which on their side of the line is too short for the sensors.
fn beside_their_lines() -> [Trial; 2] {
    let robot = |size, delivery, product, aside_mm: f64| {
        let map = warehouse(size, delivery, 50, &[product]);
        let mut trial = Trial::new(map, Exit::Straight(600.0), Trouble::NONE, 761);
        trial.order(1, 1);
        let nears_corner =
            |trial: &Trial| trial.phase() == Phase::Returning && trial.body.x > -200.0;
        assert!(
            trial.run_until(Duration::from_secs(400), nears_corner),
            "{}",
            trial.story()
        );
        trial.body.y = f64::from(trial.map().grid.delivery().y) * 500.0 + aside_mm;
        trial
    };
    let (below, left) = ((0, 1, Heading::Down), (1, 1, Heading::Left));
    [
        robot((1, 2), (0, 0), below, -24.0),
        robot((2, 2), (0, 2), left, 24.0),
    ]
}

#[test]
fn a_robot_that_has_not_seen_the_delivery_corner_drives_on_to_the_next_and_comes_home() {
    for mut trial in beside_their_lines() {
        trial.deliver(1);
        let drove_on = |thought: &String| thought.contains("the mark of the delivery corner");
        assert!(trial.thoughts.iter().any(drove_on), "{}", trial.story());
    }
}

#[test]
fn a_robot_that_has_not_seen_the_delivery_corner_says_so_where_the_way_on_is_blocked() {
    for mut trial in beside_their_lines() {
        let grid = &trial.map().grid;
        let (node, heading) = (grid.delivery(), grid.exit().back());
        trial.press_at(InputKind::WayBlocked, (node.x, node.y), heading);
        assert!(
            trial.run_until(Duration::from_secs(30), |trial| trial.phase()
                == Phase::Stuck)
        );
        let failure = trial.navigator.status().failure;
        assert_eq!(failure.kind, FailureKind::CornerUnseen, "{failure}");
        assert_eq!(failure.remedy, Remedy::Reset);
    }
}

proptest! {
    #![proptest_config(missions(200))]

    #[test]
    fn a_mission_with_many_kills_under_trouble_is_delivered(
        (width, height) in (1u8..4, 1u8..4),
        corner in 0usize..4,
        square in (0u8..4, 0u8..4),
        side in 0usize..4,
        gains in (0.98f64..1.02, 0.98f64..1.02),
        kills in prop::collection::vec((2_000u64..25_000, 20u64..1200), 1..6),
        seed in 1u64..1000,
    ) {
        let product = (square.0 % width, square.1 % height, SIDES[side]);
        let delivery = corners((width, height))[corner];
        let trouble = Trouble { frame_ms: 10, lost: 20, noise: 2, gains };
        let map = warehouse((width, height), delivery, 50, &[product]);
        let trial = Trial::new(map, Exit::Straight(600.0), trouble, seed);
        killed(trial, kills).deliver(1);
    }
}
