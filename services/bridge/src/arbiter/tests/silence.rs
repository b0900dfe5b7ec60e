//! A steering board that does not report: no order may move anything.

use super::*;

/// A bench whose board hears everything and is not heard any more.
struct Deaf(Bench);

impl Deaf {
    /// Runs `millis`, renewing `order` every 40 ms; the board's reports are lost.
    fn run_renewed(&mut self, millis: u64, order: SteeringOrder) {
        let Self(bench) = self;
        for step in 0..millis {
            if step % 40 == 0 {
                bench.give(order);
            }
            for command in turn(&mut bench.arbiter, bench.now) {
                bench.written.push((bench.now, command));
                bench.board.take(bench.now, command);
            }
            bench.board.step(bench.now);
            bench.now += ms(1);
        }
    }
}

#[test]
fn an_unheard_board_is_stopped_after_200_ms_and_stays_so_whoever_renews() {
    for (mode, origin) in [
        (Mode::Manual, Origin::Operator),
        (Mode::Autonomous, Origin::Logic),
    ] {
        let mut bench = Bench::new(mode);
        let order = drive(origin, 1, FORWARD);
        bench.run_renewed(100, order);
        let last_report = bench.now - ms(1);
        bench.written.clear();
        let mut deaf = Deaf(bench);
        deaf.run_renewed(1_000, order);
        let Deaf(mut bench) = deaf;
        let (halted, _) = bench
            .written
            .iter()
            .find(|(_, command)| command.command() == Some(STANDBY))
            .copied()
            .unwrap();
        assert_eq!(halted.checked_sub(last_report).unwrap(), UNHEARD);
        assert!(
            bench
                .written
                .iter()
                .filter(|(at, _)| *at >= halted)
                .all(|(_, command)| command.command() == Some(STANDBY)),
            "standby goes out, and nothing else"
        );
        assert!(bench.written.len() > 20, "and again and again");
        assert!(!code_moves(bench.board.code));
        assert_eq!(bench.health().blocked, Refusal::BoardSilent);
        let verdict = bench.give(drive(origin, 2, FORWARD));
        if origin == Origin::Operator {
            assert_eq!(verdict, Verdict::Refused(Refusal::BoardSilent));
        } else {
            assert_eq!(verdict, Verdict::Ignored(Refusal::BoardSilent));
        }
        assert_eq!(bench.health().refusal, Refusal::BoardSilent);

        // Reports return.
        let (revision, before) = (bench.arbiter.revision(), bench.board.executed.len());
        bench.run_renewed(100, order);
        assert_eq!(bench.health().blocked, Refusal::None);
        assert_ne!(bench.arbiter.revision(), revision, "and that is told");
        let moved = bench.board.executed[before..].contains(&FORWARD.code());
        assert!(!moved, "nothing comes back by itself");
        assert_eq!(bench.give(drive(origin, 3, FORWARD)), Verdict::Executes);
        bench.run(1);
        assert!(code_moves(bench.board.code));
    }
}

#[test]
fn a_turn_and_an_arm_order_of_an_unheard_board_are_cut_short() {
    for command in [LEFT_PERP, DROP] {
        let mut bench = Bench::autonomous();
        let order = drive(Origin::Logic, 1, command);
        bench.run_renewed(100, order);
        let mut deaf = Deaf(bench);
        deaf.run_renewed(300, order);
        let Deaf(mut bench) = deaf;
        assert_eq!(bench.ended(), Some((Origin::Logic, 1, Finish::Aborted)));
        assert_eq!(bench.board.code, STANDBY.code());
        bench.run_renewed(500, order);
        assert_eq!(
            bench
                .board
                .executed
                .iter()
                .filter(|code| **code == command.code())
                .count(),
            1
        );
        assert_eq!(bench.board.completed, 0);
    }
}

#[test]
fn standing_is_allowed_unseen() {
    let mut bench = Bench::autonomous();
    let grant = granted_standby(1);
    bench.run_renewed(50, grant);
    let mut deaf = Deaf(bench);
    deaf.run_renewed(500, grant);
    let Deaf(mut bench) = deaf;
    assert_eq!(bench.arbiter.current().map(|(key, _)| key.id), Some(1));
    assert_eq!(
        bench.give(drive(Origin::Operator, 7, SQUEEZE)),
        Verdict::Refused(Refusal::BoardSilent)
    );
    assert_eq!(
        bench.give(drive(Origin::Logic, 2, STANDBY)),
        Verdict::Executes
    );
}

#[test]
fn a_board_that_has_just_come_up_has_200_ms_to_report() {
    let mut arbiter = Arbiter::new();
    arbiter.board_up(ms(1_000), Version::One, false);
    assert_eq!(arbiter.blocked(), Refusal::None);
    arbiter.advance(ms(1_199));
    assert_eq!(arbiter.blocked(), Refusal::None);
    let due = arbiter.next_due().unwrap();
    assert!(due <= ms(1_200));
    arbiter.advance(ms(1_200));
    assert_eq!(arbiter.blocked(), Refusal::BoardSilent);
    arbiter.board_down();
    arbiter.advance(ms(1_201));
    assert_eq!(arbiter.blocked(), Refusal::NoBoard);
}

#[test]
fn silence_does_not_keep_the_loop_awake() {
    for stopped in [false, true] {
        let mut arbiter = Arbiter::new();
        arbiter.board_up(ms(1_000), Version::One, false);
        if stopped {
            arbiter.stop();
        }
        let mut now = ms(2_000);
        let mut turns = 0;
        while now < ms(3_000) {
            turn(&mut arbiter, now);
            let due = arbiter.next_due().unwrap();
            assert!(due > now, "at {now:?}");
            now = due;
            turns += 1;
        }
        assert!(turns <= 1_000 / 40 + 2, "{turns}");
    }
}

#[test]
fn an_original_board_reports_nothing_that_could_be_missed() {
    let mut arbiter = Arbiter::new();
    arbiter.drive_original_boards(true);
    arbiter.board_up(ms(1_000), Version::Original, false);
    arbiter.advance(ms(9_000));
    assert_eq!(arbiter.blocked(), Refusal::None);
    let order = drive(Origin::Operator, 1, FORWARD);
    assert_eq!(
        arbiter.order(ms(9_000), Duration::ZERO, &order),
        Verdict::Executes
    );
    turn(&mut arbiter, ms(9_000));
    assert!(arbiter.next_due().unwrap() > ms(9_000));
}
