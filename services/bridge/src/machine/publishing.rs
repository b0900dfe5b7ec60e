//! The core's publications: the state of everything, and the state of the steering board.
//!
//! They stand apart because they only publish and decide nothing.

use core::time::Duration;

use lager_orders::Moment;
use lager_topics::{Health, Role, SteeringReport};
use lager_wire::{Callsign, SteerData, Version};

use super::effect::Effect;
use super::{BridgeCore, HEALTH_PERIOD};
use crate::counts::Counts;
use crate::frames::steering_report;

/// A report that has waited longer than this is out of date, in robot time; a new one comes every
/// [`REPORT_PERIOD`](super::REPORT_PERIOD).
const FRESH: Duration = Duration::from_millis(20);

impl BridgeCore {
    /// Publishes `link/health`, whether it has news or not.
    pub fn tell_health(&mut self) {
        self.due.health = true;
    }

    /// Writes `link/health`, except the losses of the bus.
    pub fn fill_health(&mut self, now: Duration, counts: &Counts, health: &mut Health) {
        self.boards.measure(counts);
        self.boards.fill(health);
        self.arbiter.fill(now, health);
        self.settings.fill(health);
        self.profiles.fill(health);
        self.calibration.fill(health);
        if let Some(stop) = self.stop {
            health.stop_cause = stop.cause().into();
            health.stop_origin = stop.origin().unwrap_or(Role::Bridge).into();
            health.stopped_at_ns = stop.at_ns();
            health.stop_word = stop.word();
        }
    }

    /// `link/health` has been published.
    pub fn health_told(&mut self) {
        self.told.health = self.arbiter.revision();
        self.told.mover = Some(self.who_may_move());
        self.told.setpoint = self.arbiter.has_setpoint();
    }

    /// Writes `steering/state`: what the steering board does, and how old its report is, because
    /// the end of an order is published without a new report. Without a usable report it shows the
    /// command that the board was sent.
    pub fn fill_state(&self, now: Duration, state: &mut SteeringReport) {
        let told = SteerData {
            code: self
                .arbiter
                .current()
                .map_or(0, |(_, command)| command.code()),
            ..SteerData::default()
        };
        let (data, age_ms) = match (self.report, self.boards.version(Callsign::Steering)) {
            (Some((data, read)), _) => {
                let age = now.saturating_sub(read.robot);
                let age_ms = u16::try_from(age.as_millis()).unwrap_or(u16::MAX);
                let is_fresh = !self.told.report && age < FRESH;
                let age_ms = age_ms.clamp(1, SteeringReport::NEVER_HEARD - 1);
                (data, if is_fresh { 0 } else { age_ms })
            }
            (None, Some(Version::Original)) => (told, 0),
            (None, _) => (told, SteeringReport::NEVER_HEARD),
        };
        let epoch = self.boards.epoch(Callsign::Steering);
        *state = steering_report(epoch, &data, age_ms, &self.servos, &self.arbiter);
    }

    /// Whether this `steering/state` says something new that somebody acts upon. While the robot
    /// stands, most reports only repeat the board's line, battery and loads.
    pub fn is_news(&self, state: &SteeringReport) -> bool {
        let stands = (state.left_duty, state.right_duty) == (0, 0);
        !stands || without_measurements(state) != without_measurements(&self.told.shown)
    }

    /// `steering/state` has been published.
    pub fn state_told(&mut self, shown: &SteeringReport) {
        self.told.shown = *shown;
        self.told.report = true;
        self.told.state = self.arbiter.revision();
        self.told.end = self.arbiter.last_ended();
    }

    pub(super) fn publish_health(&mut self, now: Moment) -> Effect {
        self.health_due = now.robot + HEALTH_PERIOD;
        let rings = self.told.mover != Some(self.who_may_move());
        Effect::PublishHealth { rings }
    }
}

/// A report without its measurements, and without its age if it has one.
fn without_measurements(report: &SteeringReport) -> SteeringReport {
    let is_unheard = report.age_ms == SteeringReport::NEVER_HEARD;
    SteeringReport {
        line_error: 0,
        battery_decivolts: 0,
        age_ms: if is_unheard { report.age_ms } else { 0 },
        servo_load: [0; 8],
        ..*report
    }
}
