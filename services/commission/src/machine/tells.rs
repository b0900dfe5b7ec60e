//! What the boards are told of the robot: one part at a time, and each only if a board obeys it not
//! yet.

use core::time::Duration;

use lager_orders::Moment;
use lager_topics::{Health, Outcome, Part, ProfileState};
use lager_wire::{ArmProfile, RobotProfile};

use super::{Commissioning, Effect, State};

/// A description that was refused is told again after this time: the wheels may just have stopped.
const RETRY: Duration = Duration::from_millis(200);
/// The parts of the description that are found out.
pub(super) const TOLD: [Part; 3] = Part::ALL;

/// The thresholds of the line sensors, which their board keeps. They come back before the parts of
/// the description, one request after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Thresholds {
    /// Nothing has changed them, or they are back.
    #[default]
    Former,
    /// A calibration has.
    New,
    /// They are to come back.
    Due,
    /// The bridge was asked for that.
    Asked,
}

impl Commissioning {
    /// The thresholds come back with what is told next.
    pub(super) fn take_thresholds_back(&mut self) {
        if self.thresholds == Thresholds::New {
            self.thresholds = Thresholds::Due;
            self.is_tried = true;
        }
    }

    /// To be called with the bridge's answer to [`Effect::Uncalibrate`]; `None` if there was none.
    pub fn uncalibrated(&mut self, now: Moment, outcome: Option<Outcome>) {
        self.thresholds = match outcome {
            Some(Outcome::Done) => Thresholds::Former,
            // Its board has another program, and never will.
            Some(Outcome::Refused) => {
                self.said.push("thresholds_stay".into());
                Thresholds::Former
            }
            _ => Thresholds::Due,
        };
        self.tells_on(now, self.thresholds == Thresholds::Former);
    }

    /// The arm that the steering board obeys.
    pub(super) fn told_arm(&self) -> Option<ArmProfile> {
        self.told[Part::Arm as usize].map(|told| told.arm)
    }

    /// To be called with the bridge's answer to [`Effect::Describe`]; `None` if there was none.
    pub fn described(&mut self, now: Moment, part: Part, outcome: Option<Outcome>) {
        let asked = self.under_way.take();
        let is_told = outcome == Some(Outcome::Done);
        if let Some(told) = self.told.get_mut(part as usize) {
            *told = asked.filter(|_| is_told);
        }
        self.tells_on(now, is_told);
    }

    /// Goes on to tell, after a while if the last request was in vain.
    fn tells_on(&mut self, now: Moment, is_told: bool) {
        let State::Tells { since, .. } = self.state else {
            return;
        };
        let pause = if is_told { Duration::ZERO } else { RETRY };
        self.state = State::Tells {
            since,
            due: Some(now.robot + pause),
        };
    }

    /// Lets the boards obey a description.
    pub(super) fn tell(&mut self, now: Moment, robot: RobotProfile) {
        self.wanted = robot;
        self.description = None;
        self.state = State::Tells {
            since: now.robot,
            due: Some(now.robot),
        };
        self.tell_next(now.robot);
    }

    /// Tells the next part that a board does not obey yet, one at a time.
    pub(super) fn tell_next(&mut self, since: Duration) {
        if self.under_way.is_some() || self.thresholds == Thresholds::Asked {
            self.state = State::Tells { since, due: None };
            return;
        }
        if self.thresholds == Thresholds::Due {
            self.thresholds = Thresholds::Asked;
            self.effects.push(Effect::Uncalibrate);
            self.state = State::Tells { since, due: None };
            return;
        }
        let is_open = |part: &Part| match (part, self.told[*part as usize]) {
            (_, None) => true,
            (Part::Steering, Some(told)) => told.steering != self.wanted.steering,
            (Part::Arm, Some(told)) => told.arm != self.wanted.arm,
            (Part::Sensors, Some(told)) => told.sensors != self.wanted.sensors,
        };
        if let Some(part) = TOLD.into_iter().find(is_open) {
            self.under_way = Some(self.wanted);
            self.is_tried = true;
            self.effects.push(Effect::Describe(part, self.wanted));
            self.state = State::Tells { since, due: None };
            return;
        }
        // Of what came before nobody knows by which description it was made.
        self.bits.clear();
        self.readings.clear();
        self.volts.clear();
        let listens = core::mem::take(&mut self.listens);
        self.state = match (self.is_leaving, listens) {
            (true, _) => State::Over,
            (false, true) => State::Listens { since: None },
            (false, false) => State::Asks,
        };
    }

    /// A board does not take a description.
    pub(super) fn undescribed(&mut self, now: Moment) {
        self.told = [None; TOLD.len()];
        self.under_way = None;
        if self.thresholds == Thresholds::Asked {
            self.thresholds = Thresholds::Due;
        }
        if self.is_leaving {
            if self.has_calibrated() {
                self.said.push("thresholds_stay".into());
            }
            self.said.push("undescribed".into());
            self.state = State::Over;
        } else {
            self.fall_back(now, "undescribed");
        }
    }
}

/// Whether both boards obey what they were told.
pub(super) fn is_obeyed(health: &Health) -> bool {
    [health.steering_profile, health.sensor_profile]
        .iter()
        .all(|told| *told == ProfileState::Accepted)
}
