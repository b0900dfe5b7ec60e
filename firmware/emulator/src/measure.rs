//! Measures how fast the images react, in exact chip cycles that are the same in every run.
//!
//! ```text
//!   robot follows a straight line, settled; at one of many phases of both boards' loops
//!   the tape jumps two sensors aside
//!       |----- tape to UART: the first start bit of the line packet that reports it
//!       |----- tape to duty: the write that gives a motor another duty
//! ```
//! Only `real_time_factor` depends on the machine.

use core::time::Duration;

use lager_plant::Pose;
use lager_wire::{Command, LineState, Payload, WheelCommand};
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use thiserror::Error;

use crate::chip::{FREQUENCY, InterruptStatistics};
use crate::pi::{Pi, run_for, run_until};
use crate::rig::{Board, Images, Rig, RigError, RigOptions};

/// Both boards have this long to connect to the Pi.
const COMING_UP: Duration = Duration::from_millis(600);
/// Time from a trial's start to its jump, in cycles: 30 ms, some byte times, and a phase.
const SETTLING: u64 = FREQUENCY * 30 / 1_000;
const SETTLING_BYTES: u64 = 30;
/// If a duty changed this shortly before the jump, the robot is not settled; in cycles: 15 ms.
const QUIET: u64 = FREQUENCY * 15 / 1_000;
/// A jump must show within this time, in cycles: 60 ms.
const SHOWING: u64 = FREQUENCY * 60 / 1_000;
/// Number of robots. Their boards start at different times, so their rarer work coincides in
/// different ways.
const ROBOTS: u64 = 3;
/// Phases for each robot. Their distance has no common divisor with any period of the boards.
const PHASES: u64 = 140;
const PHASE: u64 = 16_139;
/// Phases are spread over this many cycles: longer than a pass of the sensor board at 9600 Bd.
const SPREAD: u64 = 400_000;
/// Phases around the sensor board's status. Its pass is the board's longest, and comes only twice a
/// second.
const STATUS_PHASES: u64 = 10;
const STATUS_PERIOD: u64 = FREQUENCY / 2;
/// Phases begin two passes before the next status, this many cycles apart.
const BEFORE_STATUS: u64 = 16_000;
const STATUS_PHASE: u64 = 1_600;
/// Where the robot stands on its first edge, and how far the tape jumps, in mm.
const PLACE: f64 = 60.0;
const JUMP: f64 = 14.0;
/// How often a trial is checked.
const SLICE: Duration = Duration::from_millis(1);
/// How long interrupts are measured while the robot drives.
const DRIVE: Duration = Duration::from_secs(2);

/// Why a measurement failed.
#[derive(Debug, Error)]
pub enum MeasureError {
    /// The rig cannot be built.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A board did not answer the Pi.
    #[error(
        "the {0:?} board did not shake hands; is it the image of that board, and its baud rate --baud?"
    )]
    NotUp(Board),
    /// Nothing reacted to a jump of the tape, or no status came.
    #[error("{0} did not come within 60 ms; can these images follow a line?")]
    NoAnswer(&'static str),
    /// The duties of every robot changed just before every jump.
    #[error("the duties changed all the time on a straight line; check the regulator's gains")]
    NeverSettled,
}

/// Times over all phases, in cycles of 62.5 ns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Span {
    /// The shortest.
    pub best: u64,
    /// The middle one.
    pub median: u64,
    /// 99 % of the times are at most this long.
    pub p99: u64,
    /// The longest: the worst phase.
    pub worst: u64,
}

impl Span {
    /// `None` if there are no times.
    fn of(mut cycles: Vec<u64>) -> Option<Self> {
        cycles.sort_unstable();
        let last = cycles.len().checked_sub(1)?;
        Some(Self {
            best: cycles[0],
            median: cycles[cycles.len() / 2],
            p99: cycles[(cycles.len() * 99 / 100).min(last)],
            worst: cycles[last],
        })
    }
}

