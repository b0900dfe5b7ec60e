//! The boards connect to the Pi, and tell it why they started.

use std::time::Duration;

use lager_emulator::chip::ResetLine;
use lager_emulator::rig::Board;
use lager_wire::{
    BUILD, Callsign, LineState, Payload, ResetCause, ResetOrder, SteerFlags, Version, WheelCommand,
};

use crate::support::{Robot, milliseconds, status};

#[test]
fn both_boards_shake_hands_with_the_pi_and_with_each_other() {
    for seed in 1..=3 {
        let mut robot = Robot::up(seed);
        robot.place(0.0);
        robot.run(Duration::from_millis(700));
        for (pi, callsign) in [
            (&robot.sensor, Callsign::Sensor),
            (&robot.steering, Callsign::Steering),
        ] {
            assert_eq!(pi.ups.len(), 1, "one epoch");
            let (_, up) = pi.ups[0];
            assert_eq!((up.callsign, up.version), (callsign, Version::One));
            assert_eq!((up.reset, up.build), (ResetCause::PowerOn, BUILD));
            let health = pi.health();
            assert!(health.packets > 100);
            assert_eq!((health.lost, health.bad_crc, health.bad_content), (0, 0, 0));
        }
        assert!(robot.report().flags.contains(SteerFlags::EXDE_OK));
        let line =
            robot
                .sensor
                .packets
                .iter()
                .rev()
                .find_map(|arrived| match arrived.packet.payload {
                    Payload::Line(state) => Some(state),
                    _ => None,
                });
        assert_eq!(line, Some(LineState::OnLine));
        assert_eq!(robot.rig.duties(), [0, 0], "nobody has said drive");
    }
}

#[test]
fn a_reset_is_told_with_its_cause() {
    for board in Board::BOTH {
        let mut robot = Robot::up(4);
        robot.rig.reset(board, ResetLine::External);
        robot.run(Duration::from_millis(600));
        let pi = match board {
            Board::Sensor => &robot.sensor,
            Board::Steering => &robot.steering,
        };
        let (_, up) = pi.ups.last().copied().expect("it was up before");
        assert_eq!(
            (up.rebooted, up.reset),
            (true, ResetCause::External),
            "{board:?}"
        );
        assert_eq!(
            status(pi).map(|status| status.reset),
            Some(ResetCause::External)
        );
        assert!(
            robot.report().flags.contains(SteerFlags::EXDE_OK),
            "ExDe too"
        );
    }
}

#[test]
fn the_pi_resets_a_driving_board_and_it_tells_that_it_was_told_to() {
    let mut robot = Robot::driving(4);
    let order = Payload::Reset(ResetOrder::Restart);
    robot.steering.send(&mut robot.rig, order);
    robot.wheels(WheelCommand::ManualForward);
    let begin = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(5));
    // The packet takes 220 us, and the board obeys in its next step.
    assert!(
        off.is_some_and(|at| at - begin < milliseconds(2)),
        "{off:?}"
    );
    robot.run(Duration::from_millis(600));
    let (_, up) = robot.steering.ups.last().copied().expect("it was up");
    assert_eq!((up.rebooted, up.reset), (true, ResetCause::Ordered));
    assert_eq!(robot.rig.chip(Board::Steering).resets(), 1);
}

#[test]
fn a_run_depends_on_images_seed_and_bytes_and_not_on_how_time_is_cut() {
    let run = |step: Duration| {
        let mut robot = Robot::new(5);
        let end = Duration::from_millis(400);
        while robot.rig.now() < end {
            let left = end - robot.rig.now();
            robot.rig.run_for(step.min(left));
        }
        let bytes = Board::BOTH.map(|board| robot.rig.read(board));
        assert!(bytes.iter().all(|bytes| !bytes.is_empty()));
        bytes
    };
    assert_eq!(
        run(Duration::from_millis(400)),
        run(Duration::from_micros(137))
    );
}
