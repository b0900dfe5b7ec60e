//! Tests of the handshake, of line following and turns, and of the sensors' reports meanwhile.

use core::f64::consts::{FRAC_PI_2, PI};

use lager_floor::{Heading, Node};
use lager_plant::{NamedProduct, Obstacle, Warehouse};
use lager_simulator::Wire;
use lager_wire::{Callsign, Command, LineState, SteerFlags, WheelCommand};

use crate::pi::{Pi, ms};

/// A long straight line: nodes at x = 0 and x = 4000.
fn long() -> Warehouse {
    Warehouse {
        size: Node::new(1, 1),
        side_length_cm: 400,
        products: Vec::new(),
        ..Warehouse::builtin("small").unwrap()
    }
}

#[test]
fn both_boards_say_who_they_are_and_then_report() {
    let mut pi = Pi::in_builtin("small");
    let mut callsigns: Vec<_> = pi
        .heard
        .ups
        .iter()
        .map(|(wire, up)| (*wire, up.callsign))
        .collect();
    callsigns.sort_by_key(|(_, callsign)| callsign.code());
    assert_eq!(
        callsigns,
        [
            (Wire::Sensor, Callsign::Sensor),
            (Wire::Steering, Callsign::Steering)
        ]
    );
    pi.run(ms(1_000));
    assert_eq!(pi.lost(), 0);
    // 200 sensor packets and 200 reports a second, and besides them servos and statuses.
    assert!(
        (380..450).contains(&pi.heard.packets),
        "{}",
        pi.heard.packets
    );
    assert!(pi.heard.servos.iter().all(Option::is_some));
    assert!(pi.heard.steer.unwrap().flags.contains(SteerFlags::EXDE_OK));
}

#[test]
fn the_boards_work_at_the_originals_baud_rate() {
    let options = lager_simulator::RobotOptions {
        baud: 9_600,
        ..Default::default()
    };
    let mut pi = Pi::new(&long(), options);
    pi.until(ms(2_000), Pi::is_up);
    pi.wheels(WheelCommand::ActiveForward);
    pi.run(ms(5_000));
    assert_eq!(pi.lost(), 0);
    assert!(
        pi.pose().x > 250.0 && pi.pose().y.abs() < 5.0,
        "{:?}",
        pi.pose()
    );
}

#[test]
fn following_settles_on_the_line_from_twenty_millimetres_beside() {
    for seed in 1..=8 {
        for side in [1.0, -1.0] {
            let mut pi = Pi::started(&long(), seed);
            pi.place(300.0, 20.0 * side, 0.0);
            pi.wheels(WheelCommand::ActiveForward);
            let mut track: Vec<(f64, f64)> = Vec::new();
            pi.watch(ms(20_000), |pi| {
                let pose = pi.pose();
                track.push((pose.x - 300.0, pose.y * side));
            });
            let worst = |from: f64, to: f64| {
                track
                    .iter()
                    .filter(|(x, _)| (from..to).contains(x))
                    .map(|(_, y)| y.abs())
                    .fold(0.0, f64::max)
            };
            let overshoot = track.iter().map(|(_, y)| -y).fold(0.0, f64::max);
            println!(
                "seed {seed} side {side}: overshoot {overshoot:.1} mm, |y| at 250-500 mm {:.1}, 500-1000 mm {:.1}, 1000-1300 mm {:.1}",
                worst(250.0, 500.0),
                worst(500.0, 1_000.0),
                worst(1_000.0, 1_300.0)
            );
            assert!(track.last().unwrap().0 > 1_300.0, "drives at 73 mm/s");
            assert!(overshoot < 6.0, "E15: overshoot {overshoot} mm");
            assert!(worst(500.0, 1_300.0) < 5.0, "E15: weaves");
        }
    }
}

