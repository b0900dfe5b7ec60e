//! Who gets in: real sockets, a real station, and people with other addresses, names and tokens.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_panel::{Panel, PanelError, Tokens};
use lager_station::{Handle, Listen, Server, ServerConfig, Warehouse};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// It bounds a hang; it measures nothing.
const WATCHDOG: Duration = Duration::from_secs(60);

/// A station with a panel.
struct Running {
    address: SocketAddr,
    /// Where robots connect.
    station: SocketAddr,
    handle: Handle,
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

fn server(warehouse: Option<PathBuf>) -> Server {
    Server::open(ServerConfig {
        name: Name::new("station").unwrap(),
        listen: Listen::At(SocketAddr::from(([127, 0, 0, 1], 0))),
        gag: None,
        warehouse,
        fetch: Vec::new(),
    })
    .unwrap()
}

impl Running {
    fn new(tokens: Option<Tokens>) -> Self {
        Self::of(server(None), tokens)
    }

    fn of(server: Server, tokens: Option<Tokens>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (handle, station) = (server.handle(), server.address().unwrap());
        let panel = Panel::on(listener, tokens, handle.clone()).unwrap();
        let address = panel.address().unwrap();
        let end = Arc::new(AtomicBool::new(false));
        let (ends, too) = (Arc::clone(&end), Arc::clone(&end));
        let threads = vec![
            std::thread::spawn(move || server.run(&ends).unwrap()),
            std::thread::spawn(move || panel.run(&too).unwrap()),
        ];
        Self {
            address,
            station,
            handle,
            end,
            threads,
        }
    }

    /// The head of the answer to a request for a path.
    fn ask(&self, path: &str, headers: &[(&str, &str)]) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let mut request = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            request += &format!("{name}: {value}\r\n");
        }
        stream.write_all((request + "\r\n").as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn host(&self) -> String {
        self.address.to_string()
    }

    /// The socket of a page of this origin, with this cookie.
    fn page(&self, origin: &str, cookie: &str) -> Result<Page, u16> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let mut request = format!("ws://{}/live", self.address)
            .into_client_request()
            .unwrap();
        let headers = request.headers_mut();
        headers.insert("origin", origin.parse().unwrap());
        headers.insert("cookie", cookie.parse().unwrap());
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(Page(socket)),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(other) => panic!("{other}"),
        }
    }

    /// A robot by its lines: it does what it is told, and keeps what it was told.
    fn robot(&self, name: &str) -> Robot {
        let stream = TcpStream::connect(self.station).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let (mut to, told) = (stream.try_clone().unwrap(), Arc::default());
        writeln!(to, "lager 1 {name}").unwrap();
        let keeps: Arc<Mutex<Vec<String>>> = Arc::clone(&told);
        std::thread::spawn(move || {
            for line in BufReader::new(stream).lines().map_while(Result::ok) {
                if let Some(number) = line.strip_prefix("do ") {
                    let number = number.split(' ').next().unwrap();
                    if writeln!(to, "done {number}").is_err() {
                        return;
                    }
                }
                keeps.lock().unwrap().push(line);
            }
        });
        Robot(told)
    }

    fn own_page(&self) -> Page {
        self.page(&format!("http://{}", self.address), "").unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end.store(true, Ordering::SeqCst);
        for thread in self.threads.drain(..) {
            assert!(thread.join().is_ok() || std::thread::panicking());
        }
    }
}

/// A page's socket.
struct Page(WebSocket<TcpStream>);

impl Page {
    fn say(&mut self, line: &str) {
        self.0.send(Message::text(line)).unwrap();
    }

    /// The next line that begins like this; `None` once the panel has closed.
    fn line(&mut self, beginning: &str) -> Option<String> {
        let end = Instant::now() + WATCHDOG;
        loop {
            assert!(
                Instant::now() < end,
                "no {beginning:?}, and it is not closed"
            );
            let message = self.0.read().ok()?;
            if let Message::Close(_) = message {
                return None;
            }
            let Message::Text(text) = message else {
                continue;
            };
            if let Some(line) = text.lines().find(|line| line.starts_with(beginning)) {
                return Some(line.to_owned());
            }
        }
    }
}

