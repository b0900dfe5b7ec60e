//! Boards and bridges that restart, and every mixture of events.

use super::*;

#[test]
fn a_rebooted_board_drives_on_by_a_live_setpoint_but_repeats_no_turn() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(50, order);
    bench.board = board();
    bench.arbiter.board_up(bench.now, Version::One, true);
    bench.run_renewed(50, order);
    assert_eq!(bench.board.code, FOLLOW.code());

    let turn = drive(Origin::Logic, 2, LEFT_PERP);
    bench.run_renewed(500, turn);
    bench.board = board();
    bench.arbiter.board_up(bench.now, Version::One, true);
    bench.run_renewed(500, turn);
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Aborted)));
    assert!(!bench.board.executed.contains(&LEFT_PERP.code()));
}

#[test]
fn a_reset_or_a_renewed_link_ends_what_a_person_drove() {
    for rebooted in [false, true] {
        let mut bench = Bench::manual();
        let order = drive(Origin::Operator, 1, FORWARD);
        bench.run_renewed(50, order);
        bench.board = board();
        bench.arbiter.board_down();
        bench.arbiter.board_up(bench.now, Version::One, rebooted);
        bench.run_renewed(200, order);
        assert!(!bench.board.executed.contains(&FORWARD.code()));
        assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Aborted)));
        bench.run_renewed(50, drive(Origin::Operator, 2, FORWARD));
        assert!(code_moves(bench.board.code));
    }
}

#[test]
fn a_person_who_goes_on_drives_on_across_a_restart_of_the_bridge() {
    for rebooted in [false, true] {
        let mut bench = Bench::manual();
        let order = drive(Origin::Operator, 1, FORWARD);
        bench.run_renewed(50, order);
        bench.restart_bridge();
        bench.run(1);
        bench.arbiter.board_up(bench.now, Version::One, rebooted);
        bench.run_renewed(200, order);
        assert_eq!(code_moves(bench.board.code), !rebooted);
    }
}

/// A bridge that was killed, or frozen and replaced: the board stops meanwhile, and the origin goes
/// on renewing.
#[test]
fn a_successor_does_not_set_the_robot_off_again_by_an_order_of_before() {
    for (origin, command) in [(Origin::Operator, FORWARD), (Origin::Logic, FOLLOW)] {
        for away in [119, 120, 300, 3_000] {
            for board_comes_after in [1, 60, 130] {
                let mut bench = Bench::new(match origin {
                    Origin::Operator => Mode::Manual,
                    Origin::Logic => Mode::Autonomous,
                });
                let order = drive(origin, 1, command);
                bench.run_renewed(300, order);
                let (kept, published) = (bench.health(), bench.now);
                bench.arbiter = Arbiter::new();
                bench.run(away);
                bench.arbiter = Arbiter::resume(&kept, published);
                bench.run_renewed(board_comes_after, order);
                bench.arbiter.board_up(bench.now, Version::One, false);
                bench.board.executed.clear();
                bench.run_renewed(500, order);
                let what = format!("{origin:?}, away {away} ms, board after {board_comes_after}");
                assert!(!bench.board.executed.contains(&command.code()), "{what}");
                let (of, id, finish) = bench.ended().expect(&what);
                assert_eq!((of, id, finish), (origin, 1, Finish::Aborted), "{what}");
                bench.run_renewed(50, drive(origin, 2, command));
                assert!(code_moves(bench.board.code), "{what}: a new order does");
            }
        }
    }
}

#[test]
fn what_a_person_drove_is_summed_across_a_restart_of_the_bridge() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(500, drive(Origin::Logic, 1, FOLLOW));
    bench.arbiter.set_mode(Mode::Manual);
    bench.run(300);
    let rolled_out = bench.health().driven_by_hand;
    assert!(
        rolled_out <= 2 * 200 * 1_000,
        "{rolled_out}: logic's are not counted"
    );
    bench.run_renewed(1_000, drive(Origin::Operator, 1, FORWARD));
    bench.run(300);
    let driven = bench.health().driven_by_hand - rolled_out;
    // Both motors at 100, a second and what was left of the lease.
    assert!((200_000_000..230_000_000).contains(&driven), "{driven}");
    let before = bench.health().driven_by_hand;
    bench.restart_bridge();
    assert_eq!(bench.health().driven_by_hand, before);
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(100, drive(Origin::Operator, 2, FORWARD));
    let before = bench.health().driven_by_hand;
    bench.restart_bridge();
    assert!(
        bench.health().driven_by_hand >= before + 200 * 150_000,
        "nobody has counted what the board did alone"
    );
}

