//! `lager bench command`: measures the time from a command that a GaG sends to the station until
//! the robot's motors turn. The command goes through the station's socket, TCP on this machine,
//! comm, the bridge and the boards.
//!
//! The robot is in manual mode and asks for one command after the other. This process is the GaG
//! and makes it drive and stand in turn. It reads `CLOCK_MONOTONIC` just before it writes the line;
//! the end of a time is when a sample was published on the robot's bus, by the same clock.

use std::fmt;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_benches::times::{Times, table};
use lager_home::Clock;
use lager_lines::gag::{Query, Request};
use lager_ports::Subscriber;
use lager_topics::{NavMap, Origin, SteeringCommand, SteeringState};
use lager_wire::{OperatorCommand, Speed};
use serde::Serialize;

use super::robot::{PATIENCE, Robot};

/// The measured times, in milliseconds.
#[derive(Debug, Serialize)]
pub(crate) struct CommandReport {
    /// The number of commands.
    commands: usize,
    /// From the command until comm has published the order on the robot's bus.
    until_order: Times,
    /// From the command until the steering board's report on the bus has the motors on or off.
    until_duty: Times,
}

impl fmt::Display for CommandReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} commands of a GaG to a station on this machine, whose robot drives and stands in\n\
             turn, 500 000 Bd, real time; in ms, from the line\n",
            self.commands
        )?;
        let rows = [
            ("the order is on the bus", &self.until_order),
            ("the motors obey", &self.until_duty),
        ];
        table(formatter, "until", &rows)
    }
}

/// Gives a robot `commands` commands, one after the other, and times each.
///
/// # Errors
/// The robot does not come up, asks for no command, or does not obey one.
pub(crate) fn measure(commands: usize) -> Result<CommandReport> {
    let robot = Robot::start()?;
    // Until the robot knows its warehouse, it asks for other things, too.
    let mut map = robot.bus.subscriber::<NavMap>()?;
    robot.wait("the robot to know its warehouse", || {
        Ok(map.latest()?.is_some())
    })?;
    robot.release()?;
    let mut gag = Gag::connect(&robot)?;
    let (mut until_order, mut until_duty) = (Vec::new(), Vec::new());
    for number in 0..commands {
        // Forwards and backwards in turn, so that it stays where it is, with a pause after each.
        let command = match number % 4 {
            0 => OperatorCommand::Forward(Speed::Full),
            2 => OperatorCommand::Backward(Speed::Full),
            _ => OperatorCommand::Stop,
        };
        gag.wait_to_be_asked()?;
        // Each command comes at another point of the periods of bridge and boards (5, 20, 40 ms).
        std::thread::sleep(Duration::from_millis(60 + (number as u64 * 17) % 41));
        let (order, duty) = gag.give(command)?;
        until_order.push(order);
        until_duty.push(duty);
    }
    Ok(CommandReport {
        commands,
        until_order: Times::of(until_order),
        until_duty: Times::of(until_duty),
    })
}

/// This process, connected to the station and observing the robot's bus.
struct Gag {
    lines: BufReader<UnixStream>,
    orders: Subscriber<SteeringCommand>,
    states: Subscriber<SteeringState>,
}

impl Gag {
    fn connect(robot: &Robot) -> Result<Self> {
        let path = robot.gag();
        let stream = UnixStream::connect(&path);
        let stream = stream.with_context(|| format!("no station answers at {}", path.display()))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Self {
            lines: BufReader::new(stream),
            orders: robot.bus.subscriber()?,
            states: robot.bus.subscriber()?,
        })
    }

    /// Waits until the robot asks for a command.
    fn wait_to_be_asked(&mut self) -> Result<()> {
        loop {
            let mut line = String::new();
            let length = self.lines.read_line(&mut line);
            if length.context("the robot asks for no command")? == 0 {
                bail!("the station has closed the connection");
            }
            match Request::read(line.trim_end()) {
                Ok(Request::Query(Query::Wheels)) => return Ok(()),
                Ok(Request::Telemetry(_)) => (),
                Ok(Request::Query(other)) => bail!("the robot asks for {other}, not a command"),
                Err(error) => bail!("the station says {line:?}: {error}"),
            }
        }
    }

    /// Answers with `command`; returns the times until the order and until the motors, in ns.
    fn give(&mut self, command: OperatorCommand) -> Result<(u64, u64)> {
        let (code, drives) = (command.firmware().code(), command != OperatorCommand::Stop);
        while self.orders.receive()?.is_some() {}
        while self.states.receive()?.is_some() {}
        let said_ns = Clock::monotonic_ns();
        let answer = format!("styrcomm {}\n", command.code());
        self.lines.get_mut().write_all(answer.as_bytes())?;
        let start = Instant::now();
        let (mut order, mut duty) = (None, None);
        while order.is_none() || duty.is_none() {
            while let Some(sample) = self.orders.receive()? {
                let is_it = sample.origin == Origin::Operator && sample.code == code;
                if order.is_none() && is_it {
                    order = Some(sample.stamp().publish_time_ns.saturating_sub(said_ns));
                }
            }
            while let Some(sample) = self.states.receive()? {
                let turns = sample.left_duty != 0 && sample.right_duty != 0;
                let rests = sample.left_duty == 0 && sample.right_duty == 0;
                if duty.is_none() && (if drives { turns } else { rests }) {
                    duty = Some(sample.stamp().publish_time_ns.saturating_sub(said_ns));
                }
            }
            if start.elapsed() > PATIENCE {
                bail!("the robot does not carry out `{}`", answer.trim_end());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok((order.unwrap_or_default(), duty.unwrap_or_default()))
    }
}
