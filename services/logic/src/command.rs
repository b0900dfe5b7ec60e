//! The one steering order that the navigator wants in force, with its id.
//!
//! The same id renews an order, a new id executes it. So a changed command gets the next id, and so
//! does a command that must be executed again. Every other order keeps its id. This file knows
//! nothing of maps.

use core::time::Duration;

use lager_topics::{Finish, Origin, SteeringOrder, SteeringReport};
use lager_wire::{Command, WheelCommand};

/// The order in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Standing {
    id: u32,
    command: Command,
    arm_granted: bool,
    given_anew: bool,
    /// When it was given.
    given: Duration,
    /// When it was given, or when the bridge's reports last showed it at work.
    heard: Duration,
}

/// What a report says of the order in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// The report is too early to tell.
    None,
    /// It is at work.
    AtWork,
    /// It has ended.
    Ended(Finish),
    /// The bridge has not shown it for too long.
    Unheard,
}

impl Standing {
    /// The order to stand, after an order with id `last`.
    pub(crate) fn after(last: u32) -> Self {
        Self {
            id: last,
            command: Command::Wheel(WheelCommand::Standby),
            arm_granted: false,
            given_anew: false,
            given: Duration::ZERO,
            heard: Duration::ZERO,
        }
    }

    /// An order from before a restart. A one-shot is still the same order. After a setpoint the
    /// killed navigator may have given another one that it never published, so the setpoint gets an
    /// unused id.
    pub(crate) fn resumed(id: u32, command: Command) -> Self {
        let is_setpoint = !command.is_one_shot();
        Self {
            command,
            given_anew: is_setpoint,
            ..Self::after(if is_setpoint { next(id) } else { id })
        }
    }

    /// The number of the order.
    pub(crate) fn id(&self) -> u32 {
        self.id
    }

    /// The command.
    pub(crate) fn command(&self) -> Command {
        self.command
    }

    /// Has the order executed again, although it has not changed.
    pub(crate) fn give_anew(&mut self) {
        self.given_anew = true;
    }

    /// Makes `command` the order in force.
    pub(crate) fn settle(&mut self, now: Duration, command: Command, arm_granted: bool) {
        if self.given_anew || command != self.command || arm_granted != self.arm_granted {
            *self = Self {
                id: next(self.id),
                command,
                arm_granted,
                given_anew: false,
                given: now,
                heard: now,
            };
        }
    }

    /// Begins to wait for reports; until now no report could show the order.
    pub(crate) fn listen_from(&mut self, now: Duration) {
        self.heard = now;
    }

    /// Whether the order was given longer than `span` ago.
    pub(crate) fn is_older_than(&self, now: Duration, span: Duration) -> bool {
        now.saturating_sub(self.given) > span
    }

    /// Reads a report.
    pub(crate) fn news(
        &mut self,
        now: Duration,
        report: &SteeringReport,
        patience: Duration,
    ) -> Progress {
        self.outnumber(report.finished_id, report.finished_origin == Origin::Logic);
        self.outnumber(report.current_id, report.current_origin == Origin::Logic);
        if report.finished_origin == Origin::Logic && report.finished_id == self.id {
            return match report.finish.get() {
                Some(Finish::None) | None => Progress::None,
                Some(finish) => Progress::Ended(finish),
            };
        }
        let at_work = report.current_origin == Origin::Logic && report.current_id == self.id;
        let operator_has_the_arm = self.arm_granted && report.current_origin == Origin::Operator;
        if at_work || operator_has_the_arm {
            self.heard = now;
            return Progress::AtWork;
        }
        if now.saturating_sub(self.heard) > patience {
            Progress::Unheard
        } else {
            Progress::None
        }
    }

    /// An earlier navigator that left no status may have used ids; these are not used again.
    fn outnumber(&mut self, id: u32, ours: bool) {
        let ahead = id.wrapping_sub(self.id);
        if ours && ahead != 0 && ahead < u32::MAX / 2 {
            self.id = id;
            self.given_anew = true;
        }
    }

    /// The order in its published form.
    pub(crate) fn order(&self) -> SteeringOrder {
        SteeringOrder {
            id: self.id,
            origin: Origin::Logic.into(),
            code: self.command.code(),
            arm_granted: self.arm_granted.into(),
            ..SteeringOrder::default()
        }
    }
}

/// Ids wrap round and leave out 0, which means "none".
fn next(id: u32) -> u32 {
    id.wrapping_add(1).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORWARD: Command = Command::Wheel(WheelCommand::ActiveForward);
    const TURN: Command = Command::Wheel(WheelCommand::LeftPerp);
    const PATIENCE: Duration = Duration::from_millis(300);

    fn report(current: u32, finished: u32, finish: Finish) -> SteeringReport {
        SteeringReport {
            current_id: current,
            finished_id: finished,
            finish: finish.into(),
            ..SteeringReport::default()
        }
    }

    #[test]
    fn only_a_change_or_a_wish_gets_a_new_id() {
        let mut standing = Standing::after(4);
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 5);
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 5);
        standing.give_anew();
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 6);
        standing.settle(Duration::ZERO, TURN, false);
        assert_eq!(standing.id(), 7);
    }

    #[test]
    fn after_a_restart_a_turn_is_the_same_and_a_setpoint_leaves_out_a_number() {
        let mut standing = Standing::resumed(4, TURN);
        standing.settle(Duration::ZERO, TURN, false);
        assert_eq!(standing.id(), 4);
        let mut standing = Standing::resumed(4, FORWARD);
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 6);
    }

    #[test]
    fn ids_go_round_and_leave_out_zero() {
        let mut standing = Standing::after(u32::MAX);
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 1);
    }

    #[test]
    fn only_the_end_of_this_order_is_news() {
        let mut standing = Standing::after(4);
        standing.settle(Duration::ZERO, TURN, false);
        let mut news = |current, finished, finish| {
            standing.news(Duration::ZERO, &report(current, finished, finish), PATIENCE)
        };
        assert_eq!(news(4, 3, Finish::Done), Progress::None);
        assert_eq!(news(5, 4, Finish::Aborted), Progress::AtWork);
        assert_eq!(news(5, 5, Finish::None), Progress::None);
        assert_eq!(news(5, 5, Finish::Done), Progress::Ended(Finish::Done));
    }

    #[test]
    fn an_order_nobody_speaks_of_is_missed_after_a_while() {
        let mut standing = Standing::after(4);
        standing.settle(Duration::from_millis(1000), TURN, false);
        let mut at = |ms, current| {
            let report = report(current, 0, Finish::None);
            standing.news(Duration::from_millis(ms), &report, PATIENCE)
        };
        assert_eq!(at(1250, 4), Progress::None);
        assert_eq!(at(1260, 5), Progress::AtWork);
        assert_eq!(at(1550, 4), Progress::None);
        assert_eq!(at(1561, 4), Progress::Unheard);
    }

    #[test]
    fn ids_of_an_unknown_earlier_life_are_not_used_again() {
        let mut standing = Standing::after(0);
        standing.settle(Duration::ZERO, FORWARD, false);
        standing.news(Duration::ZERO, &report(90, 89, Finish::Done), PATIENCE);
        standing.settle(Duration::ZERO, FORWARD, false);
        assert_eq!(standing.id(), 91);
    }
}
