//! Reads a firmware image: the contents of flash and EEPROM from an ELF file.
//!
//! simavr could read it too, but it ends the process when a file is wrong.

use std::fs;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{FLASH, Fuses};

/// Bytes of EEPROM of the ATmega1284P.
pub const EEPROM: usize = 4 * 1024;

/// The linker gives addresses from here on to data that exists in RAM only.
const RAM_ORIGIN: usize = 0x80_0000;
/// The linker gives addresses from here on to the EEPROM's content.
const EEPROM_ORIGIN: usize = 0x81_0000;
/// The linker gives these addresses to the fuses and to the lock bits.
const FUSE_ORIGIN: usize = 0x82_0000;
const LOCK_ORIGIN: usize = 0x83_0000;
const MACHINE_AVR: u16 = 83;
const LOAD: u32 = 1;

/// Why an image cannot be loaded.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}; build the images with firmware/avr/build")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is not a program for an AVR.
    #[error("{0} is not an ELF file for an AVR; give the ELF file of a board, not a hex file")]
    NotAvr(PathBuf),
    /// The file is shorter than its headers say.
    #[error("{0} is cut off; build the image again")]
    CutOff(PathBuf),
    /// The image needs an address that the chip lacks.
    #[error("{path} needs address {address:#x}, which the ATmega1284P does not have")]
    Beyond {
        /// The file.
        path: PathBuf,
        /// The first byte's address.
        address: usize,
    },
    /// simavr does not know the chip.
    #[error("this simavr does not know the atmega1284p; build the emulator again")]
    NoChip,
}

/// An image; one image can fill many chips.
#[derive(Clone, Debug)]
pub struct Image {
    pub(crate) flash: Vec<(usize, Vec<u8>)>,
    pub(crate) eeprom: Vec<(usize, Vec<u8>)>,
    pub(crate) fuses: Option<Fuses>,
    rustc: String,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read or is no image for this chip.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = fs::read(path).map_err(|source| ImageError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&bytes, path)
    }

    /// An image of these bytes, the first one at address 0, as a programmer has read them.
    pub fn from_bytes(bytes: Vec<u8>) -> Self {
        Self {
            flash: vec![(0, bytes)],
            eeprom: Vec::new(),
            fuses: None,
            rustc: String::new(),
        }
    }

    /// This image and another one in the same chip, such as an application and its boot loader. The
    /// fuses are those of this image, if it has any.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        self.flash.extend_from_slice(&other.flash);
        self.eeprom.extend_from_slice(&other.eeprom);
        self.fuses = self.fuses.or(other.fuses);
        self
    }

    /// How many bytes of flash the image fills.
    pub fn flash_bytes(&self) -> usize {
        self.flash.iter().map(|(_, bytes)| bytes.len()).sum()
    }

    /// The version of rustc that built the image, such as `1.96.0`; empty if the file does not say.
    pub fn rustc(&self) -> &str {
        &self.rustc
    }

    fn parse(bytes: &[u8], path: &Path) -> Result<Self, ImageError> {
        let is_avr =
            bytes.starts_with(b"\x7FELF\x01\x01") && half(bytes, 0x12) == Some(MACHINE_AVR);
        if !is_avr {
            return Err(ImageError::NotAvr(path.to_owned()));
        }
        let mut image = Self {
            flash: Vec::new(),
            eeprom: Vec::new(),
            fuses: None,
            rustc: compiler(bytes),
        };
        let cut_off = || ImageError::CutOff(path.to_owned());
        let table = word(bytes, 0x1C).ok_or_else(cut_off)?;
        let size = usize::from(half(bytes, 0x2A).ok_or_else(cut_off)?);
        let count = usize::from(half(bytes, 0x2C).ok_or_else(cut_off)?);
        for index in 0..count {
            let header = table + index * size;
            let field = |offset| word(bytes, header + offset).ok_or_else(cut_off);
            let (offset, address, length) = (field(4)?, field(12)?, field(16)?);
            if field(0)? != LOAD as usize || length == 0 {
                continue;
            }
            let content = bytes.get(offset..offset + length).ok_or_else(cut_off)?;
            image.place(address, content, path)?;
        }
        if image.flash.is_empty() {
            return Err(ImageError::NotAvr(path.to_owned()));
        }
        Ok(image)
    }

    fn place(&mut self, address: usize, content: &[u8], path: &Path) -> Result<(), ImageError> {
        if address + content.len() <= FLASH {
            self.flash.push((address, content.to_owned()));
        } else if (EEPROM_ORIGIN..EEPROM_ORIGIN + 0x1_0000).contains(&address) {
            let start = address - EEPROM_ORIGIN;
            if start + content.len() > EEPROM {
                return Err(ImageError::Beyond {
                    path: path.to_owned(),
                    address,
                });
            }
            self.eeprom.push((start, content.to_owned()));
        } else if address < RAM_ORIGIN {
            return Err(ImageError::Beyond {
                path: path.to_owned(),
                address,
            });
        }
        let mut fuses = self.fuses.unwrap_or_default();
        match (address, content) {
            (FUSE_ORIGIN, &[low, high, extended]) => {
                (fuses.low, fuses.high, fuses.extended) = (low, high, extended);
            }
            (LOCK_ORIGIN, &[lock]) => fuses.lock = lock,
            // A programmer does not write RAM and signature.
            _ => return Ok(()),
        }
        self.fuses = Some(fuses);
        Ok(())
    }
}

