//! The robot's reset button and mode switch (B1, E14). They are lines of a GPIO chip, which a
//! closed contact pulls to ground or to 3.3 V.
//!
//! ```text
//!   reset                  open -> closed    the robot has been put on the delivery node
//!   switch, of a position  open              manual mode
//!                          closed            autonomous mode
//!   switch, of a press     open -> closed    the other mode
//! ```
//! - A switch that stays where it is moved sets the mode. Its first position sets the mode of a
//!   robot that has just been started. A bridge that goes on from an earlier state keeps that mode
//!   until somebody moves the switch. Others may change the mode meanwhile, and the next movement
//!   of the switch counts again.
//! - A button that springs back toggles the mode. Only a movement from open to closed is a press,
//!   so a button that is held at the start changes nothing, and neither does letting it go.
//! - A press within [`BETWEEN_PRESSES`] of the last one is a worn contact that bounces, and does
//!   not count. Otherwise it would take back what the person has done.
//! - A press that is read a second late does not count: the person has given it up.
//! - The kernel debounces the lines, and gives each change its time by `CLOCK_MONOTONIC`.
//! - If a chip cannot be opened, the bridge goes on, logs it, and tries again for ever.
//! - While somebody finds out how the buttons are connected, they do nothing, and the levels of all
//!   lines are told instead ([`Listening`]). What was moved meanwhile does not count afterwards.
//!
//! What a press of reset does to a stop, `machine/start.rs` decides.
//!
//! Below this stands [`Gpio`]: on a machine without a chip, a test or a simulated robot moves
//! contacts there.

mod chip;
mod watch;

use core::time::Duration;
use std::io;
use std::path::PathBuf;

use lager_orders::lease::LATEST_MOVE_NS;
use lager_orders::{Contact, Levels, Mode, SwitchKind};

pub use chip::Chips;
pub use watch::{Listening, Told, watch};

/// Nobody presses one button twice within this time, in ns.
pub const BETWEEN_PRESSES: u64 = 250_000_000;

/// Which lines they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ButtonsConfig {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: PathBuf,
    /// The contact of the reset button.
    pub reset: Option<Contact>,
    /// The contact of the mode switch.
    pub switch: Option<Contact>,
    /// What that switch is.
    pub switch_kind: SwitchKind,
    /// Whether a press of reset at the delivery node ends the stop of a fresh start.
    pub reset_starts: bool,
    /// How long a contact must be steady.
    pub debounce: Duration,
}

impl ButtonsConfig {
    /// The contact at a line.
    pub fn contact(&self, line: u8) -> Option<Contact> {
        let mut both = self.reset.into_iter().chain(self.switch);
        both.find(|contact| contact.line == line)
    }
}

/// Something that a person has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// Pressed the reset button.
    Reset,
    /// Moved the switch to a mode.
    Switched(Mode),
    /// Pressed the mode button.
    Toggled,
}

impl Touch {
    /// Whether nobody waits any more for the effect of what was done at `at_ns`. A switch that
    /// stays where it was moved is never too late.
    pub fn is_late(self, at_ns: u64, now_ns: u64) -> bool {
        let is_press = !matches!(self, Self::Switched(_));
        is_press && at_ns.abs_diff(now_ns) > LATEST_MOVE_NS
    }
}

/// The contacts at their lines, debounced.
pub trait Lines {
    /// Whether the contact at this line is closed now.
    ///
    /// # Errors
    /// The chip cannot be read.
    fn is_closed(&self, line: u8) -> io::Result<bool>;

    /// The next movement of a contact; `None` if there is none in this time.
    ///
    /// # Errors
    /// The chip cannot be read.
    fn movement(&self, patience: Duration) -> io::Result<Option<Movement>>;
}

/// A contact has moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Movement {
    /// The offset of its line.
    pub line: u8,
    /// Whether it is closed since then.
    pub is_closed: bool,
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
}

/// All lines at which a button may be, whatever is connected with them.
pub trait Survey {
    /// What they show now.
    ///
    /// # Errors
    /// They cannot be read.
    fn levels(&mut self) -> io::Result<Levels>;

    /// The number of their chip.
    fn chip(&self) -> u8;
}

/// Where the lines are: [`Chips`], a simulated world, or a test's contacts.
pub trait Gpio: Sync {
    /// Opens the lines of a configuration.
    ///
    /// # Errors
    /// The chip or one of its lines cannot be opened.
    fn open(&self, config: &ButtonsConfig) -> io::Result<Box<dyn Lines + '_>>;

