//! Reads a chip's memories, and makes its program hang for tests.

use core::ffi::c_int;

use simavr_ffi as ffi;

use super::{Chip, EEPROM, FLASH, FREQUENCY};

/// A hanging program loops here, at the end of the flash.
const LOOP: usize = FLASH - 4;
/// `cli`, in front of the loop.
const CLI: [u8; 2] = [0xF8, 0x94];
/// `rjmp .-2`, the loop.
const RJMP_TO_ITSELF: [u8; 2] = [0xFF, 0xCF];

impl Chip {
    /// `count` bytes of EEPROM from its start.
    pub fn eeprom(&self, count: usize) -> Vec<u8> {
        self.peripherals.eeprom()[..count.min(EEPROM)].to_vec()
    }

    /// Writes the EEPROM from its start, as a programmer does.
    pub fn set_eeprom(&self, content: &[u8]) {
        self.peripherals.set_eeprom(0, content);
    }

    /// `count` bytes of RAM or registers from `address` on.
    pub fn memory(&self, address: u16, count: usize) -> Vec<u8> {
        // SAFETY: `ramend` bounds the data space; nothing beyond it is read.
        unsafe {
            let end = usize::from((*self.avr).ramend) + 1;
            let from = usize::from(address).min(end);
            let count = count.min(end - from);
            core::slice::from_raw_parts((*self.avr).data.add(from), count).to_vec()
        }
    }

    /// Writes RAM from `address` on.
    pub fn set_memory(&self, address: u16, bytes: &[u8]) {
        for (place, byte) in (usize::from(address)..).zip(bytes) {
            // SAFETY: `ramend` bounds the data space; nothing beyond it is written.
            unsafe {
                if place <= usize::from((*self.avr).ramend) {
                    *(*self.avr).data.add(place) = *byte;
                }
            }
        }
    }

    /// The stack pointer.
    pub fn stack_pointer(&self) -> u16 {
        u16::from_le_bytes([self.register(0x5D), self.register(0x5E)])
    }

    /// Makes the main program hang in a loop of one instruction, as a wild pointer does. Interrupts
    /// still run. A handler or a section without interrupts is finished first if that takes less
    /// than 1 ms.
    pub fn hang(&self) {
        self.enter_loop(LOOP);
    }

    /// Makes the program hang with interrupts off, as in a section that never turns them on again.
    pub fn hang_with_interrupts_off(&self) {
        self.enter_loop(LOOP - CLI.len());
    }

    fn enter_loop(&self, from: usize) {
        const INTERRUPTS_ON: u8 = 7;
        let patience = self.cycle() + FREQUENCY / 1_000;
        // SAFETY: plain fields of a living chip.
        let uninterruptible = || unsafe {
            (*self.avr).interrupts.running_ptr > 0
                || (*self.avr).sreg[usize::from(INTERRUPTS_ON)] == 0
        };
        while uninterruptible() && self.cycle() < patience {
            self.run_until(self.cycle() + 1);
        }
        // SAFETY: `place` is inside the flash, at its end, which none of our images reaches; the
        // chip is not running, so the program counter is between two instructions.
        unsafe {
            let place = (*self.avr).flash.add(LOOP - CLI.len());
            for (offset, byte) in CLI.into_iter().chain(RJMP_TO_ITSELF).enumerate() {
                place.add(offset).write(byte);
            }
            (*self.avr).pc = from as u32;
            if (*self.avr).state == ffi::cpu_Sleeping as c_int {
                (*self.avr).state = ffi::cpu_Running as c_int;
            }
        }
    }
}
