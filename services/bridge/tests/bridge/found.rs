//! Boards whose ports nobody has named, among devices of other kinds.

use std::fs::{File, create_dir, read_to_string};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use lager_bridge::Ports;
use lager_bridge::serial::SerialPort;
use lager_bridge::serial::find::{Device, NotFound, Said, both, listen, take};
use lager_home::{Clock, ClockSource};
use lager_wire::Callsign;
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};

use crate::harness::{
    Isolation, OriginalSensor, OriginalSteering, Peer, Plugged, Pty, Robot, SPEED, SensorBoard,
    SteeringBoard,
};

const BAUD: u32 = 500_000;

/// A device of another kind: it says `text` ten times a second, and counts what it is told.
struct Stranger {
    text: &'static [u8],
    due_us: u32,
    taken: usize,
}

impl Stranger {
    const fn new(text: &'static [u8]) -> Self {
        Self {
            text,
            due_us: 0,
            taken: 0,
        }
    }
}

impl Peer for Stranger {
    fn take(&mut self, _byte: u8, _now_us: u32) {
        self.taken += 1;
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        if now_us >= self.due_us {
            self.due_us = now_us + 100_000;
            out.extend(self.text);
        }
    }
}

const POSITION: &[u8] = b"$GPGGA,123519,5824.6,N,01534.1,E,1,08,0.9,54.4,M,46.9,M,,*47\r\n";

/// The folder of devices of this machine.
fn devices(isolation: &Isolation) -> PathBuf {
    let folder = isolation.folder().join("dev");
    create_dir(&folder).unwrap();
    folder
}

fn plugged<P: Peer>(folder: &Path, name: &str, peer: P) -> Plugged<P> {
    Plugged::new(peer, folder.join(name), SPEED)
}

fn heard(folder: &Path) -> Vec<Device> {
    let clock = Clock::new(&ClockSource::new(SPEED, None).unwrap());
    listen(folder, BAUD, &clock, || true)
}

fn settings(port: &File) -> String {
    format!("{:?}", tcgetattr(port).unwrap())
}

/// Boards at devices of these names, and a bridge that does not know them.
fn robot<A: Peer, B: Peer>(sensor: A, steering: B, names: [&str; 2]) -> (Robot<A, B>, PathBuf) {
    let mut robot = Robot::with(sensor, steering);
    let folder = devices(&robot.isolation);
    robot.sensor.unplug();
    robot.sensor.plug_at(&folder.join(names[0]));
    robot.steering.unplug();
    robot.steering.plug_at(&folder.join(names[1]));
    robot.bridge_config.ports = Ports::Found(folder.clone());
    (robot, folder)
}

#[test]
fn boards_are_found_in_any_order_and_no_other_device_is_told_anything() {
    for names in [["ttyUSB3", "ttyACM1"], ["ttyACM1", "ttyUSB3"]] {
        let (mut robot, folder) = robot(SensorBoard::new(), SteeringBoard::new(), names);
        let receiver = plugged(&folder, "ttyUSB0", Stranger::new(POSITION));
        let modem = plugged(&folder, "ttyACM0", Stranger::new(b""));
        // A device of a kind that is not looked at.
        let console = plugged(&folder, "ttyS0", SteeringBoard::new());
        robot.start();
        robot.wait_until_up();
        for stranger in [&receiver, &modem] {
            assert_eq!(stranger.with(|stranger| stranger.taken), 0);
        }
        assert!(!console.with(|board| board.link.is_up()));
    }
}

#[test]
fn original_boards_are_found_before_and_after_their_handshake() {
    let (mut new, _) = robot(
        OriginalSensor::new(),
        OriginalSteering::new(),
        ["ttyUSB1", "ttyUSB0"],
    );
    new.start();
    new.wait_until_up();
    let (mut running, _) = robot(
        OriginalSensor::new(),
        OriginalSteering::running(),
        ["ttyUSB0", "ttyUSB1"],
    );
    running.start();
    running.wait_until_up();
}

#[test]
fn a_board_that_is_plugged_in_later_or_elsewhere_is_found() {
    let (mut robot, folder) = robot(
        SensorBoard::new(),
        SteeringBoard::new(),
        ["ttyUSB0", "ttyUSB1"],
    );
    robot.steering.unplug();
    robot.start();
    let is_up = |health: &lager_topics::Health| health.sensor.up == 1 && health.steering.up == 0;
    robot.hands.wait_for_health("one is up", is_up);
    robot.steering.plug_at(&folder.join("ttyACM0"));
    robot.wait_until_up();
    robot.steering.unplug();
    robot.hands.wait_for_health("it is gone", is_up);
    robot.steering.plug_at(&folder.join("ttyUSB9"));
    robot.wait_until_up();
}

#[test]
fn a_board_whose_adapter_stays_without_it_is_found_at_another() {
    let (mut robot, folder) = robot(
        SensorBoard::new(),
        SteeringBoard::new(),
        ["ttyUSB0", "ttyUSB1"],
    );
    robot.start();
    robot.wait_until_up();
    robot.steering.freeze(true);
    let moved = plugged(&folder, "ttyUSB2", SteeringBoard::new());
    robot
        .hands
        .wait_for_health("it is silent", |health| health.steering.up == 0);
    robot.wait_until_up();
    assert!(moved.with(|board| board.link.is_up()));
}

