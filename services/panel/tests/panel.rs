//! Who gets in: real sockets, a real station, and people with other addresses, names and tokens.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_lines::Name;
use lager_panel::{Panel, PanelError, Tokens};
use lager_station::{Listen, Server, ServerConfig};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// It bounds a hang; it measures nothing.
const WATCHDOG: Duration = Duration::from_secs(60);

/// A station with a panel.
struct Running {
    address: SocketAddr,
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

fn server() -> Server {
    Server::open(ServerConfig {
        name: Name::new("station").unwrap(),
        listen: Listen::At(SocketAddr::from(([127, 0, 0, 1], 0))),
        gag: None,
        warehouse: None,
        fetch: Vec::new(),
    })
    .unwrap()
}

impl Running {
    fn new(tokens: Option<Tokens>) -> Self {
        let server = server();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let panel = Panel::on(listener, tokens, server.handle()).unwrap();
        let address = panel.address().unwrap();
        let end = Arc::new(AtomicBool::new(false));
        let (ends, too) = (Arc::clone(&end), Arc::clone(&end));
        let threads = vec![
            std::thread::spawn(move || server.run(&ends).unwrap()),
            std::thread::spawn(move || panel.run(&too).unwrap()),
        ];
        Self {
            address,
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
        loop {
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
        assert_eq!(status(&panel.ask("/", &[("Host", &host)])), 421, "{host}");
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
    let refused = Panel::open(everywhere, None, server().handle());
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
    for (number, line) in ["do r1 1 resume", "take r1 2", "do r1 3 drive 2 200"]
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
    page.say("do r1 7 fly");
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
    let give_up = std::time::Instant::now() + WATCHDOG;
    while panel.page(&origin, "").is_err() {
        assert!(std::time::Instant::now() < give_up);
        std::thread::sleep(Duration::from_millis(10));
    }
}
