//! [`Image`]: a board's image from an Intel hex file, with everything checked before a board is
//! touched.

use lager_wire::Callsign;
use thiserror::Error;

use crate::header::{BOOT_SECTION, Header, PAGE, crc_step};

/// Why a file is no image for a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ImageError {
    /// A line is not one of an Intel hex file.
    #[error("line {line} is not one of an Intel hex file; give the .hex file of an image")]
    NotHex {
        /// The line, from 1.
        line: usize,
    },
    /// A line is damaged.
    #[error("line {line} is damaged: its check value does not fit; copy the file again")]
    Damaged {
        /// The line, from 1.
        line: usize,
    },
    /// The file has no end.
    #[error("the file is cut off; copy it again")]
    CutOff,
    /// The image is too large for the application's section.
    #[error(
        "the image needs {size} bytes, and a board has {BOOT_SECTION}: above them is its \
         bootloader; give the image of a board alone"
    )]
    TooLarge {
        /// The address behind its last byte.
        size: u32,
    },
    /// There is no header.
    #[error(
        "this is no image for a board of this robot: it has no header; build it with firmware/avr/build"
    )]
    NoHeader,
    /// The header tells another length, or the check value does not fit.
    #[error("the image is not whole: its check value does not fit; build it again")]
    NotWhole,
}

/// An image that is whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    header: Header,
    bytes: Vec<u8>,
}

impl Image {
    /// Reads an Intel hex file.
    ///
    /// # Errors
    /// It is no whole image for a board.
    pub fn from_hex(text: &str) -> Result<Self, ImageError> {
        Self::from_bytes(read_hex(text)?)
    }

    /// An image from its bytes, the first one at address 0.
    ///
    /// # Errors
    /// It is no whole image for a board.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, ImageError> {
        let size = bytes.len() as u32;
        if size > BOOT_SECTION {
            return Err(ImageError::TooLarge { size });
        }
        let header = bytes
            .get(Header::AT as usize..)
            .and_then(|rest| rest.first_chunk())
            .and_then(Header::read)
            .ok_or(ImageError::NoHeader)?;
        if header.length != size || !header.fits(|at| bytes[at as usize], crc_step) {
            return Err(ImageError::NotWhole);
        }
        Ok(Self { header, bytes })
    }

    /// The board that it is for.
    pub fn role(&self) -> Callsign {
        self.header.role
    }

    /// Its build number.
    pub fn build(&self) -> u16 {
        self.header.build
    }

    /// Its bytes, the first one at address 0.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its pages, each with its address.
    pub(crate) fn pages(&self) -> impl Iterator<Item = (u32, &[u8])> {
        (0..).step_by(PAGE).zip(self.bytes.chunks(PAGE))
    }
}

/// The bytes of a hex file from address 0 on; gaps are 0xFF.
fn read_hex(text: &str) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    let mut base = 0;
    for (index, line) in text.lines().map(str::trim).enumerate() {
        if line.is_empty() {
            continue;
        }
        let line_number = index + 1;
        let not_hex = ImageError::NotHex { line: line_number };
        let record = record(line).ok_or(not_hex)?;
        let sum = record.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        let [length, high, low, kind, rest @ ..] = record.as_slice() else {
            return Err(not_hex);
        };
        if rest.len() != usize::from(*length) + 1 {
            return Err(not_hex);
        }
        if sum != 0 {
            return Err(ImageError::Damaged { line: line_number });
        }
        let data = &rest[..usize::from(*length)];
        match (kind, data) {
            (0, _) => {
                let from = base + u32::from(u16::from_be_bytes([*high, *low]));
                let end = from + data.len() as u32;
                if end > BOOT_SECTION {
                    return Err(ImageError::TooLarge { size: end });
                }
                let (from, end) = (from as usize, end as usize);
                bytes.resize(end.max(bytes.len()), 0xFF);
                bytes[from..end].copy_from_slice(data);
            }
            (1, []) => return Ok(bytes),
            // Two ways to go beyond 64 KiB: a segment of 16 bytes, and the upper half of an address.
            (2, &[high, low]) => base = u32::from(u16::from_be_bytes([high, low])) << 4,
            (4, &[high, low]) => base = u32::from(u16::from_be_bytes([high, low])) << 16,
            // Where a program starts; a chip knows that by itself.
            (3 | 5, _) => {}
            _ => return Err(not_hex),
        }
    }
    Err(ImageError::CutOff)
}

