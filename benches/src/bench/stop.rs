//! `lager bench stop`: measures how long it takes to stop a robot at full speed, from the start of
//! the process `lager stop` until the steering board reports that its motors are off.
//!
//! Meanwhile another process drives the robot. The bridge gives the time of the report: when it
//! read the second report with wheels at rest after the standby.

use std::fmt;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use lager_benches::times::{Times, table};
use lager_benches::{BenchError, interrupted};
use lager_home::Clock;
use lager_operator::{Driving, For};
use lager_orders::Moment;
use lager_ports::{Cause, Publisher};
use lager_topics::{SteeringCommand, SteeringState};
use lager_wire::{OperatorCommand, Speed};
use serde::Serialize;

use super::robot::Robot;

/// The measured times, in milliseconds.
#[derive(Debug, Serialize)]
pub(crate) struct StopReport {
    /// The number of stops.
    stops: usize,
    /// From the start of the process `lager stop` to the report.
    from_start: Times,
    /// From the order, at the time in the stop word, to the report.
    from_order: Times,
}

impl fmt::Display for StopReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} stops of a simulated robot at full speed, 500 000 Bd, real time; in ms, until the\n\
             steering board reports duty 0\n",
            self.stops
        )?;
        let rows = [
            ("the start of `lager stop`", &self.from_start),
            ("the order", &self.from_order),
        ];
        table(formatter, "from", &rows)
    }
}

/// Stops a robot `stops` times.
///
/// # Errors
/// The robot does not come up, or does not stop when it should.
pub(crate) fn measure(stops: usize) -> Result<StopReport> {
    let robot = Robot::start()?;
    let steer = robot.bus.publisher()?;
    let (mut from_start, mut from_order) = (Vec::new(), Vec::new());
    for number in 0..stops {
        let (start, order) = stop_once(&robot, &steer, number)?;
        from_start.push(start);
        from_order.push(order);
    }
    Ok(StopReport {
        stops,
        from_start: Times::of(from_start),
        from_order: Times::of(from_order),
    })
}

/// Lets it drive and stops it; returns the times from the process's start and the order, in ns.
fn stop_once(
    robot: &Robot,
    steer: &Publisher<SteeringCommand>,
    number: usize,
) -> Result<(u64, u64)> {
    robot.release()?;
    // Forwards and backwards in turn, so that it stays where it is.
    let command = match number % 2 {
        0 => OperatorCommand::Forward(Speed::Full),
        _ => OperatorCommand::Backward(Speed::Full),
    };
    let clock = robot.bus.clock();
    let now = Moment {
        robot: clock.now(),
        ns: Clock::monotonic_ns(),
    };
    let mut state = robot.bus.subscriber::<SteeringState>()?;
    let mut driving = Driving::default();
    let id = u32::try_from(number + 1)?;
    let order = driving.begin(now, Duration::ZERO, id, command, For::Question);
    steer.send(Cause::OWN, order)?;
    let mut renew = || -> Result<()> {
        if let Some(report) = state.latest()? {
            driving.reported(clock.now(), &report);
        }
        if let Some(order) = driving.renew(clock.now()) {
            steer.send(Cause::OWN, order)?;
        }
        Ok(())
    };
    robot.wait("the wheels to turn", || {
        renew()?;
        let report = robot.told()?.and_then(|told| told.report());
        Ok(report.is_some_and(|(_, duties)| duties[0] > 0 && duties[1] > 0))
    })?;
    // The stops come at different points of the robot's periods (5, 20 and 40 ms).
    let phase = Instant::now();
    while phase.elapsed() < Duration::from_millis(60 + (number as u64 * 17) % 41) {
        renew()?;
        std::thread::sleep(Duration::from_millis(1));
    }
    let start_ns = Clock::monotonic_ns();
    let mut stop = robot.processes.command(&["stop"])?.spawn()?;
    let end = loop {
        if let Some(status) = stop.try_wait()? {
            break status;
        }
        renew()?;
        std::thread::sleep(Duration::from_micros(500));
    };
    ensure!(!interrupted(), BenchError::Interrupted);
    ensure!(end.success(), "stop {} did not stop the robot", number + 1);
    let told = robot.told()?.context("the stop word was removed")?;
    match told.rested() {
        Some((of, at_ns)) if Some(of) == told.stop() => Ok((
            at_ns.saturating_sub(start_ns),
            at_ns.saturating_sub(of.at_ns()),
        )),
        _ => bail!("another stop came between"),
    }
}
