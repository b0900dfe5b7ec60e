//! The station through its sockets, with peers that are as they should be and peers that are not.

use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_lines::extension::Proof;
use lager_lines::secret::{Meeting, Nonce, Secrets, Side};
use lager_lines::{Called, Name};
use lager_station::{Handle, Listen, Queues, Server, ServerConfig, ServerError, Wish, load};

use crate::transcript::{WAREHOUSE, product};

/// How long a peer waits for a line before the test has failed.
pub(crate) const WATCHDOG: Duration = Duration::from_secs(20);

/// A station that serves until it is dropped, in a folder of its own.
pub(crate) struct Running {
    folder: PathBuf,
    address: SocketAddr,
    pub(crate) handle: Handle,
    shutdown: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    pub(crate) fn new() -> Self {
        Self::with(|_| {})
    }

    /// One of which something is otherwise.
    pub(crate) fn with(change: impl FnOnce(&mut ServerConfig)) -> Self {
        Self::held_up_by(&Arc::default(), change)
    }

    /// One whose thread goes on only while nobody else has the lock.
    pub(crate) fn held_up_by(
        lock: &Arc<Mutex<()>>,
        change: impl FnOnce(&mut ServerConfig),
    ) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::SeqCst);
        let name = format!("lager-sockets-{}-{count}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join("warehouse.toml"), WAREHOUSE).expect("a file");
        let mut config = config(&folder);
        change(&mut config);
        let mut server = Server::open(config).expect("a station");
        let lock = Arc::clone(lock);
        server.each_turn(move || drop(lock.lock()));
        let shutdown = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&shutdown);
        Self {
            address: server.address().expect("an address"),
            handle: server.handle(),
            thread: Some(std::thread::spawn(move || {
                server.run(&ends).expect("it serves");
            })),
            shutdown,
            folder,
        }
    }

    pub(crate) fn robot(&self) -> Peer<TcpStream> {
        let stream = TcpStream::connect(self.address).expect("it listens");
        stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
        Peer(BufReader::new(stream))
    }

    /// Somebody at the socket for a GaG, whether or not he is let in.
    pub(crate) fn stranger(&self) -> Peer<UnixStream> {
        let stream = UnixStream::connect(self.folder.join("gag")).expect("it listens");
        stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
        Peer(BufReader::new(stream))
    }

    pub(crate) fn folder(&self) -> &std::path::Path {
        &self.folder
    }

    /// A GaG that has been let in, or that is refused because there is one.
    pub(crate) fn gag(&self) -> Peer<UnixStream> {
        let gag = self.stranger();
        let start = std::time::Instant::now();
        while !self.handle.look(lager_station::Station::has_gag) {
            assert!(start.elapsed() < WATCHDOG, "it is not let in");
            std::thread::yield_now();
        }
        gag
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shutdown.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking());
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn config(folder: &std::path::Path) -> ServerConfig {
    ServerConfig {
        name: Name::new("lager").expect("a name"),
        listen: Listen::At(SocketAddr::from(([127, 0, 0, 1], 0))),
        secrets: Secrets::default(),
        gag: Some(folder.join("gag")),
        warehouse: Some(folder.join("warehouse.toml")),
        otherwise: None,
        queues: Some(folder.join("warehouse.toml.queue")),
        history: None,
        fetch: Vec::new(),
    }
}

/// The other end of a socket.
pub(crate) struct Peer<S: Read>(BufReader<S>);

impl<S: Read> Peer<S> {
    /// The next line without its end, `None` where the connection has ended.
    pub(crate) fn hears(&mut self) -> Option<String> {
        let mut line = String::new();
        match self.0.read_line(&mut line) {
            Ok(0) => None,
            Ok(_) => Some(line.trim_end().to_owned()),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => None,
            Err(error) => panic!("nothing came: {error}"),
        }
    }
}

impl Peer<UnixStream> {
    /// It says nothing more, and is still there.
    pub(crate) fn half_closes(&self) {
        // The station may have closed it by now.
        let _ = self.0.get_ref().shutdown(std::net::Shutdown::Write);
    }
}

impl Peer<TcpStream> {
    pub(crate) fn stream(&self) -> &TcpStream {
        self.0.get_ref()
    }
}

impl<S: Read + Write> Peer<S> {
    /// Sends bytes; a station that has closed the connection already is no failure.
    pub(crate) fn says(&mut self, bytes: &[u8]) {
        let _ = self.0.get_mut().write_all(bytes);
    }

