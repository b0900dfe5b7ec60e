//! The simulated robot as a process, with ports, a bus and the clock.
//!
//! ```text
//!         sleep until input, or until something happens, at least 0.5 ms
//!              |
//!   ports --bytes--> robot.advance_to(clock) --bytes--> ports
//!                                  |--> truth/pose, 50 times a second and when goods change state
//!                                  |--> what the boards' EEPROMs keep, ten times a second
//!                                  '<-- world/request: what a person's hands would do
//! ```
//! Robot time is the bus's clock, so the robot runs at the same speed as all services. The loop
//! works in batches: it uses little processor time, and delays a byte by at most one batch.
//!
//! While this process gets no core, its world stands still. If the world caught up, the robot would
//! drive on with old commands that nobody could change meanwhile. On a machine that is too slow,
//! each batch would then also take longer than the one before.

use core::time::Duration;
use std::path::PathBuf;

use lager_home::Clock;
use lager_plant::{Build, Warehouse, WarehouseError, World};
use lager_ports::{Bus, Cause, KEPT_WAIT, PortError, Publisher, ReceiveError, SendError, Server};
use lager_pty::{EepromError, EepromFile, Port, PtyError};
use lager_topics::{TruthPose, WorldRequest};
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use thiserror::Error;

use crate::robot::{Robot, RobotOptions, Wire};
use crate::truth::{message, world_state};
use crate::world_requests::{answer, wish};

/// The shortest sleep between two batches, in real time.
const BATCH: Duration = Duration::from_micros(500);
/// The longest sleep, in real time. The process notices an opened port after at most this time.
const LONGEST_SLEEP: Duration = Duration::from_millis(5);
/// How much real time the world catches up with at once; for the rest it has stood still.
const MADE_UP: Duration = Duration::from_millis(50);

/// Time between two checks of the EEPROMs, in robot time.
const EEPROM_PERIOD: Duration = Duration::from_millis(100);

/// The configuration of the process.
#[derive(Clone, Debug)]
pub struct SimulatorConfig {
    /// The warehouse of the world.
    pub warehouse: Warehouse,
    /// The seed of every imperfection.
    pub seed: u64,
    /// How the robot is built.
    pub build: Build,
    /// The number of things that come and go on the edges.
    pub obstacles: u32,
    /// Baud rate of both serial lines.
    pub baud: u32,
    /// The path of the link to the sensor board's port.
    pub sensor_link: PathBuf,
    /// The path of the link to the steering board's port.
    pub steering_link: PathBuf,
    /// The folder of the boards' EEPROM files, if they are to be kept.
    pub eeprom: Option<PathBuf>,
    /// Whether to continue in the world that a killed predecessor has left on the bus, if it has.
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
    /// An EEPROM cannot be read.
    #[error(transparent)]
    Eeprom(#[from] EepromError),
    /// The bus cannot be used.
    #[error(transparent)]
    Bus(#[from] PortError),
    /// The process cannot receive requests to change the world.
    #[error(transparent)]
    Hands(#[from] ReceiveError),
    /// The process cannot publish `truth/pose`.
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
        build: config.build,
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
    let mut eeproms = Vec::new();
    for (wire, board) in [(Wire::Sensor, "sensor"), (Wire::Steering, "steering")] {
        if let Some(folder) = &config.eeprom {
            let file = EepromFile::open(folder, board)?;
            robot.set_eeprom(wire, file.content());
            eeproms.push((wire, file));
        }
    }
    let mut shell = Shell {
        eeproms,
        eeprom_due: robot.now(),
        is_lossy: false,
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

/// The part of the passed robot time that the world catches up with; `real` is its real time.
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
    eeproms: Vec<(Wire, EepromFile)>,
    eeprom_due: Duration,
    /// Whether it has been said that an EEPROM cannot be kept.
    is_lossy: bool,
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
            self.keep_eeproms(now);
            self.tell_truth(now)?;
            let quiet = clock.real(self.robot.next_event().saturating_sub(now));
            self.sleep(quiet.clamp(BATCH, LONGEST_SLEEP));
        }
        Ok(())
    }

    /// Passes bytes in both directions, after the robot has advanced to the present.
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
            // Logged once each time a program opens the port.
            *lost = if port.is_open() { *lost + dropped } else { 0 };
        }
    }

    /// Writes what the boards have changed. A robot whose folder is gone drives on.
    fn keep_eeproms(&mut self, now: Duration) {
        if now < self.eeprom_due {
            return;
        }
        self.eeprom_due = now + EEPROM_PERIOD;
        for (wire, file) in &mut self.eeproms {
            if let Err(error) = file.save(self.robot.eeprom(*wire))
                && !core::mem::replace(&mut self.is_lossy, true)
            {
                tracing::warn!("{error}");
            }
        }
    }

    /// Answers the requests to change the world.
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
        self.truth_due = now + World::TRUTH_PERIOD;
        self.truth.send(Cause::OWN, message(&self.robot.truth()))
    }

    /// Sleeps for `time`, or until a program writes to an open port. It cannot wait on a closed
    /// port, which is always ready, with an error.
    fn sleep(&self, time: Duration) {
        let mut fds = Vec::with_capacity(2);
        for line in self.lines.iter().filter(|line| line.port.is_open()) {
            fds.push(PollFd::from_borrowed_fd(line.port.fd(), PollFlags::IN));
        }
        let time = Timespec {
            tv_sec: time.as_secs() as i64,
            tv_nsec: i64::from(time.subsec_nanos()),
        };
        // A signal only makes the sleep shorter.
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
        // For a clock that runs twenty times as fast.
        assert_eq!(made_up(ms(600), ms(30)), ms(600));
        assert_eq!(made_up(ms(60_000), ms(3_000)), ms(1_000));
    }
}
