//! How much the motors differ: learnt, kept without power, and forgotten with other wheels.

mod support;

use lager_control::{Motor, SteeringConfig, SteeringUnit};
use lager_wire::{Payload, Profile, Setting, SteeringProfile, WheelsProfile};
use support::Bench;
use support::servos::Servos;

const STANDBY: u8 = 1;
const FOLLOW: u8 = 3;
const LEFT_PERP: u8 = 7;

const MIDDLE: u16 = 0b000_0111_0000;
/// The line so far to the right that the regulator always adds 4 duty steps.
const BESIDE: u16 = MIDDLE >> 1;
const MARK: u16 = 0b111_1111_0000;
const BAR: u16 = 0b111_1111_1111;

/// The two copies of the bias.
const COPIES: core::ops::Range<usize> = 128..192;

/// Follows the line so long that something is learnt, then meets what `ends` it, and stands.
fn drive(bench: &mut Bench, ends: &[u16]) {
    bench.line = Some(BESIDE);
    bench.command(FOLLOW);
    bench.run_ms(10_000);
    for bits in ends {
        bench.line = Some(*bits);
        bench.run_ms(100);
    }
    bench.command(STANDBY);
    bench.run_ms(300);
}

/// A board that has driven to a mark.
fn experienced() -> Bench {
    let mut bench = Bench::ready();
    drive(&mut bench, &[MARK]);
    bench
}

/// The board after a restart, with what its EEPROM keeps.
fn restarted(bench: &Bench) -> Bench {
    let config = SteeringConfig::default();
    let mut again = Bench::boot(0, config, Servos::at([512; 8]));
    again.pins.eeprom = bench.pins.eeprom;
    again.unit = SteeringUnit::new(&again.pins, config);
    again.line = Some(MIDDLE);
    again.run_ms(200);
    again.command(STANDBY);
    again.run_ms(20);
    again
}

/// How many duty steps the first turn adds on the left and takes on the right, as a mean.
fn in_a_turn(bench: &mut Bench) -> f32 {
    bench.pins.motor_log.clear();
    bench.command(LEFT_PERP);
    bench.run_ms(500);
    let log = &bench.pins.motor_log;
    assert!(
        log.iter()
            .all(|(_, (left, right))| left.duty > 0 && right.duty > 0)
    );
    let sum: i32 = log
        .iter()
        .map(|(_, (left, right))| i32::from(left.duty) - i32::from(right.duty))
        .sum();
    sum as f32 / 2.0 / log.len() as f32
}

/// Tells the board its robot.
fn tell(bench: &mut Bench, profile: &SteeringProfile) {
    for (setting, seq) in profile.settings().zip(1..) {
        bench.send(Payload::Setting(Setting { seq, ..setting }));
        bench.run_ms(20);
    }
    bench.run_ms(300);
}

fn other() -> SteeringProfile {
    SteeringProfile {
        wheels: WheelsProfile {
            swapped: true,
            ..WheelsProfile::default()
        },
        divider: false,
    }
}

#[test]
fn what_was_learnt_is_used_in_the_first_turn_after_a_restart() {
    let bench = experienced();
    let steps = in_a_turn(&mut restarted(&bench));
    assert!((3.5..4.5).contains(&steps), "{steps}");
    let steps = in_a_turn(&mut Bench::ready());
    assert!(steps.abs() < f32::EPSILON, "{steps}");
}

#[test]
fn what_a_bar_takes_back_is_never_written() {
    for ends in [&[BAR][..], &[BAR, 0], &[MARK, BAR, 0]] {
        let mut bench = Bench::ready();
        drive(&mut bench, ends);
        assert_eq!(bench.pins.eeprom_writes, 0, "{ends:x?}");
        assert_eq!(bench.pins.eeprom[COPIES], [255; 64]);
    }
}

#[test]
fn learning_the_same_again_writes_nothing() {
    let mut bench = experienced();
    // Layout off, counter, two bytes, check value, layout.
    assert_eq!(bench.pins.eeprom_writes, 6);
    for _ in 0..3 {
        // With the bias the line is in the middle.
        bench.line = Some(MIDDLE);
        bench.command(FOLLOW);
        bench.run_ms(10_000);
        bench.line = Some(MARK);
        bench.run_ms(100);
        bench.command(STANDBY);
        bench.run_ms(300);
    }
    assert_eq!(bench.pins.eeprom_writes, 6);
}

#[test]
fn a_damaged_copy_means_motors_that_are_alike() {
    let whole = experienced();
    for place in COPIES.filter(|place| whole.pins.eeprom[*place] != 255) {
        let mut bench = experienced();
        bench.pins.eeprom[place] ^= 0x10;
        let steps = in_a_turn(&mut restarted(&bench));
        assert!(steps.abs() < f32::EPSILON, "{steps} with byte {place}");
    }
}

#[test]
fn other_wheels_have_their_bias_to_learn() {
    let mut bench = experienced();
    tell(&mut bench, &SteeringProfile::default());
    tell(
        &mut bench,
        &SteeringProfile {
            divider: true,
            ..SteeringProfile::default()
        },
    );
    let steps = in_a_turn(&mut restarted(&bench));
    assert!((3.5..4.5).contains(&steps), "{steps} for the same wheels");
    tell(&mut bench, &other());
    bench.command(2);
    bench.run_ms(100);
    let ahead = Motor::forward(100);
    assert_eq!(bench.pins.motors, (ahead, ahead));
    let steps = in_a_turn(&mut restarted(&bench));
    assert!(steps.abs() < f32::EPSILON, "{steps} after a restart");
}
