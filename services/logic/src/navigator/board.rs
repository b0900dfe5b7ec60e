//! The steering board's reports: the state of the order in force, how far the wheels turned, the
//! arm and the battery.

use core::time::Duration;

use lager_orders::Mode;
use lager_topics::{FailureKind, Goal, Phase, SteeringReport, Thought, ThoughtKind};

use super::Navigator;
use crate::battery::Limits;
use crate::command::Progress;
use crate::ending::Ending;
use crate::manoeuvre::{Behaviour, STANDBY};
use crate::output::Output;

impl Navigator {
    /// Takes a report.
    pub(super) fn steering(&mut self, now: Duration, report: &SteeringReport, out: &mut Output) {
        if report.age_ms == 0 {
            self.senses.odometer.report(now, report, &self.config);
            self.hear_board(now, report, out);
        }
        if self.mode == Some(Mode::Manual) {
            return;
        }
        let one_shot = self.command.command().is_one_shot();
        let patience = if one_shot {
            self.config.unheard_one_shot
        } else {
            self.config.unheard_setpoint
        };
        match self.command.news(now, report, patience) {
            Progress::None => {}
            Progress::AtWork => self.in_vain = 0,
            Progress::Ended(finish) if one_shot => {
                let outcome = self.steer(now, out, |manoeuvre, helm| manoeuvre.ended(finish, helm));
                if let Some(outcome) = outcome {
                    self.conclude(now, outcome, out);
                }
            }
            Progress::Unheard if one_shot && self.active => self.manoeuvre.interrupt(),
            // A setpoint ends by a stop, a lapsed lease or a restarted board. It is given again,
            // but not faster than the bridge can answer.
            Progress::Ended(_) | Progress::Unheard => {
                let patience = self.config.unheard_setpoint;
                if self.active && self.command.is_older_than(now, patience) {
                    self.give_setpoint_anew(now, out);
                }
            }
        }
    }

    /// Gives the setpoint again, unless it was given in vain too often. The command to stand may be
    /// refused as well, but does not count.
    fn give_setpoint_anew(&mut self, now: Duration, out: &mut Output) {
        self.command.give_anew();
        if self.command.command() == STANDBY {
            return;
        }
        self.in_vain = self.in_vain.saturating_add(1);
        let (most, in_vain) = (self.config.tries, self.in_vain);
        if in_vain > most {
            self.in_vain = 0;
            let (most, in_vain) = (f32::from(most), f32::from(in_vain));
            let refused = Ending::Failed(FailureKind::BoardRefuses, most, in_vain);
            self.conclude(now, refused, out);
        }
    }

    /// The steering board has reported just now.
    fn hear_board(&mut self, now: Duration, report: &SteeringReport, out: &mut Output) {
        self.senses.arm.take(report);
        let again = self.holding.hear_board(now);
        if again && self.active && self.manoeuvre.turns_wheels() {
            self.manoeuvre.hear_again();
            out.think(ThoughtKind::BoardHeard);
        }
        self.watch_arm(out);
        self.watch_battery(now, report.battery_decivolts, out);
    }

    /// Checks, whenever the robot stands with goods, whether the arm is in its carry pose.
    pub(super) fn watch_arm(&mut self, out: &mut Output) {
        let carries = self.mission.goal == Goal::Delivery
            && matches!(
                self.mission.phase,
                Phase::Leaving
                    | Phase::Driving
                    | Phase::Turning
                    | Phase::Looking
                    | Phase::Halted
                    | Phase::TurningBack
                    | Phase::Exiting
            );
        // Somebody cancelled an order at the goods: the arm may still reach over them.
        let withdraws = self.mission.goal == Goal::Home
            && match self.mission.phase {
                // It waits there for a way.
                Phase::Picking => true,
                Phase::Leaving => self.holding.joint_off.is_some(),
                _ => false,
            };
        if !(carries || withdraws) || self.mission.forced {
            self.holding.joint_off = None;
        } else if self.command.command() == STANDBY || !self.active {
            self.holding.watch_arm(&self.senses.arm, &self.config, out);
        }
    }

    /// Takes the battery as low, or charged, when it has been so for a while.
    fn watch_battery(&mut self, now: Duration, decivolts: u8, out: &mut Output) {
        let limits = Limits {
            low: self.config.low_battery_decivolts,
            charged_by: self.config.charged_by_decivolts,
            steady: self.config.battery_steady,
        };
        let Some(is_low) = self.mission.battery.read(now, decivolts, limits) else {
            return;
        };
        let kind = match is_low {
            true => ThoughtKind::BatteryLow,
            false => ThoughtKind::BatteryCharged,
        };
        out.think(Thought {
            seen: decivolts.into(),
            ..kind.into()
        });
        self.leave_park(now, out);
    }

    /// Sets out again from the node where it stood, if nothing holds it there any more.
    pub(super) fn leave_park(&mut self, now: Duration, out: &mut Output) {
        if !self.mission.must_park() && core::mem::take(&mut self.mission.parked) {
            self.mission.set_out(out);
            self.begin(now, out);
        }
    }
}
