//! The common helpers of the tests with real processes: an isolated bus for each test, the `lager`
//! program on it, and a check of the files that it leaves behind.

mod cable;
mod fresh;

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::{Duration, Instant};

use lager_ports::{Bus, BusConfig};
use lager_stop::{StopPage, StopWord};
use lager_topics::Role;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

pub use cable::Cable;
pub use fresh::fresh;
pub use lager_rig::proc::children;

/// The longest wait for any condition. It only ends a test that hangs; it measures nothing.
pub const WATCHDOG: Duration = Duration::from_secs(240);

/// A file or folder of the source tree.
#[must_use]
pub fn in_tree(path: &str) -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().expect("the workspace").join(path)
}

/// The emulator of the boards. The boards' images are in `firmware/avr/target/images`.
///
/// # Panics
/// When it or an image is missing or older than its sources.
#[must_use]
pub fn emulator() -> PathBuf {
    let images = in_tree("firmware/avr/target");
    for image in ["sensor", "steering", "sensor-loader", "steering-loader"] {
        let list = images.join(format!("avr-none/release/{image}.d"));
        built(&images.join(format!("images/{image}.elf")), &list);
    }
    let emulator = in_tree("firmware/emulator/target/release/lager-emulator");
    built(&emulator, &emulator.with_extension("d"))
}

/// `lager-bench`, which `lager bench` starts.
///
/// # Panics
/// When it is missing or older than its sources.
pub fn lager_bench() -> PathBuf {
    let bench = lager().with_file_name("lager-bench");
    built(&bench, &bench.with_extension("d"))
}

fn built(program: &Path, list: &Path) -> PathBuf {
    fresh(program, list).unwrap_or_else(|why| panic!("{why}"))
}

/// The program under test. cargo builds it with the tests of its own crate, so it is never older
/// than they are, and they run in either profile.
///
/// # Panics
/// When this process has no path.
#[must_use]
pub fn lager() -> PathBuf {
    // target/<profile>/deps/<test>
    let test = std::env::current_exe().expect("a path");
    let profile = test.parent().and_then(Path::parent);
    profile.expect("a folder of cargo's").join("lager")
}

/// A lock for the machine that the tests of one file share.
static MACHINE: RwLock<()> = RwLock::new(());

/// Waits until no other test of this file has a robot, and keeps the others waiting. Measurements
/// need the whole machine, and a small machine drives only one robot without losing a frame.
pub fn alone() -> RwLockWriteGuard<'static, ()> {
    // A failed test poisons the lock but has released it.
    MACHINE.write().unwrap_or_else(PoisonError::into_inner)
}

/// A test's lock on the machine.
#[derive(Debug)]
enum Share {
    All {
        _until_dropped: RwLockWriteGuard<'static, ()>,
    },
    Part {
        _until_dropped: RwLockReadGuard<'static, ()>,
    },
}

/// A bus and a folder that one test uses alone. Call [`Domain::assert_clean`] at the end of a test.
/// If a test fails earlier, the files of its processes may stay.
#[derive(Debug)]
pub struct Domain {
    own: lager_rig::Domain,
    _share: Share,
}

impl Domain {
    /// A domain for a test that must have the machine to itself, as with [`alone`].
    ///
    /// # Panics
    /// When its folder cannot be made.
    #[must_use]
    pub fn new() -> Self {
        Self::with(Share::All {
            _until_dropped: alone(),
        })
    }

    /// A domain for a test beside which other tests may drive their robots: at most as many as
    /// there are test threads.
    ///
    /// # Panics
    /// When its folder cannot be made.
    #[must_use]
    pub fn among_others() -> Self {
        Self::with(Share::Part {
            _until_dropped: MACHINE.read().unwrap_or_else(PoisonError::into_inner),
        })
    }

    fn with(share: Share) -> Self {
        Self {
            own: lager_rig::Domain::new("lager-test").expect("a bus of its own"),
            _share: share,
        }
    }

    /// `lager` with `args` on this bus.
    pub fn lager(&self, args: &[&str]) -> Command {
        let mut command = Command::new(lager());
        command
            .arg("--bus")
            .arg(self.own.folder())
            .args(args)
            .current_dir(self.folder())
            .stdin(Stdio::null());
        command
    }

