//! What goes wrong on a robot: restarts, cables, noise, ports the wrong way round.

use lager_orders::Mode;
use lager_ports::Keeper;
use lager_topics::{Health, LinkHealth, ProfileState, Role, StopCause};
use lager_wire::{Centimetres, LineState, Payload, ResetCause};

use crate::harness::{
    Bridge, FOLLOW, FORWARD, LEFT_PERP, Robot, SensorBoard, SteeringBoard, logic, operator,
    wait_until,
};

#[test]
fn a_reset_sensor_board_is_not_counted_as_loss() {
    let mut robot = Robot::up();
    robot
        .hands
        .wait_for_line("the first lines come", |line| line.link_epoch == 1);
    robot.sensor.with(|board| {
        board.state = LineState::FourWay;
        board.restart(ResetCause::Watchdog);
    });
    robot
        .hands
        .wait_for_line("lines of the new epoch come", |line| {
            line.link_epoch == 2 && line.state.get() == Some(LineState::FourWay)
        });
    let health = robot
        .hands
        .wait_for_health("health shows the new epoch", |health| {
            health.sensor.epoch == 2 && health.sensor.packets > 5
        });
    assert_eq!(health.sensor.reboots, 1);
    assert_eq!(health.sensor.lost, 0);
    assert_eq!(health.sensor.reset_cause.get(), Some(ResetCause::Watchdog));
    assert_eq!(health.steering.epoch, 1, "the other link is untouched");
}

#[test]
fn a_board_that_lost_its_power_with_its_cable_has_restarted() {
    let mut robot = Robot::up();
    robot.steering.unplug();
    robot
        .hands
        .wait_for_health("the board is gone", |health| health.steering.up == 0);
    let steering = &robot.steering;
    steering.with(|board| board.restart(ResetCause::PowerOn));
    robot.steering.plug();
    let health = robot
        .hands
        .wait_for_health("the board is back", |health| health.steering.up == 1);
    assert_eq!(health.steering.reboots, 1);
    assert_eq!(health.steering.reset_cause.get(), Some(ResetCause::PowerOn));
}

#[test]
fn the_steering_board_is_told_the_arms_profile_and_again_when_it_has_restarted() {
    let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
    robot.bridge_config.robot.arm.torque_limit = 700;
    let values = robot.bridge_config.robot.arm.values();
    robot.start();
    for restarts in 0..3 {
        let what = "the board obeys the profile";
        robot.hands.wait_for_health(what, |health| {
            health.steering.reboots == restarts && health.arm_profile == ProfileState::Accepted
        });
        let steering = &robot.steering;
        steering.with(|board| {
            assert_eq!((board.profile, board.profile_in_force), (values, true));
            board.restart(ResetCause::External);
        });
    }
}

#[test]
fn ports_may_be_swapped() {
    let mut robot = Robot::with(SteeringBoard::new(), SensorBoard::new());
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!((health.sensor.port, health.steering.port), (1, 0));
    robot
        .hands
        .wait_for_line("lines come", |line| line.link_epoch == 1);
    let steering = &robot.sensor;
    robot
        .hands
        .give_until(operator(1, FORWARD), "the wheels turn", |_| {
            steering.with(|board| board.moves())
        });
}

#[test]
fn an_unplugged_port_is_opened_again_when_it_is_back() {
    let mut robot = Robot::up();
    let epoch = robot.hands.health.look().unwrap().steering.epoch;
    for round in 1..=3 {
        robot.steering.unplug();
        let health = robot
            .hands
            .wait_for_health("the board is gone", |health| health.steering.up == 0);
        assert_eq!(health.steering.port, 0xFF);
        assert_eq!(health.sensor.up, 1);
        robot.steering.plug();
        let health = robot.wait_until_up();
        assert_eq!(health.steering.epoch, epoch + round);
        assert_eq!(health.steering.lost, 0);
        assert_eq!(
            health.steering.reboots, 0,
            "it was not the board that restarted"
        );
        let steering = &robot.steering;
        robot
            .hands
            .give_until(operator(round, FORWARD), "the wheels turn", |_| {
                steering.with(|board| board.moves())
            });
        wait_until("the wheels stand", || !steering.with(|board| board.moves()));
    }
    // The sensor's stream went on all the time.
    assert_eq!(robot.hands.health.look().unwrap().sensor.epoch, 1);
}

#[test]
fn boards_that_change_places_while_unplugged_are_found() {
    let mut robot = Robot::up();
    robot.sensor.unplug();
    robot.steering.unplug();
    robot.hands.wait_for_health("both are gone", |health| {
        health.sensor.up == 0 && health.steering.up == 0
    });
    // The cables come back the other way round: each board under the other's path.
    robot.sensor.plug_at(robot.steering.path());
    robot.steering.plug_at(robot.sensor.path());
    let health = robot.hands.wait_for_health("both are back", |health| {
        health.sensor.up == 1 && health.steering.up == 1
    });
    assert_eq!((health.sensor.port, health.steering.port), (1, 0));
    let before = robot.hands.line.count;
    wait_until("lines come", || {
        robot.hands.line.look();
        robot.hands.line.count > before + 20
    });
}

