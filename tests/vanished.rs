//! Tests with a machine that vanishes from the network without a word, as when somebody pulls a
//! cable or a battery is empty.
//!
//! ```text
//!   a network of the test's own              another one
//!   lager up, or a station  ── 192.0.2.0/30 ──  sockets of the test
//!                                            the test takes this end down
//! ```
//!
//! Each test starts itself again in a user namespace that has both networks, so it touches nothing
//! of the machine's own network. Not every machine allows that, so these tests are ignored by
//! default. `tests/run` runs them where the machine allows it; run elsewhere, they fail.

#[cfg(feature = "zenoh")]
mod bad_link;
#[path = "comm/scene.rs"]
#[allow(dead_code, reason = "what other tests with a played station need")]
mod scene;

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_lines::Name;
use lager_lines::command::read_wheels;
use lager_lines::secret::Secrets;
use lager_station::{Doing, Listen, Server, ServerConfig, Station};
use lager_tests::{alone, wait_for};
use lager_topics::TruthPose;
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

use crate::scene::{Peer, Scene};

/// The environment variable that tells the test that it is in networks of its own.
const INSIDE: &str = "LAGER_VANISHED";
/// Arguments that run a program as root of a user namespace with a network of its own.
const APART: [&str; 3] = ["--map-root-user", "--net", "--"];
const OURS: &str = "192.0.2.1";
const THEIRS: &str = "192.0.2.2";
/// The longest time until a robot driven by hand stands after its link was lost, and the longest
/// delay until the simulated world shows that.
const STANDS_WITHIN: Duration = Duration::from_millis(200);
const SHOWN_AFTER: Duration = Duration::from_millis(20);

/// A thread that sleeps 2 ms was held up if it gets no core for this time.
const HELD_UP: Duration = Duration::from_millis(20);

/// A network that is connected to this one until the test cuts it off.
struct Network {
    /// A process that keeps the network alive.
    keeper: Child,
}

impl Network {
    fn new() -> Self {
        ip(&["link", "set", "lo", "up"]);
        let keeper = Command::new("unshare")
            .args(["--net", "sleep", "infinity"])
            .stdin(Stdio::null())
            .spawn()
            .expect("`unshare` is there");
        let network = Self { keeper };
        let own = fs::read_link("/proc/self/ns/net").expect("Linux has it");
        wait_for("the other network", || {
            let theirs = fs::read_link(network.path()).ok()?;
            (theirs != own).then_some(())
        });
        let keeper = network.keeper.id().to_string();
        let peer = ["type", "veth", "peer", "name", "lager1", "netns", &keeper];
        ip(&[&["link", "add", "lager0"], &peer[..]].concat());
        ip(&["address", "add", &format!("{OURS}/30"), "dev", "lager0"]);
        ip(&["link", "set", "lager0", "up"]);
        let address = format!("{THEIRS}/30");
        network.ip(&["address", "add", &address, "dev", "lager1"]);
        network.ip(&["link", "set", "lo", "up"]);
        network.comes_back();
        network
    }

    fn path(&self) -> String {
        format!("/proc/{}/ns/net", self.keeper.id())
    }

    /// Runs `make` in a thread of that network.
    fn inside<T: Send>(&self, make: impl FnOnce() -> T + Send) -> T {
        let network = File::open(self.path()).expect("it is kept");
        let enter = move || {
            let kind = Some(LinkNameSpaceType::Network);
            move_into_link_name_space(network.as_fd(), kind).expect("this is its root");
            make()
        };
        std::thread::scope(|scope| scope.spawn(enter).join().expect("no panic"))
    }

    /// From now on nothing arrives in that network and nothing leaves it.
    fn vanishes(&self) {
        self.ip(&["link", "set", "lager1", "down"]);
    }

    fn comes_back(&self) {
        self.ip(&["link", "set", "lager1", "up"]);
    }

    fn ip(&self, arguments: &[&str]) {
        let keeper = self.keeper.id().to_string();
        let enter = ["nsenter", "--target", &keeper, "--net", "ip"];
        runs(&[&enter[..], arguments].concat());
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _ = self.keeper.kill();
        let _ = self.keeper.wait();
        // The link goes when either network goes, but a network may live on for a moment.
        let _ = Command::new("ip")
            .args(["link", "del", "lager0"])
            .stderr(Stdio::null())
            .status();
    }
}

