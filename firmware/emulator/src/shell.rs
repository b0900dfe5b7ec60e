//! Runs the emulator as a process: it serves two ptys, keeps pace, and writes clock page and truth.
//!
//! ```text
//!          as far as real time times the speed allows, half a millisecond at a time
//!              |
//!   ports --bytes--> rig.run_until --bytes--> ports
//!                          |--> clock page, every time
//!                          |--> a line of truth, 50 times a second and when goods change state
//!                          '<-- a place, when somebody takes the robot up and puts it there
//! ```
//! On a machine that is too slow the chips' time falls behind and does not catch up, so a process
//! that follows the page sees a slow robot and not a jumpy one.
//!
//! Safe state: without the emulator no motor turns, and a restarted one starts with motors off.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::mpsc::Receiver;

use lager_plant::{Hand, Report, World, WorldState};
use lager_pty::{EepromError, EepromFile, Port, PtyError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use thiserror::Error;

use crate::chip::EEPROM;
use crate::clock::{ClockError, ClockPage, monotonic_ns};
use crate::rig::{Board, Images, Rig, RigError, RigOptions};

/// The most chip time between two reads of the ports.
const SLICE: Duration = Duration::from_micros(500);
/// Shorter sleeps are left out, in real time.
const SHORTEST_SLEEP: Duration = Duration::from_micros(200);
/// If the chips are behind by more than this, in real time, the pace starts again from now.
const GIVE_UP: Duration = Duration::from_millis(20);

/// Both boards have sent their first bytes by then, in chip time: their start-up takes 65 ms.
const FIRST_BYTES: Duration = Duration::from_millis(100);

/// Time between two checks of the EEPROMs, in chip time.
const EEPROM_PERIOD: Duration = Duration::from_millis(100);

/// Options of the process.
#[derive(Debug)]
pub struct EmulatorConfig {
    /// Warehouse, seed and baud rate.
    pub rig: RigOptions,
    /// Where the sensor board's port is linked.
    pub sensor_link: PathBuf,
    /// Where the steering board's port is linked.
    pub steering_link: PathBuf,
    /// Chip time divided by real time; more than the machine can do means as fast as it can.
    pub speed: f64,
    /// The file of the clock page, if there is to be one.
    pub clock: Option<PathBuf>,
    /// The folder of the boards' EEPROM files, if they are to be kept.
    pub eeprom: Option<PathBuf>,
    /// Whether the emulator writes lines of truth to standard output.
    pub truth: bool,
    /// The world to go on with.
    pub resume: Option<WorldState>,
    /// How many things appear on edges at random, and disappear.
    pub obstacles: u32,
    /// A person's actions while it runs: moving the robot, putting or taking a thing.
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
        /// The board of this image.
        board: Board,
        /// The rate at which it sends, in baud.
        found: u32,
        /// The rate that the port has, in baud.
        wanted: u32,
    },
    /// Nobody reads standard output.
    #[error("cannot write the truth to standard output: {0}; read it, or start without --truth")]
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
    if let Some(world) = &config.resume {
        rig.resume(world);
    }
    let mut eeproms = Vec::new();
    for board in Board::BOTH {
        if let Some(folder) = &config.eeprom {
            let file = EepromFile::open(folder, board.name())?;
            rig.chip(board).set_eeprom(file.content());
            eeproms.push((board, file));
        }
    }
    // No service follows the clock yet, so a wrong image stops the start and not a running robot.
    rig.run_for(FIRST_BYTES);
    check_baud(&rig, config.rig.baud)?;
    let ports = [
        Port::create(&config.sensor_link)?,
        Port::create(&config.steering_link)?,
    ];
    let clock = config.clock.as_deref().map(ClockPage::open).transpose()?;
    let mut shell = Shell {
        pace: Allowance::new(config.speed),
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

/// How far the chips may run.
#[derive(Debug)]
struct Allowance {
    speed: f64,
    real_start: u64,
    chip_start: Duration,
}

impl Allowance {
    fn new(speed: f64) -> Self {
        Self {
            speed,
            real_start: monotonic_ns(),
            chip_start: Duration::ZERO,
        }
    }

    /// The chip time that is due beyond `chip`; starts the pace again if it is too much.
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

    /// How long a span of chip time should take in real time.
    fn real(&self, chip: Duration) -> Duration {
        chip.div_f64(self.speed)
    }
}

struct Shell {
    pace: Allowance,
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
                file.save(&self.rig.chip(*board).eeprom(EEPROM))?;
            }
        }
        Ok(())
    }

    /// Hands the Pi's bytes to the boards.
    fn listen(&mut self) {
        for board in Board::BOTH {
            let port = &mut self.ports[board as usize];
            port.look();
            self.bytes.clear();
            port.read(&mut self.bytes);
            self.rig.write(board, &self.bytes);
        }
    }

    /// Carries out a person's actions and reports the result of each.
    fn obey_hands(&mut self) -> Result<(), RunError> {
        for hand in self.hands.iter().flat_map(Receiver::try_iter) {
            let hand = hand.act(&mut self.rig.world_mut());
            write_line(&Report::Hand(hand))?;
        }
        Ok(())
    }

    /// Hands the boards' bytes to the Pi.
    fn speak(&mut self) -> Result<(), RunError> {
        check_baud(&self.rig, self.baud)?;
        for board in Board::BOTH {
            self.bytes.clear();
            let arrived = self.rig.read(board);
            self.bytes.extend(arrived.iter().map(|(_, byte)| byte));
            self.ports[board as usize].write(&self.bytes);
        }
        // Recorded for measurements, which do not run here.
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
        self.truth_due = now + World::TRUTH_PERIOD;
        write_line(&Report::Truth(self.rig.truth()))
    }

    /// Sleeps for `time`, or until somebody writes to an open port. A closed port would end the
    /// sleep at once, because it is always ready with an error.
    fn sleep(&self, time: Duration) {
        let mut fds = Vec::with_capacity(2);
        for port in self.ports.iter().filter(|port| port.is_open()) {
            fds.push(PollFd::from_borrowed_fd(port.fd(), PollFlags::IN));
        }
        let time = Timespec {
            tv_sec: time.as_secs() as i64,
            tv_nsec: i64::from(time.subsec_nanos()),
        };
        // An interrupted sleep is only shorter.
        let _ = poll(&mut fds, Some(&time));
    }
}

/// Checks that both boards send at the rate of the Pi's end, if they have sent.
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
fn write_line(line: &Report) -> Result<(), RunError> {
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
        let mut pace = Allowance::new(2.0);
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
        let mut pace = Allowance::new(1.0);
        let late = pace.real_start + 50_000_000;
        let chip = Duration::from_millis(10);
        assert_eq!(pace.due(chip, late), SLICE);
        assert_eq!(pace.due(chip, late), Duration::ZERO);
        assert_eq!(pace.due(chip, late + 300_000), Duration::from_micros(300));
    }
}
