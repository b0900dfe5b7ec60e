//! What the main loop publishes: the state of everything, what the steering board does, and how
//! long the robot takes to react.
//!
//! It is apart because it only tells: nothing here decides or writes to a port.

use std::sync::atomic::Ordering;
use std::time::Duration;

use lager_ports::Cause;
use lager_wire::{Callsign, SteerData, SteerFlags};

use super::{Core, HEALTH_PERIOD};
use crate::frames::steering_report;

impl Core<'_> {
    pub(super) fn publish_health(&mut self, now: Duration) {
        self.boards.measure(self.shared);
        let dropped = self.shared.dropped.load(Ordering::Relaxed);
        let lost = self.orders.lost() + self.inputs.lost() + u64::from(dropped);
        let mode = (self.arbiter.mode(), self.arbiter.is_stopped());
        let sent = self.health.loan().and_then(|mut loan| {
            self.boards.fill(&mut loan);
            self.arbiter.fill(now, &mut loan);
            self.settings.fill(&mut loan);
            loan.bus_lost = self.lost_before + lost;
            if self.told_mode == Some(mode) {
                loan.send_quietly()
            } else {
                loan.send()
            }
        });
        match sent {
            Ok(()) => {
                self.health_revision = self.arbiter.revision();
                self.told_mode = Some(mode);
                self.told_setpoint = self.arbiter.has_setpoint();
            }
            Err(error) => self.complain(&error),
        }
        self.health_due = now + HEALTH_PERIOD;
    }

    /// Publishes what the steering board does. Without a report that means something it is what
    /// the board was told.
    pub(super) fn publish_state(&mut self, cause: Cause) {
        let told = SteerData {
            code: self
                .arbiter
                .current()
                .map_or(0, |(_, command)| command.code()),
            left_duty: 0,
            right_duty: 0,
            flags: SteerFlags::NONE,
            line_error: 0,
            finished_seq: 0,
            servo_errors: 0,
            battery_decivolts: 0,
        };
        let data = self.report.unwrap_or(told);
        let epoch = self.boards.epoch(Callsign::Steering);
        let sent = self.state.loan().and_then(|mut loan| {
            *loan = steering_report(epoch, &data, &self.servos, &self.arbiter);
            loan.cause(cause);
            loan.send()
        });
        match sent {
            Ok(()) => {
                self.state_revision = self.arbiter.revision();
                self.told_end = self.arbiter.last_ended();
            }
            Err(error) => self.complain(&error),
        }
    }

    /// Publishes how long frames took to become commands since the last time.
    pub(super) fn publish_latency(&mut self, now_ns: u64) {
        let sent = self.latency.loan().and_then(|mut loan| {
            self.path.fill(now_ns, &mut loan);
            loan.send()
        });
        if let Err(error) = sent {
            self.complain(&error);
        }
        self.path.restart(now_ns);
    }
}
