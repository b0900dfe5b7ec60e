//! The emulator as a process: real ptys, the clock page, truth lines, an end and a restart.

#[path = "../../../tests/rig/src/host.rs"]
#[allow(
    unreachable_pub,
    reason = "it is a part of the other workspace's crate `lager-rig`"
)]
mod host;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use lager_plant::{Report, Snapshot};
use lager_wire::{Callsign, Payload, ResetCause, SteerCommand, WheelCommand};
use rustix::process::{Pid, Signal, kill_process};

use host::Host;

/// A test fails after this time, so that it cannot hang.
const WATCHDOG: Duration = Duration::from_secs(120);

/// A folder for one test.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("lager-emulator-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).expect("there is room for a folder");
        Self(folder)
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn start(&self, resume: Option<&str>) -> Emulator {
        let images = std::env::var_os("LAGER_IMAGES").map_or_else(
            || Path::new(env!("CARGO_MANIFEST_DIR")).join("../avr/target/images"),
            PathBuf::from,
        );
        let mut command = Command::new(env!("CARGO_BIN_EXE_lager-emulator"));
        command
            .arg("--sensor-elf")
            .arg(images.join("sensor.elf"))
            .arg("--steering-elf")
            .arg(images.join("steering.elf"))
            .arg("--sensor-link")
            .arg(self.at("sensor"))
            .arg("--steering-link")
            .arg(self.at("steering"))
            .arg("--clock")
            .arg(self.at("clock"))
            .arg("--truth")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        if resume.is_some() {
            command.arg("--resume");
        }
        let mut child = command.spawn().expect("it is built");
        let mut stdin = child.stdin.take().expect("it is piped");
        if let Some(line) = resume {
            stdin.write_all(line.as_bytes()).expect("it reads");
        }
        drop(stdin);
        let truth = BufReader::new(child.stdout.take().expect("it is piped"));
        Emulator { child, truth }
    }

    /// Chip time in the clock page.
    fn chip_ns(&self) -> u64 {
        let page = fs::read(self.at("clock")).expect("there is a page");
        u64::from_ne_bytes(page[24..32].try_into().expect("eight bytes"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

struct Emulator {
    child: Child,
    truth: BufReader<std::process::ChildStdout>,
}

impl Emulator {
    fn line(&mut self) -> String {
        let mut line = String::new();
        self.truth.read_line(&mut line).expect("it is text");
        line
    }

    fn truth(&mut self) -> Snapshot {
        truth(&self.line())
    }

    fn signal(&mut self, signal: Signal) -> Option<i32> {
        let id = Pid::from_child(&self.child);
        kill_process(id, signal).expect("it runs");
        self.child.wait().expect("it ends").code()
    }
}

/// The truth in a line.
fn truth(line: &str) -> Snapshot {
    match serde_json::from_str(line).expect("a line") {
        Report::Truth(truth) => truth,
        Report::Hand(_) => panic!("no hands have done anything: {line}"),
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Answers the board until a packet comes that `wanted` accepts.
fn until(board: &mut Host, wanted: impl Fn(&Payload) -> bool) {
    let (start, mut came) = (Instant::now(), false);
    while !came {
        assert!(start.elapsed() < WATCHDOG, "it never comes");
        let answered = board.answer(|payload| came |= wanted(&payload));
        answered.expect("the port takes it");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn port(path: &Path) -> Host {
    Host::open(path, WATCHDOG).expect("a port")
}

#[test]
fn the_boards_answer_on_their_ports_and_drive_on_command() {
    let place = Folder::new();
    let mut emulator = place.start(None);
    let mut steering = port(&place.at("steering"));
    until(&mut steering, |payload| {
        matches!(payload, Payload::SteerData(_))
    });
    assert_eq!(steering.link.callsign(), Some(Callsign::Steering));
    assert_eq!(steering.reset, Some(ResetCause::PowerOn));
    let mut sensor = port(&place.at("sensor"));
    until(&mut sensor, |payload| matches!(payload, Payload::Line(_)));

    let before = emulator.truth();
    assert_eq!(before.duties, [0, 0]);
    let code = lager_wire::Command::Wheel(WheelCommand::ManualForward).code();
    let command = Payload::SteerCommand(SteerCommand { code, seq: 1 });
    let start = Instant::now();
    let mut ordered = start;
    let mut order = || {
        assert!(steering.link.is_up());
        steering.send(command).expect("the port takes it");
    };
    order();
    loop {
        let truth = emulator.truth();
        // The board corrects for the battery, so the driver's duty is not exactly the standard one.
        if truth.duties[0] > 60 && truth.world.pose.x > before.world.pose.x + 1.0 {
            break;
        }
        if ordered.elapsed() > Duration::from_millis(20) {
            ordered = Instant::now();
            order();
        }
        assert!(start.elapsed() < WATCHDOG, "it never moves");
    }
    // The test does not renew the command: the steering board stops by itself, in chip time.
    while emulator.truth().duties[0] != 0 {}

    let first = place.chip_ns();
    let truth = emulator.truth();
    while place.chip_ns() <= first {
        assert!(start.elapsed() < WATCHDOG, "the clock stands");
    }
    assert!(truth.world.time > before.world.time);
    assert_eq!(emulator.signal(Signal::TERM), Some(0));
    assert!(!place.at("steering").is_symlink(), "the links are gone");
    assert_eq!(
        fs::read(place.at("clock")).expect("it stays")[48..56],
        [0; 8]
    );
}

#[test]
fn a_killed_emulator_goes_on_where_it_was() {
    let place = Folder::new();
    let mut emulator = place.start(None);
    let mut line = String::new();
    let start = Instant::now();
    while place.at("clock").metadata().is_err() || place.chip_ns() < 100_000_000 {
        line = emulator.line();
        assert!(start.elapsed() < WATCHDOG, "the clock stands");
    }
    emulator.signal(Signal::KILL);
    let (kept, clock) = (truth(&line).world, place.chip_ns());

    let line = serde_json::to_string(&kept).expect("JSON") + "\n";
    let mut emulator = place.start(Some(&line));
    let mut steering = port(&place.at("steering"));
    let first = emulator.truth().world;
    assert!(first.time >= kept.time);
    assert!((first.pose.x - kept.pose.x).abs() < 1.0);
    assert_eq!(first.goods, kept.goods);
    assert!(place.chip_ns() >= clock, "the clock never goes back");
    until(&mut steering, |payload| {
        matches!(payload, Payload::SteerData(_))
    });
    assert_eq!(emulator.signal(Signal::INT), Some(0));
}

#[test]
fn what_is_wrong_is_said_in_a_sentence() {
    let place = Folder::new();
    let run = |sensor: &Path, warehouse: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_lager-emulator"))
            .args(["--steering-elf", "/dev/null", "--warehouse", warehouse])
            .arg("--sensor-elf")
            .arg(sensor)
            .arg("--sensor-link")
            .arg(place.at("sensor"))
            .arg("--steering-link")
            .arg(place.at("steering"))
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).expect("it is text")
    };
    let unknown = run(&place.at("nothing.elf"), "smal");
    assert!(unknown.contains("small, curved, large"), "{unknown}");
    let missing = run(&place.at("nothing.elf"), "small");
    assert!(missing.contains("firmware/avr/build"), "{missing}");
    fs::write(place.at("hex"), ":10000000").expect("there is room");
    let hex = run(&place.at("hex"), "small");
    assert!(hex.contains("not an ELF file for an AVR"), "{hex}");
}
