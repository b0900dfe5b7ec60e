//! Tests of what a service manager, such as systemd, hears of `lager up` and `lager station`: a
//! socket of the test stands for the manager.

use std::fs;
use std::os::unix::net::UnixDatagram;
use std::time::{Duration, Instant};

use lager_tests::{Domain, Running, WATCHDOG, is_stopped, pid, wait_for};
use rustix::process::{Signal, kill_process};

const READY: &str = "READY=1";
const GOES_ON: &str = "WATCHDOG=1";
const STOPPING: &str = "STOPPING=1";

/// How long the manager waits for a sign of life, in µs, and half of it.
const LIMIT_US: &str = "2000000";
const HALF: Duration = Duration::from_secs(1);

/// The manager's end, and what it has heard.
struct Manager {
    socket: UnixDatagram,
    heard: Vec<String>,
}

impl Manager {
    fn of(domain: &Domain) -> Self {
        let socket = UnixDatagram::bind(domain.folder().join("notify")).expect("a socket");
        let heard = Vec::new();
        Self { socket, heard }
    }

    /// Starts `lager` as this manager's service.
    fn start(&self, domain: &Domain, args: &[&str]) -> Running {
        let mut lager = domain.lager(args);
        lager
            .env("NOTIFY_SOCKET", domain.folder().join("notify"))
            .env("WATCHDOG_USEC", LIMIT_US)
            .env_remove("WATCHDOG_PID");
        domain.launch(lager)
    }

    /// The next word, if one comes within `patience`.
    fn next(&mut self, patience: Duration) -> Option<String> {
        let patience = patience.max(Duration::from_millis(1));
        self.socket
            .set_read_timeout(Some(patience))
            .expect("a socket");
        let mut word = [0; 4096];
        let length = self.socket.recv(&mut word).ok()?;
        let word = String::from_utf8_lossy(&word[..length])
            .trim_end()
            .to_owned();
        self.heard.push(word.clone());
        Some(word)
    }

    /// Takes everything that has come already.
    fn drain(&mut self) {
        while self.next(Duration::ZERO).is_some() {}
    }

    /// The words up to the first that begins so.
    fn until(&mut self, begin: &str, up: &Running) -> Vec<String> {
        let from = self.heard.len();
        let give_up = Instant::now() + WATCHDOG;
        while !self.next(HALF).is_some_and(|word| word.starts_with(begin)) {
            let said = || format!("{:?}\n{}{}", self.heard, up.output(), up.log());
            assert!(Instant::now() < give_up, "no {begin}: {}", said());
        }
        self.heard[from..].to_vec()
    }

    fn count(&self, word: &str) -> usize {
        self.heard.iter().filter(|one| *one == word).count()
    }
}

fn freeze(process: u32) {
    kill_process(pid(process), Signal::STOP).expect("a living process");
    wait_for("it to stop", || is_stopped(process).then_some(()));
}

fn end(up: &mut Running, signal: Signal) {
    up.signal(signal);
    assert_eq!(up.wait(), Some(0), "{}{}", up.log(), up.output());
}

/// A logic that somebody has started holds the place of the robot's own.
#[test]
fn a_robot_is_ready_once_and_not_before_its_services_are_at_work() {
    let domain = Domain::new();
    let other = domain.start(&["logic"]);
    let place = domain.bus("r1", 1.0).home().expect("a folder");
    wait_for("the other logic", || {
        let up = place.up();
        let mut holders = up.into_values().flatten();
        holders.find(|holder| holder.pid == other.pid())
    });
    let mut manager = Manager::of(&domain);
    let mut up = manager.start(&domain, &["up", "--headless"]);
    wait_for("the robot's own logic", || up.service("logic"));
    wait_for("the bridge", || {
        up.output().contains("board is connected").then_some(())
    });
    // Words come in their order, so by then an early one would have come.
    manager.drain();
    for _ in 0..3 {
        manager.until(GOES_ON, &up);
    }
    let first = &manager.heard[0];
    assert!(first.starts_with("STATUS="), "{first}");
    assert_eq!(manager.count(READY), 0, "{:?}", manager.heard);

    other.signal(Signal::INT);
    manager.until(READY, &up);
    for service in ["attend", "simulator", "station", "comm", "bridge", "logic"] {
        let process = up.service(service);
        let process = process.unwrap_or_else(|| panic!("no {service}: {}", up.output()));
        // A word of a service would count as the robot's, if a manager lets all of them speak.
        let environment = fs::read(format!("/proc/{process}/environ")).expect("a process");
        let environment = String::from_utf8_lossy(&environment);
        for variable in ["NOTIFY_SOCKET", "WATCHDOG_USEC"] {
            assert!(!environment.contains(variable), "{service} has {variable}");
        }
    }
    manager.until(GOES_ON, &up);
    let told = |word: &String| word.starts_with("STATUS=robot ");
    assert!(manager.heard.iter().any(told), "{:?}", manager.heard);
    end(&mut up, Signal::TERM);
    manager.until(STOPPING, &up);
    assert_eq!(manager.count(READY), 1, "{:?}", manager.heard);
    let secret = manager.heard.iter().find(|word| word.contains("token"));
    assert_eq!(secret, None);
    drop(other);
    domain.assert_clean();
}

