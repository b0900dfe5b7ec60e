//! `lager bench stop`: how long it takes to stop a robot that drives at full speed, from the start
//! of the process `lager stop` until the steering board reports that its motors are off.
//!
//! A process goes on driving it while it is stopped. The moment of the
//! report comes from the bridge: when it read the second report with wheels at rest after the
//! standby.

use std::fmt;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use lager_benches::times::{Times, table};
use lager_benches::{BenchError, interrupted};
use lager_ports::Clock;
use lager_topics::{Origin, SteeringOrder};
use lager_wire::WheelCommand;
use serde::Serialize;

use super::robot::Robot;
use crate::hands::Hands;

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

/// Stops a robot so many times.
///
/// # Errors
/// The robot does not come up, or once does not stop.
pub fn measure(stops: usize) -> Result<StopReport> {
    let robot = Robot::start()?;
    let (mut from_start, mut from_order) = (Vec::new(), Vec::new());
    for number in 0..stops {
        let (start, order) = stop_once(&robot, number)?;
        from_start.push(start);
        from_order.push(order);
    }
    Ok(StopReport {
        stops,
        from_start: Times::of(from_start),
        from_order: Times::of(from_order),
    })
}

/// Lets it drive and stops it; the time from the process's start and from the order, in ns.
fn stop_once(robot: &Robot, number: usize) -> Result<(u64, u64)> {
    robot.release()?;
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
    robot.hands.steer(order)?;
    let mut renew = || -> Result<()> {
        if renewed.elapsed() >= RENEW {
            renewed = Instant::now();
            robot.hands.steer(order)?;
        }
        Ok(())
    };
    robot.wait("the wheels to turn", || {
        renew()?;
        let report = robot.told()?.and_then(|told| told.report());
        Ok(report.is_some_and(|(_, duties)| duties[0] > 0 && duties[1] > 0))
    })?;
    // Each stop meets the robot's rounds of 5, 20 and 40 ms in another place.
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
    ensure!(end.success(), "stop number {} did not stop it", number + 1);
    let told = robot.told()?.context("the stop word has gone")?;
    match told.rested() {
        Some((of, at_ns)) if Some(of) == told.stop() => Ok((
            at_ns.saturating_sub(start_ns),
            at_ns.saturating_sub(of.at_ns()),
        )),
        _ => bail!("another stop came between"),
    }
}
