//! The emulator as a process: ptys, pace, clock page, truth lines.
//!
//! ```text
//!          as far as real time times the speed allows, half a millisecond at a time
//!              |
//!   ports --bytes--> rig.run_until --bytes--> ports
//!                          |--> clock page, every time
//!                          |--> a line of truth, 50 times a second and when goods change state
//!                          '<-- a place, when somebody takes the robot up and puts it there
//! ```
//! Where the machine is too slow, the chips' time falls behind and is not made up for: whoever
//! follows the page sees a slow robot, not a jumpy one.
//!
//! Safe state: a dead emulator has no motors. The steering board of a restarted one starts with
//! them off.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::mpsc::Receiver;

use lager_pty::{Port, PtyError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use thiserror::Error;

use crate::clock::{ClockError, ClockPage, monotonic_ns};
use crate::eeprom::{EepromError, EepromFile};
use crate::rig::{Board, Images, Rig, RigError, RigOptions};
use crate::truth::{Hand, TruthLine};

/// The most chip time between two looks at the ports.
const SLICE: Duration = Duration::from_micros(500);
/// The least that is worth waking up for, in real time.
const SHORTEST_SLEEP: Duration = Duration::from_micros(200);
/// Behind by more than this, the pace is given up and starts anew, in real time.
const GIVE_UP: Duration = Duration::from_millis(20);
/// From one truth to the next, in chip time.
const TRUTH_PERIOD: Duration = Duration::from_millis(20);

/// Both boards have sent their first bytes by then, in chip time: they start up for 65 ms.
const FIRST_BYTES: Duration = Duration::from_millis(100);

/// From one look at the EEPROMs to the next, in chip time.
const EEPROM_PERIOD: Duration = Duration::from_millis(100);

/// What the process needs to know.
#[derive(Debug)]
pub struct EmulatorConfig {
    /// World, seed, baud rate.
    pub rig: RigOptions,
    /// Where the sensor board's port is linked.
    pub sensor_link: PathBuf,
    /// Where the steering board's port is linked.
    pub steering_link: PathBuf,
    /// Chip time in real time; more than the machine can do means as fast as it can.
    pub speed: f64,
    /// The clock page, if one is wanted.
    pub clock: Option<PathBuf>,
    /// The folder in which the boards' EEPROMs are kept, if they are.
    pub eeprom: Option<PathBuf>,
    /// Whether lines of truth are written to standard output.
    pub truth: bool,
    /// The world to go on with.
    pub resume: Option<TruthLine>,
    /// So many things come and go on the edges.
    pub obstacles: u32,
    /// What somebody's hands do while it runs.
    pub hands: Option<Receiver<Hand>>,
}

/// Why the emulator ended.
#[derive(Debug, Error)]
pub enum RunError {
    /// The rig cannot be built.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A port could not be made.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The clock page cannot be had.
    #[error(transparent)]
    Clock(#[from] ClockError),
    /// An EEPROM cannot be kept.
    #[error(transparent)]
    Eeprom(#[from] EepromError),
    /// The images are built for another baud rate.
    #[error(
        "the image of the {} board sends at {found} Bd and the port is at {wanted}; give the rate that the images are built for (`--baud` here and of `lager up`), or build them for this one (`firmware/avr/build --baud {wanted}`)",
        board.name()
    )]
    Baud {
        /// Whose image.
        board: Board,
        /// How fast it sends.
        found: u32,
        /// How fast it should.
        wanted: u32,
    },
    /// No reader takes the truth.
    #[error("the truth cannot be written to standard output: {0}; leave --truth away")]
    Truth(#[source] io::Error),
}

/// Runs the emulated robot until `shutdown` is set.
///
/// # Errors
/// The images, the warehouse, the ports, the clock page or the output cannot be used.
pub fn run(
    images: &Images,
    mut config: EmulatorConfig,
    shutdown: &AtomicBool,
) -> Result<(), RunError> {
    let mut rig = Rig::new(images, &config.rig)?;
    rig.world_mut()
        .scatter_obstacles(config.obstacles, config.rig.seed)
        .map_err(RigError::from)?;
    if let Some(truth) = &config.resume {
        rig.resume(&truth.world_state());
    }
    let mut eeproms = Vec::new();
    for board in Board::BOTH {
        if let Some(folder) = &config.eeprom {
            let path = folder.join(board.name()).with_extension("eeprom");
            eeproms.push((board, EepromFile::load(&path, rig.chip(board))?));
        }
    }
    // Nobody follows the clock yet, so wrong images end the start, and not a robot that runs.
    rig.run_for(FIRST_BYTES);
    check_baud(&rig, config.rig.baud)?;
    let ports = [
        Port::create(&config.sensor_link)?,
        Port::create(&config.steering_link)?,
    ];
    let clock = config.clock.as_deref().map(ClockPage::open).transpose()?;
    let mut shell = Shell {
        pace: Pace::new(config.speed),
        rig,
        baud: config.rig.baud,
        ports,
        clock,
        eeproms,
        eeprom_due: Duration::ZERO,
        truth: config.truth,
        hands: config.hands.take(),
        truth_due: Duration::ZERO,
        changes_told: 0,
        bytes: Vec::with_capacity(4_096),
    };
    while !shutdown.load(Ordering::Relaxed) {
        shell.turn()?;
    }
    Ok(())
}

/// How far the chips may go.
#[derive(Debug)]
struct Pace {
    speed: f64,
    real_start: u64,
    chip_start: Duration,
}

impl Pace {
    fn new(speed: f64) -> Self {
        Self {
            speed,
            real_start: monotonic_ns(),
            chip_start: Duration::ZERO,
        }
    }

    /// Chip time that is due beyond `chip`, given up when it is too much.
    fn due(&mut self, chip: Duration, real: u64) -> Duration {
        let elapsed = Duration::from_nanos(real.saturating_sub(self.real_start));
        let wanted = self.chip_start + elapsed.mul_f64(self.speed);
        let due = wanted.saturating_sub(chip);
        if self.real(due) > GIVE_UP {
            self.real_start = real;
            self.chip_start = chip;
            return SLICE;
        }
        due
    }

    /// How long a span of chip time should last.
    fn real(&self, chip: Duration) -> Duration {
        chip.div_f64(self.speed)
    }
}

struct Shell {
    pace: Pace,
    rig: Rig,
    baud: u32,
    ports: [Port; 2],
    clock: Option<ClockPage>,
    eeproms: Vec<(Board, EepromFile)>,
    eeprom_due: Duration,
    truth: bool,
    hands: Option<Receiver<Hand>>,
    truth_due: Duration,
    changes_told: u64,
    bytes: Vec<u8>,
}

impl Shell {
    fn turn(&mut self) -> Result<(), RunError> {
        let now = self.rig.now();
        let due = self.pace.due(now, monotonic_ns()).min(SLICE);
        let missing = self.pace.real(SLICE.saturating_sub(due));
        if due < SLICE && missing >= SHORTEST_SLEEP {
            self.sleep(missing);
            self.listen();
            return Ok(());
        }
        self.listen();
        self.obey_hands()?;
        self.rig.run_for(due);
        self.speak()?;
        if let Some(clock) = &mut self.clock {
            clock.publish(self.rig.now());
        }
        self.keep_eeproms()?;
        self.tell_truth()
    }

    fn keep_eeproms(&mut self) -> Result<(), RunError> {
        let now = self.rig.now();
        if now >= self.eeprom_due {
            self.eeprom_due = now + EEPROM_PERIOD;
            for (board, file) in &mut self.eeproms {
                file.save(self.rig.chip(*board))?;
            }
        }
        Ok(())
    }

    /// What the Pi has written goes on its way.
    fn listen(&mut self) {
        for board in Board::BOTH {
            let port = &mut self.ports[board as usize];
            port.look();
            self.bytes.clear();
            port.read(&mut self.bytes);
            self.rig.write(board, &self.bytes);
        }
    }

    /// Does what somebody's hands do, and says what became of it.
    fn obey_hands(&mut self) -> Result<(), RunError> {
        for hand in self.hands.iter().flat_map(Receiver::try_iter) {
            let told = hand.act(&mut self.rig.world_mut());
            write_line(&told)?;
        }
        Ok(())
    }

    /// What has arrived at the Pi's end is handed over.
    fn speak(&mut self) -> Result<(), RunError> {
        check_baud(&self.rig, self.baud)?;
        for board in Board::BOTH {
            self.bytes.clear();
            let arrived = self.rig.read(board);
            self.bytes.extend(arrived.iter().map(|(_, byte)| byte));
            self.ports[board as usize].write(&self.bytes);
        }
        // Nobody here asks for them.
        self.rig.take_motor_changes();
        Ok(())
    }

    fn tell_truth(&mut self) -> Result<(), RunError> {
        if !self.truth {
            return Ok(());
        }
        let now = self.rig.now();
        let changes = self.rig.world().changes();
        if now < self.truth_due && changes == self.changes_told {
            return Ok(());
        }
        self.changes_told = changes;
        self.truth_due = now + TRUTH_PERIOD;
        write_line(&TruthLine::of(&self.rig))
    }

    /// Sleeps for `time`, or until somebody writes to an open port. A closed one cannot be waited
    /// on: it is always ready, with an error.
    fn sleep(&self, time: Duration) {
        let mut fds = Vec::with_capacity(2);
        for port in self.ports.iter().filter(|port| port.is_open()) {
            fds.push(PollFd::from_borrowed_fd(port.fd(), PollFlags::IN));
        }
        let time = Timespec {
            tv_sec: time.as_secs() as i64,
            tv_nsec: i64::from(time.subsec_nanos()),
        };
        // An interrupted sleep is only a shorter one.
        let _ = poll(&mut fds, Some(&time));
    }
}

/// Whether both boards send at the rate of the Pi's end, as far as they have sent.
fn check_baud(rig: &Rig, wanted: u32) -> Result<(), RunError> {
    for board in Board::BOTH {
        if let Some(found) = rig.foreign_baud(board) {
            return Err(RunError::Baud {
                board,
                found,
                wanted,
            });
        }
    }
    Ok(())
}

/// Writes a line of JSON to standard output.
fn write_line(line: &impl serde::Serialize) -> Result<(), RunError> {
    let mut out = io::stdout().lock();
    serde_json::to_writer(&mut out, line)
        .map_err(io::Error::from)
        .and_then(|()| out.write_all(b"\n"))
        .and_then(|()| out.flush())
        .map_err(RunError::Truth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_that_keeps_up_runs_as_far_as_real_time_goes() {
        let mut pace = Pace::new(2.0);
        let start = pace.real_start;
        assert_eq!(pace.due(Duration::ZERO, start), Duration::ZERO);
        let millisecond = start + 1_000_000;
        assert_eq!(
            pace.due(Duration::from_millis(1), millisecond),
            Duration::from_millis(1)
        );
    }

    #[test]
    fn what_a_slow_machine_has_missed_is_not_made_up_for() {
        let mut pace = Pace::new(1.0);
        let late = pace.real_start + 50_000_000;
        let chip = Duration::from_millis(10);
        assert_eq!(pace.due(chip, late), SLICE);
        assert_eq!(pace.due(chip, late), Duration::ZERO);
        assert_eq!(pace.due(chip, late + 300_000), Duration::from_micros(300));
    }
}