#[test]
fn a_turn_at_a_crossing_ends_on_tape_a_quarter_further() {
    for seed in 1..=8 {
        for (command, quarter) in [
            (WheelCommand::LeftPerp, 1.0),
            (WheelCommand::RightPerp, -1.0),
        ] {
            for heading in [0.0, FRAC_PI_2, PI] {
                let mut pi = Pi::started(&Warehouse::builtin("small").unwrap(), seed);
                pi.place(500.0, 500.0, heading);
                let flags = pi.carry_out(Command::Wheel(command), ms(4_000));
                pi.run(ms(500));
                let turned = (pi.pose().heading - heading).to_degrees() * quarter;
                println!(
                    "seed {seed} {command:?} from {:.0}: {turned:.2}",
                    heading.to_degrees()
                );
                assert!(!flags.contains(SteerFlags::ABORTED));
                assert!((turned - 90.0).abs() < 3.5, "{turned}");
                assert_ne!(pi.heard.states.last().unwrap().1, LineState::NotOnLine);
                assert_eq!(pi.robot.truth().duties, [0, 0]);
            }
        }
    }
}

/// The line states that a robot meets on its way, without the follower's deviations. Each lasts at
/// least 50 ms, because a crossing passed at an angle shows one half for a moment.
fn met(pi: &mut Pi, x: f64, y: f64, heading: f64, time: u64) -> Vec<LineState> {
    pi.place(x, y, heading);
    pi.run(ms(50));
    pi.heard.states.clear();
    pi.wheels(WheelCommand::ActiveForward);
    pi.run(ms(time));
    let ends = pi
        .heard
        .states
        .iter()
        .skip(1)
        .map(|(at, _)| *at)
        .chain([pi.robot.now()]);
    let lasting = pi
        .heard
        .states
        .iter()
        .zip(ends)
        .filter(|((from, _), to)| *to - *from >= ms(50));
    let mut states: Vec<_> = lasting
        .map(|((_, state), _)| *state)
        .filter(|state| !matches!(state, LineState::LeftOfLine | LineState::RightOfLine))
        .collect();
    states.dedup();
    states
}

#[test]
fn a_mark_is_told_on_its_side_and_a_crossing_on_both() {
    use LineState::{FourWay, OnLine, StationToLeft, StationToRight};
    let mut warehouse = Warehouse::builtin("small").unwrap();
    warehouse.size = Node::new(3, 3);
    warehouse.products = vec![NamedProduct {
        id: 1,
        name: None,
        square: Node::new(1, 1),
        side: Heading::Down,
    }];
    let mut pi = Pi::started(&warehouse, 1);
    // Along y = 500 from x = 550: the station of square (1, 1) at 750, the crossing at 1000.
    assert_eq!(
        met(&mut pi, 550.0, 500.0, 0.0, 4_500),
        [OnLine, StationToLeft, OnLine, FourWay, OnLine]
    );
    assert_eq!(
        met(&mut pi, 1_450.0, 500.0, PI, 13_000),
        [
            OnLine,
            FourWay,
            OnLine,
            StationToRight,
            OnLine,
            FourWay,
            OnLine
        ]
    );
}

#[test]
fn a_border_crossing_looks_like_a_mark() {
    use LineState::{OnLine, StationToLeft, StationToRight};
    let mut warehouse = Warehouse::builtin("small").unwrap();
    warehouse.products.clear();
    let mut pi = Pi::started(&warehouse, 2);
    assert_eq!(
        met(&mut pi, 200.0, 0.0, 0.0, 5_000),
        [OnLine, StationToLeft, OnLine]
    );
    assert_eq!(
        met(&mut pi, 200.0, 1_000.0, 0.0, 5_000),
        [OnLine, StationToRight, OnLine]
    );
}

