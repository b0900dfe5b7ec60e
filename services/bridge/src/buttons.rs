//! The robot's reset button and mode switch (B1, E14). They are lines of a GPIO chip, which a
//! closed contact pulls to ground.
//!
//! ```text
//!   reset    open -> closed    the robot has been put on the delivery node
//!   switch   open              manual mode
//!            closed            autonomous mode
//! ```
//! - The switch's position is a mode; the switch does not toggle. Its first position sets the mode
//!   of a robot that has just been started. A bridge that goes on from an earlier state keeps that
//!   mode until somebody moves the switch. Others may change the mode meanwhile, and the next
//!   movement of the switch counts again.
//! - A press that is read a second late does not count: the person has given it up.
//! - The kernel debounces the lines, and gives each change its time by `CLOCK_MONOTONIC`.
//! - If a chip cannot be opened, the bridge goes on, logs it, and tries again for ever.
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

/// How often the thread checks whether the bridge ends.
const LOOK: Duration = Duration::from_millis(100);
/// After how many checks it tries again to open a chip.
const LOOKS: u32 = 20;

/// Which lines they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ButtonsConfig {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: PathBuf,
    /// The offset of the reset button's line.
    pub reset: Option<u32>,
    /// The offset of the mode switch's line.
    pub switch: Option<u32>,
    /// How long a contact must be steady.
    pub debounce: Duration,
}

/// Something that a person has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// Pressed the reset button.
    Reset,
    /// Moved the switch to a mode.
    Switched(Mode),
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
}

impl Contacts {
    const fn new(resume: bool) -> Self {
        Self {
            switch: None,
            is_first: !resume,
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

    /// The reset button has moved. A press that is too old does not count.
    fn reset(is_closed: bool, moved_ns: u64, now_ns: u64) -> Option<Touch> {
        let is_fresh = moved_ns.abs_diff(now_ns) <= LATEST_MOVE_NS;
        (is_closed && is_fresh).then_some(Touch::Reset)
    }
}

/// Passes on what people do, until `end`.
pub fn watch(
    config: &ButtonsConfig,
    open: &Opener,
    resume: bool,
    end: &AtomicBool,
    mut touched: impl FnMut(Touch),
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
    touched: &mut impl FnMut(Touch),
) -> io::Result<()> {
    if let Some(line) = config.switch {
        let touch = contacts.switch(lines.is_closed(line)?);
        touch.into_iter().for_each(&mut *touched);
    }
    while !end.load(Ordering::Acquire) {
        let Some(moved) = lines.movement(LOOK)? else {
            continue;
        };
        let touch = match Some(moved.line) == config.switch {
            true => contacts.switch(moved.is_closed),
            false => Contacts::reset(moved.is_closed, moved.at_ns, Clock::monotonic_ns()),
        };
        touch.into_iter().for_each(&mut *touched);
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

    #[test]
    fn a_press_counts_when_it_is_made_and_not_when_it_ends_or_is_old() {
        let now = 5_000_000_000;
        assert_eq!(Contacts::reset(true, now, now), Some(Touch::Reset));
        assert_eq!(Contacts::reset(false, now, now), None);
        assert_eq!(Contacts::reset(true, now - LATEST_MOVE_NS - 1, now), None);
    }

    #[test]
    fn a_chip_that_is_not_there_ends_nothing_and_the_wish_to_end_is_heard() {
        let config = ButtonsConfig {
            chip: "/dev/null".into(),
            reset: Some(0),
            switch: Some(1),
            debounce: Duration::from_millis(20),
        };
        assert!(open(&config).is_err());
        let end = AtomicBool::new(false);
        let nobody = |touch| panic!("{touch:?}");
        std::thread::scope(|scope| {
            let watching = scope.spawn(|| watch(&config, &open, false, &end, nobody));
            std::thread::sleep(LOOK * 3);
            assert!(!watching.is_finished());
            end.store(true, Ordering::Release);
            watching.join().expect("it ends");
        });
    }
}
