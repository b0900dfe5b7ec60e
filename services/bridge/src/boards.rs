//! What the bridge knows of the two boards, in the form of `link/health`.
//!
//! It stands apart from the main loop because it outlives links and ports: a board keeps its counts
//! of restarts, epochs and losses when it changes its port or the bridge is restarted.

use std::sync::atomic::Ordering;

use lager_topics::{BoardHealth, Health};
use lager_wire::{BoardStatus, Callsign, Version};

use crate::counts::{Counts, index};
use crate::events::BoardUp;

/// One board.
#[derive(Clone, Copy, Debug)]
struct Board {
    health: BoardHealth,
    /// The port where it was found last, 0 or 1.
    place: Option<usize>,
}

/// Both boards.
#[derive(Clone, Debug)]
pub(crate) struct Boards {
    boards: [Board; 2],
}

impl Boards {
    /// No board found yet, with the counts of an earlier bridge.
    pub(crate) fn new(kept: Option<&Health>) -> Self {
        let board = |earlier: Option<&BoardHealth>| {
            let earlier = earlier.copied().unwrap_or_default();
            Board {
                health: BoardHealth {
                    epoch: earlier.epoch,
                    reboots: earlier.reboots,
                    reset_cause: earlier.reset_cause,
                    ..BoardHealth::default()
                },
                place: None,
            }
        };
        Self {
            boards: [
                board(kept.map(|kept| &kept.sensor)),
                board(kept.map(|kept| &kept.steering)),
            ],
        }
    }

    /// A board has come up on the port at `place`. If it was on another port before, it has moved:
    /// the newest handshake counts.
    pub(crate) fn up(&mut self, place: usize, baud: u32, board: &BoardUp) {
        let Some(index) = index(board.up.callsign) else {
            return;
        };
        // So the other board cannot be on this port any more.
        self.down(place);
        let Board { health, place: at } = &mut self.boards[index];
        *at = Some(place);
        *health = BoardHealth {
            epoch: board.link_epoch,
            reboots: health.reboots.wrapping_add(u32::from(board.up.rebooted)),
            baud,
            up: 1,
            version: match board.up.version {
                Version::Original => 0,
                Version::One => 1,
            },
            reset_cause: board.up.reset.into(),
            build: board.up.build,
            port: u8::try_from(place).unwrap_or(BoardHealth::UNKNOWN),
            ..BoardHealth::default()
        };
    }

    /// The board on the port at `place` is not up any more. Returns which board that was.
    pub(crate) fn down(&mut self, place: usize) -> Option<Callsign> {
        let index = self
            .boards
            .iter()
            .position(|board| board.place == Some(place) && board.health.up != 0)?;
        self.boards[index].health.up = 0;
        Some([Callsign::Sensor, Callsign::Steering][index])
    }

    /// The port at `place` has gone, and its board with it.
    pub(crate) fn gone(&mut self, place: usize) {
        for board in &mut self.boards {
            if board.place == Some(place) {
                board.place = None;
                board.health.port = BoardHealth::UNKNOWN;
            }
        }
    }

    /// The port on which a board is up.
    pub(crate) fn place(&self, callsign: Callsign) -> Option<usize> {
        let board = &self.boards[index(callsign)?];
        board.place.filter(|_| board.health.up != 0)
    }

    /// The board that is up on the port at `place`.
    pub(crate) fn callsign(&self, place: usize) -> Option<Callsign> {
        [Callsign::Sensor, Callsign::Steering]
            .into_iter()
            .find(|callsign| self.place(*callsign) == Some(place))
    }

    /// The epoch of a board's link.
    pub(crate) fn epoch(&self, callsign: Callsign) -> u32 {
        index(callsign).map_or(0, |index| self.boards[index].health.epoch)
    }

    /// The version of the protocol that a board speaks, while it is up.
    pub(crate) fn version(&self, callsign: Callsign) -> Option<Version> {
        self.place(callsign)?;
        match self.boards[index(callsign)?].health.version {
            0 => Some(Version::Original),
            1 => Some(Version::One),
            _ => None,
        }
    }

    /// A board has reported its own counters.
    pub(crate) fn status(&mut self, place: usize, status: &BoardStatus) {
        let Some(index) = self.callsign(place).and_then(index) else {
            return;
        };
        let health = &mut self.boards[index].health;
        health.reset_cause = status.reset.into();
        health.board_bad_packets = status.bad_packets;
        health.board_lost = status.lost_packets;
        health.board_refused = status.refused;
        health.board_exde_errors = status.exde_errors;
        health.board_servo_timeouts = status.servo_timeouts;
        health.board_load_percent = status.load_percent;
        health.board_longest_loop_100us = status.longest_loop_100us;
    }

    /// Takes over the counts of the readers.
    pub(crate) fn measure(&mut self, counts: &Counts) {
        for (board, lost) in self.boards.iter_mut().zip(&counts.lost) {
            board.health.lost_total = lost.load(Ordering::Relaxed);
            let Some(place) = board.place else {
                continue;
            };
            let meter = &counts.meters[place];
            board.health.packets = meter.packets.load(Ordering::Relaxed);
            board.health.lost = meter.lost.load(Ordering::Relaxed);
            board.health.bad_crc = meter.refused.load(Ordering::Relaxed);
            board.health.skipped_bytes = meter.skipped_bytes.load(Ordering::Relaxed);
        }
    }

    /// Writes the boards' part of `link/health`.
    pub(crate) fn fill(&self, health: &mut Health) {
        health.sensor = self.boards[0].health;
        health.steering = self.boards[1].health;
    }
}
