//! The arbiter in virtual time, against a model of the steering board.

use super::*;
use lager_wire::{SteerData, SteerFlags};

/// What the steering board does with commands, as far as the arbiter can tell (T2, T4): a new
/// sequence byte executes, the same renews, a command older than 150 ms is given up.
#[derive(Clone, Debug)]
struct Board {
    last_seq: Option<u8>,
    code: u8,
    heard: Duration,
    one_shot_ends: Option<Duration>,
    failsafe: bool,
    finished_seq: u8,
    finish: SteerFlags,
    /// Every command executed, in order.
    executed: Vec<u8>,
    /// How many one-shots ran to their end.
    completed: usize,
}

impl Board {
    fn new() -> Self {
        Self {
            last_seq: None,
            code: 0,
            heard: Duration::ZERO,
            one_shot_ends: None,
            failsafe: false,
            finished_seq: 0,
            finish: SteerFlags::NONE,
            executed: Vec::new(),
            completed: 0,
        }
    }

    fn take(&mut self, now: Duration, command: SteerCommand) {
        self.heard = now;
        if self.last_seq == Some(command.seq) {
            return;
        }
        self.end_one_shot(SteerFlags::ABORTED);
        self.last_seq = Some(command.seq);
        self.failsafe = false;
        let meaning = command.command().expect("the arbiter sends defined codes");
        if matches!(meaning, Command::Arm(_)) && code_moves(self.code) {
            self.finished_seq = command.seq;
            self.finish = SteerFlags::REFUSED;
            return;
        }
        self.code = command.code;
        self.executed.push(command.code);
        if meaning.is_one_shot() {
            let lasts = if moves(meaning) { 3_000 } else { 300 };
            self.one_shot_ends = Some(now + ms(lasts));
        }
    }

    fn end_one_shot(&mut self, how: SteerFlags) {
        if self.one_shot_ends.take().is_some() {
            self.finished_seq = self.last_seq.unwrap();
            self.finish = how;
            self.code = STANDBY.code();
        }
    }

    fn step(&mut self, now: Duration) -> SteerData {
        if now - self.heard > ms(150) && self.last_seq.is_some() {
            self.failsafe = true;
            self.end_one_shot(SteerFlags::ABORTED);
            self.code = STANDBY.code();
        }
        if self.one_shot_ends.is_some_and(|end| end <= now) {
            self.end_one_shot(SteerFlags::NONE);
            self.completed += 1;
        }
        let mut flags = self.finish;
        if self.failsafe {
            flags.insert(SteerFlags::FAILSAFE);
        }
        if self.one_shot_ends.is_some() {
            flags.insert(SteerFlags::BUSY);
        }
        SteerData {
            code: self.code,
            left_duty: if code_moves(self.code) { 100 } else { 0 },
            right_duty: if code_moves(self.code) { 100 } else { 0 },
            flags,
            line_error: 0,
            finished_seq: self.finished_seq,
            servo_errors: 0,
            battery_decivolts: 0,
        }
    }
}

fn code_moves(code: u8) -> bool {
    Command::from_code(code).is_some_and(moves)
}

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn drive(origin: Origin, id: u32, command: Command) -> SteeringOrder {
    SteeringOrder {
        id,
        origin: origin.into(),
        kind: OrderKind::Drive.into(),
        code: command.code(),
        arm_granted: 0,
    }
}

fn stop(origin: Origin) -> SteeringOrder {
    SteeringOrder {
        origin: origin.into(),
        kind: OrderKind::Stop.into(),
        ..SteeringOrder::default()
    }
}

fn granted_standby(id: u32) -> SteeringOrder {
    SteeringOrder {
        arm_granted: 1,
        ..drive(Origin::Logic, id, STANDBY)
    }
}

const FORWARD: Command = Command::Wheel(WheelCommand::ManualForward);
const FOLLOW: Command = Command::Wheel(WheelCommand::ActiveForward);
const LEFT_PERP: Command = Command::Wheel(WheelCommand::LeftPerp);
const LEFT_DIAG: Command = Command::Wheel(WheelCommand::LeftDiag);
const ARM_UP: Command = Command::Arm(ArmCommand::Up);
const SQUEEZE: Command = Command::Arm(ArmCommand::Squeeze);
const DROP: Command = Command::Arm(ArmCommand::Drop);

