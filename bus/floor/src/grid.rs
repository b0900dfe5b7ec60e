//! [`Grid`]: how large a floor is, and whether products can stand on it.

use core::fmt;

use crate::error::FloorError;
use crate::heading::Heading;
use crate::limits::{MAX_PRODUCTS, MAX_SIDE_CM, MAX_SQUARES, MIN_SIDE_CM};
use crate::node::Node;
use crate::product::Product;

/// The side of a square in whole centimetres (C3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SideLength(u16);

impl SideLength {
    /// The shortest side in cm.
    pub const MIN_CM: u16 = MIN_SIDE_CM;
    /// The longest side in cm.
    pub const MAX_CM: u16 = MAX_SIDE_CM;

    /// A side of `cm` centimetres.
    ///
    /// # Errors
    /// It is shorter than [`MIN_CM`](Self::MIN_CM) or longer than [`MAX_CM`](Self::MAX_CM).
    pub const fn new(cm: u16) -> Result<Self, FloorError> {
        match cm {
            Self::MIN_CM..=Self::MAX_CM => Ok(Self(cm)),
            _ => Err(FloorError::Side { cm }),
        }
    }

    /// The side in cm.
    pub const fn cm(self) -> u16 {
        self.0
    }

    /// The side in mm.
    pub const fn mm(self) -> u16 {
        self.0 * 10
    }
}

impl fmt::Display for SideLength {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// How many squares a floor has, and at which corner the robot leaves it (M1, M2, G3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Grid {
    size: Node,
    delivery: Node,
}

impl Grid {
    /// A floor of `size.x` times `size.y` squares, which the robot leaves at the node `delivery`.
    ///
    /// # Errors
    /// It has no squares or more than [`MAX_SQUARES`] one way, or the delivery is not at a corner.
    pub const fn new(size: Node, delivery: Node) -> Result<Self, FloorError> {
        let is_size = size.x != 0 && size.x <= MAX_SQUARES && size.y != 0 && size.y <= MAX_SQUARES;
        if !is_size {
            return Err(FloorError::Size { size });
        }
        let at_side = delivery.x == 0 || delivery.x == size.x;
        if !at_side || (delivery.y != 0 && delivery.y != size.y) {
            return Err(FloorError::Delivery { size, delivery });
        }
        Ok(Self { size, delivery })
    }

    /// Squares each way; also the coordinates of the last node.
    pub const fn size(self) -> Node {
        self.size
    }

    /// The node at the delivery corner.
    pub const fn delivery(self) -> Node {
        self.delivery
    }

    /// The direction of the way out from the delivery corner: left or right.
    pub const fn exit(self) -> Heading {
        match self.delivery.x {
            0 => Heading::Left,
            _ => Heading::Right,
        }
    }

    /// Whether the floor has this node.
    pub const fn contains(self, node: Node) -> bool {
        node.x <= self.size.x && node.y <= self.size.y
    }

    /// Whether the floor has this square.
    pub const fn has_square(self, square: Node) -> bool {
        square.x < self.size.x && square.y < self.size.y
    }

    /// The next node along `heading`; `None` at the border.
    pub fn neighbour(self, node: Node, heading: Heading) -> Option<Node> {
        heading.step_from(node).filter(|next| self.contains(*next))
    }

    /// How many nodes there are, at most [`MAX_NODES`](crate::MAX_NODES).
    pub fn node_count(self) -> usize {
        (usize::from(self.size.x) + 1) * (usize::from(self.size.y) + 1)
    }

    /// A node's place in arrays, row by row. The node must be one of this floor's.
    pub fn index(self, node: Node) -> usize {
        debug_assert!(self.contains(node));
        usize::from(node.y) * (usize::from(self.size.x) + 1) + usize::from(node.x)
    }

    /// The node at a place in arrays, below [`Self::node_count`].
    pub fn node(self, index: usize) -> Node {
        let columns = usize::from(self.size.x) + 1;
        // Both are at most 99.
        Node::new((index % columns) as u8, (index / columns) as u8)
    }

    /// Checks that these products can stand on this floor.
    ///
    /// # Errors
    /// There are more than [`MAX_PRODUCTS`], two have the same number, or one stands outside.
    pub fn check(self, products: &[Product]) -> Result<(), FloorError> {
        Self::check_numbers(products)?;
        match products.iter().find(|one| !self.has_square(one.square)) {
            None => Ok(()),
            Some(&Product { id, square, .. }) => Err(FloorError::ProductOutside {
                id: id.get(),
                square,
                size: self.size,
            }),
        }
    }

