//! The warehouse as lines tell of it, and as the bus carries it.

use lager_lines::gag::{ListWord, Query};
use lager_lines::{Coord, Direction, Map, Product, Products, SideLength};
use lager_topics::{Heading, MapProduct, Side, WarehouseMap};

/// What the external computer has said of the warehouse so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Described {
    pub(crate) side: Option<SideLength>,
    pub(crate) map: Option<Map>,
    pub(crate) products: Option<Products>,
}

impl Described {
    /// What is known of the floor from a map that was published: the size does not change while a
    /// robot is up, goods do.
    pub(crate) fn floor_of(map: &WarehouseMap) -> Self {
        let coord = |x, y| Coord { x, y };
        Self {
            map: Map::new(
                coord(map.width, map.height),
                coord(map.delivery_x, map.delivery_y),
            )
            .ok(),
            ..Self::default()
        }
    }

    /// What is to be asked next to know all of it.
    pub(crate) fn unknown(&self) -> Option<Query> {
        // As the document spells it (AMB-40).
        let products = Query::Products(ListWord::Prodlis);
        let side = self.side.is_none().then_some(Query::SideLength);
        let map = self.map.is_none().then_some(Query::Map);
        side.or(map)
            .or_else(|| self.products.is_none().then_some(products))
    }

    /// The map for the bus, once everything is known; `Err` is why it cannot be.
    pub(crate) fn to_bus(&self) -> Option<Result<WarehouseMap, String>> {
        let (side, map, products) = (self.side?, self.map?, self.products.as_ref()?);
        Some(to_bus(side, map, products))
    }
}

fn to_bus(side: SideLength, map: Map, products: &Products) -> Result<WarehouseMap, String> {
    if let Some(Product { id, square, .. }) = products.outside(map) {
        return Err(format!(
            "product {id} stands in the square ({}, {}), which a warehouse of {} x {} squares does not have",
            square.x,
            square.y,
            map.size().x,
            map.size().y
        ));
    }
    let mut bus = WarehouseMap {
        width: map.size().x,
        height: map.size().y,
        delivery_x: map.delivery().x,
        delivery_y: map.delivery().y,
        side_length_cm: side.cm(),
        ..WarehouseMap::default()
    };
    let listed = products.as_slice();
    if listed.len() > bus.products.len() {
        return Err(format!(
            "{} products are listed; a robot takes {} at most",
            listed.len(),
            bus.products.len()
        ));
    }
    for (slot, product) in bus.products.iter_mut().zip(listed) {
        *slot = MapProduct {
            id: product.id.get(),
            x: product.square.x,
            y: product.square.y,
            side: match product.side {
                Direction::Left => Side::Left,
                Direction::Up => Side::Up,
                Direction::Right => Side::Right,
                Direction::Down => Side::Down,
            }
            .into(),
            ..MapProduct::default()
        };
        bus.product_count += 1;
    }
    Ok(bus)
}

/// A heading in the words of the lines.
pub(crate) const fn direction(heading: Heading) -> Direction {
    match heading {
        Heading::Left => Direction::Left,
        Heading::Up => Direction::Up,
        Heading::Right => Direction::Right,
        Heading::Down => Direction::Down,
    }
}

/// A way in the words of the bus.
pub(crate) const fn heading(way: Direction) -> Heading {
    match way {
        Direction::Left => Heading::Left,
        Direction::Up => Heading::Up,
        Direction::Right => Heading::Right,
        Direction::Down => Heading::Down,
    }
}