#[test]
fn a_turn_goes_on_when_only_the_link_was_renewed() {
    let mut bench = Bench::autonomous();
    let turn = drive(Origin::Logic, 1, LEFT_PERP);
    bench.run_renewed(500, turn);
    bench.arbiter.board_down();
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(3_000, turn);
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Done)));
    let turns = bench
        .board
        .executed
        .iter()
        .filter(|code| **code == LEFT_PERP.code());
    assert_eq!(turns.count(), 1);
}

#[test]
fn a_turn_that_vanished_with_an_unplugged_board_is_not_repeated() {
    let mut bench = Bench::autonomous();
    let turn = drive(Origin::Logic, 1, LEFT_PERP);
    bench.run_renewed(500, turn);
    bench.connected = false;
    bench.arbiter.board_down();
    bench.run_renewed(500, turn);
    bench.board = board();
    bench.connected = true;
    // A port that comes back cannot tell that its board has lost its power meanwhile.
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(500, turn);
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
    assert!(!bench.board.executed.contains(&LEFT_PERP.code()));
}

#[test]
fn a_restarted_bridge_keeps_mode_latch_and_counters() {
    let mut bench = Bench::autonomous();
    bench.give(drive(Origin::Operator, 5, DROP));
    bench.arbiter.stop();
    bench.restart_bridge();
    assert_eq!(bench.arbiter.mode(), Mode::Autonomous);
    assert!(bench.arbiter.is_stopped());
    assert_eq!(bench.health().orders_refused, 1);
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FORWARD)),
        Verdict::Ignored(Refusal::StopLatched)
    );
}

#[test]
fn a_setpoint_that_was_written_and_not_told_keeps_no_later_one_from_the_board() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(50, drive(Origin::Logic, 1, FOLLOW));
    let told = bench.health();
    bench.give(drive(Origin::Logic, 2, FORWARD));
    bench.run(1);
    assert_eq!(bench.board.code, FORWARD.code());
    bench.arbiter = Arbiter::resume(&told, bench.now);
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(50, drive(Origin::Logic, 4, STANDBY));
    assert_eq!(bench.board.code, STANDBY.code());
    bench.run_renewed(50, drive(Origin::Logic, 5, FOLLOW));
    assert_eq!(bench.board.code, FOLLOW.code());
}

#[test]
fn a_restarted_bridge_writes_nothing_until_the_origin_renews() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(100, order);
    bench.restart_bridge();
    bench.written.clear();
    bench.run(1);
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run(50);
    assert!(bench.written.is_empty());
    assert_eq!(bench.give(order), Verdict::Renewed);
    bench.run(1);
    assert_eq!(bench.written.len(), 1);
    assert_eq!(bench.board.code, FOLLOW.code());
}

#[test]
fn a_restarted_bridge_halts_when_nobody_renews() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(100, drive(Origin::Logic, 1, FOLLOW));
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.written.clear();
    bench.run(200);
    assert_eq!(
        bench.written[0].1.command(),
        Some(STANDBY),
        "the lease has lapsed"
    );
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
}

#[test]
fn a_turn_is_carried_out_once_across_a_restart_of_the_bridge_at_any_moment() {
    let mut seen = [0, 0];
    for killed_after in (1..3_300).step_by(7) {
        for away in [20, 140, 400] {
            let mut bench = Bench::autonomous();
            let turn = drive(Origin::Logic, 1, LEFT_PERP);
            bench.run_renewed(killed_after, turn);
            // While the bridge is away the board runs alone; its reports are not heard.
            let (kept, published) = (bench.health(), bench.now);
            bench.arbiter = Arbiter::new();
            bench.run(away);
            bench.arbiter = Arbiter::resume(&kept, published);
            bench.run(1);
            bench.arbiter.board_up(bench.now, Version::One, false);
            bench.run_renewed(3_500, turn);
            let turns = bench
                .board
                .executed
                .iter()
                .filter(|code| **code == LEFT_PERP.code())
                .count();
            assert_eq!(turns, 1, "killed after {killed_after} ms");
            let (origin, id, finish) = bench.ended().unwrap();
            assert_eq!((origin, id), (Origin::Logic, 1));
            let expected = if bench.board.completed == 1 {
                Finish::Done
            } else {
                Finish::Aborted
            };
            assert_eq!(
                finish, expected,
                "killed after {killed_after} ms, away {away} ms"
            );
            seen[usize::from(finish == Finish::Done)] += 1;
        }
    }
    assert!(seen[0] > 100 && seen[1] > 100, "both ends are tried");
}

