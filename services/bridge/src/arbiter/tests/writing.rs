//! What is written when, to which board.

use super::*;

#[test]
fn a_fresh_link_gets_two_standbys_with_different_numbers() {
    let bench = Bench::manual();
    let commands: Vec<_> = bench.written.iter().map(|(_, command)| *command).collect();
    assert_eq!(commands.len(), 2);
    assert!(
        commands
            .iter()
            .all(|command| command.command() == Some(STANDBY))
    );
    assert_ne!(commands[0].seq, commands[1].seq);
}

#[test]
fn an_order_is_written_at_once_and_again_every_40_ms() {
    let mut bench = Bench::manual();
    bench.written.clear();
    let start = bench.now;
    let order = drive(Origin::Operator, 1, FORWARD);
    assert_eq!(bench.give(order), Verdict::Executes);
    bench.run_renewed(100, order);
    let times: Vec<_> = bench
        .written
        .iter()
        .map(|(at, command)| {
            assert_eq!(command.command(), Some(FORWARD));
            at.checked_sub(start).unwrap()
        })
        .collect();
    assert_eq!(times, [ms(0), ms(40), ms(80)]);
    let seqs: Vec<_> = bench
        .written
        .iter()
        .map(|(_, command)| command.seq)
        .collect();
    assert!(seqs.iter().all(|seq| *seq == seqs[0]));
}

#[test]
fn of_several_setpoints_in_a_batch_only_the_last_is_written() {
    let mut bench = Bench::manual();
    bench.written.clear();
    bench.give(drive(Origin::Operator, 1, FORWARD));
    bench.give(drive(Origin::Operator, 2, FOLLOW));
    bench.run(1);
    assert_eq!(bench.written.len(), 1);
    assert_eq!(bench.board.code, FOLLOW.code());
}

#[test]
fn a_halt_and_an_arm_order_in_one_batch_run_in_turn() {
    let mut bench = Bench::manual();
    bench.run_renewed(50, drive(Origin::Operator, 1, FORWARD));
    bench.written.clear();
    bench.give(drive(Origin::Operator, 2, STANDBY));
    bench.give(drive(Origin::Operator, 3, ARM_UP));
    bench.run_renewed(400, drive(Origin::Operator, 3, ARM_UP));
    let codes: Vec<_> = bench
        .written
        .iter()
        .map(|(_, command)| command.code)
        .collect();
    assert_eq!(codes[0], STANDBY.code());
    assert!(codes.contains(&ARM_UP.code()));
    assert_eq!(bench.ended(), Some((Origin::Operator, 3, Finish::Done)));
}

#[test]
fn an_arm_order_right_after_a_lapsed_drive_waits_for_the_arm_lock() {
    let mut bench = Bench::manual();
    bench.give(drive(Origin::Operator, 1, FORWARD));
    bench.run(121);
    bench.give(drive(Origin::Operator, 2, ARM_UP));
    let given_at = bench.now;
    bench.run_renewed(60, drive(Origin::Operator, 2, ARM_UP));
    let arm_at = bench
        .written
        .iter()
        .find(|(_, command)| command.command() == Some(ARM_UP))
        .map(|(at, _)| *at)
        .unwrap();
    assert!(arm_at.checked_sub(given_at).unwrap() >= ms(15));
}

#[test]
fn a_board_that_refuses_an_order_ends_it_so() {
    let mut bench = Bench::manual();
    // The board still drives by a bridge nobody remembers.
    bench.board.code = FORWARD.code();
    bench.give(drive(Origin::Operator, 1, ARM_UP));
    bench.run(10);
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Refused)));
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, ARM_UP)),
        Verdict::Ended(Finish::Refused)
    );
}

#[test]
fn a_board_that_gave_up_a_live_setpoint_is_told_anew() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(100, order);
    bench.connected = false;
    bench.run_renewed(300, order);
    assert!(bench.board.failsafe);
    bench.connected = true;
    bench.run_renewed(300, order);
    assert_eq!(bench.board.code, FOLLOW.code());
    assert!(!bench.board.failsafe);
}

