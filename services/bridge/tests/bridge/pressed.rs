//! The buttons through the whole bridge: contacts move at the edge of the service, and the bus
//! shows what came of it.

use std::io;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use lager_bridge::buttons::{BETWEEN_PRESSES, ButtonsConfig, Gpio, Lines, Movement, Survey};
use lager_home::Clock;
use lager_orders::{Contact, Level, Levels, Mode, SwitchKind};
use lager_ports::{Cause, Publisher};
use lager_stop::StopWord;
use lager_topics::{
    Ask, BridgeAnswer, ButtonLines, Health, Input, InputKind, LinkHealth, LogThought, NavStatus,
    NavigatorStatus, OperatorInput, Outcome, Phase, Refusal, Role, StopCause, ThoughtKind,
};

use crate::harness::{
    Bridge, FORWARD, Robot, Seen, SensorBoard, SteeringBoard, operator, wait_until,
};

const RESET: u8 = 5;
const SWITCH: u8 = 6;

fn contact(line: u8) -> Contact {
    let closed = Level::Low;
    Contact { line, closed }
}

/// Contacts that a test moves. A clone is the same ones.
#[derive(Clone, Default)]
struct Contacts(Arc<(Mutex<State>, Condvar)>);

#[derive(Default)]
struct State {
    /// The lines whose contacts are closed.
    closed: Vec<u8>,
    /// What has moved and was not told.
    moved: Vec<Movement>,
    /// The chip is gone.
    is_away: bool,
    /// How often the lines were asked for.
    opened: u32,
}

impl Contacts {
    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.0.0.lock().expect("no panic"));
        self.0.1.notify_all();
    }

    /// Closes or opens the contact at a line, `ago` ns before now.
    fn moves_late(&self, line: u8, is_closed: bool, ago: u64) {
        self.change(|state| {
            state.closed.retain(|closed| *closed != line);
            state.closed.extend(is_closed.then_some(line));
            state.moved.push(Movement {
                line,
                is_closed,
                at_ns: Clock::monotonic_ns() - ago,
            });
        });
    }

    fn moves(&self, line: u8, is_closed: bool) {
        self.moves_late(line, is_closed, 0);
    }

    fn opened(&self) -> u32 {
        self.0.0.lock().expect("no panic").opened
    }

    fn open_them(&self) -> io::Result<Box<dyn Lines>> {
        let mut state = self.0.0.lock().expect("no panic");
        state.opened += 1;
        // What a chip has told nobody is forgotten.
        state.moved.clear();
        match state.is_away {
            true => Err(io::ErrorKind::NotFound.into()),
            false => Ok(Box::new(self.clone())),
        }
    }
}

impl Gpio for Contacts {
    fn open(&self, _: &ButtonsConfig) -> io::Result<Box<dyn Lines + '_>> {
        self.open_them()
    }

    fn survey(&self) -> io::Result<Box<dyn Survey + '_>> {
        match self.0.0.lock().expect("no panic").is_away {
            true => Err(io::ErrorKind::NotFound.into()),
            false => Ok(Box::new(self.clone())),
        }
    }
}

impl Survey for Contacts {
    fn levels(&mut self) -> io::Result<Levels> {
        let mut levels = Levels::default();
        for line in &self.0.0.lock().expect("no panic").closed {
            levels.set(*line, Some(Level::Low));
        }
        Ok(levels)
    }

    fn chip(&self) -> u8 {
        2
    }
}

impl Lines for Contacts {
    fn is_closed(&self, line: u8) -> io::Result<bool> {
        Ok(self.0.0.lock().expect("no panic").closed.contains(&line))
    }

