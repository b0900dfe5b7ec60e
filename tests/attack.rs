//! Every shared file of a running robot is damaged. The robot must run again or end with a reason,
//! no tool may hang, nothing may be left behind, and the motors must not run on. `tests/soak
//! attack` tries every kind of file in every way, a full memory and a full disk, and kills
//! observers by the thousand; here a part of it runs.
//!
//! The boards are a process on a bus of their own, as real ones would be, behind a cable that knows
//! when the bridge last sent something. So the test sees what the motors do, whatever happens to
//! the robot's bus.

use std::fs::{self, OpenOptions, Permissions};
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_ports::{Bus, BusConfig, Place};
use lager_tests::{Cable, Domain, Running, WATCHDOG, children, lager, pid, wait_for};
use lager_topics::{Role, TruthPose};
use rustix::process::{Signal, kill_process};

/// The bound on driving without a word of the bridge, and what a sample of the world is late.
const UNSTEERED: Duration = Duration::from_millis(200);
/// The bound on being up again, or on ending with a reason.
const BACK: Duration = Duration::from_secs(10);
/// The bound on a tool's end.
const TOOL: Duration = Duration::from_secs(5);

/// Observers to kill in the soak, which also measures; times are no verdict anywhere else.
fn soak() -> Option<usize> {
    std::env::var("LAGER_SOAK_ATTACK").ok()?.parse().ok()
}

/// How a file is spoilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Harm {
    Emptied,
    /// To half of its length, 24 bytes at the most.
    Shortened,
    Deleted,
    Overwritten,
}

const HARMS: [Harm; 4] = [
    Harm::Emptied,
    Harm::Shortened,
    Harm::Deleted,
    Harm::Overwritten,
];

impl Harm {
    /// Spoils a file; one that goes by itself meanwhile is spoilt enough.
    fn to(self, file: &Path) {
        if self == Harm::Deleted {
            let _ = fs::remove_file(file);
            return;
        }
        let _ = fs::set_permissions(file, Permissions::from_mode(0o600));
        let Ok(opened) = OpenOptions::new().write(true).open(file) else {
            return;
        };
        let length = opened.metadata().map_or(0, |found| found.len());
        let _ = match self {
            Harm::Emptied => opened.set_len(0),
            Harm::Shortened => opened.set_len(length.min(48) / 2),
            Harm::Overwritten => opened.write_all_at(&vec![0xa5; length as usize], 0),
            Harm::Deleted => Ok(()),
        };
    }
}