#[test]
fn a_bridge_may_start_before_its_ports_are_there() {
    let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
    robot.sensor.unplug();
    robot.steering.unplug();
    robot.start();
    robot
        .hands
        .wait_for_health("the bridge runs", |health| health.sensor.up == 0);
    robot.steering.plug();
    robot
        .hands
        .wait_for_health("one is up", |health| health.steering.up == 1);
    robot.sensor.plug();
    robot.wait_until_up();
}

#[test]
fn a_silent_board_is_asked_until_it_answers() {
    let mut robot = Robot::up();
    robot.steering.freeze(true);
    robot
        .hands
        .wait_for_health("the board is silent", |health| health.steering.up == 0);
    robot.steering.freeze(false);
    robot
        .hands
        .wait_for_health("the board is back", |health| health.steering.up == 1);
    assert_eq!(robot.steering.with(|board| board.restarts), 0);
}

#[test]
fn a_megabyte_of_noise_hides_no_good_packet_behind_it() {
    let mut robot = Robot::up();
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    let noise = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random as u8
    };
    assert!(robot.sensor.send_noise(noise, 1 << 20));
    robot
        .sensor
        .with(|board| board.state = LineState::DropStation);
    robot.hands.wait_for_line("a good packet comes", |line| {
        line.state.get() == Some(LineState::DropStation)
    });
    let health = robot
        .hands
        .wait_for_health("the noise is counted", |health| {
            health.sensor.skipped_bytes > 1_000_000 || health.sensor.epoch > 1
        });
    assert_eq!(health.sensor.up, 1);
    assert_eq!(health.steering.epoch, 1);
    let steering = &robot.steering;
    robot
        .hands
        .give_until(operator(1, FORWARD), "the wheels turn", |_| {
            steering.with(|board| board.moves())
        });
}

#[test]
fn a_restarted_bridge_goes_on_beside_running_boards() {
    let mut robot = Robot::autonomous();
    let supervisor = robot.isolation.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<LinkHealth>().unwrap();
    let id = robot.hands.carry_out(logic(1, LEFT_PERP)).finished_id;
    let turns = robot.steering.with(|board| board.count(LEFT_PERP));
    robot.hands.stop();
    robot
        .hands
        .wait_for_health("the stop is latched", |health| health.stopped == 1);
    wait_until("the keeper has it", || {
        keeper.remember().unwrap();
        keeper
            .value()
            .is_some_and(|(health, _)| health.stopped == 1)
    });

    let after = restart_bridge(&mut robot, &mut keeper);
    assert_eq!(after.mode.get(), Some(Mode::Autonomous));
    assert_eq!(after.stopped, 1);
    assert_eq!((after.sensor.reboots, after.steering.reboots), (0, 0));
    assert_eq!((after.sensor.lost, after.steering.lost), (0, 0));
    wait_until("both boards have their ACK", || {
        robot.sensor.with(|board| board.ups) == 2 && robot.steering.with(|board| board.ups) == 2
    });
    assert_eq!(robot.sensor.with(|board| board.restarts), 0);
    assert_eq!(robot.steering.with(|board| board.restarts), 0);

    // The finished turn stays finished, and the latch holds.
    let steering = &robot.steering;
    let commands = steering.with(|board| board.commands);
    robot
        .hands
        .give_until(logic(id, LEFT_PERP), "it is renewed", |_| {
            steering.with(|board| board.commands > commands + 5)
        });
    assert_eq!(steering.with(|board| board.count(LEFT_PERP)), turns);
    robot.hands.resume();
    let tries = robot.hands.carry_out(logic(id + 1, LEFT_PERP)).finished_id - id;
    let done = robot.steering.with(|board| board.count(LEFT_PERP)) - turns;
    assert!(
        (1..=tries as usize).contains(&done),
        "{done} turns for {tries}"
    );
}

#[test]
fn the_total_of_losses_outlives_resets_cables_and_bridges() {
    let mut robot = Robot::up();
    let supervisor = robot.isolation.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<LinkHealth>().unwrap();
    let mut total = lose(&mut robot, 0, 5);

    robot
        .sensor
        .with(|board| board.restart(ResetCause::Watchdog));
    robot
        .hands
        .wait_for_health("the board has restarted", |health| {
            health.sensor.epoch == 2 && health.sensor.lost == 0 && health.sensor.lost_total >= total
        });
    total = lose(&mut robot, total, 3);

    robot.sensor.unplug();
    robot
        .hands
        .wait_for_health("the board is gone", |health| health.sensor.up == 0);
    robot.sensor.plug();
    let health = robot
        .hands
        .wait_for_health("the board is back", |health| health.sensor.up == 1);
    assert!(health.sensor.lost_total >= total, "{health:?}");
    total = lose(&mut robot, total, 4);

    let health = restart_bridge(&mut robot, &mut keeper);
    assert!(health.sensor.lost_total >= total, "{health:?}");
    total = lose(&mut robot, total, 2);
    assert!(total >= 5 + 3 + 4 + 2);
}

