//! The instructions of a servo (A4).

/// An instruction code. The four names below with `INST_` are in the original's listing but not in
/// today's manual of the servo; they can be decoded, but this robot never sends them (AMB-33).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Instruction {
    /// Answer with a status packet.
    Ping = 0x01,
    /// Parameters: first address, count. The servo answers with the registers.
    Read = 0x02,
    /// Parameters: first address, values.
    Write = 0x03,
    /// As `Write`, but the servo waits for `Action`.
    RegWrite = 0x04,
    /// Carries out the waiting write.
    Action = 0x05,
    /// Restores the factory's values, also the id.
    Reset = 0x06,
    /// `INST_DIGITAL_RESET` of the listing.
    DigitalReset = 0x07,
    /// `INST_SYSTEM_READ` of the listing.
    SystemRead = 0x0C,
    /// `INST_SYSTEM_WRITE` of the listing.
    SystemWrite = 0x0D,
    /// One write to several servos; as a broadcast, so no servo answers.
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
