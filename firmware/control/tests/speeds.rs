//! The speeds at which a person drives: what the motors get, what is told, and what ends it.

mod support;

use lager_control::Motor;
use lager_wire::{Payload, SteerFlags, WheelCommand};
use support::Bench;

const OFF: (Motor, Motor) = (Motor::OFF, Motor::OFF);
const AHEAD: (Motor, Motor) = (Motor::forward(100), Motor::forward(100));
const BACK: (Motor, Motor) = (Motor::backward(100), Motor::backward(100));
const LEFT: (Motor, Motor) = (Motor::backward(100), Motor::forward(100));
const RIGHT: (Motor, Motor) = (Motor::forward(100), Motor::backward(100));

/// Each command with its duties, and the part of the time in which the motors get them, in quarters.
const COMMANDS: [(WheelCommand, (Motor, Motor), u32); 12] = [
    (WheelCommand::SlowForward, AHEAD, 1),
    (WheelCommand::MiddleForward, AHEAD, 2),
    (WheelCommand::ManualForward, AHEAD, 4),
    (WheelCommand::SlowBackward, BACK, 1),
    (WheelCommand::MiddleBackward, BACK, 2),
    (WheelCommand::ManualBackward, BACK, 4),
    (WheelCommand::SlowLeft, LEFT, 1),
    (WheelCommand::MiddleLeft, LEFT, 2),
    (WheelCommand::ManualLeft, LEFT, 4),
    (WheelCommand::SlowRight, RIGHT, 1),
    (WheelCommand::MiddleRight, RIGHT, 2),
    (WheelCommand::ManualRight, RIGHT, 4),
];

/// The duties, whatever the direction.
fn duties((left, right): (Motor, Motor)) -> (u8, u8) {
    (left.duty, right.duty)
}

#[test]
fn each_speed_powers_the_motors_for_its_part_of_the_time_and_tells_the_mean() {
    for (command, motors, quarters) in COMMANDS {
        let mut bench = Bench::ready();
        bench.command(command.code());
        assert_eq!(bench.pins.motors, motors, "{command:?} begins at once");
        let mut powered = 0;
        bench.pi.packets.clear();
        for _ in 0..800 {
            bench.run_ms(1);
            let is_powered = bench.pins.motors == motors;
            assert!(is_powered || duties(bench.pins.motors) == (0, 0));
            powered += u32::from(is_powered);
        }
        let wanted = 200 * quarters;
        assert!(powered.abs_diff(wanted) <= 20, "{command:?}: {powered} ms");
        let mean = 25 * quarters as u8;
        let told = bench.pi.all(|payload| match payload {
            Payload::SteerData(data) => Some(data),
            _ => None,
        });
        assert!(told.len() > 50);
        for (_, report) in told {
            assert_eq!((report.left_duty, report.right_duty), (mean, mean));
            assert_eq!(report.code, command.code());
            assert_eq!(
                report.flags.contains(SteerFlags::LEFT_REVERSE),
                motors.0.reverse
            );
            assert!(report.flags.contains(SteerFlags::ARM_LOCKED));
        }
    }
}

#[test]
fn a_stop_and_the_end_of_the_lease_stand_at_every_speed_and_in_every_moment() {
    for (command, _, _) in COMMANDS {
        // In a pulse, and in the pause after it.
        for moment in [0, 10, 30, 50, 70, 90] {
            let mut bench = Bench::ready();
            bench.command(command.code());
            bench.run_ms(moment);
            bench.command(WheelCommand::Standby.code());
            assert_eq!(bench.pins.motors, OFF, "{command:?} after {moment} ms");
            bench.pins.motor_log.clear();
            bench.run_ms(500);
            assert_eq!(bench.pins.motor_log, [], "no pulse comes after it");

            bench.command(command.code());
            bench.run_ms(moment);
            bench.renewed = None;
            bench.run_ms(200);
            assert_eq!(bench.pins.motors, OFF, "{command:?}: the command is old");
            assert!(bench.report().flags.contains(SteerFlags::FAILSAFE));
            let report = bench.report();
            assert_eq!((report.left_duty, report.right_duty), (0, 0));
            bench.pins.motor_log.clear();
            bench.run_ms(500);
            assert_eq!(bench.pins.motor_log, []);
        }
    }
}

#[test]
fn another_speed_counts_at_once_and_a_renewal_begins_no_new_pulse() {
    let mut bench = Bench::ready();
    bench.command(WheelCommand::SlowForward.code());
    bench.run_ms(30);
    assert_eq!(duties(bench.pins.motors), (0, 0), "in the pause");
    bench.command(WheelCommand::ManualForward.code());
    assert_eq!(bench.pins.motors, AHEAD);
    bench.run_ms(500);
    assert_eq!(bench.pins.motors, AHEAD, "full speed has no pauses");
    bench.command(WheelCommand::SlowForward.code());
    bench.pins.motor_log.clear();
    // The bench renews the command every 40 ms.
    bench.run_ms(400);
    let pulses = bench.pins.motor_log.iter();
    let pulses = pulses.filter(|(_, motors)| *motors == AHEAD).count();
    assert!((4..=5).contains(&pulses), "{pulses}");
}
