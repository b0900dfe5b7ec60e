//! The wires between the boards.

use std::time::Duration;

use lager_emulator::chip::ResetLine;
use lager_emulator::rig::Board;
use lager_wire::{Payload, SteerFlags, WheelCommand};

use crate::support::{Robot, milliseconds};

/// Bits of a word.
const WORD: usize = 11;

/// The number of rises of sync in each word; a silence of 50 microseconds ends a word.
fn words(edges: &[(u64, bool)]) -> Vec<usize> {
    let rises: Vec<u64> = edges
        .iter()
        .filter(|edge| edge.1)
        .map(|edge| edge.0)
        .collect();
    rises
        .chunk_by(|one, next| next - one < milliseconds(1) / 20)
        .map(<[u64]>::len)
        .collect()
}

#[test]
fn a_lost_pulse_costs_one_word_and_not_all() {
    const LOSSES: u8 = 8;
    let mut robot = Robot::up(1);
    robot.place(0.0);
    let before = robot.steering_status().exde_errors;
    for loss in 0..LOSSES {
        robot.rig.exde().sync.lose(1);
        // Each loss hits another bit of the word.
        robot.run(Duration::from_micros(20_000 + 37 * u64::from(loss)));
    }
    let told = robot.steering.packets.clone();
    let after = robot.steering_status().exde_errors;
    assert_eq!(robot.rig.exde().sync.lost(), u64::from(LOSSES));
    // A word without its middle arrives as two pieces, and the board refuses each.
    let errors = after - before;
    assert!((LOSSES..=2 * LOSSES).contains(&errors), "{errors} errors");
    assert!(told.len() > 20);
    for arrived in &told {
        if let Payload::SteerData(data) = arrived.packet.payload {
            assert!(
                data.line_error.abs() <= 1,
                "a word was read askew: {data:?}"
            );
            assert!(data.flags.contains(SteerFlags::EXDE_OK));
        }
    }
}

#[test]
fn words_are_whole_and_follow_the_tape() {
    let mut robot = Robot::up(2);
    robot.place(0.0);
    robot.run(Duration::from_millis(50));
    robot.rig.exde().sync.record();
    robot.run(Duration::from_millis(200));
    let words = words(&robot.rig.exde().sync.take_edges());
    let inner = &words[1..words.len() - 1];
    assert!(inner.len() > 20, "{words:?}");
    assert!(inner.iter().all(|bits| *bits == WORD), "{words:?}");
    for (left, wanted) in [(0.0, 0_i8), (14.0, 4), (-14.0, -4)] {
        robot.place(left);
        robot.run(Duration::from_millis(60));
        let error = robot.report().line_error;
        assert!((error - wanted).abs() <= 1, "{left} mm: {error}");
    }
}

#[test]
fn a_packet_leaves_for_the_pi_while_a_word_is_sent() {
    let mut robot = Robot::up(3);
    robot.sensor.packets.clear();
    robot.rig.exde().sync.record();
    robot.run(Duration::from_millis(200));
    let edges = robot.rig.exde().sync.take_edges();
    let packets = robot.sensor.packets.iter();
    let meanwhile = packets.filter(|sent| {
        let of_word = edges
            .iter()
            .filter(|edge| (sent.from..sent.to).contains(&edge.0));
        of_word.count() > 1
    });
    let both = meanwhile.count();
    assert!(both > 20, "{both} of {}", robot.sensor.packets.len());
}

#[test]
fn a_cut_wire_stops_a_robot_that_follows_the_line() {
    let mut robot = Robot::up(3);
    robot.place(0.0);
    let seq = robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(200));
    assert_ne!(robot.rig.duties(), [0, 0]);
    robot.rig.exde().sync.lose(u64::MAX);
    let cut = robot.rig.cycle();
    let off = robot.run_until_off(Duration::from_millis(300));
    assert!(off.expect("the motors went off") - cut <= milliseconds(200));
    let report = robot.report();
    let stopped = SteerFlags::FAILSAFE.with(SteerFlags::ABORTED);
    assert!(report.flags.contains(stopped), "{report:?}");
    assert!(!report.flags.contains(SteerFlags::EXDE_OK), "and why");
    assert_eq!(report.finished_seq, seq);
    robot.rig.exde().sync.lose(0);
    robot.rig.take_motor_changes();
    robot.run(Duration::from_millis(500));
    assert_eq!(robot.rig.take_motor_changes(), [], "mended, and it stands");
    robot.wheels(WheelCommand::ActiveForward);
    robot.run(Duration::from_millis(100));
    assert_ne!(robot.rig.duties(), [0, 0], "ordered anew");
    assert!(robot.report().flags.contains(SteerFlags::EXDE_OK));
}

#[test]
fn either_board_may_restart_and_the_words_come_back() {
    for board in Board::BOTH {
        let mut robot = Robot::up(4);
        robot.place(0.0);
        robot.rig.reset(board, ResetLine::External);
        robot.run(Duration::from_millis(60));
        robot.run(Duration::from_millis(400));
        assert!(
            robot.report().flags.contains(SteerFlags::EXDE_OK),
            "{board:?}"
        );
    }
}
