//! The way of an order: bus, arbiter, packet, board, and back as a report.

use lager_ports::Cause;
use lager_topics::{
    AskKind, Calibration, Finish, Health, Input, InputKind, Mode, OperatorInput, Outcome, Refusal,
    Role, SteeringReport,
};
use lager_wire::{ArmCommand, Command, LineReading, LineState, SettingStatus};

use crate::harness::{
    FOLLOW, FORWARD, LEFT_PERP, Robot, STANDBY, SensorBoard, SteeringBoard, logic, operator,
    wait_until,
};
use lager_topics::Ask;

#[test]
fn both_boards_come_up_and_health_says_so() {
    let mut robot = Robot::up();
    let health = robot
        .hands
        .wait_for_health("the boards' own counters are there", |health| {
            health.steering.board_refused == 1 && health.sensor.board_load_percent == 42
        });
    assert_eq!((health.sensor.version, health.steering.version), (1, 1));
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
    assert!(
        steering.with(|board| !board.failsafe),
        "the bridge halted the robot, not the board"
    );
    robot.hands.wait_for_state("the end is told", |state| {
        state.finished_id == 1 && state.finish.get() == Some(Finish::Aborted)
    });
    assert_eq!(robot.hands.health.look().unwrap().leases_expired, 1);
}

#[test]
fn logic_drives_in_autonomous_mode_and_the_operator_does_not() {
    let mut robot = Robot::autonomous();
    robot
        .hands
        .give_until(logic(1, FOLLOW), "the wheels turn", |hands| {
            hands
                .state
                .look()
                .is_some_and(|state| state.left_duty == 100)
        });
    let refused = robot.hands.health.look().unwrap().orders_refused;
    robot.hands.give(operator(1, FORWARD));
    robot
        .hands
        .wait_for_health("the operator's order is counted", |health| {
            health.orders_refused > refused
        });
    assert_eq!(robot.steering.with(|board| board.count(FORWARD)), 0);
}

#[test]
fn a_stop_latches_until_a_resume() {
    let mut robot = Robot::autonomous();
    let order = logic(1, FOLLOW);
    robot.hands.give_until(order, "the wheels turn", |hands| {
        hands
            .state
            .look()
            .is_some_and(|state| state.left_duty == 100)
    });
    robot.hands.stop();
    robot
        .hands
        .wait_for_health("the stop is latched", |health| health.stopped == 1);
    let executed = robot.steering.with(|board| board.executed.len());
    let commands = robot.steering.with(|board| board.commands);
    let steering = &robot.steering;
    // Logic goes on, with this order and with new ones.
    for id in 1..4 {
        robot
            .hands
            .give_until(logic(id, FOLLOW), "standby is renewed", |_| {
                steering.with(|board| board.commands > commands + 5 * id as usize)
            });
    }
    assert_eq!(robot.steering.with(|board| board.code), STANDBY.code());
    assert!(robot.steering.with(|board| {
        board.executed[executed..]
            .iter()
            .all(|code| *code == STANDBY.code())
    }));
    let answer = robot.hands.resume();
    assert_eq!(answer.outcome.get(), Some(Outcome::Done));
    assert_eq!(answer.stopped, 0);
    robot
        .hands
        .give_until(logic(3, FOLLOW), "the wheels turn again", |hands| {
            hands
                .state
                .look()
                .is_some_and(|state| state.left_duty == 100)
        });
}

#[test]
fn two_equal_turns_are_two_and_a_refresh_is_none() {
    let mut robot = Robot::autonomous();
    let (mut id, mut turns) = (0, 0);
    for _ in 0..2 {
        let before = (id, turns);
        id = robot.hands.carry_out(logic(id + 1, LEFT_PERP));
        let steering = &robot.steering;
        let commands = steering.with(|board| board.commands);
        turns = steering.with(|board| board.count(LEFT_PERP));
        let (tries, done) = ((id - before.0) as usize, turns - before.1);
        assert!((1..=tries).contains(&done), "{done} turns for {tries}");
        robot
            .hands
            .give_until(logic(id, LEFT_PERP), "it is refreshed", |_| {
                steering.with(|board| board.commands > commands + 5)
            });
        assert_eq!(robot.steering.with(|board| board.count(LEFT_PERP)), turns);
    }
}

