//! Tests of faults: resets, hung programs and bad cables, and when the motors go off.

use lager_simulator::Wire;
use lager_wire::{ResetCause, WheelCommand};

use crate::pi::{Pi, ms};

fn driving() -> Pi {
    let mut pi = Pi::in_builtin("large");
    pi.wheels(WheelCommand::ManualForward);
    pi.run(ms(500));
    assert_eq!(pi.robot.truth().duties, [100, 100]);
    pi
}

/// How long the motors still had a duty, in ms.
fn until_off(pi: &mut Pi) -> u128 {
    let start = pi.robot.now();
    pi.until(ms(1_000), |pi| pi.robot.truth().duties == [0, 0]);
    (pi.robot.now() - start).as_millis()
}

#[test]
fn a_cut_cable_stops_the_motors_and_a_mended_one_goes_on() {
    let mut pi = driving();
    pi.robot.cut(Wire::Steering, true);
    let off = until_off(&mut pi);
    assert!(off < 200, "{off} ms");
    pi.run(ms(1_500));
    assert!(!pi.is_up());
    pi.robot.cut(Wire::Steering, false);
    pi.until(ms(1_000), Pi::is_up);
}

#[test]
fn a_reset_board_comes_back_and_says_why() {
    for (wire, cause) in [
        (Wire::Sensor, ResetCause::BrownOut),
        (Wire::Steering, ResetCause::External),
    ] {
        let mut pi = driving();
        let before = pi.heard.ups.len();
        pi.robot.reset_board(wire, cause);
        if wire == Wire::Steering {
            assert_eq!(pi.robot.truth().duties, [0, 0], "at once");
        }
        pi.until(ms(1_000), |pi| pi.heard.ups.len() > before);
        let (up_wire, up) = pi.heard.ups[before];
        assert_eq!((up_wire, up.reset, up.rebooted), (wire, cause, true));
        pi.heard.statuses.clear();
        pi.until(ms(1_000), |pi| {
            pi.heard.statuses.iter().any(|(of, _)| *of == wire)
        });
        let (_, status) = pi
            .heard
            .statuses
            .iter()
            .find(|(of, _)| *of == wire)
            .unwrap();
        assert_eq!(status.reset, cause);
        assert_eq!(pi.lost(), 0, "a reset is not a loss");
    }
}

#[test]
fn a_hung_program_is_ended_by_its_watchdog_with_the_motors_off() {
    let mut pi = driving();
    let before = pi.heard.ups.len();
    pi.robot.hang_board(Wire::Steering);
    let off = until_off(&mut pi);
    // The test looks every few milliseconds.
    assert!((40..=71).contains(&off), "{off} ms");
    pi.until(ms(1_000), |pi| pi.heard.ups.len() > before);
    assert_eq!(pi.heard.ups[before].1.reset, ResetCause::Watchdog);
}
