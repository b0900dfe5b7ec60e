//! The EEPROM, byte by byte; nothing waits for it.

use avr_device::interrupt;

use crate::register::{bit, eeprom, get, put, set};

const EERE: u8 = bit(0);
const EEPE: u8 = bit(1);
const EEMPE: u8 = bit(2);

/// A byte of it; not while one is being written.
pub fn read(address: u8) -> u8 {
    let eeprom = eeprom();
    put(eeprom.eear(), u16::from(address));
    set(eeprom.eecr(), EERE);
    get(eeprom.eedr())
}

/// Begins to write a byte, which takes 3.4 ms; `false`, and nothing happens, while another is being
/// written.
pub fn write(address: u8, value: u8) -> bool {
    let eeprom = eeprom();
    if get(eeprom.eecr()) & EEPE != 0 {
        return false;
    }
    put(eeprom.eear(), u16::from(address));
    put(eeprom.eedr(), value);
    // The second bit within four cycles after the first.
    interrupt::free(|_| {
        set(eeprom.eecr(), EEMPE);
        set(eeprom.eecr(), EEPE);
    });
    true
}
