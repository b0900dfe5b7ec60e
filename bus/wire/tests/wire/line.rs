//! A board's end and the Pi's end on one faulty line, in virtual time.

use std::time::Duration;

use lager_wire::link::{BoardEvent, BoardLink, HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{Callsign, Packet, Payload, ResetCause, SteerCommand, SteerData, SteerFlags};

use crate::sample::Noise;

/// The time a byte takes at 500 000 Bd.
const BYTE_US: u64 = 20;
pub(crate) const GAP_US: u32 = 200;

/// What a line does to its bytes: each fault once in so many bytes, `None` = never.
#[derive(Clone, Copy, Default)]
pub(crate) struct Harm {
    pub(crate) loses: Option<u64>,
    pub(crate) flips: Option<u64>,
    pub(crate) adds: Option<u64>,
}

/// A board and the Pi on one line, in steps of 1 ms. The board sends data every 5 ms, the Pi a
/// command every 40 ms, both as soon as they may.
pub(crate) struct Line {
    pub(crate) board: BoardLink,
    pub(crate) host: HostLink,
    pub(crate) transmitter: HostTransmitter,
    pub(crate) now_us: u64,
    pub(crate) harm: Harm,
    /// The packet that the board sends.
    pub(crate) data: Payload,
    pub(crate) noise: Noise,
    pub(crate) host_events: Vec<HostEvent>,
    pub(crate) board_events: Vec<BoardEvent>,
    pub(crate) cut_to_board: bool,
    pub(crate) cut_to_host: bool,
    to_board: Vec<u8>,
    to_host: Vec<u8>,
}

pub(crate) fn board(sign: Callsign, reset: ResetCause) -> BoardLink {
    BoardLink::new(sign, reset, GAP_US)
}

impl Line {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            board: board(Callsign::Steering, ResetCause::PowerOn),
            host: HostLink::new(),
            transmitter: HostTransmitter::new(),
            // With this start the board's clock wraps during the first seconds of every test.
            now_us: u64::from(u32::MAX) - 700_000,
            harm: Harm::default(),
            data: Payload::SteerData(SteerData {
                code: 3,
                left_duty: 104,
                right_duty: 96,
                flags: SteerFlags::EXDE_OK,
                line_error: -2,
                finished_seq: 6,
                servo_errors: 0,
                battery_decivolts: 118,
            }),
            noise: Noise::new(seed),
            host_events: Vec::new(),
            board_events: Vec::new(),
            cut_to_board: false,
            cut_to_host: false,
            to_board: Vec::new(),
            to_host: Vec::new(),
        }
    }

    pub(crate) fn board_now(&self) -> u32 {
        (self.now_us & u64::from(u32::MAX)) as u32
    }

    pub(crate) fn now(&self) -> Duration {
        Duration::from_micros(self.now_us)
    }

    pub(crate) fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.step();
        }
    }

    /// Runs until both ends are up, at most `seconds`.
    pub(crate) fn run_up(&mut self, seconds: u32) -> bool {
        for _ in 0..seconds * 1000 {
            self.step();
            if self.board.is_up() && self.host.is_up() {
                return true;
            }
        }
        false
    }

    fn step(&mut self) {
        self.now_us += 1_000;
        let millisecond = self.now_us / 1_000;
        let syn = self.board.poll(self.board_now());
        self.to_host.extend(syn.into_iter().flatten());
        if millisecond.is_multiple_of(5) {
            let data = self.board.encode(self.data);
            self.to_host.extend(data.into_iter().flatten());
        }
        while let Some(event) = self.host.poll(self.now()) {
            self.react(event);
        }
        if millisecond.is_multiple_of(40) && self.host.is_up() {
            let command = Payload::SteerCommand(SteerCommand { code: 3, seq: 1 });
            let bytes = self.transmitter.encode(command);
            self.to_board.extend(bytes.into_iter().flatten());
        }
        for byte in self.pass(true) {
            if let Some(event) = self.host.push(byte, self.now()) {
                self.react(event);
            }
        }
        for (index, byte) in (0..).zip(self.pass(false)) {
            let at = self.board_now().wrapping_add((index * BYTE_US) as u32);
            self.board_events.extend(self.board.push(byte, at));
        }
    }

    fn react(&mut self, event: HostEvent) {
        self.host_events.push(event);
        match event {
            HostEvent::SendSyn => self.to_board.extend(self.transmitter.syn()),
            HostEvent::SendAck { .. } => {
                let version = self.host.version().unwrap();
                self.to_board.extend(self.transmitter.ack(version));
            }
            HostEvent::Up(up) => self.transmitter.adopt(up.version),
            HostEvent::Packet(_) | HostEvent::Silent => {}
        }
    }

    /// The bytes that arrive, of those that wait in one direction.
    fn pass(&mut self, to_host: bool) -> Vec<u8> {
        let (queue, cut) = if to_host {
            (&mut self.to_host, self.cut_to_host)
        } else {
            (&mut self.to_board, self.cut_to_board)
        };
        let mut arrived = Vec::new();
        for (index, byte) in std::mem::take(queue).into_iter().enumerate() {
            if cut || self.strikes(self.harm.loses) {
                continue;
            }
            let flipped = self.strikes(self.harm.flips);
            arrived.push(byte ^ (u8::from(flipped) << (index % 8)));
            if self.strikes(self.harm.adds) {
                arrived.push(self.noise.byte());
            }
        }
        arrived
    }

    fn strikes(&mut self, odds: Option<u64>) -> bool {
        odds.is_some_and(|odds| self.noise.once_in(odds))
    }

    pub(crate) fn ups(&self) -> Vec<Up> {
        self.host_events
            .iter()
            .filter_map(|event| match event {
                HostEvent::SendAck { up } => *up,
                HostEvent::Up(up) => Some(*up),
                _ => None,
            })
            .collect()
    }

    pub(crate) fn received(&self) -> Vec<Packet> {
        self.host_events
            .iter()
            .filter_map(|event| match event {
                HostEvent::Packet(packet) => Some(*packet),
                _ => None,
            })
            .collect()
    }
}
