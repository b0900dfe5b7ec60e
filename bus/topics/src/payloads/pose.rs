//! Where the robot is between nodes, from what logic tells: the node last passed, the way since
//! then and where it looks.

use super::nav::{Heading, MapProduct, NavigatorStatus, Phase, Side, WarehouseMap};

/// A place in the warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pose {
    /// Middle of the axle in mm, x to the right of node (0, 0).
    pub x_mm: i32,
    /// Middle of the axle in mm, y up from node (0, 0).
    pub y_mm: i32,
    /// Where it looks, in degrees clockwise from up; any number of turns.
    pub heading_deg: i32,
}

impl NavigatorStatus {
    /// Where the middle of the axle is, if what the robot does is known. `map` is the warehouse
    /// that it drives in.
    pub fn pose(&self, map: &WarehouseMap) -> Option<Pose> {
        pose(self, map)
    }
}

fn pose(status: &NavigatorStatus, map: &WarehouseMap) -> Option<Pose> {
    let (phase, looks) = (status.phase.get()?, status.heading.get()?);
    let side_mm = i32::from(map.side_length_cm) * 10;
    let (along, way_mm) = match phase {
        // On the way back logic counts from the cross bar.
        Phase::Returning => (outwards(map), status.exit_mm - status.travelled_mm),
        // Half round it looks along no way.
        Phase::TurningRound => (outwards(map), status.travelled_mm),
        // The robot has turned, or turns, off the edge that it came along.
        Phase::Positioning | Phase::Picking | Phase::Leaving => {
            let along = goods(status, map).and_then(|goods| edge_from(status, goods));
            (along.unwrap_or(looks), status.travelled_mm)
        }
        _ => (looks, status.travelled_mm),
    };
    let (right, up) = step(along);
    let turned_deg = match phase {
        Phase::Turning
        | Phase::Positioning
        | Phase::Leaving
        | Phase::TurningRound
        | Phase::TurningBack => status.turned_deg,
        // The tape tells where it looks.
        _ => 0,
    };
    Some(Pose {
        x_mm: i32::from(status.x) * side_mm + right * way_mm,
        y_mm: i32::from(status.y) * side_mm + up * way_mm,
        heading_deg: degrees(looks) + i32::from(turned_deg),
    })
}

fn goods<'map>(status: &NavigatorStatus, map: &'map WarehouseMap) -> Option<&'map MapProduct> {
    let mut products = map.products().iter();
    products.find(|product| product.id == status.product)
}

/// Which way the edge of `goods` leads from the node last passed.
fn edge_from(status: &NavigatorStatus, goods: &MapProduct) -> Option<Heading> {
    let (x, y) = (i16::from(goods.x), i16::from(goods.y));
    let (first, second, forth) = match goods.side.get()? {
        Side::Left => ((x, y), (x, y + 1), Heading::Up),
        Side::Right => ((x + 1, y), (x + 1, y + 1), Heading::Up),
        Side::Up => ((x, y + 1), (x + 1, y + 1), Heading::Right),
        Side::Down => ((x, y), (x + 1, y), Heading::Right),
    };
    let at = (status.x, status.y);
    if at == first {
        Some(forth)
    } else {
        (at == second).then(|| opposite(forth))
    }
}

/// Right and up, each by how many.
const fn step(heading: Heading) -> (i32, i32) {
    match heading {
        Heading::Left => (-1, 0),
        Heading::Up => (0, 1),
        Heading::Right => (1, 0),
        Heading::Down => (0, -1),
    }
}

const fn opposite(heading: Heading) -> Heading {
    match heading {
        Heading::Left => Heading::Right,
        Heading::Up => Heading::Down,
        Heading::Right => Heading::Left,
        Heading::Down => Heading::Up,
    }
}

/// Which way the way out leads from the delivery corner.
fn outwards(map: &WarehouseMap) -> Heading {
    match map.delivery_x {
        0 => Heading::Left,
        _ => Heading::Right,
    }
}

/// Clockwise from up.
const fn degrees(heading: Heading) -> i32 {
    match heading {
        Heading::Up => 0,
        Heading::Right => 90,
        Heading::Down => 180,
        Heading::Left => 270,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> WarehouseMap {
        let mut map = WarehouseMap {
            width: 4,
            height: 3,
            side_length_cm: 40,
            product_count: 1,
            ..WarehouseMap::default()
        };
        map.products[0] = MapProduct {
            id: 7,
            x: 1,
            y: 0,
            side: Side::Down.into(),
            ..MapProduct::default()
        };
        map
    }

    fn status(phase: Phase, heading: Heading) -> NavigatorStatus {
        NavigatorStatus {
            x: 2,
            y: 0,
            travelled_mm: 150,
            turned_deg: 30,
            exit_mm: 900,
            product: 7,
            phase: phase.into(),
            heading: heading.into(),
            ..NavigatorStatus::default()
        }
    }

    fn at(phase: Phase, heading: Heading) -> (i32, i32, i32) {
        let pose = status(phase, heading).pose(&map()).expect("a pose");
        (pose.x_mm, pose.y_mm, pose.heading_deg)
    }

    #[test]
    fn it_is_so_far_from_the_node_as_it_has_come() {
        assert_eq!(at(Phase::Driving, Heading::Up), (800, 150, 0));
        assert_eq!(at(Phase::Driving, Heading::Left), (650, 0, 270));
        assert_eq!(at(Phase::TurningBack, Heading::Left), (650, 0, 300));
    }

    #[test]
    fn at_goods_it_is_on_their_edge_wherever_it_looks() {
        // From (2, 0) the edge of the goods leads to the left.
        assert_eq!(at(Phase::Approaching, Heading::Left), (650, 0, 270));
        assert_eq!(at(Phase::Picking, Heading::Up), (650, 0, 0));
        assert_eq!(at(Phase::Leaving, Heading::Up), (650, 0, 30));
    }

    #[test]
    fn on_the_way_back_it_comes_from_the_bar() {
        assert_eq!(at(Phase::Returning, Heading::Right), (800 - 750, 0, 90));
        assert_eq!(at(Phase::TurningRound, Heading::Up), (800 - 150, 0, 30));
    }
}
