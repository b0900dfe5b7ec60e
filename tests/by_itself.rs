//! Tests that the robot never starts to move again by itself, and that no order moves it unseen:
//! with frozen processes, late requests, a cable that is cut towards the bridge, and a calendar that
//! jumps.

use std::fs::{self, File};
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use lager_home::Clock;
use lager_orders::Mode;
use lager_ports::Subscriber;
use lager_rig::{Watch, behind_ports};
use lager_tests::{Cable, Domain, Running, in_tree, is_stopped, pid, wait_for};
use lager_topics::{
    Health, Hold, LinkHealth, NavStatus, Origin, Phase, Refusal, SteeringState, TruthPose,
};
use rustix::process::{Signal, kill_process};

/// An observer of the robot.
struct DriveObserver {
    truth: Subscriber<TruthPose>,
    health: Subscriber<LinkHealth>,
    steering: Subscriber<SteeringState>,
}

impl DriveObserver {
    fn new(domain: &Domain) -> Self {
        let bus = domain.observe("r1", 1.0);
        Self {
            truth: bus.subscriber().expect("a topic"),
            health: bus.subscriber().expect("a topic"),
            steering: bus.subscriber().expect("a topic"),
        }
    }

    fn wait_for_health(&mut self, what: &str, wanted: impl Fn(&Health) -> bool) -> Health {
        wait_for(what, || {
            let health = self.health.latest().expect("readable")?;
            wanted(&health).then_some(*health)
        })
    }

    fn wait_to_stand(&mut self) {
        wait_for("the robot to stand", || self.moves().filter(|moves| !moves));
    }

    /// Whether the robot's wheels turn; `None` without a new sample of the world.
    fn moves(&mut self) -> Option<bool> {
        let truth = self.truth.latest().expect("readable")?;
        Some(truth.left_duty != 0 || truth.right_duty != 0)
    }

    /// Whether the board obeys an order that a person first gave after `began`; `None` without a
    /// new report. An order's id is the time when it was first given, in ms.
    fn obeys(&mut self, began: u64) -> Option<bool> {
        let report = self.steering.latest().expect("readable")?;
        let by_person = report.current_origin == Origin::Operator;
        let began = (began / 1_000_000) as u32;
        Some(by_person && report.current_id.wrapping_sub(began) < u32::MAX / 2)
    }