    /// Starts `lager` with `args`; standard output and error go to files of the domain.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn start(&self, args: &[&str]) -> Running {
        self.launch(self.lager(args))
    }

    /// Starts a command that becomes [`Domain::lager`], in the background.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn launch(&self, mut command: Command) -> Running {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let log = self.folder().join(format!("{number}.log"));
        let out = self.folder().join(format!("{number}.out"));
        let child = command
            .stdout(fs::File::create(&out).expect("a log file"))
            .stderr(fs::File::create(&log).expect("a log file"))
            .spawn()
            .expect("it starts");
        Running { child, log, out }
    }

    /// Runs `lager` with `args` to its end.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn run(&self, args: &[&str]) -> Output {
        self.lager(args).output().expect("lager starts")
    }

    /// Runs `lager` with an order that it renews until the robot has carried it out. If the order
    /// ended because others kept this process from its core, gives it again, as `lager`'s sentence
    /// advises.
    ///
    /// # Panics
    /// When it cannot be started, or never gets its core for long enough.
    #[must_use]
    pub fn run_renewed(&self, args: &[&str]) -> Output {
        wait_for(&format!("{args:?} to be renewed in time"), || {
            let output = self.run(args);
            let said = String::from_utf8_lossy(&output.stderr);
            let late = ["held up for", "not renewed in time", "has not reported for"];
            let late = late.iter().any(|why| said.contains(why));
            (!late).then_some(output)
        })
    }

    /// [`Domain::run_renewed`], and asserts that it succeeded.
    ///
    /// # Panics
    /// When it did not, with its output.
    pub fn done(&self, args: &[&str]) {
        let output = self.run_renewed(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
    }

    /// Opens the bus for this test, as an observer of `robot`.
    ///
    /// # Panics
    /// When the bus cannot be opened.
    #[must_use]
    pub fn observe(&self, robot: &str, speed: f64) -> Bus {
        Bus::open(&self.bus(robot, speed), Role::Observer).expect("the bus opens")
    }

    /// The bus of `robot` in this domain.
    ///
    /// # Panics
    /// When this is not a valid name.
    #[must_use]
    pub fn bus(&self, robot: &str, speed: f64) -> BusConfig {
        BusConfig {
            unit: robot.parse().expect("a robot's name"),
            speed,
            ..self.own.config()
        }
    }

    /// The path of `robot`'s clock page, which an emulated body has.
    #[must_use]
    pub fn clock_page(&self, robot: &str) -> PathBuf {
        self.own.folder().join(robot).join("clock")
    }

    /// The folder with the EEPROMs of `robot`'s emulated boards.
    #[must_use]
    pub fn eeprom(&self, robot: &str) -> PathBuf {
        self.own.folder().join(robot).join("eeprom")
    }

    /// The bus's folder.
    #[must_use]
    pub fn bus_folder(&self) -> &Path {
        self.own.folder()
    }

    /// A folder that only this test uses.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.own.files()
    }

    /// The shared memory and the bus's files that still exist.
    ///
    /// # Panics
    /// When the bus's folder cannot be used.
    #[must_use]
    pub fn leftovers(&self) -> Vec<String> {
        let left = self.own.left().into_iter();
        left.filter(|path| !is_released_stop(path) && !is_kept(path))
            .map(|path| path.display().to_string())
            .collect()
    }

    /// Asserts, as the last line of a test, that nothing of the bus is left.
    ///
    /// # Panics
    /// When shared memory or files of the bus are left.
    pub fn assert_clean(self) {
        let left = self.leftovers();
        assert!(left.is_empty(), "left behind: {left:#?}");
    }
}

/// Whether this file may stay: orders, a warehouse, a history, the lock of a killed station, or what
/// an emulated board keeps without power.
fn is_kept(path: &Path) -> bool {
    if path.extension().is_some_and(|end| end == "eeprom") {
        return true;
    }
    let is_state = path.components().any(|part| part.as_os_str() == ".state");
    let is_file = path.extension().is_some_and(|end| {
        ["toml", "queue", "log", "lock"]
            .iter()
            .any(|kept| end == *kept)
    });
    is_state && is_file && !path.ends_with("running.toml")
}

/// A stop word without a stop in force. It outlives every process, and only `up` removes it.
fn is_released_stop(path: &Path) -> bool {
    path.ends_with(StopPage::FILE)
        && StopWord::read(path).is_ok_and(|told| told.is_some_and(|told| told.stop().is_none()))
}

