//! Tests of a robot and an external computer that speak the extension: the robot's reports, its
//! actions on request, and who drives it.

use std::collections::BTreeMap;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::command::read_wheels;
use lager_lines::extension::State;
use lager_lines::secret::Secrets;
use lager_orders::Action;
use lager_station::{Handle, Listen, Reply, Server, ServerConfig};
use lager_tests::wait_for;

use crate::scene::{Peer, Scene, WATCHDOG, answer_to_sign};

/// A station written from the extension's grammar alone; it knows the robot's warehouse.
struct Station {
    robot: Peer<TcpStream>,
    /// The fields of the robot's last state.
    state: BTreeMap<String, String>,
    /// The robot's real place.
    truth: Option<(i32, i32)>,
    number: u32,
}

impl Station {
    fn new(robot: Peer<TcpStream>) -> Self {
        Self {
            robot,
            state: BTreeMap::new(),
            truth: None,
            number: 0,
        }
    }

    /// The next line; `None` when the connection has ended. Answers the lines that need an answer.
    fn hears(&mut self) -> Option<String> {
        let line = self.robot.hears()?;
        if let Some(answer) = answer_to_sign(&line) {
            self.robot.says(&answer);
        }
        match line.as_str() {
            "sidelength" => self.robot.says("sidelength 50"),
            "karta" => self.robot.says("karta 2 2 0 0"),
            "prodlis" => self.robot.says("prodlis 3 1 1 0 down 2 0 1 up 3 1 1 left"),
            _ => {}
        }
        if let Some(fields) = line.strip_prefix("state ") {
            let fields = fields.split(' ').filter_map(|field| field.split_once('='));
            self.state = fields
                .map(|(key, value)| (key.to_owned(), value.to_owned()))
                .collect();
        }
        if let Some(truth) = line.strip_prefix("truth ") {
            let mut numbers = truth.split(' ').map_while(|number| number.parse().ok());
            self.truth = numbers.next().zip(numbers.next());
        }
        Some(line)
    }

    fn number(&self, key: &str) -> Option<i32> {
        self.state.get(key)?.parse().ok()
    }

    /// The place that the robot reports.
    fn pose(&self) -> Option<(i32, i32)> {
        Some((self.number("x_mm")?, self.number("y_mm")?))
    }

    /// Asks for an action; returns the robot's answer, or `None` if the connection ends before it.
    fn asks(&mut self, action: &str) -> Option<Result<(), String>> {
        self.number += 1;
        let number = self.number;
        self.robot.says(&format!("do {number} {action}"));
        let refused = format!("refused {number} ");
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < WATCHDOG, "{action} is not answered");
            let line = self.hears()?;
            if line == format!("done {number}") {
                return Some(Ok(()));
            }
            if let Some(why) = line.strip_prefix(&refused) {
                return Some(Err(why.to_owned()));
            }
        }
    }

    /// Hears lines until `shown` is true of the state; false if the connection ends before.
    fn hears_until(&mut self, what: &str, shown: impl Fn(&Self) -> bool) -> bool {
        let start = Instant::now();
        while !shown(self) {
            assert!(start.elapsed() < WATCHDOG, "{what}: {:?}", self.state);
            if self.hears().is_none() {
                return false;
            }
        }
        true
    }
}

#[test]
fn a_station_sees_the_robot_drive_to_what_it_has_ordered() {
    let scene = Scene::new();
    // If the machine is held up, the robot closes the link by hand and connects again. By then
    // logic knows its map.
    let mut station = loop {
        let mut station = Station::new(scene.robot());
        let is_ready = station.hears_until("it waits for an order", |station| {
            station.state.get("phase").map(String::as_str) == Some("waiting_for_order")
        });
        if is_ready && station.asks("mode autonomous") == Some(Ok(())) {
            break station;
        }
    };
    let refused = station.asks("drive 2 200").expect("a reply");
    assert!(refused.is_err(), "logic steers");
    let refused = station.asks("order 3 9").expect("a reply");
    assert_eq!(refused.unwrap_err(), "failure_unknown_product 9");
    assert_eq!(station.asks("order 4 1"), Some(Ok(())));
    assert!(station.hears_until("it is on its order", |station| {
        station.number("order") == Some(4) && station.number("product") == Some(1)
    }));
    let (x, y) = station.pose().expect("a place");
    assert!(station.hears_until("it moves", |station| {
        let moved = station
            .pose()
            .map(|now| (now.0 - x).abs() + (now.1 - y).abs());
        moved.is_some_and(|moved| moved >= 200)
    }));
    // The reported place is near the real one. The robot moves a little between the two lines.
    let ((x, y), (true_x, true_y)) = station.pose().zip(station.truth).expect("both are told");
    let off = (x - true_x).abs().max((y - true_y).abs());
    assert!(off < 150, "({x}, {y}) and ({true_x}, {true_y})");
    let event = loop {
        let line = station.hears().expect("the link lasts");
        if line.starts_with("event in_position ") {
            break line;
        }
    };
    assert!(event.ends_with(" 4 1"), "{event}");
    // With what seem to be real boards, the robot waits for a person to pick.
    assert_eq!(station.asks("picked force"), Some(Ok(())));
    assert!(station.hears_until("it leaves the goods", |station| {
        station
            .state
            .get("phase")
            .is_some_and(|phase| phase == "exiting" || phase == "driving")
    }));
}

