//! One connection: bytes to lines and lines to bytes, without ever waiting for its peer.
//!
//! The memory for a peer has a limit: one line that the peer has not ended, and [`MOST_UNREAD`]
//! bytes that it has not read. The station closes a connection that is slower
//! ([`Connection::overdue`]).

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use lager_lines::splitter::{LineError, LineSplitter};
use rustix::io::ioctl_fionread;

use crate::unread::is_unread;

/// What a peer may leave unread, in bytes: some sixty of the longest lines.
const MOST_UNREAD: usize = 64 * 1024;

/// How long a peer may take from the beginning of a line to its end, and to read anything of what
/// waits for it.
const SLOWEST: Duration = Duration::from_secs(5);

/// Bytes that the station reads at a time. If a peer sends more, the rest waits for the next turn,
/// so a peer that never ends does not delay the others.
const READ: usize = 4096;

/// A stream of either kind.
#[derive(Debug)]
pub(crate) enum Stream {
    Tcp(TcpStream),
    Unix(UnixStream),
}

impl Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.read(buffer),
            Self::Unix(stream) => stream.read(buffer),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.write(bytes),
            Self::Unix(stream) => stream.write(bytes),
        }
    }
}

impl AsFd for Stream {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Tcp(stream) => stream.as_fd(),
            Self::Unix(stream) => stream.as_fd(),
        }
    }
}

/// A connection whose stream does not block.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: Stream,
    splitter: LineSplitter,
    unread: Vec<u8>,
    /// Whether the peer has stopped reading. The station still reads what the peer sent before the
    /// connection ends.
    is_deaf: bool,
    /// Whether the peer has read a part of the first line that waits.
    is_begun: bool,
    /// Since when a line waits that the peer has not read.
    unread_since: Instant,
    /// Since when the peer has begun a line without ending it.
    begun_since: Option<Instant>,
    /// How long the next bytes may have waited because this process was held up.
    late: Duration,
    /// How many bytes waited after that and have not been read yet.
    behind: usize,
}

impl Connection {
    /// A new connection.
    pub(crate) fn new(stream: Stream, now: Instant) -> Self {
        Self {
            stream,
            splitter: LineSplitter::new(),
            unread: Vec::new(),
            is_deaf: false,
            is_begun: false,
            unread_since: now,
            begun_since: None,
            late: Duration::ZERO,
            behind: 0,
        }
    }

    /// Tells how long this process was held up; bytes that wait now may have come meanwhile. The
    /// next call of [`Connection::read`] reads them all.
    pub(crate) fn held_up(&mut self, pause: Duration) {
        let waits = ioctl_fionread(&self.stream).unwrap_or(0);
        if waits > 0 {
            self.late = self.late.max(pause);
            self.behind = usize::try_from(waits).unwrap_or(usize::MAX);
        }
    }

    /// How long the bytes that are read next may have waited, at most.
    pub(crate) const fn late(&self) -> Duration {
        self.late
    }

    /// Whether the peer of a unix socket has read every line.
    pub(crate) fn has_read_all(&self) -> bool {
        self.unread.is_empty() && !is_unread(&self.stream)
    }

    /// Whether lines wait to be written.
    pub(crate) fn wants_to_write(&self) -> bool {
        !self.unread.is_empty()
    }

    /// Reads the bytes that have arrived and hands on each line: at most [`READ`] bytes, or all that
    /// waited when this process had been held up.
    ///
    /// # Errors
    ///
    /// The connection has ended; the lines before its end have been handed on.
    pub(crate) fn read(
        &mut self,
        now: Instant,
        mut hear: impl FnMut(Result<&str, LineError>),
    ) -> io::Result<()> {
        loop {
            let count = self.read_once(now, &mut hear)?;
            self.behind = self.behind.saturating_sub(count);
            if count < READ || self.behind == 0 {
                self.behind = 0;
                return Ok(());
            }
        }
    }