#[test]
fn an_original_board_is_told_each_command_once() {
    let mut bench = Bench::autonomous();
    bench.arbiter = Arbiter::new();
    bench.arbiter.set_mode(Mode::Autonomous);
    bench.arbiter.board_up(bench.now, Version::Original, false);
    bench.written.clear();
    bench.run(100);
    bench.run_renewed(500, drive(Origin::Logic, 1, FOLLOW));
    bench.run_renewed(3_400, drive(Origin::Logic, 2, LEFT_PERP));
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Done)));
    bench.run_renewed(3_400, drive(Origin::Logic, 3, LEFT_PERP));
    bench.run_renewed(100, drive(Origin::Logic, 4, FOLLOW));
    bench.run(500);
    let codes: Vec<_> = bench
        .written
        .iter()
        .map(|(_, command)| command.command().unwrap())
        .collect();
    assert_eq!(
        codes,
        [
            STANDBY, FOLLOW, LEFT_PERP, STANDBY, LEFT_PERP, STANDBY, FOLLOW, STANDBY
        ]
    );
}

#[test]
fn what_an_original_board_reports_ends_no_order() {
    let mut arbiter = Arbiter::new();
    arbiter.board_up(ms(0), Version::Original, false);
    arbiter.order(ms(0), &drive(Origin::Operator, 1, ARM_UP));
    while arbiter.poll(ms(0)).is_some() {}
    for seq in 0..=u8::MAX {
        let mut data = Board::new().step(ms(1));
        data.finished_seq = seq;
        data.flags = SteerFlags(0xFF);
        arbiter.observe(ms(1), &data);
    }
    assert!(arbiter.current().is_some());
}

#[test]
fn nothing_is_written_while_no_board_is_up() {
    let mut arbiter = Arbiter::new();
    arbiter.order(ms(0), &drive(Origin::Operator, 1, FORWARD));
    assert_eq!(arbiter.poll(ms(10)), None);
    arbiter.board_up(ms(20), Version::One, false);
    let mut written = Vec::new();
    while let Some(command) = arbiter.poll(ms(20)) {
        written.push(command.command().unwrap());
    }
    assert_eq!(written, [STANDBY, FORWARD]);
    arbiter.board_down();
    assert_eq!(arbiter.poll(ms(90)), None);
}

#[test]
fn a_one_shot_never_gets_the_number_the_board_last_finished() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(3_010, drive(Origin::Logic, 1, LEFT_PERP));
    let finished = bench.board.finished_seq;
    for id in 2..1_000 {
        bench.give(drive(Origin::Logic, id, LEFT_DIAG));
        let seq = bench.health().wire_seq;
        assert_ne!(seq, 0);
        assert_ne!(seq, finished);
    }
}

#[test]
fn a_parked_arbiter_writes_standby_again_and_again_and_takes_no_orders() {
    for version in [Version::One, Version::Original] {
        let mut arbiter = Arbiter::new();
        arbiter.board_up(ms(0), version, false);
        arbiter.order(ms(0), &drive(Origin::Operator, 1, FORWARD));
        while arbiter.poll(ms(0)).is_some() {}
        arbiter.park();
        assert_eq!(
            arbiter.order(ms(1), &drive(Origin::Operator, 2, FORWARD)),
            Verdict::Ignored(Ignored::ShuttingDown)
        );
        let written: Vec<_> = (1..100).filter_map(|now| arbiter.poll(ms(now))).collect();
        assert!(written.len() >= 4, "{version:?}");
        assert!(
            written
                .iter()
                .all(|command| command.command() == Some(STANDBY))
        );
    }
}

#[test]
fn the_next_due_time_misses_nothing() {
    // A shell that wakes only when told writes the same as one that looks every millisecond.
    let mut eager = Bench::manual();
    let mut lazy = eager.arbiter.clone();
    let order = drive(Origin::Operator, 1, FORWARD);
    eager.written.clear();
    eager.board = Board::new();
    eager.connected = false;
    let start = eager.now;
    eager.give(order);
    eager.run(400);
    let mut written = Vec::new();
    lazy.order(start, &order);
    let mut now = start;
    while now < start + ms(400) {
        while let Some(command) = lazy.poll(now) {
            written.push((now, command));
        }
        now = lazy.next_due().unwrap().max(now);
    }
    written.retain(|(at, _)| *at < start + ms(400));
    assert_eq!(eager.written, written);
}
