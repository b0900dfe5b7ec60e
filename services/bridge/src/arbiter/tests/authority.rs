//! Who may steer: mode, stop, grant, refusals.

use super::*;

#[test]
fn a_stop_latches_until_resumed() {
    for (mode, driver) in [
        (Mode::Manual, Origin::Operator),
        (Mode::Autonomous, Origin::Logic),
    ] {
        let mut bench = Bench::new(mode);
        let order = drive(driver, 1, FORWARD);
        bench.run_renewed(100, order);
        bench.arbiter.stop();
        bench.run(1);
        assert!(!code_moves(bench.board.code));
        let person = driver == Origin::Operator;
        let new = match person {
            true => Verdict::Refused(Refusal::StopLatched),
            false => Verdict::Ignored(Refusal::StopLatched),
        };
        let same = Verdict::Ended(Finish::Aborted);
        assert_eq!(bench.give(order), same, "the same order");
        assert_eq!(bench.give(drive(driver, 2, FORWARD)), new, "a new order");
        let from = bench.written.len();
        bench.run(1_000);
        assert!(bench.written.len() > from + 10, "standby is renewed");
        let rest = &bench.written[from..];
        assert!(
            rest.iter()
                .all(|(_, command)| command.command() == Some(STANDBY))
        );

        bench.arbiter.resume_from_stop();
        bench.run(500);
        assert!(
            !code_moves(bench.board.code),
            "resuming alone moves nothing"
        );
        // What was wanted before the stop is not what is wanted after it, nor what a person wanted
        // during it.
        assert_eq!(bench.give(order), same);
        if person {
            assert_eq!(
                bench.give(drive(driver, 2, FORWARD)),
                Verdict::Ended(Finish::Refused)
            );
        }
        let id = if person { 3 } else { 2 };
        assert_eq!(bench.give(drive(driver, id, FORWARD)), Verdict::Executes);
        bench.run(1);
        assert!(code_moves(bench.board.code));
    }
}

#[test]
fn a_stop_is_due_at_once_though_the_driver_took_nothing_a_moment_ago() {
    let mut bench = Bench::manual();
    bench.run_renewed(50, drive(Origin::Operator, 1, FORWARD));
    bench.arbiter.not_written(bench.now);
    bench.arbiter.stop();
    let written = bench.arbiter.poll(bench.now);
    assert_eq!(written.and_then(|it| it.command()), Some(STANDBY));
    // So it is for who stops a robot that is stopped.
    assert_eq!(bench.arbiter.poll(bench.now), None);
    bench.arbiter.stop();
    assert!(bench.arbiter.poll(bench.now).is_some());
}

#[test]
fn a_stopped_original_board_is_told_standby_again_and_again() {
    let mut bench = Bench::manual();
    bench.arbiter.board_up(bench.now, Version::Original, false);
    bench.arbiter.stop();
    let from = bench.written.len();
    bench.run(400);
    assert!(bench.written.len() >= from + 10);
}

#[test]
fn only_the_mode_decides_who_drives() {
    let mut bench = Bench::manual();
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FORWARD)),
        Verdict::Ignored(Refusal::NotInCharge)
    );
    bench.run(50);
    assert!(!code_moves(bench.board.code));
    bench.arbiter.set_mode(Mode::Autonomous);
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FORWARD)),
        Verdict::Executes
    );
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, FORWARD)),
        Verdict::Refused(Refusal::NotInCharge)
    );
    bench.run(1);
    assert!(code_moves(bench.board.code));
    bench.arbiter.set_mode(Mode::Manual);
    bench.run(1);
    assert!(
        !code_moves(bench.board.code),
        "a change of the mode halts the robot"
    );
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
}

#[test]
fn an_ignored_origin_is_counted_once_for_each_order() {
    let mut bench = Bench::manual();
    let before = bench.health().orders_refused;
    for id in [1, 1, 1, 2, 2] {
        bench.give(drive(Origin::Logic, id, FORWARD));
    }
    assert_eq!(bench.health().orders_refused - before, 2);
}

