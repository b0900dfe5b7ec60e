//! A board with another image than this source's.

use lager_wire::{PACKET_LENGTH, Packet, Payload, Version};

use super::Peer;

/// A board whose image tells another build number.
pub struct Built<P> {
    /// The board.
    pub board: P,
    /// The number.
    pub build: u16,
}

impl<P: Peer> Peer for Built<P> {
    fn take(&mut self, byte: u8, now_us: u32) {
        self.board.take(byte, now_us);
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        let before = out.len();
        self.board.step(now_us, out);
        // A board appends whole packets.
        for bytes in out[before..].chunks_exact_mut(PACKET_LENGTH) {
            if let Ok(mut packet) = Packet::decode(bytes, Version::One)
                && let Payload::Handshake(handshake) = &mut packet.payload
            {
                handshake.build = self.build;
                bytes.copy_from_slice(&packet.encode(Version::One));
            }
        }
    }
}
