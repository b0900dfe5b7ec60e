//! The lines that `up` shows while it runs, in the order of their times. Only this file writes
//! them.
//!
//! ```text
//!   this process, and the attendant ── notes ─┐
//!                                             ├─> held for a moment, put in order ──> terminal
//!   every service ─ standard error, a pipe ───┘
//! ```
//! The attendant sees what the robot does a moment later than a service speaks of itself, so lines
//! wait a moment and are sorted. A terminal that is held (Ctrl-S, a pager) takes no more lines, and
//! a program that writes to it waits. So a thread writes the lines, and drops those that it could
//! not write for long. A service writes into a pipe that never makes it wait. Traces are not lines:
//! they go straight to standard error.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::process::Stdio;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pipe::{PipeFlags, pipe_with};

use crate::console;
use crate::narrator::Note;

/// How many lines may wait; at a few lines a second that is minutes.
const WAITING: usize = 1_024;
/// How long a line waits, so that an earlier line can come before it.
const HELD: Duration = Duration::from_millis(150);
/// How long the last lines may take.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Where the lines go.
pub struct Terminal {
    lines: SyncSender<ToTerminal>,
    written: Receiver<()>,
    /// Where services report faults; `None` if they write traces there.
    services: Option<Services>,
}

/// The pipe of the services' standard error, and the end of its reader.
struct Services {
    mouth: OwnedFd,
    read: Receiver<()>,
}

/// A message to the thread.
enum ToTerminal {
    Line(Line),
    End,
}

/// A line with its time.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Line {
    at: Duration,
    text: String,
    /// It is a service's line, for standard error.
    is_fault: bool,
}

impl Terminal {
    /// Writes to standard output, or with `to_stderr` to standard error, so that standard output is
    /// free for the JSON line. `are_traces`: services write traces to standard error.
    ///
    /// # Errors
    /// The system has no thread or no pipe for it.
    pub fn new(to_stderr: bool, are_traces: bool) -> Result<Self> {
        let (lines, waiting) = mpsc::sync_channel(WAITING);
        let (done, written) = mpsc::sync_channel(1);
        std::thread::Builder::new()
            .name("terminal".into())
            .spawn(move || {
                write_all(&waiting, to_stderr);
                let _ = done.send(());
            })
            .context("cannot start a thread for the terminal")?;
        let services = match are_traces {
            true => None,
            false => Some(Services::listen(lines.clone())?),
        };
        Ok(Self {
            lines,
            written,
            services,
        })
    }

    /// The standard error of a service.
    pub(crate) fn errors(&self) -> Stdio {
        let mouth = self.services.as_ref();
        let mouth = mouth.and_then(|services| services.mouth.try_clone().ok());
        mouth.map_or_else(Stdio::inherit, Stdio::from)
    }

    /// Shows a line, a moment later or never.
    pub(crate) fn show(&self, note: &Note) {
        let _ = self.lines.try_send(ToTerminal::Line(Line {
            at: note.at,
            text: console::line(note.at, &note.who, &note.text),
            is_fault: false,
        }));
    }

    /// Waits until the last line is written, but not for ever.
    pub(crate) fn finish(self) {
        if let Some(Services { mouth, read }) = self.services {
            drop(mouth);
            let _ = read.recv_timeout(LAST_LINES);
        }
        let _ = self.lines.try_send(ToTerminal::End);
        let _ = self.written.recv_timeout(LAST_LINES);
    }
}

impl Services {
    /// Reads the lines of services in a thread. It ends with the last process that could write one.
    fn listen(lines: SyncSender<ToTerminal>) -> Result<Self> {
        let (ear, mouth) = pipe_with(PipeFlags::CLOEXEC).context("there is no pipe")?;
        // A service never waits for this process: what does not fit into the pipe is lost.
        fcntl_setfl(&mouth, OFlags::NONBLOCK)?;
        let (done, read) = mpsc::sync_channel(1);
        std::thread::Builder::new()
            .name("services".into())
            .spawn(move || {
                let mut at = Duration::ZERO;
                for text in BufReader::new(File::from(ear)).split(b'\n') {
                    let Ok(text) = text else { break };
                    let text = String::from_utf8_lossy(&text).into_owned();
                    // A line without a time belongs to the line before it.
                    at = console::time(&text).unwrap_or(at);
                    let is_fault = true;
                    let _ = lines.try_send(ToTerminal::Line(Line { at, text, is_fault }));
                }
                let _ = done.send(());
            })
            .context("cannot start a thread for what services say")?;
        Ok(Self { mouth, read })
    }
}

