//! What the tests with real processes share: an isolated bus for each test, the `lager` binary
//! on it, and a look at what it leaves behind.

mod cable;
mod compare;

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::{Duration, Instant};

use lager_ports::{Bus, BusConfig, StopPage, StopWord};
use lager_topics::Role;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

pub use cable::Cable;
pub use compare::{compare, compare_on_robot};
pub use lager_rig::told::children;

/// How long a test waits for anything before it calls it stuck. It bounds a hang; it measures
/// nothing.
pub const WATCHDOG: Duration = Duration::from_secs(240);

/// The program that people run, as this workspace builds it.
///
/// # Panics
/// When it has not been built: `tests/run` builds it first.
#[must_use]
pub fn lager() -> PathBuf {
    released("lager")
}

/// A program of this workspace's release profile.
///
/// # Panics
/// When it has not been built.
#[must_use]
pub fn released(name: &str) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || {
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("..")
                .join("target")
        },
        PathBuf::from,
    );
    let binary = target.join("release").join(name);
    assert!(
        binary.is_file(),
        "{} is missing; run tests/run, or `cargo build --release` first",
        binary.display()
    );
    binary
}

/// The machine, as far as the tests of one file share it.
static MACHINE: RwLock<()> = RwLock::new(());

/// Waits until no other test of this file has a robot, and keeps them waiting. Figures want the
/// machine to themselves, and one robot is what a small machine drives without losing a frame.
pub fn alone() -> RwLockWriteGuard<'static, ()> {
    // A test that failed has let go of the machine too.
    MACHINE.write().unwrap_or_else(PoisonError::into_inner)
}

/// What a test has of the machine.
#[derive(Debug)]
enum Share {
    All {
        _until_dropped: RwLockWriteGuard<'static, ()>,
    },
    Part {
        _until_dropped: RwLockReadGuard<'static, ()>,
    },
}

/// A bus and a folder of a test's own, one at a time. Call [`Domain::assert_clean`] at the end of a
/// test; a test that failed earlier leaves what its processes left.
#[derive(Debug)]
pub struct Domain {
    own: lager_rig::Domain,
    _share: Share,
}

impl Domain {
    /// A domain no other test has, and the machine with it, as [`alone`] has it.
    ///
    /// # Panics
    /// When its folder cannot be made.
    #[must_use]
    pub fn new() -> Self {
        Self::with(Share::All {
            _until_dropped: alone(),
        })
    }

    /// A domain no other test has, for a test that loses nothing by a few others that drive their
    /// robots meanwhile: as many as there are test threads.
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

    /// Runs `lager` with an order that it renews until it is carried out. One that was not renewed
    /// in time, because others kept this process from its core, is given anew, as `lager` says to
    /// do.
    ///
    /// # Panics
    /// When it cannot be started, or is held up for ever.
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

    /// [`Domain::run_renewed`], which must succeed.
    ///
    /// # Panics
    /// When it does not, with what it said.
    pub fn done(&self, args: &[&str]) {
        let output = self.run_renewed(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
    }

    /// This test's own way onto the bus, as an observer of `robot`.
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
    /// When the name is none.
    #[must_use]
    pub fn bus(&self, robot: &str, speed: f64) -> BusConfig {
        BusConfig {
            robot: robot.parse().expect("a robot's name"),
            speed,
            ..self.own.config()
        }
    }

    /// Where `robot` keeps its clock page if its body is emulated.
    #[must_use]
    pub fn clock_page(&self, robot: &str) -> PathBuf {
        self.own.folder().join(robot).join("clock")
    }

    /// Where the emulated boards of `robot` keep their EEPROMs.
    #[must_use]
    pub fn eeprom(&self, robot: &str) -> PathBuf {
        self.own.folder().join(robot).join("eeprom")
    }

    /// The folder in which the bus lives.
    #[must_use]
    pub fn bus_folder(&self) -> &Path {
        self.own.folder()
    }

    /// A folder of this test's own.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.own.files()
    }

    /// The shared memory and bookkeeping files that are left.
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

    /// The last line of a test: nothing of the bus is left.
    ///
    /// # Panics
    /// When shared memory or files of the bus are left.
    pub fn assert_clean(self) {
        let left = self.leftovers();
        assert!(left.is_empty(), "left behind: {left:#?}");
    }
}

/// Orders and a warehouse that are to outlive the robot, and the lock of a station that was killed.
fn is_kept(path: &Path) -> bool {
    let is_state = path.components().any(|part| part.as_os_str() == ".state");
    let is_file = path
        .extension()
        .is_some_and(|end| end == "toml" || end == "queue" || end == "lock");
    is_state && is_file && !path.ends_with("running.toml")
}

/// A stop word that stops nobody: it outlives every process, and only `up` tidies it away.
fn is_released_stop(path: &Path) -> bool {
    path.ends_with(StopPage::FILE)
        && StopWord::read(path).is_ok_and(|told| told.is_some_and(|told| told.stop().is_none()))
}

impl Domain {
    /// Prints the last lines of every log that is not empty.
    fn show_logs(&self) {
        const LINES: usize = 40;
        for entry in fs::read_dir(self.folder()).into_iter().flatten().flatten() {
            let log = fs::read(entry.path()).unwrap_or_default();
            let log = String::from_utf8_lossy(&log);
            if entry.path().extension().is_some_and(|end| end == "log") && !log.is_empty() {
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
    /// A test that fails shows what its processes logged, before its folder and its bus are
    /// removed.
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

/// An address of this machine that is free at this moment.
///
/// # Panics
/// When there is none.
#[must_use]
pub fn free() -> String {
    let socket = TcpListener::bind("127.0.0.1:0").expect("a port");
    socket.local_addr().expect("an address").to_string()
}

/// A running `lager`, killed when dropped.
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

    /// What it has written to standard error.
    ///
    /// # Panics
    /// When the log cannot be read.
    #[must_use]
    pub fn log(&self) -> String {
        fs::read_to_string(&self.log).expect("a readable log")
    }

    /// What it has written to standard output.
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
    /// When there is none, or more than that line.
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

    /// Whether it still runs.
    ///
    /// # Panics
    /// When it cannot be asked.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Waits for its end and returns the exit code.
    ///
    /// # Panics
    /// When it runs past the watchdog, with its log.
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

    /// Sends a signal.
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

/// A process id as the kernel's calls want it.
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

/// Whether a process has ended; one that nobody has waited for yet counts.
#[must_use]
pub fn has_ended(process: u32) -> bool {
    state(process).is_none_or(|state| state == 'Z')
}

/// Whether a process is stopped by a signal, all of it.
#[must_use]
pub fn is_stopped(process: u32) -> bool {
    state(process) == Some('T')
}

/// The state of a process as the kernel has it, if there is such a process.
fn state(process: u32) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The state follows the name, which is in parentheses and may contain anything.
    stat.rsplit(") ").next()?.chars().next()
}

/// Waits until `done` gives something.
///
/// # Panics
/// When it takes longer than the watchdog.
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
