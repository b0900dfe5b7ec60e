//! The Pi's sending end: numbers packets and knows which version the board takes.
//!
//! It is apart from the receiving end because different threads read and write the port. What the
//! receiving end wants to send is handed to this one.

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

    /// The question to a board that may be running already. It is always version 1: an original
    /// board does not look at what is new in it.
    pub fn syn(&self) -> [u8; PACKET_LENGTH] {
        let (sign, reset) = (Callsign::Raspi, ResetCause::Unknown);
        handshake(SynAck::Syn, sign, reset, Version::One, false)
    }

    /// The answer to a board's SYN; data packets are numbered from 0 after it.
    pub fn ack(&mut self, version: Version) -> [u8; PACKET_LENGTH] {
        self.adopt(version);
        let (sign, reset) = (Callsign::Raspi, ResetCause::Unknown);
        handshake(SynAck::Ack, sign, reset, version, false)
    }

    /// Starts sending to a board that was found running and takes no ACK.
    pub fn adopt(&mut self, version: Version) {
        self.version = Some(version);
        self.next_id = PacketId::new(0);
    }

    /// The bytes of the next data packet. `None` before the first ACK, for handshakes, and for
    /// what an original board does not know: it takes only commands.
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
