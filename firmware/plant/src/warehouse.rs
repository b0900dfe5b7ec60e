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
//! module knows nothing of tape widths or coordinates in mm; see [`crate::scene`].

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Squares along one axis, at most; it keeps a way through all nodes within 256 of them.
pub const MAX_SQUARES: u8 = 15;
/// Products in one warehouse, at most.
pub const MAX_PRODUCTS: usize = 64;
/// Smallest side of a square in cm: the marks are 17 cm long and goods stand behind them.
pub const MIN_SIDE_CM: u16 = 40;
/// Largest side of a square in cm.
pub const MAX_SIDE_CM: u16 = 500;
/// Smallest radius of the exit line in cm (E3).
pub const MIN_RADIUS_CM: u16 = 25;
/// Straight part in cm before the first and after the last curve of the exit line.
pub const STRAIGHT_CM: u16 = 20;
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Product {
    /// The product's number.
    pub id: i32,
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

/// Why a warehouse cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WarehouseError {
    /// No squares, or too many.
    #[error("size is {x} x {y} squares; each must be from 1 to {MAX_SQUARES}")]
    Size {
        /// Squares along x.
        x: u8,
        /// Squares along y.
        y: u8,
    },
    /// Squares too small or too large.
    #[error(
        "side_length_cm is {0}; a square's side must be from {MIN_SIDE_CM} to {MAX_SIDE_CM} cm"
    )]
    SideLength(u16),
    /// Not at a corner (M2).
    #[error(
        "delivery is [{x}, {y}]; it must be a corner of the warehouse: [0, 0], [0, {height}], [{width}, 0] or [{width}, {height}]"
    )]
    Delivery {
        /// As given.
        x: u8,
        /// As given.
        y: u8,
        /// The largest x of a node.
        width: u8,
        /// The largest y of a node.
        height: u8,
    },
    /// The exit's curves are too tight (E3).
    #[error("the exit's radius_cm is {0}; it must be from {MIN_RADIUS_CM} to 200 cm")]
    Radius(u16),
    /// The exit cannot have that length.
    #[error(
        "the exit's length_cm is {length}; with this curve it must be from {least} to {MAX_EXIT_CM} cm"
    )]
    ExitLength {
        /// As given.
        length: u16,
        /// The shortest that fits the curve.
        least: u16,
    },
    /// More products than the bus can carry.
    #[error("there are {0} products; at most {MAX_PRODUCTS} fit")]
    TooManyProducts(usize),
    /// The same number twice.
    #[error("product {0} is listed twice; every product needs a number of its own")]
    DuplicateProduct(i32),
    /// A negative product number.
    #[error("product {0} has a negative number; -1 means no product, so numbers start at 0")]
    NegativeProduct(i32),
    /// A square that is not there.
    #[error(
        "product {id} stands in square [{x}, {y}], outside the warehouse; squares run to [{last_x}, {last_y}]"
    )]
    OutsideSquare {
        /// The product.
        id: i32,
        /// As given.
        x: u8,
        /// As given.
        y: u8,
        /// The largest x of a square.
        last_x: u8,
        /// The largest y of a square.
        last_y: u8,
    },
    /// Two stations between two crossings (E17).
    #[error(
        "products {first} and {second} have their stations on the same edge; at most one station fits between two crossings"
    )]
    SharedEdge {
        /// The one listed first.
        first: i32,
        /// The other one.
        second: i32,
    },
    /// Goods that would stand in each other.
    #[error(
        "products {first} and {second} would stand {gap_mm} mm apart in one square; goods need 100 mm from middle to middle, so give one of them another square"
    )]
    Crowded {
        /// The one listed first.
        first: i32,
        /// The other one.
        second: i32,
        /// Distance of their middles.
        gap_mm: u32,
    },
    /// An obstacle that is not on an edge.
    #[error(
        "an obstacle stands between [{}, {}] and [{}, {}], which are not neighbouring nodes of the warehouse", .between[0][0], .between[0][1], .between[1][0], .between[1][1]
    )]
    ObstacleOffEdge {
        /// As given.
        between: [[u8; 2]; 2],
    },
}

