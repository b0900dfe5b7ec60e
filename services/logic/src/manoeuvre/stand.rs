//! Standing, until the mission has something to do.

use lager_floor::Heading;
use lager_wire::Command;

use super::behaviour::Behaviour;
use super::helm::{Helm, STANDBY, Senses};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// The robot stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stand;

impl Behaviour for Stand {
    fn begin(&mut self, helm: &mut Helm<'_>) {
        helm.senses.marks.clear();
    }

    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        STANDBY
    }

    fn go_on(&mut self, _: &mut Helm<'_>) -> Option<Ending> {
        None
    }

    fn turns_wheels(&self) -> bool {
        false
    }
}