    pub(crate) fn asks(&mut self, line: &str) -> String {
        self.says(format!("{line}\r\n").as_bytes());
        self.hears().expect("an answer")
    }
}

#[test]
fn two_robots_and_a_gag_hold_their_conversations() {
    let station = Running::new();
    let (mut one, mut two) = (station.robot(), station.robot());
    assert_eq!(one.asks("lager 1 one"), "lager 1 lager");
    assert_eq!(two.asks("lager 1 two"), "lager 1 lager");
    assert_eq!(one.asks("prodlis"), "prodlis 2 7 1 0 down 12 0 1 left");
    two.says(b"fetch");
    two.says(b"prod\n");
    let mut gag = station.gag();
    one.says(b"fetchprod\n");
    assert_eq!(gag.hears().as_deref(), Some("fetchprod"));
    gag.says(b"fetchprod 12\n");
    assert_eq!(one.hears().as_deref(), Some("fetchprod 12"));

    let name = Name::new("two").expect("a name");
    let handle = &station.handle;
    handle
        .wish(&name, Wish::Fetch(product(7)))
        .expect("it is known");
    assert_eq!(two.hears().as_deref(), Some("fetchprod 7"));
}

#[test]
fn what_a_gag_describes_is_saved() {
    let station = Running::new();
    let mut robot = station.robot();
    let mut gag = station.gag();
    for (question, answer) in [
        ("sidelength", "sidelength 50"),
        ("karta", "karta 2 2 2 0"),
        ("prodlist", "prodlist 1 7 1 1 up"),
    ] {
        robot.says(format!("{question}\n").as_bytes());
        assert_eq!(gag.hears().as_deref(), Some(question));
        gag.says(format!("{answer}\n").as_bytes());
        assert_eq!(robot.hears().as_deref(), Some(answer));
    }
    let file = station.folder.join("warehouse.toml");
    let start = std::time::Instant::now();
    let saved = loop {
        let saved = load(&file).expect("a whole file at any time");
        if saved.size == lager_floor::Node::new(2, 2) {
            break saved;
        }
        assert!(start.elapsed() < WATCHDOG, "it is not saved");
        std::thread::yield_now();
    };
    assert_eq!(saved.side_length_cm, 50);
    assert_eq!(saved.products[0].name.as_deref(), Some("screws"));
}

/// What the file of a station's queues says once it says `wanted`.
fn wait_for_queues(folder: &std::path::Path, wanted: &str) -> Queues {
    let file = Queues::beside(&folder.join("warehouse.toml"));
    let wanted: Queues = toml::from_str(wanted).expect("queues");
    let start = std::time::Instant::now();
    loop {
        let queues = Queues::load(&file).expect("a whole file at any time");
        if queues == wanted {
            return queues;
        }
        assert!(start.elapsed() < WATCHDOG, "{queues:?} is saved");
        std::thread::yield_now();
    }
}

#[test]
fn queues_outlive_a_station_that_was_killed() {
    let station = Running::new();
    let mut robot = station.robot();
    robot.says(b"lager 1 r1\n");
    assert_eq!(robot.hears().as_deref(), Some("lager 1 lager"));
    let r1 = Name::new("r1").expect("a name");
    for number in [7, 12] {
        let wish = Wish::Fetch(product(number));
        station.handle.wish(&r1, wish).expect("it is known");
    }
    wait_for_queues(&station.folder, "r1 = [7, 12]");
    // What was told counts as told once the robot has said another word.
    assert_eq!(robot.asks("fetchprod"), "fetchprod 7");
    robot.says(b"set_robot 1 0\n");
    let saved = wait_for_queues(&station.folder, "r1 = [12]");

    // The next one finds what lies on the disk now, and what it is to add.
    let folder = station.folder.join("next");
    fs::create_dir_all(&folder).expect("a folder");
    let [from, to] = [&station.folder, &folder].map(|folder| folder.join("warehouse.toml"));
    fs::copy(&from, &to).expect("the warehouse");
    fs::copy(Queues::beside(&from), Queues::beside(&to)).expect("the queues");
    let mut next = config(&folder);
    // What waits already is asked for by the same flags at each start.
    let asked = |robot: &str| (Name::new(robot).expect("a name"), product(12).into());
    next.fetch = vec![asked("r2"), asked("r1")];
    let next = Server::open(next).expect("another station");
    let queues = next.handle().look(lager_station::Station::queues);
    assert_eq!(queues.0["r1"], saved.0["r1"]);
    assert_eq!(queues.0["r2"], [12]);

    let r2 = || Name::new("r2").expect("a name");
    let mut named = config(&folder);
    named.fetch = vec![(r2(), Called::Name("screws".into()))];
    drop(next);
    let named = Server::open(named).expect("a third one");
    let queues = named.handle().look(lager_station::Station::queues);
    assert_eq!(queues.0["r2"], [7], "by its name");
    drop(named);
    for (warehouse, known) in [
        (&to, "7 (screws), 12"),
        (&folder.join("none"), "not known yet"),
    ] {
        let mut unknown = config(&folder);
        unknown.warehouse = Some(warehouse.clone());
        unknown.fetch = vec![(r2(), Called::Name("nails".into()))];
        let why = Server::open(unknown).expect_err("nails").to_string();
        assert!(
            why.contains("no goods nails") && why.contains(known),
            "{why}"
        );
    }

    // Without what it cannot have fetched.
    let unknown: Queues = toml::from_str("r1 = [7, 99]\n\"A b\" = [7]").expect("queues");
    unknown.save(&Queues::beside(&to)).expect("it is saved");
    let last = Server::open(config(&folder)).expect("another one");
    let queues = last.handle().look(lager_station::Station::queues);
    assert_eq!(queues, toml::from_str("r1 = [7]").expect("queues"));
}

