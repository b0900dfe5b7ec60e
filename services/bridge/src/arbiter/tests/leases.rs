//! Leases, ids, and what the newest order does to the older.

use super::*;

#[test]
fn a_lease_ends_120_ms_after_the_last_renewal_and_not_before() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.give(order);
    bench.run(50);
    assert_eq!(bench.give(order), Verdict::Renewed);
    let renewed_at = bench.now;
    bench.run(300);
    let (halted_at, halt) = bench
        .written
        .iter()
        .rev()
        .find(|(_, command)| command.command() == Some(FORWARD))
        .map(|(last, _)| *last)
        .and_then(|last| bench.written.iter().find(|(at, _)| *at > last))
        .copied()
        .unwrap();
    assert_eq!(halt.command(), Some(STANDBY));
    assert_eq!(halted_at.checked_sub(renewed_at).unwrap(), SETPOINT);
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Aborted)));
    assert_eq!(bench.health().leases_expired, 1);
}

#[test]
fn sending_again_does_not_extend_a_lease() {
    let mut bench = Bench::manual();
    bench.give(drive(Origin::Operator, 1, FORWARD));
    bench.run(119);
    assert!(code_moves(bench.board.code));
    bench.run(2);
    assert!(!code_moves(bench.board.code));
}

#[test]
fn an_order_that_lay_in_a_queue_is_as_old_as_it_is() {
    let mut bench = Bench::manual();
    let stale = bench.now.checked_sub(SETPOINT).unwrap();
    bench
        .arbiter
        .order(stale, SETPOINT, &drive(Origin::Operator, 1, FORWARD));
    bench.run(200);
    assert!(!bench.board.executed.contains(&FORWARD.code()));
}

#[test]
fn a_late_renewal_moves_nothing_and_its_origin_hears_the_end() {
    let mut bench = Bench::autonomous();
    for (id, command) in [(1, FOLLOW), (2, LEFT_PERP)] {
        bench.give(drive(Origin::Logic, id, command));
        bench.run(200);
        assert!(!code_moves(bench.board.code));
        bench.give(drive(Origin::Operator, id, DROP));
        assert_eq!(
            bench.give(drive(Origin::Logic, id, command)),
            Verdict::Ended(Finish::Aborted)
        );
        assert_eq!(bench.ended(), Some((Origin::Logic, id, Finish::Aborted)));
        bench.run_renewed(200, drive(Origin::Logic, id, command));
        assert!(!code_moves(bench.board.code));
    }
    bench.run_renewed(50, drive(Origin::Logic, 3, FOLLOW));
    assert!(code_moves(bench.board.code), "a new order does");
}

#[test]
fn to_stand_is_taken_up_again_by_a_late_renewal() {
    let mut bench = Bench::autonomous();
    bench.give(granted_standby(1));
    bench.run(200);
    assert_eq!(bench.arbiter.current(), None);
    assert_eq!(bench.give(granted_standby(1)), Verdict::Executes);
}

#[test]
fn renewals_that_come_after_a_pause_of_the_bridge_take_nothing_up() {
    for (origin, command) in [
        (Origin::Operator, FORWARD),
        (Origin::Operator, LEFT_DIAG),
        (Origin::Logic, FOLLOW),
    ] {
        let mut bench = Bench::new(match origin {
            Origin::Operator => Mode::Manual,
            Origin::Logic => Mode::Autonomous,
        });
        let order = drive(origin, 1, command);
        bench.run_renewed(100, order);
        let frozen = bench.now;
        // The origin renews, the board stops by itself, and nobody reads.
        bench.board.step(frozen + ms(1_000));
        bench.now += ms(1_000);
        bench.arbiter.wake(bench.now);
        for sent in (40..=1_000).step_by(40) {
            let verdict = bench.arbiter.order(frozen + ms(sent), ms(0), &order);
            assert_eq!(verdict, Verdict::Ended(Finish::Aborted), "{sent} ms");
        }
        bench.board.executed.clear();
        bench.run_renewed(400, order);
        assert!(!bench.board.executed.contains(&command.code()));
        bench.run_renewed(50, drive(origin, 2, command));
        assert!(code_moves(bench.board.code), "a new order does");
    }
}