/// Finds the compiler's version in the file's comments: `rustc version 1.96.0 (...)`.
fn compiler(bytes: &[u8]) -> String {
    const MARK: &[u8] = b"rustc version ";
    let Some(at) = bytes.windows(MARK.len()).position(|window| window == MARK) else {
        return String::new();
    };
    let version = bytes[at + MARK.len()..].iter();
    version
        .take_while(|byte| byte.is_ascii_graphic())
        .map(|byte| char::from(*byte))
        .collect()
}

fn half(bytes: &[u8], at: usize) -> Option<u16> {
    let field = bytes.get(at..at + 2)?;
    Some(u16::from_le_bytes([field[0], field[1]]))
}

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let field: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(u32::from_le_bytes(field) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elf(machine: u16, address: u32) -> Vec<u8> {
        let mut bytes = vec![0; 0x34 + 0x20];
        bytes[..6].copy_from_slice(b"\x7FELF\x01\x01");
        bytes[0x12..0x14].copy_from_slice(&machine.to_le_bytes());
        bytes[0x1C] = 0x34;
        bytes[0x2A] = 0x20;
        bytes[0x2C] = 1;
        let mut put = |at: usize, value: u32| {
            bytes[0x34 + at..0x34 + at + 4].copy_from_slice(&value.to_le_bytes());
        };
        put(0, LOAD);
        put(4, 0x54);
        put(12, address);
        put(16, 2);
        bytes.extend([0xFF, 0xCF]);
        bytes
    }

    fn parse(bytes: &[u8]) -> Result<Image, ImageError> {
        Image::parse(bytes, Path::new("image.elf"))
    }

    #[test]
    fn a_segment_lands_where_it_says() {
        let image = parse(&elf(MACHINE_AVR, 0x100)).unwrap();
        assert_eq!(image.flash, [(0x100, vec![0xFF, 0xCF])]);
        assert_eq!(image.flash_bytes(), 2);
        assert_eq!(image.rustc(), "");
    }

    #[test]
    fn an_image_tells_its_compiler() {
        let mut bytes = elf(MACHINE_AVR, 0);
        bytes.extend(b"\0rustc version 1.96.0-nightly (ac68faa20 2026-05-25)\0");
        assert_eq!(parse(&bytes).unwrap().rustc(), "1.96.0-nightly");
    }

    #[test]
    fn an_image_tells_its_fuses() {
        assert_eq!(parse(&elf(MACHINE_AVR, 0)).unwrap().fuses, None);
        let mut image = parse(&elf(MACHINE_AVR, 0)).unwrap();
        let path = Path::new("image.elf");
        image.place(FUSE_ORIGIN, &[0xF7, 0x92, 0xFC], path).unwrap();
        image.place(LOCK_ORIGIN, &[0xEF], path).unwrap();
        let fuses = Fuses {
            low: 0xF7,
            high: 0x92,
            extended: 0xFC,
            lock: 0xEF,
        };
        assert_eq!(image.fuses, Some(fuses));
        let application = parse(&elf(MACHINE_AVR, 0x100)).unwrap();
        let both = application.with(&image);
        assert_eq!((both.fuses, both.flash.len()), (Some(fuses), 2));
    }

    #[test]
    fn what_is_no_image_is_refused_with_its_reason() {
        assert!(matches!(parse(b":1000"), Err(ImageError::NotAvr(_))));
        assert!(matches!(parse(&elf(62, 0)), Err(ImageError::NotAvr(_))));
        let cut = elf(MACHINE_AVR, 0);
        let cut = &cut[..cut.len() - 1];
        assert!(matches!(parse(cut), Err(ImageError::CutOff(_))));
        let beyond = parse(&elf(MACHINE_AVR, 0x2_0000));
        assert!(matches!(
            beyond,
            Err(ImageError::Beyond {
                address: 0x2_0000,
                ..
            })
        ));
    }
}
