//! Turning on the spot, quarter by quarter. Each quarter is an order that runs once; its end is
//! read from the bridge's reports.
//!
//! ```text
//!            Done                               Done: the next quarter, or the turn's end
//!   order ---------> judged by its angle ------>
//!     |                                         fragment: again, with a new id
//!     | Aborted, Refused, unheard                                ^
//!     +-------> stand for a moment --> judged by angle and line -+
//! ```

use lager_topics::{FailureKind, Finish, Heading, NavigatorStatus};
use lager_wire::{Command, LineState, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Pause, STANDBY, Senses};
use crate::config::LogicConfig;
use crate::heading::{Compass, Spin};
use crate::outcome::Outcome;
use crate::turn::{Turned, done, interrupted, is_bare};

/// In a status's doubt: the quarter before the one at hand ended without tape.
const FROM_BARE: u8 = 16;

/// Where a turn takes place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Spot {
    /// On a node.
    Node,
    /// So many mm behind a node.
    Edge(f32),
    /// On a line so many mm long: what lies behind the robot then lies ahead.
    Along(f32),
}

/// A turn to a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    target: Heading,
    pub(super) spot: Spot,
    /// Which way a half turn goes: where its first quarter meets tape too.
    half: Spin,
    /// How often the order at hand has been begun anew.
    tries: u8,
    /// It was cut short, or went on unheard.
    disturbed: bool,
    /// The quarter before ended without tape under the sensors.
    from_bare: bool,
    pause: Pause,
}

impl Turn {
    /// A turn that has not begun.
    pub(crate) fn to(target: Heading, spot: Spot, half: Spin) -> Self {
        Self {
            target,
            spot,
            half,
            tries: 0,
            disturbed: false,
            from_bare: false,
            pause: Pause::None,
        }
    }

    /// The floor is known only now, in the middle of the turn.
    pub(crate) fn learn(&mut self, known: &Self) {
        (self.spot, self.half) = (known.spot, known.half);
    }

    /// Which way to turn to the target from `heading`: the short way.
    fn spin(&self, heading: Heading) -> Spin {
        match heading.quarters_right_to(self.target) {
            1 => Spin::Right,
            2 => self.half,
            _ => Spin::Left,
        }
    }

    /// Degrees turned in the direction of the quarter at hand.
    fn angle(&self, senses: &Senses, heading: Heading) -> f32 {
        senses.odometer.turned_deg * self.spin(heading).sign()
    }

    fn judged(&mut self, turned: Turned, helm: &mut Helm<'_>) -> Option<Outcome> {
        let Turned::Quarters(quarters) = turned else {
            return self.begin_again(helm);
        };
        let spin = self.spin(*helm.heading);
        *helm.heading = helm.heading.turned(spin, quarters);
        let senses = &mut *helm.senses;
        senses.odometer.turned_deg -= 90.0 * f32::from(quarters) * spin.sign();
        senses.free_behind = false;
        if *helm.heading != self.target {
            helm.order.give_anew();
            return None;
        }
        senses.turned_at = helm.now;
        if let Spot::Along(length_mm) = self.spot {
            senses.odometer.travelled_mm = length_mm - senses.odometer.travelled_mm;
        }
        Some(if self.disturbed {
            Outcome::Interrupted
        } else if matches!(self.spot, Spot::Edge(_)) && sees_no_tape(senses) {
            Outcome::Missed
        } else {
            Outcome::Done
        })
    }

    fn begin_again(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        self.tries += 1;
        let (most, tries) = (helm.config.tries, self.tries);
        if tries > most {
            let (most, tries) = (f32::from(most), f32::from(tries));
            return Some(Outcome::Failed(FailureKind::BoardRefuses, most, tries));
        }
        helm.order.give_anew();
        None
    }
}

impl Behaviour for Turn {
    fn begin(&mut self, helm: &mut Helm<'_>) {
        let odometer = &mut helm.senses.odometer;
        odometer.turned_deg = 0.0;
        match self.spot {
            Spot::Node => odometer.travelled_mm = 0.0,
            Spot::Edge(at_mm) => odometer.travelled_mm = at_mm,
            Spot::Along(_) => {}
        }
        helm.senses.marks.clear();
        helm.order.give_anew();
    }

    /// The order for the quarter at hand; none while it stands to be judged.
    fn wanted(&self, _: &Senses, heading: Heading, _: &LogicConfig) -> Command {
        if self.pause != Pause::None {
            return STANDBY;
        }
        Command::Wheel(match self.spin(heading) {
            Spin::Left => WheelCommand::LeftPerp,
            Spin::Right => WheelCommand::RightPerp,
        })
    }

    /// The order for the quarter has ended.
    fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Outcome> {
        match finish {
            Finish::None => None,
            Finish::Aborted | Finish::Refused | Finish::NoWord | Finish::NoTape => {
                self.pause = Pause::Wanted;
                None
            }
            Finish::Done => {
                let seen = helm
                    .senses
                    .sight
                    .map_or(LineState::NotOnLine, |(_, seen)| seen);
                let angle = self.angle(helm.senses, *helm.heading);
                let turned = done(angle, seen, self.from_bare);
                self.from_bare |= is_bare(seen);
                self.judged(turned, helm)
            }
        }
    }

    /// Judges a turn that was cut short once the robot has stood for a moment.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        if !self
            .pause
            .is_over(helm.now, helm.config.settle, helm.active)
        {
            return None;
        }
        let seen = helm.senses.sure_sight?;
        self.disturbed = true;
        let spin = self.spin(*helm.heading);
        let turned = interrupted(self.angle(helm.senses, *helm.heading), spin, seen);
        self.judged(turned, helm)
    }

    fn interrupt(&mut self) {
        self.pause = Pause::Wanted;
    }

    fn hear_again(&mut self) {
        (self.pause, self.tries) = (Pause::Wanted, 0);
    }

    fn restore(&mut self, status: &NavigatorStatus, _: Command) {
        self.tries = status.tries;
        self.disturbed = status.doubt & 1 != 0;
        self.from_bare = status.doubt & FROM_BARE != 0;
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.tries = self.tries;
        let from_bare = if self.from_bare { FROM_BARE } else { 0 };
        status.doubt = u8::from(self.disturbed) | from_bare;
    }
}

/// Whether there is surely no tape under the sensors.
fn sees_no_tape(senses: &Senses) -> bool {
    senses.sure_sight.is_some_and(is_bare) && senses.sight.is_some_and(|(_, seen)| is_bare(seen))
}
