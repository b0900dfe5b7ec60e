//! What is known of a robot.

use lager_lines::gag::Query;
use lager_lines::{Coord, Direction, Name, ProductId, Text};
use lager_wire::OperatorCommand;

use super::{Doing, Robot};
use crate::shown::Shown;

/// In what two warehouses differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Other {
    /// In their size, their delivery or their squares.
    Floor,
    /// In nothing but the goods.
    Goods,
}

impl Robot {
    /// What it is doing.
    pub const fn doing(&self) -> Doing {
        self.doing
    }

    /// Its name, once it has announced the extension.
    pub fn name(&self) -> Option<&Name> {
        self.hello.as_ref().map(|hello| &hello.name)
    }

    /// In what the warehouse that it was told differs from the one that there is, if it was told
    /// all of it.
    pub(crate) fn uses_other(&self) -> Option<Other> {
        let (side, map, products) = self.warehouse.as_ref()?;
        let known = &self.known;
        let is_told = known.side.is_some() && known.map.is_some() && known.products.is_some();
        if !is_told || self.doing == Doing::Away {
            return None;
        }
        if known.side != Some(*side) || known.map != Some(*map) {
            return Some(Other::Floor);
        }
        (known.products.as_ref() != Some(products)).then_some(Other::Goods)
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