    fn movement(&self, patience: Duration) -> io::Result<Option<Movement>> {
        let (state, changed) = &*self.0;
        let state = state.lock().expect("no panic");
        let nothing = |state: &mut State| state.moved.is_empty() && !state.is_away;
        let waited = changed.wait_timeout_while(state, patience, nothing);
        let mut state = waited.expect("no panic").0;
        if state.is_away {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        Ok((!state.moved.is_empty()).then(|| state.moved.remove(0)))
    }
}

/// A robot with both buttons.
struct Scene {
    robot: Robot,
    contacts: Contacts,
    inputs: Seen<OperatorInput>,
}

impl Scene {
    /// Its boards run, and no bridge yet.
    fn new() -> Self {
        let mut robot = Robot::with(SensorBoard::new(), SteeringBoard::new());
        robot.bridge_config.buttons = Some(ButtonsConfig {
            chip: "/dev/none".into(),
            reset: Some(contact(RESET)),
            switch: Some(contact(SWITCH)),
            switch_kind: SwitchKind::Position,
            reset_starts: true,
            debounce: Duration::from_millis(20),
        });
        let inputs = Seen::new(&robot.isolation.open(Role::Observer));
        Self {
            robot,
            contacts: Contacts::default(),
            inputs,
        }
    }

    fn start(&mut self) {
        self.start_bridge();
        self.robot.wait_until_up();
    }

    fn start_bridge(&mut self) {
        let contacts = Box::new(self.contacts.clone());
        let config = self.robot.bridge_config.clone();
        let bridge = Bridge::start_with(&self.robot.isolation, config, contacts);
        self.robot.bridge = Some(bridge);
    }

    fn mode(&mut self, mode: Mode) -> Health {
        let hands = &mut self.robot.hands;
        hands.wait_for_health("the mode follows the switch", |health| health.mode == mode)
    }

    /// Waits for the next thing that the bridge tells of its buttons.
    fn told(&mut self) -> Option<InputKind> {
        let mut told: Vec<Input> = Vec::new();
        wait_until("the bridge tells of a button", || {
            told.extend(self.inputs.drain());
            !told.is_empty()
        });
        assert_eq!(told.len(), 1, "{told:?}");
        told[0].kind.get()
    }
}

#[test]
fn the_switch_sets_the_mode_and_the_reset_button_tells_logic() {
    let mut scene = Scene::new();
    scene.contacts.moves(SWITCH, true);
    scene.start();
    scene.mode(Mode::Autonomous);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));

    // A person may not drive, and may after the switch has been moved.
    let order = operator(7, FORWARD);
    scene
        .robot
        .hands
        .give_until(order, "it is refused", |hands| {
            let refused =
                |health: Health| health.refused_id == 7 && health.refusal == Refusal::NotInCharge;
            hands.health.look().is_some_and(refused)
        });
    scene.contacts.moves(SWITCH, false);
    scene.mode(Mode::Manual);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    let order = operator(8, FORWARD);
    scene
        .robot
        .hands
        .give_until(order, "the wheels turn", |hands| {
            hands.state.look().is_some_and(|state| state.left_duty > 0)
        });

    // Its movement back takes the wheel from a person who goes on ordering.
    scene.contacts.moves(SWITCH, true);
    scene
        .robot
        .hands
        .give_until(order, "the wheels stand", |hands| {
            hands.state.look().is_some_and(|state| state.left_duty == 0)
        });
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));

    // A press is told once: neither when it ends, nor when it is a second old.
    scene.contacts.moves(RESET, true);
    assert_eq!(scene.told(), Some(InputKind::ResetPressed));
    scene.contacts.moves(RESET, false);
    scene.contacts.moves_late(RESET, true, 1_000_000_000);
    scene.contacts.moves(SWITCH, false);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
}