#[test]
fn of_two_boards_that_say_the_same_neither_is_taken() {
    let isolation = Isolation::new();
    let folder = devices(&isolation);
    let _ours = plugged(&folder, "ttyUSB0", SteeringBoard::new());
    let _theirs = plugged(&folder, "ttyUSB1", SteeringBoard::new());
    let _sensor = plugged(&folder, "ttyUSB2", SensorBoard::new());
    let mut devices = heard(&folder);
    let refused = take(&folder, &mut devices, Callsign::Steering).unwrap_err();
    assert!(matches!(refused, NotFound::Several { .. }), "{refused}");
    let said = refused.to_string();
    for word in ["ttyUSB0 and ", "ttyUSB1", "steering board", "[serial]"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let sensor = take(&folder, &mut devices, Callsign::Sensor).unwrap();
    assert_eq!(sensor.path(), folder.join("ttyUSB2"));
}

/// A program that has a port open.
fn holder(pty: &Pty) -> Child {
    let program = Command::new("sleep")
        .arg("600")
        .stdin(Stdio::from(pty.slave()))
        .spawn();
    let program = program.unwrap();
    // For a moment a new program still has the name of the thread that started it.
    let name = format!("/proc/{}/comm", program.id());
    while read_to_string(&name).unwrap() != "sleep\n" {
        std::thread::yield_now();
    }
    program
}

#[test]
fn a_port_that_another_program_has_is_not_opened_and_the_program_is_named() {
    let isolation = Isolation::new();
    let folder = devices(&isolation);
    let pty = Pty::new(&folder.join("ttyUSB0"));
    let port = pty.slave();
    let mut program = holder(&pty);
    let before = settings(&port);
    let mut devices = heard(&folder);
    assert!(matches!(devices[0].said, Said::Held(_)), "{devices:?}");
    assert_eq!(settings(&port), before);
    let refused = take(&folder, &mut devices, Callsign::Sensor).unwrap_err();
    program.kill().unwrap();
    program.wait().unwrap();
    let said = refused.to_string();
    let named = format!("process {} (sleep) has ", program.id());
    assert!(said.contains(&named) && said.contains("kill"), "{said}");
    assert!(said.starts_with("no sensor board"), "{said}");
}

#[test]
fn another_device_has_its_settings_back_and_its_port_is_free() {
    let isolation = Isolation::new();
    let folder = devices(&isolation);
    let pty = Pty::new(&folder.join("ttyUSB0"));
    let port = pty.slave();
    let mut former: Termios = tcgetattr(&port).unwrap();
    former.set_speed(9_600).unwrap();
    tcsetattr(&port, OptionalActions::Now, &former).unwrap();
    let before = settings(&port);
    let devices = heard(&folder);
    assert!(matches!(devices[0].said, Said::Nothing), "{devices:?}");
    assert_eq!(settings(&port), before);
    SerialPort::open(&folder.join("ttyUSB0"), BAUD).unwrap();
}

#[test]
fn what_is_absent_is_said_with_what_to_do() {
    let isolation = Isolation::new();
    let folder = devices(&isolation);
    let refused = take(&folder, &mut heard(&folder), Callsign::Sensor).unwrap_err();
    assert!(matches!(refused, NotFound::NoDevice { .. }), "{refused}");
    let said = refused.to_string();
    assert!(
        said.contains("plug in") && said.contains("ttyUSB*"),
        "{said}"
    );

    let _receiver = plugged(&folder, "ttyUSB0", Stranger::new(POSITION));
    let _modem = plugged(&folder, "ttyUSB1", Stranger::new(b""));
    let _board = plugged(&folder, "ttyUSB2", SteeringBoard::new());
    let said = take(&folder, &mut heard(&folder), Callsign::Sensor)
        .unwrap_err()
        .to_string();
    for words in [
        "no sensor board speaks",
        "ttyUSB0 speaks, but not as a board does",
        "ttyUSB1 says nothing",
        "ttyUSB2 has the steering board",
        "look at its power",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// A board in its bootloader is silent; whoever works on boards may ask it.
#[test]
fn a_silent_device_counts_as_the_missing_board_only_if_it_can_be_no_other() {
    let isolation = Isolation::new();
    let folder = devices(&isolation);
    let _board = plugged(&folder, "ttyUSB0", SteeringBoard::new());
    let _silent = plugged(&folder, "ttyUSB1", Stranger::new(b""));
    let _receiver = plugged(&folder, "ttyUSB2", Stranger::new(POSITION));
    let found = both(&folder, heard(&folder));
    assert_eq!(
        found,
        [Ok(folder.join("ttyUSB1")), Ok(folder.join("ttyUSB0"))]
    );

    let pty = Pty::new(&folder.join("ttyUSB3"));
    let mut program = holder(&pty);
    let [sensor, steering] = both(&folder, heard(&folder));
    program.kill().unwrap();
    program.wait().unwrap();
    assert!(matches!(sensor, Err(NotFound::Silent { .. })), "{sensor:?}");
    assert_eq!(steering, Ok(folder.join("ttyUSB0")));

    // Nobody has it any more, and it is silent as well.
    let [sensor, _] = both(&folder, heard(&folder));
    assert!(matches!(sensor, Err(NotFound::Silent { .. })), "{sensor:?}");
}
