//! What happens when something breaks.

use lager_plant::Warehouse;
use lager_simulator::{Robot, RobotOptions, Wire};
use lager_wire::{Command, ResetCause, SteerFlags, WheelCommand};

use crate::pi::{Pi, ms};

fn driving() -> Pi {
    let mut pi = Pi::in_builtin("large");
    pi.wheels(WheelCommand::ManualForward);
    pi.run(ms(500));
    assert_eq!(pi.robot.truth().duties, [100, 100]);
    pi
}

/// How long the motors still had duty, in ms.
fn until_off(pi: &mut Pi) -> u128 {
    let start = pi.robot.now();
    pi.until(ms(1_000), |pi| pi.robot.truth().duties == [0, 0]);
    (pi.robot.now() - start).as_millis()
}

#[test]
fn silence_stops_the_motors_within_two_hundred_milliseconds() {
    let mut pi = driving();
    pi.fall_silent();
    let off = until_off(&mut pi);
    // 150 ms after the last command, which was at most 40 ms ago.
    assert!((100..200).contains(&off), "{off} ms");
    pi.run(ms(100));
    assert!(pi.heard.steer.unwrap().flags.contains(SteerFlags::FAILSAFE));
    pi.wheels(WheelCommand::ManualForward);
    pi.run(ms(50));
    assert_eq!(pi.robot.truth().duties, [100, 100]);
}

#[test]
fn a_cut_cable_stops_the_motors_and_a_mended_one_goes_on() {
    let mut pi = driving();
    pi.robot.cut(Wire::Steering, true);
    let off = until_off(&mut pi);
    assert!(off < 200, "{off} ms");
    pi.run(ms(1_500));
    assert!(!pi.is_up());
    pi.robot.cut(Wire::Steering, false);
    pi.until(ms(1_000), Pi::is_up);
}

#[test]
fn a_reset_board_comes_back_and_says_why() {
    for (wire, cause) in [
        (Wire::Sensor, ResetCause::BrownOut),
        (Wire::Steering, ResetCause::External),
    ] {
        let mut pi = driving();
        let before = pi.heard.ups.len();
        pi.robot.reset_board(wire, cause);
        if wire == Wire::Steering {
            assert_eq!(pi.robot.truth().duties, [0, 0], "at once");
        }
        pi.until(ms(1_000), |pi| pi.heard.ups.len() > before);
        let (up_wire, up) = pi.heard.ups[before];
        assert_eq!((up_wire, up.reset, up.rebooted), (wire, cause, true));
        pi.heard.statuses.clear();
        pi.until(ms(1_000), |pi| {
            pi.heard.statuses.iter().any(|(of, _)| *of == wire)
        });
        let (_, status) = pi
            .heard
            .statuses
            .iter()
            .find(|(of, _)| *of == wire)
            .unwrap();
        assert_eq!(status.reset, cause);
        assert_eq!(pi.lost(), 0, "a reset is not a loss");
    }
}

#[test]
fn a_hung_program_is_ended_by_its_watchdog_with_the_motors_off() {
    let mut pi = driving();
    let before = pi.heard.ups.len();
    pi.robot.hang_board(Wire::Steering);
    let off = until_off(&mut pi);
    // Looked at every few milliseconds.
    assert!((40..=71).contains(&off), "{off} ms");
    pi.until(ms(1_000), |pi| pi.heard.ups.len() > before);
    assert_eq!(pi.heard.ups[before].1.reset, ResetCause::Watchdog);
}

#[test]
fn a_silent_sensor_board_stops_following() {
    let mut pi = Pi::in_builtin("large");
    pi.wheels(WheelCommand::ActiveForward);
    pi.run(ms(1_000));
    assert_ne!(pi.robot.truth().duties, [0, 0]);
    pi.robot.hang_board(Wire::Sensor);
    pi.run(ms(120));
    assert_eq!(pi.robot.truth().duties, [0, 0]);
    // Its watchdog brings the sensor board back, but what has ended does not begin by itself.
    pi.run(ms(1_000));
    assert_eq!(pi.robot.truth().duties, [0, 0]);
    pi.wheels(WheelCommand::ActiveForward);
    pi.until(ms(1_000), |pi| pi.robot.truth().duties != [0, 0]);
}

#[test]
fn noise_on_the_cable_moves_nothing_and_is_counted() {
    let mut pi = Pi::in_builtin("small");
    let mut noise = lager_plant::noise::Noise::new(4, 4);
    for _ in 0..2_000 {
        let bytes: Vec<u8> = (0..16).map(|_| noise.bits() as u8).collect();
        pi.robot.write(Wire::Steering, &bytes);
        pi.robot.disturb_pi(Wire::Sensor, &bytes);
        pi.run(ms(1));
        assert_eq!(pi.robot.truth().duties, [0, 0]);
    }
    pi.run(ms(1_200));
    let steering = pi
        .heard
        .statuses
        .iter()
        .filter(|(wire, _)| *wire == Wire::Steering);
    assert!(
        steering
            .max_by_key(|(_, status)| status.bad_packets)
            .unwrap()
            .1
            .bad_packets
            > 0
    );
    pi.until(ms(1_000), Pi::is_up);
    let flags = pi.carry_out(Command::Wheel(WheelCommand::LeftDiag), ms(3_000));
    assert!(!flags.contains(SteerFlags::ABORTED));
}

#[test]
fn a_missing_servo_is_flagged_and_the_others_work() {
    let mut pi = Pi::in_builtin("small");
    // Until the first standby the arm is locked.
    pi.wheels(WheelCommand::Standby);
    pi.run(ms(2_000));
    assert_eq!(pi.heard.steer.unwrap().servo_errors, 0);
    pi.robot.world_mut().servos().set_present(7, false);
    pi.until(ms(3_000), |pi| {
        pi.heard.steer.unwrap().servo_errors == 1 << 6
    });
    let before = pi.robot.truth().world.servo_positions[0];
    pi.arm(lager_wire::ArmCommand::Left, 4);
    assert_eq!(pi.robot.truth().world.servo_positions[0], before + 12);
}

#[test]
fn a_warehouse_that_cannot_be_built_is_refused() {
    let mut warehouse = Warehouse::builtin("small").unwrap();
    warehouse.delivery = [1, 1];
    let refused = Robot::new(&warehouse, RobotOptions::default()).unwrap_err();
    assert!(refused.to_string().contains("corner"));
}
