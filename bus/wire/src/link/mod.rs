//! Both ends of a line as pure state machines: they shake hands, count ids and find losses.
//!
//! ```text
//!  board                                   Pi
//!    | -- SYN/board, every 100 ms ---------> |   believed at once if its CRC fits
//!    | <------------------------- ACK/raspi -|   ids restart at 0 both ways
//!    | -- data ----------------------------> |
//!    | <--------------------- data ----------|
//!    |                                       |
//!    | <-- SYN/raspi, every 100 ms ----------|   a Pi that has just started, or hears nothing
//!    | -- SYN/board at once ---------------> |   the board keeps running, only the ids restart
//! ```
//!
//! A board's SYN says whether the link has been up since the board started. So the Pi can tell a
//! reset from a cut line, even after a silence in which the Pi has asked too.
//!
//! Handshake packets are not counted and carry id 0. Both ends stand beside each other so that
//! tests run them against each other. Neither does input or output, and neither reads a clock.

mod board;
mod evidence;
mod host;
mod transmitter;

pub use board::{BoardEvent, BoardLink};
pub use host::{HostEvent, HostLink, LinkCounters, Up};
pub use transmitter::HostTransmitter;

use crate::handshake::{Callsign, Handshake, ResetCause, SynAck, Version};
use crate::packet::{PACKET_LENGTH, Packet, PacketId};
use crate::payload::Payload;

/// The bytes of a handshake packet.
fn handshake(
    kind: SynAck,
    sign: Callsign,
    reset: ResetCause,
    version: Version,
    was_up: bool,
    build: u16,
) -> [u8; PACKET_LENGTH] {
    let handshake = Handshake {
        kind,
        sign,
        version,
        reset,
        was_up,
        build,
    };
    Packet {
        id: PacketId::default(),
        payload: Payload::Handshake(handshake),
    }
    .encode(version)
}
