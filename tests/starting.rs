//! Tests that real boards start as a person without a shell needs it: they wait for a warehouse,
//! keep the one that somebody sets up at the panel, and stand until they are released.

use std::fs;
use std::net::TcpStream;
use std::time::Duration;

use lager_floor::Node;
use lager_plant::Warehouse;
use lager_ports::{Bus, Subscriber};
use lager_rig::behind_ports;
use lager_stop::{Stop, StopWord};
use lager_tests::{Domain, Running, WATCHDOG, children, has_ended, wait_for};
use lager_topics::{LinkHealth, NavMap, NavStatus, Phase, TruthPose};
use rustix::process::Signal;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// Boards that run for themselves, as real ones do, and a robot that nobody tells of a warehouse.
struct Scene {
    domain: Domain,
    config: String,
    body: Running,
}

impl Scene {
    fn new() -> Self {
        let domain = Domain::new();
        let port = |name: &str| domain.folder().join(name);
        let [sensor, steering] = ["sensor.tty", "steering.tty"].map(port);
        let config = port("robot.toml");
        let text = behind_ports(&sensor, &steering).expect("a description");
        fs::write(&config, text).expect("a configuration file");
        let config = config.to_str().expect("UTF-8").to_owned();
        let body = domain.start(&["--config", &config, "simulator"]);
        Self {
            domain,
            config,
            body,
        }
    }

    fn up(&self) -> (Running, Seen) {
        let here = "127.0.0.1:0";
        let args = ["up", "--listen", here, "--panel", here];
        let up = self
            .domain
            .start(&[&["--config", &self.config][..], &args].concat());
        (up, self.seen())
    }

    /// An observer of the robot, once its boards are ready.
    fn seen(&self) -> Seen {
        wait_for("its boards", || {
            let mut seen = Seen::new(self.domain.observe("r1", 1.0));
            let health = wait_for("its health", || seen.health.latest().expect("readable"));
            health.boards_are_ready().then_some(())?;
            drop(health);
            Some(seen)
        })
    }

    fn stop(&self) -> Option<Stop> {
        let word = StopWord::read(&self.domain.bus_folder().join("r1/stop"));
        word.expect("readable")?.stop()
    }

    fn listed(&self) -> String {
        let listed = self.domain.run(&["queue"]);
        String::from_utf8_lossy(&listed.stdout).into_owned()
    }
}

/// An observer of the robot.
struct Seen {
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    map: Subscriber<NavMap>,
    truth: Subscriber<TruthPose>,
    _bus: Bus,
}

impl Seen {
    fn new(bus: Bus) -> Self {
        Self {
            health: bus.subscriber().expect("a topic"),
            status: bus.subscriber().expect("a topic"),
            map: bus.subscriber().expect("a topic"),
            truth: bus.subscriber().expect("a topic"),
            _bus: bus,
        }
    }

    /// What the boards are described as.
    fn description(&mut self) -> u32 {
        wait_for("a description", || {
            let health = self.health.latest().expect("readable")?;
            (health.description != 0).then_some(health.description)
        })
    }

    /// Waits until logic is in this phase, and returns where it believes the robot to be.
    fn phase(&mut self, phase: Phase) -> Node {
        wait_for(&format!("{phase:?}"), || {
            let status = self.status.latest().expect("readable")?;
            let at = |axis: i16| u8::try_from(axis).expect("on the floor");
            (status.phase == phase).then(|| Node::new(at(status.x), at(status.y)))
        })
    }

    /// In the next half second logic stays in this phase, and the wheels stand.
    fn stays(&mut self, phase: Phase) {
        for _ in 0..10 {
            std::thread::sleep(Duration::from_millis(50));
            if let Some(status) = self.status.latest().expect("readable") {
                assert_eq!(status.phase, phase);
            }
            if let Some(truth) = self.truth.latest().expect("readable") {
                assert_eq!((truth.left_duty, truth.right_duty), (0, 0));
            }
        }
    }
}

/// The panel's page of the person who drives.
struct Page(WebSocket<TcpStream>);

