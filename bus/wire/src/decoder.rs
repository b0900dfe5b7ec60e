//! [`Decoder`]: finds packets in a stream of bytes. One byte goes in, at most one packet comes out.
//!
//! Nothing marks a packet's start (AMB-9), so the decoder accepts a start by its structure alone:
//!
//! ```text
//!              header plausible            11 bytes, CRC and content fit
//!   version 1  ----------------> collect  ------------------------------> packet
//!                   ^                | no: move one byte on, look again at the buffered bytes
//!                   +----------------+
//!
//!   original   the same with the length that the header states, without CRC. While hunting (at the
//!              start, after a skip, after a gap in the ids) a packet is held until the next header
//!              has come, is plausible and has the next id
//! ```
//!
//! A rejected window moves on by only one byte, so a complete version-1 packet after noise is never
//! lost. Time does not matter here, because USB adapters deliver bytes in bursts. The boards' end
//! of a link resets the decoder after a gap in time.
//!
//! Measured: 10 MB of random bytes yield 0 packets by version 1's rules, and 61 by the original's.

use crate::handshake::Version;
use crate::packet::{
    DecodeError, HEADER_LENGTH, LENGTH_BYTE, PACKET_LENGTH, Packet, PacketId, kind_of, length_of,
};
use crate::payload::Kind;

/// Room for the longest packet and the header after it.
const CAPACITY: usize = PACKET_LENGTH + HEADER_LENGTH;

/// A decoder's counters. All of them wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecoderCounters {
    /// Packets returned.
    pub packets: u32,
    /// Windows with a plausible header but a wrong check value.
    pub bad_crc: u32,
    /// Windows with a right check value, or without one, whose payload breaks a rule.
    pub bad_content: u32,
    /// Bytes that belong to no packet.
    pub skipped_bytes: u32,
}

/// The id and kind of the packet before, as long as no byte was skipped since.
#[derive(Clone, Copy, Debug)]
struct Header {
    id: PacketId,
    kind: Kind,
}

impl Header {
    fn read(first: u8, second: u8) -> Option<Self> {
        length_of(second, Version::Original)?;
        Some(Self {
            id: PacketId::new(first),
            kind: kind_of(first, Version::Original)?,
        })
    }

    /// Whether `next` can follow this header directly. Original boards may repeat a SYN with the
    /// same id, and may start counting at 0 after it.
    fn is_followed_by(self, next: Self) -> bool {
        next.id == self.id.next()
            || self.kind == Kind::Handshake
                && (next.id.get() == 0 || next.kind == Kind::Handshake && next.id == self.id)
    }
}

/// Finds the packets of one version in a stream of bytes.
#[derive(Clone, Debug)]
pub struct Decoder {
    version: Version,
    length: u8,
    buffer: [u8; CAPACITY],
    counters: DecoderCounters,
    /// Original only: the last packet returned; `None` while hunting.
    locked: Option<Header>,
    /// Original only: the bytes of the last handshake returned.
    handshake: [u8; PACKET_LENGTH],
}

impl Decoder {
    /// A decoder for the packets of one version.
    pub const fn new(version: Version) -> Self {
        Self {
            version,
            length: 0,
            buffer: [0; CAPACITY],
            counters: DecoderCounters {
                packets: 0,
                bad_crc: 0,
                bad_content: 0,
                skipped_bytes: 0,
            },
            locked: None,
            handshake: [0; PACKET_LENGTH],
        }
    }

