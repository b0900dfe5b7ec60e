//! Contact of the robot's body: a shelf, an obstacle or a wall stops it, and it pushes goods that
//! lie on the floor in front of it.
//!
//! ```text
//!            .-----------------------.
//!            |     axle              | 90 mm
//!   -110 mm  |------+----------------|  170 mm: just ahead of the line sensors
//!            |                       |
//!            '-----------------------'
//! ```
//! A touch counts as one collision until the body has been free for half a second. The wheels of a
//! stopped robot go on turning and skid. The arm and the goods that it holds touch nothing. Goods
//! that the robot pushes pass through each other and through shelves.

use crate::body::Pose;
use crate::goods::{FLOOR_HEIGHT, Good, GoodState, SIDE};
use crate::scene::Block;

/// How far the body reaches ahead of the axle, in mm.
pub const FRONT: f64 = 170.0;
/// How far it reaches behind the axle, in mm.
pub const REAR: f64 = 110.0;
/// Half its width in mm.
pub const HALF_WIDTH: f64 = 90.0;

/// How long the body must be free before the next touch counts, in ns.
const APART_NS: u64 = 500_000_000;
/// More than half a diagonal of the body, in mm: a thing farther away cannot touch it.
const RADIUS: f64 = 200.0;

/// The last free pose, and the collisions so far.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    free: Pose,
    touched_ns: Option<u64>,
    collisions: u32,
}

impl Contact {
    pub(crate) fn new(pose: Pose) -> Self {
        Self {
            free: pose,
            touched_ns: None,
            collisions: 0,
        }
    }

    /// How often the body has hit something.
    pub(crate) fn collisions(&self) -> u32 {
        self.collisions
    }

    /// Sets the count, from a kept world.
    pub(crate) fn set_collisions(&mut self, collisions: u32) {
        self.collisions = collisions;
    }

    /// Somebody has put the robot here.
    pub(crate) fn place(&mut self, pose: Pose) {
        self.free = pose;
    }

    /// Returns the pose that the body reaches when it wants to reach `wanted`, and whether it
    /// pushed goods on the way.
    pub(crate) fn resolve(
        &mut self,
        wanted: Pose,
        blocks: &[Block],
        goods: &mut [Good],
        now_ns: u64,
    ) -> (Pose, bool) {
        // A robot that somebody put into a shelf can leave it.
        let held = blocks.iter().any(|block| {
            let depth = overlap(&wanted, block).map(depth);
            depth.is_some_and(|depth| {
                overlap(&self.free, block).is_none_or(|before| depth > self::depth(before))
            })
        });
        let pose = if held { self.free } else { wanted };
        let mut pushed = false;
        for good in goods.iter_mut() {
            if !matches!(good.state, GoodState::Lying | GoodState::Delivered) {
                continue;
            }
            let [x, y, _] = good.position;
            if let Some([dx, dy]) = overlap(&pose, &Block::around((x, y), SIDE, SIDE)) {
                good.position = [x + dx, y + dy, FLOOR_HEIGHT];
                pushed = true;
            }
        }
        if held || pushed {
            let apart = self
                .touched_ns
                .is_none_or(|touched| now_ns.saturating_sub(touched) > APART_NS);
            self.collisions += u32::from(apart);
            self.touched_ns = Some(now_ns);
        }
        self.free = pose;
        (pose, pushed)
    }
}

fn depth(way: [f64; 2]) -> f64 {
    way[0].hypot(way[1])
}

