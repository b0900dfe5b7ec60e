//! STK500 version 1, as far as the loader speaks it (Atmel's application note AVR061).
//!
//! ```text
//!   Pi:      command  arguments  EOP
//!   loader:  INSYNC   answer     OK
//! ```
//!
//! Addresses are in words, so 16 bits reach all of the flash; those of EEPROM are halved as well.

/// Ends every command.
pub const EOP: u8 = 0x20;

/// The loader has understood the command.
pub const INSYNC: u8 = 0x14;
/// The command did not end with [`EOP`].
pub const NO_SYNC: u8 = 0x15;
/// It is done.
pub const OK: u8 = 0x10;
/// The loader refuses it.
pub const FAILED: u8 = 0x11;
/// The loader does not have this command.
pub const UNKNOWN: u8 = 0x12;

/// Only answers.
pub const GET_SYNC: u8 = 0x30;
/// The value of a parameter, see [`parameter`].
pub const GET_PARAMETER: u8 = 0x41;
/// 20 bytes that describe the chip; the loader knows its chip.
pub const SET_DEVICE: u8 = 0x42;
/// Bytes that describe the programmer, their number first.
pub const SET_DEVICE_EXTENDED: u8 = 0x45;
/// Begins to program.
pub const ENTER_PROGRAMMING: u8 = 0x50;
/// Starts the application.
pub const LEAVE_PROGRAMMING: u8 = 0x51;
/// An address in words, the low byte first.
pub const LOAD_ADDRESS: u8 = 0x55;
/// Four bytes for an ISP programmer; the loader reads fuses with it.
pub const UNIVERSAL: u8 = 0x56;
/// Writes a page: length (high byte first), memory, bytes.
pub const WRITE_PAGE: u8 = 0x64;
/// Reads a page: length (high byte first), memory.
pub const READ_PAGE: u8 = 0x74;
/// The chip's signature.
pub const READ_SIGNATURE: u8 = 0x75;

/// The memory of a page.
pub const FLASH: u8 = b'F';
/// The memory of a page.
pub const EEPROM: u8 = b'E';

/// The signature of the ATmega1284P.
pub const SIGNATURE: [u8; 3] = [0x1E, 0x97, 0x05];

/// Parameters of [`GET_PARAMETER`].
pub mod parameter {
    /// Version of the loader, its first number.
    pub const MAJOR: u8 = 0x81;
    /// Version of the loader, its second number.
    pub const MINOR: u8 = 0x82;
    /// Only this loader: the callsign of its board.
    pub const ROLE: u8 = 0xA0;
    /// Only this loader: 1 if the application is whole, else 0.
    pub const WHOLE: u8 = 0xA1;
    /// The answer to any other.
    pub const OTHER: u8 = 3;
}

/// The loader's version, as avrdude shows it.
pub const VERSION: [u8; 2] = [1, 0];
