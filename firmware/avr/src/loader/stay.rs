//! How long the loader waits for the Pi before it starts the application.
//!
//! ```text
//!   power-on, reset button   0.5 s ---a whole command---> 2.5 s from the reset
//!   the application asked    8 s                             |
//!                                 a page written or read ----'--> 3 s from there, again and again
//!   never longer than 120 s; without an application, for ever
//! ```
//!
//! The bytes of other programs can look like a short command, but not like a page: that takes its
//! length, its memory and its end at the right places. So they cannot keep a board from starting.

use lager_avr::register::{bit, get, put, timer1};
use lager_loader::entry;

/// Timer 1 clears itself at its compare value, 25 times a second.
const TICK_MS: u16 = 40;
/// Compares 16 MHz / 64 with 40 ms.
const COMPARE: u16 = 9_999;
const CTC_64: u8 = 0b0000_1011;
const OCF_A: u8 = bit(1);

/// Later than any time, or nearly: after 43 minutes the loader looks for an application again.
const FOR_EVER: u16 = u16::MAX;

/// The longest silence inside a command.
const GAP: u16 = 240 / TICK_MS;

const fn ticks(ms: u32) -> u16 {
    (ms / TICK_MS as u32) as u16
}

/// The loader's time.
pub(crate) struct Stay {
    /// Since the reset.
    now: u16,
    until: u16,
    last_byte: u16,
}

impl Stay {
    /// Starts the clock.
    pub(crate) fn new(is_asked: bool) -> Self {
        let timer = timer1();
        put(timer.ocr1a(), COMPARE);
        put(timer.tccr1b(), CTC_64);
        let first_ms = if is_asked {
            entry::WAITS_WHEN_ASKED_MS
        } else {
            entry::WAITS_MS
        };
        Self {
            now: 0,
            until: ticks(first_ms as u32),
            last_byte: 0,
        }
    }

    /// Looks at the clock. Call it at least every 40 ms.
    pub(crate) fn look(&mut self) {
        if get(timer1().tifr1()) & OCF_A != 0 {
            put(timer1().tifr1(), OCF_A);
            self.now = self.now.saturating_add(1);
        }
    }

    /// Whether the time is up.
    pub(crate) fn is_over(&self) -> bool {
        self.now >= self.until
    }

    /// The loader stays, because there is no application.
    pub(crate) fn for_ever(&mut self) {
        self.until = FOR_EVER;
        self.restart();
    }

    fn restart(&mut self) {
        self.now = 0;
        self.last_byte = 0;
    }

    /// A byte has come.
    pub(crate) fn on_byte(&mut self) {
        self.last_byte = self.now;
    }

    /// Whether the line has been silent for too long inside a command.
    pub(crate) fn is_gap(&self) -> bool {
        self.now.wrapping_sub(self.last_byte) > GAP
    }

    /// A whole command has come.
    pub(crate) fn on_command(&mut self) {
        self.extend(ticks(entry::WAITS_AFTER_COMMAND_MS as u32));
    }

    /// A page was written or read.
    pub(crate) fn on_page(&mut self) {
        if self.until == FOR_EVER {
            // From now on there may be an application.
            self.until = 0;
            self.restart();
        }
        let more = self
            .now
            .saturating_add(ticks(entry::WAITS_AFTER_PAGE_MS as u32));
        self.extend(more.min(ticks(entry::LONGEST_MS)));
    }

    fn extend(&mut self, until: u16) {
        self.until = self.until.max(until);
    }
}
