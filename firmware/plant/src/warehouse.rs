//! The warehouse as people write it down: size, delivery corner, exit, products, obstacles.
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
//! A file is only data: [`Warehouse::validate`] says in a sentence what cannot be built. This
//! module knows nothing of tape widths or coordinates in mm; `scene.rs` does.

use serde::{Deserialize, Serialize};

/// Squares along one axis, at most: the robot's map has up to 100 nodes there.
pub const MAX_SQUARES: u8 = 99;
/// Products in one warehouse, at most: as many as the robot's map holds.
pub const MAX_PRODUCTS: usize = 256;
/// Smallest side of a square in cm: the marks are 17 cm long and goods stand behind them.
pub const MIN_SIDE_CM: u16 = 40;
/// Largest side of a square in cm.
pub const MAX_SIDE_CM: u16 = 500;
/// Smallest radius of the exit line in cm (E3).
pub const MIN_RADIUS_CM: u16 = 25;
/// Straight part in cm before the first and after the last curve of the exit line.
pub const STRAIGHT_CM: u16 = 20;
/// Least contrast between floor and tape, in steps of the sensors' 8 bits.
pub const LEAST_CONTRAST: f64 = 20.0;
/// Longest exit line in cm.
pub const MAX_EXIT_CM: u16 = 1_000;

/// A warehouse (O5, part 3 of the requirements).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Warehouse {
    /// Squares in x and in y; the nodes run from (0, 0) to this (M2).
    pub size: [u8; 2],
    /// Side of a square in cm (C3).
    pub side_length_cm: u16,
    /// The corner node the exit leaves from (M2).
    #[serde(default)]
    pub delivery: [u8; 2],
    /// The line that leaves the warehouse.
    #[serde(default)]
    pub exit: Exit,
    /// Products and their stations (M3).
    #[serde(default, rename = "product", skip_serializing_if = "Vec::is_empty")]
    pub products: Vec<Product>,
    /// How light floor and tape look to the line sensors.
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

/// What the line sensors read over the floor and over the tape, 8 bits, the middle of all
/// sensors. A dark floor or a worn tape has a weak contrast.
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
    /// Tape less floor.
    pub fn contrast(self) -> f64 {
        f64::from(self.tape) - f64::from(self.white)
    }

    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

/// How the exit line runs, seen by a robot that leaves.
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

/// A product and where it is picked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Product {
    /// The product's number.
    pub id: i32,
    /// What people call it; the robot knows numbers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The square it stands in.
    pub square: [u8; 2],
    /// The side of the square it is reached from.
    pub side: Side,
}

/// A side of a square, in the order of the goods protocol (M3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The side with the smaller x.
    Left = 0,
    /// The side with the larger y.
    Up = 1,
    /// The side with the larger x.
    Right = 2,
    /// The side with the smaller y.
    Down = 3,
}

impl Side {
    /// All four, clockwise from the left.
    pub const ALL: [Side; 4] = [Side::Left, Side::Up, Side::Right, Side::Down];
}

/// Something that stands in the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// The two nodes of the edge.
    pub between: [[u8; 2]; 2],
}

/// The tape between two neighbouring nodes; `from` is the one with the smaller coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Edge {
    /// The node at the left or lower end.
    pub from: [u8; 2],
    /// The node at the right or upper end.
    pub to: [u8; 2],
}

impl Edge {
    /// The edge at one side of a square (AMB-37).
    pub fn of(square: [u8; 2], side: Side) -> Self {
        let [x, y] = square;
        let (from, to) = match side {
            Side::Left => ([x, y], [x, y + 1]),
            Side::Up => ([x, y + 1], [x + 1, y + 1]),
            Side::Right => ([x + 1, y], [x + 1, y + 1]),
            Side::Down => ([x, y], [x + 1, y]),
        };
        Self { from, to }
    }

    /// The edge between two nodes, if they are neighbours.
    pub fn between(a: [u8; 2], b: [u8; 2]) -> Option<Self> {
        let (from, to) = if a <= b { (a, b) } else { (b, a) };
        let across = from[1] == to[1] && to[0].checked_sub(from[0]) == Some(1);
        let along = from[0] == to[0] && to[1].checked_sub(from[1]) == Some(1);
        (across || along).then_some(Self { from, to })
    }
}

impl Warehouse {
    /// The products as the map of the warehouse lists them (M3): number, square, side.
    pub fn map_products(&self) -> impl ExactSizeIterator<Item = (i32, [u8; 2], Side)> + '_ {
        self.products
            .iter()
            .map(|product| (product.id, product.square, product.side))
    }

    /// Where a robot stands at the start: the delivery node, looking into the warehouse along x
    /// (AMB-50). `true` if that is towards +x.
    pub fn starts_towards_plus_x(&self) -> bool {
        self.delivery[0] == 0
    }
}

impl Exit {
    /// The shortest line its curves fit into, in cm.
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
            [Product {
                id: 4,
                name: Some("screws".into()),
                square: [1, 0],
                side: Side::Up
            }]
        );
        assert_eq!(warehouse.exit.curve, Curve::Left);
        let again: Warehouse = toml::from_str(&toml::to_string(&warehouse).unwrap()).unwrap();
        assert_eq!(again, warehouse);
        assert!(
            toml::from_str::<Warehouse>("size = [1, 1]\nside_length_cm = 50\ncolour = 1").is_err()
        );
    }

    #[test]
    fn the_same_edge_has_two_names() {
        assert_eq!(Edge::of([0, 0], Side::Right), Edge::of([1, 0], Side::Left));
        assert_eq!(Edge::of([0, 0], Side::Up), Edge::of([0, 1], Side::Down));
        assert_eq!(
            Edge::between([1, 1], [1, 0]),
            Some(Edge::of([1, 0], Side::Left))
        );
        assert_eq!(Edge::between([0, 1], [1, 0]), None);
        assert_eq!(Edge::between([1, 1], [1, 1]), None);
    }
}
