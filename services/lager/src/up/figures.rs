//! What a robot that is up has done, as its attendants tell it.

use std::time::{Duration, Instant};

use crate::config::Config;
use crate::words::Pulse;

/// How long after a pulse an emulated body's time is taken to go on.
const PULSE: Duration = Duration::from_millis(200);

/// What the robot has done, over the lives of all attendants.
pub struct Figures {
    /// When it was started.
    pub started: Instant,
    /// The robot's time at its start, once a clock has shown it.
    pub robot_start: Option<Duration>,
    /// Whether an attendant has told what the robot does.
    pub is_told: bool,
    /// The robot's time since its start, when that was told last, and what was told with it.
    pub robot_time: Duration,
    pub told: Instant,
    pub last: Pulse,
    /// Frames of the attendants before this one, and those that they lost themselves.
    pub frames: u64,
    pub lost: u64,
    /// Frames lost on the wires and by the services.
    pub lost_elsewhere: u64,
}

impl Figures {
    /// Nothing yet.
    pub fn new(now: Instant, robot_start: Option<Duration>) -> Self {
        Self {
            started: now,
            robot_start,
            is_told: false,
            robot_time: Duration::ZERO,
            told: now,
            last: Pulse::default(),
            frames: 0,
            lost: 0,
            lost_elsewhere: 0,
        }
    }

    /// Takes what the attendant tells.
    pub fn take(&mut self, pulse: Pulse) {
        self.last = pulse;
        if let Some(now) = pulse.robot_time {
            self.is_told = true;
            self.robot_time = now.saturating_sub(*self.robot_start.get_or_insert(now));
            self.told = Instant::now();
        }
    }

    /// The robot's time since its start.
    pub fn now(&self, config: &Config) -> Duration {
        let since_told = match config.chip.clock {
            Some(_) => self.told.elapsed().min(PULSE),
            None => self.told.elapsed(),
        };
        self.robot_time + since_told.mul_f64(config.speed)
    }

    /// Keeps what the attendant has counted; the next one counts from 0.
    pub fn attendant_ended(&mut self) {
        let last = core::mem::take(&mut self.last);
        self.frames += last.frames;
        self.lost += last.lost_here;
        // This is told whole by whoever looks.
        self.lost_elsewhere = self.lost_elsewhere.max(last.lost_elsewhere);
    }
}