#[test]
fn who_sends_what_is_no_line_is_closed_and_nobody_else_notices() {
    let station = Running::new();
    let mut good = station.robot();
    assert_eq!(good.asks("sidelength"), "sidelength 40");
    let long = vec![b'a'; 1 << 20];
    for bad in [&long[..], b"th\xFFought\n", b"hello there\n", b"karta 1\n"] {
        let mut peer = station.robot();
        peer.says(bad);
        assert_eq!(peer.hears(), None);
        assert_eq!(good.asks("karta"), "karta 4 3 0 0");
    }
}

/// A thousand sockets are as many as a process may have on some machines.
pub(crate) static CROWD: Mutex<()> = Mutex::new(());

#[test]
fn a_thousand_connections_that_say_nothing_keep_nobody_out() {
    let _crowd = CROWD.lock();
    let station = Running::new();
    let mut good = station.robot();
    assert_eq!(good.asks("sidelength"), "sidelength 40");
    let mut crowd: Vec<_> = (0..1000).map(|_| station.robot()).collect();
    assert_eq!(good.asks("karta"), "karta 4 3 0 0");
    // All of them are there; one that says who it is is let in.
    let mut next = station.robot();
    assert_eq!(next.asks("lager 1 r1"), "lager 1 lager");
    assert_eq!(crowd[0].hears(), None, "others wait");
}

#[test]
fn who_says_one_line_and_stays_leaves_room_for_whoever_proves_who_he_is() {
    let _crowd = CROWD.lock();
    let secret = Secrets::read("r1 0123456789abcdef").expect("a secret");
    let station = Running::with(|config| config.secrets = secret.clone());
    let crowd: Vec<_> = (0..200)
        .map(|_| {
            let mut one = station.robot();
            one.says(b"sidelength\n");
            one
        })
        .collect();
    let r1 = Name::new("r1").expect("a name");
    let secret = secret.of(&r1).expect("it has one");
    for _ in 0..3 {
        let mut robot = station.robot();
        let asked = robot.asks("lager 1 r1");
        let Some(Ok(Proof::Asked(stations))) = Proof::read(&asked) else {
            panic!("{asked}");
        };
        let meeting = Meeting {
            robot: &r1,
            stations,
            robots: Nonce::random().expect("random bytes"),
        };
        let proof = Proof::Robot(meeting.robots, secret.code(Side::Robot, &meeting));
        let answer = robot.asks(&proof.to_string());
        let Some(Ok(Proof::Station(code))) = Proof::read(&answer) else {
            panic!("{answer}");
        };
        assert!(secret.is_proved(Side::Station, &meeting, &code));
        assert_eq!(robot.hears().as_deref(), Some("lager 1 lager"));
        let view = station.handle.robots();
        assert!(view.iter().any(|view| view.name == r1 && view.is_extended));
        drop(robot);
    }
    drop(crowd);
}

