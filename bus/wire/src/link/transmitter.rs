//! [`HostTransmitter`]: the Pi's sending end. It numbers packets and knows the board's version.
//!
//! It is apart from the receiving end because different threads read and write the port. The
//! receiving end hands this one what it wants to send.

use super::handshake;
use crate::handshake::{Callsign, ResetCause, SynAck, Version};
use crate::packet::{PACKET_LENGTH, Packet, PacketId};
use crate::payload::Payload;

/// The Pi's sending end of the line to one board.
#[derive(Clone, Debug, Default)]
pub struct HostTransmitter {
    version: Option<Version>,
    next_id: PacketId,
}

impl HostTransmitter {
    /// A transmitter that sends no data yet.
    pub const fn new() -> Self {
        Self {
            version: None,
            next_id: PacketId::new(0),
        }
    }

    /// The question to a board that may already be running. It is always of version 1: an original
    /// board ignores the new bytes.
    pub fn syn(&self) -> [u8; PACKET_LENGTH] {
        let (sign, reset) = (Callsign::Raspi, ResetCause::Unknown);
        handshake(SynAck::Syn, sign, reset, Version::One, false, 0)
    }

    /// The answer to a board's SYN. Data packets after it are numbered from 0.
    pub fn ack(&mut self, version: Version) -> [u8; PACKET_LENGTH] {
        self.adopt(version);
        let (sign, reset) = (Callsign::Raspi, ResetCause::Unknown);
        handshake(SynAck::Ack, sign, reset, version, false, 0)
    }

    /// Starts to send to a board that was found running and gets no ACK.
    pub fn adopt(&mut self, version: Version) {
        self.version = Some(version);
        self.next_id = PacketId::new(0);
    }

    /// The bytes of the next data packet. `None` before the first ACK, for handshakes, and for
    /// anything but commands to an original board, which knows nothing else.
    pub fn encode(&mut self, payload: Payload) -> Option<[u8; PACKET_LENGTH]> {
        let version = self.version?;
        let understood = match payload {
            Payload::Handshake(_) => false,
            Payload::SteerCommand(_) => true,
            _ => version == Version::One,
        };
        if !understood {
            return None;
        }
        let id = self.next_id;
        self.next_id = id.next();
        Some(Packet { id, payload }.encode(version))
    }
}
