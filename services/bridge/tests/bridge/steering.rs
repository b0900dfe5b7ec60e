//! The way of an order: bus, arbiter, packet, board, and back as a report.

use lager_orders::Mode;
use lager_topics::{Ask, AskKind, Calibration, Finish, Health, Outcome, Part, ProfileState, Role};
use lager_wire::{ArmCommand, BUILD, Command, LineReading, LineState, SettingStatus};

use crate::harness::{FORWARD, Robot, STANDBY, SensorBoard, SteeringBoard, operator, wait_until};

#[test]
fn both_boards_come_up_and_health_says_so() {
    let mut robot = Robot::up();
    let health = robot
        .hands
        .wait_for_health("the boards' own counters are there", |health| {
            health.steering.board_refused == 1 && health.sensor.board_load_percent == 42
        });
    assert_eq!((health.sensor.version, health.steering.version), (1, 1));
    assert_eq!((health.sensor.build, health.steering.build), (BUILD, BUILD));
    assert_eq!((health.sensor.port, health.steering.port), (0, 1));
    assert_eq!((health.sensor.epoch, health.steering.epoch), (1, 1));
    assert_eq!(
        (health.sensor.baud, health.steering.baud),
        (500_000, 500_000)
    );
    assert_eq!(health.mode.get(), Some(Mode::Manual));
    assert_eq!(health.stopped, 0);
    assert_eq!(health.steering.board_exde_errors, 2);
    assert_eq!(health.steering.board_servo_timeouts, 3);
}

#[test]
fn what_the_sensor_board_sees_is_published() {
    let mut robot = Robot::up();
    robot.sensor.with(|board| {
        board.state = LineState::StationToRight;
        board.distance = 37;
    });
    robot.hands.wait_for_line("the mark is seen", |line| {
        line.state.get() == Some(LineState::StationToRight) && line.link_epoch == 1
    });
    robot
        .hands
        .wait_for_distance("the distance is seen", |frame| frame.distance_cm == 37);
    // Line and distance share one id count. On a busy machine some may be missing, but never
    // without being counted.
    let mut last = None;
    let mut missing = 0;
    wait_until("fifty lines have come", || {
        for line in robot.hands.line.drain() {
            if let Some(last) = last {
                let gap = (line.packet_id + 16 - last - 2) % 16;
                missing += u64::from(gap);
            }
            last = Some(line.packet_id);
        }
        robot.hands.line.count > 50
    });
    let on_the_wire = robot.hands.health.look().unwrap().sensor.lost;
    let counted = 2 * robot.hands.line.lost() + u64::from(on_the_wire);
    assert!(missing <= counted, "{missing} missing, {counted} counted");
}

#[test]
fn raw_readings_come_with_the_line_when_asked_for() {
    let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
    robot.bridge_config.raw_line = true;
    robot.start();
    robot
        .hands
        .wait_for_line("bits come", |line| line.bits == 0b000_0111_0000);
    // A restarted board has forgotten the wish and is told again.
    robot.sensor.with(|board| {
        board.bits = 0b111_1100_0000;
        board.restart(lager_wire::ResetCause::External);
    });
    robot
        .hands
        .wait_for_line("bits come again", |line| line.bits == 0b111_1100_0000);
}

#[test]
fn an_order_drives_the_robot_for_as_long_as_it_is_renewed() {
    let mut robot = Robot::up();
    let steering = &robot.steering;
    robot
        .hands
        .give_until(operator(1, FORWARD), "the wheels turn", |hands| {
            hands.state.look().is_some_and(|state| {
                state.left_duty == 100 && state.current_id == 1 && state.line_error == -3
            })
        });
    wait_until("the lease ends", || !steering.with(|board| board.moves()));
    robot.hands.wait_for_state("the end is told", |state| {
        state.finished_id == 1 && state.finish.get() == Some(Finish::Aborted)
    });
    assert_eq!(robot.hands.health.look().unwrap().leases_expired, 1);
}

#[test]
fn the_servos_of_an_arm_step_are_known_when_it_ends() {
    let mut robot = Robot::up();
    let up = operator(5, Command::Arm(ArmCommand::Up));
    let state = robot.hands.carry_out(up);
    assert_eq!((state.servo_position[2], state.servo_load[2]), (700, -12));
    assert_eq!(state.servo_position[0], lager_topics::SERVO_UNKNOWN);
}

#[test]
fn gains_are_set_and_refused_by_the_board() {
    let robot = Robot::up();
    let ask = |gain_p, gain_d| Ask {
        kind: AskKind::SetGains.into(),
        gain_p,
        gain_d,
        ..Ask::default()
    };
    let answer = robot.hands.ask(ask(5, 7));
    assert_eq!(answer.outcome.get(), Some(Outcome::Done));
    assert_eq!((answer.gain_p, answer.gain_d), (5, 7));
    assert_eq!(robot.steering.with(|board| board.gains), [5, 7]);

    let answer = robot.hands.ask(ask(6, 200));
    assert_eq!(answer.outcome.get(), Some(Outcome::Refused));
    assert_eq!((answer.gain_p, answer.gain_d), (6, 7));

    robot
        .steering
        .with(|board| board.restart(lager_wire::ResetCause::BrownOut));
    wait_until("the gains are told again", || {
        robot.steering.with(|board| board.gains) == [6, 7]
    });
}

