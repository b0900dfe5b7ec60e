//! The figures of a robot that is up, from its attendants.

use std::time::{Duration, Instant};

use lager_ports::BusConfig;

use crate::attendant::PULSE;
use crate::protocol::Pulse;

/// What the robot has done, over the lives of all attendants.
pub(crate) struct Figures {
    /// When it was started.
    pub(crate) started: Instant,
    /// The robot's time at its start, once a clock has shown it.
    pub(crate) robot_start: Option<Duration>,
    /// Whether an attendant has reported what the robot does.
    pub(crate) is_told: bool,
    /// The robot's time since its start, the moment of the last report, and the report.
    pub(crate) robot_time: Duration,
    pub(crate) told: Instant,
    pub(crate) last: Pulse,
    /// Frames of earlier attendants, and those that they lost themselves.
    pub(crate) frames: u64,
    pub(crate) lost: u64,
    /// Frames lost on the wires and by the services.
    pub(crate) lost_elsewhere: u64,
}

impl Figures {
    /// Nothing yet.
    pub(crate) fn new(now: Instant, robot_start: Option<Duration>) -> Self {
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

    /// Takes a report of the attendant.
    pub(crate) fn take(&mut self, pulse: Pulse) {
        self.last = pulse;
        if let Some(now) = pulse.robot_time {
            self.is_told = true;
            self.robot_time = now.saturating_sub(*self.robot_start.get_or_insert(now));
            self.told = Instant::now();
        }
    }

    /// The robot's time since its start.
    pub(crate) fn now(&self, bus: &BusConfig) -> Duration {
        let since_told = match bus.clock {
            Some(_) => self.told.elapsed().min(PULSE),
            None => self.told.elapsed(),
        };
        self.robot_time + since_told.mul_f64(bus.speed)
    }

    /// Adds what the attendant has counted; the next one counts from 0.
    pub(crate) fn attendant_ended(&mut self) {
        let last = core::mem::take(&mut self.last);
        self.frames += last.frames;
        self.lost += last.lost_here;
        // Every attendant reports this as a whole.
        self.lost_elsewhere = self.lost_elsewhere.max(last.lost_elsewhere);
    }
}
