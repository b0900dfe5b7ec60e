//! The other processes of a test or a measurement: the same program, started again in another role.
//!
//! ```text
//!   parent (a test, a bench target, lager bench)       child
//!     Process::start("hop, sender") ── LAGER_PROCESS ──> run_if_asked(…)
//!     Process::tell / hear          ── lines of JSON ──> Parent::hear / say
//! ```
//!
//! A child dies with the thread that started it, gets no Ctrl-C from the terminal, and is killed
//! when its [`Process`] is dropped. Each wait of the parent has a limit. Each message of a child
//! begins with the character RS (RFC 7464); the parent skips other lines, which a test harness may
//! print.

use core::error::Error;
use core::fmt;
use core::time::Duration;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::time::Instant;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process, set_parent_process_death_signal};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::interrupts::interrupted;
use crate::schedule::schedule;

/// The work of a child: it hears from its parent, and returns when the parent says nothing more.
pub type Main = fn(&mut Parent) -> Result<(), Box<dyn Error>>;

/// The environment variable with the name of the process that this program is to be.
const VARIABLE: &str = "LAGER_PROCESS";

/// How long a parent waits for a child's next message, unless the caller gives another limit.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// The first character of a child's message.
const RS: u8 = 0x1e;

/// Why the parent can no longer use a child.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProcessError {
    /// It could not be started.
    #[error(
        "the process `{process}` could not be started ({detail}); the executable may have been replaced meanwhile, start again"
    )]
    Start {
        /// The name of the process.
        process: String,
        /// The kernel's reason.
        detail: String,
    },
    /// It ended too early.
    #[error(
        "the process `{process}` ended before it was done ({detail}); look at its messages above and start again"
    )]
    Ended {
        /// The name of the process.
        process: String,
        /// How it ended.
        detail: String,
    },
    /// It reports an error.
    #[error("{detail}")]
    Failed {
        /// The name of the process.
        process: String,
        /// The child's sentence.
        detail: String,
    },
    /// It said nothing for too long.
    #[error(
        "the process `{process}` did not answer within {limit:?}; a wake-up was lost or the machine is overloaded: start again, and report it if it happens twice"
    )]
    Silent {
        /// The name of the process.
        process: String,
        /// How long the parent waited.
        limit: Duration,
    },
    /// The user wants to stop ([`crate::heed_interrupts`]).
    #[error("interrupted")]
    Interrupted,
}

/// If this program was started as a process of `tables`, does that process's work and ends. Call it
/// first in `main`.
pub fn run_if_asked(tables: &[&[(&str, Main)]]) {
    if let Some(mut parent) = Parent::of_this_process() {
        parent.run(tables);
    }
}

/// A child's message.
#[derive(Serialize, Deserialize)]
enum Message<T> {
    Said(T),
    Failed(String),
}

/// A child's end of the line to its parent.
#[derive(Debug)]
pub struct Parent {
    name: String,
}

impl Parent {
    /// `None` if this process was not started as a child.
    #[must_use]
    pub fn of_this_process() -> Option<Self> {
        let name = std::env::var(VARIABLE).ok()?;
        // Without this signal a child would outlive a parent that is killed. If the parent is gone
        // already, the child ends anyway, at its first `hear`.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
        Some(Self { name })
    }

    /// The name of the process that this program is to be.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    fn run(&mut self, tables: &[&[(&str, Main)]]) -> ! {
        let mut known = tables.iter().flat_map(|table| table.iter());
        let result = match known.find(|(name, _)| *name == self.name) {
            Some((_, main)) => main(self),
            None => Err(format!(
                "there is no process `{}`: the executable was replaced",
                self.name
            )
            .into()),
        };
        std::process::exit(match result {
            Ok(()) => 0,
            Err(error) => {
                // If the parent is gone, nobody hears the error.
                let _ = write(&Message::<()>::Failed(error.to_string()));
                1
            }
        });
    }

    /// The parent's next message; `None` when the parent has closed the line.
    ///
    /// # Errors
    /// The message cannot be decoded.
    pub fn hear<T: DeserializeOwned>(&mut self) -> Result<Option<T>, ProcessError> {
        let mut line = String::new();
        match std::io::stdin().read_line(&mut line) {
            Ok(0) | Err(_) => Ok(None),
            Ok(_) => serde_json::from_str(&line)
                .map(Some)
                .map_err(|error| ProcessError::Failed {
                    process: self.name.clone(),
                    detail: format!("not understood: {error}"),
                }),
        }
    }

    /// The parent's first message. If the parent closes the line instead, this process ends.
    ///
    /// # Errors
    /// The message cannot be decoded.
    pub fn told<T: DeserializeOwned>(&mut self) -> Result<T, ProcessError> {
        match self.hear()? {
            Some(told) => Ok(told),
            None => std::process::exit(0),
        }
    }

    /// Sends `what` to the parent.
    ///
    /// # Errors
    /// The parent is gone.
    pub fn say<T: Serialize>(&mut self, what: &T) -> Result<(), ProcessError> {
        write(&Message::Said(what))
    }
}