    /// Takes the next byte and returns the packet that it completes, if any.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Packet> {
        match self.version {
            Version::One => self.push_one::<true>(byte),
            Version::Original => {
                self.keep(byte);
                self.examine_original()
            }
        }
    }

    /// The same on a board, which hears only the Pi, in version 1. So the original's rules, and the
    /// reading of boards' packets, take no room there.
    #[inline]
    pub(crate) fn push_on_board(&mut self, byte: u8) -> Option<Packet> {
        self.push_one::<false>(byte)
    }

    #[inline]
    fn push_one<const BOARDS: bool>(&mut self, byte: u8) -> Option<Packet> {
        self.keep(byte);
        match self.length {
            1 | 2 => {
                self.check_header();
                None
            }
            LENGTH_BYTE.. if BOARDS => self.examine_any_window(),
            LENGTH_BYTE.. => self.examine_window::<false>(),
            _ => None,
        }
    }

    #[inline]
    fn keep(&mut self, byte: u8) {
        self.buffer[usize::from(self.length)] = byte;
        self.length += 1;
    }

    /// Forgets an unfinished packet; its bytes count as skipped.
    pub fn reset(&mut self) {
        self.skip(self.length);
        self.locked = None;
    }

    /// Whether bytes of an unfinished packet are buffered.
    pub const fn is_midway(&self) -> bool {
        self.length > 0
    }

    /// The decoder's counters.
    pub const fn counters(&self) -> &DecoderCounters {
        &self.counters
    }

    /// The bytes of the last original handshake returned, with zeros after a short one.
    pub(crate) const fn last_handshake(&self) -> &[u8; PACKET_LENGTH] {
        &self.handshake
    }

    /// Version 1: keeps the invariant that the buffered bytes start like a packet.
    fn check_header(&mut self) {
        if !self.starts_like_a_packet(0) {
            self.skip_to_next_start();
        }
    }

    /// Version 1: the window is full. It is not generic, so only this crate compiles it: compiled
    /// in each crate that decodes, it took a quarter more instructions.
    fn examine_any_window(&mut self) -> Option<Packet> {
        self.examine_window::<true>()
    }

    /// Version 1: the window is full.
    fn examine_window<const BOARDS: bool>(&mut self) -> Option<Packet> {
        match Packet::decode_from::<BOARDS>(&self.buffer[..PACKET_LENGTH], Version::One) {
            Ok(packet) => {
                self.length = 0;
                self.counters.packets = self.counters.packets.wrapping_add(1);
                Some(packet)
            }
            Err(error) => {
                self.count(error);
                self.skip_to_next_start();
                None
            }
        }
    }

    /// Version 1: whether the bytes from `start` on can be the beginning of a packet.
    fn starts_like_a_packet(&self, start: u8) -> bool {
        let start = usize::from(start);
        let end = usize::from(self.length);
        kind_of(self.buffer[start], Version::One).is_some()
            && (start + 1 >= end || self.buffer[start + 1] == LENGTH_BYTE)
    }

    fn skip_to_next_start(&mut self) {
        let next = (1..self.length).find(|start| self.starts_like_a_packet(*start));
        self.skip(next.unwrap_or(self.length));
    }

    /// Original: returns the packet at the front once it is confirmed, else moves on.
    ///
    /// At most one packet leaves per byte, so a packet behind a rejected window may wait for the
    /// next bytes. The buffer cannot overflow: unless a packet leaves, it keeps fewer bytes than
    /// the longest packet and a header need.
    fn examine_original(&mut self) -> Option<Packet> {
        loop {
            let bytes = &self.buffer[..usize::from(self.length)];
            let first = *bytes.first()?;
            if kind_of(first, Version::Original).is_none() {
                self.skip_one_and_hunt();
                continue;
            }
            let second = *bytes.get(1)?;
            let Some(header) = Header::read(first, second) else {
                self.skip_one_and_hunt();
                continue;
            };
            let length = usize::from(second);
            let packet = match Packet::decode(bytes.get(..length)?, Version::Original) {
                Ok(packet) => packet,
                Err(error) => {
                    self.count(error);
                    self.skip_one_and_hunt();
                    continue;
                }
            };
            let trusted = self.locked.is_some_and(|last| last.is_followed_by(header));
            if !trusted {
                let (next, after) = (*bytes.get(length)?, *bytes.get(length + 1)?);
                if !Header::read(next, after).is_some_and(|next| header.is_followed_by(next)) {
                    self.skip_one_and_hunt();
                    continue;
                }
            }
            return Some(self.release_original(packet, header, second));
        }
    }

    fn release_original(&mut self, packet: Packet, header: Header, length: u8) -> Packet {
        if header.kind == Kind::Handshake {
            self.handshake = [0; PACKET_LENGTH];
            let bytes = &self.buffer[..usize::from(length)];
            self.handshake[..bytes.len()].copy_from_slice(bytes);
        }
        self.locked = Some(header);
        self.drop_front(length);
        self.counters.packets = self.counters.packets.wrapping_add(1);
        packet
    }

    fn skip_one_and_hunt(&mut self) {
        self.skip(1);
        self.locked = None;
    }

    fn skip(&mut self, count: u8) {
        self.drop_front(count);
        self.counters.skipped_bytes = self.counters.skipped_bytes.wrapping_add(u32::from(count));
    }

    fn drop_front(&mut self, count: u8) {
        self.buffer
            .copy_within(usize::from(count)..usize::from(self.length), 0);
        self.length -= count;
    }

    fn count(&mut self, error: DecodeError) {
        let counter = match error {
            DecodeError::Crc { .. } => &mut self.counters.bad_crc,
            _ => &mut self.counters.bad_content,
        };
        *counter = counter.wrapping_add(1);
    }
}
