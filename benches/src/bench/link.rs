//! `lager bench link`: measures how long a robot that a person drives goes on after its link to the
//! external computer was cut.
//!
//! ```text
//!   reset     the connection is torn down (RST), as when the station's process is killed
//!   silence   the connection stays and nothing is said any more, as when a cable is pulled
//!   frozen    the station's process is stopped (SIGSTOP); its machine still takes bytes
//! ```
//!
//! In the first two cases this process plays the station; in the third it is the GaG of a real
//! station. Each cut has a new comm, which connects at once; one that was cut off before would wait
//! longer and longer. The rest of the robot stays. A time begins just before the cut, and ends with
//! the first sample of the simulated world (`truth/pose`, every 20 ms) in which both motors have
//! duty 0. So it is up to 20 ms too long.

use std::fmt;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use lager_benches::times::{Times, table};
use lager_benches::{BenchError, interrupted};
use lager_home::Clock;
use lager_lines::conversation::RobotLine;
use lager_lines::gag::{Query, Request};
use lager_ports::Subscriber;
use lager_topics::TruthPose;
use lager_wire::{OperatorCommand, Speed};
use rustix::process::{Signal, kill_process};
use serde::Serialize;

use super::robot::{PATIENCE, Robot};

/// The robot drives at least this long before the cut.
const DRIVES: Duration = Duration::from_millis(150);
/// How long it waits for a line before it does other things.
const LOOK: Duration = Duration::from_millis(1);

/// The measured times, in milliseconds.
#[derive(Debug, Serialize)]
pub(crate) struct LinkReport {
    /// The number of cuts of each kind.
    cuts: usize,
    /// The connection is torn down.
    reset: Times,
    /// The station sends nothing more.
    silence: Times,
    /// The station's process is stopped.
    frozen: Times,
}

impl fmt::Display for LinkReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} cuts of each kind of the link of a simulated robot that is driven by hand, 500 000 Bd,\n\
             real time; in ms, until both motors are at duty 0, seen every 20 ms\n",
            self.cuts
        )?;
        let rows = [
            ("the connection is reset", &self.reset),
            ("the station is silent", &self.silence),
            ("the station is frozen", &self.frozen),
        ];
        table(formatter, "when", &rows)
    }
}

/// Cuts a robot's link `cuts` times in each of the three ways.
///
/// # Errors
/// The robot does not come up, or does not drive or stop when it should.
pub(crate) fn measure(cuts: usize) -> Result<LinkReport> {
    let (reset, silence) = measure_played(cuts)?;
    Ok(LinkReport {
        cuts,
        reset: Times::of(reset),
        silence: Times::of(silence),
        frozen: Times::of(measure_frozen(cuts)?),
    })
}

/// Forwards and backwards in turn, so that the robot stays where it is.
fn command(number: usize) -> OperatorCommand {
    match number % 2 {
        0 => OperatorCommand::Forward(Speed::Full),
        _ => OperatorCommand::Backward(Speed::Full),
    }
}

/// The cuts come at different points of the periods of bridge and boards (5, 20 and 40 ms).
fn phase(number: usize) -> Duration {
    DRIVES + Duration::from_millis((number as u64 * 17) % 41)
}

/// The wheels in the simulated world.
struct Wheels(Subscriber<TruthPose>);

impl Wheels {
    /// Whether both wheels turn in the newest sample; false if there is no new one.
    fn turn(&mut self) -> Result<bool> {
        let truth = self.0.latest()?;
        Ok(truth.is_some_and(|truth| truth.left_duty > 0 && truth.right_duty > 0))
    }

