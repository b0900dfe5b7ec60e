//! A board as tests and measurements play it: one end of a cable and one end of a link.
//!
//! It answers handshakes, and knows when it is time to report. All else is the player's.

use lager_ports::Clock;
use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    Callsign, Payload, ResetCause, Setting, SettingReply, SettingStatus, SteerData, SteerFlags,
};

use crate::{Cable, Refused};

/// How long a board waits for the next byte of a packet, in us. The bridge writes packets whole,
/// but a process that is put to sleep may be cut off in one.
pub const GAP_US: u32 = 50_000;

/// Boards speak at least this often, in ns: a link that is silent for a second is down, and nobody
/// drives a board that has not reported for 200 ms.
pub const SPEAK_EVERY_NS: u64 = 100_000_000;

/// One board: its end of the wire and its end of the link.
#[derive(Debug)]
pub struct Board {
    /// Its end of the wire.
    pub cable: Cable,
    /// Its end of the link.
    pub link: BoardLink,
    /// When it last spoke for [`Board::speak`], in ns of `CLOCK_MONOTONIC`; 0 = never, so
    /// it speaks next time.
    pub spoke_ns: u64,
}

impl Board {
    /// A board that has just been switched on.
    ///
    /// # Errors
    /// There is no pseudo terminal to be had.
    pub fn new(sign: Callsign) -> Result<Self, Refused> {
        Ok(Self {
            cable: Cable::new()?,
            link: BoardLink::new(sign, ResetCause::PowerOn, GAP_US),
            spoke_ns: 0,
        })
    }

    /// Takes what has come, hands over each packet's data, and sends a handshake if one is due.
    ///
    /// # Errors
    /// As [`Cable::read`] and [`Cable::write`].
    pub fn answer(&mut self, packet: impl FnMut(Payload)) -> Result<(), Refused> {
        self.take(packet)?;
        match self.link.poll(board_us()) {
            Some(syn) => self.cable.write(&syn),
            None => Ok(()),
        }
    }

    /// Sends data if the link is up and it has not spoken for [`SPEAK_EVERY_NS`]; whether it was.
    ///
    /// # Errors
    /// As [`Cable::write`].
    pub fn speak(&mut self, payload: Payload) -> Result<bool, Refused> {
        let now = Clock::monotonic_ns();
        if now.saturating_sub(self.spoke_ns) < SPEAK_EVERY_NS || !self.link.is_up() {
            return Ok(false);
        }
        self.spoke_ns = now;
        self.send(payload)?;
        Ok(true)
    }

    /// Sends data, if the link is up.
    ///
    /// # Errors
    /// As [`Cable::write`].
    pub fn send(&mut self, payload: Payload) -> Result<(), Refused> {
        match self.link.encode(payload) {
            Some(packet) => self.cable.write(&packet),
            None => Ok(()),
        }
    }

    /// Takes what has come, and hands over each packet's data.
    ///
    /// # Errors
    /// As [`Cable::read`].
    pub fn take(&mut self, mut packet: impl FnMut(Payload)) -> Result<(), Refused> {
        let mut buffer = [0; 256];
        loop {
            let count = self.cable.read(&mut buffer)?;
            if count == 0 {
                return Ok(());
            }
            self.hear(&buffer[..count], &mut packet);
        }
    }

    /// Hears bytes that were read from the cable, and hands over each packet's data.
    pub fn hear(&mut self, bytes: &[u8], mut packet: impl FnMut(Payload)) {
        for byte in bytes {
            if let Some(BoardEvent::Packet(heard)) = self.link.push(*byte, board_us()) {
                packet(heard.payload);
            }
        }
    }
}

/// What a steering board reports that does what it is told, but whose wheels are in the air: a flag
/// besides the duties of 0 says that they are meant.
#[must_use]
pub fn wheels_in_the_air(code: u8) -> Payload {
    Payload::SteerData(SteerData {
        code,
        left_duty: 0,
        right_duty: 0,
        flags: SteerFlags::ARM_LOCKED,
        line_error: 0,
        finished_seq: 0,
        servo_errors: 0,
        battery_decivolts: 111,
    })
}

/// What a board answers to a setting.
#[must_use]
pub fn answer_to(setting: &Setting, status: SettingStatus) -> Payload {
    Payload::SettingReply(SettingReply {
        key: setting.key,
        seq: setting.seq,
        value: setting.value,
        status,
    })
}

/// A board's clock: microseconds that wrap.
fn board_us() -> u32 {
    (Clock::monotonic_ns() / 1_000) as u32
}
