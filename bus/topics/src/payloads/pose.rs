//! [`Pose`]: where the robot is between nodes, from logic's status: the node last passed, the way
//! since then and where the robot looks.

use lager_floor::{Heading, Node};

use super::map::{MapProduct, WarehouseMap};
use super::nav::{NavigatorStatus, Phase};

/// A place and a heading in the warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pose {
    /// Middle of the axle in mm, x to the right of node (0, 0).
    pub x_mm: i32,
    /// Middle of the axle in mm, y up from node (0, 0).
    pub y_mm: i32,
    /// Where the robot looks, in degrees clockwise from up; may be several turns.
    pub heading_deg: i32,
}

impl NavigatorStatus {
    /// Where the middle of the axle is, if the robot's phase tells it. `map` is the robot's
    /// warehouse.
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
        // While it turns round, it looks along no way.
        Phase::TurningRound => (outwards(map), status.travelled_mm),
        // The robot has turned off the edge along which it came, or is turning.
        Phase::Positioning | Phase::Picking | Phase::Leaving => {
            let along = goods(status, map).and_then(|goods| edge_from(status, goods));
            (along.unwrap_or(looks), status.travelled_mm)
        }
        _ => (looks, status.travelled_mm),
    };
    let (right, up) = along.step();
    let turned_deg = match phase {
        Phase::Turning
        | Phase::Positioning
        | Phase::Leaving
        | Phase::TurningRound
        | Phase::TurningBack => status.turned_deg,
        // The tape shows where it looks.
        _ => 0,
    };
    Some(Pose {
        x_mm: i32::from(status.x) * side_mm + right * way_mm,
        y_mm: i32::from(status.y) * side_mm + up * way_mm,
        heading_deg: looks.degrees() + i32::from(turned_deg),
    })
}

fn goods<'map>(status: &NavigatorStatus, map: &'map WarehouseMap) -> Option<&'map MapProduct> {
    let mut products = map.products().iter();
    products.find(|product| product.id == status.product)
}

/// The direction of the edge of `goods` from the node last passed.
fn edge_from(status: &NavigatorStatus, goods: &MapProduct) -> Option<Heading> {
    let (x, y) = (status.x.try_into().ok()?, status.y.try_into().ok()?);
    goods.get()?.edge().heading_from(Node::new(x, y))
}

/// The direction of the way out from the delivery corner.
fn outwards(map: &WarehouseMap) -> Heading {
    match map.delivery_x {
        0 => Heading::Left,
        _ => Heading::Right,
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
            side: Heading::Down.into(),
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