fn ip(arguments: &[&str]) {
    runs(&[&["ip"], arguments].concat());
}

fn runs(words: &[&str]) {
    let status = Command::new(words[0]).args(&words[1..]).status();
    assert!(status.is_ok_and(|status| status.success()), "{words:?}");
}

/// The network for this test. Outside its namespace the test runs itself again as root of one; then
/// this returns `None` when that run has passed.
fn apart(test: &str) -> Option<Network> {
    if std::env::var_os(INSIDE).is_some() {
        return Some(Network::new());
    }
    // Each such test is a process of its own, and a small machine can drive only one robot in time.
    let _until_it_ends = alone();
    let again = Command::new("unshare")
        .args(APART)
        .arg(std::env::current_exe().expect("this program"))
        .args([test, "--exact", "--ignored", "--nocapture"])
        .env(INSIDE, "1")
        .stderr(Stdio::inherit())
        .output()
        .expect("`unshare` is there");
    let said = String::from_utf8_lossy(&again.stdout);
    println!("{said}");
    assert!(
        again.status.success() && said.contains("1 passed"),
        "{}",
        again.status
    );
    None
}

/// A robot that a station in the other network drives.
fn driven(network: &Network, is_extended: bool) -> (Scene, Peer<TcpStream>) {
    let listener = network.inside(|| TcpListener::bind((THEIRS, 0)).expect("a port"));
    let mut scene = Scene::with(listener);
    let robot = scene.drive(is_extended);
    (scene, robot)
}

#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn a_robot_stands_within_200_ms_when_the_machine_of_its_station_vanishes() {
    let Some(network) =
        apart("a_robot_stands_within_200_ms_when_the_machine_of_its_station_vanishes")
    else {
        return;
    };
    let (mut scene, mut robot) = driven(&network, true);
    let bus = scene.domain.observe("r1", 1.0);
    let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
    let mut good = 0;
    while good < 3 {
        let cut_ns = Clock::monotonic_ns();
        network.vanishes();
        let (mut last, mut held_up) = (Instant::now(), Duration::ZERO);
        let after = wait_for("the robot to stand", || {
            // This thread sleeps 2 ms at a time.
            held_up = held_up.max(last.elapsed());
            last = Instant::now();
            let truth = truth.receive().expect("readable")?;
            let seen_ns = truth.stamp().publish_time_ns;
            let stands = (truth.left_duty, truth.right_duty) == (0, 0);
            (stands && seen_ns > cut_ns).then(|| Duration::from_nanos(seen_ns - cut_ns))
        });
        let [ms, held_up_ms] = [after, held_up].map(|time| time.as_millis());
        println!("the robot stood {ms} ms after the cut; this machine was held up {held_up_ms} ms");
        let is_in_time = after <= STANDS_WITHIN + SHOWN_AFTER;
        // A time taken while the machine was held up says nothing, so the test measures once more.
        assert!(is_in_time || held_up > HELD_UP, "{after:?}");
        good += u32::from(is_in_time);
        // When the link is back, the robot waits for a new command and carries out no old one.
        network.comes_back();
        drop(robot);
        robot = scene.robot();
        robot.waits_for(&["styrcomm"]);
        assert_eq!(scene.duties().unwrap_or_default(), (0, 0));
        drop(robot);
        robot = scene.drive(true);
        while truth.receive().expect("readable").is_some() {}
    }
}

/// The document's language has no sign of life, so here the kernel has to detect the loss.
#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn a_robot_stands_when_the_machine_of_a_plain_station_vanishes() {
    let Some(network) = apart("a_robot_stands_when_the_machine_of_a_plain_station_vanishes") else {
        return;
    };
    let (mut scene, robot) = driven(&network, false);
    let start = Instant::now();
    network.vanishes();
    scene.wait_until_it_stands();
    println!("the robot stood after {} ms", start.elapsed().as_millis());
    network.comes_back();
    drop(robot);
    scene.robot().waits_for(&["styrcomm"]);
}

