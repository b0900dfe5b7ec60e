//! The thread that waits for the buttons, and reads their lines while somebody finds out how they
//! are connected.
//!
//! ```text
//!               somebody listens
//!   watches  ----------------------> surveys: a pass over all lines every 10 ms
//!   contacts <---------------------- and tells what they show
//!               nobody does any more: nothing that has moved meanwhile counts
//! ```

use core::time::Duration;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use lager_home::Clock;
use lager_orders::Levels;
use lager_topics::ButtonLines;

use super::{ButtonsConfig, Contacts, Gpio, Lines, Touch};

/// How often the thread checks whether the bridge ends.
const LOOK: Duration = Duration::from_millis(100);
/// After how many checks it tries again to open a chip.
const LOOKS: u32 = 20;
/// The pause between two passes over all lines.
const PASS: Duration = Duration::from_millis(10);

/// What the main loop wants of the thread, and what that has found.
#[derive(Debug, Default)]
pub struct Listening {
    is_wanted: AtomicBool,
    told: Mutex<Told>,
}

/// What the lines show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Told {
    /// What is known of them.
    pub state: ButtonLines,
    /// The number of their chip.
    pub chip: u8,
    /// Their levels.
    pub levels: Levels,
}

impl Default for Told {
    fn default() -> Self {
        Self {
            state: ButtonLines::Unread,
            chip: 0,
            levels: Levels::default(),
        }
    }
}

impl Listening {
    /// Whether somebody wants to know the levels.
    pub fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Acquire)
    }

    /// From now on somebody wants to know the levels, or nobody does.
    pub fn want(&self, is_wanted: bool) {
        if self.is_wanted() == is_wanted {
            return;
        }
        if is_wanted {
            self.tell(Told::default());
        }
        self.is_wanted.store(is_wanted, Ordering::Release);
    }

    /// What is known of the lines.
    pub fn told(&self) -> Told {
        *self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, told: Told) {
        *self.told.lock().unwrap_or_else(PoisonError::into_inner) = told;
    }
}

/// Passes on what people do, and when they did it (in ns of `CLOCK_MONOTONIC`), until `end`. Without
/// a configuration it only listens.
pub fn watch(
    config: Option<&ButtonsConfig>,
    gpio: &dyn Gpio,
    resume: bool,
    (end, listening): (&AtomicBool, &Listening),
    mut touched: impl FnMut(Touch, u64),
) {
    let ends = || end.load(Ordering::Acquire);
    let mut contacts = Contacts::new(resume);
    let mut complaints = 0_u32;
    while !ends() {
        if listening.is_wanted() {
            survey(gpio, (end, listening));
            contacts.forget();
            continue;
        }
        let Some(config) = config else {
            std::thread::sleep(LOOK);
            continue;
        };
        let watched = gpio.open(config).and_then(|lines| {
            let whether = (end, listening);
            watch_lines(config, &*lines, &mut contacts, whether, &mut touched)
        });
        let Err(error) = watched else { continue };
        complaints = complaints.wrapping_add(1);
        if complaints.is_power_of_two() {
            let chip = config.chip.display();
            tracing::error!(
                "buttons do not work: {chip}: {error}; `gpioinfo` of libgpiod shows which chips and \
                 lines there are, and who uses them"
            );
        }
        for _ in 0..LOOKS {
            if ends() || listening.is_wanted() {
                break;
            }
            std::thread::sleep(LOOK);
        }
    }
}

fn watch_lines(
    config: &ButtonsConfig,
    lines: &dyn Lines,
    contacts: &mut Contacts,
    (end, listening): (&AtomicBool, &Listening),
    touched: &mut impl FnMut(Touch, u64),
) -> io::Result<()> {
    if let Some(touch) = contacts.begin(config, |line| lines.is_closed(line))? {
        touched(touch, Clock::monotonic_ns());
    }
    while !end.load(Ordering::Acquire) && !listening.is_wanted() {
        let Some(moved) = lines.movement(LOOK)? else {
            continue;
        };
        if let Some(touch) = contacts.take(config, moved) {
            touched(touch, moved.at_ns);
        }
    }
    Ok(())
}

/// Tells what all lines show, while somebody listens.
fn survey(gpio: &dyn Gpio, (end, listening): (&AtomicBool, &Listening)) {
    let absent = |error: &io::Error| {
        tracing::warn!("the lines of the buttons cannot be read: {error}");
        listening.tell(Told {
            state: ButtonLines::Absent,
            ..Told::default()
        });
    };
    let goes_on = || listening.is_wanted() && !end.load(Ordering::Acquire);
    let mut survey = gpio.survey().inspect_err(absent).ok();
    while goes_on() {
        let levels = survey
            .as_mut()
            .map(|survey| (survey.levels(), survey.chip()));
        match levels {
            Some((Ok(levels), chip)) => listening.tell(Told {
                state: ButtonLines::Read,
                chip,
                levels,
            }),
            Some((Err(error), _)) => {
                absent(&error);
                survey = None;
            }
            None => {}
        }
        std::thread::sleep(PASS);
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use lager_orders::{Contact, Level, SwitchKind};

    use super::super::Chips;
    use super::*;

    #[test]
    fn a_chip_that_is_not_there_ends_nothing_and_the_wish_to_end_is_heard() {
        let config = ButtonsConfig {
            chip: PathBuf::from("/dev/null"),
            reset: Some(Contact {
                line: 0,
                closed: Level::Low,
            }),
            switch: None,
            switch_kind: SwitchKind::Position,
            reset_starts: true,
            debounce: Duration::from_millis(20),
        };
        assert!(Chips.open(&config).is_err());
        let (end, listening) = (AtomicBool::new(false), Listening::default());
        let nobody = |touch, _| panic!("{touch:?}");
        std::thread::scope(|scope| {
            let watching = scope.spawn(|| {
                watch(Some(&config), &Chips, false, (&end, &listening), nobody);
            });
            std::thread::sleep(LOOK * 3);
            assert!(!watching.is_finished());
            end.store(true, Ordering::Release);
            watching.join().expect("it ends");
        });
    }
}
