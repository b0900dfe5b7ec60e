//! What a warehouse must keep to be built, each rule with the sentence that says so.

use thiserror::Error;

use crate::obstacles::MOST_OBSTACLES;
use crate::room::{LEAST_SIDE_WITH_GOODS_CM, LEAST_SIDE_WITH_THINGS_CM};
use crate::warehouse::{
    Edge, Exit, Floor, LEAST_CONTRAST, MAX_EXIT_CM, MAX_PRODUCTS, MAX_SIDE_CM, MAX_SQUARES,
    MIN_RADIUS_CM, MIN_SIDE_CM, Product, Warehouse,
};

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
    /// Squares in which the robot would touch the goods' shelves.
    #[error(
        "side_length_cm is {0}; where goods stand it must be {LEAST_SIDE_WITH_GOODS_CM} cm or more, or a robot that turns on the far side of their square touches their shelf"
    )]
    NoRoomForGoods(u16),
    /// Ways so short that the robot would touch a thing on the next one.
    #[error(
        "side_length_cm is {0}; where things stand on the ways it must be {LEAST_SIDE_WITH_THINGS_CM} cm or more, or a robot that turns on a crossing touches the thing on the next way before it can see it"
    )]
    NoRoomForThings(u16),
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
    /// The tape is not darker than the floor.
    #[error(
        "floor reads {white} and its tape {tape}; black tape reads more than the floor, by 20 at least"
    )]
    Contrast {
        /// As given.
        white: u8,
        /// As given.
        tape: u8,
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
    /// More products than the robot's map holds.
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
    /// More obstacles than may stand.
    #[error("{0} obstacles; at most {most} can stand in a warehouse", most = MOST_OBSTACLES)]
    TooManyObstacles(usize),
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
        let Floor { white, tape } = self.floor;
        if self.floor.contrast() < LEAST_CONTRAST {
            return Err(WarehouseError::Contrast { white, tape });
        }
        self.exit.validate()?;
        self.validate_products()?;
        if !self.products.is_empty() && self.side_length_cm < LEAST_SIDE_WITH_GOODS_CM {
            return Err(WarehouseError::NoRoomForGoods(self.side_length_cm));
        }
        if !self.obstacles.is_empty() {
            self.has_room_for_things()?;
        }
        if self.obstacles.len() > MOST_OBSTACLES {
            return Err(WarehouseError::TooManyObstacles(self.obstacles.len()));
        }
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

    /// Whether things may come and go on the ways.
    ///
    /// # Errors
    /// The ways are too short for a robot to turn beside a thing.
    pub fn has_room_for_things(&self) -> Result<(), WarehouseError> {
        room_for_things(self.side_length_cm)
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
}

/// Whether things may stand in the middle of ways of this length in cm.
pub(crate) fn room_for_things(side_cm: u16) -> Result<(), WarehouseError> {
    match side_cm < LEAST_SIDE_WITH_THINGS_CM {
        true => Err(WarehouseError::NoRoomForThings(side_cm)),
        false => Ok(()),
    }
}

impl Exit {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warehouse::{Curve, Obstacle, Side};

    fn error(change: impl FnOnce(&mut Warehouse)) -> WarehouseError {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        change(&mut warehouse);
        warehouse.validate().expect_err("this must not be built")
    }

    fn product(id: i32, square: [u8; 2], side: Side) -> Product {
        Product {
            id,
            name: None,
            square,
            side,
        }
    }

    #[test]
    fn what_cannot_be_built_is_refused_with_a_sentence() {
        let thing = Obstacle {
            between: [[0, 0], [1, 0]],
        };
        let cases: [(WarehouseError, &str); 15] = [
            (error(|w| w.size = [0, 2]), "size is 0 x 2"),
            (error(|w| w.size = [2, 100]), "size is 2 x 100"),
            (error(|w| w.side_length_cm = 39), "side must be from 40"),
            (
                error(|w| w.side_length_cm = 44),
                "where goods stand it must be 45 cm or more",
            ),
            (
                error(|w| (w.side_length_cm, w.obstacles) = (49, vec![thing])),
                "where things stand on the ways it must be 50 cm or more",
            ),
            (error(|w| w.delivery = [1, 0]), "corner of the warehouse"),
            (error(|w| w.floor.tape = 50), "floor reads 45"),
            (error(|w| w.exit.radius_cm = 24), "from 25 to 200 cm"),
            (
                error(|w| w.exit.curve = Curve::Left),
                "with this curve it must be from 88",
            ),
            (error(|w| w.products[1].id = 1), "product 1 is listed twice"),
            (
                error(|w| w.products = vec![w.products[0].clone(); 257]),
                "there are 257 products; at most 256 fit",
            ),
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
}