    /// For half a second, the robot stands in every sample of the world.
    fn assert_stands(&mut self) {
        let from = Clock::monotonic_ns();
        let mut seen = 0;
        while seen < 20 {
            let truth = wait_for("the world", || self.truth.latest().expect("readable"));
            if truth.stamp().publish_time_ns > from {
                assert_eq!(
                    (truth.left_duty, truth.right_duty),
                    (0, 0),
                    "the robot moves, by {:?}; {:?}",
                    self.steering.latest().expect("readable").as_deref(),
                    self.health.latest().expect("readable").as_deref(),
                );
                seen += 1;
            }
            drop(truth);
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Runs `lager` with `args` until it succeeds.
fn insist(domain: &Domain, args: &[&str]) {
    wait_for(&format!("{args:?}"), || {
        domain.run(args).status.success().then_some(())
    });
}

fn freeze(process: u32) {
    kill_process(pid(process), Signal::STOP).expect("a living process");
    wait_for("the process to stop", || is_stopped(process).then_some(()));
}

/// A simulated robot in manual mode, driven forward by hand.
fn driven_by_hand(domain: &Domain) -> (Running, DriveObserver, Running) {
    by_hand(domain, domain.start(&["up"]))
}

/// The same with a robot that was started.
fn by_hand(domain: &Domain, up: Running) -> (Running, DriveObserver, Running) {
    let mut watch = DriveObserver::new(domain);
    watch.wait_for_health("the steering board", |health| health.steering.up != 0);
    insist(domain, &["mode", "manual"]);
    let drive = driving(domain, &mut watch, &["drive", "forward"]);
    (up, watch, drive)
}

/// Starts a process that drives the robot, and waits until the robot moves by that process's order.
/// If others keep the process from its core for longer than its order lasts, it ends with a
/// sentence, and a new one is started.
fn driving(domain: &Domain, watch: &mut DriveObserver, drive: &[&str]) -> Running {
    let mut began = Clock::monotonic_ns();
    let mut driver = domain.start(drive);
    let mut obeyed = false;
    wait_for("the robot to drive", || {
        if !driver.is_running() {
            began = Clock::monotonic_ns();
            driver = domain.start(drive);
            obeyed = false;
        }
        obeyed |= watch.obeys(began) == Some(true);
        (watch.moves() == Some(true) && obeyed).then_some(())
    });
    driver
}

#[test]
fn a_frozen_drive_does_not_move_the_robot_again() {
    let domain = Domain::new();
    let (up, mut watch, mut drive) = driven_by_hand(&domain);
    freeze(drive.pid());
    watch.wait_to_stand();
    // Long enough for every copy of the order to expire.
    std::thread::sleep(Duration::from_millis(1_500));
    drive.signal(Signal::CONT);
    watch.assert_stands();
    assert_eq!(drive.wait(), Some(1), "{}", drive.log());
    let log = drive.log();
    assert!(
        log.contains("held up") || log.contains("cut short"),
        "no sentence about it: {log}"
    );
    insist(&domain, &["drive", "forward", "--seconds", "0.2"]);
    drop((up, watch, drive));
    domain.assert_clean();
}

#[test]
fn a_request_that_a_frozen_bridge_finds_later_changes_nothing() {
    let domain = Domain::new();
    let up = domain.start(&["up"]);
    let mut watch = DriveObserver::new(&domain);
    watch.wait_for_health("the steering board", |health| health.steering.up != 0);
    insist(&domain, &["mode", "manual"]);
    watch.wait_for_health("manual mode", |health| health.mode == Mode::Manual);
    let bridge = up.service("bridge").expect("a bridge");
    freeze(bridge);
    let refused = domain.run(&["mode", "autonomous"]);
    assert!(!refused.status.success());
    // A client's question disappears when the client ends. While the client is frozen too, the
    // question stays, and only its age tells the bridge that nobody waits for the answer.
    let mut asker = domain.start(&["mode", "autonomous"]);
    std::thread::sleep(Duration::from_millis(250));
    freeze(asker.pid());
    std::thread::sleep(Duration::from_millis(500));
    let from = Clock::monotonic_ns();
    kill_process(pid(bridge), Signal::CONT).expect("a living process");
    for _ in 0..5 {
        let health = wait_for("the bridge to go on", || {
            let health = watch.health.latest().expect("readable");
            health.filter(|health| health.stamp().publish_time_ns > from)
        });
        assert_eq!(health.mode, Mode::Manual);
    }
    // The client ends in order, whether it asked before it was frozen or asks now.
    asker.signal(Signal::CONT);
    asker.wait();
    drop((up, watch));
    domain.assert_clean();
}

#[test]
fn a_robot_whose_steering_board_is_not_heard_stands_and_goes_on_by_a_new_order_only() {
    let domain = Domain::new();
    let (body, plugged, config) = boards_at_a_cable(&domain);
    let bridge = domain.start(&["--config", &config, "bridge"]);
    let mut watch = DriveObserver::new(&domain);
    watch.wait_for_health("both boards", |health| health.boards_are_ready());
    insist(&domain, &["--config", &config, "mode", "manual"]);
    insist(&domain, &["--config", &config, "resume"]);
    let forward = ["--config", &config, "drive", "forward"];
    let mut drive = driving(&domain, &mut watch, &forward);

    plugged.cut_reports(true);
    watch.wait_for_health("people to see why", |health| {
        health.blocked == Refusal::BoardSilent
    });
    watch.wait_to_stand();
    assert_eq!(drive.wait(), Some(1), "{}", drive.log());
    let log = drive.log();
    let why = "steering board does not report";
    // If the process was kept from its core meanwhile, it gives that reason instead.
    assert!(log.contains(why) || log.contains("held up"), "{log}");
    let other = domain.run_renewed(&forward);
    assert!(!other.status.success());
    let said = String::from_utf8_lossy(&other.stderr);
    assert!(said.contains(why), "{said}");
    watch.assert_stands();

    plugged.cut_reports(false);
    watch.wait_for_health("the board to be heard", |health| {
        health.blocked == Refusal::None
    });
    watch.assert_stands();
    let seconds = ["--config", &config, "drive", "forward", "--seconds", "0.5"];
    let again = domain.run_renewed(&seconds);
    assert!(again.status.success(), "{again:?}");
    drop((bridge, plugged, body, watch, drive));
    domain.assert_clean();
}

/// The boards as a process, a cable at the steering board, and a configuration whose ports are
/// those of the cable and of the sensor board.
fn boards_at_a_cable(domain: &Domain) -> (Running, Cable, String) {
    let file = |name: &str| domain.folder().join(name);
    let [sensor, steering, cable] = ["sensor.tty", "steering.tty", "cable.tty"].map(file);
    let write = |name: &str, steering: &std::path::Path| {
        let path = file(name);
        let text = behind_ports(&sensor, steering).expect("a description");
        std::fs::write(&path, format!("warehouse = \"small\"\n{text}")).expect("a configuration");
        path.to_str().expect("a path in UTF-8").to_owned()
    };
    let (boards, config) = (
        write("boards.toml", &steering),
        write("bridge.toml", &cable),
    );
    let body = domain.start(&["--config", &boards, "simulator"]);
    let plugged = wait_for("the boards' port", || {
        steering.exists().then(|| Cable::plug(&steering, &cable))
    });
    (body, plugged, config)
}

#[test]
fn a_mission_stands_while_the_steering_board_is_not_heard_and_is_delivered_after() {
    let domain = Domain::new();
    let (body, plugged, config) = boards_at_a_cable(&domain);
    let mut up = domain.start(&[
        "--config",
        &config,
        "up",
        "--script",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
    ]);
    let mut watch = DriveObserver::new(&domain);
    let bus = domain.observe("r1", 1.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    insist(&domain, &["--config", &config, "resume"]);
    let mut wait_for_logic = |what: &str, phase: Phase, hold: Hold| {
        wait_for(what, || {
            let status = status.latest().expect("readable")?;
            (status.phase == phase && status.hold == hold).then_some(())
        });
    };
    wait_for_logic("the robot to drive", Phase::Driving, Hold::None);
    wait_for("the wheels to turn", || {
        watch.moves().filter(|moves| *moves)
    });

    plugged.cut_reports(true);
    wait_for_logic("logic to say why it stands", Phase::Driving, Hold::Unheard);
    watch.wait_for_health("the bridge to say so", |health| {
        health.blocked == Refusal::BoardSilent
    });
    watch.wait_to_stand();
    watch.assert_stands();

    plugged.cut_reports(false);
    wait_for_logic("logic to go on", Phase::Driving, Hold::None);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]), "{}", up.log());
    drop((body, plugged, watch, status, bus));
    domain.assert_clean();
}

/// The calendar of programs that load a library, which moves it.
struct Calendar {
    library: PathBuf,
    moved: PathBuf,
}

impl Calendar {
    fn new(domain: &Domain) -> Self {
        let at = |name: &str| domain.folder().join(name);
        let (library, moved) = (at("calendar.so"), at("moved"));
        fs::write(&moved, 0_i64.to_ne_bytes()).expect("a file");
        let mut compiler = Command::new("cc");
        compiler
            .args(["-O1", "-shared", "-fPIC", "-o"])
            .arg(&library);
        let built = compiler.arg(in_tree("tests/data/calendar.c")).status();
        assert!(built.is_ok_and(|status| status.success()), "cc builds it");
        Self { library, moved }
    }

