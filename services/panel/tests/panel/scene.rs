//! A station with its panel, and who comes to it: pages, and a robot.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::secret::Secrets;
use lager_orders::Reason;
use lager_panel::{Panel, Tokens, World};
use lager_station::{Handle, Listen, Server, ServerConfig};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// It bounds a hang; it measures nothing.
pub(crate) const WATCHDOG: Duration = Duration::from_secs(60);

/// A station with a panel.
pub(crate) struct Running {
    pub(crate) address: SocketAddr,
    /// Where robots connect.
    pub(crate) station: SocketAddr,
    pub(crate) handle: Handle,
    pub(crate) tokens: Tokens,
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

pub(crate) fn server(warehouse: Option<PathBuf>, history: Option<PathBuf>) -> Server {
    Server::open(ServerConfig {
        name: Name::new("station").unwrap(),
        listen: Listen::At(SocketAddr::from(([127, 0, 0, 1], 0))),
        secrets: Secrets::default(),
        gag: None,
        queues: warehouse.as_deref().map(lager_station::Queues::beside),
        history,
        warehouse,
        otherwise: None,
        fetch: Vec::new(),
    })
    .unwrap()
}

impl Running {
    pub(crate) fn new() -> Self {
        Self::of(server(None, None))
    }

    pub(crate) fn of(server: Server) -> Self {
        Self::with(server, None)
    }

    /// One that can put a simulated robot into another world.
    pub(crate) fn with(server: Server, world: Option<World>) -> Self {
        let tokens = Tokens::random().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (handle, station) = (server.handle(), server.address().unwrap());
        let mut panel = Panel::on(listener, tokens.clone(), handle.clone()).unwrap();
        if let Some(world) = world {
            panel = panel.with_world(world);
        }
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
            tokens,
            end,
            threads,
        }
    }

    /// The head of the answer to a request for a path.
    pub(crate) fn ask(&self, path: &str, headers: &[(&str, &str)]) -> String {
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

    /// The answer to STOP by a form of this body.
    pub(crate) fn stop(&self, body: &str, headers: &[(&str, &str)]) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let length = body.len();
        let mut request = format!(
            "POST /stop HTTP/1.1\r\nConnection: close\r\nContent-Length: {length}\r\n\
             Content-Type: application/x-www-form-urlencoded\r\nHost: {}\r\n",
            self.host()
        );
        for (name, value) in headers {
            request += &format!("{name}: {value}\r\n");
        }
        let request = format!("{request}\r\n{body}");
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// The cookie of a driver's browser.
    pub(crate) fn cookie(&self) -> String {
        let port = self.address.port();
        format!("lager-token-{port}={}", self.tokens.driver)
    }

    /// The answer to a driver's browser.
    pub(crate) fn ask_as_driver(&self, path: &str) -> String {
        let (host, cookie) = (self.host(), self.cookie());
        self.ask(path, &[("Host", &host), ("Cookie", &cookie)])
    }

    pub(crate) fn host(&self) -> String {
        self.address.to_string()
    }

    /// The socket of a page of this origin, with this cookie.
    pub(crate) fn page(&self, origin: &str, cookie: &str) -> Result<Page, u16> {
        self.page_of("", origin, cookie)
    }

    /// The page of a person who wants to be called so.
    pub(crate) fn page_of(&self, name: &str, origin: &str, cookie: &str) -> Result<Page, u16> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let mut request = format!("ws://{}/live?name={name}", self.address)
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
    pub(crate) fn robot(&self, name: &str) -> Robot {
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
                if let Some(number) = line.strip_prefix("stop ")
                    && writeln!(to, "stopped {number} 7").is_err()
                {
                    return;
                }
                keeps.lock().unwrap().push(line);
            }
        });
        Robot(told)
    }

    pub(crate) fn own_page(&self) -> Page {
        let origin = format!("http://{}", self.address);
        self.page(&origin, &self.cookie()).unwrap()
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
pub(crate) struct Page(pub(crate) WebSocket<TcpStream>);

impl Page {
    pub(crate) fn say(&mut self, line: &str) {
        self.0.send(Message::text(line)).unwrap();
    }

    /// The next line that begins like this; `None` once the panel has closed.
    pub(crate) fn line(&mut self, beginning: &str) -> Option<String> {
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
                return Some(shown(line));
            }
        }
    }
}

/// A line as the page shows it: the codes of an answer are sentences.
fn shown(line: &str) -> String {
    let words: Vec<&str> = line.splitn(4, ' ').collect();
    let [
        answer @ "answer",
        number,
        what @ ("done" | "refused" | "lost"),
        reasons,
    ] = words[..]
    else {
        return line.to_owned();
    };
    let reasons = reasons
        .split("; ")
        .map(|reason| Reason::read(reason).to_string());
    let reasons: Vec<String> = reasons.collect();
    format!("{answer} {number} {what} {}", reasons.join("; "))
}

/// A robot that is played.
pub(crate) struct Robot(pub(crate) Arc<Mutex<Vec<String>>>);

impl Robot {
    /// The actions that it was given, without the numbers and without how long ago that was given.
    pub(crate) fn told(&self) -> Vec<String> {
        let told = self.0.lock().unwrap();
        let actions = told.iter().filter_map(|line| line.strip_prefix("do "));
        actions
            .filter_map(|action| action.split_once(' '))
            .map(|(_, action)| match action.strip_prefix("late ") {
                Some(late) => late.split_once(' ').unwrap().1.to_owned(),
                None => action.to_owned(),
            })
            .collect()
    }
}

pub(crate) fn status(answer: &str) -> u16 {
    answer.split(' ').nth(1).unwrap().parse().unwrap()
}