#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn what_was_given_while_the_link_was_cut_moves_nothing_when_it_is_back() {
    let Some(network) =
        apart("what_was_given_while_the_link_was_cut_moves_nothing_when_it_is_back")
    else {
        return;
    };
    let listener = network.inside(|| TcpListener::bind((THEIRS, 0)).expect("a port"));
    let mut scene = Scene::with(listener);
    let server = Server::open(ServerConfig {
        name: Name::new("tester").expect("a name"),
        listen: Listen::On(scene.listener()),
        secrets: Secrets::default(),
        gag: None,
        otherwise: None,
        queues: None,
        history: None,
        warehouse: None,
        fetch: Vec::new(),
    });
    let server = server.expect("a station");
    let handle = server.handle();
    let ends = Arc::new(AtomicBool::new(false));
    let until = Arc::clone(&ends);
    let serves = std::thread::spawn(move || server.run(&until).expect("it serves"));
    let robot = Name::new("r1").expect("a name");
    let shows = || {
        let view = handle.robots().pop()?;
        let is_new = view.shown.state?.age(view.now) < Duration::from_millis(200);
        is_new.then_some(())
    };
    for cut in [600, 1_000, 2_000] {
        wait_for("the robot to show itself", shows);
        let anna = handle.take_wheel(&robot, "anna").expect("the seat is free");
        network.vanishes();
        // By now every command that the cut delayed has arrived.
        std::thread::sleep(Duration::from_millis(100));
        let asked = anna.drive(read_wheels("8").expect("a code"));
        std::thread::sleep(Duration::from_millis(cut));
        network.comes_back();
        scene.assert_it_stays(Duration::from_millis(cut + 1_000));
        let reply = asked.ok().and_then(|asked| asked.wait(scene::WATCHDOG));
        println!("a turn that was cut off for {cut} ms: {reply:?}");
        assert_ne!(reply, Some(lager_station::Reply::Done));
    }
    ends.store(true, Ordering::SeqCst);
    serves.join().expect("it has ended");
}

/// A robot's connection to its station: it sends one line, and then waits.
fn robot(at: SocketAddr, name: &str) -> BufReader<TcpStream> {
    let stream = TcpStream::connect(at).expect("it listens");
    stream
        .set_read_timeout(Some(scene::WATCHDOG))
        .expect("a socket");
    let mut robot = BufReader::new(stream);
    let _ = writeln!(robot.get_mut(), "lager 1 {name}");
    robot
}

fn is_answered(robot: &mut BufReader<TcpStream>) -> bool {
    let mut line = String::new();
    robot.read_line(&mut line).is_ok_and(|count| count > 0)
}

#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn robots_whose_machine_vanishes_are_shown_as_away_and_leave_their_places() {
    let Some(network) =
        apart("robots_whose_machine_vanishes_are_shown_as_away_and_leave_their_places")
    else {
        return;
    };
    let server = Server::open(ServerConfig {
        name: Name::new("tester").expect("a name"),
        listen: Listen::At(format!("{OURS}:0").parse().expect("an address")),
        secrets: Secrets::default(),
        gag: None,
        warehouse: None,
        otherwise: None,
        queues: None,
        history: None,
        fetch: Vec::new(),
    });
    let server = server.expect("a station");
    let (handle, at) = (server.handle(), server.address().expect("an address"));
    let ends = Arc::new(AtomicBool::new(false));
    let until = Arc::clone(&ends);
    let serves = std::thread::spawn(move || server.run(&until).expect("it serves"));

    // As many as the station has places for one address, and one more.
    let crowd = network.inside(|| {
        let robots = 0..Station::MOST_OF_ONE_ADDRESS;
        let robots = robots.map(|number| robot(at, &format!("far-{number}")));
        let mut robots: Vec<_> = robots.collect();
        assert!(robots.iter_mut().all(is_answered));
        let mut one_more = robot(at, "far-too-many");
        let mut line = String::new();
        one_more.read_line(&mut line).expect("it is told");
        assert!(line.starts_with("thought "), "there is no place: {line}");
        robots
    });
    let away = || {
        let robots = handle.robots();
        let away = robots.iter().filter(|view| view.doing == Doing::Away);
        away.count()
    };
    assert_eq!(away(), 0);
    let start = Instant::now();
    network.vanishes();
    wait_for("all of them to be shown as away", || {
        (away() == crowd.len()).then_some(())
    });
    println!("all were away after {} ms", start.elapsed().as_millis());
    assert!(is_answered(&mut robot(at, "near")), "there is room");
    ends.store(true, Ordering::SeqCst);
    serves.join().expect("it has ended");
    network.comes_back();
}