#[test]
fn a_bridge_that_goes_on_keeps_its_mode_until_the_switch_is_moved() {
    let mut scene = Scene::new();
    scene.contacts.moves(SWITCH, true);
    scene.start();
    scene.mode(Mode::Autonomous);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));
    // Somebody has chosen another mode than the switch shows.
    let supervisor = scene.robot.isolation.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<LinkHealth>().expect("a keeper");
    scene.robot.hands.set_mode(Mode::Manual);
    wait_until("the keeper has it", || {
        keeper.remember().expect("readable");
        keeper
            .value()
            .is_some_and(|(health, _)| health.mode == Mode::Manual)
    });
    scene.robot.bridge.take().expect("it runs").stop();
    let before = scene.robot.hands.health.look().expect("it was told");
    keeper.remember().expect("readable");
    keeper.hand_over().expect("writable");
    scene.robot.bridge_config.resume = true;
    scene.start_bridge();
    wait_until("both boards are up again", || {
        // A late joiner gets the kept value at the keeper's next tick.
        keeper.remember().expect("readable");
        let health = scene.robot.hands.health.look();
        health.is_some_and(|health| {
            health.sensor.epoch > before.sensor.epoch
                && health.sensor.up == 1
                && health.steering.up == 1
        })
    });
    let health = scene.mode(Mode::Manual);
    assert_eq!((health.stopped, health.mode_chosen), (0, 1), "it goes on");
    assert!(scene.inputs.drain().is_empty(), "nobody has moved it");
    scene.contacts.moves(SWITCH, false);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    scene.contacts.moves(SWITCH, true);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));
    scene.mode(Mode::Autonomous);
}

#[test]
fn a_switch_that_was_moved_while_its_chip_was_away_counts_when_that_is_back() {
    let mut scene = Scene::new();
    scene.start();
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    scene.contacts.change(|state| state.is_away = true);
    let opened = scene.contacts.opened();
    wait_until("the chip is tried again", || {
        scene.contacts.opened() > opened
    });
    assert!(scene.inputs.drain().is_empty());
    scene.contacts.change(|state| {
        state.closed = vec![SWITCH];
        state.is_away = false;
    });
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));
    scene.mode(Mode::Autonomous);
}

#[test]
fn a_mode_button_toggles_and_one_that_is_held_at_the_start_changes_nothing() {
    let mut scene = Scene::new();
    let buttons = scene.robot.bridge_config.buttons.as_mut();
    buttons.expect("buttons").switch_kind = SwitchKind::Press;
    scene.contacts.moves(SWITCH, true);
    scene.start();
    // It is let go, and somebody has set no mode.
    scene.contacts.moves(SWITCH, false);
    let press = |scene: &mut Scene| {
        // Two presses are never so near to each other.
        std::thread::sleep(Duration::from_nanos(BETWEEN_PRESSES) * 2);
        scene.contacts.moves(SWITCH, true);
        scene.contacts.moves(SWITCH, false);
        // The contact bounces.
        scene.contacts.moves(SWITCH, true);
        scene.contacts.moves(SWITCH, false);
        scene.told()
    };
    for (mode, told) in [
        (Mode::Autonomous, InputKind::SwitchedToAutonomous),
        (Mode::Manual, InputKind::SwitchedToManual),
        (Mode::Autonomous, InputKind::SwitchedToAutonomous),
    ] {
        assert_eq!(press(&mut scene), Some(told));
        scene.mode(mode);
    }
    assert!(scene.inputs.drain().is_empty());
}

/// Logic, as the bridge sees it, and what people read.
struct Around {
    status: Publisher<NavStatus>,
    thoughts: Seen<LogThought>,
}

impl Around {
    fn new(scene: &Scene) -> Self {
        Self {
            status: scene
                .robot
                .isolation
                .open(Role::Logic)
                .publisher()
                .expect("a port"),
            thoughts: Seen::new(&scene.robot.isolation.open(Role::Observer)),
        }
    }

    /// Presses reset while logic says whether it stands on the delivery node. Returns what people
    /// and logic are told.
    fn press(&mut self, scene: &mut Scene, at_start: u8) -> (Option<ThoughtKind>, InputKind) {
        std::thread::sleep(Duration::from_nanos(BETWEEN_PRESSES) * 2);
        let status = NavigatorStatus {
            phase: Phase::WaitingForOrder.into(),
            at_start,
            ..NavigatorStatus::default()
        };
        self.status.send(Cause::OWN, status).expect("a reader");
        scene.contacts.moves(RESET, true);
        scene.contacts.moves(RESET, false);
        let told = scene.told().expect("a known kind");
        let thought = self.thoughts.drain().pop();
        (thought.and_then(|thought| thought.kind.get()), told)
    }
}

