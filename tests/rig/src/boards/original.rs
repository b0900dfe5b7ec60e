//! The original boards, for tests of the bridge with old firmware. They are written from the packet
//! layout alone (U2-U14), without this project's encoder: 11 bytes, end 0xFF, no version, unused
//! payload bytes with random memory content, and ids that run on across handshakes.

use super::Peer;

const SYN_PERIOD_US: u32 = 100_000;
const DATA_PERIOD_US: u32 = 20_000;

/// The common part of both original boards.
pub struct Original {
    callsign: u8,
    next_id: u8,
    /// The bridge has acknowledged its SYN.
    pub up: bool,
    due_us: u32,
    /// The packet being received.
    packet: [u8; 11],
    received: usize,
    /// The ACK packets in the order in which they came.
    pub acks: Vec<[u8; 11]>,
}

impl Original {
    fn new(callsign: u8, up: bool) -> Self {
        Self {
            callsign,
            next_id: 9,
            up,
            due_us: 0,
            packet: [0; 11],
            received: 0,
            acks: Vec::new(),
        }
    }

    /// Returns a packet when `byte` completes it. An original board frames by length alone.
    fn take(&mut self, byte: u8) -> Option<[u8; 11]> {
        self.packet[self.received] = byte;
        self.received += 1;
        if self.received < 11 {
            return None;
        }
        self.received = 0;
        let packet = self.packet;
        assert_eq!(packet[1], 11, "the Pi sends full packets: {packet:02x?}");
        if packet[0] >> 4 == 0 && packet[2] == 0x05 {
            self.acks.push(packet);
            self.up = true;
        }
        Some(packet)
    }

    fn send(&mut self, kind: u8, payload: [u8; 8], out: &mut Vec<u8>) {
        out.extend([self.next_id | kind << 4, 11]);
        out.extend(payload);
        out.push(0xFF);
        self.next_id = (self.next_id + 1) & 0x0F;
    }

    /// Sends SYN until the ACK comes; afterwards returns whether data is due.
    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) -> bool {
        if now_us.wrapping_sub(self.due_us) > i32::MAX as u32 {
            return false;
        }
        if self.up {
            self.due_us = now_us.wrapping_add(DATA_PERIOD_US);
            return true;
        }
        self.due_us = now_us.wrapping_add(SYN_PERIOD_US);
        let garbage = [0xDE, 0xAD, 0xBE, 0xEF, 0x12, 0x34, 0x56];
        let mut payload = [self.callsign << 2, 0, 0, 0, 0, 0, 0, 0];
        payload[1..].copy_from_slice(&garbage);
        self.send(0, payload, out);
        false
    }
}

/// An original steering board.
pub struct OriginalSteering {
    /// The common part of both boards.
    pub board: Original,
    /// The codes of all received commands, in order.
    pub commands: Vec<u8>,
}

impl OriginalSteering {
    /// A board that has just been switched on.
    #[must_use]
    pub fn new() -> Self {
        Self {
            board: Original::new(3, false),
            commands: Vec::new(),
        }
    }

    /// A board that had its handshake before the bridge started.
    #[must_use]
    pub fn running() -> Self {
        Self {
            board: Original::new(3, true),
            commands: Vec::new(),
        }
    }
}

impl Peer for OriginalSteering {
    fn take(&mut self, byte: u8, _now_us: u32) {
        if let Some(packet) = self.board.take(byte)
            && packet[0] >> 4 == 4
        {
            self.commands.push(packet[2]);
        }
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        if self.board.step(now_us, out) {
            self.board.send(5, *b"whatever", out);
        }
    }
}

/// An original sensor board.
pub struct OriginalSensor {
    /// The common part of both boards.
    pub board: Original,
    /// The line state that it reports.
    pub state: u8,
    /// The distance that it reports, in cm.
    pub distance: u8,
    flip_flop: bool,
}

impl OriginalSensor {
    /// A board that has just been switched on.
    #[must_use]
    pub fn new() -> Self {
        Self {
            board: Original::new(2, false),
            state: 0,
            distance: 40,
            flip_flop: false,
        }
    }
}

impl Peer for OriginalSensor {
    fn take(&mut self, byte: u8, _now_us: u32) {
        self.board.take(byte);
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        if !self.board.step(now_us, out) {
            return;
        }
        self.flip_flop = !self.flip_flop;
        if self.flip_flop {
            self.board.send(1, [self.state, 7, 7, 7, 7, 7, 7, 7], out);
        } else {
            self.board
                .send(2, [self.distance, 9, 9, 9, 9, 9, 9, 9], out);
        }
    }
}

impl Default for OriginalSteering {
    fn default() -> Self {
        Self::new()
    }
}

impl Default for OriginalSensor {
    fn default() -> Self {
        Self::new()
    }
}