/// The shortest way by which a block would leave the body, if it is inside.
fn overlap(pose: &Pose, block: &Block) -> Option<[f64; 2]> {
    let half = [
        (block.high[0] - block.low[0]) / 2.0,
        (block.high[1] - block.low[1]) / 2.0,
    ];
    let (x, y) = (
        f64::midpoint(block.low[0], block.high[0]) - pose.x,
        f64::midpoint(block.low[1], block.high[1]) - pose.y,
    );
    if x.abs() > half[0] + RADIUS || y.abs() > half[1] + RADIUS {
        return None;
    }
    let (sin, cos) = pose.heading.sin_cos();
    let middle = (FRONT - REAR) / 2.0;
    let (long, wide) = ((FRONT + REAR) / 2.0, HALF_WIDTH);
    // The way from the middle of the body to the middle of the block.
    let (x, y) = (x - middle * cos, y - middle * sin);
    let mut least = None;
    let mut shortest = f64::MAX;
    for [nx, ny] in [[1.0, 0.0], [0.0, 1.0], [cos, sin], [-sin, cos]] {
        let body = long * (nx * cos + ny * sin).abs() + wide * (ny * cos - nx * sin).abs();
        let box_ = half[0] * nx.abs() + half[1] * ny.abs();
        let along = x * nx + y * ny;
        let inside = body + box_ - along.abs();
        if inside <= 0.0 {
            return None;
        }
        if inside < shortest {
            shortest = inside;
            least = Some([nx * inside.copysign(along), ny * inside.copysign(along)]);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, heading: f64) -> Pose {
        Pose { x, y, heading }
    }

    fn shelf() -> Block {
        Block::around((500.0, 0.0), 80.0, 80.0)
    }

    fn drive(
        contact: &mut Contact,
        goods: &mut [Good],
        blocks: &[Block],
        millimetres: usize,
    ) -> Pose {
        let mut pose = contact.free;
        for step in 0..millimetres {
            let wanted = Pose {
                x: pose.x + 1.0,
                ..pose
            };
            (pose, _) = contact.resolve(wanted, blocks, goods, step as u64 * 10_000_000);
        }
        pose
    }

    #[test]
    fn a_shelf_stops_the_body_and_counts_once() {
        let mut contact = Contact::new(at(200.0, 0.0, 0.0));
        let pose = drive(&mut contact, &mut [], &[shelf()], 400);
        assert_eq!(pose.x, 460.0 - FRONT);
        assert_eq!(contact.collisions(), 1);
        // The robot moves away and comes back.
        let away = at(200.0, 0.0, 0.0);
        contact.resolve(away, &[shelf()], &mut [], 20_000_000_000);
        drive(&mut contact, &mut [], &[shelf()], 0);
        let again = at(300.0, 0.0, 0.0);
        contact.resolve(again, &[shelf()], &mut [], 30_000_000_000);
        assert_eq!(contact.collisions(), 2);
    }

    #[test]
    fn a_corner_that_turns_into_a_shelf_touches_it() {
        let beside = Block::around((0.0, 230.0), 80.0, 80.0);
        let mut contact = Contact::new(Pose::default());
        let mut pose = Pose::default();
        for _ in 0..157 {
            let wanted = at(0.0, 0.0, pose.heading + 0.01);
            (pose, _) = contact.resolve(wanted, &[beside], &mut [], 0);
        }
        assert_eq!(contact.collisions(), 1);
        assert!(pose.heading < 1.4, "{}", pose.heading);
    }

    #[test]
    fn who_was_put_into_a_shelf_may_leave_it() {
        let mut contact = Contact::new(at(320.0, 0.0, 0.0));
        let back = at(319.0, 0.0, 0.0);
        let (pose, _) = contact.resolve(back, &[shelf()], &mut [], 0);
        assert_eq!(pose, back);
        let deeper = at(320.0, 0.0, 0.0);
        let (pose, _) = contact.resolve(deeper, &[shelf()], &mut [], 0);
        assert_eq!(pose, back);
    }

    #[test]
    fn goods_on_the_floor_are_pushed_and_others_are_not() {
        let good = |state| Good {
            id: 1,
            position: [400.0, 0.0, FLOOR_HEIGHT],
            state,
        };
        let mut goods = [good(GoodState::Lying), good(GoodState::Shelf)];
        let mut contact = Contact::new(at(100.0, 0.0, 0.0));
        let pose = drive(&mut contact, &mut goods, &[], 200);
        assert_eq!(pose.x, 300.0);
        assert!((goods[0].position[0] - (300.0 + FRONT + SIDE / 2.0)).abs() < 1e-6);
        assert_eq!(goods[1].position[0], 400.0);
        assert_eq!(contact.collisions(), 1);
    }
}