#[test]
fn reset_at_the_delivery_node_ends_the_stop_of_a_fresh_start_and_no_other() {
    let mut scene = Scene::new();
    let word = scene.robot.hands.stop_word.clone();
    let start = || StopWord::set(&word, Role::Supervisor, StopCause::FreshStart);
    start().expect("a stop");
    scene.start();
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    let mut around = Around::new(&scene);
    let stays = |scene: &Scene| assert!(scene.robot.hands.stop_told().stop().is_some());

    let elsewhere = around.press(&mut scene, 0);
    assert_eq!(
        elsewhere,
        (Some(ThoughtKind::ResetElsewhere), InputKind::ResetPressed)
    );
    stays(&scene);
    let started = around.press(&mut scene, 1);
    assert_eq!(
        started,
        (Some(ThoughtKind::StartedByReset), InputKind::StartPressed)
    );
    let hands = &mut scene.robot.hands;
    hands.wait_for_health("the stop is over", |health| health.stopped == 0);
    assert_eq!(hands.stop_told().stop(), None);

    // A person stops the robot after the fresh start: that one stays.
    start().expect("a stop");
    hands.stop();
    hands.wait_for_health("the person's stop", |health| {
        health.stopped != 0 && health.stop_cause == StopCause::Ordered
    });
    let ordered = around.press(&mut scene, 1);
    assert_eq!(
        ordered,
        (Some(ThoughtKind::ResetKeepsStop), InputKind::ResetPressed)
    );
    stays(&scene);
}

/// Listens until the lines have been read, and returns the answer.
fn listens(scene: &Scene) -> BridgeAnswer {
    let mut answer = BridgeAnswer::default();
    wait_until("the lines are read", || {
        answer = scene.robot.hands.ask(Ask::listen());
        assert_eq!(answer.outcome, Outcome::Done);
        answer.button_lines != ButtonLines::Unread
    });
    answer
}

#[test]
fn whoever_finds_out_how_the_buttons_are_connected_sees_their_lines_and_they_do_nothing() {
    let mut scene = Scene::new();
    scene.start();
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    let answer = listens(&scene);
    assert_eq!(
        (answer.button_lines, answer.button_chip),
        (ButtonLines::Read.into(), 2)
    );
    assert_eq!(answer.levels(), Levels::default());
    scene.contacts.moves(SWITCH, true);
    scene.contacts.moves(RESET, true);
    wait_until("the lines show it", || {
        let lines = listens(&scene).levels();
        lines.low == 1 << SWITCH | 1 << RESET && lines.high == 0
    });
    // A stop needs no button.
    scene.robot.hands.stop();
    scene
        .robot
        .hands
        .wait_for_health("the stop", |health| health.stopped != 0);
    assert!(scene.inputs.drain().is_empty());

    // He dies. Where the switch stands now is where it stood; its next movement counts.
    let opened = scene.contacts.opened();
    wait_until("the buttons are watched again", || {
        scene.contacts.opened() > opened
    });
    // Then their positions are read.
    std::thread::sleep(Duration::from_nanos(BETWEEN_PRESSES));
    scene.contacts.moves(RESET, false);
    scene.contacts.moves(SWITCH, false);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToManual));
    scene.contacts.moves(SWITCH, true);
    assert_eq!(scene.told(), Some(InputKind::SwitchedToAutonomous));
}

#[test]
fn a_robot_without_lines_for_buttons_says_so() {
    let mut scene = Scene::new();
    scene.robot.bridge_config.buttons = None;
    scene.contacts.change(|state| state.is_away = true);
    scene.start();
    assert_eq!(listens(&scene).button_lines, ButtonLines::Absent);
}