#[test]
fn an_impostor_gets_neither_the_name_nor_its_stop_and_both_sides_are_told() {
    let secret = Secrets::read("0123456789abcdef").expect("a secret");
    let station = Running::with(|config| config.secrets = secret);
    let r1 = Name::new("r1").expect("a name");
    for second in ["sidelength", "styrcomm", "lager 1 r1", "stopped 1 3"] {
        let mut impostor = station.robot();
        assert!(impostor.asks("lager 1 r1").starts_with("prove "));
        assert!(station.handle.stop(&r1).is_err(), "there is no robot");
        impostor.says(format!("{second}\n").as_bytes());
        let told = impostor.hears().expect("it is told why");
        assert!(
            told.starts_with("thought somebody says that he is robot r1"),
            "{told}"
        );
        assert_eq!(impostor.hears(), None);
        assert_eq!(station.handle.robots(), []);
    }
}

#[test]
fn a_peer_that_does_not_read_is_closed() {
    let station = Running::new();
    let mut deaf = station.robot();
    let stream = deaf.0.get_mut();
    stream.set_write_timeout(Some(WATCHDOG)).expect("a socket");
    // It asks without end; once its answers fill all buffers it is closed, and writing fails.
    let failed = loop {
        if let Err(error) = stream.write_all(&b"prodlis\n".repeat(512)) {
            break error.kind();
        }
    };
    assert!(
        matches!(failed, ErrorKind::ConnectionReset | ErrorKind::BrokenPipe),
        "{failed:?}"
    );
}

#[test]
fn a_second_gag_is_closed_and_so_is_a_peer_that_says_nothing() {
    let station = Running::new();
    let mut robot = station.robot();
    let mut first = station.gag();
    robot.says(b"fetchprod\n");
    assert_eq!(first.hears().as_deref(), Some("fetchprod"));
    assert_eq!(station.gag().hears(), None);
    let mut silent = station.robot();
    assert_eq!(silent.hears(), None, "it is closed after a while");
    let mut begins = station.robot();
    begins.says(b"sidelen");
    assert_eq!(begins.hears(), None, "its line never ends");
    first.says(b"fetchprod 7\n");
    assert_eq!(robot.hears().as_deref(), Some("fetchprod 7"));
}

#[test]
fn the_socket_of_a_gag_is_its_users_alone_and_a_dead_one_is_replaced() {
    let station = Running::new();
    let path = station.folder.join("gag");
    let mode = fs::metadata(&path).expect("a socket").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let elsewhere = |config: ServerConfig| ServerConfig {
        warehouse: None,
        ..config
    };
    let taken = Server::open(elsewhere(config(&station.folder))).expect_err("another one listens");
    assert!(matches!(taken, ServerError::GagInUse { .. }), "{taken}");

    let dead = station.folder.join("dead");
    drop(std::os::unix::net::UnixListener::bind(&dead).expect("a socket"));
    let config = ServerConfig {
        gag: Some(dead),
        ..elsewhere(config(&station.folder))
    };
    Server::open(config).expect("nobody listens there");
}

#[test]
fn two_stations_do_not_save_in_one_file() {
    let station = Running::new();
    let another = || ServerConfig {
        gag: None,
        ..config(&station.folder)
    };
    let held = Server::open(another()).expect_err("it is held");
    let sentence = format!("is kept by process {}, and two would", std::process::id());
    assert!(held.to_string().contains(&sentence), "{held}");
    let link = station.folder.join("link.toml");
    std::os::unix::fs::symlink("warehouse.toml", &link).expect("a link");
    let by_another_name = ServerConfig {
        warehouse: Some(link),
        ..another()
    };
    let held = Server::open(by_another_name).expect_err("it is the same file");
    assert!(matches!(held, ServerError::Held { .. }), "{held}");
}

#[test]
fn a_damaged_queue_is_moved_aside_and_the_station_serves() {
    let name = format!("lager-aside-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    fs::create_dir_all(&folder).expect("a folder");
    let queue = folder.join("warehouse.toml.queue");
    fs::write(&queue, "r1 = [7, ").expect("a file");
    let config = ServerConfig {
        gag: None,
        warehouse: None,
        ..config(&folder)
    };
    drop(Server::open(config).expect("it serves"));
    let names: Vec<String> = fs::read_dir(&folder)
        .expect("the folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let aside = names
        .iter()
        .find(|name| name.starts_with("warehouse.toml.queue.damaged-"));
    let aside = aside.unwrap_or_else(|| panic!("it is not moved aside: {names:?}"));
    let text = fs::read_to_string(folder.join(aside)).expect("the file");
    assert_eq!(text, "r1 = [7, ");
    fs::remove_dir_all(folder).expect("it is there");
}
