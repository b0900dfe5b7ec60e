//! The floor of a warehouse, as every program of this project sees it: nodes, headings, edges,
//! products, and the one check of whether there can be such a floor.
//!
//! ```text
//!   y
//!   2  o----o----o        size (2, 2): squares each way, and the last node (M2)
//!      |    |    |        o = node, from (0, 0) at the bottom left to (2, 2)
//!   1  o----o----o        up = towards greater y
//!      |    | P--|        product P of the square (1, 0), side right: it is picked on the edge
//!   0 =o----o----o        from (2, 0) to (2, 1). A square has the name of its lower left node
//!      0    1    2   x    = is the way out at the delivery corner (0, 0), outwards along x
//! ```
//!
//! Files, lines, samples and the navigator's map hold the same types or are converted to them. A
//! program that reads a floor checks it with [`Grid::new`], [`SideLength::new`] and
//! [`Grid::check`], so that a wrong floor is refused with the same sentence wherever it comes from.
//!
//! Nothing here allocates, plans, or knows where a robot is.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod edge;
mod error;
mod grid;
mod heading;
mod limits;
mod node;
mod place;
mod product;

pub use edge::Edge;
pub use error::FloorError;
pub use grid::{Grid, SideLength};
pub use heading::{Heading, Spin};
pub use limits::{MAX_NODES, MAX_PRODUCTS, MAX_SQUARES};
pub use node::Node;
pub use place::{Place, PlaceError};
pub use product::{Product, ProductId};
