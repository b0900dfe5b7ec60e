//! A warehouse as the bus carries it.
//!
//! The plant knows no topics and logic knows no plant; this is the one place where a warehouse
//! file becomes the map that the robot is told where there is no external computer.

use lager_plant::Warehouse;
use lager_topics::{MapProduct, Side, WarehouseMap};

/// The map of `warehouse`, which has been validated.
pub fn bus_map(warehouse: &Warehouse) -> WarehouseMap {
    let mut map = WarehouseMap {
        width: warehouse.size[0],
        height: warehouse.size[1],
        delivery_x: warehouse.delivery[0],
        delivery_y: warehouse.delivery[1],
        side_length_cm: warehouse.side_length_cm,
        ..WarehouseMap::default()
    };
    for (slot, (id, square, side)) in map.products.iter_mut().zip(warehouse.map_products()) {
        *slot = MapProduct {
            id,
            x: square[0],
            y: square[1],
            side: match side {
                lager_plant::Side::Left => Side::Left,
                lager_plant::Side::Up => Side::Up,
                lager_plant::Side::Right => Side::Right,
                lager_plant::Side::Down => Side::Down,
            }
            .into(),
            ..MapProduct::default()
        };
        map.product_count += 1;
    }
    map
}
