//! The goods: each piece is on a shelf, in the claw, on the floor or delivered (E7).
//!
//! ```text
//!             claw closes around it
//!   Shelf --------------------------> Held ----- claw opens -----> Lying, Delivered near the bar
//!     ^                                | ^                           |
//!     '-- claw opens over its shelf ---' '--- claw closes around it -'
//! ```
//! Goods are cubes that do not touch each other; the claw takes at most one. If the claw's middle
//! is more than 25 mm from theirs, it holds them by an edge, and they slip out after some seconds
//! as if it had opened. The seed decides how many.

use serde::{Deserialize, Serialize};

use crate::arm::Claw;
use crate::body::Pose;
use crate::make::Make;
use crate::noise::Noise;
use crate::scene::stand_3d;
use crate::tape::Tape;
use crate::warehouse::Warehouse;

/// Side of a piece of goods in mm.
pub const SIDE: f64 = 50.0;
/// Height of the middle of goods on the floor, in mm.
pub const FLOOR_HEIGHT: f64 = SIDE / 2.0;
/// Greatest distance from the claw's middle to goods that it can take, in mm along the floor.
pub const REACH: f64 = 40.0;
/// Greatest difference of their heights, in mm.
pub const REACH_UP: f64 = 30.0;
/// Greatest distance from the claw's middle to the goods' for a firm grip, in mm along the floor.
pub const FIRM: f64 = 25.0;
/// How long a bad grip holds, at least and at most, in s.
const SLIPS_AFTER: [f64; 2] = [1.0, 6.0];
/// The claw lets go when it opens this much wider than the goods, in mm.
const PLAY: f64 = 4.0;

/// The place of a piece of goods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Good {
    /// The product's number.
    pub id: i32,
    /// Its middle: x, y and height in mm.
    pub position: [f64; 3],
    /// The kind of place where it is.
    pub state: GoodState,
}

/// All goods of a warehouse.
#[derive(Clone, Debug)]
pub struct Goods {
    list: Vec<Good>,
    stands: Vec<[f64; 3]>,
    held: Option<usize>,
    /// How long the grip will hold, in s; infinite for a firm grip.
    grip: f64,
    /// How long a bad grip holds, in s.
    slips_after: f64,
    slips: u32,
    last_gap: f64,
    changes: u64,
}

impl Goods {
    /// All goods on their shelves; `noise` decides how long a bad grip holds.
    pub fn new(warehouse: &Warehouse, mut noise: Noise, make: Make) -> Self {
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
            grip: f64::INFINITY,
            slips_after: make.draw(&mut noise, 3.0, SLIPS_AFTER[0], SLIPS_AFTER[1]),
            slips: 0,
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

    /// Counts all changes of states, so that a publisher of the goods does not miss one.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// How often goods have slipped from the claw.
    pub fn slips(&self) -> u32 {
        self.slips
    }

    /// The goods, for the code that pushes them on the floor.
    pub(crate) fn list_mut(&mut self) -> &mut [Good] {
        &mut self.list
    }

    /// Goods on the floor were pushed: checks again which of them are delivered.
    pub(crate) fn pushed(&mut self, tape: &Tape) {
        for good in &mut self.list {
            if matches!(good.state, GoodState::Lying | GoodState::Delivered) {
                good.state = on_floor(tape, good.position[0], good.position[1]);
            }
        }
        self.changes += 1;
    }

    /// Takes over the goods of a kept world, if this warehouse has their number.
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

    /// The smallest gap of the jaws now, in mm.
    pub fn narrowest(&self) -> f64 {
        if self.held.is_some() { SIDE } else { 0.0 }
    }

    /// Lets the claw act on the goods for `seconds`.
    pub fn step(&mut self, seconds: f64, pose: &Pose, claw: &Claw, tape: &Tape) {
        let (x, y) = pose.point(claw.ahead, claw.left);
        let at = [x, y, claw.up];
        match self.held {
            Some(index) if claw.gap > SIDE + PLAY => self.release(index, at, tape),
            Some(index) => {
                self.list[index].position = at;
                self.grip -= seconds;
                if self.grip <= 0.0 {
                    self.slips += 1;
                    self.release(index, at, tape);
                }
            }
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
        if let Some((index, good)) = nearest {
            self.grip = match aside(good) <= FIRM {
                true => f64::INFINITY,
                false => self.slips_after,
            };
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
        } else {
            ([at[0], at[1], FLOOR_HEIGHT], on_floor(tape, at[0], at[1]))
        };
        self.held = None;
        self.changes += 1;
    }
}

fn on_floor(tape: &Tape, x: f64, y: f64) -> GoodState {
    match tape.is_delivered(x, y) {
        true => GoodState::Delivered,
        false => GoodState::Lying,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm;
    use crate::scene::{SHELF_HEIGHT, STAND};

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
                goods: Goods::new(&warehouse, Noise::new(1, 1), Make::Nominal),
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
            self.goods.step(0.001, &pose, &claw, &self.tape);
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
    fn goods_slip_out_of_a_bad_grip() {
        for (x, slips) in [(750.0 + FIRM - 1.0, 0), (750.0 + FIRM + 1.0, 1)] {
            let mut bench = Bench::new();
            bench.claw(x, 250.0, 60.0, 80.0);
            bench.claw(x, 250.0, 60.0, 50.0);
            assert_eq!(bench.goods.held(), Some(1));
            for _ in 0..3_001 {
                bench.claw(300.0, 300.0, 200.0, 50.0);
            }
            assert_eq!(bench.goods.slips(), slips);
            let left = if slips == 0 {
                GoodState::Held
            } else {
                GoodState::Lying
            };
            assert_eq!(bench.state(), left);
        }
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

    #[test]
    fn the_arm_reaches_goods_on_their_shelf_and_the_floor_at_the_bar() {
        // 250 mm ahead of the axle at the height of goods on a shelf, and a pose for dropping them.
        let pose = |shoulder: f64, elbow: f64| {
            let (up, low) = (512.0 + shoulder, 511.0 - shoulder);
            let (out, back) = (512.0 + elbow, 511.0 - elbow);
            arm::claw(&[512.0, up, low, out, back, 512.0, 512.0, 512.0])
        };
        let reach = pose(-201.0, -24.0);
        assert!((reach.ahead - STAND).abs() < 3.0, "{reach:?}");
        assert!((reach.up - SHELF_HEIGHT).abs() < 3.0, "{reach:?}");
        let low = pose(-212.0, 0.0);
        assert!(low.up < 70.0 && low.ahead > 200.0, "{low:?}");
    }
}
