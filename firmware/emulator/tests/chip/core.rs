//! Time, sleep, interrupts and resets of the core.

use std::time::{Duration, Instant};

use lager_emulator::chip::ResetLine;

use crate::support::{START, chip, milliseconds, noted};

#[test]
fn an_interrupt_takes_four_cycles_to_enter_and_eight_from_sleep() {
    let chip = chip("entry.S", "entry");
    chip.run_until(START + milliseconds(2));
    let log = noted(&chip, 9);
    let at = |index: usize| u16::from_le_bytes([log[index], log[index + 1]]);
    let (awake, asleep) = (at(0), at(3));
    // The match shows one count after 1000. Then come four cycles of entry, three of the jump at
    // the vector and two of the load, which reads in its first.
    assert!((1_007..=1_009).contains(&awake), "{awake}");
    assert_eq!(asleep, awake + 4);
}

#[test]
fn one_instruction_runs_after_sei_before_a_waiting_interrupt() {
    let chip = chip("entry.S", "sei");
    chip.run_until(START + milliseconds(2));
    assert_eq!(noted(&chip, 9)[8], 1);
}

#[test]
fn a_sleeping_chip_costs_no_time_of_ours() {
    let chip = chip("uart.c", "sleep");
    let start = Instant::now();
    let hour = milliseconds(3_600_000);
    chip.run_until(START + hour);
    assert!(chip.slept() > hour - milliseconds(10));
    // simavr's own loop would sleep for a real hour; this limit is a watchdog and measures nothing.
    assert!(start.elapsed() < Duration::from_secs(600));
}

#[test]
fn the_program_starts_65_milliseconds_after_power() {
    let chip = chip("uart.c", "power");
    chip.run_until(START - 1);
    assert!(chip.is_held());
    chip.run_until(START + 100);
    assert!(!chip.is_held());
}

#[test]
fn the_clock_goes_on_over_a_reset() {
    let chip = chip("uart.c", "reset");
    chip.run_until(START + milliseconds(10));
    let before = chip.cycle();
    chip.reset(ResetLine::External);
    assert_eq!((chip.cycle(), chip.resets()), (before, 1));
    chip.run_until(before + START - 1);
    assert!(chip.is_held());
    chip.run_until(before + START + 1);
    assert!(!chip.is_held());
}

#[test]
fn the_watchdog_resets_a_program_that_does_not_serve_its_interrupt() {
    let chip = chip("watchdog.c", "watchdog");
    // Two time-outs of 16.384 ms (2048 cycles of 128 kHz are 16 ms), then the start-up time.
    chip.run_until(START + milliseconds(33));
    assert_eq!(chip.resets(), 1);
    assert_eq!(noted(&chip, 2), [1, 0x01], "power");
    chip.run_until(chip.cycle() + START + milliseconds(1));
    assert_eq!(noted(&chip, 3), [2, 0x01, 0x08], "watchdog");
    chip.run_until(chip.cycle() + START + milliseconds(40));
    assert_eq!(chip.resets(), 2);
}

#[test]
fn a_program_that_hangs_goes_on_serving_interrupts() {
    let chip = chip("uart.c", "hang");
    chip.run_until(START + milliseconds(1));
    chip.hang();
    let slept = chip.slept();
    chip.run_until(chip.cycle() + milliseconds(1));
    assert_eq!(chip.slept(), slept, "the main loop never comes back");
    let interrupts = chip.interrupts();
    chip.send_to(lager_emulator::chip::UsartId::Zero, chip.cycle(), 1, 32.0);
    chip.run_until(chip.cycle() + milliseconds(1));
    assert_ne!(chip.interrupts().vectors, interrupts.vectors);
    assert_eq!(chip.crashes(), 0);
}