    /// Returns how many bytes it has read.
    fn read_once(
        &mut self,
        now: Instant,
        hear: &mut impl FnMut(Result<&str, LineError>),
    ) -> io::Result<usize> {
        let mut buffer = [0; READ];
        let count = match self.stream.read(&mut buffer) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => count,
            Err(error) if is_nothing(&error) => {
                self.late = Duration::ZERO;
                return Ok(0);
            }
            Err(error) => return Err(error),
        };
        if count < READ {
            // Nothing more waits.
            self.late = Duration::ZERO;
        }
        let mut bytes = &buffer[..count];
        let mut ended = false;
        while let Some(line) = self.splitter.next(&mut bytes) {
            ended = true;
            hear(line);
        }
        match self.splitter.pending() {
            0 => self.begun_since = None,
            _ if ended || self.begun_since.is_none() => self.begun_since = Some(now),
            _ => {}
        }
        Ok(count)
    }

    /// Writes a line, as much as the peer takes at once; the rest waits.
    ///
    /// # Errors
    ///
    /// The peer has left too much unread.
    pub(crate) fn say(&mut self, now: Instant, line: &str) -> io::Result<()> {
        self.put(now, self.unread.len(), line)
    }

    /// Writes a line before all lines that wait, except one that the peer has begun to read.
    ///
    /// # Errors
    ///
    /// As with [`Connection::say`].
    pub(crate) fn say_first(&mut self, now: Instant, line: &str) -> io::Result<()> {
        let end = self.unread.iter().position(|byte| *byte == b'\n');
        let begun = end.map_or(self.unread.len(), |end| end + 1);
        self.put(now, if self.is_begun { begun } else { 0 }, line)
    }

    fn put(&mut self, now: Instant, place: usize, line: &str) -> io::Result<()> {
        if self.is_deaf {
            return Ok(());
        }
        if self.unread.is_empty() {
            self.unread_since = now;
        }
        self.unread.splice(place..place, line.bytes());
        self.write(now);
        if self.unread.len() > MOST_UNREAD {
            return Err(io::Error::other("it does not read what it is told"));
        }
        Ok(())
    }

    /// Writes the lines that wait, as much as the peer takes. If the peer has gone,
    /// [`Connection::read`] finds that out, after the peer's last line.
    pub(crate) fn write(&mut self, now: Instant) {
        while !self.unread.is_empty() {
            match self.stream.write(&self.unread) {
                Ok(count @ 1..) => {
                    self.is_begun = self.unread[count - 1] != b'\n';
                    self.unread.drain(..count);
                    self.unread_since = now;
                }
                Err(error) if is_nothing(&error) => return,
                Ok(0) | Err(_) => {
                    self.is_deaf = true;
                    self.unread.clear();
                    self.unread_since = now;
                }
            }
        }
    }

    /// Why the station closes the connection now, if the peer was too slow.
    pub(crate) fn overdue(&self, now: Instant) -> Option<&'static str> {
        let over = |since: Instant, most| now.saturating_duration_since(since) > most;
        // A peer that has stopped reading may go on sending, but not for ever.
        if (self.is_deaf || self.wants_to_write()) && over(self.unread_since, SLOWEST) {
            return Some("it does not read what it is told");
        }
        let is_begun = self.begun_since.is_some_and(|since| over(since, SLOWEST));
        is_begun.then_some("it has begun a line and does not end it")
    }
}

impl AsFd for Connection {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

fn is_nothing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_peer_said_before_it_went_is_heard_though_it_takes_nothing_more() {
        let (ours, mut theirs) = UnixStream::pair().expect("sockets");
        ours.set_nonblocking(true).expect("a socket");
        let now = Instant::now();
        let mut connection = Connection::new(Stream::Unix(ours), now);
        theirs.write_all(b"fetchprod 2\n").expect("it is there");
        drop(theirs);
        connection
            .say(now, "thought I am back\n")
            .expect("no reason to close it");
        let mut heard = Vec::new();
        let hear = |line: Result<&str, LineError>| heard.push(line.expect("a line").to_owned());
        connection.read(now, hear).expect("it has said something");
        assert_eq!(heard, ["fetchprod 2"]);
        assert!(connection.overdue(now + SLOWEST).is_none());
        let too_long = now + SLOWEST + Duration::from_millis(1);
        assert!(
            connection.overdue(too_long).is_some(),
            "it may not stay so for ever"
        );
        let end = connection.read(now, |_| {});
        assert_eq!(
            end.expect_err("it has gone").kind(),
            io::ErrorKind::UnexpectedEof
        );
    }

    #[test]
    fn what_waited_while_this_process_was_held_up_is_read_at_once_and_no_more() {
        let (ours, mut theirs) = UnixStream::pair().expect("sockets");
        ours.set_nonblocking(true).expect("a socket");
        let now = Instant::now();
        let mut connection = Connection::new(Stream::Unix(ours), now);
        let line = b"styrcomm\n";
        let lines = |connection: &mut Connection| {
            let mut count = 0;
            connection.read(now, |_| count += 1).expect("it is there");
            count
        };
        let many = line.repeat(2_000);
        theirs.write_all(&many).expect("there is room");
        assert_eq!(lines(&mut connection), READ / line.len(), "one turn");
        connection.held_up(SLOWEST);
        theirs.write_all(&many).expect("there is room");
        // A peer that goes on sending does not keep this thread from the others.
        let read = lines(&mut connection);
        let waited = 2_000 - READ / line.len();
        let one_turn = READ.div_ceil(line.len());
        assert!((waited..=waited + one_turn).contains(&read), "{read}");
        assert_eq!(lines(&mut connection), READ / line.len(), "as before");
    }

    #[test]
    fn what_is_said_first_overtakes_whole_lines_that_wait() {
        let (ours, mut theirs) = UnixStream::pair().expect("sockets");
        ours.set_nonblocking(true).expect("a socket");
        let now = Instant::now();
        let mut connection = Connection::new(Stream::Unix(ours), now);
        // One line that the machine takes in part only.
        let long = "x".repeat(4 << 20) + "\n";
        connection.unread.extend_from_slice(long.as_bytes());
        connection.write(now);
        assert!(connection.is_begun && connection.wants_to_write());
        // What waits behind it, as `say` would refuse for so long a line.
        connection.unread.extend_from_slice(b"do 1 clear\n");
        let end = connection.unread.len();
        let said = connection.say_first(now, "stop 2\n");
        assert!(said.is_err(), "so much is too much, but it stands there");
        assert_eq!(connection.unread.len(), end + "stop 2\n".len());

        let reader = std::thread::spawn(move || {
            let mut all = String::new();
            theirs.read_to_string(&mut all).expect("it ends");
            all
        });
        connection.say(now, "do 3 clear\n").ok();
        while connection.wants_to_write() {
            connection.write(now);
            std::thread::yield_now();
        }
        drop(connection);
        let all = reader.join().expect("it reads");
        let lines: Vec<_> = all.lines().skip(1).collect();
        assert_eq!(lines, ["stop 2", "do 1 clear", "do 3 clear"]);
    }
}
