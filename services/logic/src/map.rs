//! The warehouse as the navigator sees it: nodes with their ways (L4), pick stations on the edges
//! between them (AMB-37), and the way out at the delivery corner (L8).
//!
//! ```text
//!   y
//!   2  o----o----o        squares X x Y, nodes 0..=X, 0..=Y (M2), origin at the bottom left,
//!      |    |    |        up = +y (AMB-36). A border node has only the ways that exist.
//!   1  o----o----o
//!      |    | P--|        product P of square (1, 0), side right: on the edge (2,0)-(2,1),
//!   0 =o----o----o        the robot turns in towards the square, here to the left
//!      0    1    2   x    `=` is the way out at delivery corner (0, 0): outwards along x
//! ```
//!
//! It never plans and never knows where the robot is. What tape lies on the floor and which way
//! is open are two things: an obstacle closes a way and leaves the tape.

use lager_topics::{Heading, Side, WarehouseMap};

use crate::heading::{Compass, HEADINGS};
use crate::marks::Sides;

/// Most nodes a warehouse can have; a published route holds as many.
pub const MAX_NODES: usize = 256;

/// Most pick stations; a published map holds as many.
pub const MAX_STATIONS: usize = 64;

/// Shortest side of a square in cm. A mark at the middle of an edge must come under the sensors
/// after the axle has passed the node before it.
pub const MIN_SIDE_CM: u16 = 40;

/// A crossing by its coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Node {
    /// Column, from 0 at the left.
    pub x: u8,
    /// Row, from 0 at the bottom.
    pub y: u8,
}

impl Node {
    /// The crossing at these coordinates.
    pub const fn new(x: u8, y: u8) -> Self {
        Self { x, y }
    }
}

impl core::fmt::Display for Node {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "({}, {})", self.x, self.y)
    }
}

/// A set of ways out of a node (wayUp, wayRight, wayDown, wayLeft of L4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Ways(u8);

impl Ways {
    fn has(self, heading: Heading) -> bool {
        self.0 & (1 << heading as u8) != 0
    }

    fn open(&mut self, heading: Heading) {
        self.0 |= 1 << heading as u8;
    }

    fn close(&mut self, heading: Heading) {
        self.0 &= !(1 << heading as u8);
    }
}

/// A place where a product is picked: the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Station {
    /// The product's number.
    pub product: i32,
    /// The nodes it lies between, the one nearer to the origin first.
    pub ends: [Node; 2],
    /// Where the robot looks when it stands at the goods: into the product's square.
    pub into: Heading,
}

impl Station {
    /// The heading along the station's edge from one of its ends, `None` elsewhere.
    pub fn heading_from(&self, node: Node) -> Option<Heading> {
        let other = self.other_end(node)?;
        HEADINGS
            .into_iter()
            .find(|heading| heading.step_from(node) == Some(other))
    }

    /// The end that is not `node`, `None` if `node` is no end.
    pub fn other_end(&self, node: Node) -> Option<Node> {
        match self.ends {
            [first, second] if first == node => Some(second),
            [first, second] if second == node => Some(first),
            _ => None,
        }
    }
}

/// Why a published map cannot be driven in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MapError {
    /// No square in one direction.
    #[error("a warehouse of {width} x {height} squares has no way round; give at least 1 x 1")]
    NoSquares {
        /// Squares from left to right.
        width: u8,
        /// Squares from bottom to top.
        height: u8,
    },
    /// More nodes than there is room for.
    #[error(
        "{width} x {height} squares have more than {MAX_NODES} crossings; divide the warehouse"
    )]
    TooLarge {
        /// Squares from left to right.
        width: u8,
        /// Squares from bottom to top.
        height: u8,
    },
    /// The delivery station is not at one of the four corners (M2).
    #[error("the delivery station ({x}, {y}) is not at a corner of the warehouse")]
    DeliveryNotAtCorner {
        /// Column of the node given.
        x: u8,
        /// Row of the node given.
        y: u8,
    },
    /// The side length has not arrived (L2).
    #[error("the side length of the squares is missing; set it in centimetres")]
    NoSideLength,
    /// The marks on an edge would lie too close to tell apart.
    #[error("squares of {0} cm are too small; the side must be at least {MIN_SIDE_CM} cm")]
    SideTooShort(u16),
    /// A product's square is not in the warehouse, or its side is none.
    #[error("product {0} does not stand at a side of a square of this warehouse")]
    ProductOutside(i32),
    /// Two products share a number.
    #[error("product number {0} is given twice")]
    ProductTwice(i32),
}

/// The warehouse, ready to be driven in.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    width: u8,
    height: u8,
    side_mm: f32,
    delivery: Node,
    open: [Ways; MAX_NODES],
    stations: heapless::Vec<Station, MAX_STATIONS>,
}

