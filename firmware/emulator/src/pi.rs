//! A scripted Pi: the host's end of the line to one board, in chip time.
//!
//! It uses the bridge's link machines (`lager_wire::link`) without the bridge, for tests and
//! measurements.

use core::time::Duration;
use std::collections::VecDeque;

use lager_wire::link::{HostEvent, HostLink, HostTransmitter, LinkCounters, Up};
use lager_wire::{Command, PACKET_LENGTH, Packet, Payload, SteerCommand, SteerData};

use crate::rig::{Board, Rig, nanoseconds};

/// How often the Pi reads its line, in cycles: 100 microseconds.
const LOOK: u64 = 1_600;
/// How often a setpoint is renewed, the same as in the bridge.
const RENEWAL: Duration = Duration::from_millis(40);

/// The Pi's end of the line to one board.
#[derive(Debug)]
pub struct Pi {
    board: Board,
    link: HostLink,
    transmitter: HostTransmitter,
    /// Packets, oldest first.
    pub packets: Vec<Arrived>,
    /// When the board connected, and how.
    pub ups: Vec<(u64, Up)>,
    /// Arrival times of the latest bytes, as many as a packet has.
    bytes: VecDeque<u64>,
    seq: u8,
    standing: Option<(SteerCommand, Duration)>,
}

/// A packet from a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// The cycle in which the first byte's start bit began.
    pub from: u64,
    /// The cycle in which the last byte's stop bit ended.
    pub to: u64,
    /// The packet.
    pub packet: Packet,
}

impl Pi {
    /// A Pi that has just started.
    pub fn new(board: Board) -> Self {
        Self {
            board,
            link: HostLink::new(),
            transmitter: HostTransmitter::new(),
            packets: Vec::new(),
            ups: Vec::new(),
            bytes: VecDeque::new(),
            seq: 0,
            standing: None,
        }
    }

    /// Whether the board is connected.
    pub fn is_up(&self) -> bool {
        self.link.is_up()
    }

    /// The counters of the link.
    pub fn health(&self) -> LinkCounters {
        self.link.health()
    }

    /// Sends a packet now, if the board is connected.
    pub fn send(&mut self, rig: &mut Rig, payload: Payload) {
        if let Some(bytes) = self.transmitter.encode(payload) {
            rig.write(self.board, &bytes);
        }
    }

    /// Gives an order under a new number and renews it until the next order. Returns the number.
    pub fn order(&mut self, rig: &mut Rig, command: Command) -> u8 {
        self.order_code(rig, command.code())
    }

    /// As `order`, with any code.
    pub fn order_code(&mut self, rig: &mut Rig, code: u8) -> u8 {
        self.seq = self.seq.wrapping_add(1);
        let seq = self.seq;
        let command = SteerCommand { code, seq };
        self.standing = Some((command, rig.now() + RENEWAL));
        self.send(rig, Payload::SteerCommand(command));
        seq
    }

    /// Sends nothing more until the next order.
    pub fn fall_silent(&mut self) {
        self.standing = None;
    }

    /// The latest report of the steering board.
    pub fn steer_data(&self) -> Option<SteerData> {
        self.packets
            .iter()
            .rev()
            .find_map(|arrived| match arrived.packet.payload {
                Payload::SteerData(data) => Some(data),
                _ => None,
            })
    }

    /// Reads the bytes that have arrived and sends the packets that are due.
    fn look(&mut self, rig: &mut Rig) {
        for (cycle, byte) in rig.read(self.board) {
            if self.bytes.len() == PACKET_LENGTH {
                self.bytes.pop_front();
            }
            self.bytes.push_back(cycle);
            let now = Duration::from_nanos(nanoseconds(cycle));
            let event = self.link.push(byte, now);
            self.handle(rig, event, cycle);
        }
        let now = rig.now();
        while let Some(event) = self.link.poll(now) {
            self.handle(rig, Some(event), rig.cycle());
        }
        if let Some((command, due)) = self.standing
            && now >= due
        {
            self.standing = Some((command, now + RENEWAL));
            self.send(rig, Payload::SteerCommand(command));
        }
    }

    fn handle(&mut self, rig: &mut Rig, event: Option<HostEvent>, cycle: u64) {
        match event {
            Some(HostEvent::SendSyn) => rig.write(self.board, &self.transmitter.syn()),
            Some(HostEvent::SendAck { up }) => {
                let version = up.map_or_else(|| self.link.version(), |up| Some(up.version));
                if let Some(version) = version {
                    let bytes = self.transmitter.ack(version);
                    rig.write(self.board, &bytes);
                }
                self.ups.extend(up.map(|up| (cycle, up)));
            }
            Some(HostEvent::Up(up)) => {
                self.transmitter.adopt(up.version);
                self.ups.push((cycle, up));
            }
            Some(HostEvent::Packet(packet)) => {
                let first = self.bytes.front().copied().unwrap_or(cycle);
                let from = first - rig.byte_cycles();
                self.packets.push(Arrived {
                    from,
                    to: cycle,
                    packet,
                });
            }
            Some(HostEvent::Silent) | None => {}
        }
    }
}

/// Runs a rig and its Pis to a cycle.
pub fn run_until(rig: &mut Rig, pis: &mut [&mut Pi], target: u64) {
    while rig.cycle() < target {
        let next = (rig.cycle() + LOOK).min(target);
        rig.run_until(next);
        for pi in pis.iter_mut() {
            pi.look(rig);
        }
    }
}

/// Runs a rig and its Pis for a time.
pub fn run_for(rig: &mut Rig, pis: &mut [&mut Pi], time: Duration) {
    let target = rig.cycle() + crate::rig::cycles(time);
    run_until(rig, pis, target);
}