    /// Opens all lines at which a button may be. No other program has them, and nothing drives them.
    ///
    /// # Errors
    /// There are none, or they cannot be opened.
    fn survey(&self) -> io::Result<Box<dyn Survey + '_>>;
}

/// Turns movements of contacts into actions. Pure.
#[derive(Clone, Copy, Debug)]
pub struct Contacts {
    /// The last position of the switch.
    switch: Option<bool>,
    /// The first position sets the mode.
    is_first: bool,
    reset: Press,
    mode: Press,
}

impl Contacts {
    /// Those of a bridge that begins, or goes on from an earlier state.
    pub const fn new(resume: bool) -> Self {
        Self {
            switch: None,
            is_first: !resume,
            reset: Press::NEW,
            mode: Press::NEW,
        }
    }

    /// Forgets where everything stood: what moves before the next [`Contacts::begin`] does not count.
    pub const fn forget(&mut self) {
        (self.switch, self.is_first) = (None, false);
    }

    /// The switch is in this position.
    fn switch(&mut self, is_closed: bool) -> Option<Touch> {
        let before = self.switch.replace(is_closed);
        let counts = match before {
            Some(before) => before != is_closed,
            None => self.is_first,
        };
        let mode = match is_closed {
            true => Mode::Autonomous,
            false => Mode::Manual,
        };
        counts.then_some(Touch::Switched(mode))
    }

    /// The lines are open for reading, and `is_closed` says which contacts are closed now.
    ///
    /// # Errors
    /// They cannot be read.
    pub fn begin(
        &mut self,
        config: &ButtonsConfig,
        is_closed: impl Fn(u8) -> io::Result<bool>,
    ) -> io::Result<Option<Touch>> {
        if let Some(reset) = config.reset {
            self.reset.is_closed = is_closed(reset.line)?;
        }
        let Some(Contact { line, .. }) = config.switch else {
            return Ok(None);
        };
        Ok(match config.switch_kind {
            SwitchKind::Position => self.switch(is_closed(line)?),
            SwitchKind::Press => {
                self.mode.is_closed = is_closed(line)?;
                None
            }
        })
    }

    /// A contact has moved.
    pub fn take(&mut self, config: &ButtonsConfig, moved: Movement) -> Option<Touch> {
        let is_switch = (config.switch).is_some_and(|switch| switch.line == moved.line);
        match (is_switch, config.switch_kind) {
            (true, SwitchKind::Position) => self.switch(moved.is_closed),
            (true, SwitchKind::Press) => self.mode.moves(moved).then_some(Touch::Toggled),
            (false, _) => self.reset.moves(moved).then_some(Touch::Reset),
        }
    }
}

/// A button that springs back.
#[derive(Clone, Copy, Debug)]
struct Press {
    is_closed: bool,
    /// When it was last pressed, in ns.
    last_ns: Option<u64>,
}

impl Press {
    const NEW: Self = Self {
        is_closed: false,
        last_ns: None,
    };

    /// The contact has moved. Returns whether that is a press.
    fn moves(&mut self, moved: Movement) -> bool {
        let was_closed = core::mem::replace(&mut self.is_closed, moved.is_closed);
        if was_closed || !moved.is_closed {
            return false;
        }
        let before = self.last_ns.replace(moved.at_ns);
        before.is_none_or(|before| moved.at_ns.abs_diff(before) > BETWEEN_PRESSES)
    }
}

#[cfg(test)]
mod tests {
    use lager_orders::Level;

    use super::*;

    #[test]
    fn the_position_of_the_switch_is_the_mode_and_only_its_movements_count() {
        let mut contacts = Contacts::new(false);
        let manual = Some(Touch::Switched(Mode::Manual));
        let autonomous = Some(Touch::Switched(Mode::Autonomous));
        assert_eq!(
            contacts.switch(false),
            manual,
            "where it stands at the start"
        );
        assert_eq!(contacts.switch(false), None, "as when the chip was away");
        assert_eq!(contacts.switch(true), autonomous);
        assert_eq!(contacts.switch(true), None);
        assert_eq!(contacts.switch(false), manual);
    }

    #[test]
    fn a_bridge_that_resumes_keeps_its_mode_until_the_switch_is_moved() {
        let mut contacts = Contacts::new(true);
        assert_eq!(contacts.switch(true), None);
        assert_eq!(contacts.switch(false), Some(Touch::Switched(Mode::Manual)));
    }

