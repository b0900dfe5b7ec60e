//! The robot's own buttons in virtual time: from the contacts of the world to what comes of a touch,
//! by the same decisions as in the bridge's thread.

use std::time::Duration;

use lager_bridge::buttons::{ButtonsConfig, Contacts, Movement, Touch};
use lager_commission::{Answer, Built, Question, Step};
use lager_logic::Input;
use lager_orders::{Buttons, Contact, Level, Mode, SwitchKind};
use lager_plant::{Build, ButtonsBuild, ContactBuild};
use lager_topics::{BridgeAnswer, ButtonLines, Hold, InputKind};

use super::super::Whole;
use super::super::built::{LIMIT, robot, seeds};
use super::person::Person;
use crate::config::{Body, ButtonsSection, Config};

/// A press is longer than a contact bounces, and two of them are not one.
const PRESS: Duration = Duration::from_millis(300);

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
    // Whoever has ordered the mission lets logic drive, as long as nobody has chosen otherwise.
    moves(whole, &mut watched, 1, false);
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

/// A robot that differs in its buttons alone.
fn with_buttons(seed: u64) -> Build {
    Build {
        buttons: Build::drawn(seed).buttons,
        ..Build::default()
    }
}

#[test]
fn a_robot_whose_buttons_nobody_described_stands_and_says_why_and_its_buttons_do_nothing() {
    for seed in seeds() {
        let real = Config {
            body: Body::Serial,
            ..Config::default()
        };
        let mut whole = robot(&real, with_buttons(seed), seed);
        let mut watched = Watched::new(&real.buttons, &mut whole);
        for button in 0..2 {
            for is_closed in [true, false] {
                assert_eq!(moves(&mut whole, &mut watched, button, is_closed), []);
            }
        }
        let end = whole.now + Duration::from_secs(20);
        whole.run(end).expect("it cannot deliver");
        assert_eq!(whole.hold(), Some(Hold::Undescribed.into()), "seed {seed}");
    }
}

/// A person at the buttons of a robot that is built so, who is asked for them.
fn at_the_buttons(buttons: ButtonsBuild) -> Person {
    let build = Build {
        buttons,
        ..Build::default()
    };
    let mut person = Person::new(&Config::default(), build, 1);
    let end = person.whole.now + LIMIT;
    while person.machine().step() != Step::Buttons {
        match person.machine().question() {
            Some(Question::Boards) => person.say(Answer::Yes),
            Some(_) => person.say(Answer::Skip),
            None => {}
        }
        person.wait(Duration::from_millis(200));
        assert!(person.whole.now < end, "{:?}", person.said);
    }
    person.wait(Duration::from_millis(500));
    person
}

fn contact(line: u8, closed: Level) -> ContactBuild {
    ContactBuild {
        contact: Contact { line, closed },
        has_resistor: false,
    }
}

