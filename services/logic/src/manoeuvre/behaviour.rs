//! What a manoeuvre can do. Its defaults are what most of them do.

use lager_topics::{Finish, Heading, NavigatorStatus};
use lager_wire::{Command, LineState};

use super::helm::{Helm, Senses};
use crate::config::LogicConfig;
use crate::marks::Mark;
use crate::outcome::Outcome;

/// One thing that the robot does.
pub(crate) trait Behaviour {
    /// Begins it where the robot is.
    fn begin(&mut self, _helm: &mut Helm<'_>) {}

    /// The command it needs now.
    fn wanted(&self, senses: &Senses, heading: Heading, config: &LogicConfig) -> Command;

    /// Takes a line frame, and the mark that ended with it.
    fn see(
        &mut self,
        _state: LineState,
        _mark: Option<Mark>,
        _helm: &mut Helm<'_>,
    ) -> Option<Outcome> {
        None
    }

    /// Takes a distance: something may stand on the way.
    fn range(&mut self, _centimetres: u8, _helm: &mut Helm<'_>) -> Option<Outcome> {
        None
    }

    /// An order that runs once has ended.
    fn ended(&mut self, _finish: Finish, _helm: &mut Helm<'_>) -> Option<Outcome> {
        None
    }

    /// Goes on where time and the odometer allow it.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome>;

    /// Whether it turns the wheels.
    fn turns_wheels(&self) -> bool {
        true
    }

    /// Has it stand for a moment and judge how far it has come, if it is one that runs once.
    fn interrupt(&mut self) {}

    /// The board is heard again after a silence: a turn may have ended, or not.
    fn hear_again(&mut self) {}

    /// As a predecessor left it, by what it published of it; `ordered` was in force.
    fn restore(&mut self, _status: &NavigatorStatus, _ordered: Command) {}

    /// Writes into a status what a successor needs of it.
    fn fill(&self, _status: &mut NavigatorStatus) {}
}
