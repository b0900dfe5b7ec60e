//! The service `lager emulator`: runs the boards' real images in their emulator, a child process,
//! and publishes what that says of the world as `truth/pose`.
//!
//! ```text
//!   lager emulator --[chip], [serial], [simulator]--> lager-emulator <==two ptys==> bridge
//!         |  ^--------- lines of truth, a pipe ------------'   '--> clock page --> all services
//!         |--> truth/pose                 ^
//!         '<-- world/request -- what hands do, a line each on its standard input, and answered
//! ```
//! The emulator is GPL-3 and a program of its own: it and this process share a command line, two
//! pipes and a file. When this process dies, the kernel ends the emulator; when the emulator ends,
//! this process ends too. The supervisor starts both again, and they resume the world from the last
//! truth on the bus.
//!
//! **Safe state**: no emulator runs. A new one starts its steering board with motors off.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::ChanceClock;
use lager_plant::{HandsOff, Report, Warehouse};
use lager_ports::{Bus, Cause, KEPT_WAIT, Publisher};
use lager_simulator::{answer, message, wish, world_state};
use lager_supervisor::children::{PATIENCE, ends_within};
use lager_topics::{Outcome, Truth, TruthPose, WorldAnswer, WorldAsk, WorldRequest};
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

use crate::config::Config;

/// How long the emulator may take for a request of a person's hands.
const HANDS_WAIT: Duration = Duration::from_millis(500);
/// How long the emulator may be silent, in time in which it could have run, before a warning. The
/// robot's time stands still meanwhile, so nothing is lost, and nobody else would notice.
const STANDS: Duration = Duration::from_secs(5);
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
    let hands = bus.server::<WorldRequest>()?;
    let warehouse = config.simulated_warehouse()?;
    let mut emulator = Emulator::start(config, &warehouse, kept.as_ref().map(|(truth, _)| truth))?;
    while !shutdown.is_requested() {
        let mut heard = Ok(true);
        hands.serve(|ask| {
            let (told, answer) = emulator.obey(&warehouse, ask, &truth);
            heard = told;
            answer
        })?;
        heard?;
        if !emulator.pass_on(&truth)? {
            let status = emulator.child.wait().context("the emulator is lost")?;
            bail!("the emulator ended ({status})");
        }
    }
    Ok(())
}

/// The child process. Dropping it ends it.
struct Emulator {
    child: Child,
    input: ChildStdin,
    output: ChildStdout,
    lines: Lines,
    /// The result of the last request of a person's hands.
    answered: Option<Result<(), HandsOff>>,
    /// How long it could have run in all, the same at its last line, and whether the warning of its
    /// silence has been given.
    could_run: ChanceClock,
    told_at: Duration,
    is_said: bool,
}

impl Emulator {
    fn start(config: &Config, warehouse: &Warehouse, kept: Option<&Truth>) -> Result<Self> {
        let parts = config.chip.parts(config.serial.baud)?;
        let [sensor_link, steering_link] = config.serial.links()?;
        let mut command = Command::new(&parts.emulator);
        command
            .arg("--sensor-elf")
            .arg(&parts.sensor_elf)
            .arg("--steering-elf")
            .arg(&parts.steering_elf)
            .arg("--sensor-link")
            .arg(sensor_link)
            .arg("--steering-link")
            .arg(steering_link)
            .args(["--warehouse", &serde_json::to_string(warehouse)?])
            .args(["--seed", &config.simulator.seed.to_string()])
            .args(["--obstacles", &config.simulator.obstacles.to_string()])
            .args(["--baud", &config.serial.baud.to_string()])
            .args(["--speed", &config.speed.to_string()])
            .args(["--parent", &std::process::id().to_string()])
            .arg("--truth")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        if let Some(clock) = &config.chip.clock {
            command.arg("--clock").arg(clock);
        }
        if let Some(built) = config.simulator.built {
            command.args(["--built", &built.to_string()]);
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
        let input = child.stdin.take().context("the emulator has no input")?;
        let mut emulator = Self {
            could_run: ChanceClock::of_process(child.id()),
            told_at: Duration::ZERO,
            is_said: false,
            child,
            input,
            output,
            lines: Lines::default(),
            answered: None,
        };
        if let Some(kept) = kept {
            let world = serde_json::to_string(&world_state(kept))?;
            writeln!(emulator.input, "{world}").context("the emulator takes no world")?;
        }
        Ok(emulator)
    }

    /// Makes the emulator do what a person's hands would do. Returns whether it still runs, and its
    /// answer.
    fn obey(
        &mut self,
        warehouse: &Warehouse,
        ask: &WorldAsk,
        truth: &Publisher<TruthPose>,
    ) -> (Result<bool>, WorldAnswer) {
        let hand = match wish(warehouse, ask) {
            Ok(hand) => hand,
            Err(refused) => return (Ok(true), refused),
        };
        let unanswered = WorldAnswer {
            outcome: Outcome::NoBoard.into(),
            ..WorldAnswer::default()
        };
        self.answered = None;
        // If it has ended, the next line is missing and shows that.
        let said = serde_json::to_string(&hand).map(|line| writeln!(self.input, "{line}"));
        if !matches!(said, Ok(Ok(()))) {
            return (Ok(true), unanswered);
        }
        let start = Instant::now();
        while self.answered.is_none() && start.elapsed() < HANDS_WAIT {
            match self.pass_on(truth) {
                Ok(true) => {}
                ended => return (ended, unanswered),
            }
        }
        let answered = self.answered.take().map_or(unanswered, answer);
        (Ok(true), answered)
    }

    /// Warns once that the emulator is silent.
    fn watch(&mut self) {
        let stands = self.could_run.look(STANDS) - self.told_at;
        if stands >= STANDS && !core::mem::replace(&mut self.is_said, true) {
            let pid = self.child.id();
            tracing::warn!(
                "the emulator (process {pid}) does not go on, so the robot's time stands still; if somebody has frozen it, `kill -CONT {pid}` lets it go on, and `kill -9 {pid}` has another one started"
            );
        }
    }

    /// Waits a moment for the emulator's lines and publishes them. Returns whether it still runs.
    fn pass_on(&mut self, truth: &Publisher<TruthPose>) -> Result<bool> {
        let mut fds = [PollFd::new(&self.output, PollFlags::IN)];
        match poll(&mut fds, Some(&LOOK)) {
            Ok(0) => {
                self.watch();
                return Ok(true);
            }
            Err(Errno::INTR) => return Ok(true),
            Ok(_) => {}
            Err(errno) => return Err(errno).context("the emulator cannot be heard"),
        }
        self.told_at = self.could_run.look(STANDS);
        self.is_said = false;
        let mut chunk = [0; 4_096];
        let count = self.output.read(&mut chunk)?;
        self.lines.push(&chunk[..count]);
        while let Some(line) = self.lines.next() {
            let line = serde_json::from_slice(&line).with_context(|| {
                format!(
                    "the emulator says something that this program does not know (`{}`); build both again",
                    String::from_utf8_lossy(&line)
                )
            })?;
            match line {
                Report::Hand(hand) => self.answered = Some(hand),
                Report::Truth(world) => truth.send(Cause::OWN, message(&world))?,
            }
        }
        Ok(count > 0)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        if !ends_within(&mut self.child, None, PATIENCE / 2, None) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// Collects bytes and returns whole lines.
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
