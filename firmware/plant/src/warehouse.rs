//! The warehouse as people write it in a file: size, delivery corner, exit, products, obstacles.
//!
//! ```text
//!   y                               size = [2, 1], side_length_cm = 50
//!   ^   (0,1)----(1,1)----(2,1)     delivery = [0, 0]
//!   |     |        |        |       [[product]] id = 1, square = [1, 0], side = "down"
//!   |     |        |   1    |       the mark points from the middle of that edge
//!   |     |        |   |    |       into the square, the goods stand at its end
//!   +-- (0,0)----(1,0)-+--(2,0)
//!        /
//!  =----+  exit, ends at the delivery bar
//! ```
//! A file is only data: [`Warehouse::validate`] says in a sentence why it cannot be built. This
//! module knows no tape widths and no coordinates in mm; `scene.rs` does.

use lager_floor::{FloorError, Grid, Heading, Node, Product, SideLength};
use lager_orders::Reason;
use serde::{Deserialize, Serialize};

/// Smallest radius of the exit line in cm (E3).
pub const MIN_RADIUS_CM: u16 = 25;
/// Straight part in cm before the first and after the last curve of the exit line.
pub const STRAIGHT_CM: u16 = 20;
/// Least contrast between tape and floor, in steps of the sensors' 8 bits.
pub const LEAST_CONTRAST: f64 = 20.0;
/// Longest exit line in cm.
pub const MAX_EXIT_CM: u16 = 1_000;

/// A warehouse (O5, part 3 of the requirements).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Warehouse {
    /// Squares in x and in y; the nodes run from (0, 0) to this (M2).
    pub size: Node,
    /// Side of a square in cm (C3).
    pub side_length_cm: u16,
    /// The corner node at which the exit line begins (M2).
    #[serde(default)]
    pub delivery: Node,
    /// The line that leaves the warehouse.
    #[serde(default, skip_serializing_if = "Exit::is_usual")]
    pub exit: Exit,
    /// Products and their stations (M3).
    #[serde(default, rename = "product", skip_serializing_if = "Vec::is_empty")]
    pub products: Vec<NamedProduct>,
    /// The brightness of floor and tape for the line sensors.
    #[serde(default, skip_serializing_if = "Floor::is_usual")]
    pub floor: Floor,
    /// Things that stand on an edge (E6).
    #[serde(default, rename = "obstacle", skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
}

/// The line from the delivery corner to the delivery bar (E3, E4). It leaves along x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Exit {
    /// Length along the line in cm.
    pub length_cm: u16,
    /// How the line runs.
    pub curve: Curve,
    /// Radius of its curves in cm, measured at the middle of the tape.
    pub radius_cm: u16,
}

impl Default for Exit {
    fn default() -> Self {
        Self {
            length_cm: 80,
            curve: Curve::Straight,
            radius_cm: 30,
        }
    }
}

/// Readings of the line sensors over floor and tape, 8 bits, as the mean of all sensors. A dark
/// floor or a worn tape has a weak contrast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Floor {
    /// Over the bare floor.
    pub white: u8,
    /// Over tape; it must be more (S6).
    pub tape: u8,
}

impl Default for Floor {
    fn default() -> Self {
        Self {
            white: 45,
            tape: 205,
        }
    }
}

impl Floor {
    /// The tape's reading minus the floor's.
    pub fn contrast(self) -> f64 {
        f64::from(self.tape) - f64::from(self.white)
    }

    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

/// The shape of the exit line, seen by a robot that leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Curve {
    /// Straight on.
    #[default]
    Straight,
    /// A quarter of a circle to the left.
    Left,
    /// A quarter of a circle to the right.
    Right,
    /// An eighth of a circle to the left and one back to the right.
    S,
}

impl Curve {
    /// The arcs of the curve in order, each as its angle in degrees, positive to the left.
    pub fn arcs_deg(self) -> &'static [f64] {
        match self {
            Curve::Straight => &[],
            Curve::Left => &[90.0],
            Curve::Right => &[-90.0],
            Curve::S => &[45.0, -45.0],
        }
    }
}

/// A product and the place where the robot picks it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedProduct {
    /// The product's number.
    pub id: i32,
    /// The name that people use; the robot uses numbers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The square it stands in.
    pub square: Node,
    /// The side of the square from which the robot reaches it.
    pub side: Heading,
}

/// A thing that stands in the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// The two nodes of the edge.
    pub between: [Node; 2],
}

impl Warehouse {
    /// The parts of it that a robot gets: side length, grid and products.
    ///
    /// # Errors
    /// No floor, simulated or real, can be like that.
    pub fn told(&self) -> Result<(SideLength, Grid, Vec<Product>), Reason> {
        let grid = Grid::new(self.size, self.delivery)?;
        let side = SideLength::new(self.side_length_cm)?;
        let products = self.products.iter().map(NamedProduct::told);
        let products = products.collect::<Result<Vec<_>, _>>()?;
        grid.check(&products)?;
        Ok((side, grid, products))
    }

    /// The robot starts at the delivery node, heading into the warehouse along x (AMB-50). `true`
    /// if that is towards +x.
    pub fn starts_towards_plus_x(&self) -> bool {
        self.delivery.x == 0
    }
}

impl NamedProduct {
    /// The product as a robot gets it, without a name.
    ///
    /// # Errors
    /// The product's number is negative.
    pub fn told(&self) -> Result<Product, FloorError> {
        Ok(Product {
            id: self.id.try_into()?,
            square: self.square,
            side: self.side,
        })
    }
}

impl Exit {
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// The shortest line that its curves fit into, in cm.
    pub fn least_length_cm(&self) -> u16 {
        let turned: f64 = self.curve.arcs_deg().iter().map(|arc| arc.abs()).sum();
        let curved = f64::from(self.radius_cm) * turned.to_radians();
        2 * STRAIGHT_CM + curved.ceil() as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_reads_as_documented_and_writes_back() {
        let text = r#"
            size = [2, 1]
            side_length_cm = 50
            delivery = [2, 1]
            [exit]
            length_cm = 90
            curve = "left"
            radius_cm = 25
            [[product]]
            id = 4
            name = "screws"
            square = [1, 0]
            side = "up"
            [[obstacle]]
            between = [[0, 0], [1, 0]]
        "#;
        let warehouse: Warehouse = toml::from_str(text).expect("valid");
        assert_eq!(warehouse.validate(), Ok(()));
        assert_eq!(
            warehouse.products,
            [NamedProduct {
                id: 4,
                name: Some("screws".into()),
                square: Node::new(1, 0),
                side: Heading::Up
            }]
        );
        assert_eq!(warehouse.exit.curve, Curve::Left);
        let again: Warehouse = toml::from_str(&toml::to_string(&warehouse).unwrap()).unwrap();
        assert_eq!(again, warehouse);
        assert!(
            toml::from_str::<Warehouse>("size = [1, 1]\nside_length_cm = 50\ncolour = 1").is_err()
        );
    }
}
