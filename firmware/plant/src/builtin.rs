//! The built-in warehouses, from small to large.
//!
//! In `small`, product 1 is near. The exits of `curved` and `large` bend, that of `large` at the
//! smallest allowed radius.

use lager_floor::{Heading, Node};

use crate::warehouse::{Curve, Exit, Floor, NamedProduct, Warehouse};

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
            size: Node::new(2, 2),
            side_length_cm: 50,
            delivery: Node::new(0, 0),
            exit: Exit::default(),
            products: vec![
                product(1, Node::new(1, 0), Heading::Down),
                product(2, Node::new(0, 1), Heading::Up),
                product(3, Node::new(1, 1), Heading::Left),
            ],
            floor: Floor::default(),
            obstacles: Vec::new(),
        }
    }

    fn curved() -> Self {
        Self {
            size: Node::new(3, 2),
            side_length_cm: 60,
            delivery: Node::new(3, 0),
            exit: Exit {
                length_cm: 130,
                curve: Curve::S,
                radius_cm: 40,
            },
            products: vec![
                product(1, Node::new(1, 0), Heading::Up),
                product(2, Node::new(0, 1), Heading::Left),
                product(3, Node::new(2, 1), Heading::Right),
                product(4, Node::new(2, 0), Heading::Left),
            ],
            floor: Floor::default(),
            obstacles: Vec::new(),
        }
    }

    fn large() -> Self {
        Self {
            size: Node::new(5, 4),
            side_length_cm: 50,
            delivery: Node::new(0, 4),
            exit: Exit {
                length_cm: 110,
                curve: Curve::Right,
                radius_cm: 25,
            },
            products: vec![
                product(1, Node::new(2, 2), Heading::Down),
                product(2, Node::new(4, 0), Heading::Right),
                product(3, Node::new(0, 0), Heading::Down),
                product(4, Node::new(4, 3), Heading::Up),
                product(5, Node::new(1, 1), Heading::Left),
                product(6, Node::new(3, 1), Heading::Up),
            ],
            floor: Floor::default(),
            obstacles: Vec::new(),
        }
    }
}

fn product(id: i32, square: Node, side: Heading) -> NamedProduct {
    NamedProduct {
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
            assert!(warehouse.products.iter().any(|product| product.id == 1));
        }
        assert!(Warehouse::builtin("huge").is_none());
    }
}