/// An arbiter wired to a board, both stepped every millisecond.
struct Bench {
    arbiter: Arbiter,
    board: Board,
    now: Duration,
    /// Everything written, with its time.
    written: Vec<(Duration, SteerCommand)>,
    connected: bool,
}

impl Bench {
    fn new(mode: Mode) -> Self {
        let mut arbiter = Arbiter::new();
        arbiter.set_mode(mode);
        let mut bench = Self {
            arbiter,
            board: Board::new(),
            now: ms(1_000),
            written: Vec::new(),
            connected: true,
        };
        bench.arbiter.board_up(bench.now, Version::One, false);
        bench.run(1);
        bench
    }

    fn manual() -> Self {
        Self::new(Mode::Manual)
    }

    fn autonomous() -> Self {
        Self::new(Mode::Autonomous)
    }

    fn give(&mut self, order: SteeringOrder) -> Verdict {
        self.arbiter.order(self.now, &order)
    }

    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            while let Some(command) = self.arbiter.poll(self.now) {
                self.written.push((self.now, command));
                if self.connected {
                    self.board.take(self.now, command);
                }
            }
            let data = self.board.step(self.now);
            if self.connected {
                self.arbiter.observe(self.now, &data);
            }
            self.now += ms(1);
        }
    }

    /// Runs with an origin that renews every 40 ms.
    fn run_renewed(&mut self, millis: u64, order: SteeringOrder) {
        for step in 0..millis {
            if step % 40 == 0 {
                self.give(order);
            }
            self.run(1);
        }
    }

    fn health(&self) -> Health {
        let mut health = Health::default();
        self.arbiter.fill(self.now, &mut health);
        health
    }

    /// A bridge that was killed and has come back with what it had last published.
    fn restart_bridge(&mut self) {
        self.arbiter = Arbiter::resume(&self.health());
    }

    fn ended(&self) -> Option<(Origin, u32, Finish)> {
        let ended = self.arbiter.last_ended()?;
        Some((ended.key.origin, ended.key.id, ended.finish))
    }
}

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
        .order(stale, &drive(Origin::Operator, 1, FORWARD));
    bench.run(200);
    assert!(!bench.board.executed.contains(&FORWARD.code()));
}

#[test]
fn a_late_renewal_takes_a_lapsed_setpoint_up_again_but_not_a_one_shot() {
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
fn a_stop_latches_until_resumed_whoever_sent_it() {
    for (mode, driver) in [
        (Mode::Manual, Origin::Operator),
        (Mode::Autonomous, Origin::Logic),
    ] {
        for stopper in [Origin::Operator, Origin::Logic] {
            let mut bench = Bench::new(mode);
            let order = drive(driver, 1, FORWARD);
            bench.run_renewed(100, order);
            assert_eq!(bench.give(stop(stopper)), Verdict::Stopped);
            bench.run(1);
            assert!(!code_moves(bench.board.code));
            assert_eq!(
                bench.give(order),
                Verdict::Ignored(Ignored::StopLatched),
                "the same order"
            );
            assert_eq!(
                bench.give(drive(driver, 2, FORWARD)),
                Verdict::Ignored(Ignored::StopLatched),
                "a new order"
            );
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
            assert_eq!(bench.give(drive(driver, 2, FORWARD)), Verdict::Executes);
            bench.run(1);
            assert!(code_moves(bench.board.code));
        }
    }
}

#[test]
fn a_stop_anywhere_in_a_batch_wins() {
    let forward = drive(Origin::Operator, 1, FORWARD);
    let follow = drive(Origin::Operator, 2, FOLLOW);
    for batch in [
        [stop(Origin::Operator), forward, follow],
        [forward, stop(Origin::Operator), follow],
        [forward, follow, stop(Origin::Operator)],
    ] {
        let mut bench = Bench::manual();
        for order in batch {
            bench.give(order);
        }
        bench.run(500);
        assert!(
            bench
                .board
                .executed
                .iter()
                .all(|code| *code == STANDBY.code())
        );
        assert!(bench.arbiter.is_stopped());
    }
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
fn a_stop_with_a_code_nobody_knows_still_stops() {
    let mut bench = Bench::manual();
    let mut order = stop(Origin::Logic);
    order.code = 0xEE;
    assert_eq!(bench.give(order), Verdict::Stopped);
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
fn only_the_mode_decides_who_drives() {
    let mut bench = Bench::manual();
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FORWARD)),
        Verdict::Ignored(Ignored::NotInCharge)
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
        Verdict::Ignored(Ignored::NotInCharge)
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
        assert_eq!(bench.give(bad), Verdict::Refused(Refused::Undefined));
        count += 1;
    }
    assert_eq!(count, 256 - 22);
    assert_eq!(bench.health().orders_refused, count);
    bench.run(1);
    assert_eq!(bench.board.code, FORWARD.code());
    assert_eq!(bench.give(order), Verdict::Renewed);
}