/// Figures of one board while the robot drives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoardFigures {
    /// How many bytes of flash the image fills.
    pub flash_bytes: usize,
    /// The longest time from an interrupt's flag to its first instruction, in cycles.
    pub worst_interrupt_latency: u64,
    /// Share of time in interrupts, 0 to 1.
    pub interrupt_share: f64,
    /// Share of time the core is awake, 0 to 1.
    pub awake_share: f64,
    /// All vectors, in cycles.
    pub interrupts: InterruptStatistics,
}

/// All figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// The chips' clock.
    pub frequency_hz: u64,
    /// The lines' baud rate.
    pub baud: u32,
    /// The version of rustc that built the sensor board's image.
    pub rustc: String,
    /// How many phases of the sensor board's loop were measured.
    pub phases: u64,
    /// From the tape's jump to the write of another duty. The pin follows at the end of the running
    /// PWM period.
    pub tape_to_duty: Span,
    /// One PWM period, in cycles.
    pub pwm_period: u64,
    /// From the tape's jump to the first start bit of the packet that reports it.
    pub tape_to_uart: Span,
    /// The sensor board.
    pub sensor: BoardFigures,
    /// The steering board.
    pub steering: BoardFigures,
    /// Chip time divided by processor time while the robot drove: how fast one core runs both
    /// boards. Depends on the machine.
    pub real_time_factor: f64,
}

/// Measures the pair of images.
///
/// # Errors
/// The rig cannot be built, or the images do not do what this measures.
pub fn measure(images: &Images, options: &RigOptions) -> Result<Figures, MeasureError> {
    let (mut to_duty, mut to_uart) = (Vec::new(), Vec::new());
    for robot in 1..ROBOTS {
        let options = RigOptions {
            seed: options.seed.wrapping_add(robot),
            ..options.clone()
        };
        Bench::new(images, &options)?.jumps(&mut to_duty, &mut to_uart)?;
    }
    let mut bench = Bench::new(images, options)?;
    bench.jumps(&mut to_duty, &mut to_uart)?;
    let factor = bench.drive();
    let figures = |board: Board, image: &crate::chip::Image| {
        let chip = bench.rig.chip(board);
        let interrupts = chip.interrupts();
        BoardFigures {
            flash_bytes: image.flash_bytes(),
            worst_interrupt_latency: interrupts.worst_latency,
            interrupt_share: interrupts.share(),
            awake_share: 1.0
                - (chip.slept() - bench.slept[board as usize]) as f64 / interrupts.cycles as f64,
            interrupts,
        }
    };
    let prescaler = match bench
        .rig
        .chip(Board::Steering)
        .register(crate::chip::register::TCCR2B)
        & 7
    {
        0 => 0,
        1 => 1,
        2 => 8,
        3 => 32,
        4 => 64,
        5 => 128,
        6 => 256,
        _ => 1_024,
    };
    Ok(Figures {
        frequency_hz: FREQUENCY,
        baud: options.baud,
        rustc: images.sensor.rustc().to_owned(),
        phases: to_duty.len() as u64,
        tape_to_duty: Span::of(to_duty).ok_or(MeasureError::NeverSettled)?,
        pwm_period: 256 * prescaler,
        tape_to_uart: Span::of(to_uart).ok_or(MeasureError::NeverSettled)?,
        sensor: figures(Board::Sensor, &images.sensor),
        steering: figures(Board::Steering, &images.steering),
        real_time_factor: factor,
    })
}

struct Bench {
    rig: Rig,
    sensor: Pi,
    steering: Pi,
    slept: [u64; 2],
}

impl Bench {
    fn new(images: &Images, options: &RigOptions) -> Result<Self, MeasureError> {
        let mut bench = Self {
            rig: Rig::new(images, options)?,
            sensor: Pi::new(Board::Sensor),
            steering: Pi::new(Board::Steering),
            slept: [0; 2],
        };
        bench.run(COMING_UP);
        for (pi, board) in [
            (&bench.sensor, Board::Sensor),
            (&bench.steering, Board::Steering),
        ] {
            if !pi.is_up() {
                return Err(MeasureError::NotUp(board));
            }
        }
        bench.place(0.0);
        let follow = Command::Wheel(WheelCommand::ActiveForward);
        bench.steering.order(&mut bench.rig, follow);
        Ok(bench)
    }

