//! [`Header`]: what an application says of itself, behind its vectors.
//!
//! ```text
//! byte 0x8C   'L' 'G' 'R' 'I'     an image of this project
//!      0x90   role                callsign of its board
//!      0x91   1                   format of this header
//!      0x92   build number        2 bytes, the low one first, as all that follow
//!      0x94   length              4 bytes, of the whole image from byte 0
//!      0x98   check value         4 bytes, CRC-32 of the image, these four counted as 0xFF
//! ```
//!
//! It lies in the first page, which is written first. So the loader of a board sees an image of the
//! other board before it erases anything. A half-written image has a check value that does not fit.
//! `firmware/avr/build` puts length and check value into the linked image.

use lager_wire::{BUILD, Callsign};

/// The first byte of the boot section, and so how many bytes an application may have.
pub const BOOT_SECTION: u32 = 0x1_F000;
/// Bytes that the chip erases and writes at a time.
pub const PAGE: usize = 256;

const MAGIC: [u8; 4] = *b"LGRI";
const FORMAT: u8 = 1;
/// Where the check value stands in the header.
const CHECK: usize = 12;

/// What an image says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// The board that it is for.
    pub role: Callsign,
    /// Its build number.
    pub build: u16,
    /// Bytes of the whole image.
    pub length: u32,
    /// The image's CRC-32.
    pub check: u32,
}

impl Header {
    /// The address of its first byte: behind the 35 vectors.
    pub const AT: u32 = 0x8C;
    /// How many bytes it has.
    pub const LENGTH: usize = 16;

    /// The bytes that a board's program contains; length and check value are not known yet.
    pub const fn of(role: Callsign) -> [u8; Self::LENGTH] {
        let [m0, m1, m2, m3] = MAGIC;
        let [low, high] = BUILD.to_le_bytes();
        let code = role.code();
        let no = 0xFF;
        [
            m0, m1, m2, m3, code, FORMAT, low, high, no, no, no, no, no, no, no, no,
        ]
    }

    /// Reads a header. `None`: there is none, or its length is impossible.
    pub fn read(bytes: &[u8; Self::LENGTH]) -> Option<Self> {
        let [
            m0,
            m1,
            m2,
            m3,
            role,
            format,
            b0,
            b1,
            l0,
            l1,
            l2,
            l3,
            c0,
            c1,
            c2,
            c3,
        ] = *bytes;
        let length = u32::from_le_bytes([l0, l1, l2, l3]);
        let role = match Callsign::from_code(role) {
            Some(role @ (Callsign::Sensor | Callsign::Steering)) => role,
            _ => return None,
        };
        let shortest = Self::AT + Self::LENGTH as u32;
        let fits = [m0, m1, m2, m3] == MAGIC && format == FORMAT;
        (fits && length >= shortest && length <= BOOT_SECTION).then_some(Self {
            role,
            build: u16::from_le_bytes([b0, b1]),
            length,
            check: u32::from_le_bytes([c0, c1, c2, c3]),
        })
    }

    /// Whether the image behind this header is whole. `byte` gives the image's bytes in their
    /// order, and `step` is [`crc_step`] or the chip's own form of it.
    pub fn fits(
        &self,
        mut byte: impl FnMut(u32) -> u8,
        mut step: impl FnMut(u32, u8) -> u32,
    ) -> bool {
        let own = Self::AT + CHECK as u32;
        let mut crc = u32::MAX;
        for at in 0..self.length {
            let read = byte(at);
            let counted = if at >= own && at < own + 4 {
                0xFF
            } else {
                read
            };
            crc = step(crc, counted);
        }
        !crc == self.check
    }
}

/// CRC-32 (ISO-HDLC, that of Ethernet and zip) for each byte.
pub const CRC_TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        let mut crc = index as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xEDB8_8320
            } else {
                crc >> 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
};

/// Takes one more byte into a CRC.
pub const fn crc_step(crc: u32, byte: u8) -> u32 {
    crc >> 8 ^ CRC_TABLE[(crc as u8 ^ byte) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_agrees_with_the_catalogue() {
        // Greg Cook's CRC catalogue: CRC-32/ISO-HDLC of "123456789".
        let crc = b"123456789".iter().fold(u32::MAX, |c, b| crc_step(c, *b));
        assert_eq!(!crc, 0xCBF4_3926);
    }

    #[test]
    fn a_header_reads_back_and_one_of_no_image_does_not() {
        let mut bytes = Header::of(Callsign::Steering);
        assert_eq!(Header::read(&bytes), None, "the length is not known yet");
        bytes[8..12].copy_from_slice(&BOOT_SECTION.to_le_bytes());
        let header = Header::read(&bytes).unwrap();
        assert_eq!((header.role, header.build), (Callsign::Steering, BUILD));
        assert_eq!(header.length, BOOT_SECTION);
        for (index, value) in [(0, b'X'), (4, Callsign::Raspi.code()), (5, 2), (10, 2)] {
            let mut other = bytes;
            other[index] = value;
            assert_eq!(Header::read(&other), None, "byte {index}");
        }
    }
}
