//! The chip programs its own flash.

use std::rc::Rc;

use lager_emulator::chip::{Chip, ResetLine};

use crate::support::{START, chip, chip_with, milliseconds, noted};

const SPMEN: u8 = 0x01;
const PGERS: u8 = 0x02;
const RWWSB: u8 = 0x40;
/// The page that the program erases and writes at the end, in `CASE == 2`.
const PAGE: core::ops::Range<usize> = 0x1_0100..0x1_0200;

/// The program lies in the boot section, and a little application in its own.
const SECTIONS: &str = "-Wl,--section-start=.text=0x1f000,--section-start=.low=0";

/// A chip that has done all of `spm.c` up to its cases.
fn programmed(test: &str, case: &str) -> Rc<Chip> {
    let chip = chip_with("spm.c", test, &[SECTIONS, case]);
    while noted(&chip, 32)[31] != 1 {
        chip.run_until(chip.cycle() + milliseconds(1) / 10);
        assert!(
            chip.cycle() < START + milliseconds(200),
            "it comes to an end"
        );
    }
    chip
}

#[test]
fn the_fuses_say_where_a_chip_starts() {
    let log = noted(&programmed("starts", "-DCASE=0"), 32);
    assert_eq!(log[0], 0x5A, "it reads the application's section");
    let chip = chip_with("spm.c", "starts-below", &[SECTIONS, "-DHIGH_FUSE=0x9B"]);
    chip.run_until(START + milliseconds(100));
    assert_ne!(noted(&chip, 32)[31], 1, "the application's loop runs");
    assert_eq!(chip.crashes(), 0);
}

#[test]
fn an_erasure_takes_its_time_and_nothing_can_be_read_below_it() {
    let log = noted(&programmed("busy", "-DCASE=0"), 32);
    assert_eq!(log[1], RWWSB | PGERS | SPMEN);
    assert_eq!(log[2], 0xFF, "the lower section");
    assert_ne!(log[3], 0xFF, "the boot section");
    // 4.5 ms, counted in steps of 4 microseconds.
    let took = u16::from_le_bytes([log[4], log[5]]);
    assert!((1_124..=1_128).contains(&took), "{took}");
    assert_eq!((log[6], log[7]), (RWWSB, 0xFF), "not before RWWSRE");
    assert_eq!((log[8], log[9]), (0, 0x5A));
}

#[test]
fn the_first_word_for_a_place_is_written_and_the_next_fill_ends_the_blockade() {
    let log = noted(&programmed("fill", "-DCASE=0"), 32);
    assert_eq!((log[10], log[11]), (RWWSB, 0));
    assert_eq!((log[12], log[13]), (0xF0, 0xFF));
}

#[test]
fn a_write_only_clears_bits() {
    let log = noted(&programmed("clears", "-DCASE=0"), 32);
    assert_eq!((log[14], log[15]), (0xF0 & 0x3C, 0x01));
}

#[test]
fn the_core_stands_still_while_its_own_section_is_written() {
    let log = noted(&programmed("halts", "-DCASE=0"), 32);
    assert_eq!(log[16], 0);
    let took = u16::from_le_bytes([log[17], log[18]]);
    assert!((1_124..=1_128).contains(&took), "{took}");
    assert_eq!((log[19], log[20]), (0x77, 0x5A));
}

#[test]
fn a_program_reads_its_fuses_and_lock_bits_whatever_rampz_says() {
    let log = noted(&programmed("fuses", "-DCASE=0"), 32);
    assert_eq!(log[21..25], [0xF7, 0xFF, 0xFC, 0x9A]);
}

#[test]
fn a_late_command_and_one_beside_the_eeprom_do_nothing() {
    let log = noted(&programmed("late", "-DCASE=0"), 32);
    assert_eq!((log[25], log[26]), (0, 0xF0 & 0x3C), "too late");
    assert_eq!(log[27], 0, "the EEPROM writes");
    assert_eq!(log[28], 0xF0 & 0x3C, "the buffer was emptied");
}

#[test]
fn a_lock_bit_keeps_the_boot_section() {
    let chip = programmed("locked", "-DCASE=0");
    let log = noted(&chip, 32);
    assert_eq!((log[29], log[30]), (0x11, 0xEF));
    assert_eq!((chip.fuses().lock, chip.refused_spm()), (0xEF, 1));
}

#[test]
fn only_the_boot_section_may_write() {
    let chip = chip("spm_below.c", "below");
    chip.run_until(START + milliseconds(10));
    assert_eq!(noted(&chip, 2), [0, 1]);
    assert_eq!(chip.refused_spm(), 1);
}

#[test]
fn a_program_that_runs_where_the_flash_is_busy_hangs() {
    let chip = programmed("fetch", "-DCASE=1");
    chip.run_until(chip.cycle() + milliseconds(10));
    assert_eq!(chip.crashes(), 1);
    chip.reset(ResetLine::External);
    chip.run_until(chip.cycle() + START + milliseconds(1));
    assert_eq!(noted(&chip, 1), [0x5A], "after a reset it starts again");
}

#[test]
fn a_page_is_torn_when_power_goes_and_complete_after_another_reset() {
    let erased = [0xFF; 256];
    let written: Vec<u8> = [0xFF, 0x00].repeat(128);
    for (line, torn) in [
        (ResetLine::Power, true),
        (ResetLine::BrownOut, true),
        (ResetLine::External, false),
    ] {
        for writes in [false, true] {
            let chip = programmed(&format!("torn-{line:?}-{writes}"), "-DCASE=2");
            // The second round, so that an erasure has something to erase.
            for _ in 0..if writes { 2 } else { 3 } {
                while chip.is_programming() {
                    chip.run_until(chip.cycle() + 10);
                }
                while !chip.is_programming() {
                    chip.run_until(chip.cycle() + 10);
                }
            }
            chip.run_until(chip.cycle() + milliseconds(1));
            chip.reset(line);
            let page = &chip.flash()[PAGE];
            let whole = page == erased || page == written;
            assert_eq!(whole, !torn, "{line:?}, writes: {writes}");
        }
    }
}
