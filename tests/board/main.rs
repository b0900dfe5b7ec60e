//! `lager board` and `lager doctor` with the boards' real images and bootloaders in emulated chips,
//! behind two ptys.

mod doctor;
mod flash;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use lager_loader::{Header, Image, crc_step};
use lager_pty::Port;
use lager_tests::{Domain, Running, in_tree, wait_for};
use lager_topics::{Health, LinkHealth, StopCause};
use lager_wire::{BUILD, ResetCause};
use rustix::process::Signal;

const IMAGES: &str = "firmware/avr/target/images";

/// Both boards with their bootloaders, and the configuration of their robot.
struct Boards {
    chips: Child,
    config: PathBuf,
    sensor: PathBuf,
    steering: PathBuf,
}

impl Boards {
    fn new(domain: &Domain) -> Self {
        let at = |name: &str| domain.folder().join(name);
        let image = |name: &str| in_tree(IMAGES).join(name);
        let (sensor, steering) = (at("ttyUSB1"), at("ttyUSB0"));
        let chips = Command::new(lager_tests::emulator())
            .arg("--sensor-elf")
            .arg(image("sensor.elf"))
            .arg("--steering-elf")
            .arg(image("steering.elf"))
            .arg("--sensor-loader")
            .arg(image("sensor-loader.elf"))
            .arg("--steering-loader")
            .arg(image("steering-loader.elf"))
            .arg("--sensor-link")
            .arg(&sensor)
            .arg("--steering-link")
            .arg(&steering)
            .arg("--clock")
            .arg(at("clock"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("the emulator starts");
        let config = at("lager.toml");
        // Nobody names the ports: the boards say who they are.
        let text = format!(
            "body = \"serial\"\n[serial]\ndevices = {:?}\n[chip]\nclock = {:?}\n",
            domain.folder(),
            at("clock")
        );
        fs::write(&config, text).expect("a file");
        // After power-on a board waits in its bootloader for half a second.
        wait_for("the boards' programs", || {
            let page = fs::read(at("clock")).ok()?;
            let chip_ns = u64::from_ne_bytes(page.get(24..32)?.try_into().ok()?);
            (chip_ns > 1_500_000_000).then_some(())
        });
        Self {
            chips,
            config,
            sensor,
            steering,
        }
    }

    fn command(&self, domain: &Domain, args: &[&str]) -> Command {
        let mut command = domain.lager(&["--config"]);
        // Where this program finds its images.
        command
            .arg(&self.config)
            .args(args)
            .current_dir(in_tree(""));
        command
    }

    fn run(&self, domain: &Domain, args: &[&str]) -> Output {
        self.command(domain, args).output().expect("lager starts")
    }

    fn start(&self, domain: &Domain, args: &[&str]) -> Running {
        domain.launch(self.command(domain, args))
    }
}

impl Drop for Boards {
    fn drop(&mut self) {
        let _ = self.chips.kill();
        let _ = self.chips.wait();
    }
}

fn image(board: &str) -> String {
    let path = in_tree(IMAGES).join(format!("{board}.hex"));
    path.to_str().expect("a name in UTF-8").to_owned()
}

/// The image of a board with pages more at its end, so that it is not whole before the last one. It
/// runs, too.
fn longer(domain: &Domain, board: &str) -> PathBuf {
    let hex = fs::read_to_string(image(board)).expect("an image");
    let mut bytes = Image::from_hex(&hex)
        .expect("a whole image")
        .bytes()
        .to_vec();
    bytes.extend([0xA5; 2_000]);
    let header = Header::AT as usize;
    let length = u32::try_from(bytes.len()).expect("it is short");
    bytes[header + 8..header + 12].copy_from_slice(&length.to_le_bytes());
    bytes[header + 12..header + 16].fill(0xFF);
    let crc = bytes
        .iter()
        .fold(u32::MAX, |crc, byte| crc_step(crc, *byte));
    bytes[header + 12..header + 16].copy_from_slice(&(!crc).to_le_bytes());
    let mut hex = String::new();
    for (place, data) in bytes.chunks(16).enumerate() {
        let [high, low] = u16::try_from(place * 16)
            .expect("below 64 KiB")
            .to_be_bytes();
        let record = [&[data.len() as u8, high, low, 0], data].concat();
        let sum = record.iter().fold(0u8, |sum, byte| sum.wrapping_sub(*byte));
        let digits = record
            .iter()
            .chain([&sum])
            .map(|byte| format!("{byte:02X}"));
        hex += &format!(":{}\n", digits.collect::<String>());
    }
    let path = domain.folder().join("longer.hex");
    fs::write(&path, hex + ":00000001FF\n").expect("a file");
    path
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a name in UTF-8")
}

/// What a command has printed; it has ended with this exit code.
fn told(output: &Output, code: i32) -> String {
    let said = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    let said = said.concat();
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

fn assert_says(said: &str, words: &[&str]) {
    for word in words {
        assert!(said.contains(word), "`{word}` is missing: {said}");
    }
}

#[test]
fn both_boards_get_their_images_and_an_update_that_broke_off_is_taken_up_again() {
    let domain = Domain::new();
    let boards = Boards::new(&domain);
    let build = format!("build {BUILD}");
    let runs = |board: &str, before: &str| {
        format!("{board} board: was {before}, runs {build} now, verified")
    };
    let said = told(&boards.run(&domain, &["board", "update"]), 0);
    assert_says(&said, &[&runs("sensor", &build), &runs("steering", &build)]);

    // Somebody kills it, and a second one that ran at the same time has left the boards alone. The
    // steering board is at the first port.
    let longer = longer(&domain, "steering");
    let begun = |signal| {
        let begun = boards.start(&domain, &["board", "update", "--image", text(&longer)]);
        wait_for("a part to be written", || {
            begun
                .output()
                .contains("steering board: 25 % written")
                .then_some(())
        });
        begun.signal(signal);
        begun
    };
    let first = begun(Signal::STOP);
    let second = told(&boards.run(&domain, &["board", "update"]), 4);
    assert_says(&second, &["another `lager board`", "process"]);
    first.signal(Signal::KILL);
    drop(first);
    // The board that was being written waits, whoever comes now.
    let sensor = image("sensor");
    let wrong = ["board", "update", "--image", &sensor, "--port"];
    let wrong = [&wrong[..], &[text(&boards.steering)]].concat();
    let said = told(&boards.run(&domain, &wrong), 1);
    let waits = "in its bootloader without a whole image";
    assert_says(
        &said,
        &[
            waits,
            "image of the sensor board",
            "the steering board is at this port",
        ],
    );
    let reset = ["board", "reset", "steering"];
    assert_says(
        &told(&boards.run(&domain, &reset), 1),
        &["`lager board update`"],
    );
    let said = told(&boards.run(&domain, &["board", "update"]), 0);
    assert_says(&said, &[&runs("sensor", &build), &runs("steering", waits)]);

    // Somebody ends it in order, and asks what is wrong.
    let mut first = begun(Signal::INT);
    assert_eq!(first.wait(), Some(130), "{}", first.log());
    assert_says(&first.log(), &["waits in its bootloader"]);
    let doctor = boards.run(&domain, &["doctor"]);
    let said = String::from_utf8_lossy(&doctor.stdout);
    assert_says(&said, &["BAD   steering board", "without a whole image"]);
    assert_says(&said, &["steering board: `lager board update`"]);
    let steering = image("steering");
    let one = ["board", "update", "--image", &steering];
    let said = told(&boards.run(&domain, &one), 0);
    assert_says(&said, &[&runs("steering", waits)]);
    assert!(!said.contains("sensor board: writes"), "{said}");
    drop(boards);
    domain.assert_clean();
}

#[test]
fn a_board_restarts_when_it_is_told_and_no_image_that_does_not_fit_touches_it() {
    let domain = Domain::new();
    let boards = Boards::new(&domain);
    let doctor = boards.run(&domain, &["doctor"]);
    let said = String::from_utf8_lossy(&doctor.stdout);
    let build = format!("build {BUILD} at {}", boards.sensor.display());
    assert_says(
        &said,
        &["ok    sensor board", &build, "tape under", "distance"],
    );
    // Nobody has said that this robot has a divider.
    let battery = "the battery is not measured, 8 of 8 servos answer";
    assert_says(&said, &["ok    steering board", battery]);
    // The servos are those of the description, and a joint may have one.
    let as_drawn = fs::read_to_string(&boards.config).expect("a file");
    let servos = "[arm.servos]\nbase = 21\nshoulder = 2\nelbow = [4, 22]\n";
    fs::write(&boards.config, as_drawn.clone() + servos).expect("a file");
    let doctor = boards.run(&domain, &["doctor"]);
    let silent = "servos 21 (base), 22 (elbow) do not answer";
    let said = String::from_utf8_lossy(&doctor.stdout);
    assert_says(&said, &[silent, "5 of 7 servos answer"]);
    fs::write(&boards.config, as_drawn).expect("a file");
    for board in ["sensor", "steering"] {
        let said = told(&boards.run(&domain, &["board", "reset", board]), 0);
        assert_says(&said, &[&format!("the {board} board"), "has started again"]);
    }
    let refused = |args: &[&str], words: &[&str]| {
        let args = [&["board"], args].concat();
        assert_says(&told(&boards.run(&domain, &args), 1), words);
    };
    let (sensor, steering) = (text(&boards.sensor), text(&boards.steering));
    refused(
        &["reset", "sensor", "--port", steering],
        &[
            "no sensor board was found",
            "the steering board is at this port",
        ],
    );
    for (image, port) in [("sensor", steering), ("steering", sensor)] {
        refused(
            &["update", "--image", &self::image(image), "--port", port],
            &["image of the", "nothing was written"],
        );
    }
    // One byte has another value; the file is that of the other board; a file ends too early.
    let copy = domain.folder().join("copy.hex");
    let hex = fs::read_to_string(image("sensor")).expect("an image");
    let damaged = hex.replacen(":10010000", ":10010100", 1);
    assert_ne!(damaged, hex);
    let half: String = hex
        .lines()
        .take(20)
        .map(|line| format!("{line}\n"))
        .collect();
    for (content, words) in [
        (damaged.as_str(), "its check value does not fit"),
        (&half, "cut off"),
        ("no image\n", "not one of an Intel hex file"),
    ] {
        fs::write(&copy, content).expect("a file");
        refused(&["update", "--image", text(&copy)], &[text(&copy), words]);
    }
    refused(&["update", "--image", "nowhere.hex"], &["nowhere.hex"]);
    let same = image("sensor");
    let both = ["board", "update", "--image", &same, "--image", &same];
    assert_says(&told(&boards.run(&domain, &both), 2), &["both images"]);
    drop(boards);
    domain.assert_clean();
}

/// Waits for the robot's state of its boards.
fn wait_for_boards(domain: &Domain, what: &str, holds: impl Fn(&Health) -> bool) -> Health {
    let bus = domain.observe("r1", 1.0);
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    wait_for(what, || {
        let latest = health.latest().expect("a readable topic")?;
        holds(&latest).then(|| *latest)
    })
}

fn are_up(health: &Health) -> bool {
    health.sensor.up == 1 && health.steering.up == 1
}

fn is_stopped_for_work(health: &Health) -> bool {
    health.stopped == 1 && health.stop_cause == StopCause::BoardWork
}

#[test]
fn a_robot_that_is_up_stands_while_a_board_is_worked_on_and_until_somebody_resumes() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless"]);
    let port = wait_for("the robot's ports", || {
        let port = domain.bus_folder().join("r1/sensor.tty");
        (up.service("bridge").is_some() && port.exists()).then_some(port)
    });
    wait_for_boards(&domain, "both boards", are_up);
    let reset = ["board", "reset", "sensor", "--port", text(&port)];
    let said = told(&domain.run(&reset), 0);
    assert_says(
        &said,
        &[
            "the robot `r1` is up: stopped",
            "the sensor board at",
            "has started again",
            "stands; `lager resume`",
        ],
    );
    let is_back = |health: &Health| are_up(health) && is_stopped_for_work(health);
    let health = wait_for_boards(&domain, "its boards again", is_back);
    assert_eq!(health.sensor.reset_cause, ResetCause::Ordered);
    domain.done(&["resume"]);
    wait_for_boards(&domain, "the robot to go on", |health| health.stopped == 0);
    // A simulated board has no bootloader. The robot has it again all the same.
    let image = image("sensor");
    let update = ["board", "update", "--image", &image, "--port", text(&port)];
    let said = told(&domain.run(&update), 1);
    assert_says(
        &said,
        &[
            "did not start its bootloader",
            "stands until `lager resume`",
        ],
    );
    wait_for_boards(&domain, "its boards again", is_back);
    domain.done(&["resume"]);
    // Whoever does not ask this robot gets nothing from it.
    let held = wait_for("the bridge to have its port", || {
        let output = domain.run(&[&["--name", "other"], &update[..]].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        said.contains("in use by another process").then_some(said)
    });
    assert_says(&held, &["(lager) has", "Ctrl-C where it runs"]);
    assert!(up.is_running(), "{}", up.log());
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    domain.assert_clean();
}

#[test]
fn a_robot_that_is_up_gets_new_images_and_whoever_is_killed_meanwhile_keeps_no_board() {
    let domain = Domain::new();
    let boards = Boards::new(&domain);
    let mut up = boards.start(&domain, &["up", "--headless"]);
    wait_for_boards(&domain, "both boards", are_up);
    let longer = longer(&domain, "steering");
    let begun = boards.start(&domain, &["board", "update", "--image", text(&longer)]);
    wait_for("a part to be written", || {
        begun
            .output()
            .contains("steering board: 25 % written")
            .then_some(())
    });
    begun.signal(Signal::STOP);
    let second = told(&boards.run(&domain, &["board", "update"]), 4);
    assert_says(&second, &["another `lager board`"]);
    // A bridge that comes meanwhile leaves the ports alone.
    let bridge = up.service("bridge").expect("a bridge");
    rustix::process::kill_process(lager_tests::pid(bridge), Signal::KILL).expect("a process");
    wait_for("the next bridge", || {
        up.service("bridge").filter(|next| *next != bridge)
    });
    let is_away = |health: &Health| {
        is_stopped_for_work(health) && health.sensor.up == 0 && health.steering.up == 0
    };
    wait_for_boards(&domain, "no board", is_away);
    begun.signal(Signal::KILL);
    drop(begun);
    // The sensor board was not touched; the steering board waits for the rest of its image.
    wait_for_boards(&domain, "the sensor board", |health| {
        is_stopped_for_work(health) && health.sensor.up == 1 && health.steering.up == 0
    });
    let said = told(&boards.run(&domain, &["board", "update"]), 0);
    assert_says(
        &said,
        &[
            &format!("sensor board: was build {BUILD}, runs build {BUILD} now, verified"),
            "steering board: was in its bootloader without a whole image, runs build",
            "stands; `lager resume`",
        ],
    );
    wait_for_boards(&domain, "both boards again", |health| {
        are_up(health) && is_stopped_for_work(health)
    });
    domain.done(&["resume"]);
    wait_for_boards(&domain, "the robot to go on", |health| health.stopped == 0);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    drop(boards);
    domain.assert_clean();
}

#[test]
fn a_port_without_a_board_is_named_and_a_simulated_robot_has_no_board() {
    let domain = Domain::among_others();
    let port = domain.folder().join("silent");
    let silent = Port::create(&port).expect("a pty");
    let image = image("sensor");
    let update =
        |more: &[&str]| domain.run(&[&["board", "update", "--image", &image], more].concat());
    let said = told(&update(&["--port", text(&port)]), 1);
    assert_says(&said, &[text(&port), "no board answers", "switched on"]);
    drop(silent);
    let said = told(&update(&["--port", text(&port)]), 1);
    assert_says(&said, &["there is no serial port", text(&port)]);
    assert_says(&told(&update(&[]), 2), &["is simulated", "--port"]);
    let same = ["--port", "/dev/null", "--port", "/dev/null"];
    assert_says(&told(&update(&same), 2), &["are the same port"]);
    domain.assert_clean();
}
