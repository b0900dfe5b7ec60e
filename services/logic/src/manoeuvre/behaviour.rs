//! The trait of all manoeuvres. Its defaults are right for most of them.

use lager_floor::Heading;
use lager_topics::{Finish, NavigatorStatus};
use lager_wire::{Command, LineState};

use super::helm::{Helm, Senses};
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::marks::Mark;

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
    ) -> Option<Ending> {
        None
    }

    /// Takes a distance: something may stand on the way.
    fn range(&mut self, _centimetres: u8, _helm: &mut Helm<'_>) -> Option<Ending> {
        None
    }

    /// A one-shot order has ended.
    fn ended(&mut self, _finish: Finish, _helm: &mut Helm<'_>) -> Option<Ending> {
        None
    }

    /// Goes on, as far as time and the odometer allow.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending>;

    /// Whether it turns the wheels.
    fn turns_wheels(&self) -> bool {
        true
    }

    /// Makes it stand for a moment and judge how far it has come, if it has one-shot orders.
    fn interrupt(&mut self) {}

    /// The board reports again after a silence: a turn may have ended, or not.
    fn hear_again(&mut self) {}

    /// The manoeuvre as an earlier navigator published it, with `ordered` in force.
    fn restore(&mut self, _status: &NavigatorStatus, _ordered: Command) {}

    /// Writes what a successor needs into a status.
    fn fill(&self, _status: &mut NavigatorStatus) {}
}
