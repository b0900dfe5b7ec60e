//! The smallest warehouse in which a robot has somewhere to drive.

use lager_topics::{MapProduct, Side, WarehouseMap};

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
        side: Side::Down.into(),
        ..MapProduct::default()
    };
    map
}