#[test]
fn buttons_that_do_not_do_what_is_asked_are_refused_with_what_to_do() {
    let both = ButtonsBuild {
        reset: Some(contact(17, Level::Low)),
        mode: Some((contact(27, Level::High), SwitchKind::Position)),
    };
    let says = |person: &mut Person, why: &str| {
        let said = person.said.join("; ");
        assert!(said.contains(why), "{why}: {said}");
        assert_eq!(person.machine().question(), Some(Question::ButtonsFree));
        person.said.clear();
        for button in 0..2 {
            person.whole.robot.world_mut().press(button, false);
        }
        person.wait(Duration::from_millis(500));
    };
    let answers = |person: &mut Person, presses: &[(usize, bool)], answer: Answer| {
        for (button, is_closed) in presses {
            person.whole.robot.world_mut().press(*button, *is_closed);
            person.wait(Duration::from_millis(200));
        }
        person.say(answer);
        person.wait(Duration::from_millis(500));
    };
    let mut person = at_the_buttons(both);
    person.said.clear();
    // Nobody presses it.
    answers(&mut person, &[], Answer::Yes);
    answers(&mut person, &[], Answer::Yes);
    says(&mut person, "no line has changed");
    // The wrong one, which stays.
    answers(&mut person, &[], Answer::Yes);
    answers(&mut person, &[(1, true)], Answer::Yes);
    says(&mut person, "line 27 has changed and stays so");
    // Both.
    answers(&mut person, &[], Answer::Yes);
    let all = [(0, true), (0, false), (1, true), (1, false)];
    answers(&mut person, &all, Answer::Yes);
    says(&mut person, "more than one line has changed: 17, 27");
    // A switch that is open at autonomous looks like a broken cable.
    answers(&mut person, &[(1, true)], Answer::Yes);
    answers(&mut person, &[(0, true), (0, false)], Answer::Yes);
    answers(&mut person, &[(1, false)], Answer::Yes);
    assert_eq!(
        person.machine().question(),
        Some(Question::SwitchAutonomous)
    );
    answers(&mut person, &[], Answer::Yes);
    says(&mut person, "the contact at line 27 is open");
    // As it should be, and the other way round when it is asked.
    answers(&mut person, &[], Answer::Yes);
    answers(&mut person, &[(0, true), (0, false)], Answer::Yes);
    answers(
        &mut person,
        &[(1, true), (1, false), (1, true)],
        Answer::Yes,
    );
    answers(&mut person, &[(1, false)], Answer::No);
    assert_eq!(person.machine().built().buttons, of(&both));
    assert_eq!(person.machine().step(), Step::Finish);
    // Back brings the buttons back that held before, which were none.
    person.say(Answer::Back);
    person.wait(Duration::from_millis(500));
    assert_eq!(person.machine().built().buttons, Buttons::default());
    assert_eq!(person.machine().step(), Step::Buttons);
}

#[test]
fn a_robot_without_buttons_has_the_step_skipped_and_says_so() {
    let mut person = at_the_buttons(ButtonsBuild::default());
    person.say(Answer::No);
    person.wait(Duration::from_millis(500));
    assert_eq!(person.machine().step(), Step::Finish);
    let said = person.said.last().expect("a sentence");
    assert_eq!(said, "the robot has no buttons of its own");

    // Its machine has no lines: nobody is asked anything.
    let mut person = at_the_buttons(ButtonsBuild::default());
    let none = BridgeAnswer {
        button_lines: ButtonLines::Absent.into(),
        ..BridgeAnswer::default()
    };
    let now = person.whole.moment();
    person.machine().lines(now, Some(&none));
    person.wait(Duration::from_millis(500));
    assert_eq!(person.machine().step(), Step::Finish);
    let said = person.said.last().expect("a sentence");
    assert!(said.contains("no lines for buttons"), "{said}");
}

#[test]
fn nothing_that_is_pressed_while_it_is_asked_changes_the_mode_and_a_stop_is_possible() {
    let mut person = at_the_buttons(ButtonsBuild {
        reset: Some(contact(17, Level::Low)),
        mode: Some((contact(27, Level::Low), SwitchKind::Press)),
    });
    let whole = &mut person.whole;
    assert!(whole.bridge.is_listened_to());
    let now = whole.moment();
    for touch in [
        Touch::Toggled,
        Touch::Reset,
        Touch::Switched(Mode::Autonomous),
    ] {
        assert_eq!(whole.bridge.touch(now, (touch, now.ns), true, None), None);
    }
    assert_eq!(whole.bridge.mode(), Mode::Manual);
    person.stop();
    person.wait(Duration::from_millis(300));
    assert!(person.whole.bridge.is_stopped());
    // The process that asks is dead: soon the buttons count again.
    person.whole.wizard = None;
    let end = person.whole.now + Duration::from_millis(5_200);
    while person.whole.now < end {
        let _ = person.whole.turn();
    }
    let whole = &mut person.whole;
    let now = whole.moment();
    let told = whole
        .bridge
        .touch(now, (Touch::Toggled, now.ns), true, None);
    assert_eq!(told, Some(InputKind::SwitchedToAutonomous));
}
