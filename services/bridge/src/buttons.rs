//! The robot's reset button and mode switch (B1, E14). They are lines of a GPIO chip, which a
//! closed contact pulls to ground.
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
//!
//! What a press of reset does to a stop, `machine/start.rs` decides.
//!
//! Below this stands [`Lines`]: on a machine without a chip, a test can move contacts there.

use core::time::Duration;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use gpiocdev::Request;
use gpiocdev::line::{Bias, EdgeDetection, EdgeKind, Value};
use lager_home::Clock;
use lager_orders::Mode;
use lager_orders::lease::LATEST_MOVE_NS;
use serde::{Deserialize, Serialize};

/// How often the thread checks whether the bridge ends.
const LOOK: Duration = Duration::from_millis(100);
/// After how many checks it tries again to open a chip.
const LOOKS: u32 = 20;
/// Nobody presses one button twice within this time, in ns.
pub const BETWEEN_PRESSES: u64 = 250_000_000;

/// Which lines they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ButtonsConfig {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: PathBuf,
    /// The offset of the reset button's line.
    pub reset: Option<u32>,
    /// The offset of the mode switch's line.
    pub switch: Option<u32>,
    /// What that switch is.
    pub switch_kind: SwitchKind,
    /// Whether a press of reset at the delivery node ends the stop of a fresh start.
    pub reset_starts: bool,
    /// How long a contact must be steady.
    pub debounce: Duration,
}

/// What a mode switch tells by its contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SwitchKind {
    /// A switch that stays where it is moved: its position is the mode.
    #[default]
    Position,
    /// A button that springs back: each press toggles the mode.
    Press,
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
    fn is_closed(&self, line: u32) -> io::Result<bool>;

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
    pub line: u32,
    /// Whether it is closed since then.
    pub is_closed: bool,
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
}

/// Opens the lines of a configuration: [`open`], or a test's own function.
pub type Opener = dyn Fn(&ButtonsConfig) -> io::Result<Box<dyn Lines>> + Send + Sync;

/// Turns movements of contacts into actions. Pure.
#[derive(Clone, Copy, Debug)]
struct Contacts {
    /// The last position of the switch.
    switch: Option<bool>,
    /// The first position sets the mode.
    is_first: bool,
    reset: Press,
    mode: Press,
}

impl Contacts {
    const fn new(resume: bool) -> Self {
        Self {
            switch: None,
            is_first: !resume,
            reset: Press::NEW,
            mode: Press::NEW,
        }
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
    fn begin(
        &mut self,
        config: &ButtonsConfig,
        is_closed: impl Fn(u32) -> io::Result<bool>,
    ) -> io::Result<Option<Touch>> {
        if let Some(line) = config.reset {
            self.reset.is_closed = is_closed(line)?;
        }
        let Some(line) = config.switch else {
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
    fn take(&mut self, config: &ButtonsConfig, moved: Movement) -> Option<Touch> {
        match (Some(moved.line) == config.switch, config.switch_kind) {
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

/// Passes on what people do, and when they did it (in ns of `CLOCK_MONOTONIC`), until `end`.
pub fn watch(
    config: &ButtonsConfig,
    open: &Opener,
    resume: bool,
    end: &AtomicBool,
    mut touched: impl FnMut(Touch, u64),
) {
    let mut contacts = Contacts::new(resume);
    let mut complaints = 0_u32;
    while !end.load(Ordering::Acquire) {
        let watched = open(config)
            .and_then(|lines| watch_lines(config, &*lines, &mut contacts, end, &mut touched));
        let Err(error) = watched else { return };
        complaints = complaints.wrapping_add(1);
        if complaints.is_power_of_two() {
            let chip = config.chip.display();
            tracing::error!(
                "buttons do not work: {chip}: {error}; `gpioinfo` of libgpiod shows which chips and \
                 lines there are, and who uses them"
            );
        }
        for _ in 0..LOOKS {
            if end.load(Ordering::Acquire) {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}

/// The lines of a chip of this machine.
///
/// # Errors
/// The chip or one of its lines cannot be opened.
pub fn open(config: &ButtonsConfig) -> io::Result<Box<dyn Lines>> {
    let lines: Vec<u32> = config.reset.into_iter().chain(config.switch).collect();
    let request = Request::builder()
        .on_chip(&config.chip)
        .with_consumer("lager")
        .with_lines(&lines)
        .as_input()
        .as_active_low()
        .with_bias(Bias::PullUp)
        .with_edge_detection(EdgeDetection::BothEdges)
        .with_debounce_period(config.debounce)
        .request();
    Ok(Box::new(Chip(request.map_err(io::Error::other)?)))
}

/// Lines that the kernel debounces.
struct Chip(Request);

impl Lines for Chip {
    fn is_closed(&self, line: u32) -> io::Result<bool> {
        let value = self.0.value(line).map_err(io::Error::other)?;
        Ok(value == Value::Active)
    }

    fn movement(&self, patience: Duration) -> io::Result<Option<Movement>> {
        if !(self.0.wait_edge_event(patience)).map_err(io::Error::other)? {
            return Ok(None);
        }
        let edge = self.0.read_edge_event().map_err(io::Error::other)?;
        Ok(Some(Movement {
            line: edge.offset,
            // A line that is active low rises when its contact closes.
            is_closed: edge.kind == EdgeKind::Rising,
            at_ns: edge.timestamp_ns,
        }))
    }
}

fn watch_lines(
    config: &ButtonsConfig,
    lines: &dyn Lines,
    contacts: &mut Contacts,
    end: &AtomicBool,
    touched: &mut impl FnMut(Touch, u64),
) -> io::Result<()> {
    if let Some(touch) = contacts.begin(config, |line| lines.is_closed(line))? {
        touched(touch, Clock::monotonic_ns());
    }
    while !end.load(Ordering::Acquire) {
        let Some(moved) = lines.movement(LOOK)? else {
            continue;
        };
        if let Some(touch) = contacts.take(config, moved) {
            touched(touch, moved.at_ns);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
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

    const RESET: u32 = 0;
    const SWITCH: u32 = 1;

    fn config(switch_kind: SwitchKind) -> ButtonsConfig {
        ButtonsConfig {
            chip: "/dev/null".into(),
            reset: Some(RESET),
            switch: Some(SWITCH),
            switch_kind,
            reset_starts: true,
            debounce: Duration::from_millis(20),
        }
    }

    /// What comes of a contact that moves `at_ms`.
    fn moves(contacts: &mut Contacts, line: u32, is_closed: bool, at_ms: u64) -> Option<Touch> {
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
    fn a_chip_that_is_not_there_ends_nothing_and_the_wish_to_end_is_heard() {
        let config = config(SwitchKind::Position);
        assert!(open(&config).is_err());
        let end = AtomicBool::new(false);
        let nobody = |touch, _| panic!("{touch:?}");
        std::thread::scope(|scope| {
            let watching = scope.spawn(|| watch(&config, &open, false, &end, nobody));
            std::thread::sleep(LOOK * 3);
            assert!(!watching.is_finished());
            end.store(true, Ordering::Release);
            watching.join().expect("it ends");
        });
    }
}