#[test]
fn a_robot_without_boards_is_ready() {
    let domain = Domain::new();
    let mut manager = Manager::of(&domain);
    let ports = ["sensor", "steering"].map(|port| domain.folder().join(port));
    let [sensor, steering] = ports.each_ref().map(|port| port.to_str().expect("UTF-8"));
    let args = [
        "up",
        "--headless",
        "--sensor",
        sensor,
        "--steering",
        steering,
    ];
    let mut up = manager.start(&domain, &args);
    manager.until(READY, &up);
    // It stays up, and goes on.
    for _ in 0..3 {
        manager.until(GOES_ON, &up);
    }
    assert_eq!(manager.count(READY), 1, "{:?}", manager.heard);
    end(&mut up, Signal::TERM);
    // Real boards start stopped, and a stop outlives the robot.
    let left = domain.leftovers();
    assert!(
        left.iter().all(|file| file.ends_with("/r1/stop")),
        "{left:?}"
    );
}

#[test]
fn a_frozen_supervisor_and_a_frozen_attendant_give_no_sign_of_life() {
    let domain = Domain::new();
    let mut manager = Manager::of(&domain);
    let mut up = manager.start(&domain, &["up", "--headless"]);
    manager.until(READY, &up);
    manager.until(GOES_ON, &up);

    freeze(up.pid());
    manager.drain();
    let silence = manager.next(HALF * 3);
    assert_eq!(silence, None);
    up.signal(Signal::CONT);
    manager.until(GOES_ON, &up);

    let attendant = wait_for("the attendant", || up.service("attend"));
    freeze(attendant);
    manager.drain();
    // The supervisor gives it two seconds. What it had said before may count once.
    let words = manager.until("STATUS=the attendant does not answer", &up);
    let signs = words.iter().filter(|word| *word == GOES_ON).count();
    assert!(signs <= 1, "{words:?}");
    manager.until(GOES_ON, &up);
    assert_eq!(manager.count(READY), 1, "{:?}", manager.heard);
    end(&mut up, Signal::TERM);
    domain.assert_clean();
}

#[test]
fn without_a_manager_nothing_changes_and_another_process_is_not_watched() {
    let domain = Domain::new();
    let mut manager = Manager::of(&domain);
    let has_thread = |up: &Running| {
        let threads = fs::read_dir(format!("/proc/{}/task", up.pid())).expect("a process");
        let mut names = threads
            .flatten()
            .map(|thread| fs::read_to_string(thread.path().join("comm")).unwrap_or_default());
        names.any(|name| name.trim() == "manager")
    };
    let drives = |up: &Running| up.output().contains("drives from").then_some(());

    let mut alone = domain.lager(&["up", "--headless"]);
    alone
        .env_remove("NOTIFY_SOCKET")
        .env("WATCHDOG_USEC", LIMIT_US);
    let mut up = domain.launch(alone);
    wait_for("it to drive", || drives(&up));
    assert!(!has_thread(&up));
    end(&mut up, Signal::INT);

    let mut other = domain.lager(&["up", "--headless"]);
    other
        .env("NOTIFY_SOCKET", domain.folder().join("notify"))
        .env("WATCHDOG_USEC", LIMIT_US)
        .env("WATCHDOG_PID", std::process::id().to_string());
    let mut up = domain.launch(other);
    manager.until(READY, &up);
    assert!(has_thread(&up));
    end(&mut up, Signal::INT);
    manager.until(STOPPING, &up);
    assert_eq!(manager.count(GOES_ON), 0, "{:?}", manager.heard);
    domain.assert_clean();
}

/// Far more words than fit into the queues: the supervisor does its work all the same.
#[test]
fn a_manager_that_does_not_read_holds_nobody_up() {
    let domain = Domain::new();
    let manager = Manager::of(&domain);
    let mut lager = domain.lager(&["up", "--headless"]);
    lager
        .env("NOTIFY_SOCKET", domain.folder().join("notify"))
        .env("WATCHDOG_USEC", "40000");
    let mut up = domain.launch(lager);
    let bridge = wait_for("the bridge", || up.service("bridge"));
    std::thread::sleep(HALF * 3);
    kill_process(pid(bridge), Signal::KILL).expect("a living process");
    wait_for("another bridge", || {
        up.service("bridge").filter(|next| *next != bridge)
    });
    end(&mut up, Signal::TERM);
    drop(manager);
    domain.assert_clean();
}

#[test]
fn a_station_is_ready_when_robots_can_connect() {
    let domain = Domain::new();
    let mut manager = Manager::of(&domain);
    let args = ["station", "--listen", "127.0.0.1:0", "--no-panel"];
    let mut station = manager.start(&domain, &args);
    manager.until(READY, &station);
    manager.until("STATUS=robots connect to 127.0.0.1:", &station);
    for _ in 0..3 {
        manager.until(GOES_ON, &station);
    }
    freeze(station.pid());
    manager.drain();
    assert_eq!(manager.next(HALF * 3), None);
    station.signal(Signal::CONT);
    manager.until(GOES_ON, &station);
    end(&mut station, Signal::TERM);
    manager.until(STOPPING, &station);
    assert_eq!(manager.count(READY), 1, "{:?}", manager.heard);
    domain.assert_clean();
}
