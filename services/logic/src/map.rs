//! The floor as the navigator sees it: nodes, pick stations on the edges between them (AMB-37), and
//! the way out at the delivery corner (L8).
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
//! It is what was published and never changes: what blocks a way stands in [`crate::blocks`]. It
//! never plans and never knows where the robot is.

use lager_topics::{Failure, FailureKind, Heading, Side, WarehouseMap};

use crate::heading::{Compass, HEADINGS};
use crate::judge::Edge;
use crate::marks::Sides;
use crate::node::Node;

/// Most nodes along one side of a warehouse.
pub const MAX_SIDE: usize = 100;

/// Most nodes a warehouse can have.
pub const MAX_NODES: usize = MAX_SIDE * MAX_SIDE;

/// Most pick stations; a published map holds as many.
pub const MAX_STATIONS: usize = 256;

/// Shortest side of a square in cm. A mark at the middle of an edge must come under the sensors
/// after the axle has passed the node before it.
pub const MIN_SIDE_CM: u16 = 40;

/// A place where a product is picked: the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PickStation {
    /// The product's number.
    pub product: i32,
    /// The nodes it lies between, the one nearer to the origin first.
    pub ends: [Node; 2],
    /// Where the robot looks when it stands at the goods: into the product's square.
    pub into: Heading,
}

impl PickStation {
    /// The heading along the station's edge from one of its ends, `None` elsewhere.
    pub fn heading_from(&self, node: Node) -> Option<Heading> {
        let other = self.other_end(node)?;
        HEADINGS
            .into_iter()
            .find(|heading| heading.step_from(node) == Some(other))
    }

    /// On which side its mark is for one who drives along `heading`.
    pub fn side_for(&self, heading: Heading) -> Sides {
        Sides {
            left: self.into == heading.left(),
            right: self.into == heading.right(),
        }
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

/// The warehouse, ready to be driven in.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    width: u8,
    height: u8,
    side_mm: f32,
    delivery: Node,
    stations: heapless::Vec<PickStation, MAX_STATIONS>,
}

impl Map {
    /// The map as published.
    ///
    /// # Errors
    /// The published map is incomplete or contradicts itself.
    pub fn new(published: &WarehouseMap) -> Result<Self, Failure> {
        let refuse = |kind, expected, seen| Err(Failure::new(kind, (0, 0), expected, seen));
        let WarehouseMap { width, height, .. } = *published;
        if width == 0 || height == 0 {
            return refuse(FailureKind::MapEmpty, 1, 0);
        }
        let crossings = usize::from(width.max(height)) + 1;
        if crossings > MAX_SIDE {
            return refuse(FailureKind::MapTooLarge, MAX_SIDE as i32, crossings as i32);
        }
        if usize::from(published.product_count) > MAX_STATIONS {
            return refuse(
                FailureKind::TooManyProducts,
                MAX_STATIONS as i32,
                published.product_count.into(),
            );
        }
        let delivery = Node::new(published.delivery_x, published.delivery_y);
        if ![0, width].contains(&delivery.x) || ![0, height].contains(&delivery.y) {
            let Node { x, y } = delivery;
            return Err(Failure::new(FailureKind::DeliveryOffCorner, (x, y), 0, 0));
        }
        match published.side_length_cm {
            0 => return refuse(FailureKind::SideUnknown, MIN_SIDE_CM.into(), 0),
            short if short < MIN_SIDE_CM => {
                return refuse(FailureKind::SideTooShort, MIN_SIDE_CM.into(), short.into());
            }
            _ => {}
        }
        let mut map = Self {
            width,
            height,
            side_mm: f32::from(published.side_length_cm) * 10.0,
            delivery,
            stations: heapless::Vec::new(),
        };
        for product in published.products() {
            let square = Node::new(product.x, product.y);
            let Some(station) = map.station_at(product.id, square, product.side.get()) else {
                return refuse(FailureKind::ProductOutside, 0, product.id);
            };
            if map.station(product.id).is_some() {
                return refuse(FailureKind::ProductTwice, 0, product.id);
            }
            // As many places as the published list has.
            let _ = map.stations.push(station);
        }
        Ok(map)
    }

    /// The edge a side of a square is (AMB-37), seen as a pick station.
    fn station_at(&self, product: i32, square: Node, side: Option<Side>) -> Option<PickStation> {
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
        Some(PickStation {
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

    /// Squares from left to right and from bottom to top.
    pub fn size(&self) -> [u8; 2] {
        [self.width, self.height]
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

    /// The next node in a direction.
    pub fn neighbour(&self, node: Node, heading: Heading) -> Option<Node> {
        heading.step_from(node).filter(|next| self.contains(*next))
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
                let side = station.side_for(heading);
                sides.left |= side.left;
                sides.right |= side.right;
            }
        }
        sides
    }

    /// What lies on the edge from `node` along `heading`, if there is one.
    pub fn edge(&self, node: Node, heading: Heading) -> Option<Edge> {
        let end = self.neighbour(node, heading)?;
        Some(Edge {
            length_mm: self.side_mm,
            stations: self.station_sides(node, heading),
            crossing: self.crossing_sides(end, heading),
        })
    }

    /// Where a product is picked.
    pub fn station(&self, product: i32) -> Option<&PickStation> {
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
impl Map {
    /// A floor of 50 cm squares without products.
    pub(crate) fn grid(width: u8, height: u8) -> Self {
        let published = WarehouseMap {
            width,
            height,
            side_length_cm: 50,
            ..WarehouseMap::default()
        };
        Self::new(&published).expect("a floor")
    }
}

#[cfg(test)]
mod tests;
