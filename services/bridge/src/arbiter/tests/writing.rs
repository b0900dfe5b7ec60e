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

/// An arbiter with an original board, which may be driven or not.
fn with_original_board(mode: Mode, accepted: bool) -> Bench {
    let mut bench = Bench::new(mode);
    bench.arbiter = Arbiter::new();
    bench.arbiter.set_mode(mode);
    bench.arbiter.drive_original_boards(accepted);
    bench.arbiter.board_up(bench.now, Version::Original, false);
    bench.written.clear();
    bench
}

#[test]
fn an_original_board_is_told_each_moving_command_once_and_standby_again_and_again() {
    let mut bench = with_original_board(Mode::Autonomous, true);
    bench.run(100);
    bench.run_renewed(500, drive(Origin::Logic, 1, FOLLOW));
    bench.run_renewed(3_400, drive(Origin::Logic, 2, LEFT_PERP));
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Done)));
    bench.run_renewed(3_400, drive(Origin::Logic, 3, LEFT_PERP));
    bench.run_renewed(100, drive(Origin::Logic, 4, FOLLOW));
    bench.run(500);
    let mut codes: Vec<_> = bench
        .written
        .iter()
        .map(|(_, command)| command.command().unwrap())
        .collect();
    let moving = codes.iter().filter(|command| moves(**command)).count();
    assert_eq!(moving, 4);
    codes.dedup();
    assert_eq!(
        codes,
        [
            STANDBY, FOLLOW, LEFT_PERP, STANDBY, LEFT_PERP, STANDBY, FOLLOW, STANDBY
        ]
    );
    let pause = |pair: &[(Duration, SteerCommand)]| pair[1].0.checked_sub(pair[0].0).unwrap();
    let standing = bench.written.windows(2).filter(|pair| {
        pair.iter()
            .all(|(_, command)| command.command() == Some(STANDBY))
    });
    assert!(standing.clone().count() > 10);
    assert!(standing.map(pause).all(|pause| pause == RENEWAL));
}

#[test]
fn an_original_board_is_never_driven_faster_than_a_person_asks() {
    let slow = Command::Wheel(WheelCommand::SlowForward);
    let mut bench = with_original_board(Mode::Manual, true);
    let refused = bench.give(drive(Origin::Operator, 1, slow));
    assert_eq!(refused, Verdict::Refused(Refusal::FullSpeedOnly));
    bench.run(500);
    assert!(
        bench
            .written
            .iter()
            .all(|(_, command)| command.command() == Some(STANDBY))
    );
    // At full speed the person drives it.
    let given = bench.give(drive(Origin::Operator, 2, FORWARD));
    assert_eq!(given, Verdict::Executes);
    // The same order cannot become slower or faster under way.
    let changed = bench.give(drive(Origin::Operator, 2, slow));
    assert_eq!(changed, Verdict::Refused(Refusal::CodeChanged));

    // An order that an earlier bridge gave to another board ends, too.
    let mut bench = Bench::manual();
    bench.give(drive(Origin::Operator, 1, slow));
    bench.run(20);
    bench.arbiter = Arbiter::resume(&bench.health(), bench.now);
    bench.arbiter.drive_original_boards(true);
    bench.arbiter.board_up(bench.now, Version::Original, false);
    bench.written.clear();
    bench.run_renewed(200, drive(Origin::Operator, 1, slow));
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Aborted)));
    assert!(
        bench
            .written
            .iter()
            .all(|(_, command)| command.command() == Some(STANDBY))
    );
}

#[test]
fn an_original_board_is_told_standby_only_unless_that_was_accepted() {
    let mut bench = with_original_board(Mode::Manual, false);
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, FORWARD)),
        Verdict::Refused(Refusal::OriginalBoard)
    );
    bench.run(500);
    bench.arbiter.set_mode(Mode::Autonomous);
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FOLLOW)),
        Verdict::Ignored(Refusal::OriginalBoard)
    );
    bench.run(500);
    assert_eq!(bench.health().blocked, Refusal::OriginalBoard);
    assert!(bench.written.len() > 20, "it is told to stand");
    assert!(
        bench
            .written
            .iter()
            .all(|(_, command)| command.command() == Some(STANDBY))
    );
}

#[test]
fn what_an_original_board_is_told_by_hand_is_summed() {
    let mut bench = with_original_board(Mode::Manual, true);
    bench.run_renewed(1_000, drive(Origin::Operator, 1, FORWARD));
    bench.run(1_000);
    let driven = bench.health().driven_by_hand;
    assert!((200_000_000..230_000_000).contains(&driven), "{driven}");
}

#[test]
fn what_an_original_board_reports_ends_no_order() {
    let mut arbiter = Arbiter::new();
    arbiter.drive_original_boards(true);
    arbiter.board_up(ms(0), Version::Original, false);
    arbiter.order(ms(0), Duration::ZERO, &drive(Origin::Operator, 1, ARM_UP));
    turn(&mut arbiter, ms(0));
    for seq in 0..=u8::MAX {
        let mut data = board().step(ms(1));
        data.finished_seq = seq;
        data.flags = SteerFlags(0xFF);
        arbiter.observe(ms(1), &data);
    }
    assert!(arbiter.current().is_some());
}