impl Map {
    /// The map as published, with every way open.
    ///
    /// # Errors
    /// The published map is incomplete or contradicts itself.
    pub fn new(published: &WarehouseMap) -> Result<Self, MapError> {
        let WarehouseMap { width, height, .. } = *published;
        if width == 0 || height == 0 {
            return Err(MapError::NoSquares { width, height });
        }
        if (usize::from(width) + 1) * (usize::from(height) + 1) > MAX_NODES {
            return Err(MapError::TooLarge { width, height });
        }
        let delivery = Node::new(published.delivery_x, published.delivery_y);
        if ![0, width].contains(&delivery.x) || ![0, height].contains(&delivery.y) {
            let Node { x, y } = delivery;
            return Err(MapError::DeliveryNotAtCorner { x, y });
        }
        match published.side_length_cm {
            0 => return Err(MapError::NoSideLength),
            short if short < MIN_SIDE_CM => return Err(MapError::SideTooShort(short)),
            _ => {}
        }
        let mut map = Self {
            width,
            height,
            side_mm: f32::from(published.side_length_cm) * 10.0,
            delivery,
            open: [Ways::default(); MAX_NODES],
            stations: heapless::Vec::new(),
        };
        for index in 0..map.node_count() {
            for heading in HEADINGS {
                if map.neighbour(map.node(index), heading).is_some() {
                    map.open[index].open(heading);
                }
            }
        }
        for product in published.products() {
            let station = map
                .station_at(
                    product.id,
                    Node::new(product.x, product.y),
                    product.side.get(),
                )
                .ok_or(MapError::ProductOutside(product.id))?;
            if map.station(product.id).is_some() {
                return Err(MapError::ProductTwice(product.id));
            }
            // As many places as the published list has.
            let _ = map.stations.push(station);
        }
        Ok(map)
    }

    /// The edge a side of a square is (AMB-37), seen as a pick station.
    fn station_at(&self, product: i32, square: Node, side: Option<Side>) -> Option<Station> {
        let Node { x, y } = square;
        if x >= self.width || y >= self.height {
            return None;
        }
        let (first, second, into) = match side? {
            Side::Left => ((x, y), (x, y + 1), Heading::Right),
            Side::Up => ((x, y + 1), (x + 1, y + 1), Heading::Down),
            Side::Right => ((x + 1, y), (x + 1, y + 1), Heading::Left),
            Side::Down => ((x, y), (x + 1, y), Heading::Up),
        };
        Some(Station {
            product,
            ends: [Node::new(first.0, first.1), Node::new(second.0, second.1)],
            into,
        })
    }

    /// Side of a square in mm.
    pub fn side_mm(&self) -> f32 {
        self.side_mm
    }

    /// The node at the delivery corner.
    pub fn delivery(&self) -> Node {
        self.delivery
    }

    /// The heading of the way that leaves the warehouse at the delivery corner.
    pub fn exit(&self) -> Heading {
        if self.delivery.x == 0 {
            Heading::Left
        } else {
            Heading::Right
        }
    }

    /// How many nodes there are.
    pub fn node_count(&self) -> usize {
        (usize::from(self.width) + 1) * (usize::from(self.height) + 1)
    }

    /// Whether there is such a node.
    pub fn contains(&self, node: Node) -> bool {
        node.x <= self.width && node.y <= self.height
    }

    /// A node's place in arrays, row by row. The node must be in the map.
    pub fn index(&self, node: Node) -> usize {
        debug_assert!(self.contains(node));
        usize::from(node.y) * (usize::from(self.width) + 1) + usize::from(node.x)
    }

    /// The node at a place in arrays, below [`Self::node_count`].
    pub fn node(&self, index: usize) -> Node {
        let columns = usize::from(self.width) + 1;
        // Both are at most 255 because width and height are bytes.
        Node::new((index % columns) as u8, (index / columns) as u8)
    }

    /// The next node in a direction, whether the way there is open or not.
    pub fn neighbour(&self, node: Node, heading: Heading) -> Option<Node> {
        heading.step_from(node).filter(|next| self.contains(*next))
    }

    /// Whether one can go from `node` along `heading` to the next node.
    pub fn is_open(&self, node: Node, heading: Heading) -> bool {
        self.contains(node) && self.open[self.index(node)].has(heading)
    }

    /// Closes the way from `node` along `heading` at both of its ends (addObstacle of L4, and
    /// AMB-47). Returns whether there was an open way.
    pub fn block(&mut self, node: Node, heading: Heading) -> bool {
        if !self.is_open(node, heading) {
            return false;
        }
        let here = self.index(node);
        self.open[here].close(heading);
        if let Some(next) = self.neighbour(node, heading) {
            let there = self.index(next);
            self.open[there].close(heading.back());
        }
        true
    }

    /// Whether tape leads away from `node` along `heading`, to another node or out.
    pub fn has_tape(&self, node: Node, heading: Heading) -> bool {
        self.neighbour(node, heading).is_some() || (node == self.delivery && heading == self.exit())
    }

    /// On which sides tape leads away from `node`, for one who comes with `heading`.
    pub fn crossing_sides(&self, node: Node, heading: Heading) -> Sides {
        Sides {
            left: self.has_tape(node, heading.left()),
            right: self.has_tape(node, heading.right()),
        }
    }

    /// On which sides pick stations are marked on the edge from `node` along `heading`.
    pub fn station_sides(&self, node: Node, heading: Heading) -> Sides {
        let mut sides = Sides::NONE;
        for station in &self.stations {
            if station.heading_from(node) == Some(heading) {
                sides.left |= station.into == heading.left();
                sides.right |= station.into == heading.right();
            }
        }
        sides
    }

    /// Where a product is picked.
    pub fn station(&self, product: i32) -> Option<&Station> {
        self.stations
            .iter()
            .find(|station| station.product == product)
    }

    /// Whether both maps have the same tape between nodes, whatever their products.
    pub fn same_floor(&self, other: &Self) -> bool {
        let floor = |map: &Self| (map.width, map.height, map.side_mm, map.delivery);
        floor(self) == floor(other)
    }
}

#[cfg(test)]
mod tests;
