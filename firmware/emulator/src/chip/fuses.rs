//! The fuses and lock bits of a chip; a programmed bit is 0.
//!
//! An image may carry them, as avr-gcc does, in sections of its ELF file (`.fuse` and `.lock`).

/// Bytes of flash of the ATmega1284P.
pub const FLASH: usize = 128 * 1024;

/// Low bit of the high fuse: the chip starts in its boot section.
const BOOTRST: u8 = 0x01;
/// A lock bit of the application's section: SPM does not write there.
const BLB01: u8 = 0x04;
/// A lock bit of the boot section: SPM does not write there.
const BLB11: u8 = 0x10;
/// The bits of the lock byte that exist.
const LOCK_BITS: u8 = 0x3F;

/// The fuses and lock bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fuses {
    /// Clock and start-up time. The emulator always runs with a crystal of 16 MHz and 65 ms.
    pub low: u8,
    /// The boot section's size and whether the chip starts there.
    pub high: u8,
    /// The brown-out voltage.
    pub extended: u8,
    /// The lock bits. A program can only clear them; a programmer sets them by a chip erase.
    pub lock: u8,
}

impl Default for Fuses {
    /// Those of a chip from the factory, but with a crystal: it starts at address 0.
    fn default() -> Self {
        Self {
            low: 0xF7,
            high: 0x99,
            extended: 0xFF,
            lock: 0xFF,
        }
    }
}

impl Fuses {
    /// The first byte of the boot section, which reaches to the end of the flash.
    pub fn boot_section(self) -> u32 {
        // BOOTSZ 0 is the largest section, of 8 KiB; each step halves it.
        FLASH as u32 - (0x2000 >> (self.high >> 1 & 3))
    }

    /// The byte at which the chip starts after a reset.
    pub fn start(self) -> u32 {
        if self.high & BOOTRST == 0 {
            self.boot_section()
        } else {
            0
        }
    }

    /// Whether the lock bits keep SPM from writing at this byte.
    pub(super) fn forbid_writing(self, address: u32) -> bool {
        let bit = if address < self.boot_section() {
            BLB01
        } else {
            BLB11
        };
        self.lock & bit == 0
    }

    /// The program sets lock bits: each bit of `mask` that is 0 is programmed.
    pub(super) fn program_lock(&mut self, mask: u8) {
        self.lock &= mask | !LOCK_BITS;
    }

    /// The byte that LPM reads at Z after BLBSET.
    pub(super) fn read(self, z: u16) -> Option<u8> {
        match z {
            0 => Some(self.low),
            1 => Some(self.lock),
            2 => Some(self.extended),
            3 => Some(self.high),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_high_fuse_says_where_the_boot_section_begins_and_where_the_chip_starts() {
        for (high, section, start) in [
            (0x98, 0x1_E000, 0x1_E000),
            (0x9A, 0x1_F000, 0x1_F000),
            (0x9C, 0x1_F800, 0x1_F800),
            (0x9E, 0x1_FC00, 0x1_FC00),
            (0x9B, 0x1_F000, 0),
        ] {
            let fuses = Fuses {
                high,
                ..Fuses::default()
            };
            assert_eq!((fuses.boot_section(), fuses.start()), (section, start));
        }
        assert_eq!(Fuses::default().start(), 0);
    }
}