#[test]
fn the_servos_of_an_arm_step_are_known_when_it_ends() {
    let mut robot = Robot::up();
    let up = operator(5, Command::Arm(ArmCommand::Up));
    robot.hands.give_until(up, "the step is done", |hands| {
        hands.state.drain().iter().any(|state| {
            let done = state.finished_id == 5 && state.finish.get() == Some(Finish::Done);
            if done {
                assert_eq!((state.servo_position[2], state.servo_load[2]), (700, -12));
                assert_eq!(state.servo_position[0], lager_topics::SERVO_UNKNOWN);
            }
            done
        })
    });
}

#[test]
fn an_undefined_code_is_refused_and_counted() {
    let mut robot = Robot::up();
    let mut order = operator(1, FORWARD);
    order.code = 0x0C;
    robot.hands.give(order);
    robot
        .hands
        .wait_for_health("it is counted", |health| health.orders_refused == 1);
    robot.hands.wait_for_state("its origin is told", |state| {
        state.finished_id == 1 && state.finish.get() == Some(Finish::Refused)
    });
    assert!(!robot.steering.with(|board| board.moves()));
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
fn one_that_drives_by_itself_is_not_calibrated() {
    let mut robot = Robot::autonomous();
    let ask = Ask {
        kind: AskKind::Calibrate.into(),
        ..Ask::default()
    };
    let asked = || {
        robot.hands.give(logic(1, FOLLOW));
        robot.hands.ask(ask).outcome.get()
    };
    wait_until("it is refused while the wheels turn", || {
        asked() == Some(Outcome::UnderWay)
    });
    robot.hands.stop();
    robot
        .hands
        .wait_for_health("the stop is latched", |health| health.stopped == 1);
    assert_eq!(robot.hands.ask(ask).outcome.get(), Some(Outcome::Done));
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
    assert!(!robot.steering.with(|board| board.failsafe));
    assert!(robot.steering.with(|board| board.count(FORWARD)) == 1);
}

#[test]
fn boards_cannot_be_reset_and_unknown_requests_are_refused() {
    let robot = Robot::up();
    for kind in [AskKind::ResetBoards.into(), lager_topics::Tag::from_raw(77)] {
        let answer = robot.hands.ask(Ask {
            kind,
            ..Ask::default()
        });
        assert_eq!(answer.outcome.get(), Some(Outcome::Refused));
    }
    assert_eq!(robot.sensor.with(|board| board.restarts), 0);
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
fn each_press_of_the_switch_changes_the_mode_once() {
    let mut robot = Robot::up();
    let buttons = robot
        .isolation
        .open(Role::Operator)
        .publisher::<OperatorInput>()
        .unwrap();
    let press = |id| {
        let input = Input {
            kind: InputKind::SwitchPressed.into(),
            id,
            ..Input::default()
        };
        buttons.send(Cause::OWN, input).unwrap();
    };
    for (id, mode) in [(7, Mode::Autonomous), (8, Mode::Manual)] {
        press(id);
        robot
            .hands
            .wait_for_health("the mode has changed", |health| {
                health.mode.get() == Some(mode)
            });
        // A repeated sample is no second press, nor is one without a number.
        for repeated in [id, 7, 0] {
            press(repeated);
        }
        let health = robot
            .hands
            .wait_for_health("it is known", |health| health.switch_ids[0] == id);
        assert_eq!(health.mode.get(), Some(mode));
    }
    press(9);
    robot
        .hands
        .wait_for_health("the last press has come", |health| {
            health.switch_ids[0] == 9
        });
    let health = robot.hands.health.look().unwrap();
    assert_eq!(health.mode.get(), Some(Mode::Autonomous), "three presses");
    assert_eq!(health.switch_ids, [9, 8, 7, 0]);
}

#[test]
fn a_board_that_does_not_report_is_not_driven_and_its_last_report_grows_old() {
    for logic_drives in [false, true] {
        let mut robot = if logic_drives {
            Robot::autonomous()
        } else {
            Robot::up()
        };
        let steering = &robot.steering;
        let order = if logic_drives {
            logic(1, FOLLOW)
        } else {
            operator(1, FORWARD)
        };
        let fresh = |state: &SteeringReport| state.left_duty == 100 && state.age_ms < 200;
        robot.hands.give_until(order, "the wheels turn", |hands| {
            hands.state.look().is_some_and(|state| fresh(&state))
        });
        robot.hands.state.drain();
        steering.with(|board| board.mute = true);
        robot.hands.give_until(order, "the wheels stand", |_| {
            steering.with(|board| !board.moves())
        });
        assert!(
            steering.with(|board| !board.failsafe),
            "the bridge halted the robot, not the board"
        );
        let health = robot.hands.wait_for_health("people see why", |health| {
            health.blocked.get() == Some(Refusal::BoardSilent)
        });
        assert_eq!(health.steering.up, 1, "its link is up all the same");
        let executed = steering.with(|board| board.executed.len());
        let commands = steering.with(|board| board.commands);
        robot.hands.give_until(order, "standby goes on", |_| {
            steering.with(|board| board.commands > commands + 10)
        });
        assert!(steering.with(|board| {
            let mut since = board.executed[executed..].iter();
            since.all(|code| *code == STANDBY.code())
        }));
        let frozen = robot.hands.state.drain();
        let last = frozen.last().expect("the end of the order was told");
        assert_eq!(last.left_duty, 100, "as last heard");
        assert!(last.age_ms >= 200, "{}", last.age_ms);

        steering.with(|board| board.mute = false);
        robot
            .hands
            .give_until(order, "its origin is told that it is over", |hands| {
                hands.health.look().is_some_and(|health| {
                    health.blocked.get() == Some(Refusal::None) && health.finished_id == 1
                })
            });
        let commands = steering.with(|board| board.commands);
        robot.hands.give_until(order, "standby goes on", |_| {
            steering.with(|board| board.commands > commands + 10)
        });
        assert!(!steering.with(|board| board.moves()));
        let new = if logic_drives {
            logic(2, FOLLOW)
        } else {
            operator(2, FORWARD)
        };
        robot.hands.give_until(new, "a new order drives", |_| {
            steering.with(|board| board.moves())
        });
    }
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
    robot.steering.with(|board| board.halted = false);
    robot.bridge.take().unwrap().stop();
    let (moves, halted, last) = robot
        .steering
        .with(|board| (board.moves(), board.halted, *board.executed.last().unwrap()));
    assert!(!moves && !halted);
    assert_eq!(last, STANDBY.code());
    let health = robot.hands.health.look().unwrap();
    assert_eq!(health.current_code, 0);
}

#[test]
fn a_setpoint_the_board_gave_up_does_not_set_it_off_again() {
    let mut robot = Robot::up();
    let steering = &robot.steering;
    let order = operator(1, FORWARD);
    robot.hands.give_until(order, "the wheels turn", |_| {
        steering.with(|board| board.moves())
    });
    // As if all commands of 150 ms had been lost.
    steering.with(|board| {
        board.failsafe = true;
        board.code = STANDBY.code();
    });
    robot
        .hands
        .give_until(order, "the person is told that it is over", |hands| {
            let health = hands.health.look();
            health.is_some_and(|health| health.finished_id == 1)
        });
    assert!(!steering.with(|board| board.moves()));
    robot
        .hands
        .give_until(operator(2, FORWARD), "the wheels turn again", |_| {
            steering.with(|board| board.moves())
        });
}