#[test]
fn what_was_read_too_late_is_refused_whoever_gave_it_but_a_standby() {
    let late = LATEST_MOVE + ms(1);
    for (origin, command) in [
        (Origin::Operator, LEFT_DIAG),
        (Origin::Operator, ARM_UP),
        (Origin::Logic, FOLLOW),
    ] {
        let mut bench = Bench::new(match origin {
            Origin::Operator => Mode::Manual,
            Origin::Logic => Mode::Autonomous,
        });
        let mut give = |id, age, command| {
            let order = drive(origin, id, command);
            bench.arbiter.order(bench.now, age, &order)
        };
        assert_eq!(give(1, LATEST_MOVE, command), Verdict::Executes);
        let refused = match origin {
            Origin::Operator => Verdict::Refused(Refusal::Stale),
            // It renews, and its next sample is as old as it is.
            Origin::Logic => Verdict::Ignored(Refusal::Stale),
        };
        assert_eq!(give(2, late, command), refused);
        assert_eq!(give(3, late, STANDBY), Verdict::Executes);
        let health = bench.health();
        assert_eq!(
            (health.refused_id, health.refusal.get()),
            (2, Some(Refusal::Stale)),
            "its giver is told"
        );
    }
}

#[test]
fn two_equal_turns_are_two_and_a_refresh_is_none() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(3_100, drive(Origin::Logic, 1, LEFT_PERP));
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Done)));
    let turns = |bench: &Bench| {
        bench
            .board
            .executed
            .iter()
            .filter(|code| **code == LEFT_PERP.code())
            .count()
    };
    assert_eq!(turns(&bench), 1);
    bench.run_renewed(500, drive(Origin::Logic, 1, LEFT_PERP));
    assert_eq!(turns(&bench), 1, "renewing a finished turn is no turn");
    bench.run_renewed(3_100, drive(Origin::Logic, 2, LEFT_PERP));
    assert_eq!(turns(&bench), 2);
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Done)));
}

#[test]
fn the_end_of_an_order_is_told_again_to_who_missed_it() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(3_010, drive(Origin::Logic, 1, LEFT_PERP));
    bench.give(drive(Origin::Operator, 9, DROP));
    assert_eq!(bench.ended(), Some((Origin::Operator, 9, Finish::Refused)));
    let revision = bench.arbiter.revision();
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, LEFT_PERP)),
        Verdict::Ended(Finish::Done)
    );
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Done)));
    assert_ne!(bench.arbiter.revision(), revision);
}

#[test]
fn a_newer_one_shot_takes_over_and_the_older_is_aborted() {
    let mut bench = Bench::autonomous();
    bench.run_renewed(500, drive(Origin::Logic, 1, LEFT_PERP));
    bench.give(drive(Origin::Logic, 2, LEFT_DIAG));
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
    bench.run_renewed(3_100, drive(Origin::Logic, 2, LEFT_DIAG));
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Done)));
}

#[test]
fn an_order_that_was_replaced_does_not_come_back() {
    let mut bench = Bench::manual();
    let panel = drive(Origin::Operator, 1, FORWARD);
    let cli = drive(Origin::Operator, 2, FOLLOW);
    bench.give(panel);
    bench.run(10);
    bench.give(cli);
    bench.run(10);
    assert_eq!(bench.give(panel), Verdict::Ended(Finish::None));
    bench.run(10);
    assert_eq!(bench.board.code, FOLLOW.code());
}

#[test]
fn the_same_id_with_another_code_is_refused_and_does_not_renew() {
    let mut bench = Bench::manual();
    bench.give(drive(Origin::Operator, 1, FORWARD));
    bench.run(100);
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, FOLLOW)),
        Verdict::Refused(Refusal::CodeChanged)
    );
    bench.run(30);
    assert!(!code_moves(bench.board.code));
}

#[test]
fn a_late_renewal_of_a_persons_setpoint_moves_nothing() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    bench.run(200);
    assert_eq!(bench.give(order), Verdict::Ended(Finish::Aborted));
    bench.run_renewed(200, order);
    assert!(!code_moves(bench.board.code));
    bench.run_renewed(50, drive(Origin::Operator, 2, FORWARD));
    assert!(code_moves(bench.board.code), "a new order does");
}

#[test]
fn a_persons_order_that_everybody_has_forgotten_is_too_old_to_begin() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    for id in 2..100 {
        bench.give(drive(Origin::Operator, id, FOLLOW));
        bench.run(20);
    }
    bench.run(200);
    let late = |bench: &mut Bench, order| bench.arbiter.order(bench.now, ms(2_000), &order);
    assert_eq!(late(&mut bench, order), Verdict::Refused(Refusal::Stale));
    bench.run(50);
    assert!(!code_moves(bench.board.code));
    // In force it is renewed however long ago it was given.
    let renewed = drive(Origin::Operator, 200, FORWARD);
    bench.give(renewed);
    assert_eq!(late(&mut bench, renewed), Verdict::Renewed);
}
