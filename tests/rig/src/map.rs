//! The smallest warehouse in which a robot has somewhere to drive.

use lager_floor::Heading;
use lager_topics::{MapProduct, WarehouseMap};

/// One square with product 1 on the edge along which the robot looks: no turn, no crossing.
#[must_use]
pub fn one_square() -> WarehouseMap {
    let mut map = WarehouseMap {
        width: 1,
        height: 1,
        side_length_cm: 50,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 1,
        side: Heading::Down.into(),
        ..MapProduct::default()
    };
    map
}