/// Tells this child's parent that the child is ready; any thread of the child may call it.
///
/// # Panics
/// When the parent is gone.
pub fn ready() {
    write(&Message::Said(())).expect("a parent");
}

/// Waits until the parent has closed the line or is gone, and ends the child.
pub fn end_with_parent() -> ! {
    let mut nothing = String::new();
    while std::io::stdin()
        .read_line(&mut nothing)
        .is_ok_and(|count| count > 0)
    {}
    std::process::exit(0);
}

fn write<T: Serialize>(message: &Message<T>) -> Result<(), ProcessError> {
    let mut line = vec![RS];
    serde_json::to_writer(&mut line, message).expect("messages are plain data");
    line.push(b'\n');
    let mut out = std::io::stdout().lock();
    out.write_all(&line)
        .and_then(|()| out.flush())
        .map_err(|_| ProcessError::Interrupted)
}

/// A child and the parent's end of the line to it.
///
/// It stays in the thread that started it, because the child dies with that thread.
pub struct Process {
    name: String,
    child: Child,
    /// `None` when the parent has closed the line.
    stdin: Option<ChildStdin>,
    stdout: BufReader<ChildStdout>,
    heard: Vec<u8>,
}

impl Process {
    /// Starts this program as the process `name`.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn start(name: &str) -> Result<Self, ProcessError> {
        Self::spawn(name, &mut Command::new("/proc/self/exe"))
    }

    /// Starts this program under the standard test harness as the process `name`. The work of that
    /// process is the ignored test `test`.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn start_in_test(name: &str, test: &str) -> Result<Self, ProcessError> {
        Self::spawn(name, Command::new("/proc/self/exe").args(in_test(test)))
    }

    /// The same under another program that starts this one, such as `strace`.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn start_in_test_under(
        runner: &mut Command,
        name: &str,
        test: &str,
    ) -> Result<Self, ProcessError> {
        let this = format!("/proc/{}/exe", std::process::id());
        Self::spawn(name, runner.arg(this).args(in_test(test)))
    }

    fn spawn(name: &str, command: &mut Command) -> Result<Self, ProcessError> {
        let failed = |error: std::io::Error| ProcessError::Start {
            process: name.to_owned(),
            detail: error.to_string(),
        };
        let mut child = command
            .env(VARIABLE, name)
            // A group of its own: only the parent gets Ctrl-C from the terminal.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let stdin = child.stdin.take();
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        rustix::io::ioctl_fionbio(stdout.get_ref(), true).map_err(|error| failed(error.into()))?;
        Ok(Self {
            name: name.to_owned(),
            child,
            stdin,
            stdout,
            heard: Vec::new(),
        })
    }

    /// Its process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal to the child, if it has not ended.
    pub fn signal(&self, signal: Signal) {
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }

    /// Whether the child still runs.
    ///
    /// # Panics
    /// When the kernel does not say so.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Sends `what` to the child.
    pub fn tell<T: Serialize>(&mut self, what: &T) {
        let mut line = serde_json::to_vec(what).expect("messages are plain data");
        line.push(b'\n');
        if let Some(stdin) = &mut self.stdin {
            // A write fails when the child has ended; the child's last message tells the reason.
            let _ = stdin.write_all(&line);
        }
    }

    /// The child's next message, if it comes within [`PATIENCE`].
    ///
    /// # Errors
    /// The child reports an error, has ended, or is silent; or the user wants to stop.
    pub fn hear<T: DeserializeOwned>(&mut self) -> Result<T, ProcessError> {
        self.hear_within(PATIENCE)
    }

    /// The child's next message, if it comes within `limit`.
    ///
    /// # Errors
    /// As [`Process::hear`].
    pub fn hear_within<T: DeserializeOwned>(&mut self, limit: Duration) -> Result<T, ProcessError> {
        let said = self.message(limit)?;
        match serde_json::from_slice(&said) {
            Ok(Message::Said(what)) => Ok(what),
            Ok(Message::Failed(detail)) => Err(ProcessError::Failed {
                process: self.name.clone(),
                detail,
            }),
            Err(error) => Err(ProcessError::Failed {
                process: self.name.clone(),
                detail: format!("`{}` was not understood: {error}", self.name),
            }),
        }
    }

    /// Sends `what` and waits for the answer.
    ///
    /// # Errors
    /// As [`Process::hear`].
    pub fn ask<T: DeserializeOwned>(&mut self, what: &impl Serialize) -> Result<T, ProcessError> {
        self.tell(what);
        self.hear()
    }

    /// The next message of each of two children, if both come within `limit`.
    ///
    /// # Errors
    /// As [`Process::hear`]. If one child reports an error and the other is only silent, this
    /// returns the reported error, because it tells the cause.
    pub fn both<A: DeserializeOwned, B: DeserializeOwned>(
        first: &mut Self,
        second: &mut Self,
        limit: Duration,
    ) -> Result<(A, B), ProcessError> {
        // Long enough for a child that has noticed the error to report it.
        const AFTERWARDS: Duration = Duration::from_millis(500);
        let one = first.hear_within(limit);
        let other = second.hear_within(if one.is_ok() { limit } else { AFTERWARDS });
        match (one, other) {
            (Ok(one), Ok(other)) => Ok((one, other)),
            (Err(ProcessError::Interrupted), _) | (_, Err(ProcessError::Interrupted)) => {
                Err(ProcessError::Interrupted)
            }
            (Err(error), Ok(_) | Err(ProcessError::Silent { .. })) => Err(error),
            (_, Err(error)) => Err(error),
        }
    }

    /// Closes the line to the child, and waits until the child has ended.
    ///
    /// # Panics
    /// When the kernel does not say how it ended.
    pub fn end(mut self) -> ExitStatus {
        self.stdin = None;
        self.child.wait().expect("a child")
    }

    /// Kills the child (`kill -9`), and waits until it is gone.
    pub fn kill(self) {
        drop(self);
    }

    /// The next message without its first character; other lines are skipped.
    fn message(&mut self, limit: Duration) -> Result<Vec<u8>, ProcessError> {
        // The parent looks for interrupts this often.
        const SLICE: Timespec = Timespec {
            tv_sec: 0,
            tv_nsec: 50_000_000,
        };
        let start = Instant::now();
        loop {
            match self.stdout.read_until(b'\n', &mut self.heard) {
                Ok(_) if self.heard.ends_with(b"\n") => {
                    let line = std::mem::take(&mut self.heard);
                    if let Some(at) = line.iter().position(|byte| *byte == RS) {
                        return Ok(line[at + 1..].to_vec());
                    }
                    continue;
                }
                Ok(_) => return Err(self.ended()),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(self.ended()),
            }
            if interrupted() {
                return Err(ProcessError::Interrupted);
            }
            if start.elapsed() >= limit {
                return Err(ProcessError::Silent {
                    process: self.name.clone(),
                    limit,
                });
            }
            let mut waiting = [PollFd::new(self.stdout.get_ref(), PollFlags::IN)];
            // A signal ends this sleep early; then the loop goes on.
            let _ = poll(&mut waiting, Some(&SLICE));
        }
    }

    fn ended(&mut self) -> ProcessError {
        let detail = match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        };
        ProcessError::Ended {
            process: self.name.clone(),
            detail,
        }
    }
}