    /// `lager` with this calendar.
    fn lager(&self, domain: &Domain, args: &[&str]) -> Command {
        let mut command = domain.lager(args);
        command.env("LD_PRELOAD", &self.library);
        command.env("LAGER_CALENDAR", &self.moved);
        command
    }

    /// From now on it is so many days ahead, or behind. Nobody reads half of a number.
    fn jumps_to(&self, days: i64) {
        let file = File::options().write(true).open(&self.moved);
        let seconds = days * 24 * 3_600;
        let written = file.and_then(|file| file.write_all_at(&seconds.to_ne_bytes(), 0));
        written.expect("its file");
    }

    /// The date as `lager` sees it.
    fn date(&self, domain: &Domain) -> String {
        let output = self.lager(domain, &["doctor"]).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let line = said.lines().find(|line| line.contains("calendar"));
        let date = line.and_then(|line| line.split("it says ").nth(1));
        date.unwrap_or_else(|| panic!("no date in {said}"))[..10].to_owned()
    }
}

/// A service that gives no sign of life for this time is replaced.
const REPLACED_AFTER: Duration = Duration::from_secs(2);

/// Ahead, and behind where it began. A Pi without a clock chip gets its date when it finds a network.
const JUMPS: [i64; 3] = [20, -20, 0];

#[test]
fn a_calendar_that_jumps_ends_no_drive_and_keeps_none_alive() {
    let domain = Domain::new();
    let calendar = Calendar::new(&domain);
    let command = calendar.lager(&domain, &["up"]);
    let (up, mut watch, mut drive) = by_hand(&domain, domain.launch(command));
    let held_up = Watch::begin();
    let services = ["bridge", "logic"].map(|name| up.service(name));
    let mut dates = Vec::new();
    for days in JUMPS {
        calendar.jumps_to(days);
        dates.push(calendar.date(&domain));
        // Who drives still does; who froze does not.
        if !drive.is_running() {
            let why = drive.log();
            assert!(why.contains("held up"), "{why}");
            drive = driving(&domain, &mut watch, &["drive", "forward"]);
        }
        freeze(drive.pid());
        watch.wait_to_stand();
        watch.assert_stands();
        drive.signal(Signal::KILL);
        drive.wait();
        drive = driving(&domain, &mut watch, &["drive", "backward"]);
    }
    dates.dedup();
    assert_eq!(dates.len(), JUMPS.len(), "{dates:?}");
    let after = ["bridge", "logic"].map(|name| up.service(name));
    assert!(
        after == services || held_up.end() > REPLACED_AFTER,
        "{}",
        up.log()
    );
    drop((up, watch, drive));
    domain.assert_clean();
}

#[test]
fn a_mission_is_delivered_while_the_calendar_jumps() {
    let domain = Domain::new();
    let calendar = Calendar::new(&domain);
    let mission = [
        "up",
        "--script",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
    ];
    let held_up = Watch::begin();
    let mut up = domain.launch(calendar.lager(&domain, &mission));
    let mut watch = DriveObserver::new(&domain);
    for days in JUMPS {
        wait_for("the wheels to turn", || {
            watch.moves().filter(|moves| *moves)
        });
        calendar.jumps_to(days);
        // Long enough for a service to be taken for dead.
        std::thread::sleep(REPLACED_AFTER + Duration::from_secs(1));
    }
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]), "{}", up.log());
    let is_whole = told["restarts"] == 0 || held_up.end() > REPLACED_AFTER;
    assert!(is_whole, "{told}\n{}", up.log());
    drop((up, watch));
    domain.assert_clean();
}
