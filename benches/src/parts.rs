//! The other processes of a measurement: this executable started again, playing one part.
//!
//! ```text
//!   director (lager bench, a bench target)             player
//!     Part::start("hop, first") ── LAGER_BENCH_PART ──> cast::play_if_asked()
//!     Part::tell / hear         ── lines of JSON ─────> Stage::hear / tell
//! ```
//!
//! A player dies with the thread that started it, is out of reach of Ctrl-C on the terminal, and is
//! killed when its [`Part`] is dropped. The director never waits for one without a limit.

use core::fmt;
use core::time::Duration;
use std::io::{BufRead, BufReader, StdinLock, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Signal, set_parent_process_death_signal};
use rustix::time::Timespec;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::BenchError;
use crate::schedule::schedule;

/// What a player does: hears from its director through the stage, and returns when it hears
/// nothing more.
pub(crate) type Play = fn(&mut Stage) -> Result<(), BenchError>;

/// Names the part a process is to play.
const PART: &str = "LAGER_BENCH_PART";

/// How long a player may be silent unless a longer time is given.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// If this process was started to play a part of `tables`, plays it and ends the process.
pub(crate) fn play_one_of(tables: &[&[(&str, Play)]]) {
    let Ok(part) = std::env::var(PART) else {
        return;
    };
    std::process::exit(match play(&part, tables) {
        Ok(()) => 0,
        Err(()) => 1,
    });
}

fn play(part: &str, tables: &[&[(&str, Play)]]) -> Result<(), ()> {
    // Without it a player would outlive a director that is killed; with it, one that is
    // orphaned already ends at the first word it does not hear.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    let mut stage = Stage {
        input: std::io::stdin().lock(),
    };
    let played = tables
        .iter()
        .flat_map(|table| table.iter())
        .find(|(name, _)| *name == part)
        .map_or_else(
            || {
                Err(BenchError::PartFailed {
                    part: part.to_owned(),
                    detail: format!("there is no part `{part}`: the executable was replaced"),
                })
            },
            |(_, play)| play(&mut stage),
        );
    played.map_err(|error| {
        // If the director is gone, nobody is left to be told.
        let _ = stage.write(&Message::<()>::Failed(error.to_string()));
    })
}

/// What a player says.
#[derive(serde::Serialize, serde::Deserialize)]
enum Message<T> {
    Said(T),
    Failed(String),
}

/// A player's end of the line to its director.
pub(crate) struct Stage {
    input: StdinLock<'static>,
}

impl Stage {
    /// What the director says next; `None` when it has nothing more to say.
    pub(crate) fn hear<T: DeserializeOwned>(&mut self) -> Result<Option<T>, BenchError> {
        let mut line = String::new();
        match self.input.read_line(&mut line) {
            Ok(0) | Err(_) => Ok(None),
            Ok(_) => {
                serde_json::from_str(&line)
                    .map(Some)
                    .map_err(|error| BenchError::PartFailed {
                        part: "player".to_owned(),
                        detail: format!("not understood: {error}"),
                    })
            }
        }
    }

    /// Says `what` to the director.
    pub(crate) fn tell<T: Serialize>(&mut self, what: &T) -> Result<(), BenchError> {
        self.write(&Message::Said(what))
    }

    fn write<T: Serialize>(&mut self, message: &Message<T>) -> Result<(), BenchError> {
        let mut line = serde_json::to_vec(message).expect("messages are plain data");
        line.push(b'\n');
        let mut out = std::io::stdout().lock();
        out.write_all(&line)
            .and_then(|()| out.flush())
            .map_err(|_| BenchError::Interrupted)
    }
}

/// A director's end of the line to a player, and the player's life.
///
/// Stays in the thread that started it: the player dies with that thread.
pub(crate) struct Part {
    name: &'static str,
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    heard: Vec<u8>,
}

impl Part {
    /// Starts a process that plays `name`.
    pub(crate) fn start(name: &'static str) -> Result<Self, BenchError> {
        heed_interrupts();
        let failed = |error: std::io::Error| BenchError::Start {
            part: name.to_owned(),
            detail: error.to_string(),
        };
        let mut child = Command::new("/proc/self/exe")
            .env(PART, name)
            // Ctrl-C on the terminal is the director's to handle.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let stdin = child.stdin.take().expect("it is piped");
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        rustix::io::ioctl_fionbio(stdout.get_ref(), true).map_err(|error| failed(error.into()))?;
        Ok(Self {
            name,
            child,
            stdin,
            stdout,
            heard: Vec::new(),
        })
    }

