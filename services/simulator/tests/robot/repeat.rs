//! Tests that a seed always makes the same robot, however the caller divides the time.

use lager_plant::Warehouse;
use lager_simulator::{Robot, RobotOptions, Wire};
use lager_wire::{ArmCommand, Command, WheelCommand};

use crate::pi::{Pi, ms};

/// A short run with driving, turning and a step of the arm; returns all bytes of both boards.
fn life(seed: u64) -> Vec<u8> {
    let mut pi = Pi::started(&Warehouse::builtin("curved").unwrap(), seed);
    pi.wheels(WheelCommand::ActiveForward);
    pi.run(ms(6_000));
    pi.carry_out(Command::Wheel(WheelCommand::RightPerp), ms(5_000));
    pi.wheels(WheelCommand::Standby);
    pi.run(ms(300));
    pi.arm(ArmCommand::Left, 3);
    pi.heard.bytes
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let first = life(11);
    assert!(first.len() > 40_000, "{}", first.len());
    assert_eq!(first, life(11));
    assert_ne!(first, life(12));
}

#[test]
fn time_may_be_cut_in_any_way() {
    let warehouse = Warehouse::builtin("small").unwrap();
    let run = |step_us: u64| {
        let mut robot = Robot::new(&warehouse, RobotOptions::default()).unwrap();
        let mut bytes = [Vec::new(), Vec::new()];
        let end = ms(1_500);
        while robot.now() < end {
            let next = robot.now() + core::time::Duration::from_micros(step_us);
            robot.advance_to(next.min(end));
            robot.read(Wire::Sensor, &mut bytes[0]);
            robot.read(Wire::Steering, &mut bytes[1]);
        }
        (bytes, robot.truth())
    };
    let whole = run(1_500_000);
    assert!(!whole.0[0].is_empty());
    for step_us in [7, 333, 5_000] {
        assert_eq!(run(step_us), whole, "{step_us} us");
    }
}
