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
//! It is the published map and never changes: [`crate::blocks`] has what blocks a way. It never
//! plans and never knows where the robot is.

use lager_floor::{
    Edge, FloorError, Grid, Heading, MAX_PRODUCTS, MAX_SQUARES, Node, Product, SideLength,
};
use lager_topics::{Failure, FailureKind, WarehouseMap};

use crate::judge::EdgeMarks;
use crate::marks::Sides;

/// A place where a product is picked: the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PickStation {
    /// The product's number.
    pub product: i32,
    /// The edge on which it lies.
    pub edge: Edge,
    /// Which way the robot looks when it stands at the goods: into the product's square.
    pub into: Heading,
}

impl PickStation {
    /// On which side its mark is, for a robot that drives along `heading`.
    pub fn side_for(&self, heading: Heading) -> Sides {
        Sides {
            left: self.into == heading.left(),
            right: self.into == heading.right(),
        }
    }
}

impl From<&Product> for PickStation {
    fn from(product: &Product) -> Self {
        Self {
            product: product.id.get(),
            edge: product.edge(),
            into: product.side.back(),
        }
    }
}

/// The warehouse in a form for driving.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Its nodes and its way out.
    pub grid: Grid,
    side_mm: f32,
    stations: heapless::Vec<PickStation, MAX_PRODUCTS>,
}

impl Map {
    /// Reads a published map.
    ///
    /// # Errors
    /// The published map is incomplete or contradicts itself.
    pub fn new(published: &WarehouseMap) -> Result<Self, Failure> {
        let grid = published.grid().map_err(failure)?;
        let count = usize::from(published.product_count);
        if count > MAX_PRODUCTS {
            return Err(failure(FloorError::TooManyProducts { count }));
        }
        let side = SideLength::new(published.side_length_cm).map_err(failure)?;
        let mut products = heapless::Vec::<Product, MAX_PRODUCTS>::new();
        for product in published.products() {
            let outside = || Failure::new(FailureKind::ProductOutside, (0, 0), 0, product.id);
            // The published list has as many places.
            let _ = products.push(product.get().ok_or_else(outside)?);
        }
        grid.check(&products).map_err(failure)?;
        Ok(Self {
            grid,
            side_mm: f32::from(side.mm()),
            stations: products.iter().map(PickStation::from).collect(),
        })
    }

    /// Side of a square in mm.
    pub fn side_mm(&self) -> f32 {
        self.side_mm
    }

    /// Whether tape leads away from `node` along `heading`, to another node or out.
    pub fn has_tape(&self, node: Node, heading: Heading) -> bool {
        self.grid.neighbour(node, heading).is_some()
            || (node == self.grid.delivery() && heading == self.grid.exit())
    }

    /// On which sides tape leads away from `node`, for a robot that comes with `heading`.
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
            if station.edge.heading_from(node) == Some(heading) {
                let side = station.side_for(heading);
                sides.left |= side.left;
                sides.right |= side.right;
            }
        }
        sides
    }

    /// The marks and the length of the edge from `node` along `heading`, if there is one.
    pub fn edge(&self, node: Node, heading: Heading) -> Option<EdgeMarks> {
        let end = self.grid.neighbour(node, heading)?;
        Some(EdgeMarks {
            length_mm: self.side_mm,
            stations: self.station_sides(node, heading),
            crossing: self.crossing_sides(end, heading),
        })
    }

    /// The station of a product.
    pub fn station(&self, product: i32) -> Option<&PickStation> {
        self.stations
            .iter()
            .find(|station| station.product == product)
    }

    /// Whether both maps have the same tape between nodes, whatever their products.
    pub fn same_floor(&self, other: &Self) -> bool {
        (self.grid, self.side_mm) == (other.grid, other.side_mm)
    }
}

/// Why the navigator cannot drive on such a floor.
fn failure(error: FloorError) -> Failure {
    let refused = |kind, expected, seen| Failure::new(kind, (0, 0), expected, seen);
    match error {
        FloorError::Size { size } if size.x == 0 || size.y == 0 => {
            refused(FailureKind::MapEmpty, 1, 0)
        }
        FloorError::Size { size } => {
            let nodes = |squares: u8| i32::from(squares) + 1;
            let seen = nodes(size.x.max(size.y));
            refused(FailureKind::MapTooLarge, nodes(MAX_SQUARES), seen)
        }
        FloorError::Delivery { delivery, .. } => {
            let at = (delivery.x, delivery.y);
            Failure::new(FailureKind::DeliveryOffCorner, at, 0, 0)
        }
        FloorError::Side { cm: 0 } => {
            refused(FailureKind::SideUnknown, SideLength::MIN_CM.into(), 0)
        }
        FloorError::Side { cm } => {
            let nearest = cm.clamp(SideLength::MIN_CM, SideLength::MAX_CM);
            refused(FailureKind::SideWrong, nearest.into(), cm.into())
        }
        FloorError::TooManyProducts { count } => refused(
            FailureKind::TooManyProducts,
            MAX_PRODUCTS as i32,
            count as i32,
        ),
        FloorError::ProductNegative { number } => refused(FailureKind::ProductOutside, 0, number),
        FloorError::ProductOutside { id, .. } => refused(FailureKind::ProductOutside, 0, id),
        FloorError::ProductTwice { id, .. } => refused(FailureKind::ProductTwice, 0, id),
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
