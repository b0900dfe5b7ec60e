//! Checks that a warehouse can be built; each rule has an error whose sentence explains it.

use lager_floor::{Edge, Node, Product};
use lager_orders::Reason;
use thiserror::Error;

use crate::obstacles::MOST_OBSTACLES;
use crate::room::{LEAST_SIDE_WITH_GOODS_CM, LEAST_SIDE_WITH_THINGS_CM};
use crate::warehouse::{Exit, Floor, LEAST_CONTRAST, MAX_EXIT_CM, MIN_RADIUS_CM, Warehouse};

/// Why a warehouse cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WarehouseError {
    /// No floor of a robot, real or simulated, can be like that.
    #[error(transparent)]
    Floor(#[from] Reason),
    /// The squares are so small that the robot would touch the goods' shelves.
    #[error(
        "side_length_cm is {0}; where goods stand it must be {LEAST_SIDE_WITH_GOODS_CM} cm or more, or a robot that turns on the far side of their square touches their shelf"
    )]
    NoRoomForGoods(u16),
    /// The edges are so short that the robot would touch a thing on the next one.
    #[error(
        "side_length_cm is {0}; where things stand on the ways it must be {LEAST_SIDE_WITH_THINGS_CM} cm or more, or a robot that turns on a crossing touches the thing on the next way before it can see it"
    )]
    NoRoomForThings(u16),
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
    /// The exit line cannot have that length.
    #[error(
        "the exit's length_cm is {length}; with this curve it must be from {least} to {MAX_EXIT_CM} cm"
    )]
    ExitLength {
        /// As given.
        length: u16,
        /// The shortest possible length with this curve.
        least: u16,
    },
    /// Two stations on one edge (E17).
    #[error(
        "goods {first} and {second} have their stations on the same edge; at most one station fits between two crossings"
    )]
    SharedEdge {
        /// The one listed first.
        first: i32,
        /// The other one.
        second: i32,
    },
    /// Two pieces of goods overlap.
    #[error(
        "goods {first} and {second} would stand {gap_mm} mm apart in one square; goods need 100 mm from middle to middle, so give one of them another square"
    )]
    Crowded {
        /// The one listed first.
        first: i32,
        /// The other one.
        second: i32,
        /// Distance of their middles.
        gap_mm: u32,
    },
    /// There are more obstacles than may stand.
    #[error("{0} obstacles; at most {most} can stand in a warehouse", most = MOST_OBSTACLES)]
    TooManyObstacles(usize),
    /// An obstacle is not on an edge.
    #[error(
        "an obstacle stands between {} and {}, which are not neighbouring nodes of the warehouse", .between[0], .between[1]
    )]
    ObstacleOffEdge {
        /// As given.
        between: [Node; 2],
    },
}

impl Warehouse {
    /// Checks everything that the geometry relies on.
    ///
    /// # Errors
    /// The first rule that the warehouse breaks.
    pub fn validate(&self) -> Result<(), WarehouseError> {
        let (_, grid, products) = self.told()?;
        let Floor { white, tape } = self.floor;
        if self.floor.contrast() < LEAST_CONTRAST {
            return Err(WarehouseError::Contrast { white, tape });
        }
        self.exit.validate()?;
        self.validate_stations(&products)?;
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
            if Edge::between(a, b).is_none() || !grid.contains(a) || !grid.contains(b) {
                return Err(WarehouseError::ObstacleOffEdge {
                    between: obstacle.between,
                });
            }
        }
        Ok(())
    }

    /// Checks that there is room for things on the edges.
    ///
    /// # Errors
    /// The edges are too short for a robot to turn beside a thing.
    pub fn has_room_for_things(&self) -> Result<(), WarehouseError> {
        room_for_things(self.side_length_cm)
    }

    fn validate_stations(&self, products: &[Product]) -> Result<(), WarehouseError> {
        for (index, product) in products.iter().enumerate() {
            for other in &products[..index] {
                self.validate_pair(other, product)?;
            }
        }
        Ok(())
    }

    fn validate_pair(&self, one: &Product, other: &Product) -> Result<(), WarehouseError> {
        let (first, second) = (one.id.get(), other.id.get());
        if one.edge() == other.edge() {
            return Err(WarehouseError::SharedEdge { first, second });
        }
        if one.square == other.square {
            let side = crate::scene::side_mm(self);
            let (ax, ay) = crate::scene::stand(one.square, one.side, side);
            let (bx, by) = crate::scene::stand(other.square, other.side, side);
            let gap = (ax - bx).hypot(ay - by);
            if gap < 100.0 {
                return Err(WarehouseError::Crowded {
                    first,
                    second,
                    gap_mm: gap.round() as u32,
                });
            }
        }
        Ok(())
    }
}

/// Checks that things may stand in the middle of edges of this length in cm.
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
    use lager_floor::Heading;

    use crate::warehouse::{Curve, NamedProduct, Obstacle};

    fn error(change: impl FnOnce(&mut Warehouse)) -> WarehouseError {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        change(&mut warehouse);
        warehouse.validate().expect_err("this must not be built")
    }

    fn product(id: i32, square: Node, side: Heading) -> NamedProduct {
        NamedProduct {
            id,
            name: None,
            square,
            side,
        }
    }

    #[test]
    fn what_cannot_be_built_is_refused_with_a_sentence() {
        let thing = Obstacle {
            between: [Node::new(0, 0), Node::new(1, 0)],
        };
        let cases: [(WarehouseError, &str); 15] = [
            (error(|w| w.size = Node::new(0, 2)), "size is 0 x 2"),
            (error(|w| w.size = Node::new(2, 100)), "size is 2 x 100"),
            (error(|w| w.side_length_cm = 39), "must be from 40"),
            (
                error(|w| w.side_length_cm = 44),
                "where goods stand it must be 45 cm or more",
            ),
            (
                error(|w| (w.side_length_cm, w.obstacles) = (49, vec![thing])),
                "where things stand on the ways it must be 50 cm or more",
            ),
            (
                error(|w| w.delivery = Node::new(1, 0)),
                "no corner of the floor",
            ),
            (error(|w| w.floor.tape = 50), "floor reads 45"),
            (error(|w| w.exit.radius_cm = 24), "from 25 to 200 cm"),
            (
                error(|w| w.exit.curve = Curve::Left),
                "with this curve it must be from 88",
            ),
            (error(|w| w.products[1].id = 1), "goods 1 are listed twice"),
            (
                error(|w| w.products = vec![w.products[0].clone(); 257]),
                "the warehouse has 257 goods; at most 256 fit",
            ),
            (
                error(|w| w.products[0].square = Node::new(2, 0)),
                "the last one is (1, 1)",
            ),
            (
                error(|w| w.products[1] = product(2, Node::new(1, 1), Heading::Down)),
                "would stand 0 mm apart",
            ),
            (
                error(|w| {
                    w.products = vec![
                        product(1, Node::new(0, 0), Heading::Right),
                        product(2, Node::new(1, 0), Heading::Left),
                    ];
                }),
                "at most one station",
            ),
            (
                error(|w| {
                    w.obstacles.push(Obstacle {
                        between: [Node::new(0, 0), Node::new(1, 1)],
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
