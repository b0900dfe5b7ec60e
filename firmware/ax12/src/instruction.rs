//! What a servo can be asked to do (A4).

/// An instruction code. The last four names are in the original's listing but not in today's manual
/// of the servo; they can be decoded and are never sent by this robot (AMB-33).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Instruction {
    /// Answer with a status packet.
    Ping = 0x01,
    /// Parameters: first address, count. Answered with the registers.
    Read = 0x02,
    /// Parameters: first address, values.
    Write = 0x03,
    /// As `Write`, but held back until `Action`.
    RegWrite = 0x04,
    /// Carries out the write held back.
    Action = 0x05,
    /// Back to the factory's values, the id included.
    Reset = 0x06,
    /// `INST_DIGITAL_RESET` of the listing.
    DigitalReset = 0x07,
    /// `INST_SYSTEM_READ` of the listing.
    SystemRead = 0x0C,
    /// `INST_SYSTEM_WRITE` of the listing.
    SystemWrite = 0x0D,
    /// One write to several servos; broadcast, so nobody answers.
    SyncWrite = 0x83,
    /// `INST_SYNC_REG_WRITE` of the listing.
    SyncRegWrite = 0x84,
}

impl Instruction {
    /// The code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The instruction with this code, if there is one.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0x01 => Self::Ping,
            0x02 => Self::Read,
            0x03 => Self::Write,
            0x04 => Self::RegWrite,
            0x05 => Self::Action,
            0x06 => Self::Reset,
            0x07 => Self::DigitalReset,
            0x0C => Self::SystemRead,
            0x0D => Self::SystemWrite,
            0x83 => Self::SyncWrite,
            0x84 => Self::SyncRegWrite,
            _ => return None,
        })
    }
}
