//! The check value of version 1: CRC-8/AUTOSAR (polynomial 0x2F), over a packet's first ten bytes
//! and over settings kept in EEPROM.
//!
//! Over 80 bits it finds every error of one, two or three bits: a test tries all of them, 113 652
//! for each tested packet.

use crc::{CRC_8_AUTOSAR, Crc, Table};

// One table of 256 bytes everywhere. On the boards it lies in RAM, because constants are copied
// there, and takes 60 us off every packet, which is on the way from the tape to the wheels. On the
// Pi it is ten times as fast as bit by bit (measured: 3 ns instead of 37 ns a packet). Larger
// tables need longer input.
static CRC: Crc<u8, Table<1>> = Crc::<u8, Table<1>>::new(&CRC_8_AUTOSAR);

/// The check value of `bytes`: CRC-8/AUTOSAR.
pub fn checksum(bytes: &[u8]) -> u8 {
    CRC.checksum(bytes)
}

/// The check value of `values`, each with its low byte first.
pub(crate) fn checksum_of(values: &[u16]) -> u8 {
    let mut digest = CRC.digest();
    for value in values {
        digest.update(&value.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_catalogue_with_and_without_a_table() {
        // Greg Cook's CRC catalogue: CRC-8/AUTOSAR of "123456789".
        assert_eq!(checksum(b"123456789"), 0xDF);
        let bitwise = Crc::<u8, crc::NoTable>::new(&CRC_8_AUTOSAR);
        for first in 0..=u8::MAX {
            let bytes = [first, 11, !first, 0, 1, 2, 3, first, 5, 6];
            assert_eq!(checksum(&bytes), bitwise.checksum(&bytes));
        }
    }
}
