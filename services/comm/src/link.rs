//! The connection to the external computer: a thread that makes it, reads it, and makes a new one
//! after its end.
//!
//! ```text
//!   connecting ──> up, reading ──> ended ──> waits 0.1, 0.2 .. 5 s, ± a quarter ──> connecting
//! ```
//!
//! The thread passes what it reads to the thread of the bus through a bounded channel, and rings
//! there. The thread of the bus writes, and never waits: [`Link`] keeps what the peer does not
//! take, up to a limit. Of states it keeps only the newest, and sends them after all other lines.
//!
//! If the robot has a secret, a connection is up once both sides have proved that they know it
//! (`proving.rs`). If the other side does not prove it, this thread hangs up, and the other thread
//! gets none of its lines.

use std::io;
use std::net::{Shutdown as Direction, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_lines::Name;
use lager_lines::secret::Nonce;
use lager_lines::splitter::{LineError, LineSplitter};
use lager_wake::Ringer;
use rustix::net::{SendFlags, send, sockopt};
use thiserror::Error;

use crate::proving::{Proving, Step, THOUGHT, Unproved, shown};
use crate::secret::{SecretsError, secrets_at};
use crate::telling::KINDS;

/// How long one address may take to answer.
const CONNECT: Duration = Duration::from_secs(2);
/// The first pause between two attempts. Each pause is twice as long as the one before, up to the
/// longest.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// The log names an address that cannot be reached when the pauses have become longer than this.
const PATIENCE: Duration = Duration::from_millis(500);
/// A connection that lasted this long was good: after it the pauses begin with the first again.
const GOOD: Duration = Duration::from_secs(5);
/// How long a station may take to prove itself.
const PROOF: Duration = Duration::from_secs(5);
/// How often the log shows a station's sentences, at most.
const SENTENCES: Duration = Duration::from_secs(1);
/// How often a pause checks whether it must end.
const GLANCE: Duration = Duration::from_millis(20);
/// How many bytes the peer may leave unread before the link closes.
const MOST_UNREAD: usize = 64 * 1024;
/// How many pieces of at most 4 KiB may wait for the other thread.
const PIECES: usize = 16;
/// When the kernel first probes a silent peer's machine, how often, and when it gives up. A second
/// is the shortest time that it can count. A peer that speaks the extension is found silent long
/// before.
const KEEP_ALIVE: Duration = Duration::from_secs(1);
const UNCONFIRMED_MS: u32 = 3_000;

/// News of the connection.
#[derive(Debug)]
pub(crate) enum News {
    /// It is up.
    Up(TcpStream),
    /// Lines have come.
    Lines(Vec<Result<String, LineError>>),
    /// It has ended.
    Down(String),
}

/// The external computer to which a robot connects, and how the robot proves its name.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    /// The external computer: host and port.
    pub(crate) station: String,
    /// The robot's name.
    pub(crate) robot: Name,
    /// The file of its secret. It is read for each connection.
    pub(crate) secret: Option<PathBuf>,
}

/// Why there is no connection.
#[derive(Debug, Error)]
enum NoLink {
    /// The external computer cannot be reached.
    #[error("cannot reach the external computer at {at}: {error}")]
    Reach {
        /// Where.
        at: String,
        /// Why.
        error: io::Error,
    },
    /// The peer is not the robot's station.
    #[error("{at} is not taken for this robot's external computer: {why}")]
    Unproved {
        /// Where.
        at: String,
        /// Why.
        why: Unproved,
    },
    /// The robot's secret cannot be read.
    #[error("the robot cannot prove who it is: {0}")]
    Secrets(#[from] SecretsError),
    /// The file does not have it.
    #[error("the robot cannot prove who it is: {} holds no secret of {robot}", .path.display())]
    Nameless {
        /// Which.
        path: PathBuf,
        /// Whose.
        robot: Name,
    },
}

/// The other thread's end.
#[derive(Debug)]
pub(crate) struct Link {
    news: Receiver<News>,
    stream: Option<TcpStream>,
    unread: Vec<u8>,
    /// The newest state of each kind, until all other lines have been taken.
    shown: [Option<String>; KINDS],
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Connects from now on.
    ///
    /// # Errors
    /// The system gives no thread for it.
    pub(crate) fn new(wanted: Wanted, ringer: Ringer) -> io::Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let (to, news) = sync_channel(PIECES);
        let thread = Thread {
            wanted,
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

    /// The news of the connection since the last call.
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

    /// Sends a line, as much as the peer takes at once.
    pub(crate) fn say(&mut self, line: &str) {
        if self.stream.is_some() {
            self.unread.extend_from_slice(line.as_bytes());
            self.write_said();
        }
    }

    /// Sends a state. It replaces the state of this kind that the peer has not taken.
    pub(crate) fn show(&mut self, kind: usize, line: String) {
        if self.stream.is_some() {
            self.shown[kind] = Some(line);
        }
    }

    /// Writes the lines that wait, as much as the peer takes.
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
                // The reading thread finds the end of the connection.
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
            // The thread may wait for an address; it ends when that answers or the process ends.
            if start.elapsed() > FIRST_PAUSE {
                return;
            }
            // Or it waits for room in the channel, or is about to report the connection.
            if let Ok(News::Up(stream)) = self.news.recv_timeout(GLANCE) {
                let _ = stream.shutdown(Direction::Both);
            }
            self.thread = Some(thread);
        }
    }
}