#[test]
fn an_order_from_nobody_or_of_no_kind_is_refused() {
    let mut bench = Bench::manual();
    let mut order = drive(Origin::Operator, 1, FORWARD);
    order.origin = lager_topics::Tag::from_raw(9);
    assert_eq!(bench.give(order), Verdict::Refused(Refused::Undefined));
    let mut order = drive(Origin::Operator, 1, FORWARD);
    order.kind = lager_topics::Tag::from_raw(9);
    assert_eq!(bench.give(order), Verdict::Refused(Refused::Undefined));
    bench.run(50);
    assert!(!code_moves(bench.board.code));
}

#[test]
fn the_same_id_with_another_code_is_refused_and_does_not_renew() {
    let mut bench = Bench::manual();
    bench.give(drive(Origin::Operator, 1, FORWARD));
    bench.run(100);
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, FOLLOW)),
        Verdict::Refused(Refused::CodeChanged)
    );
    bench.run(30);
    assert!(!code_moves(bench.board.code));
}

#[test]
fn quarter_turns_and_the_drop_are_logics_alone() {
    for command in [
        LEFT_PERP,
        Command::Wheel(WheelCommand::RightPerp),
        DROP,
    ] {
        for mode in [Mode::Manual, Mode::Autonomous] {
            let mut bench = Bench::new(mode);
            bench.give(granted_standby(1));
            assert_eq!(
                bench.give(drive(Origin::Operator, 2, command)),
                Verdict::Refused(Refused::LogicOnly)
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
        Verdict::Refused(Refused::ArmLocked)
    );
    assert_eq!(bench.ended(), Some((Origin::Operator, 2, Finish::Refused)));
    assert_eq!(bench.give(order), Verdict::Renewed);
    bench.run(10);
    assert_eq!(bench.board.code, FORWARD.code());
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
fn the_operator_moves_the_arm_while_logic_stands_and_lets_him() {
    let mut bench = Bench::autonomous();
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, ARM_UP)),
        Verdict::Ignored(Ignored::NotInCharge)
    );
    bench.give(drive(Origin::Logic, 1, STANDBY));
    assert_eq!(
        bench.give(drive(Origin::Operator, 1, ARM_UP)),
        Verdict::Ignored(Ignored::NotInCharge),
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
        Verdict::Ignored(Ignored::NotInCharge)
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
    let arms = bench.board.executed.iter().filter(|code| **code == ARM_UP.code());
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
        Verdict::Ignored(Ignored::NotInCharge)
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
    assert_eq!(
        bench.arbiter.current().map(|(key, _)| key.id),
        Some(1)
    );
    assert_eq!(bench.board.code, STANDBY.code());
}

#[test]
fn a_stop_while_the_operator_moves_the_arm_ends_both() {
    let mut bench = Bench::autonomous();
    bench.give(granted_standby(1));
    bench.give(drive(Origin::Operator, 7, SQUEEZE));
    bench.run(20);
    bench.give(stop(Origin::Operator));
    assert_eq!(bench.arbiter.current(), None);
    bench.run(1);
    assert_eq!(bench.board.code, STANDBY.code());
}

#[test]
fn a_rebooted_board_drives_on_by_a_live_setpoint_but_repeats_no_turn() {
    let mut bench = Bench::autonomous();
    let order = drive(Origin::Logic, 1, FOLLOW);
    bench.run_renewed(50, order);
    bench.board = Board::new();
    bench.arbiter.board_up(bench.now, Version::One, true);
    bench.run_renewed(50, order);
    assert_eq!(bench.board.code, FOLLOW.code());

    let turn = drive(Origin::Logic, 2, LEFT_PERP);
    bench.run_renewed(500, turn);
    bench.board = Board::new();
    bench.arbiter.board_up(bench.now, Version::One, true);
    bench.run_renewed(500, turn);
    assert_eq!(bench.ended(), Some((Origin::Logic, 2, Finish::Aborted)));
    assert!(!bench.board.executed.contains(&LEFT_PERP.code()));
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
    bench.board = Board::new();
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
    bench.give(stop(Origin::Operator));
    bench.restart_bridge();
    assert_eq!(bench.arbiter.mode(), Mode::Autonomous);
    assert!(bench.arbiter.is_stopped());
    assert_eq!(bench.health().orders_refused, 1);
    assert_eq!(
        bench.give(drive(Origin::Logic, 1, FORWARD)),
        Verdict::Ignored(Ignored::StopLatched)
    );
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
            let kept = bench.health();
            bench.arbiter = Arbiter::new();
            bench.run(away);
            bench.arbiter = Arbiter::resume(&kept);
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
            assert_eq!(finish, expected, "killed after {killed_after} ms, away {away} ms");
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

/// Whatever comes in whatever order, nothing moves without a live order of the one in charge.
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
    for _ in 0..200 {
        let mut bench = Bench::manual();
        let mut last_word = [None::<(Duration, u32)>; 2];
        for _ in 0..300 {
            match next(12) {
                0 => {
                    bench.give(stop(Origin::Logic));
                }
                1 => bench.arbiter.resume_from_stop(),
                2 => bench.arbiter.set_mode(Mode::Manual),
                3 => bench.arbiter.set_mode(Mode::Autonomous),
                4 => {
                    bench.restart_bridge();
                    bench.arbiter.board_up(bench.now, Version::One, false);
                }
                5 => {
                    bench.board = Board::new();
                    bench.arbiter.board_up(bench.now, Version::One, true);
                }
                _ => {
                    let origin = [Origin::Logic, Origin::Operator][next(2) as usize];
                    let id = next(20) as u32;
                    let command = codes[id as usize % codes.len()];
                    let order = SteeringOrder {
                        arm_granted: u8::from(next(2) == 0),
                        ..drive(origin, id, command)
                    };
                    bench.give(order);
                    last_word[usize::from(origin == Origin::Operator)] = Some((bench.now, id));
                }
            }
            for _ in 0..next(60) {
                bench.run(1);
                let moving = code_moves(bench.board.code);
                let stop_is_old = !bench.written.last().is_some_and(|(_, command)| {
                    command.seq != bench.board.last_seq.unwrap_or_default()
                });
                if moving && stop_is_old {
                    let charge = usize::from(bench.arbiter.mode() == Mode::Manual);
                    let (at, _) = last_word[charge].expect("somebody in charge has spoken");
                    let age = bench.now.checked_sub(at).unwrap();
                    assert!(age <= ms(320), "moving {age:?} after the last word");
                    if bench.arbiter.current().is_none() {
                        // Only a board that was just handed over may still be moving, until its
                        // own limit.
                        assert!(
                            bench.now.checked_sub(bench.board.heard).unwrap() <= ms(151),
                            "moving without an order"
                        );
                    }
                }
                if bench.arbiter.is_stopped() && bench.arbiter.current().is_none() {
                    let (_, command) = bench.written.last().unwrap();
                    assert_eq!(command.command(), Some(STANDBY));
                }
            }
        }
    }
}