impl Domain {
    /// Prints the last lines of every log that is not empty.
    fn show_logs(&self) {
        const LINES: usize = 40;
        for entry in fs::read_dir(self.folder()).into_iter().flatten().flatten() {
            // A link to a serial port beside them would be read without an end.
            if entry.path().extension().is_none_or(|end| end != "log") {
                continue;
            }
            let log = fs::read(entry.path()).unwrap_or_default();
            let log = String::from_utf8_lossy(&log);
            if !log.is_empty() {
                let skipped = log.lines().count().saturating_sub(LINES);
                eprintln!("--- {}", entry.file_name().to_string_lossy());
                log.lines()
                    .skip(skipped)
                    .for_each(|line| eprintln!("{line}"));
            }
        }
    }
}

impl Drop for Domain {
    /// Shows the logs of a failed test before its folder and its bus are removed.
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.show_logs();
        }
    }
}

impl Default for Domain {
    fn default() -> Self {
        Self::new()
    }
}

/// A free network address of this machine.
///
/// # Panics
/// When there is none.
#[must_use]
pub fn free() -> String {
    let socket = TcpListener::bind("127.0.0.1:0").expect("a port");
    socket.local_addr().expect("an address").to_string()
}

/// A running `lager`; dropping it kills the process.
#[derive(Debug)]
pub struct Running {
    child: Child,
    log: PathBuf,
    out: PathBuf,
}

impl Running {
    /// Its process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Its standard error so far.
    ///
    /// # Panics
    /// When the log cannot be read.
    #[must_use]
    pub fn log(&self) -> String {
        fs::read_to_string(&self.log).expect("a readable log")
    }

    /// Its standard output so far.
    ///
    /// # Panics
    /// When the file cannot be read.
    #[must_use]
    pub fn output(&self) -> String {
        fs::read_to_string(&self.out).expect("a readable file")
    }

    /// The one JSON line on its standard output.
    ///
    /// # Panics
    /// When there is no line, or more than one.
    #[must_use]
    pub fn json(&self) -> Value {
        let output = self.output();
        assert_eq!(
            output.lines().count(),
            1,
            "one line: {output}\n{}",
            self.log()
        );
        serde_json::from_str(&output).expect("a JSON line")
    }

    /// Whether the process still runs.
    ///
    /// # Panics
    /// When the kernel does not say so.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Waits until the process ends, and returns the exit code.
    ///
    /// # Panics
    /// When it runs longer than the watchdog allows; the message has its log.
    pub fn wait(&mut self) -> Option<i32> {
        let give_up = Instant::now() + WATCHDOG;
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status.code();
            }
            assert!(Instant::now() < give_up, "stuck:\n{}", self.log());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends a signal to the process.
    ///
    /// # Panics
    /// When the process is gone.
    pub fn signal(&self, signal: Signal) {
        kill_process(pid(self.pid()), signal).expect("a living process");
    }

    /// The process ids of its services, by subcommand.
    #[must_use]
    pub fn service(&self, name: &str) -> Option<u32> {
        children(self.pid())
            .into_iter()
            .find(|child| arguments(*child).iter().any(|argument| argument == name))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.is_running() {
            self.signal(Signal::TERM);
            let give_up = Instant::now() + Duration::from_secs(15);
            while self.is_running() && Instant::now() < give_up {
                std::thread::sleep(Duration::from_millis(10));
            }
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// A process id in the type of the kernel's calls.
///
/// # Panics
/// When it is 0.
#[must_use]
pub fn pid(raw: u32) -> Pid {
    Pid::from_raw(i32::try_from(raw).expect("a process id")).expect("not 0")
}

fn arguments(process: u32) -> Vec<String> {
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split(|byte| *byte == 0)
        .map(|argument| String::from_utf8_lossy(argument).into_owned())
        .collect()
}

/// Whether a process has ended, even if nobody has waited for it yet.
#[must_use]
pub fn has_ended(process: u32) -> bool {
    state(process).is_none_or(|state| state == 'Z')
}

/// Whether a signal has stopped all threads of a process.
#[must_use]
pub fn is_stopped(process: u32) -> bool {
    state(process) == Some('T')
}

/// The kernel's letter for the state of a process; `None` if there is no such process.
fn state(process: u32) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The state follows the name, which is in parentheses and may contain any character.
    stat.rsplit(") ").next()?.chars().next()
}

/// Waits until `done` returns a value.
///
/// # Panics
/// When that takes longer than the watchdog allows.
pub fn wait_for<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> T {
    let give_up = Instant::now() + WATCHDOG;
    loop {
        if let Some(value) = done() {
            return value;
        }
        assert!(Instant::now() < give_up, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