/// A robot that is played.
struct Robot(Arc<Mutex<Vec<String>>>);

impl Robot {
    /// The actions that it was given.
    fn told(&self) -> Vec<String> {
        let told = self.0.lock().unwrap();
        let actions = told.iter().filter_map(|line| line.strip_prefix("do "));
        actions
            .filter_map(|action| action.split_once(' '))
            .map(|(_, action)| action.to_owned())
            .collect()
    }
}

fn status(answer: &str) -> u16 {
    answer.split(' ').nth(1).unwrap().parse().unwrap()
}

#[test]
fn the_page_comes_with_what_keeps_others_out() {
    let panel = Running::new(None);
    let answer = panel.ask("/", &[("Host", &panel.host())]);
    assert_eq!(status(&answer), 200);
    for header in [
        "content-security-policy: default-src 'none'; script-src 'self'",
        "x-content-type-options: nosniff",
        "text/html",
    ] {
        assert!(answer.contains(header), "{header}: {answer}");
    }
    assert_eq!(
        status(&panel.ask("/screen", &[("Host", &panel.host())])),
        200
    );
    assert_eq!(
        status(&panel.ask("/nothing", &[("Host", &panel.host())])),
        404
    );
}

#[test]
fn another_name_for_this_machine_is_refused() {
    let panel = Running::new(None);
    let port = panel.address.port();
    for host in [format!("evil.example:{port}"), "127.0.0.1:1".into()] {
        let answer = panel.ask("/", &[("Host", &host)]);
        assert_eq!(status(&answer), 421, "{host}");
        for part in [
            "content-security-policy: ",
            "not to this name",
            "detta namn",
        ] {
            assert!(answer.contains(part), "{part}: {answer}");
        }
    }
}

#[test]
fn the_page_of_somebody_else_opens_no_socket() {
    let panel = Running::new(None);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(panel.page(origin, "").err(), Some(403), "{origin}");
    }
    let line = panel.own_page().line("you ").unwrap();
    assert!(line.ends_with(" driver"), "{line}");
}

#[test]
fn beyond_this_machine_a_token_is_needed_and_a_viewers_only_looks_and_stops() {
    let everywhere = SocketAddr::from(([0, 0, 0, 0], 0));
    let refused = Panel::open(everywhere, None, server(None).handle());
    assert!(matches!(refused, Err(PanelError::NoTokens(_))));

    let tokens = Tokens::random().unwrap();
    let panel = Running::new(Some(tokens.clone()));
    let host = panel.host();
    assert_eq!(status(&panel.ask("/", &[("Host", &host)])), 403);
    assert_eq!(status(&panel.ask("/?token=0", &[("Host", &host)])), 403);
    let answer = panel.ask(&format!("/?token={}", tokens.viewer), &[("Host", &host)]);
    assert_eq!(status(&answer), 303, "the address does not keep it");
    let cookie = answer
        .lines()
        .find_map(|line| line.strip_prefix("set-cookie: "))
        .unwrap();
    assert!(
        cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"),
        "{cookie}"
    );
    let cookie = cookie.split(';').next().unwrap();
    assert_eq!(
        status(&panel.ask("/", &[("Host", &host), ("Cookie", cookie)])),
        200
    );

    let origin = format!("http://{}", panel.address);
    assert_eq!(panel.page(&origin, "").err(), Some(403));
    let mut viewer = panel.page(&origin, cookie).unwrap();
    assert!(viewer.line("you ").unwrap().ends_with(" viewer"));
    for (number, line) in ["do r1 1 0 resume", "take r1 2", "do r1 3 0 drive 2 200"]
        .into_iter()
        .enumerate()
    {
        viewer.say(line);
        let answer = viewer.line("answer ").unwrap();
        let wanted = format!("answer {} refused this page may look and stop", number + 1);
        assert!(answer.starts_with(&wanted), "{answer}");
    }
    // The stop is no question of rank; this robot is just not there.
    viewer.say("stop r1 4");
    let answer = viewer.line("answer ").unwrap();
    assert!(
        answer.starts_with("answer 4 refused there is no robot r1"),
        "{answer}"
    );
}

