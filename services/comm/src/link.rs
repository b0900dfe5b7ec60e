//! The connection to the external computer: a thread that makes it, reads it, and makes it anew for
//! ever.
//!
//! ```text
//!   connecting ──> up, reading ──> ended ──> waits 0.1, 0.2 .. 5 s, ± a quarter ──> connecting
//! ```
//!
//! What it reads goes to the thread of the bus through a bounded channel, and rings that. Writing
//! is the other thread's, which never waits: what the peer does not take stays with [`Link`],
//! bounded. Of what only shows how things are the newest alone is kept, and goes after all that is
//! said.

use std::io;
use std::net::{Shutdown as Direction, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_lines::splitter::{LineError, LineSplitter};
use lager_ports::{Clock, Ringer};
use rustix::net::{SendFlags, send, sockopt};

use crate::telling::KINDS;

/// How long one address may take to answer.
const CONNECT: Duration = Duration::from_secs(2);
/// The first pause between two tries, doubled up to the longest.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// The log names an address that cannot be reached when the pauses have become longer than this.
const PATIENCE: Duration = Duration::from_millis(500);
/// A connection that lasted this long was good: the next pause is the first again.
const GOOD: Duration = Duration::from_secs(5);
/// How often a pause looks whether it is to end.
const GLANCE: Duration = Duration::from_millis(20);
/// What the peer may leave unread, in bytes, before it is given up.
const MOST_UNREAD: usize = 64 * 1024;
/// How many pieces of at most 4 KiB may be read that the other thread has not taken yet.
const PIECES: usize = 16;
/// When the kernel begins to ask a silent peer's machine whether it is there, how often, and when
/// it gives up. Seconds are the shortest that it counts in; a peer that speaks the extension is
/// found silent long before.
const KEEP_ALIVE: Duration = Duration::from_secs(1);
const UNCONFIRMED_MS: u32 = 3_000;

/// What has become of the connection.
#[derive(Debug)]
pub(crate) enum News {
    /// It is there.
    Up(TcpStream),
    /// Lines have come.
    Lines(Vec<Result<String, LineError>>),
    /// It has ended.
    Down(String),
}

/// The other thread's end.
#[derive(Debug)]
pub(crate) struct Link {
    news: Receiver<News>,
    stream: Option<TcpStream>,
    unread: Vec<u8>,
    /// The newest of each kind, until all that is said has been taken.
    shown: [Option<String>; KINDS],
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Connects to `station`, a host and a port, from now on.
    ///
    /// # Errors
    /// There is no thread for it.
    pub(crate) fn new(station: String, ringer: Ringer) -> io::Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let (to, news) = sync_channel(PIECES);
        let thread = Thread {
            station,
            to,
            ringer,
            ends: Arc::clone(&ends),
        };
        let work = move || thread.run();
        Ok(Self {
            news,
            stream: None,
            unread: Vec::new(),
            shown: Default::default(),
            ends,
            thread: Some(std::thread::Builder::new().spawn(work)?),
        })
    }

    /// What has become of the connection since the last look.
    pub(crate) fn next(&mut self) -> Option<News> {
        let news = self.news.try_recv().ok()?;
        match &news {
            News::Up(stream) => {
                self.stream = stream.try_clone().ok();
                self.unread.clear();
                self.shown = Default::default();
            }
            News::Down(_) => self.stream = None,
            News::Lines(_) => {}
        }
        Some(news)
    }

    /// Ends the connection; the thread makes another one.
    pub(crate) fn hang_up(&mut self) {
        if let Some(stream) = self.stream.take() {
            let _ = stream.shutdown(Direction::Both);
        }
    }

    /// Says a line, as far as the peer takes it at once.
    pub(crate) fn say(&mut self, line: &str) {
        if self.stream.is_some() {
            self.unread.extend_from_slice(line.as_bytes());
            self.write_said();
        }
    }

    /// Shows how things are: in place of the line of this kind that the peer has not taken.
    pub(crate) fn show(&mut self, kind: usize, line: String) {
        if self.stream.is_some() {
            self.shown[kind] = Some(line);
        }
    }

    /// Writes what waits, as far as the peer takes it.
    pub(crate) fn write(&mut self) {
        self.write_said();
        while self.stream.is_some() && self.unread.is_empty() {
            let Some(line) = self.shown.iter_mut().find_map(Option::take) else {
                return;
            };
            self.unread.extend_from_slice(line.as_bytes());
            self.write_said();
        }
    }

    fn write_said(&mut self) {
        let Some(stream) = &self.stream else { return };
        let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
        while !self.unread.is_empty() {
            match send(stream, &self.unread, flags) {
                Ok(count) => drop(self.unread.drain(..count)),
                Err(rustix::io::Errno::INTR) => {}
                Err(rustix::io::Errno::AGAIN) if self.unread.len() <= MOST_UNREAD => return,
                // The reading thread finds its end.
                Err(_) => return self.hang_up(),
            }
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        self.hang_up();
        let start = Instant::now();
        while let Some(thread) = self.thread.take() {
            if thread.is_finished() {
                let _ = thread.join();
                return;
            }
            // It waits for an address to answer, and ends when that has or the process does.
            if start.elapsed() > FIRST_PAUSE {
                return;
            }
            // Or for a place in the channel, or is about to say that it is up.
            if let Ok(News::Up(stream)) = self.news.recv_timeout(GLANCE) {
                let _ = stream.shutdown(Direction::Both);
            }
            self.thread = Some(thread);
        }
    }
}

struct Thread {
    station: String,
    to: SyncSender<News>,
    ringer: Ringer,
    ends: Arc<AtomicBool>,
}

impl Thread {
    fn run(&self) {
        let mut pauses = Pauses::default();
        let mut said = String::new();
        while !self.ends.load(Ordering::SeqCst) {
            let start = Instant::now();
            match self.connect() {
                Ok(stream) => {
                    let _link = tracing::info_span!("link", station = %self.station).entered();
                    tracing::info!("connected to the external computer at {}", self.station);
                    said.clear();
                    if self.hold(stream).is_none() {
                        return;
                    }
                }
                Err(error) => {
                    let why = format!(
                        "cannot reach the external computer at {}: {error}",
                        self.station
                    );
                    // One that has just been started may not listen yet.
                    if said != why && pauses.next > PATIENCE {
                        tracing::warn!("{why}; it is tried for ever");
                        said = why;
                    }
                }
            }
            // Parts of a second that nobody else has, so that many robots do not come back in step.
            let chance = Clock::monotonic_ns() / 1_000 % 1_000;
            self.wait(pauses.after(start.elapsed(), chance));
        }
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut failure = io::Error::other("the name has no address");
        for address in self.station.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    sockopt::set_socket_keepalive(&stream, true)?;
                    sockopt::set_tcp_keepidle(&stream, KEEP_ALIVE)?;
                    sockopt::set_tcp_keepintvl(&stream, KEEP_ALIVE)?;
                    sockopt::set_tcp_user_timeout(&stream, UNCONFIRMED_MS)?;
                    return Ok(stream);
                }
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }

    /// Reads until the connection ends; `None` if the other thread has gone.
    fn hold(&self, mut stream: TcpStream) -> Option<()> {
        let ended = match stream.try_clone() {
            Ok(writer) => {
                self.tell(News::Up(writer))?;
                self.read(&mut stream)?
            }
            Err(error) => error,
        };
        self.tell(News::Down(ended.to_string()))
    }

    fn read(&self, stream: &mut TcpStream) -> Option<io::Error> {
        use std::io::Read as _;
        let mut splitter = LineSplitter::new();
        let mut buffer = [0; 4096];
        loop {
            let count = match stream.read(&mut buffer) {
                Ok(0) => return Some(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Some(error),
            };
            let mut bytes = &buffer[..count];
            let mut lines = Vec::new();
            while let Some(line) = splitter.next(&mut bytes) {
                lines.push(line.map(str::to_owned));
            }
            if !lines.is_empty() {
                self.tell(News::Lines(lines))?;
            }
        }
    }

    fn tell(&self, news: News) -> Option<()> {
        self.to.send(news).ok()?;
        self.ringer.ring();
        Some(())
    }

    fn wait(&self, pause: Duration) {
        let start = Instant::now();
        while start.elapsed() < pause && !self.ends.load(Ordering::SeqCst) {
            std::thread::sleep(GLANCE);
        }
    }
}

/// How long is waited between two tries.
#[derive(Debug)]
struct Pauses {
    next: Duration,
}

impl Default for Pauses {
    fn default() -> Self {
        Self { next: FIRST_PAUSE }
    }
}

impl Pauses {
    /// The pause after a try that took so long, with its connection if it made one: three to five
    /// quarters of the one that is next, by `chance` of 0 to 999.
    fn after(&mut self, lasted: Duration, chance: u64) -> Duration {
        if lasted >= GOOD {
            self.next = FIRST_PAUSE;
        }
        let pause = self.next;
        self.next = (pause * 2).min(LONGEST_PAUSE);
        pause * 3 / 4 + pause / 2 * u32::try_from(chance).unwrap_or(0) / 1_000
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;
    use std::net::TcpListener;

    use super::*;

    /// A link that is up, and its peer.
    fn connected() -> (Link, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let ours = TcpStream::connect(address).expect("it listens");
        let (theirs, _) = listener.accept().expect("it connects");
        let (_, news) = sync_channel(1);
        let link = Link {
            news,
            stream: Some(ours),
            unread: Vec::new(),
            shown: Default::default(),
            ends: Arc::new(AtomicBool::new(false)),
            thread: None,
        };
        (link, theirs)
    }

    #[test]
    fn a_station_that_does_not_read_finds_the_newest_of_each_kind_in_the_end() {
        let (mut link, mut station) = connected();
        let line = |number: usize| format!("state time_ms={number} {}\n", "x".repeat(900));
        // More than the machine keeps for a peer that reads nothing.
        let last = 50_000;
        for number in 0..=last {
            link.show(0, line(number));
            link.write();
            assert!(link.unread.len() <= line(number).len(), "one line at most");
        }
        assert!(link.shown[0].is_some(), "the machine has not taken all");
        // What is said goes before it, and is not lost.
        link.say("done 1\n");
        link.show(0, line(last + 1));
        let reader = std::thread::spawn(move || {
            let mut all = String::new();
            station.read_to_string(&mut all).expect("it ends");
            all
        });
        while !link.unread.is_empty() || link.shown[0].is_some() {
            link.write();
            std::thread::yield_now();
        }
        link.hang_up();
        let all = reader.join().expect("it reads");
        let lines: Vec<&str> = all.lines().collect();
        assert!(lines.len() < last, "{} of {last} were told", lines.len());
        assert_eq!(lines[lines.len() - 2], "done 1");
        assert_eq!(lines[lines.len() - 1], line(last + 1).trim_end());
    }

    #[test]
    fn pauses_grow_until_a_connection_was_good_and_no_two_are_alike() {
        let mut pauses = Pauses::default();
        let brief = Duration::from_millis(1);
        let mut pass = |lasted, chance| pauses.after(lasted, chance).as_millis();
        let shortest: Vec<_> = (0..8).map(|_| pass(brief, 0)).collect();
        assert_eq!(shortest, [75, 150, 300, 600, 1200, 2400, 3750, 3750]);
        assert_eq!(
            [0, 500, 999].map(|chance| pass(brief, chance)),
            [3750, 5000, 6247]
        );
        // A station that closes again and again is not good before it has stayed for a while.
        assert_eq!(pass(GOOD - brief, 0), 3750);
        assert_eq!([pass(GOOD, 0), pass(brief, 0)], [75, 150]);
    }
}