fn record(line: &str) -> Option<Vec<u8>> {
    let digits = line.strip_prefix(':')?.as_bytes();
    let digit = |byte: u8| char::from(byte).to_digit(16);
    if !digits.len().is_multiple_of(2) {
        return None;
    }
    digits
        .chunks(2)
        .map(|pair| Some((digit(pair[0])? << 4 | digit(pair[1])?) as u8))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A whole image of so many bytes.
    fn whole(length: u32) -> Vec<u8> {
        let mut bytes: Vec<u8> = (0..length).map(|at| (at / 256) as u8).collect();
        let at = Header::AT as usize;
        bytes[at..at + Header::LENGTH].copy_from_slice(&Header::of(Callsign::Sensor));
        bytes[at + 8..at + 12].copy_from_slice(&length.to_le_bytes());
        let crc = bytes
            .iter()
            .fold(u32::MAX, |crc, byte| crc_step(crc, *byte));
        bytes[at + 12..at + 16].copy_from_slice(&(!crc).to_le_bytes());
        bytes
    }

    fn line(kind: u8, address: u16, data: &[u8]) -> String {
        let [high, low] = address.to_be_bytes();
        let mut record = vec![data.len() as u8, high, low, kind];
        record.extend(data);
        let sum = record.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        record.push(sum.wrapping_neg());
        let digits: String = record.iter().map(|byte| format!("{byte:02X}")).collect();
        format!(":{digits}\n")
    }

    /// A hex file that goes beyond 64 KiB by records of this kind.
    fn hex(bytes: &[u8], kind: u8) -> String {
        let mut text = String::new();
        for (index, data) in bytes.chunks(16).enumerate() {
            let address = index as u32 * 16;
            if address > 0 && address.is_multiple_of(0x1_0000) {
                let base = if kind == 2 {
                    address >> 4
                } else {
                    address >> 16
                };
                text += &line(kind, 0, &(base as u16).to_be_bytes());
            }
            text += &line(0, address as u16, data);
        }
        text + &line(1, 0, &[])
    }

    #[test]
    fn an_image_of_the_greatest_size_is_read_with_both_kinds_of_addresses() {
        let bytes = whole(BOOT_SECTION);
        for kind in [2, 4] {
            let image = Image::from_hex(&hex(&bytes, kind)).unwrap();
            assert_eq!(image.bytes(), bytes);
            assert_eq!(image.role(), Callsign::Sensor);
            assert_eq!(image.pages().count(), 496);
        }
    }

    #[test]
    fn what_no_board_should_get_is_refused_with_its_reason() {
        let bytes = whole(1_000);
        let text = hex(&bytes, 2);
        let fault = |text: &str| Image::from_hex(text).unwrap_err();
        assert_eq!(fault("\x7FELF"), ImageError::NotHex { line: 1 });
        assert_eq!(
            fault(&text.replacen("00", "0", 1)),
            ImageError::NotHex { line: 1 }
        );
        let damaged = text.replacen(":10001", ":10002", 1);
        assert_eq!(fault(&damaged), ImageError::Damaged { line: 2 });
        let end = text.len() - ":00000001FF\n".len();
        assert_eq!(fault(&text[..end]), ImageError::CutOff);
        // One byte more than fits, and a small image with a byte in the boot section.
        let beyond = hex(&vec![0; 126_977], 2);
        assert_eq!(fault(&beyond), ImageError::TooLarge { size: 126_977 });
        let beyond = text[..end].to_owned() + &line(2, 0, &[0x10, 0]) + &line(0, 0xF000, &[0]);
        assert_eq!(fault(&beyond), ImageError::TooLarge { size: 126_977 });
        assert!(
            ImageError::TooLarge { size: 126_977 }
                .to_string()
                .contains("126976")
        );
        assert_eq!(fault(&hex(&[0; 500], 2)), ImageError::NoHeader);
        let mut other = bytes.clone();
        other[700] ^= 1;
        assert_eq!(fault(&hex(&other, 2)), ImageError::NotWhole);
        assert_eq!(fault(&hex(&bytes[..999], 2)), ImageError::NotWhole);
    }
}