/// Ends the bridge, and starts one that takes up its state; the health with both boards up again.
fn restart_bridge(robot: &mut Robot, keeper: &mut Keeper<LinkHealth>) -> Health {
    robot.bridge.take().unwrap().stop();
    let before = robot.hands.health.look().unwrap();
    keeper.remember().unwrap();
    keeper.hand_over().unwrap();
    robot.bridge_config.resume = true;
    robot.bridge = Some(Bridge::start(&robot.isolation, robot.bridge_config.clone()));
    wait_until("both links have a new epoch", || {
        // A late joiner gets the kept value at the keeper's next tick.
        keeper.remember().unwrap();
        robot.hands.health.look().is_some_and(|health| {
            health.sensor.epoch == before.sensor.epoch + 1
                && health.steering.epoch == before.steering.epoch + 1
                && health.sensor.up == 1
                && health.steering.up == 1
        })
    });
    robot.hands.health.last.unwrap()
}

/// Loses `count` packets of the sensor board beyond those already lost; the new total.
fn lose(robot: &mut Robot, before: u32, count: u32) -> u32 {
    wait_until("the board is up", || {
        robot.sensor.with(|board| {
            let lost = Payload::Distance(Centimetres(1));
            // Packets that use up ids and are never sent.
            (0..count).all(|_| board.link.encode(lost).is_some())
        })
    });
    let health = robot
        .hands
        .wait_for_health("the loss is counted", |health| {
            // Of this life of the link, and of all.
            health.sensor.lost >= count && health.sensor.lost_total >= before + count
        });
    health.sensor.lost_total
}

#[test]
fn a_bridge_that_is_to_resume_and_finds_nothing_starts_stopped() {
    let mut robot = Robot::up();
    robot.bridge.take().unwrap().stop();
    let before = robot.hands.health.look().unwrap();
    assert_eq!(before.stopped, 0);
    robot.bridge_config.resume = true;
    robot.start();
    let health = robot
        .hands
        .wait_for_health("both boards are up and it is stopped", |health| {
            health.stopped == 1 && health.sensor.up == 1 && health.steering.up == 1
        });
    assert_eq!(health.stop_cause.get(), Some(StopCause::StateLost));
    robot.hands.give(operator(1, FORWARD));
    let commands = robot.steering.with(|board| board.commands);
    wait_until("standby is renewed", || {
        robot.steering.with(|board| board.commands) > commands + 5
    });
    assert_eq!(robot.steering.with(|board| board.count(FORWARD)), 0);
}

#[test]
fn a_stop_that_was_set_before_the_start_is_seen_before_anything_is_written() {
    let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
    let stop = robot.hands.stop();
    robot.start();
    let health = robot.wait_until_up();
    assert_eq!(health.stopped, 1);
    assert_eq!(health.stop_cause.get(), Some(StopCause::Ordered));
    assert_eq!(health.stop_origin.get(), Some(Role::Operator));
    assert_eq!(health.stopped_at_ns, stop.at_ns());
    wait_until("the board reports wheels at rest", || {
        let told = robot.hands.stop_told();
        told.rested().is_some_and(|(of, _)| of == stop)
    });
    let told = robot.hands.stop_told();
    assert_eq!((told.sensor(), told.steering()), (Some(1), Some(1)));
    assert_eq!(told.bridge(), Some(std::process::id()));
}

#[test]
fn a_removed_stop_word_stops_the_robot_and_a_resume_lets_it_go_on() {
    let mut robot = Robot::autonomous();
    robot
        .hands
        .give_until(logic(1, FOLLOW), "the wheels turn", |hands| {
            hands
                .state
                .look()
                .is_some_and(|state| state.left_duty == 100)
        });
    std::fs::remove_file(&robot.hands.stop_word).unwrap();
    let health = robot
        .hands
        .wait_for_health("it is stopped", |health| health.stopped == 1);
    assert_eq!(health.stop_cause.get(), Some(StopCause::WordRemoved));
    assert_eq!(robot.hands.resume().stopped, 0);
    robot
        .hands
        .give_until(logic(2, FOLLOW), "the wheels turn again", |hands| {
            hands
                .state
                .look()
                .is_some_and(|state| state.left_duty == 100)
        });
}
