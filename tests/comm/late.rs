//! Tests with processes that freeze for a while with an order in their input: the order moves
//! nothing later, and its giver is told.

use std::io::BufReader;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::extension::State;
use lager_orders::Action;
use lager_station::Reply;
use lager_tests::{pid, wait_for};
use lager_topics::LinkHealth;
use rustix::process::{Signal, kill_process};

use crate::extended::Served;
use crate::scene::{Peer, Scene, WATCHDOG};
use crate::station_at;

/// How long a process is frozen.
const FROZEN: Duration = Duration::from_millis(1_000);
/// How long the test watches after that, while nothing may move.
const AFTER: Duration = Duration::from_millis(700);

/// A frozen process; it runs again when this is dropped, whether the test passes or fails.
struct Frozen(u32);

impl Frozen {
    fn new(process: u32) -> Self {
        kill_process(pid(process), Signal::STOP).expect("it runs");
        Self(process)
    }
}

impl Drop for Frozen {
    fn drop(&mut self) {
        let _ = kill_process(pid(self.0), Signal::CONT);
    }
}

#[test]
fn a_resume_that_comm_finds_when_it_thaws_releases_no_stop() {
    let scene = Scene::new();
    let station = Served::new(&scene);
    let robot = Name::new("r1").expect("a name");
    let bus = scene.domain.observe("r1", 1.0);
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    scene.domain.done(&["stop"]);
    for is_stopped_again in [true, false] {
        let shown = |state: State| state.stop.filter(|_| state.stopped == Some(true));
        let in_force = wait_for("the bridge to tell the stop", || {
            let health = health.latest().expect("readable")?;
            Some(health.stop_word).filter(|word| *word != 0)
        });
        let stop = wait_for("the stop to be shown", || {
            station
                .state()
                .and_then(shown)
                .filter(|stop| *stop == in_force)
        });
        let comm = Frozen::new(scene.up.service("comm").expect("it runs"));
        let Ok(asked) = station.handle.act(&robot, Action::Resume { stop }) else {
            panic!("the robot is connected");
        };
        if is_stopped_again {
            // A person beside the robot gives this stop, and sees the robot stand.
            scene.domain.done(&["stop"]);
        }
        std::thread::sleep(FROZEN);
        drop(comm);
        let reply = asked.wait(WATCHDOG);
        assert!(
            matches!(reply, Some(Reply::Refused(_) | Reply::Lost)),
            "{reply:?}"
        );
        let start = Instant::now();
        while start.elapsed() < AFTER {
            if let Some(health) = health.latest().expect("readable") {
                assert_eq!(health.stopped, 1, "{reply:?}");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    // A new request, which names the stop that the station shows, succeeds.
    wait_for("the stop to be released", || {
        let stop = station.state()?.stop?;
        let resumed = station.handle.act(&robot, Action::Resume { stop }).ok()?;
        (resumed.wait(WATCHDOG) == Some(Reply::Done)).then_some(())
    });
}

/// A GaG connected to this socket.
fn gag(socket: &Path) -> Peer<UnixStream> {
    let stream = UnixStream::connect(socket).expect("it listens");
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    Peer(BufReader::new(stream))
}

/// Whether the next question is for a command. Before, a robot may still ask about the warehouse.
fn asks_for_a_command(gag: &mut Peer<UnixStream>) -> bool {
    gag.waits_for(&["sidelength", "karta", "prodlis", "styrcomm"]) == "styrcomm"
}

#[test]
fn a_command_that_a_station_finds_when_it_thaws_moves_nothing() {
    let domain = lager_tests::Domain::among_others();
    let socket = domain.folder().join("gag");
    let (station, address) = station_at(&domain, "127.0.0.1:0", &[]);
    let mut scene = Scene::at(domain, &address);
    let mut gag = gag(&socket);
    for command in ["styrcomm 6", "styrcomm 8"] {
        while !asks_for_a_command(&mut gag) {}
        scene.assert_it_stays(Duration::from_millis(50));
        let frozen = Frozen::new(station.pid());
        gag.says(command);
        std::thread::sleep(FROZEN);
        drop(frozen);
        scene.assert_it_stays(AFTER);
        let told = loop {
            let line = gag.hears().expect("it goes on");
            if line.contains("ms late") {
                break line;
            }
        };
        assert!(told.starts_with("thought styrcomm 0000"), "{told}");
    }
}

#[test]
fn a_gag_that_freezes_while_it_drives_makes_the_robot_stand_and_learns_why() {
    let domain = lager_tests::Domain::among_others();
    let socket = domain.folder().join("gag");
    let (_station, address) = station_at(&domain, "127.0.0.1:0", &[]);
    let mut scene = Scene::at(domain, &address);
    let mut gag = gag(&socket);
    let start = Instant::now();
    while scene.duties().is_none_or(|(left, _)| left == 0) {
        assert!(start.elapsed() < WATCHDOG, "the robot does not drive");
        if asks_for_a_command(&mut gag) {
            gag.says("styrcomm 6");
            // The wheels need a moment to start.
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    // From here on the peer reads nothing, but its connection stays open.
    scene.wait_until_it_stands();
    scene.assert_it_stays(AFTER);
    let why = loop {
        let line = gag.hears().expect("the conversation goes on");
        if line.contains("read nothing") {
            break line;
        }
    };
    assert!(why.contains("so the robot stands"), "{why}");
}

#[test]
fn a_reset_that_logic_finds_when_it_thaws_is_not_taken() {
    let scene = Scene::new();
    let station = Served::new(&scene);
    let robot = Name::new("r1").expect("a name");
    wait_for("the robot to show itself", || station.state());
    let logic = Frozen::new(scene.up.service("logic").expect("it runs"));
    let asked = station.handle.act(&robot, Action::Reset);
    assert!(asked.is_ok(), "{asked:?}");
    std::thread::sleep(FROZEN);
    drop(logic);
    wait_for("logic to refuse it", || {
        let refused = "ms late and is not taken";
        scene.up.log().contains(refused).then_some(())
    });
}
