//! `lager bench stop`: how long it takes to stop a robot that drives at full speed, from the start
//! of the process `lager stop` until the steering board reports that its motors are off.
//!
//! The robot is the simulated one in real time at 500 000 Bd, behind two ptys, with the services
//! that `lager up` starts. A process goes on driving it while it is stopped. The moment of the
//! report comes from the bridge: when it read the second report with wheels at rest after the
//! standby.

use std::fmt;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use lager_benches::{BenchError, Domain, heed_interrupts, interrupted};
use lager_ports::{Bus, Clock, StopTold, StopWord};
use lager_topics::{Ask, AskKind, Origin, Role, SteeringOrder};
use lager_wire::WheelCommand;
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;

use crate::hands::Hands;
use crate::supervisor::ends_within;

/// How long anything may take before the measurement is given up.
const PATIENCE: Duration = Duration::from_secs(30);
/// How often the order is renewed.
const RENEW: Duration = Duration::from_millis(40);

/// What was measured, in milliseconds.
#[derive(Debug, Serialize)]
pub struct StopReport {
    /// How many stops.
    stops: usize,
    /// From the start of the process `lager stop` to the report.
    from_start: Times,
    /// From the order, the stop word's own time, to the report.
    from_order: Times,
}

/// A distribution, in milliseconds.
#[derive(Debug, Serialize)]
struct Times {
    p50_ms: f64,
    p99_ms: f64,
    max_ms: f64,
}

impl Times {
    fn of(mut ns: Vec<u64>) -> Self {
        ns.sort_unstable();
        let at = |part: f64| {
            let rank = (part * ns.len() as f64).ceil() as usize;
            ns[rank.clamp(1, ns.len()) - 1] as f64 / 1e6
        };
        Self {
            p50_ms: at(0.5),
            p99_ms: at(0.99),
            max_ms: at(1.0),
        }
    }
}

impl fmt::Display for StopReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} stops of a simulated robot at full speed, 500 000 Bd, real time; in ms, until the\n\
             steering board reports duty 0\n",
            self.stops
        )?;
        writeln!(
            formatter,
            "from                           p50      p99      max"
        )?;
        for (from, times) in [
            ("the start of `lager stop`", &self.from_start),
            ("the order", &self.from_order),
        ] {
            let Times {
                p50_ms,
                p99_ms,
                max_ms,
            } = times;
            writeln!(
                formatter,
                "{from:26} {p50_ms:7.1}  {p99_ms:7.1}  {max_ms:7.1}"
            )?;
        }
        Ok(())
    }
}

/// Stops a robot so many times.
///
/// # Errors
/// The robot does not come up, or once does not stop.
pub fn measure(stops: usize) -> Result<StopReport> {
    let robot = Robot::start()?;
    let (mut from_start, mut from_order) = (Vec::new(), Vec::new());
    for number in 0..stops {
        let (start, order) = robot.stop_once(number)?;
        from_start.push(start);
        from_order.push(order);
    }
    Ok(StopReport {
        stops,
        from_start: Times::of(from_start),
        from_order: Times::of(from_order),
    })
}

/// A robot of the measurement's own, with its services. Everything ends when it is dropped.
struct Robot {
    hands: Hands,
    _bus: Bus,
    word: PathBuf,
    processes: Processes,
}

/// Ended last first, and then their bus is removed.
struct Processes {
    children: Vec<Child>,
    domain: Domain,
}

impl Processes {
    fn start(&mut self, arguments: &[&str]) -> Result<()> {
        let child = self.command(arguments)?.spawn();
        self.children
            .push(child.context("cannot start the robot to be measured")?);
        Ok(())
    }

    fn command(&self, arguments: &[&str]) -> Result<Command> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg("--config")
            .arg(self.domain.folder().join("robot.toml"))
            .arg("--bus")
            .arg(self.domain.folder())
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        Ok(command)
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        while let Some(mut child) = self.children.pop() {
            let _ = kill_process(Pid::from_child(&child), Signal::TERM);
            if !ends_within(&mut child, None, Duration::from_secs(10), None) {
                let _ = child.kill();
                let _ = child.wait();
            }
        }
    }
}

