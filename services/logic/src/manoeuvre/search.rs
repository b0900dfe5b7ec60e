//! Looks for the short mark of a station that a disturbed turn may have missed.
//!
//! It turns towards the place where dead reckoning expects the mark, and on until it sees tape. If
//! that tape belongs to the edge, it turns back from there. If it meets the edge's tape once more,
//! it has missed the mark, and ends with the robot looking along the edge.
//!
//! The sensors may just reach the mark's end, and come to rest beside it. So a turn that begins and
//! ends near the expected mark has met it: only tape ends a turn so early.

use lager_floor::{Heading, Spin};
use lager_topics::{FailureKind, Finish, NavigatorStatus};
use lager_wire::{Command, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Pause, Senses, is_no_line};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// A search. It begins while the robot looks about at the mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Search {
    /// Which way it turns; `None` before the first turn.
    spin: Option<Spin>,
    /// It has begun a turn on the edge's tape.
    from_edge: bool,
    /// It has begun the present turn near the expected mark.
    from_beside: bool,
    /// How often it has turned.
    turns: u8,
    pause: Pause,
}

impl Search {
    /// Tape that is farther than this from the mark belongs to the edge, in degrees.
    const BESIDE_DEG: f32 = 45.0;
    /// How often it turns before it gives up.
    const TURNS: u8 = 8;

    /// One that begins when the robot has come to rest.
    pub(crate) const NEW: Self = Self {
        spin: None,
        from_edge: false,
        from_beside: false,
        turns: 0,
        pause: Pause::Wanted,
    };
}

impl Behaviour for Search {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        Command::Wheel(match self.spin {
            Some(Spin::Left) if self.pause == Pause::None => WheelCommand::LeftPerp,
            Some(Spin::Right) if self.pause == Pause::None => WheelCommand::RightPerp,
            _ => WheelCommand::Standby,
        })
    }

    /// The order for a turn has ended: the robot stands before it looks.
    fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Ending> {
        if finish == Finish::None {
            return None;
        }
        self.pause = Pause::Wanted;
        let is_beside = helm.senses.odometer.turned_deg.abs() <= Self::BESIDE_DEG;
        (finish == Finish::Done && self.from_beside && is_beside).then_some(Ending::Done)
    }

    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let settle = helm.config.settle;
        if !self.pause.is_over(helm.now, settle, helm.active) {
            return None;
        }
        let off_deg = helm.senses.odometer.turned_deg;
        let sees_tape = helm.senses.sure_sight.is_some_and(|seen| !is_no_line(seen));
        let is_beside = off_deg.abs() <= Self::BESIDE_DEG;
        if sees_tape && is_beside {
            return Some(Ending::Done);
        }
        let (beside, back) = match off_deg > 0.0 {
            true => (Spin::Right, Spin::Left),
            false => (Spin::Left, Spin::Right),
        };
        if sees_tape && self.from_edge {
            *helm.heading = helm.heading.turned(beside, 1);
            return Some(Ending::Missed);
        }
        if self.turns == Self::TURNS {
            let turns = f32::from(self.turns);
            return Some(Ending::Failed(FailureKind::MarkUnseen, turns, turns));
        }
        self.turns += 1;
        self.from_edge |= sees_tape;
        self.from_beside = is_beside;
        self.spin = match sees_tape {
            true => Some(back),
            false => self.spin.or(Some(back)),
        };
        helm.order.give_anew();
        None
    }

    fn interrupt(&mut self) {
        self.pause = Pause::Wanted;
    }

    fn hear_again(&mut self) {
        self.interrupt();
    }

    fn restore(&mut self, status: &NavigatorStatus, ordered: Command) {
        self.turns = status.tries;
        // After that many turns it has met the edge's tape, or will meet it on its way from there.
        self.from_edge = self.turns > 1;
        self.spin = match ordered {
            Command::Wheel(WheelCommand::LeftPerp) => Some(Spin::Left),
            Command::Wheel(WheelCommand::RightPerp) => Some(Spin::Right),
            _ => return,
        };
        self.pause = Pause::None;
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.tries = self.turns;
    }
}