    /// The process.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Says `what` to the player.
    pub(crate) fn tell<T: Serialize>(&mut self, what: &T) -> Result<(), BenchError> {
        let mut line = serde_json::to_vec(what).expect("messages are plain data");
        line.push(b'\n');
        // A write that fails means that the player has ended; what it said last tells why.
        let _ = self.stdin.write_all(&line);
        Ok(())
    }

    /// What the player says next, within [`PATIENCE`].
    pub(crate) fn hear<T: DeserializeOwned>(&mut self) -> Result<T, BenchError> {
        self.hear_within(PATIENCE)
    }

    /// What the player says next, within `limit`.
    pub(crate) fn hear_within<T: DeserializeOwned>(
        &mut self,
        limit: Duration,
    ) -> Result<T, BenchError> {
        let line = self.line(limit)?;
        match serde_json::from_slice(&line) {
            Ok(Message::Said(what)) => Ok(what),
            Ok(Message::Failed(detail)) => Err(BenchError::PartFailed {
                part: self.name.to_owned(),
                detail,
            }),
            Err(error) => Err(BenchError::PartFailed {
                part: self.name.to_owned(),
                detail: format!("`{}` was not understood: {error}", self.name),
            }),
        }
    }

    /// Says `what` and hears the answer.
    pub(crate) fn ask<T: DeserializeOwned>(
        &mut self,
        what: &impl Serialize,
    ) -> Result<T, BenchError> {
        self.tell(what)?;
        self.hear()
    }

    /// What both say next, within `limit`. If either fails, the one that knows why is believed: a
    /// player whose partner has failed only knows that nothing came.
    pub(crate) fn both<A: DeserializeOwned, B: DeserializeOwned>(
        first: &mut Self,
        second: &mut Self,
        limit: Duration,
    ) -> Result<(A, B), BenchError> {
        // Enough for one that has noticed to say so.
        const AFTERWARDS: Duration = Duration::from_millis(500);
        let one = first.hear_within(limit);
        let other = second.hear_within(if one.is_ok() { limit } else { AFTERWARDS });
        match (one, other) {
            (Ok(one), Ok(other)) => Ok((one, other)),
            (Err(BenchError::Interrupted), _) | (_, Err(BenchError::Interrupted)) => {
                Err(BenchError::Interrupted)
            }
            (Err(error), Ok(_) | Err(BenchError::PartSilent { .. })) => Err(error),
            (_, Err(error)) => Err(error),
        }
    }

    fn line(&mut self, limit: Duration) -> Result<Vec<u8>, BenchError> {
        // Interrupts are looked for this often.
        const SLICE: Timespec = Timespec {
            tv_sec: 0,
            tv_nsec: 50_000_000,
        };
        let start = Instant::now();
        loop {
            match self.stdout.read_until(b'\n', &mut self.heard) {
                Ok(_) if self.heard.ends_with(b"\n") => return Ok(std::mem::take(&mut self.heard)),
                Ok(_) => return Err(self.ended()),
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => return Err(self.ended()),
            }
            if interrupted() {
                return Err(BenchError::Interrupted);
            }
            if start.elapsed() >= limit {
                return Err(BenchError::PartSilent {
                    part: self.name.to_owned(),
                    limit,
                });
            }
            let mut waiting = [PollFd::new(self.stdout.get_ref(), PollFlags::IN)];
            // A signal ends the sleep early, which the loop bears.
            let _ = poll(&mut waiting, Some(&SLICE));
        }
    }

    fn ended(&mut self) -> BenchError {
        let detail = match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        };
        BenchError::PartEnded {
            part: self.name.to_owned(),
            detail,
        }
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // Linux waits, without giving its core away, for whoever reads in /proc of a process that
        // it takes down: a process of real time that keeps a less urgent one from that core would
        // never end.
        let _ = schedule(libc::SCHED_OTHER, 0);
        // It may have ended already, which is as good.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl fmt::Debug for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Part")
            .field("name", &self.name)
            .field("pid", &self.pid())
            .finish_non_exhaustive()
    }
}

fn interrupt_flag() -> &'static Arc<AtomicBool> {
    static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    FLAG.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            // Refused only for signals that cannot be caught, which these are not.
            let _ = signal_hook::flag::register(signal, Arc::clone(&flag));
        }
        flag
    })
}

/// From now on an interrupt ends the measurement with [`BenchError::Interrupted`], so that
/// everything is swept on the way out.
pub fn heed_interrupts() {
    let _ = interrupt_flag();
}

/// Whether somebody wants to stop.
pub fn interrupted() -> bool {
    interrupt_flag().load(Ordering::Relaxed)
}
