//! Observers of a robot that fetches goods at a thousand frames a second: what it costs its path
//! that they listen.

use std::fs;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use lager_ports::Bus;
use lager_rig::schedule::usable_cores;
use lager_tests::{Domain, Running, compare_on_robot, free, lager, pid, wait_for};
use lager_topics::{MissionQueue, OBSERVERS, SensorLine, Topic};
use rustix::process::{Signal, kill_process};

/// Prints what the path of a robot on a mission takes, alone and with what `begin` starts, each
/// time as soon as so many observers are on the line. The robot is started with these `flags`, too.
fn compare<W>(what: &str, flags: &str, observers: usize, begin: impl Fn(&Domain) -> W) {
    let domain = Domain::new();
    // Goods for longer than it is measured.
    let mission = ["1,2,3"; 80].join(",");
    let mut up = vec!["up", "--headless", "--speed", "5", "--mission", &mission];
    up.extend(flags.split_whitespace());
    let mut up = domain.start(&up);
    domain.done(&["topic", "echo", "latency/path", "--count", "2", "--wait"]);
    let observer = domain.observe("r1", 1.0);
    compare_on_robot(&domain, what, || {
        let guests = begin(&domain);
        wait_for("all to listen", || all_listen(&observer, observers));
        // Once a second they look whether ports have come, and twice at each that has.
        std::thread::sleep(Duration::from_secs(4));
        guests
    });
    let mut queue = observer.subscriber::<MissionQueue>().expect("a topic");
    let is_on_its_way = wait_for("an order", || {
        Some(queue.latest().expect("readable")?.under_way == 1)
    });
    assert!(up.is_running() && is_on_its_way, "{}", up.log());
    drop((queue, observer, up));
    // A tool that cannot leave the bus at once, because all the others do, ends without.
    wait_for("the bus to be swept", || {
        let _ = domain.run(&["doctor", "--fix"]);
        domain.leftovers().is_empty().then_some(())
    });
}

fn all_listen(observer: &Bus, observers: usize) -> Option<()> {
    let topics = observer.topics().expect("the bus");
    let line = topics.iter().find(|topic| topic.name == SensorLine::NAME)?;
    (line.observers == observers).then_some(())
}

/// As many as a topic has places for, of each kind a process.
struct Listeners {
    tools: Vec<Running>,
    top: Child,
}

impl Listeners {
    /// A recorder, a gateway, `top` on a screen of 200 x 60, and `topic hz` at all other places.
    fn new(domain: &Domain) -> Self {
        let _ = fs::remove_file(domain.folder().join("all.mcap"));
        let mut tools = vec![
            domain.start(&["bag", "record", "all.mcap", "--json"]),
            domain.start(&["gateway", "--metrics", &free()]),
        ];
        let hz = || domain.start(&["topic", "hz", SensorLine::NAME]);
        tools.extend((0..OBSERVERS - 3).map(|_| hz()));
        let command = "stty rows 60 cols 200; exec \"$LAGER\" --bus \"$BUS\" top";
        let top = Command::new("script")
            .args(["--quiet", "--return", "--command", command, "/dev/null"])
            .env("LAGER", lager())
            .env("BUS", domain.bus_folder())
            .env("TERM", "xterm-256color")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .expect("`script` is there");
        Self { tools, top }
    }
}

impl Drop for Listeners {
    fn drop(&mut self) {
        let mut keys = self.top.stdin.take().expect("its keys");
        let _ = keys.write_all(b"q");
        for tool in &self.tools {
            tool.signal(Signal::TERM);
        }
        for tool in &mut self.tools {
            tool.wait();
            assert!(
                !tool.output().is_empty(),
                "it heard nothing: {}",
                tool.log()
            );
        }
        let ended = self.top.wait().expect("a child");
        assert!(ended.success(), "lager top: {ended}");
    }
}

/// Binds bridge and logic to one core: the last, as most interrupts come to the first.
fn on_one_core() -> String {
    let core = *usable_cores().last().expect("a core");
    format!("--core {core}")
}

#[test]
#[ignore = "it prints figures and wants the machine to itself: tests/soak listened"]
fn the_path_while_all_places_are_taken() {
    compare("64 observers", "", OBSERVERS, Listeners::new);
    let flags = on_one_core();
    compare("64, one core", &flags, OBSERVERS, Listeners::new);
}

#[test]
#[ignore = "it prints figures, and wants the machine to itself and the right to real time: tests/soak listened"]
fn the_path_in_real_time_while_all_places_are_taken() {
    let flags = "--realtime 20";
    compare("64, real time", flags, OBSERVERS, Listeners::new);
    let flags = format!("{flags} {}", on_one_core());
    compare("64, real time, one core", &flags, OBSERVERS, Listeners::new);
}

/// A Python program that reads every line frame.
struct Python(Child);

impl Python {
    fn new(domain: &Domain) -> Self {
        let code = "import signal, sys
from lagerrobot import Robot

signal.signal(signal.SIGTERM, lambda *_: sys.exit())
with Robot('r1', bus=sys.argv[1]) as robot:
    for _ in robot.topic('sensor/line'):
        pass";
        let python = std::env::var_os("LAGER_PYTHON").expect("LAGER_PYTHON names a Python");
        let mut command = Command::new(python);
        command.args(["-c", code]).arg(domain.bus_folder());
        Self(command.spawn().expect("Python starts"))
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        kill_process(pid(self.0.id()), Signal::TERM).expect("it goes on");
        let ended = self.0.wait().expect("a child");
        assert!(ended.success(), "Python: {ended}");
    }
}

#[test]
#[ignore = "it prints figures and wants the machine to itself: tests/soak python"]
fn the_path_while_python_reads() {
    compare("one Python program", "", 1, Python::new);
}
