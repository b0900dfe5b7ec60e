//! Reads and writes the EEPROM byte by byte; nothing waits for it.

use avr_device::interrupt;

use crate::register::{bit, eeprom, get, put, set};

const EERE: u8 = bit(0);
const EEPE: u8 = bit(1);
const EEMPE: u8 = bit(2);

/// Reads a byte; not allowed while a write runs.
pub fn read(address: u16) -> u8 {
    let eeprom = eeprom();
    put(eeprom.eear(), address);
    set(eeprom.eecr(), EERE);
    get(eeprom.eedr())
}

/// Whether a write runs.
pub fn is_writing() -> bool {
    get(eeprom().eecr()) & EEPE != 0
}

/// Begins to write a byte, which takes 3.4 ms. `false`: nothing happens, because a write runs.
pub fn write(address: u16, value: u8) -> bool {
    let eeprom = eeprom();
    if is_writing() {
        return false;
    }
    put(eeprom.eear(), address);
    put(eeprom.eedr(), value);
    // The second bit must be set within four cycles of the first.
    interrupt::free(|_| {
        set(eeprom.eecr(), EEMPE);
        set(eeprom.eecr(), EEPE);
    });
    true
}
