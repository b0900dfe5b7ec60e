//! Tests of robots with imperfections: what the boards learn about them, and where it matters.

use core::f64::consts::{FRAC_PI_2, PI};
use lager_floor::Node;

use lager_plant::{Floor, NamedProduct, Obstacle, Warehouse};
use lager_simulator::{CalibrateError, Robot, RobotOptions, Wire, calibrate};
use lager_wire::{Command, LineState, ResetCause, WheelCommand};

use crate::pi::{Pi, ms};

/// A robot of this seed with both links up.
fn varied(warehouse: &Warehouse, seed: u64) -> Pi {
    let options = RobotOptions {
        seed,
        ..RobotOptions::default()
    };
    let mut pi = Pi::new(warehouse, options);
    pi.until(ms(1_000), Pi::is_up);
    pi
}

fn without_goods(size: Node, side_length_cm: u16) -> Warehouse {
    Warehouse {
        size,
        side_length_cm,
        products: Vec::<NamedProduct>::new(),
        ..Warehouse::builtin("small").unwrap()
    }
}

#[test]
fn whatever_the_motors_are_a_line_is_followed_without_weaving() {
    for seed in 1..=20 {
        let mut pi = varied(&without_goods(Node::new(1, 1), 400), seed);
        pi.place(300.0, 10.0, 0.0);
        pi.wheels(WheelCommand::ActiveForward);
        pi.run(ms(36_000));
        let pose = pi.pose();
        assert!(
            pose.x > 1_900.0 && pose.x < 3_900.0,
            "seed {seed}: {pose:?}"
        );
        let lateral = pi.robot.world().worst_lateral_mm();
        assert!(
            lateral > 0.0 && lateral < 15.0,
            "E15, seed {seed}: {lateral} mm"
        );
    }
}

#[test]
fn a_turn_stays_on_its_place_once_the_sides_are_known_also_after_a_restart() {
    for (seed, restarts) in (1..=20).flat_map(|seed| [(seed, false), (seed, true)]) {
        let mut pi = varied(&without_goods(Node::new(4, 1), 50), seed);
        pi.wheels(WheelCommand::ActiveForward);
        // After two nodes the board has learnt how unequal the two sides are.
        pi.until(ms(40_000), |pi| pi.pose().x > 1_500.0);
        pi.wheels(WheelCommand::Standby);
        pi.run(ms(500));
        if restarts {
            pi.robot.reset_board(Wire::Steering, ResetCause::BrownOut);
            pi.run(ms(500));
        }
        pi.place(1_500.0, 0.0, 0.0);
        pi.carry_out(Command::Wheel(WheelCommand::LeftPerp), ms(6_000));
        pi.run(ms(500));
        let pose = pi.pose();
        let moved = (pose.x - 1_500.0).hypot(pose.y);
        let turned = pose.heading.to_degrees();
        assert!(moved < 15.0, "seed {seed}, {restarts}: {moved} mm");
        assert!(
            (turned - 90.0).abs() < 8.0,
            "seed {seed}, {restarts}: {turned}"
        );
    }
}

#[test]
fn a_full_and_an_empty_battery_drive_at_nearly_the_same_speed() {
    for seed in 1..=10 {
        let way = |charge: f64| {
            let mut pi = varied(&without_goods(Node::new(1, 1), 400), seed);
            pi.robot.world_mut().set_battery_charge(charge);
            pi.place(300.0, 0.0, 0.0);
            pi.wheels(WheelCommand::ActiveForward);
            pi.run(ms(10_000));
            let decivolts = pi.heard.steer.unwrap().battery_decivolts;
            (pi.pose().x - 300.0, decivolts)
        };
        let ((full, full_volts), (empty, empty_volts)) = (way(1.0), way(0.08));
        assert!(full_volts > empty_volts + 10, "{full_volts} {empty_volts}");
        assert!(
            (full / empty - 1.0).abs() < 0.25,
            "seed {seed}: {full} {empty}"
        );
    }
}

