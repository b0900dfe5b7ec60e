//! Looks for the short mark of a station that a disturbed turn may have missed.
//!
//! After a disturbed turn nobody knows whether the tape under the sensors is the mark or the edge
//! itself: one tape looks like another. The angles between tapes tell them apart, because the edge
//! goes on behind the robot and the mark lies on one side only:
//!
//! ```text
//!        mark
//!         |         The robot turns one way, from tape to tape. Where half a turn shows no tape,
//!   ------o------   the mark is not: so it is the next tape behind that half.
//!     edge   edge
//! ```
//!
//! If the half behind that one shows no tape either, the robot has missed the mark, and ends with
//! its heading along the edge. A robot that stands too near to the goods cannot turn past them: if
//! there is no tape for more than half a turn, something holds it. Then it turns the other way.

use lager_floor::{Heading, Spin};
use lager_topics::{FailureKind, Finish, NavigatorStatus};
use lager_wire::{Command, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Pause, Senses, is_no_line};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// Nearer than this, in degrees, a tape is still the one from which the robot turned away.
const SAME_DEG: f32 = 45.0;
/// From this angle between two tapes on, in degrees, the mark does not lie between them.
const HALF_DEG: f32 = 135.0;
/// A robot that has seemed to turn so far without tape, in degrees, is held by something.
const HELD_DEG: f32 = 225.0;

/// The bits of a status in which a successor finds the search.
const AFTER_HALF: u8 = 1 << 5;
const TO_THE_RIGHT: u8 = 1 << 6;
const PASSED: u8 = 1 << 7;

/// A search. It begins while the robot looks about at the mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Search {
    /// Which way it turns.
    spin: Spin,
    /// It has seen a tape; the odometer has the angle from the last one.
    from_tape: bool,
    /// Behind the last tape lies a half turn without tape.
    after_half: bool,
    /// There is no mark, so the next tape is the edge's.
    passed: bool,
    /// The angle at which the order in force was given, in degrees, if this navigator gave it.
    given_deg: Option<f32>,
    /// How often it has turned.
    turns: u8,
    pause: Pause,
}

impl Search {
    /// How often it turns before it gives up, by quarters: once round each way, and more.
    const TURNS: u8 = 16;

    /// One that begins when the robot has come to rest.
    pub(crate) const NEW: Self = Self {
        spin: Spin::Left,
        from_tape: false,
        after_half: false,
        passed: false,
        given_deg: None,
        turns: 0,
        pause: Pause::Wanted,
    };

    /// There is tape under the sensors.
    fn meet(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let angle = helm.senses.odometer.turned_deg.abs();
        let from_tape = core::mem::replace(&mut self.from_tape, true);
        if from_tape && angle < SAME_DEG {
            return None;
        }
        helm.senses.odometer.turned_deg = 0.0;
        let half = from_tape && angle >= HALF_DEG;
        if self.passed || (self.after_half && half) {
            *helm.heading = helm.heading.turned(self.spin, 1);
            return Some(Ending::Missed);
        }
        if self.after_half {
            return Some(Ending::Done);
        }
        self.after_half = half;
        None
    }

    /// Something holds the robot: it turns the other way.
    fn turn_back(&mut self, helm: &mut Helm<'_>) {
        helm.senses.odometer.turned_deg = 0.0;
        self.spin = self.spin.back();
        self.passed |= self.after_half;
        (self.from_tape, self.after_half) = (false, false);
    }
}

impl Behaviour for Search {
    fn begin(&mut self, helm: &mut Helm<'_>) {
        helm.senses.odometer.turned_deg = 0.0;
    }

    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        Command::Wheel(match (self.pause, self.spin) {
            (Pause::None, Spin::Left) => WheelCommand::LeftPerp,
            (Pause::None, Spin::Right) => WheelCommand::RightPerp,
            _ => WheelCommand::Standby,
        })
    }

    /// The order for a turn has ended: the robot stands before it looks.
    ///
    /// The sensors may just reach the mark's end, and come to rest beside it. But only tape ends a
    /// turn early.
    fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Ending> {
        if finish == Finish::None {
            return None;
        }
        self.pause = Pause::Wanted;
        let turned_deg = helm.senses.odometer.turned_deg;
        let given_deg = self.given_deg.take()?;
        let is_early = (turned_deg - given_deg).abs() < SAME_DEG;
        match finish == Finish::Done && is_early {
            true => self.meet(helm),
            false => None,
        }
    }

    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let settle = helm.config.settle;
        if !self.pause.is_over(helm.now, settle, helm.active) {
            return None;
        }
        let sees_tape = helm.senses.sure_sight.is_some_and(|seen| !is_no_line(seen));
        if sees_tape && let Some(ending) = self.meet(helm) {
            return Some(ending);
        }
        if helm.senses.odometer.turned_deg.abs() >= HELD_DEG {
            self.turn_back(helm);
        }
        if self.turns == Self::TURNS {
            let turns = f32::from(self.turns);
            return Some(Ending::Failed(FailureKind::MarkUnseen, turns, turns));
        }
        self.turns += 1;
        self.given_deg = Some(helm.senses.odometer.turned_deg);
        helm.order.give_anew();
        None
    }

    fn interrupt(&mut self) {
        (self.pause, self.given_deg) = (Pause::Wanted, None);
    }

    fn hear_again(&mut self) {
        self.interrupt();
        self.turns = 0;
    }

    fn restore(&mut self, status: &NavigatorStatus, ordered: Command) {
        self.turns = status.tries;
        // If it has seen no tape yet, there was none in the angle either.
        self.from_tape = self.turns > 0;
        self.after_half = status.doubt & AFTER_HALF != 0;
        self.passed = status.doubt & PASSED != 0;
        if status.doubt & TO_THE_RIGHT != 0 {
            self.spin = Spin::Right;
        }
        if let Command::Wheel(WheelCommand::LeftPerp | WheelCommand::RightPerp) = ordered {
            self.pause = Pause::None;
        }
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.tries = self.turns;
        for (is_set, bit) in [
            (self.after_half, AFTER_HALF),
            (self.spin == Spin::Right, TO_THE_RIGHT),
            (self.passed, PASSED),
        ] {
            status.doubt |= if is_set { bit } else { 0 };
        }
    }
}
