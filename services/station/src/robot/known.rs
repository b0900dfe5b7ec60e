//! What is known of a robot.

use lager_lines::gag::Query;
use lager_lines::{Coord, Direction, Name, ProductId, Text};
use lager_wire::OperatorCommand;

use super::{Doing, Robot};
use crate::shown::Shown;

impl Robot {
    /// What it is doing.
    pub const fn doing(&self) -> Doing {
        self.doing
    }

    /// Its name, once it has announced the extension.
    pub fn name(&self) -> Option<&Name> {
        self.hello.as_ref().map(|hello| &hello.name)
    }

    /// The question that is held.
    pub const fn held(&self) -> Option<Query> {
        self.held.get()
    }

    /// The product that it was told last.
    pub const fn told(&self) -> Option<ProductId> {
        self.told
    }

    /// The products that wait, the next one first.
    pub fn queue(&self) -> impl Iterator<Item = ProductId> {
        self.queue.iter().copied()
    }

    /// The same, with the product before them that it was told and may not have heard.
    pub fn unfetched(&self) -> impl Iterator<Item = ProductId> {
        let told = self.told.filter(|_| self.is_unanswered);
        told.into_iter().chain(self.queue())
    }

    /// The commands that wait, the next one first.
    pub fn commands(&self) -> impl Iterator<Item = OperatorCommand> {
        self.commands.iter().copied()
    }

    /// The node it told last, to which it goes.
    pub const fn node(&self) -> Option<Coord> {
        self.node
    }

    /// Where it said last that it looks.
    pub const fn looks(&self) -> Option<Direction> {
        self.looks
    }

    /// What it said last.
    pub const fn thought(&self) -> Option<&Text> {
        self.thought.as_ref()
    }

    /// What it has shown of itself by the extension.
    pub const fn shown(&self) -> &Shown {
        &self.shown
    }

    /// Who drives it by actions.
    pub fn driver(&self) -> Option<&str> {
        self.wheel.driver()
    }
}
