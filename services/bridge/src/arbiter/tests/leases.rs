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
    assert_eq!(halted_at.checked_sub(renewed_at).unwrap(), LEASE);
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
    let stale = bench.now.checked_sub(LEASE).unwrap();
    bench
        .arbiter
        .order(stale, stale, &drive(Origin::Operator, 1, FORWARD));
    bench.run(200);
    assert!(!bench.board.executed.contains(&FORWARD.code()));
}

#[test]
fn a_late_renewal_takes_logics_lapsed_setpoint_up_again_but_not_its_one_shot() {
    let mut bench = Bench::autonomous();
    bench.give(drive(Origin::Logic, 1, FOLLOW));
    bench.run(200);
    assert!(!code_moves(bench.board.code));
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FOLLOW)),
        Verdict::Executes
    );
    bench.run(10);
    assert_eq!(bench.board.code, FOLLOW.code());

    bench.give(drive(Origin::Logic, 2, LEFT_PERP));
    bench.run(200);
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Aborted)));
    assert_eq!(
        bench.give(drive(Origin::Logic, 2, LEFT_PERP)),
        Verdict::Ended(Finish::Aborted)
    );
    bench.run(50);
    assert!(!code_moves(bench.board.code));
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
    let given = bench.now;
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    for id in 2..100 {
        bench.give(drive(Origin::Operator, id, FOLLOW));
        bench.run(20);
    }
    bench.run(200);
    let late = |bench: &mut Bench, order| bench.arbiter.order(bench.now, given, &order);
    assert_eq!(late(&mut bench, order), Verdict::Refused(Refusal::Stale));
    bench.run(50);
    assert!(!code_moves(bench.board.code));
    // In force it is renewed however long ago it was given; logic's order is not asked for it.
    bench
        .arbiter
        .order(bench.now, bench.now, &drive(Origin::Operator, 200, FORWARD));
    let renewed = drive(Origin::Operator, 200, FORWARD);
    assert_eq!(late(&mut bench, renewed), Verdict::Renewed);
    bench.arbiter.set_mode(Mode::Autonomous);
    assert_eq!(
        late(&mut bench, drive(Origin::Logic, 1, FOLLOW)),
        Verdict::Executes
    );
}