impl Warehouse {
    /// The names of the built-in warehouses; the first is the default.
    pub const BUILTIN: [&'static str; 3] = ["small", "curved", "large"];

    /// A built-in warehouse by its name.
    pub fn builtin(name: &str) -> Option<Self> {
        match name {
            "small" => Some(Self::small()),
            "curved" => Some(Self::curved()),
            "large" => Some(Self::large()),
            _ => None,
        }
    }

    /// Checks everything the geometry relies on.
    ///
    /// # Errors
    /// The first thing that cannot be built, as a sentence.
    pub fn validate(&self) -> Result<(), WarehouseError> {
        let [width, height] = self.size;
        if !(1..=MAX_SQUARES).contains(&width) || !(1..=MAX_SQUARES).contains(&height) {
            return Err(WarehouseError::Size {
                x: width,
                y: height,
            });
        }
        if !(MIN_SIDE_CM..=MAX_SIDE_CM).contains(&self.side_length_cm) {
            return Err(WarehouseError::SideLength(self.side_length_cm));
        }
        let [x, y] = self.delivery;
        if (x != 0 && x != width) || (y != 0 && y != height) {
            return Err(WarehouseError::Delivery {
                x,
                y,
                width,
                height,
            });
        }
        self.exit.validate()?;
        self.validate_products()?;
        for obstacle in &self.obstacles {
            let [a, b] = obstacle.between;
            let inside = |node: [u8; 2]| node[0] <= width && node[1] <= height;
            if Edge::between(a, b).is_none() || !inside(a) || !inside(b) {
                return Err(WarehouseError::ObstacleOffEdge {
                    between: obstacle.between,
                });
            }
        }
        Ok(())
    }

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

    fn validate_products(&self) -> Result<(), WarehouseError> {
        if self.products.len() > MAX_PRODUCTS {
            return Err(WarehouseError::TooManyProducts(self.products.len()));
        }
        for (index, product) in self.products.iter().enumerate() {
            let [x, y] = product.square;
            if product.id < 0 {
                return Err(WarehouseError::NegativeProduct(product.id));
            }
            if x >= self.size[0] || y >= self.size[1] {
                return Err(WarehouseError::OutsideSquare {
                    id: product.id,
                    x,
                    y,
                    last_x: self.size[0] - 1,
                    last_y: self.size[1] - 1,
                });
            }
            for other in &self.products[..index] {
                self.validate_pair(other, product)?;
            }
        }
        Ok(())
    }

    fn validate_pair(&self, first: &Product, second: &Product) -> Result<(), WarehouseError> {
        let (a, b) = (first.id, second.id);
        if a == b {
            return Err(WarehouseError::DuplicateProduct(a));
        }
        if Edge::of(first.square, first.side) == Edge::of(second.square, second.side) {
            return Err(WarehouseError::SharedEdge {
                first: a,
                second: b,
            });
        }
        if first.square == second.square {
            let side = f64::from(self.side_length_cm) * 10.0;
            let (ax, ay) = crate::scene::stand(first, side);
            let (bx, by) = crate::scene::stand(second, side);
            let gap = (ax - bx).hypot(ay - by);
            if gap < 100.0 {
                return Err(WarehouseError::Crowded {
                    first: a,
                    second: b,
                    gap_mm: gap.round() as u32,
                });
            }
        }
        Ok(())
    }

    fn small() -> Self {
        Self {
            size: [2, 2],
            side_length_cm: 50,
            delivery: [0, 0],
            exit: Exit::default(),
            products: vec![
                product(1, [1, 0], Side::Down),
                product(2, [0, 1], Side::Up),
                product(3, [1, 1], Side::Left),
            ],
            obstacles: Vec::new(),
        }
    }

    fn curved() -> Self {
        Self {
            size: [3, 2],
            side_length_cm: 60,
            delivery: [3, 0],
            exit: Exit {
                length_cm: 130,
                curve: Curve::S,
                radius_cm: 40,
            },
            products: vec![
                product(1, [1, 0], Side::Up),
                product(2, [0, 1], Side::Left),
                product(3, [2, 1], Side::Right),
                product(4, [2, 0], Side::Left),
            ],
            obstacles: Vec::new(),
        }
    }

    fn large() -> Self {
        Self {
            size: [5, 4],
            side_length_cm: 50,
            delivery: [0, 4],
            exit: Exit {
                length_cm: 110,
                curve: Curve::Right,
                radius_cm: 25,
            },
            products: vec![
                product(1, [2, 2], Side::Down),
                product(2, [4, 0], Side::Right),
                product(3, [0, 0], Side::Down),
                product(4, [4, 3], Side::Up),
                product(5, [1, 1], Side::Left),
                product(6, [3, 1], Side::Up),
            ],
            obstacles: Vec::new(),
        }
    }
}

impl Exit {
    /// The shortest line its curves fit into, in cm.
    pub fn least_length_cm(&self) -> u16 {
        let turned: f64 = self.curve.arcs_deg().iter().map(|arc| arc.abs()).sum();
        let curved = f64::from(self.radius_cm) * turned.to_radians();
        2 * STRAIGHT_CM + curved.ceil() as u16
    }

