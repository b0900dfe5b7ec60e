//! Compiles small images with avr-gcc and makes chips of them.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::rc::Rc;

use lager_emulator::chip::{Chip, FREQUENCY, Image};

/// Cycles from power to the first instruction: 65 ms and 14 cycles.
pub(crate) const START: u64 = FREQUENCY * 65 / 1_000 + 14;

/// The address at which the images note their results.
const LOG: u16 = 0x3F00;

/// Compiles an image of `tests/images` with these flags too; every test has its own output.
fn image(source: &str, test: &str, flags: &[&str]) -> Image {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images");
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{source}-{test}.elf"));
    let status = Command::new("avr-gcc")
        .args([
            "-mmcu=atmega1284p",
            "-DF_CPU=16000000UL",
            "-Os",
            "-Wall",
            "-o",
        ])
        .arg(&out)
        .args(flags)
        .arg(folder.join(source))
        .status()
        .expect("avr-gcc is installed, as the emulator's build needs avr-libc");
    assert!(status.success(), "{source} compiles");
    Image::read(&out).expect("avr-gcc writes images for AVRs")
}

/// A chip with that image; power comes on now.
pub(crate) fn chip(source: &str, test: &str) -> Rc<Chip> {
    chip_with(source, test, &[])
}

/// The same, compiled with these flags too.
pub(crate) fn chip_with(source: &str, test: &str, flags: &[&str]) -> Rc<Chip> {
    Chip::new(&image(source, test, flags), 0, 1).expect("simavr knows the chip")
}

/// The first bytes that the program noted.
pub(crate) fn noted(chip: &Chip, count: usize) -> Vec<u8> {
    chip.memory(LOG, count)
}

/// The first words that the program noted.
pub(crate) fn noted_words(chip: &Chip, count: usize) -> Vec<u16> {
    noted(chip, 2 * count)
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}

/// This many milliseconds, in cycles.
pub(crate) const fn milliseconds(count: u64) -> u64 {
    FREQUENCY * count / 1_000
}
