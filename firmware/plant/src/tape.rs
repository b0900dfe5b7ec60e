//! The tape on the floor: is there tape at this point, and how much of a small spot does it cover?
//!
//! Everything is a signed distance: negative on the tape, positive beside it, in mm. The grid is
//! computed, not searched (the nearest grid line and the four marks of the square at hand), so a
//! test costs the same in any warehouse; the line sensor asks eleven times every 5 ms.
//!
//! ```text
//!   +-----+-----+   crossings at the border have only the ways that exist,
//!   |  |  |     |   a corner has two
//!   |  mark     |   mark: 170 mm from the middle of an edge into a square (E5)
//!   +--+--+-----+
//!   |
//!  -+-- bar: 300 mm across the end of the exit line (E4)
//! ```

use crate::body::Pose;
use crate::exit::{Piece, exit};
use crate::scene::side_mm;
use crate::warehouse::{Side, Warehouse};

/// Width of the tape in mm (E1).
pub const WIDTH: f64 = 15.0;
/// Length of a station's mark in mm, from the middle of the edge's tape (E5).
pub const MARK: f64 = 170.0;
/// Length of the delivery bar in mm (E4).
pub const BAR: f64 = 300.0;
/// Goods that lie within this distance of the middle of the bar, in mm, count as delivered.
pub const DELIVERY_RADIUS: f64 = 400.0;

/// Half the width of the tape.
pub(crate) const HALF: f64 = WIDTH / 2.0;
/// Farther away than any spot is wide.
pub(crate) const FAR: f64 = 1.0e6;

/// All tape of a warehouse.
#[derive(Clone, Debug)]
pub struct Tape {
    side: f64,
    columns: usize,
    rows: usize,
    /// For each square, row by row from below: which of its sides have a mark, bit `Side as u8`.
    marks: Vec<u8>,
    exit: Vec<Piece>,
    /// Around all of `exit`, in mm.
    exit_low: [f64; 2],
    exit_high: [f64; 2],
    bar: Pose,
}

impl Tape {
    /// Lays the tape of a valid warehouse.
    pub fn new(warehouse: &Warehouse) -> Self {
        let (columns, rows) = (
            usize::from(warehouse.size[0]),
            usize::from(warehouse.size[1]),
        );
        let mut marks = vec![0; columns * rows];
        for product in &warehouse.products {
            let [x, y] = product.square.map(usize::from);
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

    /// Whether goods that lie here count as delivered.
    pub fn is_delivered(&self, x: f64, y: f64) -> bool {
        (x - self.bar.x).hypot(y - self.bar.y) <= DELIVERY_RADIUS
    }

    /// The part of a round spot, 0 to 1, that is on tape; exact to a few percent where the spot
    /// is smaller than the tape and no corner is near.
    pub fn coverage(&self, x: f64, y: f64, spot_radius: f64) -> f64 {
        (0.5 - self.distance(x, y) / (2.0 * spot_radius)).clamp(0.0, 1.0)
    }

    /// Distance to the nearest edge of the tape in mm: negative on the tape. Beyond a few cm it
    /// only says that it is far.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        let mut distance = self.grid(x, y).min(self.mark(x, y));
        if x > self.exit_low[0]
            && x < self.exit_high[0]
            && y > self.exit_low[1]
            && y < self.exit_high[1]
        {
            for piece in &self.exit {
                distance = distance.min(piece.distance(x, y));
            }
        }
        distance
    }

    fn grid(&self, x: f64, y: f64) -> f64 {
        let (width, height) = (
            self.columns as f64 * self.side,
            self.rows as f64 * self.side,
        );
        let nearest = |value: f64, most: usize| {
            (value / self.side).round().clamp(0.0, most as f64) * self.side
        };
        let beside = |value: f64, end: f64| (-value).max(value - end) - HALF;
        let upright = ((x - nearest(x, self.columns)).abs() - HALF).max(beside(y, height));
        let level = ((y - nearest(y, self.rows)).abs() - HALF).max(beside(x, width));
        upright.min(level)
    }

    fn mark(&self, x: f64, y: f64) -> f64 {
        let square = |value: f64, count: usize| {
            ((value / self.side).floor().max(0.0) as usize).min(count - 1)
        };
        let (column, row) = (square(x, self.columns), square(y, self.rows));
        let marks = self.marks[row * self.columns + column];
        if marks == 0 {
            return FAR;
        }
        let (u, v) = (x - column as f64 * self.side, y - row as f64 * self.side);
        let half = self.side / 2.0;
        let mut distance = FAR;
        for side in Side::ALL {
            if marks & 1 << side as u8 != 0 {
                let (depth, across) = match side {
                    Side::Left => (u, v - half),
                    Side::Up => (self.side - v, u - half),
                    Side::Right => (self.side - u, v - half),
                    Side::Down => (v, u - half),
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
    use super::*;
    use crate::warehouse::Product;

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
    fn a_spot_on_the_tapes_edge_is_half_covered() {
        let tape = small();
        assert_eq!(tape.coverage(250.0, 0.0, 2.0), 1.0);
        assert_eq!(tape.coverage(250.0, 7.5, 2.0), 0.5);
        assert_eq!(tape.coverage(250.0, 20.0, 2.0), 0.0);
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
            (Side::Left, 100.0, 250.0),
            (Side::Up, 250.0, 400.0),
            (Side::Right, 400.0, 250.0),
            (Side::Down, 250.0, 100.0),
        ] {
            warehouse.products = vec![Product {
                id: 1,
                square: [0, 0],
                side,
            }];
            let tape = Tape::new(&warehouse);
            assert!(tape.distance(x, y) < -7.0, "{side:?}");
        }
    }
}