#[test]
fn a_page_that_says_what_nobody_understands_is_told_and_then_closed() {
    let panel = Running::new(None);
    let mut page = panel.own_page();
    page.say("do r1 7 0 fly");
    let answer = page.line("answer ").unwrap();
    assert!(answer.starts_with("answer 7 refused column"), "{answer}");
    for _ in 0..30 {
        if page.0.send(Message::text("what")).is_err() {
            break;
        }
    }
    assert_eq!(page.line("answer "), None, "it is closed");
    // Whoever opens it anew is served.
    assert!(panel.own_page().line("you ").is_some());
}

#[test]
fn a_page_that_says_more_than_a_person_can_is_closed() {
    let panel = Running::new(None);
    let mut page = panel.own_page();
    for number in 0..5_000 {
        if page
            .0
            .send(Message::text(format!("take r1 {number}")))
            .is_err()
        {
            return;
        }
    }
    while page.line("answer ").is_some() {}
}

#[test]
fn a_stop_counts_however_much_is_said_and_a_flood_of_them_closes_the_page() {
    let panel = Running::new(None);
    let robot = panel.robot("r1");
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    for number in 0..5_000 {
        let line = match number {
            ..200 => format!("keep r1 {number}"),
            _ => format!("stop r1 {number}"),
        };
        if page.0.send(Message::text(line)).is_err() {
            break;
        }
    }
    while page.line("answer ").is_some() {}
    let stops = || {
        let told = robot.0.lock().unwrap();
        told.iter().filter(|line| line.starts_with("stop ")).count()
    };
    let end = Instant::now() + WATCHDOG;
    while stops() == 0 {
        assert!(Instant::now() < end, "no stop has come");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_stop_that_the_robot_has_and_does_not_answer_is_not_told_as_refused() {
    let panel = Running::new(None);
    let mut robot = TcpStream::connect(panel.station).unwrap();
    writeln!(robot, "lager 1 r1").unwrap();
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    page.say("stop r1 1");
    let mut told = BufReader::new(robot).lines().map_while(Result::ok);
    assert!(told.any(|line| line.starts_with("stop ")));
    drop(told);
    assert_eq!(
        page.line("answer 1").unwrap(),
        "answer 1 lost the robot does not answer"
    );
}

#[test]
fn what_moves_a_robot_or_how_it_drives_is_its_drivers_while_there_is_one() {
    let panel = Running::new(None);
    let robot = panel.robot("r1");
    let (mut anna, mut bo) = (panel.own_page(), panel.own_page());
    anna.line("about r1 connected=1 speaks=1").unwrap();
    anna.say("take r1 1");
    assert_eq!(anna.line("answer 1").unwrap(), "answer 1 done");
    let hers = [
        "resume",
        "mode manual",
        "pick auto",
        "picked",
        "picked force",
        "reset",
        "place 0 0 right",
        "gains 2 2",
        "calibrate",
    ];
    // His clock runs fast, so nothing comes late.
    for (number, action) in (1..).zip(hers) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        let answer = bo.line(&format!("answer {number}")).unwrap();
        assert!(
            answer.contains("drives the robot; ask him"),
            "{action}: {answer}"
        );
    }
    assert_eq!(robot.told(), [""; 0]);
    for (number, action) in (20..).zip(["order 5 1", "cancel 5", "obstacle put 0 0 up"]) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        assert_eq!(
            bo.line(&format!("answer {number}")).unwrap(),
            format!("answer {number} done")
        );
    }
    // Without a driver they are anybody's.
    anna.say("free r1 2");
    assert_eq!(anna.line("answer 2").unwrap(), "answer 2 done");
    for (number, action) in (30..).zip(hers) {
        bo.say(&format!("do r1 {number} {number}000 {action}"));
        assert_eq!(
            bo.line(&format!("answer {number}")).unwrap(),
            format!("answer {number} done")
        );
    }
}

