//! Reads packets from a stream of bytes, one byte at a time.
//!
//! ```text
//!            byte fits the shape        length reached, checksum right
//!   hunting ------------------> collecting ------------------------> packet
//!      ^                           |
//!      |  shape or checksum wrong  |
//!      +---- drop ONE byte, look --+
//!            at the rest again
//! ```
//!
//! A rejected packet loses only one byte at a time, so the decoder finds every complete good
//! packet, also behind noise or inside a rejected packet.

use crate::{BROADCAST_ID, ErrorBits, HEADER, Instruction, MAX_FRAME, OVERHEAD, checksum};

/// Decoder for a servo's answers of up to 18 registers.
pub type StatusDecoder = Decoder<24>;

/// Decoder for every packet that this crate can write; servo models use it.
pub type InstructionDecoder = Decoder<MAX_FRAME>;

/// A packet with a correct checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Id of the servo that is asked, or that answers.
    pub id: u8,
    /// The instruction's code, or the error bits of an answer.
    pub code: u8,
    /// The bytes between code and checksum.
    pub parameters: &'a [u8],
}

impl Packet<'_> {
    /// The instruction, if the code is known. Only for a packet to servos.
    #[must_use]
    pub fn instruction(&self) -> Option<Instruction> {
        Instruction::from_code(self.code)
    }

    /// The error bits. Only for a packet from a servo.
    #[must_use]
    pub fn errors(&self) -> ErrorBits {
        ErrorBits(self.code)
    }
}

/// Counts of the decoder; all wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Packets returned.
    pub packets: u16,
    /// Packets of the right shape with a wrong checksum.
    pub bad_checksums: u16,
    /// Bytes dropped in the search for a packet.
    pub skipped_bytes: u16,
}

/// Finds packets of at most `N` bytes in a stream of bytes.
#[derive(Debug, Clone)]
pub struct Decoder<const N: usize> {
    bytes: [u8; N],
    used: u8,
    /// Bytes at the front that belong to the packet returned last.
    released: u8,
    counters: Counters,
}

/// The kind of bytes at the front of the buffer.
enum Front {
    /// Too few bytes to decide.
    Open,
    /// A complete good packet of this length.
    Whole(u8),
    /// Not the beginning of a packet.
    Nothing,
    /// A packet with a wrong checksum.
    BadChecksum,
}

impl<const N: usize> Decoder<N> {
    const FITS: () = assert!(N >= OVERHEAD && N <= 255);

    /// An empty decoder.
    #[must_use]
    pub const fn new() -> Self {
        let () = Self::FITS;
        Self {
            bytes: [0; N],
            used: 0,
            released: 0,
            counters: Counters {
                packets: 0,
                bad_checksums: 0,
                skipped_bytes: 0,
            },
        }
    }

    /// Takes the next byte from the wire. Returns a packet with its last byte.
    ///
    /// If a rejected packet had swallowed several good ones, this returns the first of them and
    /// [`Decoder::pending`] the others.
    pub fn push(&mut self, byte: u8) -> Option<Packet<'_>> {
        self.forget_released();
        if usize::from(self.used) == N {
            // Only if the caller left packets pending: drops the oldest byte.
            self.drop_front(1);
            self.counters.skipped_bytes = self.counters.skipped_bytes.wrapping_add(1);
        }
        self.bytes[usize::from(self.used)] = byte;
        self.used += 1;
        self.examine()
    }

    /// The next packet among the bytes that were already pushed.
    pub fn pending(&mut self) -> Option<Packet<'_>> {
        self.forget_released();
        self.examine()
    }

    /// Forgets everything but the counters, for example before a new question or after a silence.
    pub fn reset(&mut self) {
        self.used = 0;
        self.released = 0;
    }

    /// The counts so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    fn forget_released(&mut self) {
        self.drop_front(self.released);
        self.released = 0;
    }

    fn examine(&mut self) -> Option<Packet<'_>> {
        loop {
            match self.front() {
                Front::Open => return None,
                Front::Whole(length) => {
                    self.released = length;
                    self.counters.packets = self.counters.packets.wrapping_add(1);
                    return Some(Packet {
                        id: self.bytes[2],
                        code: self.bytes[4],
                        parameters: &self.bytes[5..usize::from(length) - 1],
                    });
                }
                Front::BadChecksum => {
                    self.counters.bad_checksums = self.counters.bad_checksums.wrapping_add(1);
                    self.skip_one();
                }
                Front::Nothing => self.skip_one(),
            }
        }
    }

    fn front(&self) -> Front {
        let bytes = &self.bytes[..usize::from(self.used)];
        if !bytes
            .iter()
            .zip(HEADER)
            .all(|(byte, header)| *byte == header)
        {
            return Front::Nothing;
        }
        if bytes.get(2).is_some_and(|id| *id > BROADCAST_ID) {
            return Front::Nothing;
        }
        let Some(length) = bytes.get(3).map(|length| usize::from(*length) + 4) else {
            return Front::Open;
        };
        if !(OVERHEAD..=N).contains(&length) {
            return Front::Nothing;
        }
        if bytes.len() < length {
            return Front::Open;
        }
        if checksum(&bytes[2..length - 1]) == bytes[length - 1] {
            Front::Whole(length as u8)
        } else {
            Front::BadChecksum
        }
    }

    fn skip_one(&mut self) {
        self.counters.skipped_bytes = self.counters.skipped_bytes.wrapping_add(1);
        self.drop_front(1);
    }

    fn drop_front(&mut self, count: u8) {
        if count > 0 {
            self.bytes
                .copy_within(usize::from(count)..usize::from(self.used), 0);
            self.used -= count;
        }
    }
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}
