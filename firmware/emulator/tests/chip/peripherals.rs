//! The converter, the EEPROM, the timers' outputs and the interrupt masks.

use crate::support::{START, chip, milliseconds, noted, noted_words};

#[test]
fn a_conversion_takes_13_of_the_converters_clocks_and_the_first_25() {
    let chip = chip("adc.c", "adc");
    chip.on_conversion(|channel, _| if channel == 1 { 2_500 } else { 0 });
    chip.run_until(START + milliseconds(1));
    let log = noted_words(&chip, 4);
    assert_eq!(log[3], 1, "the program is done");
    // The program itself needs time to start, to notice the end and to read the timer.
    assert!((25 * 16..25 * 16 + 30).contains(&log[0]), "{}", log[0]);
    assert!((13 * 16..13 * 16 + 30).contains(&log[1]), "{}", log[1]);
    assert_eq!(log[2], 511);
}

#[test]
fn a_pwm_output_does_not_write_the_programs_port_register() {
    let chip = chip("outputs.c", "pwm");
    chip.run_until(START + milliseconds(10));
    let log = noted(&chip, 3);
    assert_eq!(log[2], 1, "the program is done");
    assert_eq!(log[1], 0);
}

#[test]
fn an_eeprom_byte_takes_its_time() {
    let chip = chip("outputs.c", "eeprom");
    chip.run_until(START + milliseconds(10));
    let took = u16::from_le_bytes([noted(&chip, 18)[16], noted(&chip, 18)[17]]);
    // 3.4 ms, counted in steps of 4 microseconds.
    assert!((848..=852).contains(&took), "{took}");
    assert_eq!(chip.eeprom(8)[7], 0x5A);
}

#[test]
fn an_interrupt_enabled_after_its_flag_comes_at_once() {
    let chip = chip("outputs.c", "mask");
    chip.run_until(START + milliseconds(10));
    assert_eq!(noted(&chip, 3)[0], 1);
}