#[test]
fn a_drive_that_nobody_renews_ends_while_the_link_lasts() {
    let mut scene = Scene::new();
    // If the machine is held up, the drive or the link ends, and the test tries again.
    'connected: loop {
        let mut station = Station::new(scene.robot());
        // When a state comes, the station knows that the robot speaks the extension.
        if !station.hears_until("a state", |station| !station.state.is_empty()) {
            continue;
        }
        let turn = |station: &Station| station.number("left_duty").is_some_and(|duty| duty > 0);
        while !turn(&station) {
            if station.asks("drive 2 150").is_none() {
                continue 'connected;
            }
        }
        // While it is renewed, it goes on without a new command.
        let (since, mut renewed) = (Instant::now(), 0);
        while since.elapsed() < Duration::from_millis(500) {
            match station.asks("drive 2 150") {
                Some(done) => renewed += u32::from(done.is_ok()),
                None => continue 'connected,
            }
        }
        assert!(renewed > 0, "it was never renewed");
        // From here on nobody renews it, and the station still answers the sign of life.
        if station.hears_until("it stands", |station| !turn(station)) {
            assert_eq!(station.number("stopped"), Some(0), "it was not stopped");
            break;
        }
    }
    scene.wait_until_it_stands();
}

/// A station of this project, in this process.
pub(crate) struct Served {
    pub(crate) handle: Handle,
    ends: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Served {
    pub(crate) fn new(scene: &Scene) -> Self {
        let server = Server::open(ServerConfig {
            name: Name::new("tester").expect("a name"),
            listen: Listen::On(scene.listener()),
            secrets: Secrets::default(),
            gag: None,
            warehouse: None,
            otherwise: None,
            queues: None,
            history: None,
            fetch: Vec::new(),
        });
        let server = server.expect("a station");
        let ends = Arc::new(AtomicBool::new(false));
        let until = Arc::clone(&ends);
        Self {
            handle: server.handle(),
            ends,
            thread: Some(std::thread::spawn(move || {
                server.run(&until).expect("it serves");
            })),
        }
    }

    /// The robot's last state, if it is fresh.
    pub(crate) fn state(&self) -> Option<State> {
        let view = self.handle.robots().pop()?;
        let state = view.shown.state?;
        (state.age(view.now) < Duration::from_millis(500)).then_some(state.value)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(std::thread::JoinHandle::join);
    }
}

#[test]
fn one_drives_a_second_is_refused_and_anybody_stops() {
    let mut scene = Scene::new();
    let station = Served::new(&scene);
    let (handle, robot) = (&station.handle, Name::new("r1").expect("a name"));
    wait_for("the robot to show itself", || station.state());
    let anna = handle.take_wheel(&robot, "anna").expect("the seat is free");
    let refused = handle.take_wheel(&robot, "bo").expect_err("it is taken");
    assert!(refused.to_string().starts_with("anna drives"), "{refused}");

    let forward = read_wheels("2").expect("a code");
    wait_for("the wheels to turn", || {
        // On a machine that is held up, the robot may be away for a moment.
        let _ = anna.drive(forward);
        std::thread::sleep(Duration::from_millis(50));
        station.state().filter(|state| state.left_duty > Some(0))
    });
    drop(anna);
    scene.wait_until_it_stands();
    let bo = handle.take_wheel(&robot, "bo").expect("the seat is free");

    wait_for("a stop to be confirmed", || {
        match handle.stop(&robot).ok()??.wait(WATCHDOG) {
            Some(Reply::Stopped { .. }) => Some(()),
            _ => None,
        }
    });
    let refused = wait_for("an answer", || {
        bo.drive(forward)
            .ok()?
            .wait(WATCHDOG)
            .filter(|reply| *reply != Reply::Lost)
    });
    let Reply::Refused(why) = refused else {
        panic!("{refused:?}: it is stopped");
    };
    assert!(why.to_string().contains("stopped"), "{why}");
    wait_for("the stop to be released", || {
        let stop = station.state()?.stop?;
        let resumed = handle.act(&robot, Action::Resume { stop }).ok()?;
        (resumed.wait(WATCHDOG) == Some(Reply::Done)).then_some(())
    });
    wait_for("the wheels to turn again", || {
        let _ = bo.drive(forward);
        std::thread::sleep(Duration::from_millis(50));
        station.state().filter(|state| state.left_duty > Some(0))
    });
}
