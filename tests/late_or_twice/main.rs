//! Tests that no order moves the robot late, or twice: every machine between a person and the
//! motors, joined in virtual time, with a fault at every hop.
//!
//! ```text
//!  page -> panel -> station -> link -> comm --.
//!  GaG ------------^                          |-> bus -> bridge -> steering board -> motors, arm
//!  lager drive, logic ------------------------'
//! ```
//!
//! The laws are in `judge.rs`. The tests search for a break of a law under freezes, kills, cuts and
//! delays (`case.rs`). Without one of the protections (`mends.rs`), the same search finds a break.

mod case;
mod faults;
mod giver;
mod judge;
mod mends;
mod robot;
mod wire;
mod world;

use case::{Act, Case, Fault, LEFT, Line, TURN, Way, Who, cases, squeeze};

use mends::Mends;
use proptest::prelude::*;
use world::run;

fn case(way: Way, acts: &[(u64, Act)], faults: &[Fault]) -> Case {
    Case {
        way,
        acts: acts.to_vec(),
        faults: faults.to_vec(),
    }
}

const HELD: Act = Act::Hold {
    command: LEFT,
    lasts: 1_500,
};
const DRIVEN: Act = Act::Drive {
    command: LEFT,
    lasts: 4_500,
};

/// A defect that people met: its name, its case, and a function that takes its mend out.
type Found = (&'static str, Case, fn(&mut Mends));

/// The defects that people met, each with the mends that now prevent it.
fn found() -> Vec<Found> {
    let by_hand = |acts: &[(u64, Act)], faults: &[Fault]| case(Way::ByHand, acts, faults);
    let frozen = |who, at, lasts| Fault::Freeze { who, at, lasts };
    let cut = |at, lasts| Fault::Cut {
        line: Line::Link,
        at,
        lasts,
    };
    let stopped = [(500, Act::Stop), (900, Act::Resume), (1_500, Act::Stop)];
    vec![
        (
            "an old resume over a frozen comm",
            case(Way::ByItself, &stopped, &[frozen(Who::Comm, 800, 1_500)]),
            // The resume is also too old.
            |mends| (mends.named, mends.aged) = (false, false),
        ),
        (
            "an old resume over a cut link",
            case(Way::ByItself, &stopped, &[cut(800, 1_500)]),
            |mends| (mends.named, mends.aged) = (false, false),
        ),
        (
            "a resume that a newer stop overtakes",
            case(
                Way::ByItself,
                &[(500, Act::Stop), (900, Act::Resume), (950, Act::Stop)],
                &[frozen(Who::Comm, 880, 120)],
            ),
            |mends| mends.named = false,
        ),
        (
            "a turn over a cut link",
            by_hand(&[(1_000, Act::Press(TURN))], &[cut(900, 1_200)]),
            |mends| mends.aged = false,
        ),
        (
            "a GaG's turn at a frozen station",
            by_hand(
                &[(1_000, Act::Say(LEFT))],
                &[frozen(Who::Station, 900, 1_000)],
            ),
            |mends| mends.aged = false,
        ),
        (
            "a turn while the bridge is frozen",
            by_hand(
                &[(1_000, Act::Press(TURN))],
                &[frozen(Who::Bridge, 950, 1_000)],
            ),
            // Comm also ends the order by itself.
            |mends| (mends.aged, mends.heirs) = (false, false),
        ),
        (
            "a GaG's command and a bridge that is replaced",
            by_hand(
                &[(500, Act::Say(LEFT))],
                &[Fault::Replace {
                    at: 1_000,
                    lasts: 2_000,
                }],
            ),
            |mends| mends.heirs = false,
        ),
        (
            "a GaG's command and a bridge that is killed",
            by_hand(
                &[(500, Act::Say(LEFT))],
                &[Fault::Kill {
                    who: Who::Bridge,
                    at: 1_000,
                    back: 350,
                }],
            ),
            |mends| mends.heirs = false,
        ),
        (
            "lager drive and a bridge that is replaced",
            by_hand(
                &[(500, DRIVEN)],
                &[Fault::Replace {
                    at: 1_000,
                    lasts: 1_000,
                }],
            ),
            |mends| mends.heirs = false,
        ),
        (
            "a step of the arm over a frozen comm while logic stands at goods",
            case(
                Way::Picking,
                &[(1_000, Act::Say(squeeze()))],
                &[frozen(Who::Comm, 900, 1_000)],
            ),
            |mends| (mends.aged, mends.signs) = (false, false),
        ),
        (
            "a GaG that freezes",
            by_hand(&[(500, Act::Say(LEFT))], &[frozen(Who::Gag, 1_000, 4_000)]),
            |mends| mends.seen = false,
        ),
    ]
}

#[test]
fn what_happened_to_people_does_not_happen_again() {
    let mut broken = Vec::new();
    for (name, case, _) in found() {
        let run = run(&case, Mends::ALL);
        if !run.faults.is_empty() {
            broken.push(format!("{name}: {:#?}\n{:#?}", run.faults, run.thoughts));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn without_its_mend_each_of_them_happens() {
    let mut kept = Vec::new();
    for (name, case, take_out) in found() {
        let mut mends = Mends::ALL;
        take_out(&mut mends);
        if run(&case, mends).faults.is_empty() {
            kept.push(name);
        }
    }
    assert!(
        kept.is_empty(),
        "these happen no more without it: {kept:#?}"
    );
}

/// This shows that the model moves: one in which nothing moves would keep both laws, too.
#[test]
fn where_nothing_is_wrong_everybody_moves_the_robot() {
    let [held, said, driven] = [HELD, Act::Say(LEFT), DRIVEN].map(|act| {
        let run = run(&case(Way::ByHand, &[(500, act)], &[]), Mends::ALL);
        assert_eq!((run.faults, run.hung_up), (Vec::new(), 0), "{act:?}");
        run.motion
    });
    assert!((1_300..2_000).contains(&held), "{held}");
    assert!(said > 5_000, "{said}");
    assert!((4_300..4_800).contains(&driven), "{driven}");
    let logic = run(&case(Way::ByItself, &[], &[]), Mends::ALL);
    assert!(logic.motion > 5_500 && logic.faults.is_empty(), "{logic:?}");
    for act in [Act::Press(TURN), Act::Say(TURN)] {
        let run = run(&case(Way::ByHand, &[(500, act)], &[]), Mends::ALL);
        assert_eq!((run.one_shots, run.hung_up), (1, 0), "{act:?} {run:?}");
        assert!(run.motion > 500 && run.faults.is_empty(), "{act:?} {run:?}");
    }
}

/// The running command decides about signs of life and silence, so a long step of the arm does not
/// make comm close the link, whoever drives.
#[test]
fn a_step_of_the_arm_that_takes_long_comes_to_its_end() {
    let comes_to_its_end = |way, mends| {
        let case = case(way, &[(500, Act::Say(squeeze()))], &[]);
        let run = run(&case, mends);
        assert!(run.faults.is_empty(), "{way:?} {run:?}");
        (run.one_shots, run.hung_up, run.longest > 1_000) == (1, 0, true)
    };
    for way in [Way::ByHand, Way::Picking] {
        assert!(comes_to_its_end(way, Mends::ALL), "{way:?}");
    }
    let signs_by_mode = Mends {
        signs: false,
        ..Mends::ALL
    };
    assert!(!comes_to_its_end(Way::Picking, signs_by_mode));
}

proptest! {
    #![proptest_config(ProptestConfig {
        // Each case runs the whole model for seven seconds.
        cases: ProptestConfig::default().cases / 2,
        // Add a case that the search finds to `found`.
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn nothing_moves_late_or_after_a_newer_stop(case in cases()) {
        let run = run(&case, Mends::ALL);
        prop_assert!(run.faults.is_empty(), "{:#?}\n{:#?}", run.faults, run.thoughts);
    }
}