/// What is spoilt.
#[derive(Clone, Copy, Debug)]
enum Target {
    /// The segments whose names end so.
    Segments(&'static str),
    /// The files of the folder whose names contain this.
    Files(&'static str),
    /// All that is in the folder.
    Contents,
    /// The folder.
    Folder,
}

const SEGMENTS: [&str; 4] = [".dynamic", ".data", ".connection", ".global_mgmt"];
const FILES: [&str; 11] = [
    ".service",
    ".details",
    ".node_monitor",
    "_tag",
    "bells",
    ".lock",
    "lager.toml",
    "stop",
    "warehouse.toml",
    "warehouse.toml.queue",
    // A socket, of which nothing but its name can be spoilt.
    "gag",
];

impl Target {
    /// Spoils all that is meant, which is at least one file.
    fn spoil(self, place: &Place, harm: Harm) {
        let mut spoilt = 0;
        let mut spoil = |file: &Path| {
            harm.to(file);
            spoilt += 1;
        };
        match self {
            Target::Segments(end) => {
                for segment in place.segments() {
                    if segment.to_string_lossy().ends_with(end) {
                        spoil(&segment);
                    }
                }
            }
            Target::Files(part) => {
                for file in files(place.folder()) {
                    let name = file.file_name().unwrap_or_default().to_string_lossy();
                    if name.contains(part) {
                        spoil(&file);
                    }
                }
            }
            Target::Contents => {
                for entry in fs::read_dir(place.folder()).into_iter().flatten().flatten() {
                    let _ = fs::remove_dir_all(entry.path());
                    spoilt += 1;
                }
            }
            Target::Folder => {
                // The robot makes files in it meanwhile.
                wait_for("the folder to go", || {
                    fs::remove_dir_all(place.folder()).ok()
                });
                spoilt += 1;
            }
        }
        assert!(spoilt > 0, "{self:?}: there is nothing of it");
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.path() {
            below if below.is_dir() => found.extend(files(&below)),
            file => found.push(file),
        }
    }
    found
}

/// Boards on a bus of their own, and the cable to the steering board.
struct Boards {
    bus: PathBuf,
    process: Child,
    watch: Watch,
}

/// A thread that looks at the motors.
struct Watch {
    over: Arc<AtomicBool>,
    /// The longest time between the bridge's last word and a motor that runs, in ns.
    unsteered_ns: Arc<AtomicU64>,
    /// Whether a motor runs.
    runs: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    fn start(bus: &BusConfig, cable: &Arc<Cable>) -> Self {
        let config = bus.clone();
        let cable = Arc::clone(cable);
        let over = Arc::new(AtomicBool::new(false));
        let unsteered_ns = Arc::new(AtomicU64::new(0));
        let runs = Arc::new(AtomicBool::new(false));
        let (is_over, longest, is_running) = (
            Arc::clone(&over),
            Arc::clone(&unsteered_ns),
            Arc::clone(&runs),
        );
        let thread = std::thread::spawn(move || {
            let bus = Bus::open(&config, Role::Observer).expect("the boards' bus");
            let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
            while !is_over.load(Ordering::Relaxed) {
                // Before the sample: a word that comes in between cannot make a gap longer.
                let spoken = cable.spoken_ns();
                if let Some(truth) = truth.latest().expect("readable") {
                    let runs = (truth.left_duty, truth.right_duty) != (0, 0);
                    is_running.store(runs, Ordering::Relaxed);
                    if runs {
                        let since = truth.stamp().source_time_ns.saturating_sub(spoken);
                        longest.fetch_max(since, Ordering::Relaxed);
                    }
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        Self {
            over,
            unsteered_ns,
            runs,
            thread: Some(thread),
        }
    }

    fn unsteered(&self) -> Duration {
        Duration::from_nanos(self.unsteered_ns.load(Ordering::Relaxed))
    }

    fn runs(&self) -> bool {
        self.runs.load(Ordering::Relaxed)
    }
}

impl Boards {
    /// Boards, and in `domain`'s folder the configuration of a robot that is wired to them.
    fn start(domain: &Domain) -> Self {
        let file = |name: &str| domain.folder().join(name);
        let [sensor, steering, cable] = ["sensor.tty", "steering.tty", "cable.tty"].map(file);
        let write = |name: &str, steering: &Path| {
            let serial = format!("[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
            fs::write(file(name), format!("body = \"serial\"\n{serial}")).expect("a configuration");
        };
        write("boards.toml", &steering);
        write("robot.toml", &cable);
        let name = format!("/dev/shm/lager-boards-{}", std::process::id());
        let bus = PathBuf::from(name);
        let process = Command::new(lager())
            .arg("--bus")
            .arg(&bus)
            .arg("--config")
            .arg(file("boards.toml"))
            .arg("simulator")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(file("boards.log")).expect("a log file"))
            .spawn()
            .expect("lager starts");
        let cable = wait_for("the board's port", || {
            steering
                .exists()
                .then(|| Arc::new(Cable::plug(&steering, &cable)))
        });
        let config = BusConfig {
            folder: Some(bus.clone()),
            ..BusConfig::default()
        };
        let watch = Watch::start(&config, &cable);
        Self {
            bus,
            process,
            watch,
        }
    }
}

impl Drop for Boards {
    fn drop(&mut self) {
        self.watch.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.watch.thread.take() {
            let _ = thread.join();
        }
        let _ = kill_process(pid(self.process.id()), Signal::TERM);
        let _ = self.process.wait();
        let config = BusConfig {
            folder: Some(self.bus.clone()),
            ..BusConfig::default()
        };
        if let Ok(place) = config.place() {
            place.remove();
        }
    }
}

/// A tool that has ended by itself, `None` if it hung.
fn tool(domain: &Domain, arguments: &[&str]) -> Option<Output> {
    let mut child = domain
        .lager(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("lager starts");
    let start = Instant::now();
    let limit = soak().map_or(WATCHDOG / 4, |_| TOOL);
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > limit {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Some(child.wait_with_output().expect("its output"))
}

/// A newcomer hears the robot; panics if it hangs.
fn answers(domain: &Domain, up: &Running) -> bool {
    let echo = tool(domain, &["topic", "echo", "sensor/line", "--count", "1"]);
    let Some(echo) = echo else {
        panic!("`topic echo` hangs:\n{}", up.log());
    };
    echo.status.success()
}

/// A robot at the boards, driving.
fn driving(domain: &Domain, boards: &Boards) -> Running {
    let config = domain.folder().join("robot.toml");
    let config = config.to_str().expect("UTF-8");
    let up = domain.start(&["--config", config, "up", "--script", "--mission", "1"]);
    // Real boards start stopped.
    wait_for("the stop to be released", || {
        domain.run(&["resume"]).status.success().then_some(())
    });
    wait_for("the robot to drive", || boards.watch.runs().then_some(()));
    up
}

/// What an attack came to.
struct Outcome {
    what: String,
    said: String,
    took: Duration,
    unsteered: Duration,
}

/// Starts a robot, has it attacked as it drives, and judges what becomes of it.
fn attack(what: &str, spoil: impl FnOnce(&Domain, &Running)) -> Outcome {
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let mut up = driving(&domain, &boards);
    let start = Instant::now();
    spoil(&domain, &up);
    let said = loop {
        if !up.is_running() {
            let log = up.log();
            let why = log.lines().last().unwrap_or_default().to_owned();
            assert!(
                up.wait() != Some(0) && !why.is_empty(),
                "{what}: no reason:\n{log}"
            );
            break format!("ended: {why}");
        }
        if answers(&domain, &up) {
            break "up".to_owned();
        }
        let limit = soak().map_or(WATCHDOG, |_| BACK);
        assert!(
            start.elapsed() < limit,
            "{what}: neither up nor ended:\n{}",
            up.log()
        );
    };
    let took = start.elapsed();
    let list = tool(&domain, &["topic", "list"]);
    assert!(list.is_some(), "{what}: `topic list` hangs");
    if up.is_running() {
        up.signal(Signal::INT);
        up.wait();
    }
    wait_for("the motors to stand", || {
        (!boards.watch.runs()).then_some(())
    });
    let unsteered = boards.watch.unsteered();
    drop(boards);
    let fixed = tool(&domain, &["doctor", "--fix"]).expect("`doctor --fix` ends");
    let mut left = domain.leftovers();
    // A robot that was stopped stays stopped.
    left.retain(|file| !file.ends_with("/stop"));
    let report = String::from_utf8_lossy(&fixed.stdout).into_owned();
    assert!(
        left.is_empty(),
        "{what}: left {left:#?}\n{report}\n{}",
        up.log()
    );
    Outcome {
        what: what.to_owned(),
        said,
        took,
        unsteered,
    }
}

fn spoilt(target: Target, harm: Harm) -> Outcome {
    attack(&format!("{target:?} {harm:?}"), |domain, _| {
        let place = domain.bus("r1", 1.0).place().expect("the bus's folder");
        target.spoil(&place, harm);
    })
}

/// Prints what was measured; only the soak judges times.
fn report(outcomes: &[Outcome]) {
    for outcome in outcomes {
        println!(
            "{:40} {:>5.1} s  motors {:>4} ms without a word  {}",
            outcome.what,
            outcome.took.as_secs_f64(),
            outcome.unsteered.as_millis(),
            outcome.said
        );
    }
    if soak().is_some() {
        for outcome in outcomes {
            let unsteered = outcome.unsteered;
            assert!(unsteered <= UNSTEERED, "{}: {unsteered:?}", outcome.what);
        }
    }
}

#[test]
fn a_robot_whose_files_are_spoilt_is_up_again_or_ends_with_a_reason() {
    let segments = SEGMENTS.map(Target::Segments);
    let files = FILES.map(Target::Files);
    let kinds = segments.into_iter().chain(files);
    let mut attacks: Vec<(Target, Harm)> = match soak() {
        Some(_) => kinds
            .flat_map(|kind| HARMS.map(|harm| (kind, harm)))
            .collect(),
        None => vec![
            (Target::Segments(".dynamic"), Harm::Deleted),
            (Target::Segments(".connection"), Harm::Shortened),
            (Target::Files(".service"), Harm::Overwritten),
            (Target::Files("bells"), Harm::Deleted),
        ],
    };
    attacks.extend([Target::Contents, Target::Folder].map(|all| (all, Harm::Deleted)));
    for (target, harm) in attacks {
        report(&[spoilt(target, harm)]);
    }
}

#[test]
fn observers_killed_at_random_moments_cost_nobody_anything() {
    let count = soak().unwrap_or(20);
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let up = driving(&domain, &boards);
    let mut moment = 0_u64;
    for number in 0..count {
        let mut observer = domain
            .lager(&["topic", "echo", "sensor/line", "--count", "1000"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("lager starts");
        // Linear congruential steps: other moments each time, the same in every run.
        moment = moment
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695);
        std::thread::sleep(Duration::from_micros(2_000 + (moment >> 33) % 40_000));
        observer.kill().expect("a child");
        observer.wait().expect("a child");
        if number % 500 == 499 {
            assert!(answers(&domain, &up), "after {number}:\n{}", up.log());
        }
    }
    assert!(answers(&domain, &up), "{}", up.log());
    for service in ["bridge", "logic", "attend"] {
        assert!(up.service(service).is_some(), "{}", up.log());
    }
    let log = up.log();
    assert!(!log.contains("ended ("), "no service noticed:\n{log}");
    if soak().is_some() {
        assert!(boards.watch.unsteered() <= UNSTEERED);
    }
    drop((up, boards));
    wait_for("the dead to be swept", || {
        let _ = domain.run(&["doctor", "--fix"]);
        domain.leftovers().is_empty().then_some(())
    });
}

/// A robot in a mount namespace of its own: what is filled is full for it alone. Its words go to
/// `log`, a path below the domain's folder.
fn in_its_own_mounts(domain: &Domain, log: &str) -> Child {
    let script = r#"
        mount -t tmpfs -o size=24m tmpfs /dev/shm
        mkdir -p -m 700 /dev/shm/bus
        mkdir disk
        mount -t tmpfs -o size=1m tmpfs disk
        exec "$1" --bus /dev/shm/bus --config "$2" up --script --mission 1 2>"$3""#;
    Command::new("unshare")
        .args(["--mount", "sh", "-ec", script, "sh"])
        .arg(lager())
        .arg(domain.folder().join("robot.toml"))
        .arg(log)
        .current_dir(domain.folder())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("`unshare` is there")
}

/// A command in the mounts of process `robot`; whether it succeeds. Panics if it hangs.
fn enters(robot: u32, command: &[&str]) -> bool {
    // As `timeout` has it for what it had to end.
    const ENDED: [i32; 2] = [124, 137];
    let status = Command::new("timeout")
        .args(["-k", "1", "5", "nsenter", "--mount", "--wd", "--target"])
        .arg(robot.to_string())
        .args(command)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("`nsenter` is there");
    let hung = status.code().is_some_and(|code| ENDED.contains(&code));
    assert!(!hung, "{command:?} hangs");
    status.success()
}

/// A process that does nothing in the mounts of another, so that they outlive that one.
fn stays_in(robot: u32) -> Child {
    Command::new("nsenter")
        .args(["--mount", "--target"])
        .arg(robot.to_string())
        .args(["sleep", "600"])
        .stdin(Stdio::null())
        .spawn()
        .expect("`nsenter` is there")
}

fn has_argument(process: u32, wanted: &[u8]) -> bool {
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split(|byte| *byte == 0).any(|word| word == wanted)
}

/// Fills `full`, kills the bridge meanwhile, and makes room again.
fn fill(full: &str, log: &str) -> Outcome {
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let mut robot = in_its_own_mounts(&domain, log);
    let id = robot.id();
    let binary = lager();
    let tool = |words: &[&str]| {
        let binary = binary.to_str().expect("UTF-8");
        enters(id, &[&[binary, "--bus", "/dev/shm/bus"], words].concat())
    };
    let answers = || tool(&["topic", "echo", "sensor/line", "--count", "1"]);
    // Before, its mounts are this process's.
    wait_for("the robot's process", || {
        has_argument(id, b"up").then_some(())
    });
    let mut witness = stays_in(id);
    wait_for("the stop to be released", || {
        tool(&["resume"]).then_some(())
    });
    wait_for("the robot to drive", || boards.watch.runs().then_some(()));

    let all = format!("head -c 64M /dev/zero >{full}");
    assert!(
        !enters(id, &["sh", "-c", &all]),
        "there was room for all of it"
    );
    // Newcomers find no room; who is there drives on.
    let filled = Instant::now();
    while filled.elapsed() < Duration::from_secs(3) {
        answers();
    }
    // Nor does a killed service's successor.
    let services = children(id);
    if let Some(bridge) = services
        .iter()
        .find(|child| has_argument(**child, b"bridge"))
    {
        let _ = kill_process(pid(*bridge), Signal::KILL);
        wait_for("the motors to stand", || {
            (!boards.watch.runs()).then_some(())
        });
        std::thread::sleep(Duration::from_secs(1));
    }
    enters(id, &["rm", "-f", full]);
    let room = Instant::now();
    let said = loop {
        if let Some(status) = robot.try_wait().expect("a child") {
            assert_ne!(status.code(), Some(0));
            let log = fs::read_to_string(domain.folder().join(log)).unwrap_or_default();
            let why = log.lines().last().unwrap_or_default().to_owned();
            assert!(
                full != "/dev/shm/full" || !why.is_empty(),
                "{full}: no reason"
            );
            break format!("ended ({status}): {why}");
        }
        if answers() {
            break "up".to_owned();
        }
        assert!(room.elapsed() < BACK, "{full}: neither up nor ended");
    };
    let took = room.elapsed();
    let _ = kill_process(pid(id), Signal::INT);
    wait_for("its end", || robot.try_wait().expect("a child"));
    wait_for("the motors to stand", || {
        (!boards.watch.runs()).then_some(())
    });
    let memory = PathBuf::from(format!("/proc/{}/root/dev/shm", witness.id()));
    let binary = binary.to_str().expect("UTF-8");
    enters(
        witness.id(),
        &[binary, "--bus", "/dev/shm/bus", "doctor", "--fix"],
    );
    let mut left = files(&memory);
    // A robot that was stopped stays stopped.
    left.retain(|file| !file.ends_with("stop"));
    let _ = witness.kill();
    let _ = witness.wait();
    assert!(left.is_empty(), "{full}: left {left:#?}");
    Outcome {
        what: format!("{full}, and the bridge killed"),
        said,
        took,
        unsteered: boards.watch.unsteered(),
    }
}

#[test]
#[ignore = "mounts file systems, which needs root; `tests/soak attack` runs it"]
fn a_full_memory_and_a_full_disk_are_survived_or_said() {
    for (full, log) in [("/dev/shm/full", "log"), ("disk/full", "disk/log")] {
        report(&[fill(full, log)]);
    }
}