    /// How long after `cut_ns` the first sample has both wheels at rest, in ns.
    fn rest_after(&mut self, cut_ns: u64) -> Result<u64> {
        let start = Instant::now();
        loop {
            if let Some(truth) = self.0.latest()?
                && (truth.left_duty, truth.right_duty) == (0, 0)
                && truth.stamp().publish_time_ns > cut_ns
            {
                return Ok(truth.stamp().publish_time_ns - cut_ns);
            }
            ensure!(!interrupted(), BenchError::Interrupted);
            ensure!(
                start.elapsed() < PATIENCE,
                "the robot drives on without a link"
            );
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// A robot without a comm; its stop is released.
fn robot() -> Result<Robot> {
    let robot = Robot::start_with(&["--no-station"])?;
    robot.release()?;
    Ok(robot)
}

/// Starts the robot's comm, which connects to `address`. The robot knows the warehouse already.
fn start_comm(robot: &mut Robot, address: &str) -> Result<()> {
    let comm = ["comm", "--station", address, "--resume"];
    robot.processes.start(&comm).map(drop)
}

/// The times after a reset and after a silence, in ns.
fn measure_played(cuts: usize) -> Result<(Vec<u64>, Vec<u64>)> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?.to_string();
    let mut robot = robot()?;
    let mut wheels = Wheels(robot.bus.subscriber()?);
    let (mut resets, mut silences) = (Vec::new(), Vec::new());
    for number in 0..2 * cuts {
        start_comm(&mut robot, &address)?;
        // If this process was held up for too long, the robot has heard nothing and has closed the
        // connection.
        let link = loop {
            let stream = accepted(&robot, &listener)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(LOOK))?;
            let mut link = Link::new(stream);
            if link.drive(number / 2, &mut wheels)? {
                break link;
            }
        };
        let cut_ns = Clock::monotonic_ns();
        if number % 2 == 0 {
            link.reset()?;
            resets.push(wheels.rest_after(cut_ns)?);
        } else {
            silences.push(wheels.rest_after(cut_ns)?);
        }
        robot.processes.end_last();
        // The robot may have connected again meanwhile.
        while listener.accept().is_ok() {}
    }
    Ok((resets, silences))
}

/// Waits for the robot's next connection.
fn accepted(robot: &Robot, listener: &TcpListener) -> Result<TcpStream> {
    let mut stream = None;
    robot.wait("the robot to connect", || {
        stream = listener.accept().ok();
        Ok(stream.is_some())
    })?;
    let (stream, _) = stream.expect("it was waited for");
    stream.set_nonblocking(false)?;
    Ok(stream)
}

/// The times after a real station was frozen, in ns.
fn measure_frozen(cuts: usize) -> Result<Vec<u64>> {
    // A free port, which nobody else is likely to take before the station does.
    let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?.to_string();
    let mut robot = robot()?;
    let socket = robot.processes.folder().join("gag");
    let gag = socket.to_str().context("the folder's name is no UTF-8")?;
    let station = ["station", "--listen", &address, "--gag", gag, "--no-panel"];
    let station = robot.processes.start(&station)?;
    // The station takes one GaG at a time, so this process keeps its first connection.
    let mut stream = None;
    robot.wait("the station", || {
        stream = UnixStream::connect(&socket).ok();
        Ok(stream.is_some())
    })?;
    let stream = stream.expect("it was waited for");
    stream.set_read_timeout(Some(LOOK))?;
    let mut gag = Link::new(stream);
    let mut wheels = Wheels(robot.bus.subscriber()?);
    let mut times = Vec::new();
    for number in 0..cuts {
        start_comm(&mut robot, &address)?;
        ensure!(gag.drive(number, &mut wheels)?, "the station has closed");
        let cut_ns = Clock::monotonic_ns();
        kill_process(station, Signal::STOP)?;
        let rested = wheels.rest_after(cut_ns);
        kill_process(station, Signal::CONT)?;
        times.push(rested?);
        robot.processes.end_last();
    }
    Ok(times)
}

/// A connection to the side that asks for commands: the robot, or the station of this GaG.
struct Link<S> {
    lines: BufReader<S>,
    /// The received part of the next line.
    line: String,
}

impl<S: Read + Write> Link<S> {
    fn new(stream: S) -> Self {
        Self {
            lines: BufReader::new(stream),
            line: String::new(),
        }
    }

    /// Drives until the wheels turn, and a while longer; false if the connection was closed.
    fn drive(&mut self, number: usize, wheels: &mut Wheels) -> Result<bool> {
        let (start, command) = (Instant::now(), command(number));
        let mut until = None;
        while until.is_none_or(|until| Instant::now() < until) {
            ensure!(!interrupted(), BenchError::Interrupted);
            ensure!(start.elapsed() < PATIENCE, "the robot does not drive");
            if !self.answer(command)? {
                return Ok(false);
            }
            if until.is_none() && wheels.turn()? {
                until = Some(Instant::now() + phase(number));
            }
        }
        Ok(true)
    }

    /// Answers the next line, if one comes within [`LOOK`]; false if the connection was closed.
    fn answer(&mut self, command: OperatorCommand) -> Result<bool> {
        match self.lines.read_line(&mut self.line) {
            Ok(0) => Ok(false),
            Ok(_) => {
                let line = std::mem::take(&mut self.line);
                if let Some(answer) = answer(line.trim_end(), command)? {
                    return Ok(writeln!(self.lines.get_mut(), "{answer}").is_ok());
                }
                Ok(true)
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(true),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

impl Link<TcpStream> {
    /// Closes the connection with an error (RST) for the other end.
    fn reset(self) -> Result<()> {
        rustix::net::sockopt::set_socket_linger(self.lines.get_ref(), Some(Duration::ZERO))?;
        Ok(())
    }
}

/// The answer to a line. Each question for a command to the wheels gets `command`.
fn answer(line: &str, command: OperatorCommand) -> Result<Option<String>> {
    let said = RobotLine::read(line).with_context(|| format!("this was said: {line:?}"))?;
    Ok(match said {
        // This project's station repeats the greeting.
        RobotLine::Hello(hello) => Some(hello.to_string()),
        RobotLine::Request(Request::Query(query)) => match query {
            Query::SideLength => Some("sidelength 40".to_owned()),
            Query::Map => Some("karta 2 2 0 0".to_owned()),
            Query::Products(word) => Some(format!("{} 0", word.as_str())),
            Query::Wheels => Some(format!("styrcomm {}", command.code())),
            Query::Arm | Query::Fetch => None,
        },
        RobotLine::Request(Request::Telemetry(_)) | RobotLine::Report(_) => None,
    })
}
