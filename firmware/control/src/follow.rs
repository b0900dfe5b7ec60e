//! Gives up following the line when the sensor board's words or the tape stay away (W3, S7).
//!
//! ```text
//!               no word for 100 ms
//!   watching --------------------------> lost: words
//!      |        words, and no tape in them for 2 s
//!      '-------------------------------> lost: tape
//! ```
//!
//! Both states last until the next command. A robot that stands because it lost its line must not
//! start again by itself when a dark thing comes under its sensors or a loose plug touches. The
//! board reports the command as aborted by its failsafe, the bridge ends the order as `no-word` or
//! `no-tape`, and only a new order makes the robot follow again.
//!
//! The Pi knows where the robot is, so it limits the way without tape: it stops 80 mm after it last
//! saw the line, and drives 40 mm past the bar of the delivery. The board does not measure
//! distance, only time: 80 mm take 1.1 s at the cruise speed of 73 mm/s. 2 s leave room for a low
//! battery, a way that begins without tape, and the Pi's reaction. So the Pi always judges first;
//! if it does not, the board stops the robot 150 mm behind the line.

use lager_wire::LineBits;

use crate::time::{first, reached};

/// How old the last word may be, in microseconds: eight passes of the sensor board at 9600 Bd.
const WORD_LIMIT_US: u32 = 100_000;
/// How long words may come without tape in them, in microseconds.
const TAPE_LIMIT_US: u32 = 2_000_000;

/// What stayed away, so that following was given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lost {
    /// Words from the sensor board stayed away.
    Words,
    /// Words came, but without tape in them.
    Tape,
}

/// Watches the robot while it follows a line.
#[derive(Debug, Clone)]
pub(crate) struct Follow {
    /// When the last word came, or when following began.
    heard_us: u32,
    /// Since when the words have shown no tape.
    bare_since_us: Option<u32>,
    lost: Option<Lost>,
}

impl Follow {
    /// Begins to watch.
    pub(crate) const fn new(now_us: u32) -> Self {
        Self {
            heard_us: now_us,
            bare_since_us: None,
            lost: None,
        }
    }

    /// Takes in a word that came from the sensor board at `at_us`.
    pub(crate) fn on_word(&mut self, bits: LineBits, at_us: u32) {
        self.heard_us = at_us;
        if bits.0 != 0 {
            self.bare_since_us = None;
        } else if self.bare_since_us.is_none() {
            self.bare_since_us = Some(at_us);
        }
    }

    /// Whether following has to be given up now; `true` once.
    pub(crate) fn gives_up(&mut self, now_us: u32) -> bool {
        if self.lost.is_some() {
            return false;
        }
        if reached(now_us, self.heard_us.wrapping_add(WORD_LIMIT_US)) {
            self.lost = Some(Lost::Words);
        } else if self
            .bare_due_us()
            .is_some_and(|due_us| reached(now_us, due_us))
        {
            self.lost = Some(Lost::Tape);
        }
        self.lost.is_some()
    }

    /// What stayed away, if following was given up.
    pub(crate) const fn lost(&self) -> Option<Lost> {
        self.lost
    }

    /// When following is given up if nothing comes.
    pub(crate) fn next_due_us(&self) -> Option<u32> {
        if self.lost.is_some() {
            return None;
        }
        let word_us = self.heard_us.wrapping_add(WORD_LIMIT_US);
        Some(match self.bare_due_us() {
            Some(bare_us) => first(self.heard_us, word_us, bare_us),
            None => word_us,
        })
    }

    fn bare_due_us(&self) -> Option<u32> {
        self.bare_since_us
            .map(|since_us| since_us.wrapping_add(TAPE_LIMIT_US))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAPE: LineBits = LineBits(0b000_0111_0000);
    const BARE: LineBits = LineBits(0);

    fn fed(word: LineBits, from_us: u32, until_us: u32, watch: &mut Follow) -> Option<u32> {
        (from_us..until_us).step_by(5_000).find(|at_us| {
            watch.on_word(word, *at_us);
            watch.gives_up(*at_us)
        })
    }

    #[test]
    fn tape_keeps_it_going_and_want_of_it_ends_it_once() {
        let mut watch = Follow::new(0);
        assert_eq!(fed(TAPE, 0, 10_000_000, &mut watch), None);
        let over = fed(BARE, 10_000_000, 13_000_000, &mut watch);
        assert_eq!(over, Some(12_000_000));
        assert_eq!(watch.lost(), Some(Lost::Tape));
        assert_eq!(fed(TAPE, 12_005_000, 13_000_000, &mut watch), None);
        assert_eq!(watch.lost(), Some(Lost::Tape), "and stays");
    }

    #[test]
    fn a_gap_that_closes_in_time_is_a_gap() {
        let mut watch = Follow::new(0);
        for round in 0..5 {
            let from_us = round * 2_000_000;
            assert_eq!(fed(BARE, from_us, from_us + 1_990_000, &mut watch), None);
            assert_eq!(
                fed(TAPE, from_us + 1_990_000, from_us + 2_000_000, &mut watch),
                None
            );
        }
    }

    #[test]
    fn silence_ends_it_also_when_no_word_ever_came_and_the_clock_wraps() {
        let start = u32::MAX - 50_000;
        let mut watch = Follow::new(start);
        assert_eq!(watch.next_due_us(), Some(start.wrapping_add(100_000)));
        assert!(!watch.gives_up(start.wrapping_add(99_999)));
        assert!(watch.gives_up(start.wrapping_add(100_000)));
        assert_eq!(watch.lost(), Some(Lost::Words));
        assert_eq!(watch.next_due_us(), None);
    }
}
