//! The service `lager emulator`: the boards' real images in their emulator, a child process, and
//! what it tells of the world as samples of `truth/pose`.
//!
//! ```text
//!   lager emulator --[chip], [serial], [simulator]--> lager-emulator <==two ptys==> bridge
//!         |  ^--------- lines of truth, a pipe ------------'   '--> clock page --> all services
//!         '--> truth/pose
//! ```
//! The emulator is GPL-3 and a program of its own: it and this process share a command line, two
//! pipes and a file. It dies with this process, and this process ends with it; the supervisor
//! starts both again, and the last truth on the bus is the world that they go on with.
//!
//! **Safe state**: no emulator. Its steering board starts with motors off.

use std::io::{Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use lager_ports::{Bus, Cause, Publisher, Shutdown};
use lager_topics::{Truth, TruthPose};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

use crate::config::Config;
use crate::supervisor::{PATIENCE, ends_within};

/// How long a restarted emulator's last truth is waited for.
const KEPT_WAIT: Duration = Duration::from_millis(500);
/// How long to wait for a line before looking at the shutdown flag.
const LOOK: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};

/// Runs the emulated boards until `shutdown`.
pub fn run(bus: &Bus, config: &Config, resume: bool, shutdown: &Shutdown) -> Result<()> {
    let kept = match resume {
        true => bus.kept::<TruthPose>(KEPT_WAIT)?,
        false => None,
    };
    let truth = bus.publisher::<TruthPose>()?;
    let mut emulator = Emulator::start(config, kept.as_ref())?;
    while !shutdown.is_requested() {
        if !emulator.pass_on(&truth)? {
            let status = emulator.child.wait().context("the emulator is lost")?;
            bail!("the emulator ended ({status})");
        }
    }
    Ok(())
}

/// The child, ended when dropped.
struct Emulator {
    child: Child,
    output: ChildStdout,
    lines: Lines,
}

impl Emulator {
    fn start(config: &Config, kept: Option<&Truth>) -> Result<Self> {
        let parts = config.chip.parts(config.serial.baud)?;
        let mut command = Command::new(&parts.emulator);
        command
            .arg("--sensor-elf")
            .arg(&parts.sensor_elf)
            .arg("--steering-elf")
            .arg(&parts.steering_elf)
            .arg("--sensor-link")
            .arg(&config.serial.sensor)
            .arg("--steering-link")
            .arg(&config.serial.steering)
            .args(["--warehouse", &config.warehouse])
            .args(["--seed", &config.simulator.seed.to_string()])
            .args(["--baud", &config.serial.baud.to_string()])
            .args(["--speed", &config.speed.to_string()])
            .args(["--parent", &std::process::id().to_string()])
            .arg("--truth")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        if let Some(clock) = &config.chip.clock {
            command.arg("--clock").arg(clock);
        }
        if let Some(folder) = &config.chip.eeprom {
            command.arg("--eeprom").arg(folder);
        }
        if kept.is_some() {
            command.arg("--resume");
        }
        let mut child = command
            .spawn()
            .with_context(|| format!("cannot start the emulator {}", parts.emulator.display()))?;
        let output = child.stdout.take().context("the emulator has no output")?;
        let mut input = child.stdin.take().context("the emulator has no input")?;
        let emulator = Self {
            child,
            output,
            lines: Lines::default(),
        };
        if let Some(kept) = kept {
            serde_json::to_writer(&mut input, kept).context("the emulator takes no world")?;
            input.write_all(b"\n")?;
        }
        Ok(emulator)
    }

    /// Publishes what the emulator tells, waiting for it a moment; whether it still runs.
    fn pass_on(&mut self, truth: &Publisher<TruthPose>) -> Result<bool> {
        let mut fds = [PollFd::new(&self.output, PollFlags::IN)];
        match poll(&mut fds, Some(&LOOK)) {
            Ok(0) | Err(Errno::INTR) => return Ok(true),
            Ok(_) => {}
            Err(errno) => return Err(errno).context("the emulator cannot be heard"),
        }
        let mut chunk = [0; 4_096];
        let count = self.output.read(&mut chunk)?;
        self.lines.push(&chunk[..count]);
        while let Some(line) = self.lines.next() {
            let line = serde_json::from_slice(&line).with_context(|| {
                format!(
                    "the emulator tells what this program does not know (`{}`); build both anew",
                    String::from_utf8_lossy(&line)
                )
            })?;
            truth.send(Cause::OWN, line)?;
        }
        Ok(count > 0)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        if !ends_within(&mut self.child, PATIENCE / 2) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// Bytes as they come, lines as they are complete.
#[derive(Default)]
struct Lines(Vec<u8>);

impl Lines {
    fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    fn next(&mut self) -> Option<Vec<u8>> {
        let end = self.0.iter().position(|byte| *byte == b'\n')?;
        let rest = self.0.split_off(end + 1);
        let mut line = core::mem::replace(&mut self.0, rest);
        line.pop();
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_whole_however_they_are_cut() {
        let text = b"one\n\ntwo\nthr";
        for size in 1..=text.len() {
            let mut lines = Lines::default();
            let mut seen = Vec::new();
            for piece in text.chunks(size) {
                lines.push(piece);
                while let Some(line) = lines.next() {
                    seen.push(String::from_utf8(line).expect("text"));
                }
            }
            assert_eq!(seen, ["one", "", "two"]);
        }
    }
}
