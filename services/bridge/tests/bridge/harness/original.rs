//! Original boards, written from the packet layout alone (U2-U14) and not with this project's
//! encoder: 11 bytes, end 0xFF, no version, a payload whose unused bytes are whatever lay in
//! memory, and ids that run on across handshakes.

use super::board::Peer;

const SYN_PERIOD_US: u32 = 100_000;
const DATA_PERIOD_US: u32 = 20_000;

/// What both original boards have in common.
pub(crate) struct Original {
    callsign: u8,
    next_id: u8,
    pub(crate) up: bool,
    due_us: u32,
    /// The packet being received.
    packet: [u8; 11],
    received: usize,
    /// ACK packets as they came.
    pub(crate) acks: Vec<[u8; 11]>,
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

    /// The next whole packet. An original board frames by length alone.
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

    /// SYN until the ACK; afterwards, whether data is due.
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
pub(crate) struct OriginalSteering {
    pub(crate) board: Original,
    /// The codes of all commands, in order.
    pub(crate) commands: Vec<u8>,
}

impl OriginalSteering {
    pub(crate) fn new() -> Self {
        Self {
            board: Original::new(3, false),
            commands: Vec::new(),
        }
    }

    /// One that had its handshake before the bridge was there.
    pub(crate) fn running() -> Self {
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
pub(crate) struct OriginalSensor {
    pub(crate) board: Original,
    pub(crate) state: u8,
    pub(crate) distance: u8,
    flip_flop: bool,
}

impl OriginalSensor {
    pub(crate) fn new() -> Self {
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
