//! Original boards: 11-byte packets, end 0xFF, no version byte (U2-U14).

use lager_orders::Mode;
use lager_topics::Refusal;
use lager_wire::{LineState, ResetCause};

use crate::harness::{
    FOLLOW, FORWARD, LEFT_PERP, OriginalSensor, OriginalSteering, Robot, STANDBY, SteeringBoard,
    logic, operator, wait_until,
};

#[test]
fn two_original_boards_handshake_and_drive_the_bridge() {
    let mut robot = Robot::with(OriginalSensor::new(), OriginalSteering::new());
    robot.bridge_config.original_boards = true;
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!((health.sensor.version, health.steering.version), (0, 0));
    assert_eq!((health.sensor.port, health.steering.port), (0, 1));
    assert_eq!(health.steering.reset_cause.get(), Some(ResetCause::Unknown));
    wait_until("both boards have their ACK", || {
        robot.sensor.with(|board| board.board.up) && robot.steering.with(|board| board.board.up)
    });
    let ack = [0x00, 0x0B, 0x05, 0, 0, 0, 0, 0, 0, 0, 0xFF];
    assert_eq!(robot.sensor.with(|board| board.board.acks[0]), ack);
    assert_eq!(robot.steering.with(|board| board.board.acks[0]), ack);

    robot.sensor.with(|board| board.state = 6);
    robot.hands.wait_for_line("the crossing is seen", |line| {
        line.state.get() == Some(LineState::FourWay)
    });
    robot
        .hands
        .wait_for_distance("the distance is seen", |frame| frame.distance_cm == 40);

    let steering = &robot.steering;
    let told = |code: u8| {
        steering.with(|board| board.commands.iter().filter(|told| **told == code).count())
    };
    robot
        .hands
        .give_until(operator(1, FORWARD), "the order is on the line", |hands| {
            told(FORWARD.code()) == 1
                && hands
                    .state
                    .look()
                    .is_some_and(|state| state.current_id == 1)
        });
    // It is renewed, but the board is told once.
    let seen = robot.hands.state.count;
    robot
        .hands
        .give_until(operator(1, FORWARD), "more reports come", |hands| {
            hands.state.look();
            hands.state.count > seen + 20
        });
    assert_eq!(told(FORWARD.code()), 1);
    let standbys = told(STANDBY.code());
    wait_until("the lease ends, and standby is repeated", || {
        told(STANDBY.code()) >= standbys + 5
    });
    assert_eq!(told(FORWARD.code()), 1);
    let health = robot.hands.health.look().unwrap();
    assert_eq!((health.sensor.lost, health.steering.lost), (0, 0));
}

#[test]
fn an_original_board_that_is_running_is_known_by_its_packets() {
    let mut robot = Robot::with(OriginalSensor::new(), OriginalSteering::running());
    robot.bridge_config.original_boards = true;
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!(health.steering.version, 0);
    assert!(robot.steering.with(|board| board.board.acks.is_empty()));
    let steering = &robot.steering;
    robot
        .hands
        .give_until(operator(1, FORWARD), "the order is on the line", |_| {
            steering.with(|board| board.commands.contains(&FORWARD.code()))
        });
}

#[test]
fn a_turn_of_an_original_board_ends_after_its_time() {
    let mut robot = Robot::with(OriginalSensor::new(), OriginalSteering::new());
    robot.bridge_config.original_boards = true;
    robot.start();
    robot.wait_until_up();
    robot.hands.set_mode(Mode::Autonomous);
    let id = robot.hands.carry_out(logic(1, LEFT_PERP)).finished_id;
    let steering = &robot.steering;
    robot
        .hands
        .give_until(logic(id + 1, FOLLOW), "it drives", |_| {
            steering.with(|board| board.commands.last() == Some(&FOLLOW.code()))
        });
    let turns = robot.steering.with(|board| {
        let turns = board
            .commands
            .iter()
            .filter(|code| **code == LEFT_PERP.code());
        turns.count()
    });
    assert!((1..=id as usize).contains(&turns), "{turns} for {id}");
}

#[test]
fn an_original_sensor_board_works_beside_a_new_steering_board() {
    let mut robot = Robot::with(OriginalSensor::new(), SteeringBoard::new());
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!((health.sensor.version, health.steering.version), (0, 1));
    robot
        .hands
        .wait_for_line("lines come", |line| line.link_epoch == 1);
}

#[test]
fn an_original_steering_board_is_not_driven_unless_that_was_accepted() {
    let mut robot = Robot::with(OriginalSensor::new(), OriginalSteering::running());
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!(health.blocked.get(), Some(Refusal::OriginalBoard));
    robot.hands.give(operator(1, FORWARD));
    let health = robot
        .hands
        .wait_for_health("the order is refused", |health| health.refused_id == 1);
    assert_eq!(health.refusal.get(), Some(Refusal::OriginalBoard));
    let steering = &robot.steering;
    wait_until("it is told to stand, again and again", || {
        steering.with(|board| board.commands.len() >= 5)
    });
    assert!(steering.with(|board| {
        let mut commands = board.commands.iter();
        commands.all(|code| *code == STANDBY.code())
    }));
}
