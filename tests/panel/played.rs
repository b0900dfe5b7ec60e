//! A station with played robots, which only send their lines, for states that a simulated robot
//! cannot reach, or not in time.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_tests::{Domain, Running, wait_for};

use crate::browser::{Browser, Page};

/// A station with its panel, and a browser.
pub(crate) struct Stage {
    pub(crate) url: String,
    /// The address for people who may look and stop.
    pub(crate) viewer: String,
    robots: String,
    pub(crate) browser: Browser,
    station: Running,
    domain: Domain,
}

impl Stage {
    /// A stage whose station knows this warehouse, a file of TOML, if there is one.
    pub(crate) fn new(warehouse: Option<&str>) -> Self {
        let domain = Domain::new();
        let here = "127.0.0.1:0";
        let mut args = vec!["station", "--listen", here, "--panel", here];
        let file = domain.folder().join("played.toml");
        if let Some(text) = warehouse {
            std::fs::write(&file, text).expect("a folder");
            args.extend(["--warehouse", file.to_str().expect("a name")]);
        }
        let station = domain.start(&args);
        let (robots, url, viewer) = wait_for("its addresses", || {
            let told = station.output();
            let (_, rest) = told.split_once("robots connect to ")?;
            let robots = rest.split(',').next()?.to_owned();
            let mut panels = told.split("http://").skip(1);
            let mut next = || {
                let at = panels.next()?.split([' ', '\n']).next()?;
                Some(format!("http://{at}"))
            };
            let (url, viewer) = (next()?, next()?);
            told.ends_with('\n').then_some((robots, url, viewer))
        });
        Self {
            url,
            viewer,
            robots,
            browser: Browser::new(),
            station,
            domain,
        }
    }

    /// The page at this address.
    pub(crate) fn page(&self, url: &str) -> Page {
        let mut page = self.browser.page(url);
        page.wait_until("document.querySelector('#tab-missions')?.textContent === 'Missions'");
        page
    }

    /// Starts a robot that sends these lines twenty times a second.
    pub(crate) fn robot(&self, name: &str, lines: &[&str]) -> Played {
        Played::new(&self.robots, name, lines)
    }

    pub(crate) fn end(self) {
        let Self {
            browser,
            station,
            domain,
            ..
        } = self;
        drop((browser, station));
        domain.assert_clean();
    }
}

/// A played robot; dropping it ends it.
pub(crate) struct Played {
    lines: Arc<Mutex<Vec<String>>>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Played {
    fn new(station: &str, name: &str, lines: &[&str]) -> Self {
        let mut stream = TcpStream::connect(station).expect("the station");
        let fast = Some(Duration::from_millis(50));
        stream.set_read_timeout(fast).expect("a socket");
        writeln!(stream, "lager 1 {name}").expect("it listens");
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        let lines: Arc<Mutex<Vec<String>>> = Arc::new(Mutex::new(lines));
        let over = Arc::new(AtomicBool::new(false));
        let (says, ends) = (Arc::clone(&lines), Arc::clone(&over));
        let thread = std::thread::spawn(move || {
            while !ends.load(Ordering::Relaxed) {
                let lines = says.lock().expect("nobody fails").join("\n");
                writeln!(stream, "{lines}").expect("the station listens");
                match stream.read(&mut [0; 4096]).map_err(|error| error.kind()) {
                    Ok(0) => return,
                    // It carries out no command.
                    Ok(_) => std::thread::sleep(Duration::from_millis(50)),
                    Err(ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                    Err(other) => panic!("{other}"),
                }
            }
        });
        Self {
            lines,
            over,
            thread: Some(thread),
        }
    }

    /// From now on it sends these lines.
    pub(crate) fn says(&self, lines: &[&str]) {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        *self.lines.lock().expect("nobody fails") = lines;
    }
}

impl Drop for Played {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            assert!(thread.join().is_ok() || std::thread::panicking());
        }
    }
}
