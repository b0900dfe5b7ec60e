//! The process that commissions the robot for a page: `lager commission` with the lines of a
//! station. It is a process of its own, because a commissioning waits for the bridge, and because
//! its end must find the robot as it was: it ends when this process does, whatever the reason.
//!
//! ```text
//!   comm ── `<ns> commission answer 3 yes` ──> standard input
//!   comm <── `commission …`, `found …`, `kept …` ── standard output
//! ```

use std::ffi::OsString;
use std::io::{self, BufRead as _, BufReader, ErrorKind, Write as _};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};

use lager_lines::MAX_LINE;
use lager_lines::extension::{Report, Spelled};
use lager_orders::{Action, Commission};
use lager_wake::Ringer;
use rustix::fs::OFlags;

/// How many lines may wait for the thread of the bus.
const WAITING: usize = 256;

/// The program that commissions the robot, and its arguments.
#[derive(Clone, Debug)]
pub struct Commissioner {
    /// Its file.
    pub program: PathBuf,
    /// The arguments for a commissioning. With `--undo` behind them, it puts the former description
    /// back; with `--restart`, it has the robot started again.
    pub arguments: Vec<OsString>,
}

/// News of it.
#[derive(Debug)]
pub(crate) enum News {
    /// It tells something.
    Told(Report),
    /// It has ended.
    Over,
}

/// The process.
#[derive(Debug)]
pub(crate) struct Process {
    child: Child,
    to: ChildStdin,
    news: Receiver<News>,
}

impl Process {
    /// Starts it with this flag behind its arguments. Each of its lines rings.
    ///
    /// # Errors
    /// The system gives no process, pipe or thread.
    pub(crate) fn start(
        wanted: &Commissioner,
        flag: Option<&str>,
        ringer: Ringer,
    ) -> io::Result<Self> {
        let mut command = Command::new(&wanted.program);
        command.args(&wanted.arguments).args(flag);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let begun = pipes
            .ok_or_else(|| io::Error::from(ErrorKind::BrokenPipe))
            .and_then(|(to, from)| {
                // This thread never waits for it.
                rustix::fs::fcntl_setfl(&to, OFlags::NONBLOCK)?;
                let (tell, news) = sync_channel(WAITING);
                let mut from = BufReader::with_capacity(MAX_LINE, from);
                let work = move || {
                    let mut line = String::new();
                    while from.read_line(&mut line).is_ok_and(|count| count > 0) {
                        let told = Report::read(line.trim_end());
                        line.clear();
                        let Some(Ok(told)) = told else { continue };
                        if tell.send(News::Told(told)).is_err() {
                            return;
                        }
                        ringer.ring();
                    }
                    let _ = tell.send(News::Over);
                    ringer.ring();
                };
                std::thread::Builder::new().spawn(work)?;
                Ok((to, news))
            });
        match begun {
            Ok((to, news)) => Ok(Self { child, to, news }),
            Err(error) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(error)
            }
        }
    }

    /// Tells it what a person has said at `given_ns`. One that reads nothing any more is ended: the
    /// robot stands, and the bridge takes the trial back.
    pub(crate) fn tell(&mut self, given_ns: u64, said: Commission) {
        let line = format!("{given_ns} {}\n", Spelled(&Action::Commission(said)));
        if let Err(error) = self.to.write_all(line.as_bytes()) {
            tracing::warn!("the commissioning does not listen, and is ended: {error}");
            let _ = self.child.kill();
        }
    }

    /// What it has told since the last call.
    pub(crate) fn next(&mut self) -> Option<News> {
        self.news.try_recv().ok()
    }

    /// Waits for a process that has ended; it has closed its output before.
    pub(crate) fn reap(mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