    /// Measures all phases and adds their times.
    fn jumps(
        &mut self,
        to_duty: &mut Vec<u64>,
        to_uart: &mut Vec<u64>,
    ) -> Result<(), MeasureError> {
        let settling = SETTLING + SETTLING_BYTES * self.rig.byte_cycles();
        for phase in 0..PHASES + STATUS_PHASES {
            let settled = self.rig.cycle() + settling;
            let jump = match phase.checked_sub(PHASES) {
                None => settled + phase * PHASE % SPREAD,
                Some(phase) => {
                    self.next_status(settled + BEFORE_STATUS)? - BEFORE_STATUS
                        + phase * STATUS_PHASE
                }
            };
            self.run_until(jump - settling);
            self.place(0.0);
            self.run_until(jump);
            let latest = self
                .rig
                .take_motor_changes()
                .last()
                .map(|change| change.cycle);
            if latest.is_some_and(|latest| latest + QUIET > jump) {
                continue;
            }
            let (duty, uart) = self.jump()?;
            to_duty.push(duty);
            to_uart.push(uart);
        }
        Ok(())
    }

    /// Lets the tape jump now. Returns the cycles until a duty changes and until a packet reports
    /// it.
    fn jump(&mut self) -> Result<(u64, u64), MeasureError> {
        let jump = self.rig.cycle();
        let (mut to_duty, mut to_uart) = (None, None);
        self.sensor.packets.clear();
        self.place(JUMP);
        while self.rig.cycle() < jump + SHOWING {
            self.run(SLICE);
            let changes = self.rig.take_motor_changes();
            let duty = changes.first().map(|change| change.cycle - jump);
            let told = self.sensor.packets.iter().find(|arrived| {
                let aside = [LineState::LeftOfLine, LineState::RightOfLine];
                arrived.from > jump && aside.map(Payload::Line).contains(&arrived.packet.payload)
            });
            to_duty = to_duty.or(duty);
            to_uart = to_uart.or(told.map(|arrived| arrived.from - jump));
            if let (Some(duty), Some(uart)) = (to_duty, to_uart) {
                return Ok((duty, uart));
            }
        }
        Err(MeasureError::NoAnswer(if to_duty.is_none() {
            "another duty"
        } else {
            "a line packet"
        }))
    }

    /// When the sensor board will send a status, at least half a second after `after`, counted from
    /// its latest one.
    fn next_status(&mut self, after: u64) -> Result<u64, MeasureError> {
        self.sensor.packets.clear();
        self.run_until(self.rig.cycle() + STATUS_PERIOD + SHOWING);
        let latest = self.sensor.packets.iter().rev().find_map(|arrived| {
            let is_status = matches!(arrived.packet.payload, Payload::BoardStatus(_));
            is_status.then_some(arrived.from)
        });
        let mut next = latest.ok_or(MeasureError::NoAnswer("a board status"))?;
        while next < after + STATUS_PERIOD {
            next += STATUS_PERIOD;
        }
        Ok(next)
    }

    /// Drives along the line with cleared figures. Returns the real-time factor.
    fn drive(&mut self) -> f64 {
        self.place(0.0);
        for board in Board::BOTH {
            let chip = self.rig.chip(board);
            chip.clear_interrupts();
            self.slept[board as usize] = chip.slept();
        }
        let start = processor_time();
        self.run(DRIVE);
        DRIVE.as_secs_f64() / (processor_time() - start).as_secs_f64()
    }

    /// Puts the robot on its first edge, this far to the left of the line, in mm.
    fn place(&mut self, left: f64) {
        let pose = Pose {
            x: PLACE,
            y: left,
            heading: 0.0,
        };
        self.rig.world_mut().place(pose);
    }

    fn run(&mut self, time: Duration) {
        run_for(
            &mut self.rig,
            &mut [&mut self.sensor, &mut self.steering],
            time,
        );
    }

    fn run_until(&mut self, cycle: u64) {
        run_until(
            &mut self.rig,
            &mut [&mut self.sensor, &mut self.steering],
            cycle,
        );
    }
}

/// Processor time of this thread.
fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}
