//! [`BoardLink`]: the board's end. It sends SYN until the Pi answers, then counts ids both ways.
//!
//! ```text
//!            ACK/raspi
//!   waiting -----------> up      waiting: SYN at once and every 100 ms, no data either way
//!      ^                  |      up: data; a further ACK only restarts the Pi's ids
//!      +------------------+
//!           SYN/raspi            a new listener: the board keeps running
//! ```
//!
//! It speaks version 1 only and never resets the board.

use super::handshake;
use crate::decoder::Decoder;
use crate::handshake::{BUILD, Callsign, Handshake, ResetCause, SynAck, Version};
use crate::packet::{PACKET_LENGTH, Packet, PacketId};
use crate::payload::Payload;

/// How long the board waits for an answer before it asks again, in microseconds (AMB-51).
const SYN_PERIOD_US: u32 = 100_000;

/// An event of a board's link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardEvent {
    /// The Pi has answered, so the board may send data.
    Up,
    /// A packet from the Pi.
    Packet(Packet),
}

/// The board's end of the line to the Pi.
#[derive(Clone, Debug)]
pub struct BoardLink {
    sign: Callsign,
    reset: ResetCause,
    gap_us: u32,
    decoder: Decoder,
    up: bool,
    /// Whether the link has ever been up.
    was_up: bool,
    /// When the next SYN is due; `None` means at once.
    syn_due_us: Option<u32>,
    last_byte_us: u32,
    next_id: PacketId,
    last_received: PacketId,
    lost: u8,
    /// Packets that a gap in time has cut off. The decoder does not know the time.
    cut_off: u8,
}

impl BoardLink {
    /// A link that is not up. A silence longer than `gap_us` microseconds in the middle of a packet
    /// ends that packet; about two byte times are enough (AMB-9).
    pub const fn new(sign: Callsign, reset: ResetCause, gap_us: u32) -> Self {
        Self {
            sign,
            reset,
            gap_us,
            decoder: Decoder::new(Version::One),
            up: false,
            was_up: false,
            syn_due_us: None,
            last_byte_us: 0,
            next_id: PacketId::new(0),
            last_received: PacketId::BEFORE_FIRST,
            lost: 0,
            cut_off: 0,
        }
    }

    /// The SYN to send now, if one is due. Call this once per loop and send the result.
    pub fn poll(&mut self, now_us: u32) -> Option<[u8; PACKET_LENGTH]> {
        if self.us_to_syn(now_us)? > 0 {
            return None;
        }
        self.syn_due_us = Some(now_us.wrapping_add(SYN_PERIOD_US));
        let (sign, reset) = (self.sign, self.reset);
        Some(handshake(
            SynAck::Syn,
            sign,
            reset,
            Version::One,
            self.was_up,
            BUILD,
        ))
    }

    /// How many microseconds until the next SYN is due; `None` while the link is up.
    pub fn us_to_syn(&self, now_us: u32) -> Option<u32> {
        if self.up {
            return None;
        }
        let left = self.syn_due_us.map_or(0, |due| due.wrapping_sub(now_us));
        // More than a period ahead means in the past, because the clock wraps.
        Some(if left > SYN_PERIOD_US { 0 } else { left })
    }

    /// Takes a byte from the Pi, received at `now_us`.
    pub fn push(&mut self, byte: u8, now_us: u32) -> Option<BoardEvent> {
        if self.decoder.is_midway() && now_us.wrapping_sub(self.last_byte_us) > self.gap_us {
            self.decoder.reset();
            self.cut_off = self.cut_off.saturating_add(1);
        }
        self.last_byte_us = now_us;
        let packet = self.decoder.push_on_board(byte)?;
        match packet.payload {
            Payload::Handshake(handshake) => self.shake_hands(handshake),
            _ if self.up => {
                let missing = packet.id.missing_since(self.last_received);
                self.lost = self.lost.saturating_add(missing);
                self.last_received = packet.id;
                Some(BoardEvent::Packet(packet))
            }
            _ => None,
        }
    }

    fn shake_hands(&mut self, handshake: Handshake) -> Option<BoardEvent> {
        if handshake.sign != Callsign::Raspi {
            return None;
        }
        match handshake.kind {
            SynAck::Syn => {
                if self.up {
                    self.up = false;
                    self.syn_due_us = None;
                }
                None
            }
            SynAck::Ack => {
                // The Pi restarts its ids with every ACK, even with a repeated one.
                self.last_received = PacketId::BEFORE_FIRST;
                if self.up {
                    return None;
                }
                self.up = true;
                self.was_up = true;
                self.next_id = PacketId::new(0);
                Some(BoardEvent::Up)
            }
        }
    }

    /// The bytes of the next data packet. `None` while the link is not up, and for handshakes,
    /// which the link sends itself.
    pub fn encode(&mut self, payload: Payload) -> Option<[u8; PACKET_LENGTH]> {
        if !self.up || matches!(payload, Payload::Handshake(_)) {
            return None;
        }
        let id = self.next_id;
        self.next_id = id.next();
        Some(Packet { id, payload }.encode(Version::One))
    }

    /// Whether the Pi has answered.
    pub const fn is_up(&self) -> bool {
        self.up
    }

    /// Packets from the Pi that never came, since the board's start, up to 255; there may be more.
    pub const fn lost_packets(&self) -> u8 {
        self.lost
    }

    /// Damaged or cut-off packets from the Pi, since the board's start, up to 255.
    pub fn bad_packets(&self) -> u8 {
        let counters = self.decoder.counters();
        let refused = counters.bad_crc.saturating_add(counters.bad_content);
        u8::try_from(refused)
            .unwrap_or(u8::MAX)
            .saturating_add(self.cut_off)
    }
}