/// Writes lines until it gets the message to end.
fn write_all(told: &Receiver<ToTerminal>, to_stderr: bool) {
    let mut held = Held::default();
    loop {
        let next = match held.due() {
            Some(due) => told.recv_timeout(due.saturating_duration_since(Instant::now())),
            None => told.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        let lines = match next {
            Ok(ToTerminal::Line(line)) => {
                held.take(line, Instant::now());
                continue;
            }
            Err(RecvTimeoutError::Timeout) => held.release(Instant::now()),
            Ok(ToTerminal::End) | Err(RecvTimeoutError::Disconnected) => {
                held.all().iter().for_each(|line| write(line, to_stderr));
                return;
            }
        };
        lines.iter().for_each(|line| write(line, to_stderr));
    }
}

fn write(line: &Line, to_stderr: bool) {
    // A closed terminal does not stop a robot.
    let _ = match line.is_fault || to_stderr {
        true => writeln!(std::io::stderr(), "{}", line.text),
        false => writeln!(std::io::stdout(), "{}", line.text),
    };
}

/// Lines that wait, sorted by time and then by arrival.
#[derive(Debug, Default)]
struct Held {
    lines: Vec<(Line, Instant)>,
}

impl Held {
    fn take(&mut self, line: Line, now: Instant) {
        let place = self.lines.partition_point(|(other, _)| other.at <= line.at);
        self.lines.insert(place, (line, now + HELD));
    }

    /// When the next line has waited long enough.
    fn due(&self) -> Option<Instant> {
        self.lines.iter().map(|(_, due)| *due).min()
    }

    /// The lines that have waited long enough, and all lines of earlier times.
    fn release(&mut self, now: Instant) -> Vec<Line> {
        let due = self.lines.iter().rposition(|(_, due)| *due <= now);
        let count = due.map_or(0, |place| place + 1);
        self.lines.drain(..count).map(|(line, _)| line).collect()
    }

    fn all(&mut self) -> Vec<Line> {
        self.lines.drain(..).map(|(line, _)| line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(at: u64, text: &str) -> Line {
        Line {
            at: Duration::from_millis(at),
            text: text.to_owned(),
            is_fault: false,
        }
    }

    #[test]
    fn lines_are_told_in_the_order_of_their_times_though_they_come_in_another() {
        let start = Instant::now();
        let ms = |count| start + Duration::from_millis(count);
        let mut held = Held::default();
        assert_eq!(held.due(), None);
        held.take(line(300, "a warning"), ms(300));
        held.take(line(260, "seen later"), ms(340));
        held.take(line(300, "of the same time"), ms(345));
        held.take(line(400, "the next one"), ms(400));
        assert_eq!(held.due(), Some(ms(300) + HELD));
        assert_eq!(held.release(ms(301)), []);
        let told: Vec<String> = held
            .release(ms(460))
            .into_iter()
            .map(|line| line.text)
            .collect();
        assert_eq!(told, ["seen later", "a warning"]);
        assert_eq!(held.release(ms(495)).len(), 1);
        assert_eq!(held.all(), [line(400, "the next one")]);
    }

    #[test]
    fn none_is_held_longer_than_a_moment_whatever_its_time() {
        let start = Instant::now();
        let mut held = Held::default();
        held.take(line(9_000_000, "of a clock that runs ahead"), start);
        assert_eq!(held.release(start + HELD).len(), 1);
        assert_eq!(held.due(), None);
    }
}
