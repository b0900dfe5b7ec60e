//! Boards that fall silent and boards that reset, in the middle of a mission. The bridge in this
//! process is the service's own code, so it reacts as the service does.

use std::time::Duration;

use lager_plant::Warehouse;
use lager_simulator::Wire;
use lager_topics::{Ask, AskKind, Health, Phase, ProfileState, Refusal, StopCause};
use lager_wire::ResetCause;

use super::Whole;
use crate::config::Config;

/// Virtual time in which a mission must be over, whatever happened to a board.
const LIMIT: Duration = Duration::from_secs(600);

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// A robot that has been driving for a second.
fn driving() -> Whole {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let mut whole = Whole::new(&Config::default(), &warehouse, &[1], 1, 0).expect("a robot");
    while whole.navigator.status().phase.get() != Some(Phase::Driving) {
        assert_eq!(whole.turn(), None);
    }
    run(&mut whole, ms(1_000));
    assert_ne!(whole.robot.truth().duties, [0, 0]);
    whole
}

/// Runs for so long; `link/health` at its end.
fn run(whole: &mut Whole, span: Duration) -> Health {
    let end = whole.now + span;
    while whole.now < end {
        assert_eq!(whole.turn(), None);
    }
    health(whole)
}

fn health(whole: &Whole) -> Health {
    whole.seen.health.expect("published ten times a second")
}

/// Runs until `link/health` is as wanted; a second at most.
fn run_until(whole: &mut Whole, what: &str, wanted: impl Fn(&Health) -> bool) {
    let end = whole.now + ms(1_000);
    while !wanted(&health(whole)) {
        assert!(whole.now < end, "{what}: {:?}", health(whole));
        assert_eq!(whole.turn(), None);
    }
}

fn obeys_arm(health: &Health) -> bool {
    health.arm_profile == ProfileState::Accepted
}

#[test]
fn a_board_that_is_silent_for_two_seconds_stands_and_is_told_everything_again() {
    let mut whole = driving();
    assert!(obeys_arm(&health(&whole)));
    let before = health(&whole).steering;
    whole.robot.cut(Wire::Steering, true);
    let health = run(&mut whole, ms(310));
    assert_eq!(health.blocked, Refusal::BoardSilent);
    assert_eq!(health.steering.up, 1, "not given up yet");
    assert_eq!(whole.robot.truth().duties, [0, 0]);
    let health = run(&mut whole, ms(1_690));
    assert_eq!(health.blocked, Refusal::NoBoard);
    assert_eq!(health.steering.up, 0);
    assert_eq!(health.arm_profile, ProfileState::NoBoard);

    whole.robot.cut(Wire::Steering, false);
    let told_again = |health: &Health| {
        health.steering.epoch == before.epoch + 1 && health.blocked == Refusal::None
    };
    run_until(&mut whole, "it is found again", told_again);
    run_until(&mut whole, "it is told [arm] again", obeys_arm);
    assert_eq!(whole.run(LIMIT), None);
}

#[test]
fn a_board_that_resets_is_told_everything_again() {
    for wire in [Wire::Steering, Wire::Sensor] {
        let mut whole = driving();
        whole.robot.reset_board(wire, ResetCause::Watchdog);
        let reset = |health: &Health| match wire {
            Wire::Sensor => health.sensor.reboots == 1 && health.sensor.up == 1,
            Wire::Steering => health.steering.reboots == 1 && health.steering.up == 1,
        };
        run_until(&mut whole, "it has restarted", reset);
        if wire == Wire::Steering {
            assert_eq!(health(&whole).arm_profile, ProfileState::Telling);
        }
        run_until(&mut whole, "it is told [arm] again", obeys_arm);
        assert_eq!(health(&whole).stopped, 0);
        assert_eq!(whole.run(LIMIT), None, "{wire:?}");
    }
}

#[test]
fn a_board_that_keeps_resetting_latches_the_stop_until_somebody_resumes() {
    let mut whole = driving();
    for reboots in 1..=3 {
        // A board that has said nothing yet is not known to be another one.
        assert_eq!(run(&mut whole, ms(500)).stopped, 0);
        whole
            .robot
            .reset_board(Wire::Steering, ResetCause::BrownOut);
        let reset = |health: &Health| health.steering.reboots == reboots;
        run_until(&mut whole, "it has restarted", reset);
    }
    let health = run(&mut whole, ms(2_000));
    assert_eq!(
        (health.stopped, health.blocked.get()),
        (1, Some(Refusal::StopLatched))
    );
    assert_eq!(health.stop_cause, StopCause::BoardResets);
    assert_eq!(whole.robot.truth().duties, [0, 0]);

    let resume = Ask {
        kind: AskKind::Resume.into(),
        stop_word: health.stop_word,
        ..Ask::default()
    };
    whole.ask(&resume);
    run_until(&mut whole, "it is resumed", |health| health.stopped == 0);
    assert_eq!(whole.run(LIMIT), None);
}
