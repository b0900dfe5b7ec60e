//! What the station knows of a robot.

use lager_floor::{Heading, Node, ProductId};
use lager_lines::gag::Query;
use lager_lines::{Name, Text};
use lager_wire::OperatorCommand;

use super::{Doing, Robot};
use crate::shown::Shown;

/// How two warehouses differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Other {
    /// In their size, their delivery or their squares.
    Floor,
    /// Only in the goods.
    Goods,
}

impl Robot {
    /// What the robot is doing.
    pub const fn doing(&self) -> Doing {
        self.doing
    }

    /// Its name, if it speaks the extension.
    pub fn name(&self) -> Option<&Name> {
        self.hello.as_ref().map(|hello| &hello.name)
    }

    /// Whether it is here and was told all of a warehouse.
    pub(crate) fn is_described(&self) -> bool {
        let known = &self.known;
        let is_told = known.side.is_some() && known.map.is_some() && known.products.is_some();
        is_told && self.doing != Doing::Away
    }

    /// How the warehouse that the robot was told differs from today's. `None` if they are equal, or
    /// if the robot was not told all of it.
    pub(crate) fn uses_other(&self) -> Option<Other> {
        let (side, map, products) = self.warehouse.as_ref()?;
        let known = &self.known;
        if !self.is_described() {
            return None;
        }
        if known.side != Some(*side) || known.map != Some(*map) {
            return Some(Other::Floor);
        }
        (known.products.as_ref() != Some(products)).then_some(Other::Goods)
    }

    /// The question that is open.
    pub const fn held(&self) -> Option<Query> {
        self.held.get()
    }

    /// The last product that the station told it.
    pub const fn told(&self) -> Option<ProductId> {
        self.told
    }

    /// The products that wait, the next one first.
    pub fn queue(&self) -> impl Iterator<Item = ProductId> {
        self.queue.iter().copied()
    }

    /// The same, after the product that the station has told it and that it may not have got.
    pub fn unfetched(&self) -> impl Iterator<Item = ProductId> {
        let told = self.told.filter(|_| self.is_unanswered);
        told.into_iter().chain(self.queue())
    }

    /// The commands that wait, the next one first.
    pub fn commands(&self) -> impl Iterator<Item = OperatorCommand> {
        self.commands.iter().copied()
    }

    /// The node to which it goes, as it said last.
    pub const fn node(&self) -> Option<Node> {
        self.node
    }

    /// Which way it looks, as it said last.
    pub const fn looks(&self) -> Option<Heading> {
        self.looks
    }

    /// Its last thought.
    pub const fn thought(&self) -> Option<&Text> {
        self.thought.as_ref()
    }

    /// The state that it has shown by the extension.
    pub const fn shown(&self) -> &Shown {
        &self.shown
    }

    /// The person who drives it by actions.
    pub fn driver(&self) -> Option<&str> {
        self.wheel.driver()
    }
}