#[test]
fn a_warehouse_is_described_and_shown_to_everybody() {
    let panel = Running::new(None);
    let (mut page, mut other) = (panel.own_page(), panel.own_page());
    assert_eq!(other.line("warehouse ").unwrap(), "warehouse null");
    page.say(r#"warehouse 1 {"size":[2,3],"side_length_cm":0}"#);
    let answer = page.line("answer ").unwrap();
    assert!(answer.contains("refused side_length_cm is 0"), "{answer}");
    page.say(r#"warehouse 2 {"size":[2,3],"side_length_cm":40,"product":[{"id":7,"square":[1,2],"side":"up"}]}"#);
    assert_eq!(page.line("answer ").unwrap(), "answer 2 done");
    let shown = other.line("warehouse {").unwrap();
    assert!(
        shown.contains(r#""size":[2,3]"#) && shown.contains(r#""id":7"#),
        "{shown}"
    );
}

#[test]
fn so_many_pages_look_at_once_and_one_that_goes_makes_room() {
    let panel = Running::new(None);
    let mut pages: Vec<Page> = (0..32).map(|_| panel.own_page()).collect();
    let origin = format!("http://{}", panel.address);
    assert_eq!(panel.page(&origin, "").err(), Some(503));
    pages.truncate(31);
    let give_up = Instant::now() + WATCHDOG;
    while panel.page(&origin, "").is_err() {
        assert!(Instant::now() < give_up);
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn what_moves_a_robot_is_refused_when_it_was_held_up_on_the_way() {
    let panel = Running::new(None);
    let robot = panel.robot("r1");
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    page.say("take r1 1");
    assert_eq!(page.line("answer 1").unwrap(), "answer 1 done");
    // The page's clock counts from when it was opened: what it says here was never quicker.
    page.say("here 10000");
    page.say("do r1 2 10010 drive 2 200");
    assert_eq!(page.line("answer 2").unwrap(), "answer 2 done");
    // It comes at the same moment as one that was said half a second later, so it lay somewhere.
    page.say("do r1 3 9500 drive 4 200");
    let answer = page.line("answer 3").unwrap();
    assert!(
        answer.starts_with("answer 3 refused came ") && answer.contains(" ms late"),
        "{answer}"
    );
    for (number, action) in (10..).zip(["arm F1", "picked", "reset", "place 0 0 up"]) {
        page.say(&format!("do r1 {number} 9500 {action}"));
        let answer = page.line(&format!("answer {number}")).unwrap();
        assert!(answer.contains(" ms late"), "{action}: {answer}");
    }
    // To stand it is never too late, and what moves nothing may take its time.
    page.say("do r1 5 1 drive 1 200");
    assert_eq!(page.line("answer 5").unwrap(), "answer 5 done");
    page.say("do r1 6 9500 gains 2 2");
    assert_eq!(page.line("answer 6").unwrap(), "answer 6 done");
    let told = robot.told();
    assert_eq!(
        told,
        ["drive 00000010 150", "drive 00000001 150", "gains 2 2"]
    );
}

#[test]
fn the_wheel_is_handed_over_when_its_driver_says_so() {
    let panel = Running::new(None);
    let _robot = panel.robot("r1");
    let (mut anna, mut bo, mut cy) = (panel.own_page(), panel.own_page(), panel.own_page());
    anna.line("about r1 connected=1 speaks=1").unwrap();
    anna.say("take r1 1");
    assert_eq!(anna.line("answer 1").unwrap(), "answer 1 done");
    let named = anna
        .line("about r1 connected=1 speaks=1 driver=panel-")
        .unwrap();
    bo.say("keep r1 1");
    assert!(
        bo.line("answer 1")
            .unwrap()
            .contains("take the wheel first")
    );

    // Anna is asked and keeps it.
    bo.say("take r1 2");
    let asked = anna.line(&format!(
        "{} asks=panel-",
        named.split(" age").next().unwrap()
    ));
    assert!(asked.is_some());
    cy.say("take r1 1");
    assert!(
        cy.line("answer 1")
            .unwrap()
            .contains("has asked for the wheel before")
    );
    anna.say("keep r1 2");
    assert_eq!(anna.line("answer 2").unwrap(), "answer 2 done");
    assert!(bo.line("answer 2").unwrap().ends_with("keeps the wheel"));

    // She is asked again and hands it over; whoever did not ask does not come between.
    bo.say("take r1 3");
    anna.line(&format!(
        "{} asks=panel-",
        named.split(" age").next().unwrap()
    ))
    .unwrap();
    anna.say("free r1 3");
    assert_eq!(bo.line("answer 3").unwrap(), "answer 3 done");

    // A driver whose page is gone has handed over, too; so has one whose asker is gone nobody to ask.
    cy.say("take r1 2");
    bo.line("about r1 connected=1 speaks=1 driver=panel-2 asks=panel-3")
        .unwrap();
    drop(bo);
    assert_eq!(cy.line("answer 2").unwrap(), "answer 2 done");
    anna.say("take r1 4");
    cy.line("about r1 connected=1 speaks=1 driver=panel-3 asks=panel-1")
        .unwrap();
    drop(anna);
    let alone = |line: &str| line.contains("driver=panel-3") && !line.contains("asks=");
    while !alone(&cy.line("about r1").unwrap()) {}
}

#[test]
fn a_page_is_told_that_the_disk_does_not_take_its_warehouse() {
    let folder = std::env::temp_dir().join(format!("lager-panel-{}", std::process::id()));
    let file = folder.join("warehouse.toml");
    // Nothing can be written under the name of a folder, whoever asks.
    let in_the_way = folder.join("warehouse.toml.new");
    std::fs::create_dir_all(&in_the_way).unwrap();
    let panel = Running::of(server(Some(file.clone())), None);
    let mut page = panel.own_page();
    page.say(r#"warehouse 1 {"size":[2,3],"side_length_cm":40}"#);
    let answer = page.line("answer 1").unwrap();
    let why = format!("answer 1 refused {} is not saved: ", file.display());
    assert!(answer.starts_with(&why), "{answer}");
    assert!(
        panel.handle.look(|station| station.warehouse().is_some()),
        "it is in force"
    );
    std::fs::remove_dir(&in_the_way).unwrap();
    page.say(r#"warehouse 2 {"size":[2,3],"side_length_cm":45}"#);
    assert_eq!(page.line("answer 2").unwrap(), "answer 2 done");
    assert!(file.is_file());
    drop(panel);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_page_that_takes_nothing_in_is_dropped_though_it_says_that_it_is_there() {
    let panel = Running::new(None);
    let mut page = panel.own_page();
    page.line("you ").unwrap();
    // 60 kB of news after the other, more than the system keeps for a socket.
    let note = "a".repeat(60_000);
    let end = Instant::now() + WATCHDOG;
    let stream = page.0.get_mut().try_clone().unwrap();
    stream.set_nonblocking(true).unwrap();
    for side in (40..).map(|side| 40 + side % 100) {
        let json = format!(r#"{{"size":[2,3],"side_length_cm":{side},"note":"{note}"}}"#);
        let warehouse: Warehouse = serde_json::from_str(&json).unwrap();
        panel.handle.set_warehouse(warehouse).unwrap();
        // An empty pong, as an answer to no ping; it shows that somebody is there.
        let said = (&stream).write_all(&[0x8A, 0x80, 0, 0, 0, 0]);
        match said.map_err(|error| error.kind()) {
            Ok(()) => {}
            Err(ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => return,
            Err(other) => panic!("{other}"),
        }
        assert!(Instant::now() < end, "it is still served");
        std::thread::sleep(Duration::from_millis(30));
    }
}

#[test]
fn whoever_connects_and_asks_nothing_is_sent_away() {
    let panel = Running::new(None);
    let mut silent = TcpStream::connect(panel.address).unwrap();
    let mut slow = TcpStream::connect(panel.address).unwrap();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let mut page = panel.own_page();
    for stream in [&mut silent, &mut slow] {
        let second = Some(Duration::from_secs(1));
        stream.set_read_timeout(second).unwrap();
        let end = Instant::now() + WATCHDOG;
        loop {
            match stream.read(&mut [0; 512]).map_err(|error| error.kind()) {
                Ok(0) | Err(ErrorKind::ConnectionReset) => break,
                Ok(_) => {}
                Err(ErrorKind::WouldBlock | ErrorKind::TimedOut) => page.say("here 0"),
                Err(other) => panic!("{other}"),
            }
            assert!(Instant::now() < end, "it is still there");
        }
    }
    // A page stays, and others are served.
    page.say("take r1 1");
    assert!(page.line("answer 1").is_some());
    assert_eq!(status(&panel.ask("/", &[("Host", &panel.host())])), 200);
}
