//! Turns on the spot, quarter by quarter. Each quarter is a one-shot order; the bridge's reports
//! show its end.
//!
//! ```text
//!            Done                               Done: the next quarter, or the turn's end
//!   order ---------> judged by its angle ------>
//!     |                                         fragment: again, with a new id
//!     | Aborted, Refused, unheard                                ^
//!     +-------> stand for a moment --> judged by angle and line -+
//! ```

use lager_floor::{Heading, Spin};
use lager_topics::{FailureKind, Finish, NavigatorStatus};
use lager_wire::{Command, LineState, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Pause, STANDBY, Senses};
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::turn::{Turned, done, interrupted, is_bare};

/// In a status's doubt: the quarter before the present one ended without tape.
const FROM_BARE: u8 = 16;

/// Where a turn takes place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Spot {
    /// On a node.
    Node,
    /// At this distance behind a node, in mm.
    EdgeMarks(f32),
    /// On a line of this length in mm: after the turn, what lay behind the robot lies ahead.
    Along(f32),
}

/// A turn to a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    target: Heading,
    pub(super) spot: Spot,
    /// Which way a half turn goes: the way on which its first quarter meets tape, too.
    half: Spin,
    /// How often the present order was begun again.
    tries: u8,
    /// It was cut short, or went on while the board was silent.
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

    /// The floor becomes known in the middle of the turn.
    pub(crate) fn learn(&mut self, known: &Self) {
        (self.spot, self.half) = (known.spot, known.half);
    }

    /// Which way to turn from `heading` to the target: the short way.
    fn spin(&self, heading: Heading) -> Spin {
        match heading.quarters_right_to(self.target) {
            1 => Spin::Right,
            2 => self.half,
            _ => Spin::Left,
        }
    }

    /// How many degrees the robot has turned in the direction of the present quarter.
    fn angle(&self, senses: &Senses, heading: Heading) -> f32 {
        senses.odometer.turned_deg * self.spin(heading).sign()
    }

    fn judged(&mut self, turned: Turned, helm: &mut Helm<'_>) -> Option<Ending> {
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
            Ending::Interrupted
        } else if matches!(self.spot, Spot::EdgeMarks(_)) && sees_no_tape(senses) {
            Ending::Missed
        } else {
            Ending::Done
        })
    }

    fn begin_again(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        self.tries += 1;
        let (most, tries) = (helm.config.tries, self.tries);
        if tries > most {
            let (most, tries) = (f32::from(most), f32::from(tries));
            return Some(Ending::Failed(FailureKind::BoardRefuses, most, tries));
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
            Spot::EdgeMarks(at_mm) => odometer.travelled_mm = at_mm,
            Spot::Along(_) => {}
        }
        helm.senses.marks.clear();
        helm.order.give_anew();
    }

    /// The order for the present quarter; `None` while the robot stands to be judged.
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
    fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Ending> {
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

    /// Judges a turn that was cut short, once the robot has stood for a moment.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
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
