//! The warehouses that come with the robot, from small to large.
//!
//! Product 1 of `small` is near; `curved` and `large` have exits that bend, one at the tightest
//! radius there is.

use crate::warehouse::{Curve, Exit, Floor, Product, Side, Warehouse};

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
            floor: Floor::default(),
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
            floor: Floor::default(),
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
            floor: Floor::default(),
            obstacles: Vec::new(),
        }
    }
}

fn product(id: i32, square: [u8; 2], side: Side) -> Product {
    Product {
        id,
        name: None,
        square,
        side,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_warehouses_can_be_built() {
        for name in Warehouse::BUILTIN {
            let warehouse = Warehouse::builtin(name).expect("listed");
            assert_eq!(warehouse.validate(), Ok(()), "{name}");
            assert!(warehouse.map_products().any(|(id, ..)| id == 1));
        }
        assert!(Warehouse::builtin("huge").is_none());
    }
}
