//! The bytes of a payload, and the errors that they can contain.
//!
//! They are apart from the payloads because all payloads use them.

/// How many payload bytes a full packet has (U7).
pub const PAYLOAD_LENGTH: usize = 8;

/// The payload part of a packet; bytes beyond a short packet's payload are 0.
pub(crate) type Bytes = [u8; PAYLOAD_LENGTH];

/// The payload byte that breaks a rule.
pub(crate) struct Fault {
    pub(crate) index: u8,
}

/// Version 1's rule that bytes without a meaning are 0.
pub(crate) fn unused_from(first: u8, payload: &Bytes) -> Result<(), Fault> {
    match (first..)
        .zip(&payload[usize::from(first)..])
        .find(|(_, byte)| **byte != 0)
    {
        Some((index, _)) => Err(Fault { index }),
        None => Ok(()),
    }
}