#[test]
fn where_the_line_ends_the_kind_of_end_is_told() {
    use LineState::{DropStation, FourWay, NotOnLine, OnLine, StationToLeft, StationToRight};
    let mut warehouse = Warehouse::builtin("small").unwrap();
    warehouse.products.clear();
    let mut pi = Pi::started(&warehouse, 3);
    // A corner: only the way to the left continues.
    let corner = met(&mut pi, 700.0, 0.0, 0.0, 3_500);
    assert_eq!(corner, [OnLine, StationToLeft, NotOnLine]);
    let corner = met(&mut pi, 700.0, 1_000.0, 0.0, 3_500);
    assert_eq!(corner, [OnLine, StationToRight, NotOnLine]);
    // The border seen from inside: ways to both sides, and none straight ahead.
    let border = met(&mut pi, 700.0, 500.0, 0.0, 3_500);
    assert_eq!(border, [OnLine, FourWay, DropStation]);
    // The delivery bar, 800 mm outside.
    let bar = met(&mut pi, -300.0, 0.0, PI, 6_000);
    assert_eq!(bar, [OnLine, FourWay, DropStation]);
}

#[test]
fn every_exit_can_be_followed_to_its_bar() {
    use lager_plant::{Curve, Exit};
    for seed in 1..=4 {
        for (curve, radius_cm) in [
            (Curve::Straight, 25),
            (Curve::Left, 25),
            (Curve::Right, 25),
            (Curve::S, 25),
            (Curve::S, 40),
        ] {
            let mut warehouse = Warehouse::builtin("small").unwrap();
            warehouse.exit = Exit {
                length_cm: 130,
                curve,
                radius_cm,
            };
            let mut pi = Pi::started(&warehouse, seed);
            pi.place(0.0, 0.0, PI);
            pi.run(ms(20));
            pi.heard.states.clear();
            pi.wheels(WheelCommand::ActiveForward);
            pi.until(ms(20_000), |pi| {
                pi.heard
                    .states
                    .last()
                    .is_some_and(|(_, state)| *state == LineState::DropStation)
            });
            let bar = pi.robot.world().tape().bar();
            let pose = pi.pose();
            let (ahead, left) = (
                (pose.x - bar.x) * bar.heading.cos() + (pose.y - bar.y) * bar.heading.sin(),
                (pose.y - bar.y) * bar.heading.cos() - (pose.x - bar.x) * bar.heading.sin(),
            );
            println!(
                "seed {seed} {curve:?} {radius_cm} cm: axle {ahead:.0} mm ahead, {left:.1} mm left of \
                 the bar's middle, {:.1} degrees",
                (pose.heading - bar.heading).to_degrees()
            );
            assert!((-165.0..-135.0).contains(&ahead), "{curve:?}: {ahead}");
            assert!(left.abs() < 25.0, "{curve:?}: {left}");
            assert!(
                pi.heard
                    .states
                    .iter()
                    .all(|(_, state)| *state != LineState::NotOnLine)
            );
        }
    }
}

#[test]
fn an_obstacle_is_told_at_its_distance() {
    let mut warehouse = long();
    warehouse.obstacles.push(Obstacle {
        between: [Node::new(0, 0), Node::new(1, 0)],
    });
    let mut pi = Pi::started(&warehouse, 1);
    // The obstacle's face is at x = 1960 mm, and the ranger 100 mm ahead of the axle.
    for (centimetres, tolerance) in [(12, 1), (20, 1), (35, 2), (60, 4), (75, 8)] {
        pi.place(1_860.0 - 10.0 * f64::from(centimetres), 0.0, 0.0);
        pi.run(ms(150));
        let told = pi.heard.distance.expect("it is in range");
        assert!(
            told.abs_diff(centimetres) <= tolerance,
            "{centimetres} cm told as {told}"
        );
    }
    pi.place(400.0, 0.0, 0.0);
    pi.run(ms(150));
    assert_eq!(pi.heard.distance, None);
    pi.place(1_860.0 - 50.0, 0.0, 0.0);
    pi.run(ms(150));
    assert_eq!(
        pi.heard.distance,
        Some(10),
        "never less than the ranger can measure"
    );
}
