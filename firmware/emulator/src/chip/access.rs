//! Looking into a chip, and the one thing that is done to it: letting it hang.

use core::ffi::c_int;

use simavr_ffi as ffi;

use super::{Chip, EEPROM, FLASH, FREQUENCY};

/// Where a program hangs: at the end of the flash.
const LOOP: usize = FLASH - 4;
/// `cli`, in front of it.
const CLI: [u8; 2] = [0xF8, 0x94];
/// `rjmp .-2`
const RJMP_TO_ITSELF: [u8; 2] = [0xFF, 0xCF];

impl Chip {
    /// `count` bytes of EEPROM from its start.
    pub fn eeprom(&self, count: usize) -> Vec<u8> {
        self.peripherals.eeprom()[..count.min(EEPROM)].to_vec()
    }

    /// Fills the EEPROM from its start, as a programmer does.
    pub fn set_eeprom(&self, content: &[u8]) {
        self.peripherals.set_eeprom(0, content);
    }

    /// `count` bytes of RAM or registers from `address` on.
    pub fn memory(&self, address: u16, count: usize) -> Vec<u8> {
        // SAFETY: `ramend` bounds the data space; what lies beyond is not read.
        unsafe {
            let end = usize::from((*self.avr).ramend) + 1;
            let from = usize::from(address).min(end);
            let count = count.min(end - from);
            core::slice::from_raw_parts((*self.avr).data.add(from), count).to_vec()
        }
    }

    /// The stack pointer.
    pub fn stack_pointer(&self) -> u16 {
        u16::from_le_bytes([self.register(0x5D), self.register(0x5E)])
    }

    /// Lets the main program hang: it goes on in a loop of one instruction, as by a wild pointer.
    /// Interrupts are served: one that is under way, or a section without them, is finished
    /// first if that takes less than a millisecond.
    pub fn hang(&self) {
        self.enter_loop(LOOP);
    }

    /// The same with interrupts off for good, as in a section without them that never ends.
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
        // SAFETY: the place is inside the flash, whose last instructions no image of ours reaches;
        // the chip is not running, so the program counter is between two instructions.
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