    const RESET: u8 = 0;
    const SWITCH: u8 = 1;

    fn contact(line: u8) -> Contact {
        let closed = Level::Low;
        Contact { line, closed }
    }

    fn config(switch_kind: SwitchKind) -> ButtonsConfig {
        ButtonsConfig {
            chip: "/dev/null".into(),
            reset: Some(contact(RESET)),
            switch: Some(contact(SWITCH)),
            switch_kind,
            reset_starts: true,
            debounce: Duration::from_millis(20),
        }
    }

    /// What comes of a contact that moves `at_ms`.
    fn moves(contacts: &mut Contacts, line: u8, is_closed: bool, at_ms: u64) -> Option<Touch> {
        let at_ns = at_ms * 1_000_000;
        let moved = Movement {
            line,
            is_closed,
            at_ns,
        };
        contacts.take(&config(SwitchKind::Press), moved)
    }

    #[test]
    fn a_press_counts_when_it_is_made_and_not_when_it_ends() {
        for (line, touch) in [(RESET, Touch::Reset), (SWITCH, Touch::Toggled)] {
            let mut contacts = Contacts::new(false);
            for at_ms in [5_000, 6_000] {
                assert_eq!(moves(&mut contacts, line, true, at_ms), Some(touch));
                assert_eq!(moves(&mut contacts, line, false, at_ms + 100), None);
            }
        }
    }

    #[test]
    fn a_button_that_is_held_at_the_start_changes_nothing_until_it_is_pressed_anew() {
        for resume in [false, true] {
            let mut contacts = Contacts::new(resume);
            let begun = contacts.begin(&config(SwitchKind::Press), |_| Ok(true));
            assert_eq!(begun.unwrap(), None);
            for (line, touch) in [(RESET, Touch::Reset), (SWITCH, Touch::Toggled)] {
                // The kernel may tell of the contact as it finds it.
                assert_eq!(moves(&mut contacts, line, true, 1_000), None);
                assert_eq!(moves(&mut contacts, line, false, 2_000), None);
                assert_eq!(moves(&mut contacts, line, true, 3_000), Some(touch));
            }
        }
    }

    #[test]
    fn a_contact_that_bounces_is_one_press() {
        for (line, touch) in [(RESET, Touch::Reset), (SWITCH, Touch::Toggled)] {
            let mut contacts = Contacts::new(false);
            assert_eq!(moves(&mut contacts, line, true, 1_000), Some(touch));
            for bounce in [40, 90, 200] {
                assert_eq!(moves(&mut contacts, line, false, 1_000 + bounce), None);
                assert_eq!(moves(&mut contacts, line, true, 1_020 + bounce), None);
            }
            // It bounces for as long as it is held, and then it is let go.
            assert_eq!(moves(&mut contacts, line, false, 1_500), None);
            assert_eq!(moves(&mut contacts, line, true, 1_800), Some(touch));
        }
    }

    #[test]
    fn what_is_old_does_not_count_except_where_a_switch_stands() {
        let now = 5_000_000_000;
        let old = now - LATEST_MOVE_NS - 1;
        for touch in [Touch::Reset, Touch::Toggled] {
            assert!(touch.is_late(old, now) && !touch.is_late(old + 1, now));
            // A time of another clock.
            assert!(touch.is_late(now + LATEST_MOVE_NS + 1, now));
        }
        assert!(!Touch::Switched(Mode::Autonomous).is_late(0, now));
    }

    #[test]
    fn what_moves_while_nobody_counts_it_is_no_press_and_no_new_mode() {
        for kind in [SwitchKind::Position, SwitchKind::Press] {
            let config = config(kind);
            let mut contacts = Contacts::new(false);
            contacts.begin(&config, |_| Ok(false)).unwrap();
            contacts.forget();
            // The switch stands elsewhere now, or a button is held.
            assert_eq!(contacts.begin(&config, |_| Ok(true)).unwrap(), None);
            let moved = |line, is_closed, at_ns| Movement {
                line,
                is_closed,
                at_ns,
            };
            assert_eq!(contacts.take(&config, moved(RESET, false, 1)), None);
            let back = contacts.take(&config, moved(SWITCH, false, 1));
            let manual = (kind == SwitchKind::Position).then_some(Touch::Switched(Mode::Manual));
            assert_eq!(back, manual, "its next movement counts");
        }
    }
}
