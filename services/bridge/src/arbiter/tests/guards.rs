//! What the board ends by itself, and the arm that waits for its profile.

use super::*;

impl Bench {
    /// The board gives up following; `flags` are those of its reports until another command.
    fn give_up(&mut self, flags: SteerFlags) {
        self.board.finished_seq = self.board.last_seq.expect("it was told something");
        self.board.finish = SteerFlags::ABORTED.with(flags);
        self.board.failsafe = true;
        self.board.code = STANDBY.code();
    }
}

#[test]
fn following_that_the_board_gave_up_is_over_whoever_renews_it() {
    for (flags, finish) in [
        (SteerFlags::NONE, Finish::NoWord),
        (SteerFlags::EXDE_OK, Finish::NoTape),
    ] {
        let mut bench = Bench::autonomous();
        let order = drive(Origin::Logic, 1, FOLLOW);
        bench.run_renewed(400, order);
        bench.board.executed.clear();
        bench.give_up(flags);
        bench.run_renewed(2_000, order);
        assert_eq!(bench.ended(), Some((Origin::Logic, 1, finish)));
        assert_eq!(bench.board.executed, [STANDBY.code()], "never again");
        assert_eq!(bench.arbiter.current(), None);
        // A new order is a new decision.
        bench.run_renewed(100, drive(Origin::Logic, 2, FOLLOW));
        assert_eq!(bench.board.code, FOLLOW.code());
    }
}

#[test]
fn a_restarted_bridge_does_not_take_up_what_the_board_gave_up() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(400, order);
    bench.give_up(SteerFlags::EXDE_OK);
    bench.run(10);
    bench.restart_bridge();
    bench.arbiter.board_up(bench.now, Version::One, false);
    bench.board.executed.clear();
    bench.run_renewed(1_000, order);
    assert!(!bench.board.executed.contains(&FOLLOW.code()));
}

#[test]
fn a_command_that_the_board_gave_up_for_its_age_does_not_set_it_off_again() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(400, order);
    bench.connected = false;
    bench.run_renewed(180, order);
    bench.connected = true;
    bench.board.executed.clear();
    bench.run_renewed(300, order);
    assert!(!bench.board.executed.contains(&FOLLOW.code()));
    assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
    bench.run_renewed(50, drive(Origin::Logic, 2, FOLLOW));
    assert_eq!(bench.board.code, FOLLOW.code());
}

#[test]
fn an_arm_order_waits_until_the_board_obeys_its_limits() {
    let mut bench = Bench::manual();
    bench.arbiter.set_gates(Gate::Open, Gate::Held);
    let order = drive(Origin::Operator, 1, ARM_UP);
    assert_eq!(bench.give(order), Verdict::Executes);
    bench.run_renewed(500, order);
    assert!(!bench.board.executed.contains(&ARM_UP.code()));
    assert_eq!(bench.ended(), None, "it waits");
    bench.arbiter.set_gates(Gate::Open, Gate::Open);
    bench.run_renewed(500, order);
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Done)));
    assert_eq!(bench.board.completed, 1);
}

#[test]
fn no_wheel_turns_until_the_boards_know_their_robot() {
    let mut bench = Bench::manual();
    bench.arbiter.set_gates(Gate::Held, Gate::Open);
    let order = drive(Origin::Operator, 1, FORWARD);
    assert_eq!(bench.give(order), Verdict::Refused(Refusal::Undescribed));
    bench.run_renewed(200, order);
    assert!(!bench.board.executed.contains(&FORWARD.code()));
    bench.arbiter.set_gates(Gate::Open, Gate::Open);
    bench.run_renewed(200, drive(Origin::Operator, 2, FORWARD));
    assert_eq!(bench.board.code, FORWARD.code());
    bench.arbiter.set_gates(Gate::Shut, Gate::Open);
    bench.run_renewed(200, drive(Origin::Operator, 2, FORWARD));
    assert_eq!(bench.board.code, STANDBY.code());
    assert_eq!(bench.ended(), Some((Origin::Operator, 2, Finish::Aborted)));
    let order = drive(Origin::Operator, 3, ARM_UP);
    assert_eq!(bench.give(order), Verdict::Refused(Refusal::Undescribed));
}

#[test]
fn a_setpoint_stands_while_a_board_is_told_and_a_turn_is_over() {
    let mut bench = Bench::manual();
    let order = drive(Origin::Operator, 1, FORWARD);
    bench.run_renewed(200, order);
    bench.arbiter.set_gates(Gate::Held, Gate::Open);
    bench.run_renewed(60, order);
    assert_eq!(bench.board.code, STANDBY.code());
    bench.arbiter.set_gates(Gate::Open, Gate::Open);
    bench.run_renewed(60, order);
    assert_eq!(bench.board.code, FORWARD.code());
    let turn = drive(Origin::Operator, 2, LEFT_DIAG);
    bench.run_renewed(60, turn);
    bench.arbiter.set_gates(Gate::Held, Gate::Open);
    bench.run_renewed(60, turn);
    assert_eq!(bench.ended(), Some((Origin::Operator, 2, Finish::Aborted)));
    bench.arbiter.set_gates(Gate::Open, Gate::Open);
    bench.run_renewed(200, turn);
    assert_eq!(bench.board.code, STANDBY.code(), "it does not come back");
}

#[test]
fn without_limits_the_arm_is_refused_and_the_wheels_are_not() {
    let mut bench = Bench::manual();
    bench.arbiter.set_gates(Gate::Open, Gate::Shut);
    let order = drive(Origin::Operator, 1, ARM_UP);
    assert_eq!(bench.give(order), Verdict::Refused(Refusal::ArmUnlimited));
    bench.run_renewed(200, order);
    assert!(!bench.board.executed.contains(&ARM_UP.code()));
    assert_eq!(bench.ended(), Some((Origin::Operator, 1, Finish::Refused)));
    bench.run_renewed(200, drive(Origin::Operator, 2, FORWARD));
    assert_eq!(bench.board.code, FORWARD.code());
}

#[test]
fn a_board_that_has_restarted_is_told_a_standby_before_anything_else() {
    let mut bench = Bench::manual();
    bench.run_renewed(300, drive(Origin::Operator, 1, ARM_UP));
    bench.arbiter.board_down();
    bench.board = board();
    bench.arbiter.board_up(bench.now, Version::One, true);
    bench.written.clear();
    let order = drive(Origin::Operator, 2, ARM_UP);
    bench.run_renewed(400, order);
    assert_eq!(bench.written[0].1.command(), Some(STANDBY));
    assert_eq!(bench.board.executed[..2], [STANDBY.code(), ARM_UP.code()]);
}
