//! The simulated robot as a process.
//!
//! ```text
//!         sleep until input, or until something happens, at least 0.5 ms
//!              |
//!   ports --bytes--> robot.advance_to(clock) --bytes--> ports
//!                                  |--> truth/pose, 50 times a second and when goods change state
//!                                  '<-- world/request: what a person's hands would do
//! ```
//! Robot time is the bus's clock, so it runs at the speed of everybody else's. The loop works in
//! batches, which costs little processor time and delays a byte by no more than a batch.
//!
//! While this process gets no core, its world stands still. A world that made up for lost time would
//! drive on under commands that it could not hear meanwhile, and on a machine that is too slow for
//! it each batch would take longer than the one before.

use core::time::Duration;
use std::path::PathBuf;

use lager_plant::{Warehouse, WarehouseError};
use lager_ports::{
    Bus, Cause, Clock, PortError, Publisher, ReceiveError, SendError, Server, Shutdown,
};
use lager_pty::{Port, PtyError};
use lager_topics::{TruthPose, WorldRequest};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use thiserror::Error;

use crate::hands::{answer, wish};
use crate::robot::{Robot, RobotOptions, Wire};
use crate::truth::{message, world_state};

/// The shortest sleep between two batches, in real time.
const BATCH: Duration = Duration::from_micros(500);
/// The longest sleep, in real time; also how late an opened port is noticed.
const LONGEST_SLEEP: Duration = Duration::from_millis(5);
/// How much the world makes up for at once, in real time; more than that it has stood still.
const MADE_UP: Duration = Duration::from_millis(50);
/// From one truth to the next, in robot time.
const TRUTH_PERIOD: Duration = Duration::from_millis(20);
/// How long a restarted simulator waits for its last truth, in real time.
const KEPT_WAIT: Duration = Duration::from_millis(500);

/// What the process needs to know.
#[derive(Clone, Debug)]
pub struct SimulatorConfig {
    /// The world.
    pub warehouse: Warehouse,
    /// Chooses every imperfection.
    pub seed: u64,
    /// So many things come and go on the edges.
    pub obstacles: u32,
    /// Baud rate of both serial lines.
    pub baud: u32,
    /// Where the sensor board's port is linked.
    pub sensor_link: PathBuf,
    /// Where the steering board's port is linked.
    pub steering_link: PathBuf,
    /// Whether to go on with the world a killed predecessor left on the bus, if there is one.
    pub resume: bool,
}