#[test]
fn undefined_codes_are_refused_counted_and_change_nothing() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    let undefined = (0..=u8::MAX).filter(|code| Command::from_code(*code).is_none());
    let mut count = 0;
    for (id, code) in (100..).zip(undefined) {
        let bad = SteeringOrder {
            code,
            ..drive(Origin::Operator, id, FORWARD)
        };
        assert_eq!(bench.give(bad), Verdict::Refused(Refusal::Undefined));
        count += 1;
    }
    assert_eq!(count, 256 - 30);
    assert_eq!(bench.health().orders_refused, count);
    bench.run(1);
    assert_eq!(bench.board.code, FORWARD.code());
    assert_eq!(bench.give(order), Verdict::Renewed);
}

#[test]
fn an_order_from_nobody_is_refused() {
    let mut bench = Bench::manual();
    let mut order = drive(Origin::Operator, 1, FORWARD);
    order.origin = lager_sample::Tag::from_raw(9);
    assert_eq!(bench.give(order), Verdict::Refused(Refusal::Undefined));
    bench.run(50);
    assert!(!code_moves(bench.board.code));
}

#[test]
fn quarter_turns_and_the_drop_are_logics_alone() {
    for command in [LEFT_PERP, Command::Wheel(WheelCommand::RightPerp), DROP] {
        for mode in [Mode::Manual, Mode::Autonomous] {
            let mut bench = Bench::new(mode);
            bench.give(granted_standby(1));
            assert_eq!(
                bench.give(drive(Origin::Operator, 2, command)),
                Verdict::Refused(Refusal::LogicOnly)
            );
        }
        let mut bench = Bench::autonomous();
        assert_eq!(
            bench.give(drive(Origin::Logic, 2, command)),
            Verdict::Executes
        );
    }
}

#[test]
fn an_arm_order_while_driving_is_refused_and_the_drive_goes_on() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    assert_eq!(
        bench.give(drive(Origin::Operator, 2, ARM_UP)),
        Verdict::Refused(Refusal::ArmLocked)
    );
    assert_eq!(bench.ended(), Some((Origin::Operator, 2, Finish::Refused)));
    assert_eq!(bench.give(order), Verdict::Renewed);
    bench.run(10);
    assert_eq!(bench.board.code, FORWARD.code());
}

#[test]
fn the_operator_moves_the_arm_while_logic_stands_and_lets_him() {
    let mut bench = Bench::autonomous();
    assert_eq!(
        bench.give(drive(Origin::Operator, 11, ARM_UP)),
        Verdict::Refused(Refusal::NotInCharge)
    );
    bench.give(drive(Origin::Logic, 1, STANDBY));
    assert_eq!(
        bench.give(drive(Origin::Operator, 12, ARM_UP)),
        Verdict::Refused(Refusal::NotInCharge),
        "a standby without the grant lets nobody"
    );
    let grant = granted_standby(2);
    bench.give(grant);
    bench.run(30);
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, ARM_UP)),
        Verdict::Executes
    );
    assert_eq!(
        bench.give(drive(Origin::Operator, 2, FORWARD)),
        Verdict::Refused(Refusal::NotInCharge)
    );
    for step in 0..400 {
        if step % 40 == 0 {
            assert_eq!(bench.give(grant), Verdict::Renewed);
            bench.give(drive(Origin::Operator, 1, ARM_UP));
        }
        bench.run(1);
    }
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Done)));
    assert_eq!(
        bench.arbiter.current().map(|(key, _)| (key.origin, key.id)),
        Some((Origin::Logic, 2)),
        "logic's standby is in force again"
    );
    let arms = bench
        .board
        .executed
        .iter()
        .filter(|code| **code == ARM_UP.code());
    assert_eq!(arms.count(), 1);
}