/// The arguments with which the standard test harness runs one ignored test alone.
fn in_test(test: &str) -> [&str; 4] {
    [test, "--exact", "--ignored", "--nocapture"]
}

impl Drop for Process {
    fn drop(&mut self) {
        // When Linux takes a process down, it waits, without giving its core away, for every reader
        // of that process's `/proc`. If this process runs in real time and keeps such a reader from
        // the core, it waits for ever.
        let _ = schedule(libc::SCHED_OTHER);
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl fmt::Debug for Process {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Process")
            .field("name", &self.name)
            .field("pid", &self.pid())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "a process that the other tests start"]
    fn child() {
        run_if_asked(&[&[("echo", echo), ("fails", fails)]]);
    }

    fn echo(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
        while let Some(word) = parent.hear::<String>()? {
            println!("something else");
            parent.say(&word)?;
        }
        Ok(())
    }

    fn fails(_: &mut Parent) -> Result<(), Box<dyn Error>> {
        Err("on purpose".into())
    }

    fn start(name: &str) -> Process {
        Process::start_in_test(name, "process::tests::child").unwrap()
    }

    #[test]
    fn a_child_hears_and_is_heard_until_nothing_more_is_said() {
        let mut child = start("echo");
        let [one, two] = ["one", "two"].map(|word| child.ask::<String>(&word).unwrap());
        assert_eq!([one, two], ["one", "two"]);
        assert!(child.end().success());
    }

    #[test]
    fn why_a_child_failed_is_its_own_sentence() {
        let failed = start("fails").hear::<()>().unwrap_err();
        assert_eq!(failed.to_string(), "on purpose");
        let unknown = start("nobody").hear::<()>().unwrap_err().to_string();
        assert!(unknown.contains("no process `nobody`"), "{unknown}");
    }

    #[test]
    fn a_child_that_is_killed_has_ended() {
        let mut child = start("echo");
        child.child.kill().unwrap();
        let ended = child.hear::<()>().unwrap_err();
        assert!(matches!(ended, ProcessError::Ended { .. }), "{ended}");
    }
}
