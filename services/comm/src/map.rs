//! Turns the warehouse of the lines into the map of the bus.

use lager_floor::{Grid, SideLength};
use lager_lines::Products;
use lager_lines::gag::{ListWord, Query};
use lager_orders::Reason;
use lager_topics::WarehouseMap;

/// The parts of the warehouse that the external computer has told so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Described {
    pub(crate) side: Option<SideLength>,
    pub(crate) map: Option<Grid>,
    pub(crate) products: Option<Products>,
}

impl Described {
    /// Takes the floor from a map that was published: its size does not change while a robot is up,
    /// but goods do.
    pub(crate) fn floor_of(map: &WarehouseMap) -> Self {
        Self {
            map: map.grid().ok(),
            ..Self::default()
        }
    }

    /// The next question about the warehouse, until all of it is known.
    pub(crate) fn unknown(&self) -> Option<Query> {
        // Spelled as in the document (AMB-40).
        let products = Query::Products(ListWord::Prodlis);
        let side = self.side.is_none().then_some(Query::SideLength);
        let map = self.map.is_none().then_some(Query::Map);
        side.or(map)
            .or_else(|| self.products.is_none().then_some(products))
    }

    /// The map for the bus, once everything is known; `Err` is why such a map is impossible.
    pub(crate) fn to_bus(&self) -> Option<Result<WarehouseMap, Reason>> {
        let (side, map, products) = (self.side?, self.map?, self.products.as_ref()?);
        let products = products.as_slice();
        let checked = map.check(products);
        Some(
            checked
                .map_err(Reason::from)
                .map(|()| WarehouseMap::new(side, map, products)),
        )
    }
}
