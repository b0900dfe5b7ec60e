//! Tests of the map: its edges and marks must agree with the coordinates of the plane.

use lager_floor::MAX_NODES;
use lager_topics::MapProduct;

use super::*;

fn published(width: u8, height: u8, delivery: (u8, u8)) -> WarehouseMap {
    WarehouseMap {
        width,
        height,
        delivery_x: delivery.0,
        delivery_y: delivery.1,
        side_length_cm: 50,
        ..WarehouseMap::default()
    }
}

fn with_product(square: (u8, u8), side: Heading) -> WarehouseMap {
    let mut map = published(3, 2, (0, 0));
    map.product_count = 1;
    map.products[0] = MapProduct {
        id: 7,
        x: square.0,
        y: square.1,
        side: side.into(),
        ..MapProduct::default()
    };
    map
}

#[test]
fn each_side_of_a_square_is_its_edge() {
    let table = [
        (Heading::Left, (1, 1), (1, 2), Heading::Right),
        (Heading::Up, (1, 2), (2, 2), Heading::Down),
        (Heading::Right, (2, 1), (2, 2), Heading::Left),
        (Heading::Down, (1, 1), (2, 1), Heading::Up),
    ];
    for (side, first, second, into) in table {
        let map = Map::new(&with_product((1, 1), side)).unwrap();
        let ends = [Node::new(first.0, first.1), Node::new(second.0, second.1)];
        assert_eq!(
            map.station(7).map(|found| (found.edge.ends(), found.into)),
            Some((ends, into))
        );
    }
}

#[test]
fn a_station_is_on_the_left_one_way_and_on_the_right_the_other() {
    let map = Map::new(&with_product((1, 1), Heading::Right)).unwrap();
    let [below, above] = map.station(7).unwrap().edge.ends();
    assert_eq!(map.station_sides(below, Heading::Up), Sides::LEFT);
    assert_eq!(map.station_sides(above, Heading::Down), Sides::RIGHT);
    assert_eq!(map.station_sides(below, Heading::Down), Sides::NONE);
    assert_eq!(map.station_sides(below, Heading::Left), Sides::NONE);
}

#[test]
fn the_way_out_leaves_each_corner_outwards_along_x() {
    for (corner, exit) in [
        ((0, 0), Heading::Left),
        ((0, 2), Heading::Left),
        ((3, 0), Heading::Right),
        ((3, 2), Heading::Right),
    ] {
        let map = Map::new(&published(3, 2, corner)).unwrap();
        assert_eq!(map.grid.exit(), exit);
        assert!(map.has_tape(map.grid.delivery(), exit));
        assert_eq!(map.grid.neighbour(map.grid.delivery(), exit), None);
        assert!(map.has_tape(map.grid.delivery(), exit.back()));
    }
}

#[test]
fn what_cannot_be_driven_in_is_refused() {
    let refused = |map: &WarehouseMap| {
        let Failure {
            kind,
            expected,
            seen,
            ..
        } = Map::new(map).unwrap_err();
        (kind.get().unwrap(), expected, seen)
    };
    let map = |width, height, corner| published(width, height, corner);
    assert_eq!(refused(&map(0, 2, (0, 0))), (FailureKind::MapEmpty, 1, 0));
    assert_eq!(
        refused(&map(100, 2, (0, 0))),
        (FailureKind::MapTooLarge, 100, 101)
    );
    let crowded = WarehouseMap {
        product_count: 257,
        ..map(3, 2, (0, 0))
    };
    assert_eq!(refused(&crowded), (FailureKind::TooManyProducts, 256, 257));
    let beside = Map::new(&map(3, 2, (1, 0))).unwrap_err();
    assert_eq!(beside.kind, FailureKind::DeliveryOffCorner);
    assert_eq!((beside.x, beside.y), (1, 0));
    let mut map = map(1, 1, (0, 0));
    map.side_length_cm = 0;
    assert_eq!(refused(&map), (FailureKind::SideUnknown, 40, 0));
    map.side_length_cm = 39;
    assert_eq!(refused(&map), (FailureKind::SideWrong, 40, 39));
    map.side_length_cm = 501;
    assert_eq!(refused(&map), (FailureKind::SideWrong, 500, 501));
    assert_eq!(
        refused(&with_product((3, 0), Heading::Left)),
        (FailureKind::ProductOutside, 0, 7)
    );
    let mut twice = with_product((0, 0), Heading::Left);
    twice.products[1] = twice.products[0];
    twice.product_count = 2;
    assert_eq!(refused(&twice), (FailureKind::ProductTwice, 0, 7));
}

#[test]
fn the_largest_floor_and_the_most_products_are_taken() {
    let mut map = published(99, 99, (99, 99));
    map.product_count = 256;
    for (index, product) in map.products.iter_mut().enumerate() {
        *product = MapProduct {
            id: index as i32,
            x: (index % 99) as u8,
            y: (index / 99) as u8,
            side: Heading::Up.into(),
            ..MapProduct::default()
        };
    }
    let map = Map::new(&map).unwrap();
    assert_eq!(map.grid.node_count(), MAX_NODES);
    assert!(map.station(255).is_some());
}