#[test]
fn a_person_drives_every_robot_at_three_speeds_on_any_battery() {
    let mm_per_s = |seed, charge, command| {
        let mut pi = varied(&without_goods(Node::new(1, 1), 400), seed);
        pi.robot.world_mut().set_battery_charge(charge);
        pi.place(1_000.0, 0.0, 0.0);
        pi.wheels(command);
        pi.run(ms(500));
        let from = pi.pose();
        pi.run(ms(4_000));
        let to = pi.pose();
        (to.x - from.x).hypot(to.y - from.y) / 4.0
    };
    let mut least = [f64::MAX; 3];
    let mut most = [0.0_f64; 3];
    for seed in 1..=20 {
        for charge in [1.0, 0.08] {
            for ways in [
                [
                    WheelCommand::SlowForward,
                    WheelCommand::MiddleForward,
                    WheelCommand::ManualForward,
                ],
                [
                    WheelCommand::SlowBackward,
                    WheelCommand::MiddleBackward,
                    WheelCommand::ManualBackward,
                ],
            ] {
                let speeds = ways.map(|command| mm_per_s(seed, charge, command));
                for (index, speed) in speeds.into_iter().enumerate() {
                    least[index] = least[index].min(speed);
                    most[index] = most[index].max(speed);
                }
                let [slow, middle, full] = speeds;
                let part = |speed: f64, part: f64| (speed / full / part - 1.0).abs() < 0.15;
                assert!(part(slow, 0.25), "seed {seed}: {slow} of {full}");
                assert!(part(middle, 0.5), "seed {seed}: {middle} of {full}");
            }
        }
    }
    println!("slow, middle, full: {least:.0?} to {most:.0?} mm/s");
    assert!(least[0] > 10.0, "{least:?}");
}

#[test]
fn a_body_that_is_driven_into_an_obstacle_stops_and_is_counted() {
    let mut warehouse = without_goods(Node::new(2, 1), 60);
    warehouse.obstacles.push(Obstacle {
        between: [Node::new(1, 0), Node::new(2, 0)],
    });
    let mut pi = varied(&warehouse, 3);
    pi.place(500.0, 0.0, 0.0);
    pi.wheels(WheelCommand::ActiveForward);
    pi.run(ms(15_000));
    assert_eq!(pi.robot.world().collisions(), 1);
    assert_eq!(pi.robot.truth().world.collisions, 1);
    // The obstacle's face is at 860 mm, and the body reaches 170 mm ahead of the axle.
    assert!((pi.pose().x - 690.0).abs() < 3.0, "{:?}", pi.pose());
    let pose = pi.pose();
    pi.place(pose.x - 100.0, 0.0, PI);
    pi.wheels(WheelCommand::ManualForward);
    pi.run(ms(2_000));
    assert!(pi.pose().x < 560.0, "it leaves");
}

#[test]
fn a_weak_contrast_is_seen_once_the_sensors_are_calibrated() {
    let floor = |white, tape| Warehouse {
        floor: Floor { white, tape },
        ..Warehouse::builtin("small").unwrap()
    };
    for seed in 1..=10 {
        let options = RobotOptions {
            seed,
            ..RobotOptions::default()
        };
        let seen = |robot: Robot| {
            let mut pi = Pi::around(robot);
            pi.until(ms(16_000), Pi::is_up);
            pi.run(ms(300));
            pi.heard.states.last().unwrap().1
        };
        let weak = floor(45, 115);
        let robot = Robot::new(&weak, options).unwrap();
        assert_eq!(seen(robot), LineState::NotOnLine, "seed {seed}");
        let mut robot = Robot::new(&weak, options).unwrap();
        let start = robot.world().pose();
        calibrate(&mut robot).unwrap();
        assert_eq!(robot.world().pose(), start);
        assert_eq!(seen(robot), LineState::OnLine, "seed {seed}");
    }
    let mut robot = Robot::new(&floor(90, 110), RobotOptions::default()).unwrap();
    let refused = calibrate(&mut robot).unwrap_err();
    assert_eq!(refused, CalibrateError::NoContrast { channels: 0 });
    assert!(refused.to_string().contains("darker tape"));
}

#[test]
fn rangers_of_all_seeds_see_an_obstacle_in_time() {
    let mut warehouse = without_goods(Node::new(2, 1), 50);
    warehouse.obstacles.push(Obstacle {
        between: [Node::new(1, 0), Node::new(1, 1)],
    });
    for seed in 1..=20 {
        let mut pi = varied(&warehouse, seed);
        pi.place(500.0, 0.0, FRAC_PI_2);
        pi.run(ms(500));
        let cm = pi.heard.distance.expect("it measures");
        // 110 mm from the ranger to the obstacle's face.
        assert!((10..=17).contains(&cm), "seed {seed}: {cm} cm");
    }
}
