//! Names the chip's two USARTs and the addresses of their registers.
//!
//! In a file of its own, because the USARTs and the queue of events both need the names.

/// One of the chip's two USARTs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UsartId {
    /// RXD0 and TXD0.
    Zero,
    /// RXD1 and TXD1.
    One,
}

impl UsartId {
    pub(super) const BOTH: [Self; 2] = [Self::Zero, Self::One];

    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// The address of UCSRnA; the others follow it.
    pub(super) const fn base(self) -> u8 {
        match self {
            Self::Zero => 0xC0,
            Self::One => 0xC8,
        }
    }

    pub(super) fn of(address: u16) -> Self {
        if address < u16::from(Self::One.base()) {
            Self::Zero
        } else {
            Self::One
        }
    }
}

pub(super) const UCSRA: u8 = 0;
pub(super) const UCSRB: u8 = 1;
pub(super) const UCSRC: u8 = 2;
pub(super) const UBRRL: u8 = 4;
pub(super) const UBRRH: u8 = 5;
pub(super) const UDR: u8 = 6;
