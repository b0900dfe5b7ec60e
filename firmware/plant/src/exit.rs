//! The exit line with its bar, made of strips and arcs of tape (E3, E4).
//!
//! ```text
//!   node --- strip ---.                       straight: one strip
//!                      `. arc                 left, right: strip, quarter arc, strip
//!                        |                    s: strip, two eighths, strip
//!                        | strip
//!                  ======+====== bar
//! ```

use core::f64::consts::PI;

use crate::body::Pose;
use crate::scene::{node, side_mm};
use crate::warehouse::{STRAIGHT_CM, Warehouse};

/// Width of the tape in mm (E1).
pub const WIDTH: f64 = 15.0;
/// Length of the delivery bar in mm (E4).
pub const BAR: f64 = 300.0;
/// Half the width of the tape.
pub(crate) const HALF: f64 = WIDTH / 2.0;
/// A distance, in mm, that is larger than any spot.
pub(crate) const FAR: f64 = 1.0e6;

/// Pieces overlap by this much in mm, so that no seam shows between them.
const OVERLAP: f64 = 5.0;

/// A robot is beside a strip until its sensors are this far past the end, in mm.
const BEYOND: f64 = 100.0;
/// A robot follows a piece if its heading is within 45 degrees of it: on a bend the sensors are
/// ahead of the axle.
const ALONG: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// One piece of the exit line, or the bar.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Piece {
    /// A strip along its own x axis.
    Strip {
        start: Pose,
        sin: f64,
        cos: f64,
        length: f64,
    },
    /// A part of a ring: `from` and `sweep` are angles at the centre, `sweep` > 0.
    Arc {
        centre: [f64; 2],
        radius: f64,
        from: f64,
        sweep: f64,
    },
}

impl Piece {
    fn strip(start: Pose, length: f64) -> Self {
        let (sin, cos) = start.heading.sin_cos();
        Self::Strip {
            start,
            sin,
            cos,
            length,
        }
    }

    pub(crate) fn distance(&self, x: f64, y: f64) -> f64 {
        match *self {
            Self::Strip {
                start,
                sin,
                cos,
                length,
            } => {
                let (dx, dy) = (x - start.x, y - start.y);
                let along = dx * cos + dy * sin;
                let across = dy * cos - dx * sin;
                (across.abs() - HALF).max(-along).max(along - length)
            }
            Self::Arc {
                centre,
                radius,
                from,
                sweep,
            } => {
                let (dx, dy) = (x - centre[0], y - centre[1]);
                let angle = (dy.atan2(dx) - from).rem_euclid(2.0 * PI);
                if angle > sweep {
                    return FAR;
                }
                (dx.hypot(dy) - radius).abs() - HALF
            }
        }
    }

    /// A lower limit of the distance, quicker to calculate.
    pub(crate) fn at_least(&self, x: f64, y: f64) -> f64 {
        match *self {
            Self::Strip { .. } => self.distance(x, y),
            Self::Arc { centre, radius, .. } => {
                ((x - centre[0]).hypot(y - centre[1]) - radius).abs() - HALF
            }
        }
    }

    /// Distance from a point to the middle of the tape; `None` unless the point and the heading are
    /// along the piece.
    pub(crate) fn beside(&self, x: f64, y: f64, heading: f64) -> Option<f64> {
        let is_along = |tangent: f64| (heading - tangent).cos().abs() > ALONG;
        match *self {
            Self::Strip {
                start,
                sin,
                cos,
                length,
            } => {
                let (dx, dy) = (x - start.x, y - start.y);
                let along = dx * cos + dy * sin;
                let near = (-BEYOND..=length + BEYOND).contains(&along);
                (near && is_along(start.heading)).then(|| (dy * cos - dx * sin).abs())
            }
            Self::Arc { centre, radius, .. } => {
                let (dx, dy) = (x - centre[0], y - centre[1]);
                let near = self.distance(x, y) < FAR;
                let off = (dx.hypot(dy) - radius).abs();
                (near && is_along(dy.atan2(dx) + PI / 2.0)).then_some(off)
            }
        }
    }

    /// Points around the piece, for a box that contains it.
    pub(crate) fn outline(&self) -> [(f64, f64); 3] {
        match *self {
            Self::Strip { start, length, .. } => {
                [0.0, length / 2.0, length].map(|along| start.point(along, 0.0))
            }
            Self::Arc {
                centre,
                radius,
                from,
                sweep,
            } => [from, from + sweep / 2.0, from + sweep].map(|angle| {
                (
                    centre[0] + radius * angle.cos(),
                    centre[1] + radius * angle.sin(),
                )
            }),
        }
    }
}

/// Builds the exit line with its bar. Also returns the middle of the bar.
pub(crate) fn exit(warehouse: &Warehouse) -> (Vec<Piece>, Pose) {
    let (x, y) = node(warehouse.delivery, side_mm(warehouse));
    let heading = if warehouse.starts_towards_plus_x() {
        PI
    } else {
        0.0
    };
    let exit = &warehouse.exit;
    let radius = f64::from(exit.radius_cm) * 10.0;
    let arcs = exit.curve.arcs_deg();
    let curved: f64 = arcs.iter().map(|arc| radius * arc.to_radians().abs()).sum();
    let length = f64::from(exit.length_cm) * 10.0;
    let first = if arcs.is_empty() {
        length
    } else {
        f64::from(STRAIGHT_CM) * 10.0
    };

    let mut pieces = Vec::new();
    let mut at = Pose { x, y, heading };
    let mut lay = |at: Pose, length: f64| {
        let (x, y) = at.point(-OVERLAP, 0.0);
        pieces.push(Piece::strip(Pose { x, y, ..at }, length + 2.0 * OVERLAP));
        let (x, y) = at.point(length, 0.0);
        Pose { x, y, ..at }
    };
    at = lay(at, first);
    if !arcs.is_empty() {
        let mut bends = Vec::new();
        for &arc in arcs {
            let (bend, end) = bend(at, radius, arc.to_radians());
            bends.push(bend);
            at = end;
        }
        at = lay(at, length - first - curved);
        pieces.extend(bends);
    }
    let (x, y) = at.point(0.0, -BAR / 2.0);
    let heading = at.heading + PI / 2.0;
    pieces.push(Piece::strip(Pose { x, y, heading }, BAR));
    (pieces, at)
}

/// A curve by `turn` rad, positive to the left; also returns the pose at its end.
fn bend(at: Pose, radius: f64, turn: f64) -> (Piece, Pose) {
    let side = turn.signum();
    let (cx, cy) = at.point(0.0, side * radius);
    let begin = (at.y - cy).atan2(at.x - cx);
    let from = if turn > 0.0 { begin } else { begin + turn };
    let end = begin + turn;
    let pose = Pose {
        x: cx + radius * end.cos(),
        y: cy + radius * end.sin(),
        heading: at.heading + turn,
    };
    let piece = Piece::Arc {
        centre: [cx, cy],
        radius,
        from,
        sweep: turn.abs(),
    };
    (piece, pose)
}
