//! Whatever fails, the motors are off within 200 ms of chip time.

use std::time::Duration;

use lager_emulator::chip::ResetLine;
use lager_emulator::rig::Board;
use lager_wire::{Payload, ResetCause, Setting, SettingKey, SteerFlags, WheelCommand};

use crate::support::{Robot, milliseconds};

const LIMIT: Duration = Duration::from_millis(200);

#[test]
fn the_pi_falls_silent() {
    let mut robot = Robot::driving(1);
    robot.steering.fall_silent();
    let silent = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(400));
    let took = off.expect("the motors went off") - silent;
    assert!(took <= milliseconds(200), "{took} cycles");
    assert_eq!(robot.rig.duties(), [0, 0]);
    assert!(robot.report().flags.contains(SteerFlags::FAILSAFE));
    assert_eq!(robot.rig.chip(Board::Steering).resets(), 0);
}

#[test]
fn the_cable_is_cut() {
    let mut robot = Robot::driving(2);
    robot.rig.cut(Board::Steering, true);
    let cut = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(400));
    assert!(off.expect("the motors went off") - cut <= milliseconds(200));
}

#[test]
fn the_stream_lives_but_nobody_renews_the_command() {
    let mut robot = Robot::driving(3);
    robot.steering.fall_silent();
    let last = robot.rig.cycle();
    robot.rig.take_motor_changes();
    for seq in 0..40 {
        let setting = Setting {
            key: SettingKey::GainP,
            seq,
            value: 2,
        };
        robot
            .steering
            .send(&mut robot.rig, Payload::Setting(setting));
        robot.run(Duration::from_millis(10));
    }
    let changes = robot.rig.take_motor_changes();
    let off = changes.iter().find(|change| change.duties == [0, 0]);
    assert!(off.expect("the motors went off").cycle - last <= milliseconds(200));
    assert_eq!(robot.rig.duties(), [0, 0]);
}

#[test]
fn a_renewal_takes_it_up_again() {
    let mut robot = Robot::driving(4);
    robot.steering.fall_silent();
    robot.run(Duration::from_millis(300));
    assert_eq!(robot.rig.duties(), [0, 0]);
    robot.wheels(WheelCommand::ManualForward);
    robot.run(Duration::from_millis(300));
    assert_eq!(robot.rig.duties(), [100, 100], "and stays, renewed");
}

#[test]
fn the_steering_boards_main_loop_hangs() {
    let mut robot = Robot::driving(5);
    robot.rig.hang(Board::Steering);
    let hung = robot.rig.cycle();
    // The watchdog's interrupt switches the motors off; the reset comes after it.
    while robot.rig.duties() != [0, 0] {
        robot.run(Duration::from_millis(1));
        assert_eq!(robot.rig.chip(Board::Steering).resets(), 0);
    }
    let took = robot.rig.cycle() - hung;
    assert!(took <= milliseconds(200), "{took} cycles");
    robot.run(Duration::from_millis(600));
    assert_eq!(robot.rig.chip(Board::Steering).resets(), 1);
    let (_, up) = robot.steering.ups.last().copied().expect("it was up");
    assert_eq!((up.rebooted, up.reset), (true, ResetCause::Watchdog));
}

#[test]
fn the_steering_boards_main_loop_hangs_with_interrupts_off() {
    let mut robot = Robot::driving(8);
    robot.rig.hang_with_interrupts_off(Board::Steering);
    let hung = robot.rig.cycle();
    // The watchdog's interrupt cannot run; its second time-out resets the chip.
    let off = robot.run_until_off(LIMIT);
    let took = off.expect("the motors went off") - hung;
    assert!(took <= milliseconds(200), "{took} cycles");
    assert_eq!(robot.rig.chip(Board::Steering).resets(), 1);
    robot.run(Duration::from_millis(600));
    let (_, up) = robot.steering.ups.last().copied().expect("it was up");
    assert_eq!((up.rebooted, up.reset), (true, ResetCause::Watchdog));
}

#[test]
fn the_sensor_boards_main_loop_hangs() {
    let mut robot = Robot::up(6);
    robot.place(0.0);
    robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(100));
    assert_ne!(robot.rig.duties(), [0, 0]);
    robot.rig.hang(Board::Sensor);
    let hung = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(250));
    assert!(off.expect("no line, no motion") - hung <= milliseconds(200));
    robot.run(Duration::from_millis(600));
    let (_, up) = robot.sensor.ups.last().copied().expect("it was up");
    assert_eq!((up.rebooted, up.reset), (true, ResetCause::Watchdog));
    assert_eq!(
        robot.rig.duties(),
        [0, 0],
        "the words are back, but following was given up"
    );
    robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(100));
    assert_ne!(robot.rig.duties(), [0, 0]);
}

#[test]
fn the_tape_is_gone() {
    let mut robot = Robot::up(9);
    robot.place(0.0);
    let seq = robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(500));
    assert_ne!(robot.rig.duties(), [0, 0]);
    // Bare floor, farther than the robot drives.
    robot.place(200.0);
    let gone = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(2_500));
    let took = off.expect("the motors went off") - gone;
    assert!(
        (milliseconds(2_000)..=milliseconds(2_200)).contains(&took),
        "{took} cycles"
    );
    let report = robot.report();
    let stopped = SteerFlags::FAILSAFE
        .with(SteerFlags::ABORTED)
        .with(SteerFlags::EXDE_OK);
    assert!(report.flags.contains(stopped), "{report:?}");
    assert_eq!(report.finished_seq, seq);
    // A renewal and tape do not start the robot; only another command does.
    robot.place(0.0);
    robot.rig.take_motor_changes();
    robot.run(Duration::from_millis(1_000));
    assert_eq!(robot.rig.take_motor_changes(), []);
    robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(100));
    assert_ne!(robot.rig.duties(), [0, 0]);
    assert!(!robot.report().flags.contains(SteerFlags::FAILSAFE));
}

#[test]
fn a_reset_in_the_middle_of_driving() {
    let mut robot = Robot::driving(7);
    robot.rig.take_motor_changes();
    robot.rig.reset(Board::Steering, ResetLine::External);
    assert_eq!(robot.rig.duties(), [0, 0], "at once");
    // The Pi still renews its old order. The restarted board carries it out when both have shaken
    // hands, and never before.
    robot.run(Duration::from_millis(66));
    let before = robot.rig.take_motor_changes();
    assert_eq!(before.len(), 1, "{before:?}");
}
