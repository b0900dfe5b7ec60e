//! The tape on the floor: tells whether a point is on tape, and how much of a spot tape covers.
//!
//! All results are signed distances in mm: negative on the tape, positive beside it. The grid is
//! calculated and not searched (the nearest grid line, and the four marks of the square at hand),
//! so a test costs the same in any warehouse. The line sensor asks eleven times every 5 ms; it
//! first finds the tape that is [`Near`] any of its spots, and then looks at no other.
//!
//! ```text
//!   +-----+-----+   crossings at the border have only the ways that exist,
//!   |  |  |     |   a corner has two
//!   |  mark     |   mark: 170 mm from the middle of an edge into a square (E5)
//!   +--+--+-----+
//!   |
//!  -+-- bar: 300 mm across the end of the exit line (E4)
//! ```

use lager_floor::Heading;

use crate::body::Pose;
pub use crate::exit::{BAR, WIDTH};
use crate::exit::{FAR, HALF, Piece, exit};
use crate::scene::side_mm;
use crate::warehouse::Warehouse;

/// Length of a station's mark in mm, from the middle of the edge's tape (E5).
pub const MARK: f64 = 170.0;
/// Goods that lie within this distance of the middle of the bar, in mm, count as delivered.
pub const DELIVERY_RADIUS: f64 = 400.0;

/// A robot farther from the exit line than this, in mm, does not follow it: its sensors have lost
/// it.
const BESIDE: f64 = 75.0;

/// The tape that may be near a place; [`Tape::near`] finds it.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    grid: bool,
    mark: bool,
    /// The pieces of the exit line, a bit for each.
    exit: u8,
}

/// All tape of a warehouse.
#[derive(Clone, Debug)]
pub struct Tape {
    side: f64,
    columns: usize,
    rows: usize,
    /// For each square, row by row from below: the sides with a mark, as bits `Side as u8`.
    marks: Vec<u8>,
    exit: Vec<Piece>,
    /// The corners of a box around `exit`, in mm.
    exit_low: [f64; 2],
    exit_high: [f64; 2],
    bar: Pose,
}

impl Tape {
    /// Lays the tape of a valid warehouse.
    pub fn new(warehouse: &Warehouse) -> Self {
        let (columns, rows) = (usize::from(warehouse.size.x), usize::from(warehouse.size.y));
        let mut marks = vec![0; columns * rows];
        for product in &warehouse.products {
            let (x, y) = (usize::from(product.square.x), usize::from(product.square.y));
            marks[y * columns + x] |= 1 << product.side as u8;
        }
        let (exit, bar) = exit(warehouse);
        let mut low = [f64::MAX; 2];
        let mut high = [f64::MIN; 2];
        for (x, y) in exit.iter().flat_map(Piece::outline) {
            low = [low[0].min(x - BAR), low[1].min(y - BAR)];
            high = [high[0].max(x + BAR), high[1].max(y + BAR)];
        }
        Self {
            side: side_mm(warehouse),
            columns,
            rows,
            marks,
            exit,
            exit_low: low,
            exit_high: high,
            bar,
        }
    }

    /// Middle of the delivery bar, with the heading in which the exit line reaches it.
    pub fn bar(&self) -> Pose {
        self.bar
    }

    /// Whether goods count as delivered at this point.
    pub fn is_delivered(&self, x: f64, y: f64) -> bool {
        (x - self.bar.x).hypot(y - self.bar.y) <= DELIVERY_RADIUS
    }

    /// The part of a round spot that is on tape, 0 to 1. It is exact to a few percent if the spot
    /// is smaller than the tape and no corner is close. It looks only at the tape in `near`.
    pub fn coverage(&self, near: Near, x: f64, y: f64, spot_radius: f64) -> f64 {
        (0.5 - self.distance_to(near, x, y) / (2.0 * spot_radius)).clamp(0.0, 1.0)
    }

