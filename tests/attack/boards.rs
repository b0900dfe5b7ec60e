//! The boards of the attack tests, on a bus of their own, and a thread that watches their motors.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_ports::{Bus, BusConfig};
use lager_rig::behind_ports;
use lager_tests::{Cable, Domain, lager, pid, wait_for};
use lager_topics::{LAGER, Role, TruthPose};
use rustix::process::{Signal, kill_process};

/// Boards on a bus of their own, and the cable to the steering board.
pub(crate) struct Boards {
    bus: PathBuf,
    process: Child,
    pub(crate) watch: MotorWatch,
}

/// A thread that watches the motors.
pub(crate) struct MotorWatch {
    over: Arc<AtomicBool>,
    /// The longest time from the bridge's last bytes until a motor still ran, in ns.
    unsteered_ns: Arc<AtomicU64>,
    /// Whether a motor runs now.
    runs: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl MotorWatch {
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
                // Read before the sample: bytes that come in between must not shorten the time.
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

    pub(crate) fn unsteered(&self) -> Duration {
        Duration::from_nanos(self.unsteered_ns.load(Ordering::Relaxed))
    }

    pub(crate) fn runs(&self) -> bool {
        self.runs.load(Ordering::Relaxed)
    }
}

impl Boards {
    /// Starts boards, and writes the configuration of their robot into `domain`'s folder.
    pub(crate) fn start(domain: &Domain) -> Self {
        let file = |name: &str| domain.folder().join(name);
        let [sensor, steering, cable] = ["sensor.tty", "steering.tty", "cable.tty"].map(file);
        let write = |name: &str, steering: &Path| {
            let text = behind_ports(&sensor, steering).expect("a description");
            fs::write(file(name), format!("warehouse = \"small\"\n{text}"))
                .expect("a configuration");
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
            ..BusConfig::of(&LAGER)
        };
        let watch = MotorWatch::start(&config, &cable);
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
            ..BusConfig::of(&LAGER)
        };
        if let Ok(place) = config.home() {
            place.remove();
        }
    }
}
