//! Reads and writes the flash, and reads the fuses.

use core::arch::asm;

use lager_avr::register::{boot_load, get};

/// Bits of SPMCSR.
const SPMEN: u8 = 0x01;
const PGERS: u8 = 0x02;
const PGWRT: u8 = 0x04;
const BLBSET: u8 = 0x08;
const RWWSRE: u8 = 0x10;

/// One SPM: `command` goes into SPMCSR, and SPM follows within four cycles. Returns when it is done.
#[inline(never)]
fn spm(address: u32, word: u16, command: u8) {
    // SAFETY: it writes flash below the boot section alone, where nothing runs now.
    unsafe {
        asm!(
            "out 0x3b, {high}",
            "movw r0, {word}",
            "out 0x37, {command}",
            "spm",
            "clr r1",
            high = in(reg) (address >> 16) as u8,
            word = in(reg_pair) word,
            command = in(reg) command,
            in("Z") address as u16,
        );
    }
    while get(boot_load().spmcsr()) & SPMEN != 0 {}
}

/// Erases the page at `address` and writes these bytes there; bytes that are missing stay 0xFF.
pub(crate) fn write_page(address: u32, bytes: &[u8]) {
    spm(address, 0, SPMEN | PGERS);
    let mut place = address;
    for word in bytes.chunks(2) {
        let high = word.get(1).copied().unwrap_or(0xFF);
        spm(place, u16::from_le_bytes([word[0], high]), SPMEN);
        place += 2;
    }
    spm(address, 0, SPMEN | PGWRT);
    spm(address, 0, SPMEN | RWWSRE);
}

/// A byte of the flash.
#[inline(always)]
pub(crate) fn read(address: u32) -> u8 {
    let byte: u8;
    // SAFETY: it only reads.
    unsafe {
        asm!(
            "out 0x3b, {high}",
            "elpm {byte}, Z",
            high = in(reg) (address >> 16) as u8,
            byte = out(reg) byte,
            in("Z") address as u16,
        );
    }
    byte
}

/// Four bytes of the boot section.
#[inline(always)]
pub(crate) fn read_word(address: u16) -> u32 {
    let (b0, b1, b2, b3): (u8, u8, u8, u8);
    // SAFETY: it only reads.
    unsafe {
        asm!(
            "out 0x3b, {high}",
            "elpm {b0}, Z+",
            "elpm {b1}, Z+",
            "elpm {b2}, Z+",
            "elpm {b3}, Z+",
            high = in(reg) 1u8,
            b0 = out(reg) b0,
            b1 = out(reg) b1,
            b2 = out(reg) b2,
            b3 = out(reg) b3,
            inout("Z") address => _,
        );
    }
    u32::from_le_bytes([b0, b1, b2, b3])
}

/// The low fuse (0), the lock bits (1), the extended fuse (2) or the high fuse (3).
#[inline(never)]
pub(crate) fn fuse(which: u16) -> u8 {
    let byte: u8;
    // SAFETY: it only reads.
    unsafe {
        asm!(
            "out 0x3b, r1",
            "out 0x37, {command}",
            "lpm {byte}, Z",
            command = in(reg) SPMEN | BLBSET,
            byte = out(reg) byte,
            in("Z") which,
        );
    }
    byte
}