#[test]
fn nothing_is_written_while_no_board_is_up() {
    let mut arbiter = Arbiter::new();
    arbiter.set_mode(Mode::Autonomous);
    let forward = drive(Origin::Logic, 1, FORWARD);
    assert_eq!(
        arbiter.order(ms(0), Duration::ZERO, &forward),
        Verdict::Ignored(Refusal::NoBoard)
    );
    assert_eq!(turn(&mut arbiter, ms(10)), []);
    arbiter.board_up(ms(20), Version::One, false);
    arbiter.order(ms(20), Duration::ZERO, &forward);
    let written = turn(&mut arbiter, ms(20));
    let commands = [written[0].command(), written[1].command()];
    assert_eq!(commands, [Some(STANDBY), Some(FORWARD)]);
    assert_eq!(written.len(), 2);
    arbiter.board_down();
    assert_eq!(turn(&mut arbiter, ms(90)), []);
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
        arbiter.order(ms(0), Duration::ZERO, &drive(Origin::Operator, 1, FORWARD));
        turn(&mut arbiter, ms(0));
        arbiter.park();
        assert_eq!(
            arbiter.order(ms(1), Duration::ZERO, &drive(Origin::Operator, 2, FORWARD)),
            Verdict::Ignored(Refusal::ShuttingDown)
        );
        let written: Vec<_> = (1..100)
            .flat_map(|now| turn(&mut arbiter, ms(now)))
            .collect();
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
    eager.board = board();
    eager.connected = false;
    let start = eager.now;
    eager.give(order);
    eager.run(400);
    let mut written = Vec::new();
    lazy.order(start, Duration::ZERO, &order);
    let mut now = start;
    while now < start + ms(400) {
        let due = turn(&mut lazy, now).into_iter();
        written.extend(due.map(|command| (now, command)));
        now = lazy.next_due().unwrap().max(now);
    }
    written.retain(|(at, _)| *at < start + ms(400));
    assert_eq!(eager.written, written);
}

#[test]
fn orders_that_come_faster_than_the_wire_carries_do_not_pile_up_before_a_standby() {
    let mut bench = Bench::manual();
    bench.arbiter.pace(ms(12));
    bench.written.clear();
    // Another order each millisecond, as from somebody who answers every question at once.
    for id in 1..=600 {
        let command = [FORWARD, FOLLOW][id as usize % 2];
        bench.give(drive(Origin::Operator, id, command));
        bench.run(1);
    }
    let times: Vec<_> = bench.written.iter().map(|(at, _)| *at).collect();
    assert!(times.len() > 40, "{}", times.len());
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= ms(12)));
    // The last one is carried out, and a stop does not wait for it.
    bench.written.clear();
    let start = bench.now;
    bench.arbiter.stop();
    bench.run(1);
    let (at, command) = bench.written[0];
    assert_eq!(
        (at.checked_sub(start), command.command()),
        (Some(ms(0)), Some(STANDBY))
    );
}

#[test]
fn who_moves_and_stands_in_turn_fills_the_wire_with_no_more_than_it_carries() {
    let mut bench = Bench::manual();
    bench.arbiter.pace(ms(12));
    bench.written.clear();
    let start = bench.now;
    for id in 1..=600 {
        let command = [FORWARD, STANDBY][id as usize % 2];
        bench.give(drive(Origin::Operator, id, command));
        bench.run(1);
    }
    let carried = (bench.now - start).as_millis() / 12;
    let written = bench.written.len() as u128;
    assert!(
        written > carried / 2 && written <= carried + 2,
        "{written} of {carried}"
    );
}

#[test]
fn what_finds_the_driver_full_is_given_again_shortly_however_long_a_packet_takes() {
    for command in [STANDBY, FOLLOW] {
        let mut bench = Bench::manual();
        bench.arbiter.pace(ms(30));
        bench.give(drive(Origin::Operator, 1, FORWARD));
        bench.run(1);
        match command {
            STANDBY => bench.arbiter.stop(),
            _ => drop(bench.give(drive(Origin::Operator, 2, command))),
        }
        bench.now += ms(30);
        let given = |bench: &mut Bench| bench.arbiter.poll(bench.now).map(|it| it.command());
        assert_eq!(given(&mut bench), Some(Some(command)));
        for _ in 0..8 {
            bench.arbiter.not_written(bench.now);
            bench.now += ms(5);
            assert_eq!(bench.arbiter.next_due(), Some(bench.now), "{command:?}");
            assert_eq!(given(&mut bench), Some(Some(command)));
        }
        // What was not written has not filled the wire.
        bench.now += ms(30);
        bench.arbiter.resume_from_stop();
        bench.give(drive(Origin::Operator, 3, FORWARD));
        assert_eq!(given(&mut bench), Some(Some(FORWARD)));
    }
}
