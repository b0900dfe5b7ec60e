//! The tape of a warehouse: grid, station marks, the way out and its cross bar, with sharp edges.

use lager_floor::Heading;
use lager_topics::WarehouseMap;

/// Half the width of the tape, in mm.
const HALF_TAPE: f64 = 7.5;

/// A point in mm.
pub(crate) type Point = (f64, f64);

/// Tape on the floor.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    pub(crate) side: f64,
    columns: f64,
    rows: f64,
    /// The station marks, the way out and its cross bar.
    strips: Vec<(Point, Point)>,
    /// Middle of the cross bar.
    pub(crate) bar: Point,
}

/// The form of the way out.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Exit {
    /// Straight, with this length in mm.
    Straight(f64),
    /// Straight, then a quarter of a circle to the left, then straight; the radius is in mm.
    Curved(f64, f64),
}

impl Floor {
    pub(crate) fn new(map: &WarehouseMap, exit: Exit) -> Self {
        let side = f64::from(map.side_length_cm) * 10.0;
        let mut strips = Vec::new();
        for product in map.products() {
            let (x, y) = (f64::from(product.x) * side, f64::from(product.y) * side);
            let half = side / 2.0;
            strips.push(match product.side.get().unwrap() {
                Heading::Left => ((x, y + half), (x + 170.0, y + half)),
                Heading::Up => ((x + half, y + side), (x + half, y + side - 170.0)),
                Heading::Right => ((x + side, y + half), (x + side - 170.0, y + half)),
                Heading::Down => ((x + half, y), (x + half, y + 170.0)),
            });
        }
        let mut at = (
            f64::from(map.delivery_x) * side,
            f64::from(map.delivery_y) * side,
        );
        let mut angle: f64 = if map.delivery_x == 0 { 180.0 } else { 0.0 };
        let mut forward = |length: f64, angle: f64| {
            let to = (
                at.0 + length * angle.to_radians().cos(),
                at.1 + length * angle.to_radians().sin(),
            );
            strips.push((at, to));
            at = to;
        };
        match exit {
            Exit::Straight(length) => forward(length, angle),
            Exit::Curved(length, radius) => {
                forward(length, angle);
                for _ in 0..18 {
                    angle += 2.5;
                    forward(radius * 5f64.to_radians(), angle);
                    angle += 2.5;
                }
                forward(length, angle);
            }
        }
        let bar = at;
        let across = (angle + 90.0).to_radians();
        let end = |sign: f64| {
            (
                bar.0 + sign * 150.0 * across.cos(),
                bar.1 + sign * 150.0 * across.sin(),
            )
        };
        strips.push((end(1.0), end(-1.0)));
        Self {
            side,
            columns: f64::from(map.width),
            rows: f64::from(map.height),
            strips,
            bar,
        }
    }

    /// Whether there is tape at a point.
    pub(crate) fn is_tape(&self, (x, y): Point) -> bool {
        let near_line = |value: f64, count: f64| {
            let line = (value / self.side).round().clamp(0.0, count);
            (value - line * self.side).abs() <= HALF_TAPE
        };
        let within =
            |value: f64, count: f64| (-HALF_TAPE..=count * self.side + HALF_TAPE).contains(&value);
        let inside = within(x, self.columns) && within(y, self.rows);
        (inside && (near_line(x, self.columns) || near_line(y, self.rows)))
            || self.strips.iter().any(|strip| is_on(*strip, (x, y)))
    }
}

/// A thing on an edge: its smallest and its largest coordinates.
pub(crate) type Obstacle = (Point, Point);

impl Floor {
    /// A thing in the middle of the edge between two nodes, 80 mm along it and 160 mm across.
    pub(crate) fn obstacle(&self, a: (u8, u8), b: (u8, u8)) -> Obstacle {
        let middle = |a: u8, b: u8| (f64::from(a) + f64::from(b)) / 2.0 * self.side;
        let (x, y) = (middle(a.0, b.0), middle(a.1, b.1));
        let (dx, dy) = if a.1 == b.1 {
            (40.0, 80.0)
        } else {
            (80.0, 40.0)
        };
        ((x - dx, y - dy), (x + dx, y + dy))
    }
}

fn is_on((from, to): (Point, Point), (x, y): Point) -> bool {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy);
    let (px, py) = (x - from.0, y - from.1);
    let along = (px * dx + py * dy) / length;
    let across = (px * dy - py * dx) / length;
    // Round joints, so that a polyline has no gaps.
    (-1.0..=length + 1.0).contains(&along) && across.abs() <= HALF_TAPE
}
