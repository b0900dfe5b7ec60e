//! Orders that run once: quarter turns and the drop. Each gets its own id, and its end is read
//! from the bridge's reports.
//!
//! ```text
//!            Done                               Done: the next quarter, or the phase's end
//!   order ---------> judged by its angle ------>
//!     |                                         fragment: again, with a new id
//!     | Aborted, Refused, unheard                                ^
//!     +-------> stand for a moment --> judged by angle and line -+
//! ```

use lager_topics::{Finish, Heading, Phase};
use lager_wire::{ArmCommand, Command, LineState, WheelCommand};

use super::{Navigator, Output, Pause, say};
use crate::heading::{Compass, Spin};
use crate::turn::{self, Turned};

impl Navigator {
    /// Turns to `target`, quarter by quarter, and then goes on as `phase` says.
    pub(super) fn begin_turn(&mut self, target: Heading, phase: Phase, out: &mut Output) {
        self.phase = phase;
        self.target = target;
        self.tries = 0;
        self.pause = Pause::None;
        self.odometer.turned_deg = 0.0;
        self.marks.clear();
        self.command.give_anew();
        if phase == Phase::Turning {
            self.odometer.travelled_mm = 0.0;
            let side = match self.spin() {
                Spin::Left => "left",
                Spin::Right => "right",
            };
            say!(out, "At crossing {} I turn {side}.", self.node);
        }
    }

    /// The command of a phase that runs once.
    pub(super) fn one_shot_command(&self) -> Option<Command> {
        match self.phase {
            Phase::Turning | Phase::Positioning | Phase::Leaving | Phase::TurningRound => {
                Some(Command::Wheel(match self.spin() {
                    Spin::Left => WheelCommand::LeftPerp,
                    Spin::Right => WheelCommand::RightPerp,
                }))
            }
            Phase::Dropping => Some(Command::Arm(ArmCommand::Drop)),
            _ => None,
        }
    }

    /// Which way to turn to the target: the short way, and for a half turn the way on which the
    /// first quarter meets tape too.
    fn spin(&self) -> Spin {
        let tape = |heading| {
            self.phase == Phase::Turning
                && self
                    .map
                    .as_ref()
                    .is_some_and(|map| map.has_tape(self.node, heading))
        };
        match self.heading.quarters_right_to(self.target) {
            1 => Spin::Right,
            2 if tape(self.heading.right()) || !tape(self.heading.left()) => Spin::Right,
            _ => Spin::Left,
        }
    }

    pub(super) fn one_shot_ended(&mut self, finish: Finish, out: &mut Output) {
        match finish {
            Finish::None => {}
            Finish::Aborted | Finish::Refused => self.pause = Pause::Wanted,
            Finish::Done if self.phase == Phase::Dropping => self.have_delivered(out),
            Finish::Done => {
                let angle = self.odometer.turned_deg * self.spin().sign();
                let seen = self.sight.map_or(LineState::NotOnLine, |(_, seen)| seen);
                self.turned(turn::done(angle, seen), out);
            }
        }
    }

    /// The robot has stood for a moment: judge what was interrupted and begin it (again).
    pub(super) fn end_pause(&mut self, out: &mut Output) {
        if self.phase == Phase::Dropping {
            return self.begin_again(out);
        }
        let (Some(seen), Some(Command::Wheel(_))) = (self.sure_sight, self.one_shot_command())
        else {
            return;
        };
        let spin = self.spin();
        let angle = self.odometer.turned_deg * spin.sign();
        self.turned(turn::interrupted(angle, spin, seen), out);
    }

    fn begin_again(&mut self, out: &mut Output) {
        self.tries += 1;
        if self.tries > self.config.tries {
            return self.get_stuck("The steering board does not do what I ask", out);
        }
        self.command.give_anew();
    }

    fn turned(&mut self, turned: Turned, out: &mut Output) {
        let Turned::Quarters(quarters) = turned else {
            return self.begin_again(out);
        };
        let spin = self.spin();
        self.heading = self.heading.turned(spin, quarters);
        self.odometer.turned_deg -= 90.0 * f32::from(quarters) * spin.sign();
        if self.heading != self.target {
            self.command.give_anew();
            return;
        }
        match self.phase {
            Phase::Positioning => self.be_in_position(out),
            Phase::Leaving => self.drive_from_here(Phase::Driving),
            Phase::TurningRound => {
                self.odometer.travelled_mm = self.exit_mm - self.odometer.travelled_mm;
                self.drive_from_here(Phase::Returning);
            }
            _ => self.set_out(out),
        }
    }
}
