//! The goods: on a shelf, in the claw, on the floor, delivered (E7).
//!
//! ```text
//!             claw closes around it
//!   Shelf --------------------------> Held ----- claw opens -----> Lying, Delivered near the bar
//!     ^                                | ^                           |
//!     '-- claw opens over its shelf ---' '--- claw closes around it -'
//! ```
//! Goods are cubes that do not touch each other; the claw takes at most one.

use crate::arm::Claw;
use crate::body::Pose;
use crate::scene::stand_3d;
use crate::tape::Tape;
use crate::warehouse::Warehouse;

/// Side of a piece of goods in mm.
pub const SIDE: f64 = 50.0;
/// Height of the middle of goods on a shelf, in mm.
pub const SHELF_HEIGHT: f64 = 60.0;
/// Height of the middle of goods on the floor, in mm.
pub const FLOOR_HEIGHT: f64 = SIDE / 2.0;
/// How far the claw's middle may be from the goods' to take them, in mm along the floor.
pub const REACH: f64 = 40.0;
/// How far the claw's middle may be above or below the goods' to take them, in mm.
pub const REACH_UP: f64 = 30.0;
/// How much wider than the goods the claw must open to let go, in mm.
const PLAY: f64 = 4.0;

/// Where a piece of goods is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoodState {
    /// On its shelf.
    Shelf,
    /// In the claw.
    Held,
    /// On the floor.
    Lying,
    /// On the floor near the delivery bar.
    Delivered,
}

/// One piece of goods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Good {
    /// The product's number.
    pub id: i32,
    /// Its middle: x, y and height in mm.
    pub position: [f64; 3],
    /// Where it is.
    pub state: GoodState,
}

/// All goods of a warehouse.
#[derive(Clone, Debug)]
pub struct Goods {
    list: Vec<Good>,
    stands: Vec<[f64; 3]>,
    held: Option<usize>,
    last_gap: f64,
    changes: u64,
}

impl Goods {
    /// Every product's goods on its shelf.
    pub fn new(warehouse: &Warehouse) -> Self {
        let side = crate::scene::side_mm(warehouse);
        let stands: Vec<_> = warehouse
            .products
            .iter()
            .map(|product| stand_3d(product, side))
            .collect();
        let list = warehouse
            .products
            .iter()
            .zip(&stands)
            .map(|(product, position)| Good {
                id: product.id,
                position: *position,
                state: GoodState::Shelf,
            })
            .collect();
        Self {
            list,
            stands,
            held: None,
            last_gap: 0.0,
            changes: 0,
        }
    }

    /// The goods, in the order of the warehouse's products.
    pub fn list(&self) -> &[Good] {
        &self.list
    }

    /// The product in the claw.
    pub fn held(&self) -> Option<i32> {
        self.held.map(|index| self.list[index].id)
    }

    /// Counts the changes of any state; who publishes the goods looks here.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Takes up the goods of a kept world: those whose number is known here.
    pub fn restore(&mut self, kept: &[Good]) {
        for good in kept {
            if let Some(mine) = self.list.iter_mut().find(|mine| mine.id == good.id) {
                *mine = *good;
            }
        }
        self.held = self
            .list
            .iter()
            .position(|good| good.state == GoodState::Held);
        self.changes += 1;
    }

    /// How narrow the jaws can get now, in mm.
    pub fn narrowest(&self) -> f64 {
        if self.held.is_some() { SIDE } else { 0.0 }
    }

    /// Lets the claw act on the goods.
    pub fn step(&mut self, pose: &Pose, claw: &Claw, tape: &Tape) {
        let (x, y) = pose.point(claw.ahead, claw.left);
        let at = [x, y, claw.up];
        match self.held {
            Some(index) if claw.gap > SIDE + PLAY => self.release(index, at, tape),
            Some(index) => self.list[index].position = at,
            None if claw.gap <= SIDE && self.last_gap > SIDE => self.take(at),
            None => {}
        }
        self.last_gap = claw.gap;
    }

