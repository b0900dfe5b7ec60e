//! The robot's own buttons in virtual time: from the contacts of the world to what comes of a touch,
//! by the same decisions as in the bridge's thread.

use std::path::PathBuf;
use std::time::Duration;

use lager_bridge::buttons::{ButtonsConfig, Contacts, Movement, Told};
use lager_commission::{Answer, Built, Question, Step};
use lager_logic::Input;
use lager_orders::{Buttons, Level, Mode, SwitchKind};
use lager_plant::{Build, ButtonsBuild, World};
use lager_topics::{ButtonLines, InputKind};

use super::super::Whole;
use super::super::built::{LIMIT, robot, seeds};
use super::person::Person;
use crate::config::{ButtonsSection, Config};

/// A press is longer than a contact bounces, and two of them are not one.
const PRESS: Duration = Duration::from_millis(300);

/// What the bridge's thread tells of the lines.
pub(super) fn told(world: &World) -> Told {
    Told {
        state: ButtonLines::Read,
        chip: 0,
        levels: world.levels(),
    }
}

/// What is to be found out of such buttons.
pub(super) fn of(built: &ButtonsBuild) -> Buttons {
    Buttons {
        chip: 0,
        reset: built.reset.map(|reset| reset.contact),
        mode: built.mode.map(|(mode, kind)| (mode.contact, kind)),
    }
}

/// The thread that watches the buttons, as it is configured.
struct Watched {
    config: ButtonsConfig,
    contacts: Contacts,
    closed: [bool; 2],
}

impl Watched {
    /// Nothing if the configuration names no buttons.
    fn new(section: &ButtonsSection, whole: &mut Whole) -> Option<Self> {
        let config = section.lines()?;
        let mut watched = Self {
            closed: [false; 2],
            contacts: Contacts::new(true),
            config,
        };
        watched.closed = watched.look(whole);
        let now = watched.closed;
        let at_switch = |line| {
            watched
                .config
                .switch
                .is_some_and(|switch| switch.line == line)
        };
        let is_closed = |line| Ok(now[usize::from(at_switch(line))]);
        let first = watched.contacts.begin(&watched.config, is_closed);
        assert_eq!(first.expect("they are read"), None, "it goes on");
        Some(watched)
    }

    /// Whether the contacts of reset and switch are closed, by what their lines show.
    fn look(&self, whole: &Whole) -> [bool; 2] {
        let levels = whole.robot.world().levels();
        [self.config.reset, self.config.switch]
            .map(|contact| contact.is_some_and(|at| levels.of(at.line) == Some(at.closed)))
    }

    /// Hears what has moved. Returns what logic is told.
    fn hear(&mut self, whole: &mut Whole) -> Vec<InputKind> {
        let now = self.look(whole);
        let before = std::mem::replace(&mut self.closed, now);
        let mut told = Vec::new();
        for (place, contact) in [self.config.reset, self.config.switch].iter().enumerate() {
            let Some(contact) = contact.filter(|_| now[place] != before[place]) else {
                continue;
            };
            let moved = Movement {
                line: contact.line,
                is_closed: now[place],
                at_ns: whole.moment().ns,
            };
            let Some(touch) = self.contacts.take(&self.config, moved) else {
                continue;
            };
            let status = whole.navigator.status();
            let starts = self.config.reset_starts;
            let (now, touch) = (whole.moment(), (touch, moved.at_ns));
            let Some(kind) = whole.bridge.touch(now, touch, starts, Some(&status)) else {
                continue;
            };
            whole.stirred = true;
            whole.act();
            whole.tell_logic(Input::Operator(&lager_topics::Input {
                kind: kind.into(),
                ..lager_topics::Input::default()
            }));
            told.push(kind);
        }
        told
    }
}

/// Closes or opens a contact and lets a moment pass. Returns what logic is told.
fn moves(
    whole: &mut Whole,
    watched: &mut Option<Watched>,
    button: usize,
    is_closed: bool,
) -> Vec<InputKind> {
    whole.robot.world_mut().press(button, is_closed);
    let end = whole.now + PRESS;
    let mut told = Vec::new();
    while whole.now < end {
        let _ = whole.turn();
        if let Some(watched) = watched {
            told.extend(watched.hear(whole));
        }
    }
    told
}

/// A robot that runs by what was found out hears each of its buttons, once for each press, and does
/// what is said of it.
pub(super) fn act_as_they_are_built(whole: &mut Whole, built: &Built, seed: u64) {
    let mut config = Config::default();
    config.take_commissioned(built);
    config.validate().expect("what was found out is valid");
    for button in 0..2 {
        whole.robot.world_mut().press(button, false);
    }
    let mut watched = Watched::new(&config.buttons, whole);
    let Buttons { reset, mode, .. } = built.buttons;
    assert_eq!(watched.is_some(), reset.is_some() || mode.is_some());
    if reset.is_some() {
        let pressed = moves(whole, &mut watched, 0, true);
        assert_eq!(pressed, [InputKind::ResetPressed], "seed {seed}");
        assert_eq!(moves(whole, &mut watched, 0, false), [], "seed {seed}");
    }
    let Some((_, kind)) = mode else { return };
    let before = whole.bridge.mode();
    let named = |mode| match mode {
        Mode::Manual => InputKind::SwitchedToManual,
        Mode::Autonomous => InputKind::SwitchedToAutonomous,
    };
    for _ in 0..2 {
        let [closed, open] =
            [true, false].map(|is_closed| moves(whole, &mut watched, 1, is_closed));
        match kind {
            SwitchKind::Position => {
                assert_eq!(closed, [InputKind::SwitchedToAutonomous], "seed {seed}");
                assert_eq!(open, [InputKind::SwitchedToManual], "seed {seed}");
            }
            SwitchKind::Press => {
                let now = whole.bridge.mode();
                assert_eq!((closed, open), (vec![named(now)], vec![]), "seed {seed}");
            }
        }
    }
    if kind == SwitchKind::Press {
        assert_eq!(whole.bridge.mode(), before, "two presses");
    }
    // Its mission is begun by somebody who lets logic drive.
    if whole.bridge.mode() == Mode::Manual {
        moves(whole, &mut watched, 1, true);
    }
    assert_eq!(whole.bridge.mode(), Mode::Autonomous, "seed {seed}");
}