    fn validate(&self) -> Result<(), WarehouseError> {
        if !(MIN_RADIUS_CM..=200).contains(&self.radius_cm) {
            return Err(WarehouseError::Radius(self.radius_cm));
        }
        let least = self.least_length_cm();
        if !(least..=MAX_EXIT_CM).contains(&self.length_cm) {
            return Err(WarehouseError::ExitLength {
                length: self.length_cm,
                least,
            });
        }
        Ok(())
    }
}

fn product(id: i32, square: [u8; 2], side: Side) -> Product {
    Product { id, square, side }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(change: impl FnOnce(&mut Warehouse)) -> WarehouseError {
        let mut warehouse = Warehouse::small();
        change(&mut warehouse);
        warehouse.validate().expect_err("this must not be built")
    }

    #[test]
    fn the_built_in_warehouses_can_be_built() {
        for name in Warehouse::BUILTIN {
            let warehouse = Warehouse::builtin(name).expect("listed");
            assert_eq!(warehouse.validate(), Ok(()), "{name}");
            assert!(warehouse.map_products().any(|(id, ..)| id == 1));
        }
        assert!(Warehouse::builtin("huge").is_none());
    }

    #[test]
    fn a_file_reads_as_documented_and_writes_back() {
        let text = r#"
            size = [2, 1]
            side_length_cm = 45
            delivery = [2, 1]
            [exit]
            length_cm = 90
            curve = "left"
            radius_cm = 25
            [[product]]
            id = 4
            square = [1, 0]
            side = "up"
            [[obstacle]]
            between = [[0, 0], [1, 0]]
        "#;
        let warehouse: Warehouse = toml::from_str(text).expect("valid");
        assert_eq!(warehouse.validate(), Ok(()));
        assert_eq!(warehouse.products, [product(4, [1, 0], Side::Up)]);
        assert_eq!(warehouse.exit.curve, Curve::Left);
        let again: Warehouse = toml::from_str(&toml::to_string(&warehouse).unwrap()).unwrap();
        assert_eq!(again, warehouse);
        assert!(
            toml::from_str::<Warehouse>("size = [1, 1]\nside_length_cm = 50\ncolour = 1").is_err()
        );
    }

    #[test]
    fn what_cannot_be_built_is_refused_with_a_sentence() {
        let cases: [(WarehouseError, &str); 10] = [
            (error(|w| w.size = [0, 2]), "size is 0 x 2"),
            (error(|w| w.side_length_cm = 39), "side must be from 40"),
            (error(|w| w.delivery = [1, 0]), "corner of the warehouse"),
            (error(|w| w.exit.radius_cm = 24), "from 25 to 200 cm"),
            (
                error(|w| w.exit.curve = Curve::Left),
                "with this curve it must be from 88",
            ),
            (error(|w| w.products[1].id = 1), "product 1 is listed twice"),
            (
                error(|w| w.products[0].square = [2, 0]),
                "outside the warehouse",
            ),
            (
                error(|w| w.products[1] = product(2, [1, 1], Side::Down)),
                "would stand 0 mm apart",
            ),
            (
                error(|w| {
                    w.products = vec![
                        product(1, [0, 0], Side::Right),
                        product(2, [1, 0], Side::Left),
                    ];
                }),
                "at most one station",
            ),
            (
                error(|w| {
                    w.obstacles.push(Obstacle {
                        between: [[0, 0], [1, 1]],
                    });
                }),
                "not neighbouring nodes",
            ),
        ];
        for (error, sentence) in cases {
            assert!(error.to_string().contains(sentence), "{error}");
        }
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