impl Robot {
    fn start() -> Result<Self> {
        heed_interrupts();
        let domain = Domain::new()?;
        let config = domain.config();
        let place = config.place()?;
        let [sensor, steering] = ["sensor", "steering"].map(|name| place.folder().join(name));
        let text =
            format!("body = \"serial\"\n[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
        let word = place
            .folder_of(&config.robot)
            .join(lager_ports::StopPage::FILE);
        let mut processes = Processes {
            children: Vec::new(),
            domain,
        };
        fs::write(place.folder().join("robot.toml"), text)?;
        processes.start(&["simulator"])?;
        processes.start(&["up"])?;
        let bus = Bus::open(&config, Role::Operator)?;
        let hands = Hands::new(&bus)?;
        let robot = Self {
            hands,
            _bus: bus,
            word,
            processes,
        };
        robot.wait("both boards to be connected", || {
            let told = robot.told()?;
            Ok(told.is_some_and(|told| told.sensor().is_some() && told.steering().is_some()))
        })?;
        Ok(robot)
    }

    /// Lets it drive and stops it; the time from the process's start and from the order, in ns.
    fn stop_once(&self, number: usize) -> Result<(u64, u64)> {
        self.wait("the stop to be released", || {
            let answer = self.hands.ask(Ask {
                kind: AskKind::Resume.into(),
                ..Ask::default()
            });
            Ok(answer.is_ok_and(|answer| answer.stopped == 0))
        })?;
        // To and fro, so that it stays where it is.
        let command = match number % 2 {
            0 => WheelCommand::ManualForward,
            _ => WheelCommand::ManualBackward,
        };
        let order = SteeringOrder {
            id: Hands::fresh_id(),
            origin: Origin::Operator.into(),
            code: lager_wire::Command::Wheel(command).code(),
            ..SteeringOrder::default()
        };
        let mut renewed = Instant::now();
        self.hands.steer(order)?;
        let mut renew = || -> Result<()> {
            if renewed.elapsed() >= RENEW {
                renewed = Instant::now();
                self.hands.steer(order)?;
            }
            Ok(())
        };
        self.wait("the wheels to turn", || {
            renew()?;
            let report = self.told()?.and_then(|told| told.report());
            Ok(report.is_some_and(|(_, duties)| duties[0] > 0 && duties[1] > 0))
        })?;
        // Each stop meets the robot's rounds of 5, 20 and 40 ms in another place.
        let phase = Instant::now();
        while phase.elapsed() < Duration::from_millis(60 + (number as u64 * 17) % 41) {
            renew()?;
            std::thread::sleep(Duration::from_millis(1));
        }
        let start_ns = Clock::monotonic_ns();
        let mut stop = self.processes.command(&["stop"])?.spawn()?;
        let end = loop {
            if let Some(status) = stop.try_wait()? {
                break status;
            }
            renew()?;
            std::thread::sleep(Duration::from_micros(500));
        };
        ensure!(!interrupted(), BenchError::Interrupted);
        ensure!(end.success(), "stop number {} did not stop it", number + 1);
        let told = self.told()?.context("the stop word has gone")?;
        match told.rested() {
            Some((of, at_ns)) if Some(of) == told.stop() => Ok((
                at_ns.saturating_sub(start_ns),
                at_ns.saturating_sub(of.at_ns()),
            )),
            _ => bail!("another stop came between"),
        }
    }

    fn told(&self) -> Result<Option<StopTold>> {
        Ok(StopWord::read(&self.word)?)
    }

    fn wait(&self, what: &str, mut done: impl FnMut() -> Result<bool>) -> Result<()> {
        let start = Instant::now();
        while !done()? {
            ensure!(!interrupted(), BenchError::Interrupted);
            ensure!(start.elapsed() < PATIENCE, "waited in vain for {what}");
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_the_sorted_times() {
        let times = Times::of((1..=200).rev().map(|ms| ms * 1_000_000).collect());
        assert_eq!(
            (times.p50_ms, times.p99_ms, times.max_ms),
            (100.0, 198.0, 200.0)
        );
    }
}