/// Why the simulator ended.
#[derive(Debug, Error)]
pub enum RunError {
    /// The warehouse cannot be built.
    #[error(transparent)]
    Warehouse(#[from] WarehouseError),
    /// A port could not be made.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The bus cannot be used.
    #[error(transparent)]
    Bus(#[from] PortError),
    /// The requests of a person's hands cannot be received.
    #[error(transparent)]
    Hands(#[from] ReceiveError),
    /// The truth cannot be told.
    #[error(transparent)]
    Send(#[from] SendError),
}

/// Runs a simulated robot until `shutdown`.
///
/// # Errors
/// The warehouse, the ports or the bus cannot be used.
pub fn run(bus: &Bus, config: &SimulatorConfig, shutdown: &Shutdown) -> Result<(), RunError> {
    let kept = if config.resume {
        bus.kept::<TruthPose>(KEPT_WAIT).map_err(PortError::from)?
    } else {
        None
    };
    let options = RobotOptions {
        seed: config.seed,
        obstacles: config.obstacles,
        baud: config.baud,
        ..RobotOptions::default()
    };
    let mut robot = Robot::new(&config.warehouse, options)?;
    if let Some((kept, _)) = &kept {
        robot.resume(&world_state(kept));
        tracing::info!(
            seconds = robot.now().as_secs_f64(),
            "goes on with the kept world"
        );
    }
    let mut shell = Shell {
        truth: bus.publisher::<TruthPose>()?,
        truth_due: robot.now(),
        changes_told: robot.world().changes(),
        lines: [
            Line::new(Wire::Sensor, Port::create(&config.sensor_link)?),
            Line::new(Wire::Steering, Port::create(&config.steering_link)?),
        ],
        hands: bus.server::<WorldRequest>()?,
        warehouse: config.warehouse.clone(),
        robot,
    };
    shell.run(&bus.clock(), shutdown)
}

/// How much of the robot time that has passed, which took `real`, the world makes up for.
fn made_up(passed: Duration, real: Duration) -> Duration {
    match real > MADE_UP {
        true => passed.mul_f64(MADE_UP.div_duration_f64(real)),
        false => passed,
    }
}

struct Line {
    wire: Wire,
    port: Port,
    bytes: Vec<u8>,
    lost: usize,
}

impl Line {
    fn new(wire: Wire, port: Port) -> Self {
        Self {
            wire,
            port,
            bytes: Vec::with_capacity(4_096),
            lost: 0,
        }
    }
}

struct Shell {
    robot: Robot,
    warehouse: Warehouse,
    hands: Server<WorldRequest>,
    lines: [Line; 2],
    truth: Publisher<TruthPose>,
    truth_due: Duration,
    changes_told: u64,
}

impl Shell {
    fn run(&mut self, clock: &Clock, shutdown: &Shutdown) -> Result<(), RunError> {
        let mut looked = clock.now();
        while !shutdown.is_requested() {
            let passed = clock.now().saturating_sub(looked);
            looked += passed;
            let now = self.robot.now() + made_up(passed, clock.real(passed));
            self.robot.advance_to(now);
            self.exchange();
            self.obey_hands()?;
            self.tell_truth(now)?;
            let quiet = clock.real(self.robot.next_event().saturating_sub(now));
            self.sleep(quiet.clamp(BATCH, LONGEST_SLEEP));
        }
        Ok(())
    }

    /// Passes bytes in both directions, after the robot has come up to the present.
    fn exchange(&mut self) {
        for Line {
            wire,
            port,
            bytes,
            lost,
        } in &mut self.lines
        {
            port.look();
            bytes.clear();
            port.read(bytes);
            if !bytes.is_empty() {
                self.robot.write(*wire, bytes);
                bytes.clear();
            }
            self.robot.read(*wire, bytes);
            let dropped = port.write(bytes);
            if dropped > 0 && *lost == 0 && port.is_open() {
                tracing::warn!(?wire, "nobody reads the port fast enough; bytes are lost");
            }
            // Told once each time the port is opened.
            *lost = if port.is_open() { *lost + dropped } else { 0 };
        }
    }

    /// Does what a person's hands would do.
    fn obey_hands(&mut self) -> Result<(), ReceiveError> {
        let (robot, warehouse) = (&mut self.robot, &self.warehouse);
        self.hands.serve(|ask| {
            wish(warehouse, ask).map_or_else(|refused| refused, |wish| answer(robot.obey(wish)))
        })?;
        Ok(())
    }

    fn tell_truth(&mut self, now: Duration) -> Result<(), SendError> {
        let changes = self.robot.world().changes();
        if now < self.truth_due && changes == self.changes_told {
            return Ok(());
        }
        self.changes_told = changes;
        self.truth_due = now + TRUTH_PERIOD;
        self.truth.send(Cause::OWN, message(&self.robot.truth()))
    }

    /// Sleeps for `time`, or until somebody writes to an open port. A closed one cannot be waited
    /// on: it is always ready, with an error.
    fn sleep(&self, time: Duration) {
        let mut fds = Vec::with_capacity(2);
        for line in self.lines.iter().filter(|line| line.port.is_open()) {
            fds.push(PollFd::from_borrowed_fd(line.port.fd(), PollFlags::IN));
        }
        let time = Timespec {
            tv_sec: time.as_secs() as i64,
            tv_nsec: i64::from(time.subsec_nanos()),
        };
        // An interrupted sleep is only a shorter one.
        let _ = poll(&mut fds, Some(&time));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_whose_process_got_no_core_has_stood_still() {
        let ms = Duration::from_millis;
        assert_eq!(made_up(Duration::ZERO, Duration::ZERO), Duration::ZERO);
        assert_eq!(made_up(ms(5), ms(5)), ms(5));
        assert_eq!(made_up(ms(50), ms(50)), ms(50));
        assert_eq!(made_up(ms(3_000), ms(3_000)), ms(50));
        // A clock that runs twenty times as fast.
        assert_eq!(made_up(ms(600), ms(30)), ms(600));
        assert_eq!(made_up(ms(60_000), ms(3_000)), ms(1_000));
    }
}
