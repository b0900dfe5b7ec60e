//! A board for tests and measurements: the board's end of a cable and its end of a link.
//!
//! It answers handshakes, takes every setting that it is told, and knows when its next report is due.
//! The test does everything else.

use lager_home::Clock;
use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    Callsign, Payload, ResetCause, Setting, SettingReply, SettingStatus, SteerData, SteerFlags,
};

use crate::{Cable, Refused};

/// The longest wait for the next byte of a packet, in us. The bridge writes whole packets, but the
/// kernel may stop a process in the middle of a write.
pub const GAP_US: u32 = 50_000;

/// The longest time between two reports, in ns. A link that is silent for 1 s is down, and the
/// robot does not drive with a board that has not reported for 200 ms.
pub const SPEAK_EVERY_NS: u64 = 100_000_000;

/// One board.
#[derive(Debug)]
pub struct Board {
    /// The board's end of the wire.
    pub cable: Cable,
    /// The board's end of the link.
    pub link: BoardLink,
    /// When [`Board::speak`] last sent something, in ns of `CLOCK_MONOTONIC`; 0 = never, so the
    /// next call sends at once.
    pub spoke_ns: u64,
}

impl Board {
    /// A board that has just been switched on.
    ///
    /// # Errors
    /// The kernel gives no pseudo terminal.
    pub fn new(sign: Callsign) -> Result<Self, Refused> {
        Ok(Self {
            cable: Cable::new()?,
            link: BoardLink::new(sign, ResetCause::PowerOn, GAP_US),
            spoke_ns: 0,
        })
    }

    /// [`Board::take`], and sends a handshake if one is due.
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

    /// Sends data if the link is up and the last report is [`SPEAK_EVERY_NS`] old. Returns whether
    /// it did.
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

    /// Reads the received bytes, and hears them.
    ///
    /// # Errors
    /// As [`Cable::read`] and [`Cable::write`].
    pub fn take(&mut self, mut packet: impl FnMut(Payload)) -> Result<(), Refused> {
        let mut buffer = [0; 256];
        loop {
            let count = self.cable.read(&mut buffer)?;
            if count == 0 {
                return Ok(());
            }
            self.hear(&buffer[..count], &mut packet)?;
        }
    }

    /// Decodes bytes that were read from the cable, hands over each packet's data, and accepts each
    /// setting: a bridge that gets no answer lets nothing move.
    ///
    /// # Errors
    /// As [`Cable::write`].
    pub fn hear(&mut self, bytes: &[u8], mut packet: impl FnMut(Payload)) -> Result<(), Refused> {
        for byte in bytes {
            if let Some(BoardEvent::Packet(heard)) = self.link.push(*byte, board_us()) {
                if let Payload::Setting(setting) = heard.payload {
                    self.send(answer_to(&setting, SettingStatus::Accepted))?;
                }
                packet(heard.payload);
            }
        }
        Ok(())
    }
}

/// The report of a steering board that carries out its command with the wheels in the air. It
/// reports duty 0 while a command to drive is in force, so a flag says that this duty is meant.
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

/// A board's answer to a setting.
#[must_use]
pub(crate) fn answer_to(setting: &Setting, status: SettingStatus) -> Payload {
    Payload::SettingReply(SettingReply {
        key: setting.key,
        seq: setting.seq,
        value: setting.value,
        status,
    })
}

/// A board's clock: microseconds, which wrap around.
fn board_us() -> u32 {
    (Clock::monotonic_ns() / 1_000) as u32
}