    /// Checks that these products can stand together on any floor.
    ///
    /// # Errors
    /// There are more than [`MAX_PRODUCTS`], or two have the same number.
    pub fn check_numbers(products: &[Product]) -> Result<(), FloorError> {
        let count = products.len();
        if count > MAX_PRODUCTS {
            return Err(FloorError::TooManyProducts { count });
        }
        let is_second = |&index: &usize| {
            let (before, id) = (&products[..index], products[index].id);
            before.iter().any(|other| other.id == id)
        };
        match (0..count).find(is_second) {
            None => Ok(()),
            Some(index) => Err(FloorError::ProductTwice {
                id: products[index].id.get(),
                index,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::MAX_NODES;
    use crate::product::ProductId;

    fn node(x: u8, y: u8) -> Node {
        Node::new(x, y)
    }

    fn product(id: i32, square: Node) -> Product {
        let (id, side) = (ProductId::new(id).expect("a number"), Heading::Up);
        Product { id, square, side }
    }

    fn floor() -> Grid {
        Grid::new(node(3, 2), node(3, 0)).expect("a floor")
    }

    #[test]
    fn what_no_floor_can_be_is_refused() {
        let here = floor();
        let floor = |x, y, delivery| Grid::new(node(x, y), delivery).map(|_| ());
        let side = |cm| SideLength::new(cm).map(|_| ());
        let many: Vec<_> = (0..257).map(|id| product(id, node(0, 0))).collect();
        let size = |x, y| FloorError::Size { size: node(x, y) };
        let cases = [
            (floor(0, 2, node(0, 0)), size(0, 2)),
            (floor(2, 100, node(0, 0)), size(2, 100)),
            (
                floor(3, 2, node(1, 0)),
                FloorError::Delivery {
                    size: node(3, 2),
                    delivery: node(1, 0),
                },
            ),
            (side(0), FloorError::Side { cm: 0 }),
            (side(39), FloorError::Side { cm: 39 }),
            (side(501), FloorError::Side { cm: 501 }),
            (
                ProductId::try_from(-1).map(|_| ()),
                FloorError::ProductNegative { number: -1 },
            ),
            (
                here.check(&many),
                FloorError::TooManyProducts { count: 257 },
            ),
            (
                here.check(&[product(7, node(0, 0)), product(7, node(1, 0))]),
                FloorError::ProductTwice { id: 7, index: 1 },
            ),
            (
                here.check(&[product(7, node(3, 0))]),
                FloorError::ProductOutside {
                    id: 7,
                    square: node(3, 0),
                    size: node(3, 2),
                },
            ),
        ];
        for (refused, error) in cases {
            assert_eq!(refused, Err(error));
        }
        for cm in [SideLength::MIN_CM, SideLength::MAX_CM] {
            assert_eq!(SideLength::new(cm).map(SideLength::cm), Ok(cm));
        }
    }

    #[test]
    fn the_largest_floor_and_the_most_products_are_taken() {
        let corner = node(MAX_SQUARES, MAX_SQUARES);
        let floor = Grid::new(corner, corner).expect("a floor");
        assert_eq!(floor.node_count(), MAX_NODES);
        let products: Vec<_> = (0..MAX_PRODUCTS)
            .map(|id| product(id as i32, node((id % 99) as u8, (id / 99) as u8)))
            .collect();
        assert_eq!(floor.check(&products), Ok(()));
        for index in 0..floor.node_count() {
            assert_eq!(floor.index(floor.node(index)), index);
        }
    }

    #[test]
    fn border_nodes_have_only_the_ways_that_exist() {
        let ways = |node| Heading::ALL.map(|way| floor().neighbour(node, way).is_some());
        assert_eq!(ways(node(0, 0)), [false, true, true, false]);
        assert_eq!(ways(node(1, 0)), [true, true, true, false]);
        assert_eq!(ways(node(3, 2)), [true, false, false, true]);
        assert_eq!(ways(node(1, 1)), [true; 4]);
    }

    #[test]
    fn the_way_out_leaves_each_corner_outwards() {
        for corner in [node(0, 0), node(0, 2), node(3, 0), node(3, 2)] {
            let floor = Grid::new(node(3, 2), corner).expect("a floor");
            assert_eq!(floor.neighbour(corner, floor.exit()), None);
            assert!(floor.neighbour(corner, floor.exit().back()).is_some());
        }
    }
}