#[test]
fn a_calibration_is_answered_by_the_sensor_board_or_given_up() {
    let mut robot = Robot::up();
    let ask = Ask {
        kind: AskKind::Calibrate.into(),
        ..Ask::default()
    };
    assert_eq!(robot.hands.ask(ask).outcome.get(), Some(Outcome::Done));
    assert_eq!(robot.sensor.with(|board| board.calibrations), 1);
    for (sensors, status, end) in [
        (11, SettingStatus::Accepted, Calibration::Done),
        (4, SettingStatus::OutOfRange, Calibration::Partly),
    ] {
        assert_eq!(robot.hands.ask(ask).outcome.get(), Some(Outcome::Done));
        let running = |health: &Health| health.calibration == Calibration::Running;
        let before = robot.hands.wait_for_health("it runs", running);
        robot.sensor.with(|board| {
            board.tell(LineReading {
                sensor: 10,
                reading: 90,
                lowest: 20,
                highest: 120,
                tells_apart: true,
            });
        });
        let told = robot.hands.wait_for_health("a reading is told", |health| {
            health.calibrated[10].is_heard()
        });
        let [first, .., last] = told.calibrated;
        assert!(!first.is_heard());
        assert_eq!((last.lowest, last.highest, last.tells_apart), (20, 120, 1));
        robot
            .sensor
            .with(|board| board.end_calibration(sensors, status));
        let after = robot.hands.wait_for_health("its end is told", |health| {
            health.calibrations_ended != before.calibrations_ended
        });
        assert_eq!(after.calibration, end);
        assert_eq!(i16::from(after.calibrated_sensors), sensors);
    }
    robot.sensor.with(|board| board.deaf = true);
    assert_eq!(robot.hands.ask(ask).outcome.get(), Some(Outcome::NoBoard));
}

#[test]
fn a_description_is_tried_on_a_robot_that_stands() {
    let mut robot = Robot::up();
    let mut tried = robot.bridge_config.robot;
    tried.arm.torque_limit = 600;
    let ask = Ask::describe(Part::Arm, &tried);
    let in_force = |robot: &Robot| robot.steering.with(|board| board.profile);

    let before = robot.hands.health.look().unwrap().description;
    let answer = robot.hands.ask(ask);
    assert_eq!(answer.outcome.get(), Some(Outcome::Done));
    assert_eq!(in_force(&robot), tried.arm.values());
    robot.hands.wait_for_health("it is told", |health| {
        health.description != before && health.arm_profile == ProfileState::Accepted
    });
    let mut wild = ask;
    wild.values[0] = u16::MAX;
    assert_eq!(robot.hands.ask(wild).outcome.get(), Some(Outcome::Refused));
    assert_eq!(in_force(&robot), tried.arm.values());

    // A board that restarts is told what is tried.
    robot
        .steering
        .with(|board| board.restart(lager_wire::ResetCause::External));
    robot.hands.wait_for_health("it is told again", |health| {
        health.steering.reboots == 1 && health.arm_profile == ProfileState::Accepted
    });
    assert_eq!(in_force(&robot), tried.arm.values());

    robot.steering.unplug();
    robot
        .hands
        .wait_for_health("the board is gone", |health| health.steering.up == 0);
    assert_eq!(robot.hands.ask(ask).outcome.get(), Some(Outcome::NoBoard));
}

#[test]
fn the_robot_can_be_steered_while_a_board_is_asked() {
    let mut robot = Robot::up();
    robot.sensor.with(|board| board.deaf = true);
    let bus = robot.isolation.open(Role::Operator);
    std::thread::scope(|scope| {
        let asked = scope.spawn(move || {
            let ask = Ask {
                kind: AskKind::Calibrate.into(),
                ..Ask::default()
            };
            crate::harness::Hands::new(&bus).ask(ask)
        });
        robot
            .hands
            .give_until(operator(1, FORWARD), "the answer has come", |_| {
                asked.is_finished()
            });
    });
    assert!(!robot.steering.with(|board| board.register.failsafe));
    assert!(robot.steering.with(|board| board.count(FORWARD)) == 1);
}

#[test]
fn settings_without_a_board_are_answered_so() {
    let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
    robot.steering.unplug();
    robot.start();
    robot
        .hands
        .wait_for_health("the sensor board is up", |health| health.sensor.up == 1);
    let answer = robot.hands.ask(Ask {
        kind: AskKind::SetGains.into(),
        ..Ask::default()
    });
    assert_eq!(answer.outcome.get(), Some(Outcome::NoBoard));
}

#[test]
fn a_board_that_keeps_resetting_stops_the_robot() {
    let mut robot = Robot::up();
    for reboots in 0..3 {
        // A board that asks again before it has sent anything has only missed the answer.
        let health = robot.hands.wait_for_health("data comes", |health| {
            health.steering.reboots == reboots && health.steering.packets > 5
        });
        assert_eq!(health.stopped, 0);
        robot
            .steering
            .with(|board| board.restart(lager_wire::ResetCause::BrownOut));
    }
    robot
        .hands
        .wait_for_health("the robot is stopped", |health| health.stopped == 1);
}

#[test]
fn a_clean_stop_leaves_the_robot_in_standby() {
    let mut robot = Robot::up();
    robot
        .hands
        .give_until(operator(1, FORWARD), "the wheels turn", |hands| {
            hands
                .state
                .look()
                .is_some_and(|state| state.left_duty == 100)
        });
    robot.hands.give(operator(1, FORWARD));
    robot.steering.with(|board| board.register.halted = false);
    robot.bridge.take().unwrap().stop();
    let (moves, halted, last) = robot.steering.with(|board| {
        (
            board.moves(),
            board.register.halted,
            *board.register.executed.last().unwrap(),
        )
    });
    assert!(!moves && !halted);
    assert_eq!(last, STANDBY.code());
    let health = robot.hands.health.look().unwrap();
    assert_eq!(health.current_code, 0);
}
