//! Walks along the exit line on its tape, as a robot would that follows it.

use core::f64::consts::PI;
use lager_floor::Node;

use lager_plant::tape::Tape;
use lager_plant::{Curve, Exit, Pose, Warehouse, scene};

#[test]
fn curved_exits_have_no_gap_and_leave_the_warehouse_alone() {
    for curve in [Curve::Straight, Curve::Left, Curve::Right, Curve::S] {
        for delivery in [[0, 0], [2, 0], [0, 2], [2, 2]].map(Node::from) {
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

/// Walks along the middle of the exit line with a short look-ahead. Returns the end and the length.
fn walk(warehouse: &Warehouse, tape: &Tape) -> (Pose, f64) {
    let start = scene::start(warehouse);
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