impl Page {
    fn of(up: &Running) -> Self {
        let (host, token) = wait_for("the panel's address", || {
            let told = up.log() + &up.output();
            let (_, rest) = told.split_once("the panel is at http://")?;
            let (host, rest) = rest.split_once("/?token=")?;
            let token: String = rest.chars().take_while(|c| !c.is_whitespace()).collect();
            Some((host.to_owned(), token))
        });
        let stream = wait_for("the panel", || TcpStream::connect(&host).ok());
        stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
        let (_, port) = host.rsplit_once(':').expect("a port");
        let mut request = format!("ws://{host}/live?name=Anna")
            .into_client_request()
            .expect("an address");
        let headers = request.headers_mut();
        let cookie = format!("lager-token-{port}={token}");
        headers.insert(
            "origin",
            format!("http://{host}").parse().expect("a header"),
        );
        headers.insert("cookie", cookie.parse().expect("a header"));
        let (socket, _) = tungstenite::client(request, stream).expect("a page");
        Self(socket)
    }

    /// Saves a warehouse, and returns what the panel says of it.
    fn save(&mut self, warehouse: &Warehouse) -> String {
        let json = serde_json::to_string(warehouse).expect("JSON");
        let line = format!("warehouse 1 {json}");
        self.0.send(Message::text(line)).expect("it listens");
        loop {
            let Message::Text(text) = self.0.read().expect("an answer") else {
                continue;
            };
            if let Some(line) = text.lines().find(|line| line.starts_with("answer 1 ")) {
                return line.to_owned();
            }
        }
    }
}

/// A warehouse that is not the built-in one, on the floor of the simulated world.
fn hall() -> Warehouse {
    let mut hall = Warehouse::builtin("small").expect("built in");
    hall.products.truncate(1);
    hall.products[0].id = 42;
    hall.products[0].name = Some("screws".into());
    hall
}

/// Waits until `up` has told this; the terminal is told a little later than the bus.
fn says(up: &Running, what: &str) {
    wait_for(what, || up.output().contains(what).then_some(()));
}

fn kill(up: &mut Running) {
    let services = children(up.pid());
    up.signal(Signal::KILL);
    up.wait();
    for service in services {
        wait_for("its service to end", || has_ended(service).then_some(()));
    }
}

#[test]
fn real_boards_wait_for_a_warehouse_and_keep_it_and_their_orders_over_a_kill() {
    let scene = Scene::new();
    let (mut up, mut seen) = scene.up();
    seen.phase(Phase::WaitingForMap);
    seen.stays(Phase::WaitingForMap);
    assert!(seen.map.latest().expect("readable").is_none());
    says(&up, "the robot waits for a warehouse");
    let refused = scene.domain.run(&["queue", "add", "screws"]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && said.contains("no warehouse yet"),
        "{said}"
    );

    let kept = scene.domain.bus_folder().join(".state/r1/warehouse.toml");
    let told = Page::of(&up).save(&hall());
    assert!(told.starts_with("answer 1 done saved_in "), "{told}");
    assert!(told.contains(&*kept.to_string_lossy()), "{told}");
    assert_eq!(seen.phase(Phase::WaitingForOrder), hall().delivery);
    let map = wait_for("its map", || seen.map.latest().expect("readable"));
    let known = *map;
    drop(map);
    scene.domain.done(&["queue", "add", "screws"]);
    let fetches = "goods 42";
    wait_for("its order", || {
        scene.listed().contains(fetches).then_some(())
    });
    // The supervisor writes it down in its own time.
    let orders = scene.domain.bus_folder().join(".state/r1/orders.toml");
    wait_for("its order on the disk", || {
        let text = fs::read_to_string(&orders).ok()?;
        text.contains("42").then_some(())
    });
    // Somebody lets it go, so what stands before the next start is no stop.
    scene.domain.done(&["resume"]);
    wait_for("the resume", || scene.stop().is_none().then_some(()));
    drop(seen);
    kill(&mut up);

    let (mut up, mut seen) = scene.up();
    says(&up, "was saved in");
    assert_eq!(seen.phase(Phase::WaitingForOrder), hall().delivery);
    let map = wait_for("its map", || seen.map.latest().expect("readable"));
    assert_eq!(*map, known, "the same warehouse");
    drop(map);
    wait_for("its order again", || {
        scene.listed().contains(fetches).then_some(())
    });
    assert!(scene.stop().is_some_and(Stop::is_of_fresh_start));
    scene.domain.done(&["mode", "autonomous"]);
    wait_for("its mode", || {
        let health = seen.health.latest().expect("readable")?;
        (health.mode == lager_orders::Mode::Autonomous).then_some(())
    });
    // It has its order, and stands until it is released.
    std::thread::sleep(Duration::from_millis(300));
    if let Some(truth) = seen.truth.latest().expect("readable") {
        assert_eq!((truth.left_duty, truth.right_duty), (0, 0));
    }
    scene.domain.done(&["resume"]);
    wait_for("the robot to drive", || {
        let truth = seen.truth.latest().expect("readable")?;
        (truth.left_duty > 0).then_some(())
    });
    drop(seen);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let Scene { domain, body, .. } = scene;
    drop(body);
    domain.assert_clean();
}

