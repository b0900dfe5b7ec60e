//! A board's fuses and lock bits, as a programmer writes them. `firmware/avr/README.md` says what each
//! of them means.

/// The low fuse: a crystal of 16 MHz, and no division of its clock.
pub const LOW: u8 = 0xF7;
/// The low fuse of a board whose clock comes from an oscillator at XTAL1.
pub const LOW_EXTERNAL: u8 = 0xE0;
/// The high fuse: the chip starts in its boot section of 4 KiB, and an erasure keeps the EEPROM.
pub const HIGH: u8 = 0x92;
/// The extended fuse: a reset below 4.3 V.
pub const EXTENDED: u8 = 0xFC;
/// The lock bits: no program can write the boot section.
pub const LOCK: u8 = 0xEF;

/// The bit of the high fuse that is 0 in a chip whose EEPROM stays when the flash is erased.
pub const EEPROM_ERASED: u8 = 1 << 3;
/// The lock bits that are 0 in a chip that refuses a programmer until it is erased.
pub const LOCKED_OUT: u8 = 0b11;