    /// Distance to the nearest edge of the tape in mm, negative on the tape. From a few cm on it is
    /// not exact, only large.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        self.distance_to(self.near(x, y, BAR), x, y)
    }

    /// The tape that may be within `reach` mm of a point.
    pub fn near(&self, x: f64, y: f64, reach: f64) -> Near {
        let is_over = |low: f64, value: f64, high: f64| low < value && value < high;
        let is_by_exit = is_over(self.exit_low[0], x, self.exit_high[0])
            && is_over(self.exit_low[1], y, self.exit_high[1]);
        let mut exit = 0;
        if is_by_exit {
            for (index, piece) in self.exit.iter().enumerate() {
                exit |= u8::from(piece.at_least(x, y) <= reach) << index;
            }
        }
        Near {
            grid: self.grid(x, y) <= reach,
            mark: self.is_mark_near(x, y, reach),
            exit,
        }
    }

    fn distance_to(&self, near: Near, x: f64, y: f64) -> f64 {
        let mut distance = FAR;
        if near.grid {
            distance = self.grid(x, y);
        }
        if near.mark {
            distance = distance.min(self.mark(x, y));
        }
        let mut exit = near.exit;
        while exit != 0 {
            let piece = &self.exit[exit.trailing_zeros() as usize];
            distance = distance.min(piece.distance(x, y));
            exit &= exit - 1;
        }
        distance
    }

    /// Two corners, in mm, of a box that contains all tape.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let (width, height) = self.grid_size();
        // The exit's box has a margin of a bar's length.
        let [low, high] = [self.exit_low, self.exit_high];
        [
            [(low[0] + BAR).min(0.0), (low[1] + BAR).min(0.0)],
            [(high[0] - BAR).max(width), (high[1] - BAR).max(height)],
        ]
    }

    /// Distance in mm from a point to the middle of the line that a robot with this heading
    /// follows; `None` if there is no line along the heading. Each line is longer here than its
    /// tape, so that a robot that has passed its end is still beside it.
    pub fn beside(&self, x: f64, y: f64, heading: f64) -> Option<f64> {
        let (width, height) = self.grid_size();
        let slack = self.side / 2.0;
        let within = |value: f64, end: f64| value > -slack && value < end + slack;
        if within(x, width) && within(y, height) && !self.is_over_exit(x) {
            let (sin, cos) = heading.sin_cos();
            let off = |value: f64, most: usize| {
                let line = (value / self.side).round().clamp(0.0, most as f64);
                (value - line * self.side).abs()
            };
            return if cos.abs() > 0.9 {
                Some(off(y, self.rows))
            } else if sin.abs() > 0.9 {
                Some(off(x, self.columns))
            } else {
                None
            };
        }
        // The last piece is the bar.
        let (_, line) = self.exit.split_last()?;
        line.iter()
            .filter_map(|piece| piece.beside(x, y, heading))
            .min_by(f64::total_cmp)
            // Farther away the robot is beside another line, or none.
            .filter(|off| *off < BESIDE)
    }

    /// Whether a point is outside the grid on the side of the exit.
    fn is_over_exit(&self, x: f64) -> bool {
        match self.bar.x < 0.0 {
            true => x < -HALF,
            false => x > self.grid_size().0 + HALF,
        }
    }

    fn grid_size(&self) -> (f64, f64) {
        (
            self.columns as f64 * self.side,
            self.rows as f64 * self.side,
        )
    }

    fn grid(&self, x: f64, y: f64) -> f64 {
        let (width, height) = self.grid_size();
        // Truncating is quicker than rounding.
        let nearest = |value: f64, most: usize| {
            ((value / self.side + 0.5).max(0.0) as usize).min(most) as f64 * self.side
        };
        let beside = |value: f64, end: f64| (-value).max(value - end) - HALF;
        let upright = ((x - nearest(x, self.columns)).abs() - HALF).max(beside(y, height));
        let level = ((y - nearest(y, self.rows)).abs() - HALF).max(beside(x, width));
        upright.min(level)
    }

    /// The index of the nearest column or row of squares to `value`; there are `count`.
    fn square(&self, value: f64, count: usize) -> usize {
        // The conversion gives 0 for negative values.
        ((value / self.side) as usize).min(count - 1)
    }

    fn mark(&self, x: f64, y: f64) -> f64 {
        let (column, row) = (self.square(x, self.columns), self.square(y, self.rows));
        self.mark_of(column, row, x, y)
    }

    fn is_mark_near(&self, x: f64, y: f64, reach: f64) -> bool {
        let squares = |value: f64, count: usize| {
            self.square(value - reach, count)..=self.square(value + reach, count)
        };
        squares(y, self.rows).any(|row| {
            squares(x, self.columns).any(|column| self.mark_of(column, row, x, y) <= reach)
        })
    }

    /// Distance from a point to the nearest mark in a square.
    fn mark_of(&self, column: usize, row: usize, x: f64, y: f64) -> f64 {
        let marks = self.marks[row * self.columns + column];
        if marks == 0 {
            return FAR;
        }
        let (u, v) = (x - column as f64 * self.side, y - row as f64 * self.side);
        let half = self.side / 2.0;
        let mut distance = FAR;
        for side in Heading::ALL {
            if marks & 1 << side as u8 != 0 {
                let (depth, across) = match side {
                    Heading::Left => (u, v - half),
                    Heading::Up => (self.side - v, u - half),
                    Heading::Right => (self.side - u, v - half),
                    Heading::Down => (v, u - half),
                };
                let along = (-depth).max(depth - MARK);
                distance = distance.min((across.abs() - HALF).max(along));
            }
        }
        distance
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use lager_floor::Node;

    use super::*;
    use crate::warehouse::NamedProduct;

    fn small() -> Tape {
        Tape::new(&Warehouse::builtin("small").unwrap())
    }

    #[test]
    fn the_grid_is_where_its_lines_are() {
        let tape = small();
        for (x, y, distance) in [
            (250.0, 0.0, -7.5),
            (250.0, 7.5, 0.0),
            (250.0, -20.0, 12.5),
            (500.0, 250.0, -7.5),
            (490.0, 250.0, 2.5),
            (1000.0, 1000.0, -7.5),
            (1020.0, 1000.0, 12.5),
            (1020.0, 1020.0, 12.5),
        ] {
            assert!(
                (tape.distance(x, y) - distance).abs() < 1e-9,
                "{x} {y}: {}",
                tape.distance(x, y)
            );
        }
        assert!(tape.distance(250.0, 250.0) > 50.0);
    }

    #[test]
    fn a_mark_points_into_its_square_only() {
        let tape = small();
        // Product 1: square (1, 0), side down, so the mark runs up from (750, 0).
        assert!(tape.distance(750.0, 100.0) < -7.0);
        assert!(tape.distance(750.0, 169.0) < 0.0);
        assert!(tape.distance(750.0, 171.0) > 0.0);
        assert!(tape.distance(760.0, 100.0) > 0.0);
        assert!(tape.distance(750.0, -20.0) > 0.0);
        // Product 3: square (1, 1), side left, so the mark runs right from (500, 750).
        assert!(tape.distance(600.0, 750.0) < -7.0);
        assert!(tape.distance(400.0, 750.0) > 50.0);
    }

    #[test]
    fn what_is_not_near_a_place_covers_no_spot_around_it() {
        let mut noise = crate::noise::Noise::new(1, 1);
        for name in ["small", "curved", "large"] {
            let tape = Tape::new(&Warehouse::builtin(name).unwrap());
            let [low, high] = tape.extent();
            let mut covered = 0;
            for _ in 0..20_000 {
                let [x, y] = [0, 1].map(|axis| {
                    let middle = (low[axis] + high[axis]) / 2.0;
                    middle + noise.spread(high[axis] - middle + 50.0)
                });
                let near = tape.near(x, y, 37.5);
                let (dx, dy) = noise.spread(PI).sin_cos();
                let (x, y) = (x + 35.0 * dx, y + 35.0 * dy);
                let everything = tape.near(x, y, 1.0e5);
                let seen = tape.coverage(near, x, y, 2.5);
                assert_eq!(seen, tape.coverage(everything, x, y, 2.5), "{name} {x} {y}");
                covered += u32::from(seen > 0.0);
            }
            assert!(covered > 200, "{covered}");
        }
    }

    #[test]
    fn a_spot_on_the_tapes_edge_is_half_covered() {
        let tape = small();
        let covered = |x, y, radius| tape.coverage(tape.near(x, y, radius), x, y, radius);
        assert_eq!(covered(250.0, 0.0, 2.0), 1.0);
        assert_eq!(covered(250.0, 7.5, 2.0), 0.5);
        assert_eq!(covered(250.0, 20.0, 2.0), 0.0);
    }

    #[test]
    fn a_straight_exit_ends_at_its_bar() {
        let tape = small();
        let bar = tape.bar();
        assert!((bar.x + 800.0).abs() < 1e-6 && bar.y.abs() < 1e-6);
        assert!(tape.distance(-400.0, 0.0) < -7.0);
        assert!(tape.distance(-800.0, 149.0) < 0.0 && tape.distance(-800.0, -149.0) < 0.0);
        assert!(tape.distance(-800.0, 151.0) > 0.0);
        assert!(tape.distance(-809.0, 0.0) > 0.0, "the line ends at the bar");
        assert!(tape.is_delivered(-1000.0, 100.0) && !tape.is_delivered(0.0, 0.0));
    }

    #[test]
    fn every_side_of_a_square_has_its_mark() {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        for (side, x, y) in [
            (Heading::Left, 100.0, 250.0),
            (Heading::Up, 250.0, 400.0),
            (Heading::Right, 400.0, 250.0),
            (Heading::Down, 250.0, 100.0),
        ] {
            warehouse.products = vec![NamedProduct {
                id: 1,
                name: None,
                square: Node::new(0, 0),
                side,
            }];
            let tape = Tape::new(&warehouse);
            assert!(tape.distance(x, y) < -7.0, "{side:?}");
        }
    }

    #[test]
    fn a_robot_is_beside_the_line_that_it_follows() {
        let tape = small();
        let beside = |x, y, heading| tape.beside(x, y, heading).map(f64::round);
        assert_eq!(beside(250.0, 12.0, 0.0), Some(12.0));
        // On a crossing, the line across does not count.
        assert_eq!(beside(500.0, 20.0, PI), Some(20.0));
        assert_eq!(beside(490.0, 250.0, -PI / 2.0), Some(10.0));
        // The sensors have run over the end of a line.
        assert_eq!(beside(1_120.0, 507.0, 0.0), Some(7.0));
        assert_eq!(beside(250.0, 0.0, PI / 4.0), None);
        assert_eq!(beside(-400.0, 9.0, PI), Some(9.0));
        assert_eq!(beside(-950.0, 9.0, PI), None);
        assert_eq!(beside(-100.0, 507.0, PI), None);
        // They run over the corner from which the exit leads away across.
        assert_eq!(beside(-9.0, -70.0, -PI / 2.0), None);
        // The exit's strip overlaps its bar by 5 mm.
        let corners = tape.extent().map(|corner| corner.map(f64::round));
        assert_eq!(corners, [[-805.0, -150.0], [1_000.0, 1_000.0]]);
    }
}