    fn take(&mut self, at: [f64; 3]) {
        let aside = |good: &Good| (good.position[0] - at[0]).hypot(good.position[1] - at[1]);
        let nearest = self
            .list
            .iter()
            .enumerate()
            .filter(|(_, good)| {
                aside(good) <= REACH && (good.position[2] - at[2]).abs() <= REACH_UP
            })
            .min_by(|(_, a), (_, b)| aside(a).total_cmp(&aside(b)));
        if let Some((index, _)) = nearest {
            self.list[index].state = GoodState::Held;
            self.list[index].position = at;
            self.held = Some(index);
            self.changes += 1;
        }
    }

    fn release(&mut self, index: usize, at: [f64; 3], tape: &Tape) {
        let stand = self.stands[index];
        let over_stand =
            (stand[0] - at[0]).hypot(stand[1] - at[1]) <= REACH && at[2] > stand[2] - REACH_UP;
        let good = &mut self.list[index];
        (good.position, good.state) = if over_stand {
            (stand, GoodState::Shelf)
        } else if tape.is_delivered(at[0], at[1]) {
            ([at[0], at[1], FLOOR_HEIGHT], GoodState::Delivered)
        } else {
            ([at[0], at[1], FLOOR_HEIGHT], GoodState::Lying)
        };
        self.held = None;
        self.changes += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Bench {
        goods: Goods,
        tape: Tape,
        bar: Pose,
    }

    impl Bench {
        fn new() -> Self {
            let warehouse = Warehouse::builtin("small").unwrap();
            let tape = Tape::new(&warehouse);
            Self {
                goods: Goods::new(&warehouse),
                bar: tape.bar(),
                tape,
            }
        }

        fn claw(&mut self, x: f64, y: f64, up: f64, gap: f64) {
            let pose = Pose { x, y, heading: 0.0 };
            let claw = Claw {
                ahead: 0.0,
                left: 0.0,
                up,
                gap,
            };
            self.goods.step(&pose, &claw, &self.tape);
        }

        fn state(&self) -> GoodState {
            self.goods.list()[0].state
        }
    }

    // Product 1 stands at (750, 250).
    #[test]
    fn a_closing_claw_takes_what_is_within_reach() {
        let mut bench = Bench::new();
        bench.claw(770.0, 260.0, 70.0, 80.0);
        bench.claw(770.0, 260.0, 70.0, 50.0);
        assert_eq!(bench.goods.held(), Some(1));
        assert_eq!(bench.goods.narrowest(), SIDE);
        bench.claw(300.0, 300.0, 200.0, 50.0);
        assert_eq!(bench.goods.list()[0].position, [300.0, 300.0, 200.0]);
    }

    #[test]
    fn a_claw_beside_above_or_already_closed_takes_nothing() {
        for (x, up, first_gap) in [
            (800.0, 60.0, 80.0),
            (750.0, 100.0, 80.0),
            (750.0, 60.0, 40.0),
        ] {
            let mut bench = Bench::new();
            bench.claw(x, 250.0, up, first_gap);
            bench.claw(x, 250.0, up, 30.0);
            assert_eq!(bench.goods.held(), None, "{x} {up} {first_gap}");
        }
    }

    #[test]
    fn goods_let_go_lie_where_they_fall_and_count_at_the_bar() {
        let mut bench = Bench::new();
        let (x, y) = (bench.bar.x, bench.bar.y);
        for (at_x, at_y, state) in [
            (750.0, 240.0, GoodState::Shelf),
            (400.0, 100.0, GoodState::Lying),
            (x - 100.0, y + 50.0, GoodState::Delivered),
        ] {
            let from = bench.goods.list()[0].position;
            bench.claw(from[0], from[1], from[2], 80.0);
            bench.claw(from[0], from[1], from[2], 50.0);
            bench.claw(at_x, at_y, 60.0, 50.0);
            bench.claw(at_x, at_y, 60.0, 80.0);
            assert_eq!(bench.state(), state);
            assert_eq!(bench.goods.held(), None);
        }
        assert_eq!(bench.goods.changes(), 6);
    }

    #[test]
    fn kept_goods_are_taken_up() {
        let mut bench = Bench::new();
        bench.claw(750.0, 250.0, 60.0, 80.0);
        bench.claw(750.0, 250.0, 60.0, 50.0);
        let kept = bench.goods.list().to_vec();
        let mut fresh = Bench::new();
        fresh.goods.restore(&kept);
        assert_eq!(fresh.goods.list(), kept);
        assert_eq!(fresh.goods.held(), Some(1));
    }
}
