//! A UART and the Pi at its other end.

use std::collections::VecDeque;

use lager_wire::link::HostTransmitter;
use lager_wire::{Decoder, Packet, Payload, SynAck, Version};

/// One byte at 500 000 Bd, in microseconds.
const BYTE_US: u32 = 20;

/// A UART with a queue of 64 bytes towards the Pi.
pub struct Uart {
    pub received: VecDeque<u8>,
    pub sent: Vec<u8>,
    busy_until_us: u32,
    pub byte_us: u32,
    /// For each queued packet: when, and how long the line was still busy with earlier ones.
    pub backlog: Vec<(u32, u32)>,
}

impl Uart {
    pub fn new(now_us: u32) -> Self {
        Self {
            received: VecDeque::new(),
            sent: Vec::new(),
            busy_until_us: now_us,
            byte_us: BYTE_US,
            backlog: Vec::new(),
        }
    }

    pub fn left_us(&self, now_us: u32) -> u32 {
        let left = self.busy_until_us.wrapping_sub(now_us);
        if left > 1 << 31 { 0 } else { left }
    }

    pub fn write(&mut self, bytes: &[u8], now_us: u32) -> bool {
        let queued = self.left_us(now_us).div_ceil(self.byte_us);
        if queued + bytes.len() as u32 > 64 {
            return false;
        }
        self.backlog.push((now_us, self.left_us(now_us)));
        let from = now_us.wrapping_add(self.left_us(now_us));
        self.busy_until_us = from.wrapping_add(bytes.len() as u32 * self.byte_us);
        self.sent.extend_from_slice(bytes);
        true
    }
}

/// The Pi's end: answers SYN and keeps every packet.
pub struct Pi {
    decoder: Decoder,
    transmitter: HostTransmitter,
    pub packets: Vec<(u32, Packet)>,
    pub syns: Vec<(u32, Packet)>,
    pub answers: bool,
}

impl Pi {
    pub fn new() -> Self {
        Self {
            decoder: Decoder::new(Version::One),
            transmitter: HostTransmitter::new(),
            packets: Vec::new(),
            syns: Vec::new(),
            answers: true,
        }
    }

    pub fn hear(&mut self, uart: &mut Uart, now_us: u32) {
        for byte in core::mem::take(&mut uart.sent) {
            let Some(packet) = self.decoder.push(byte) else {
                continue;
            };
            match packet.payload {
                Payload::Handshake(handshake) => {
                    assert_eq!(handshake.kind, SynAck::Syn);
                    self.syns.push((now_us, packet));
                    if self.answers {
                        uart.received.extend(self.transmitter.ack(Version::One));
                    }
                }
                _ => self.packets.push((now_us, packet)),
            }
        }
        assert_eq!(
            self.decoder.counters().skipped_bytes,
            0,
            "a board sends whole packets only"
        );
    }

    pub fn send(&mut self, payload: Payload, uart: &mut Uart) {
        uart.received
            .extend(self.transmitter.encode(payload).expect("the link is up"));
    }

    /// Every packet of one kind, with its time.
    pub fn all<T>(&self, pick: impl Fn(Payload) -> Option<T>) -> Vec<(u32, T)> {
        self.packets
            .iter()
            .filter_map(|(at, packet)| pick(packet.payload).map(|payload| (*at, payload)))
            .collect()
    }
}
