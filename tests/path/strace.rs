//! The system calls of a service's threads, as `strace` saw them.
//!
//! Counted are the calls that begin in a span of wall-clock time, by what they do for the path;
//! everything else is kept word for word, so that a test can say what is too much.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::SystemTime;

use lager_rig::Process;
use lager_tests::children;

use crate::Told;

/// What one thread asked of the kernel.
#[derive(Debug, Default)]
pub(crate) struct Calls {
    /// Sleeps on a futex that did not end by their time-out.
    pub(crate) sleeps: u64,
    /// Sleepers woken.
    pub(crate) wakes: u64,
    /// Waits for a port that did not end by their time-out.
    pub(crate) polls: u64,
    pub(crate) reads: u64,
    pub(crate) writes: u64,
    /// Waits of both kinds that ended by their time-out.
    pub(crate) timeouts: u64,
    /// Anything else.
    pub(crate) others: Vec<String>,
}

/// A service in a process of its own.
pub(crate) struct Part {
    process: Process,
    /// Where `strace` writes, for a part that is traced.
    log: Option<PathBuf>,
}

impl Part {
    /// Starts the service `name` under `strace` if there is a `log` to write to, and tells it what
    /// it is to know.
    pub(crate) fn start(log: Option<PathBuf>, name: &str, told: &Told) -> Self {
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

    /// The threads of the traced part by name.
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

    /// What the thread asked of the kernel from `from` to `to`.
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
            // thread, time, call; strace pads the thread.
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
    /// Takes one line. A call that other threads' lines interrupt has two: the first one is the
    /// call, the second one tells how it ended.
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