#[test]
fn the_grant_ends_with_logics_lease_with_its_withdrawal_and_with_logics_next_order() {
    let begin = || {
        let mut bench = Bench::autonomous();
        bench.give(granted_standby(1));
        bench.give(drive(Origin::Operator, 7, SQUEEZE));
        bench.run(20);
        assert_eq!(bench.board.code, SQUEEZE.code());
        bench
    };

    let mut bench = begin();
    bench.run_renewed(150, drive(Origin::Operator, 7, SQUEEZE));
    assert_eq!(bench.board.code, STANDBY.code(), "logic fell silent");
    assert_eq!(bench.ended(), Some((Origin::Operator, 7, Finish::Aborted)));
    assert_eq!(bench.arbiter.current(), None);

    let mut bench = begin();
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, STANDBY)),
        Verdict::Renewed
    );
    bench.run(2);
    assert_eq!(bench.board.code, STANDBY.code(), "logic withdrew the grant");
    assert_eq!(
        bench.give(drive(Origin::Operator, 8, SQUEEZE)),
        Verdict::Refused(Refusal::NotInCharge)
    );

    let mut bench = begin();
    bench.give(drive(Origin::Logic, 2, FOLLOW));
    bench.run(2);
    assert_eq!(bench.board.code, FOLLOW.code());
    assert_eq!(bench.ended(), Some((Origin::Operator, 7, Finish::Aborted)));
}

#[test]
fn an_operator_who_falls_silent_gives_the_robot_back_to_logic() {
    let mut bench = Bench::autonomous();
    let grant = granted_standby(1);
    bench.give(grant);
    bench.give(drive(Origin::Operator, 7, SQUEEZE));
    bench.run_renewed(200, grant);
    assert_eq!(bench.ended(), Some((Origin::Operator, 7, Finish::Aborted)));
    assert_eq!(bench.arbiter.current().map(|(key, _)| key.id), Some(1));
    assert_eq!(bench.board.code, STANDBY.code());
}

#[test]
fn a_stop_while_the_operator_moves_the_arm_ends_both() {
    let mut bench = Bench::autonomous();
    bench.give(granted_standby(1));
    bench.give(drive(Origin::Operator, 7, SQUEEZE));
    bench.run(20);
    bench.arbiter.stop();
    assert_eq!(bench.arbiter.current(), None);
    bench.run(1);
    assert_eq!(bench.board.code, STANDBY.code());
}

#[test]
fn the_last_refusal_is_told_with_its_reason() {
    let mut bench = Bench::manual();
    assert_eq!(bench.health().refusal, Refusal::None);
    bench.give(drive(Origin::Operator, 5, DROP));
    let told = |bench: &Bench| {
        let health = bench.health();
        (
            health.refused_origin.get().unwrap(),
            health.refused_id,
            health.refusal.get().unwrap(),
        )
    };
    assert_eq!(told(&bench), (Origin::Operator, 5, Refusal::LogicOnly));
    let revision = bench.arbiter.revision();
    bench.give(drive(Origin::Logic, 6, FORWARD));
    assert_eq!(told(&bench), (Origin::Logic, 6, Refusal::NotInCharge));
    assert_ne!(bench.arbiter.revision(), revision);
    bench.restart_bridge();
    assert_eq!(told(&bench), (Origin::Logic, 6, Refusal::NotInCharge));
}

#[test]
fn what_a_person_may_not_do_now_he_may_not_do_later_by_the_same_order() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Operator, 1, FORWARD);
    assert_eq!(bench.give(order), Verdict::Refused(Refusal::NotInCharge));
    bench.arbiter.set_mode(Mode::Manual);
    bench.run_renewed(200, order);
    assert!(!bench.board.executed.contains(&FORWARD.code()));
}

#[test]
fn a_change_of_mode_there_and_back_ends_what_a_person_drove() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(50, order);
    bench.arbiter.set_mode(Mode::Autonomous);
    bench.arbiter.set_mode(Mode::Manual);
    bench.run_renewed(200, order);
    assert!(!code_moves(bench.board.code));
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Aborted)));
}
