//! A running board: its start-up, the steps of its loop, and its watchdog.
//!
//! ```text
//!                start-up over              step, step, ...
//!   in reset -------------------> running -------------------.
//!      ^                            | hangs                  |
//!      |  64 ms without a kick      v                        |
//!      '---------------------------hung      reset, any time v
//!      '----------------------------------------------------'
//! ```
//! Both boards use it; [`crate::boards`] has their pins.

use lager_control::EEPROM_LENGTH;
use lager_wire::ResetCause;

use crate::boards::Chip;
use crate::uart::Uart;

/// The time from the cause of a reset until the board runs: the chip's start-up time with the fuses
/// for slowly rising power.
pub(crate) const START_UP_NS: u64 = 65_000_000;
/// The shortest time of a board's loop, even if the program asks for an earlier step.
const SHORTEST_LOOP_NS: u64 = 10_000;
/// The watchdog's time. After it the motors go off, and then the board starts again.
const WATCHDOG_NS: u64 = 64_000_000;

/// A board with its program.
#[derive(Clone, Debug)]
pub(crate) struct Running<Unit> {
    /// `None` while the board is held in reset.
    pub(crate) unit: Option<Unit>,
    pub(crate) chip: Chip,
    /// The time of the program's next step, or of its start.
    pub(crate) due_ns: u64,
    /// Whether the program has stopped looping.
    pub(crate) hung: bool,
}

impl<Unit> Running<Unit> {
    pub(crate) fn new(baud: u32, cause: ResetCause, starts_ns: u64) -> Self {
        Self {
            unit: None,
            chip: Chip {
                uart: Uart::new(baud),
                cause,
                resets: false,
                boot_ns: starts_ns,
                kicked_ns: starts_ns,
                now_ns: 0,
                eeprom: [u8::MAX; EEPROM_LENGTH as usize],
                eeprom_free_ns: 0,
            },
            due_ns: starts_ns,
            hung: false,
        }
    }

    pub(crate) fn next_event(&self, now: u64) -> u64 {
        if self.hung {
            self.chip.kicked_ns + WATCHDOG_NS
        } else if self.unit.is_none() {
            self.due_ns
        } else {
            self.due_ns.min(self.chip.uart.next_event(now))
        }
    }

    /// Resets the board; it starts again after the start-up time.
    pub(crate) fn reset(&mut self, now: u64, cause: ResetCause) {
        self.unit = None;
        self.hung = false;
        self.chip.cause = cause;
        self.chip.now_ns = now;
        // The board's clock counts whole microseconds from its start.
        self.chip.boot_ns = (now + START_UP_NS).next_multiple_of(1_000);
        self.chip.kicked_ns = self.chip.boot_ns;
        self.due_ns = self.chip.boot_ns;
        self.chip.uart.restart_board(now);
    }

    /// The board's own clock, which runs only while the board does.
    pub(crate) fn clock_us(&self, now: u64) -> u32 {
        (now.saturating_sub(self.chip.boot_ns) / 1_000) as u32
    }

    /// Whether the board's loop has work; `input` says that another interrupt saw something.
    pub(crate) fn wants(&self, now: u64, input: bool) -> bool {
        let arrived = self.chip.uart.next_event(self.chip.now_ns) <= now;
        !self.hung && (now >= self.due_ns || self.unit.is_some() && (input || arrived))
    }

    /// Sets the time of the unit's next step.
    pub(crate) fn plan(&mut self, wanted_us: u32) {
        let ahead = wanted_us.wrapping_sub(self.clock_us(self.chip.now_ns)) as i32;
        let ahead_ns = u64::from(ahead.max(0).unsigned_abs()) * 1_000;
        let clock_ns = self.chip.boot_ns + (self.chip.now_ns - self.chip.boot_ns) / 1_000 * 1_000;
        self.due_ns = (clock_ns + ahead_ns).max(self.chip.now_ns + SHORTEST_LOOP_NS);
    }

    /// Whether the watchdog resets the board now.
    pub(crate) fn is_bitten(&self, now: u64) -> bool {
        self.hung && now >= self.chip.kicked_ns + WATCHDOG_NS
    }

    /// Brings the board to the time of a step. Bytes sent to it during its reset are lost.
    pub(crate) fn come_to(&mut self, now: u64) {
        if self.unit.is_none() {
            self.chip.uart.restart_board(now);
        }
        self.chip.now_ns = now;
    }
}
