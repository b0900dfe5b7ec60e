//! Tests that the robot picks goods up and drops them, by commands.

use core::f64::consts::{FRAC_PI_2, PI};

use lager_plant::GoodState;
use lager_plant::Snapshot;
use lager_simulator::Robot;
use lager_wire::{ArmCommand, Command, SteerFlags, WheelCommand};

use crate::pi::{Pi, ms};

/// Steps of the arm from its carrying pose down to goods on a shelf 250 mm ahead of the axle.
const OUT: usize = 30;
const DOWN: usize = 97;

/// A robot that has picked up product 1 and carries it.
fn loaded() -> Pi {
    let mut pi = Pi::in_builtin("small");
    // It has turned at the station: axle 7 mm off the edge's line, claw over the mark.
    pi.place(755.0, 5.0, FRAC_PI_2);
    pi.wheels(WheelCommand::Standby);
    pi.run(ms(200));
    pi.arm(ArmCommand::Release, 1);
    pi.arm(ArmCommand::Out, OUT);
    pi.arm(ArmCommand::Down, DOWN);
    let claw = pi.robot.world().claw();
    println!("claw before the squeeze: {claw:?}");
    pi.arm(ArmCommand::Squeeze, 1);
    assert_eq!(pi.robot.truth().carrying, Some(1));
    pi.arm(ArmCommand::Up, DOWN);
    pi.arm(ArmCommand::In, OUT);
    pi
}

fn state(truth: &Snapshot) -> GoodState {
    truth.world.goods[0].state
}

#[test]
fn goods_are_picked_up_and_dropped_at_the_bar() {
    let mut pi = loaded();
    let gripper = pi.heard.servos[7].unwrap();
    assert!(
        gripper.position > 300,
        "held open by the goods: {gripper:?}"
    );
    assert!(gripper.load < -200, "pressing: {gripper:?}");
    assert_eq!(state(&pi.robot.truth()), GoodState::Held);
    assert!(
        pi.robot.truth().world.goods[0].position[2] > 200.0,
        "lifted"
    );

    // In front of the delivery bar, as after following the exit.
    pi.place(-640.0, 0.0, PI);
    let flags = pi.carry_out(Command::Arm(ArmCommand::Drop), ms(15_000));
    assert!(!flags.contains(SteerFlags::ABORTED));
    assert_eq!(state(&pi.robot.truth()), GoodState::Delivered);
    assert_eq!(pi.robot.truth().carrying, None);
}

#[test]
fn goods_let_go_elsewhere_lie_there() {
    let mut pi = loaded();
    pi.arm(ArmCommand::Release, 1);
    let truth = pi.robot.truth();
    assert_eq!(state(&truth), GoodState::Lying);
    assert_eq!(truth.world.goods[0].position[2], 25.0);
}

#[test]
fn a_kept_world_is_taken_up_with_what_is_held() {
    let mut pi = loaded();
    pi.wheels(WheelCommand::ManualForward);
    pi.run(ms(400));
    let before = pi.robot.truth();
    let warehouse = lager_plant::Warehouse::builtin("small").unwrap();
    let mut robot = Robot::new(&warehouse, Default::default()).unwrap();
    robot.resume(&before.world);
    let after = robot.truth();
    assert_eq!(after.world, before.world);
    assert_eq!(after.carrying, Some(1));
    assert_eq!(after.duties, [0, 0]);

    let mut pi = Pi::around(robot);
    pi.until(ms(1_000), Pi::is_up);
    assert!(
        pi.heard
            .ups
            .iter()
            .all(|(_, up)| up.reset == lager_wire::ResetCause::External)
    );
    pi.run(ms(3_000));
    assert_eq!(
        pi.robot.truth().carrying,
        Some(1),
        "the board's start drops nothing"
    );
    assert_eq!(
        pi.robot.truth().world.servo_positions,
        before.world.servo_positions
    );
}
