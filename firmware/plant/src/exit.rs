//! The exit line with its bar, as strips and arcs of tape (E3, E4).
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
use crate::tape::{BAR, FAR, HALF};
use crate::warehouse::{STRAIGHT_CM, Warehouse};

/// Pieces overlap by this much in mm, so that no seam shows between them.
const OVERLAP: f64 = 5.0;

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

    /// Points that the piece lies between.
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

/// The exit line with its bar, and the middle of the bar.
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

/// A curve by `turn` rad, positive to the left, and the pose at its end.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::Tape;
    use crate::warehouse::{Curve, Exit};

    #[test]
    fn curved_exits_have_no_gap_and_leave_the_warehouse_alone() {
        for curve in [Curve::Straight, Curve::Left, Curve::Right, Curve::S] {
            for delivery in [[0, 0], [2, 0], [0, 2], [2, 2]] {
                let mut warehouse = Warehouse::builtin("small").unwrap();
                warehouse.delivery = delivery;
                warehouse.exit = Exit {
                    length_cm: 120,
                    curve,
                    radius_cm: 25,
                };
                warehouse.validate().unwrap();
                let tape = Tape::new(&warehouse);
                let mut walked = walk(&warehouse, &tape);
                assert!(
                    (1170.0..1190.0).contains(&walked.1),
                    "{curve:?}: {} mm",
                    walked.1
                );
                let bar = tape.bar();
                walked.0.heading -= bar.heading;
                assert!(
                    (walked.0.x - bar.x).hypot(walked.0.y - bar.y) < 21.0,
                    "{curve:?} {delivery:?}"
                );
                assert!(
                    walked.0.heading.sin().abs() < 0.1,
                    "{curve:?} {}",
                    walked.0.heading
                );
            }
        }
    }

    /// Walks along the middle of the exit line as a follower with a short look-ahead would.
    fn walk(warehouse: &Warehouse, tape: &Tape) -> (Pose, f64) {
        let start = crate::scene::start(warehouse);
        let mut at = Pose {
            heading: start.heading + PI,
            ..start
        };
        let mut length = 0.0;
        while length < 1500.0 {
            let best = (-20..=20)
                .map(|step| at.heading + f64::from(step) * 0.01)
                .map(|heading| Pose { heading, ..at }.point(4.0, 0.0))
                .min_by(|a, b| tape.distance(a.0, a.1).total_cmp(&tape.distance(b.0, b.1)))
                .unwrap();
            if tape.distance(best.0, best.1) > 0.0 {
                break;
            }
            let heading = (best.1 - at.y).atan2(best.0 - at.x);
            let turned = (heading - at.heading + PI).rem_euclid(2.0 * PI) - PI;
            at = Pose {
                x: at.x,
                y: at.y,
                heading: at.heading + turned * 0.5,
            };
            let (x, y) = at.point(1.0, 0.0);
            at = Pose { x, y, ..at };
            length += 1.0;
            if (at.x - tape.bar().x).hypot(at.y - tape.bar().y) < 20.0 {
                break;
            }
        }
        (at, length)
    }
}