#[test]
fn real_boards_start_again_with_the_description_that_is_saved_and_stand_until_they_are_released() {
    let scene = Scene::new();
    let restart = ["--config", &scene.config, "commission", "--restart"];
    let refused = scene.domain.run(&restart);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && said.contains("`lager up`"),
        "{said}"
    );

    let (mut up, mut seen) = scene.up();
    seen.phase(Phase::WaitingForMap);
    let told = Page::of(&up).save(&hall());
    assert!(told.starts_with("answer 1 done saved_in "), "{told}");
    seen.phase(Phase::WaitingForOrder);
    scene.domain.done(&["resume"]);
    scene.domain.done(&["mode", "autonomous"]);
    // It is on its way when somebody has it started again.
    scene.domain.done(&["queue", "add", "screws"]);
    wait_for("the robot to drive", || {
        let truth = seen.truth.latest().expect("readable")?;
        (truth.left_duty > 0).then_some(())
    });
    let described = seen.description();
    let file = scene.domain.folder().join("described.toml");
    // A description that cannot be used changes nothing, but the robot stands.
    fs::write(&file, "wheels = 3\n").expect("a file");
    drop(seen);
    let refused = scene.domain.start(&restart);
    says(&up, "goes on with what it had");
    drop(refused);
    assert_eq!(
        scene.stop().map(|stop| stop.is_of_fresh_start()),
        Some(false)
    );
    scene.domain.done(&["resume"]);

    fs::write(&file, "[wheels]\nfull_turn_ms = 9000\n").expect("a file");
    scene.domain.done(&restart);
    says(&up, "starts again with what was saved");
    let mut seen = scene.seen();
    assert_ne!(seen.description(), described);
    assert!(scene.stop().is_some_and(|stop| !stop.is_of_fresh_start()));
    // It has its order, and stands until somebody releases the stop.
    wait_for("its order again", || {
        scene.listed().contains("goods 42").then_some(())
    });
    scene.domain.done(&["mode", "autonomous"]);
    // The world was on the bus of before, so the navigator says whether it drives.
    let mut travelled_mm = || {
        let status = seen.status.latest().expect("readable");
        status.map_or(0, |status| status.travelled_mm)
    };
    for _ in 0..10 {
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(travelled_mm(), 0);
    }
    scene.domain.done(&["resume"]);
    wait_for("the robot to drive", || (travelled_mm() > 0).then_some(()));
    drop(seen);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let Scene { domain, body, .. } = scene;
    drop(body);
    domain.assert_clean();
}

#[test]
fn a_kept_warehouse_that_cannot_be_read_is_put_aside_and_the_robot_waits_for_another() {
    let scene = Scene::new();
    let state = scene.domain.bus_folder().join(".state/r1");
    fs::create_dir_all(&state).expect("a folder");
    fs::write(state.join("warehouse.toml"), "size = ").expect("a file");
    let (mut up, mut seen) = scene.up();
    seen.phase(Phase::WaitingForMap);
    says(&up, "cannot be used");
    says(&up, "damaged-");
    assert!(!state.join("warehouse.toml").exists());
    drop(seen);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
}
