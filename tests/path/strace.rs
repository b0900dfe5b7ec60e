//! The system calls of a service's threads, from the log of `strace`.
//!
//! A test counts the calls that begin in a span of wall-clock time, by their task on the path. All
//! other calls are kept as text, so that a test can name those that are too many.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::SystemTime;

use lager_rig::Process;
use lager_tests::children;

use crate::PartSetup;

/// The system calls of one thread.
#[derive(Debug, Default)]
pub(crate) struct Calls {
    /// Sleeps on a futex that did not end by their time-out.
    pub(crate) sleeps: u64,
    /// The number of woken sleepers.
    pub(crate) wakes: u64,
    /// Waits for a port that did not end by their time-out.
    pub(crate) polls: u64,
    pub(crate) reads: u64,
    pub(crate) writes: u64,
    /// Waits on a futex or a port that ended by their time-out.
    pub(crate) timeouts: u64,
    /// All other calls.
    pub(crate) others: Vec<String>,
}

/// A service in a process of its own.
pub(crate) struct Part {
    process: Process,
    /// The log of `strace`, if the part is traced.
    log: Option<PathBuf>,
}

impl Part {
    /// Starts the service `name`, under `strace` if there is a `log`, and sends it its message.
    pub(crate) fn start(log: Option<PathBuf>, name: &str, told: &PartSetup) -> Self {
        let process = match &log {
            None => Process::start_in_test(name, "part"),
            Some(log) => {
                let mut strace = Command::new("strace");
                strace.args(["-f", "-ttt", "-s", "0", "-o"]).arg(log);
                Process::start_in_test_under(&mut strace, name, "part")
            }
        };
        let mut process = process.unwrap_or_else(|error| {
            panic!("{error}; this test counts system calls with strace: install that package")
        });
        process.tell(told);
        Self { process, log }
    }

    /// The names of the traced part's threads, with their ids.
    pub(crate) fn threads(&self) -> BTreeMap<String, String> {
        let Some(process) = children(self.process.pid()).first().copied() else {
            return BTreeMap::new();
        };
        fs::read_dir(format!("/proc/{process}/task"))
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|task| {
                let name = fs::read_to_string(task.path().join("comm")).ok()?;
                let id = task.file_name().into_string().ok()?;
                Some((name.trim().to_owned(), id))
            })
            .collect()
    }

    /// Ends the process and waits for it.
    pub(crate) fn end(self) {
        assert!(self.process.end().success());
    }

    /// The system calls of the thread from `from` to `to`.
    pub(crate) fn calls(&self, thread: &str, from: SystemTime, to: SystemTime) -> Calls {
        let seconds = |time: SystemTime| {
            time.duration_since(SystemTime::UNIX_EPOCH)
                .expect("a time after 1970")
                .as_secs_f64()
        };
        let span = seconds(from)..seconds(to);
        let log = self.log.as_ref().expect("a traced part");
        let log = fs::read_to_string(log).expect("strace's log");
        let mut calls = Calls::default();
        for line in log.lines() {
            // The fields are thread, time and call; strace pads the thread with spaces.
            let Some((id, rest)) = line.split_once(' ') else {
                continue;
            };
            let Some((time, call)) = rest.trim_start().split_once(' ') else {
                continue;
            };
            let time: f64 = time.parse().expect("strace's time");
            if id == thread && span.contains(&time) {
                calls.add(call);
            }
        }
        calls
    }
}

impl Calls {
    /// Counts one line of the log. A call that another thread's line interrupts has two lines: the
    /// first has the call, the second its result.
    fn add(&mut self, call: &str) {
        let waits_for_port = call.contains("poll");
        if !call.starts_with("<...") {
            match call.split('(').next() {
                Some("futex") if call.contains("FUTEX_WAKE") => self.wakes += 1,
                Some("futex") => self.sleeps += 1,
                Some("poll" | "ppoll") => self.polls += 1,
                Some("read") => self.reads += 1,
                Some("write") => self.writes += 1,
                _ => self.others.push(call.to_owned()),
            }
        }
        if call.contains("ETIMEDOUT") || call.ends_with("(Timeout)") {
            self.timeouts += 1;
            let wait = if waits_for_port {
                &mut self.polls
            } else {
                &mut self.sleeps
            };
            *wait = wait.saturating_sub(1);
        }
    }
}
