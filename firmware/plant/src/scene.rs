//! The places of a warehouse's things, in mm.
//!
//! It turns the numbers of a [`Warehouse`] into points and boxes on the floor, in one place, so
//! that tape, ranger and goods use the same ones.

use core::f64::consts::{FRAC_PI_2, PI};

use lager_floor::{Edge, Heading, Node, Place};

use crate::body::Pose;
use crate::warehouse::{NamedProduct, Warehouse};

/// Distance from goods to the middle of their edge, in mm.
pub const STAND: f64 = 250.0;
/// Height of the middle of goods on a shelf, in mm.
pub const SHELF_HEIGHT: f64 = 60.0;
/// Side of the shelf under one piece of goods, in mm.
pub const SHELF: f64 = 80.0;
/// Length of an obstacle along its edge, in mm.
pub const OBSTACLE_ALONG: f64 = 80.0;
/// Length of an obstacle across its edge, in mm.
pub const OBSTACLE_ACROSS: f64 = 160.0;

/// Distance from the walls of the hall to the nearest tape, in mm.
const HALL: f64 = 1_500.0;
/// Thickness of the walls, in mm.
const WALL: f64 = 100.0;

/// A box on the floor that the ranger sees; its sides are parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Smallest x and y.
    pub low: [f64; 2],
    /// Largest x and y.
    pub high: [f64; 2],
}

impl Block {
    pub(crate) fn around(middle: (f64, f64), width: f64, height: f64) -> Self {
        Self {
            low: [middle.0 - width / 2.0, middle.1 - height / 2.0],
            high: [middle.0 + width / 2.0, middle.1 + height / 2.0],
        }
    }
}

/// The place of a node.
pub fn node(at: Node, side: f64) -> (f64, f64) {
    (f64::from(at.x) * side, f64::from(at.y) * side)
}

/// The middle of an edge.
pub fn middle(edge: Edge, side: f64) -> (f64, f64) {
    let (a, b) = (node(edge.from, side), node(edge.to, side));
    (f64::midpoint(a.0, b.0), f64::midpoint(a.1, b.1))
}

/// The place of goods that are reached from side `from` of a square; `side` is the side of a square
/// in mm.
pub fn stand(square: Node, from: Heading, side: f64) -> (f64, f64) {
    let (x, y) = middle(Edge::of(square, from), side);
    let (dx, dy) = from.back().step();
    (x + STAND * f64::from(dx), y + STAND * f64::from(dy))
}

/// The place of a product's goods, with their height.
pub fn stand_3d(product: &NamedProduct, side: f64) -> [f64; 3] {
    let (x, y) = stand(product.square, product.side, side);
    [x, y, SHELF_HEIGHT]
}

/// The start: on the delivery node, heading into the warehouse along x (AMB-50).
pub fn start(warehouse: &Warehouse) -> Pose {
    let (x, y) = node(warehouse.delivery, side_mm(warehouse));
    let heading = if warehouse.starts_towards_plus_x() {
        0.0
    } else {
        PI
    };
    Pose { x, y, heading }
}

/// The pose of a robot at a place; `None` if there is no such node.
pub fn pose_at(warehouse: &Warehouse, at: Place) -> Option<Pose> {
    let inside = at.node.x <= warehouse.size.x && at.node.y <= warehouse.size.y;
    let (x, y) = node(at.node, side_mm(warehouse));
    let heading = f64::from(at.heading.quarters_right_to(Heading::Right)) * FRAC_PI_2;
    inside.then_some(Pose { x, y, heading })
}

/// Side of a square in mm.
pub fn side_mm(warehouse: &Warehouse) -> f64 {
    f64::from(warehouse.side_length_cm) * 10.0
}

/// An obstacle across the middle of an edge.
pub(crate) fn obstacle(edge: Edge, side: f64) -> Block {
    let (width, height) = match edge.heading() {
        Heading::Left | Heading::Right => (OBSTACLE_ALONG, OBSTACLE_ACROSS),
        Heading::Up | Heading::Down => (OBSTACLE_ACROSS, OBSTACLE_ALONG),
    };
    Block::around(middle(edge, side), width, height)
}

/// Everything that the IR ranger can see: obstacles and shelves.
pub fn blocks(warehouse: &Warehouse) -> Vec<Block> {
    let side = side_mm(warehouse);
    let obstacles = warehouse.obstacles.iter().filter_map(|stands| {
        let edge = Edge::between(stands.between[0], stands.between[1])?;
        Some(obstacle(edge, side))
    });
    let products = warehouse.products.iter();
    let stands = products.map(|product| stand(product.square, product.side, side));
    let shelves = stands.map(|middle| Block::around(middle, SHELF, SHELF));
    obstacles.chain(shelves).collect()
}

/// The walls of a hall, around the corners of all tape.
pub fn walls(low: [f64; 2], high: [f64; 2]) -> [Block; 4] {
    let (x0, y0) = (low[0] - HALL, low[1] - HALL);
    let (x1, y1) = (high[0] + HALL, high[1] + HALL);
    let block = |low, high| Block { low, high };
    [
        block([x0 - WALL, y0], [x0, y1]),
        block([x1, y0], [x1 + WALL, y1]),
        block([x0 - WALL, y0 - WALL], [x1 + WALL, y0]),
        block([x0 - WALL, y1], [x1 + WALL, y1 + WALL]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goods_stand_inside_their_square() {
        let square = Node::new(1, 2);
        assert_eq!(stand(square, Heading::Left, 500.0), (750.0, 1250.0));
        assert_eq!(stand(square, Heading::Down, 600.0), (900.0, 1450.0));
        assert_eq!(stand(square, Heading::Up, 600.0), (900.0, 1550.0));
        assert_eq!(stand(square, Heading::Right, 600.0), (950.0, 1500.0));
    }

    #[test]
    fn a_robot_starts_at_the_delivery_corner_and_looks_inwards() {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        assert_eq!(
            start(&warehouse),
            Pose {
                x: 0.0,
                y: 0.0,
                heading: 0.0
            }
        );
        warehouse.delivery = Node::new(2, 2);
        assert_eq!(
            start(&warehouse),
            Pose {
                x: 1000.0,
                y: 1000.0,
                heading: PI
            }
        );
    }

    #[test]
    fn a_robot_can_be_put_on_every_node_and_beside_none() {
        let warehouse = Warehouse::builtin("small").unwrap();
        let pose = |x, y, heading| Some(Pose { x, y, heading });
        let at = |x, y, heading| pose_at(&warehouse, Place::new(Node::new(x, y), heading));
        assert_eq!(at(0, 0, Heading::Right), Some(start(&warehouse)));
        assert_eq!(at(2, 1, Heading::Left), pose(1000.0, 500.0, PI));
        assert_eq!(at(3, 0, Heading::Right), None);
        assert_eq!(at(0, 3, Heading::Right), None);
    }

    #[test]
    fn an_obstacle_stands_across_its_edge() {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        warehouse.products.clear();
        warehouse.obstacles.push(crate::Obstacle {
            between: [Node::new(0, 1), Node::new(0, 0)],
        });
        assert_eq!(
            blocks(&warehouse),
            [Block {
                low: [-80.0, 210.0],
                high: [80.0, 290.0]
            }]
        );
    }
}