#[test]
fn a_turn_that_was_published_but_never_written_is_aborted_and_not_lost() {
    let mut bench = Bench::autonomous();
    bench.give(drive(Origin::Logic, 1, LEFT_PERP));
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(100, drive(Origin::Logic, 1, LEFT_PERP));
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
    assert!(!bench.board.executed.contains(&LEFT_PERP.code()));
}

#[test]
fn an_arm_order_goes_on_across_a_restart_of_the_bridge() {
    let mut bench = Bench::autonomous();
    let grant = granted_standby(1);
    let squeeze = drive(Origin::Operator, 7, SQUEEZE);
    bench.give(grant);
    bench.give(squeeze);
    bench.run(50);
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    for step in 0..400 {
        if step % 40 == 0 {
            bench.give(grant);
            bench.give(squeeze);
        }
        bench.run(1);
    }
    assert_eq!(bench.ended(), Some((Origin::Operator, 7, Finish::Done)));
    assert_eq!(
        bench.arbiter.current().map(|(key, _)| (key.origin, key.id)),
        Some((Origin::Logic, 1))
    );
    let squeezes = bench
        .board
        .executed
        .iter()
        .filter(|code| **code == SQUEEZE.code());
    assert_eq!(squeezes.count(), 1);
}

#[test]
fn an_arm_order_of_a_restarted_bridge_needs_logics_leave_again() {
    let mut bench = Bench::autonomous();
    let squeeze = drive(Origin::Operator, 7, SQUEEZE);
    bench.give(granted_standby(1));
    bench.give(squeeze);
    bench.run(50);
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.run_renewed(200, squeeze);
    assert_eq!(bench.ended(), Some((Origin::Operator, 7, Finish::Aborted)));
    assert_eq!(bench.arbiter.current(), None);
}

#[test]
fn a_finished_turn_stays_finished_across_a_restart_of_the_bridge() {
    let mut bench = Bench::autonomous();
    let turn = drive(Origin::Logic, 1, LEFT_PERP);
    bench.run_renewed(3_100, turn);
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    assert_eq!(bench.give(turn), Verdict::Ended(Finish::Done));
    bench.run(100);
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Done)));
}

/// Whatever comes in whatever order: wheels turn only by a live order of the one in charge, and
/// never while a stop is latched. Only right after a restart of the bridge may a board still move
/// by what it was told before, within its own limit.
#[test]
fn no_mixture_of_events_moves_the_robot_without_a_live_order() {
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = |below: u64| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random % below
    };
    let codes = [STANDBY, FORWARD, FOLLOW, LEFT_PERP, LEFT_DIAG, ARM_UP, DROP];
    let mut moved = 0;
    for _ in 0..300 {
        let mut bench = Bench::manual();
        let mut words = std::collections::HashMap::new();
        let mut restarted = Duration::ZERO;
        for _ in 0..300 {
            match next(24) {
                0 => bench.arbiter.stop(),
                1 | 2 => bench.arbiter.resume_from_stop(),
                3 => bench.arbiter.set_mode(Mode::Manual),
                4 => bench.arbiter.set_mode(Mode::Autonomous),
                5 => {
                    bench.restart_bridge();
                    bench.arbiter.board_up(bench.now, Version::One, false);
                    restarted = bench.now;
                }
                6 => {
                    bench.board = board();
                    bench.arbiter.board_up(bench.now, Version::One, true);
                }
                _ => {
                    let origin = [Origin::Logic, Origin::Operator][next(2) as usize];
                    let id = next(40) as u32;
                    let command = codes[id as usize % codes.len()];
                    let order = SteeringOrder {
                        arm_granted: u8::from(next(2) == 0),
                        ..drive(origin, id, command)
                    };
                    bench.give(order);
                    words.insert((origin == Origin::Operator, id), bench.now);
                }
            }
            for _ in 0..next(60) {
                bench.run(1);
                if !code_moves(bench.board.code) || bench.now < restarted + ms(152) {
                    continue;
                }
                moved += 1;
                assert!(!bench.arbiter.is_stopped(), "moving while stopped");
                let (key, command) = bench.arbiter.current().expect("moving without an order");
                assert!(moves(command));
                let by_operator = key.origin == Origin::Operator;
                assert_eq!(by_operator, bench.arbiter.mode() == Mode::Manual);
                let word = words[&(by_operator, key.id)];
                assert!(
                    bench.now <= word + SETPOINT + ms(1),
                    "moving {:?} after the last word",
                    bench.now.checked_sub(word)
                );
            }
        }
    }
    assert!(moved > 10_000, "it moves at all: {moved} ms");
}