struct Thread {
    wanted: Wanted,
    to: SyncSender<News>,
    ringer: Ringer,
    ends: Arc<AtomicBool>,
}

/// A new connection, and the bytes that have been read from it.
struct Made {
    stream: TcpStream,
    splitter: LineSplitter,
    lines: Vec<Result<String, LineError>>,
}

impl Thread {
    fn run(&self) {
        let mut pauses = Pauses::default();
        let mut said = String::new();
        let station = &self.wanted.station;
        while !self.ends.load(Ordering::SeqCst) {
            let start = Instant::now();
            match self.make() {
                Ok(made) => {
                    let _link = tracing::info_span!("link", station = %station).entered();
                    tracing::info!("connected to the external computer at {station}");
                    said.clear();
                    if self.hold(made).is_none() {
                        return;
                    }
                }
                Err(error) => {
                    let why = error.to_string();
                    // A station that has just started may not listen yet.
                    let is_early = matches!(error, NoLink::Reach { .. }) && pauses.next <= PATIENCE;
                    if said != why && !is_early {
                        tracing::warn!("{why}; the robot tries again for ever");
                        said = why;
                    }
                }
            }
            // Take parts of a second as a random number, so that many robots do not come back in
            // step.
            let chance = Clock::monotonic_ns() / 1_000 % 1_000;
            self.wait(pauses.after(start.elapsed(), chance));
        }
    }

    /// Connects. If the robot has a secret, both sides prove that they know it.
    fn make(&self) -> Result<Made, NoLink> {
        let failed = |error| NoLink::Reach {
            at: self.wanted.station.clone(),
            error,
        };
        let proving = self.proving()?;
        let mut made = Made {
            stream: self.connect().map_err(failed)?,
            splitter: LineSplitter::new(),
            lines: Vec::new(),
        };
        if let Some(proving) = proving {
            let proved = prove(&mut made, proving).map_err(failed)?;
            proved.map_err(|why| NoLink::Unproved {
                at: self.wanted.station.clone(),
                why,
            })?;
        }
        Ok(made)
    }

    fn proving(&self) -> Result<Option<Proving>, NoLink> {
        let Some(path) = &self.wanted.secret else {
            return Ok(None);
        };
        let robot = self.wanted.robot.clone();
        let Some(secret) = secrets_at(path)?.of(&robot).cloned() else {
            let path = path.clone();
            return Err(NoLink::Nameless { path, robot });
        };
        let nonce = Nonce::random().map_err(|error| SecretsError::Read {
            path: path.clone(),
            error,
        })?;
        Ok(Some(Proving::new(robot, secret, nonce)))
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut failure = io::Error::other("the name has no address");
        for address in self.wanted.station.to_socket_addrs()? {
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
    fn hold(&self, made: Made) -> Option<()> {
        let ended = match made.stream.try_clone() {
            Ok(writer) => {
                self.tell(News::Up(writer))?;
                self.read(made)?
            }
            Err(error) => error,
        };
        self.tell(News::Down(ended.to_string()))
    }

    fn read(&self, mut made: Made) -> Option<io::Error> {
        let mut told: Option<Instant> = None;
        loop {
            let mut lines = std::mem::take(&mut made.lines);
            lines.retain(
                |line| match line.as_deref().map(|line| line.strip_prefix(THOUGHT)) {
                    Ok(Some(why)) => {
                        if told.is_none_or(|told| told.elapsed() >= SENTENCES) {
                            told = Some(Instant::now());
                            tracing::warn!("the external computer says: {}", shown(why));
                        }
                        false
                    }
                    _ => true,
                },
            );
            if !lines.is_empty() {
                self.tell(News::Lines(lines))?;
            }
            if let Err(error) = made.read() {
                return Some(error);
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

impl Made {
    /// Waits for bytes, and keeps the complete lines.
    ///
    /// # Errors
    ///
    /// The connection has ended.
    fn read(&mut self) -> io::Result<()> {
        use std::io::Read as _;
        let mut buffer = [0; 4096];
        let count = loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => break count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        };
        let mut bytes = &buffer[..count];
        while let Some(line) = self.splitter.next(&mut bytes) {
            self.lines.push(line.map(str::to_owned));
        }
        Ok(())
    }
}

/// Lets both sides of a new connection prove themselves. Keeps the lines after the proofs.
fn prove(made: &mut Made, mut proving: Proving) -> io::Result<Result<(), Unproved>> {
    use std::io::Write as _;
    let until = Instant::now() + PROOF;
    made.stream.set_write_timeout(Some(PROOF))?;
    made.stream.write_all(proving.first().as_bytes())?;
    loop {
        let mut lines = std::mem::take(&mut made.lines).into_iter();
        for line in lines.by_ref() {
            let line = line.map_err(io::Error::other)?;
            match proving.heard(&line) {
                Ok(Step::Wait) => {}
                Ok(Step::Say(line)) => made.stream.write_all(line.as_bytes())?,
                Ok(Step::Proved) => {
                    made.lines = lines.collect();
                    made.stream.set_read_timeout(None)?;
                    made.stream.set_write_timeout(None)?;
                    return Ok(Ok(()));
                }
                Err(why) => return Ok(Err(why)),
            }
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Err(Unproved::Silent));
        }
        made.stream.set_read_timeout(Some(left))?;
        match made.read() {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            read => read?,
        }
    }
}

/// The pauses between attempts.
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
    /// The pause after an attempt of this length, with its connection if it made one: three to five
    /// quarters of the present pause; `chance` of 0 to 999 chooses.
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
