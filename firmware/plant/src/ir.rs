//! The IR ranger at the front, a Sharp GP2Y0A21 unless the robot is built otherwise (AMB-14): turns distances into ADC values.
//!
//! It measures about every 38 ms and holds its output in between. Below 10 cm the voltage falls
//! again although the object comes nearer. Rangers differ within the datasheet's limits: in the
//! output at 80 cm, in its rise from there to 10 cm, and in the time between measurements.
//!
//! ```text
//!  3.1 V  _
//!        / \
//!       /   \__            10-bit ADC at 5 V: 1023 * volts / 5
//!      /       \_____
//!  0 --6--10------------80 cm
//! ```

use crate::body::{IR_AHEAD, Pose};
use crate::build::Ranger;
use crate::make::Make;
use crate::noise::Noise;
use crate::scene::Block;

/// Time between two measurements in ns (datasheet: 38.3 ms typical, 28.7 to 47.9).
pub const CYCLE_NS: u64 = 38_300_000;
const CYCLES_MS: [f64; 2] = [28.7, 47.9];
/// Lowest and highest output at 80 cm, in volts (datasheet).
const AT_80: [f64; 2] = [0.25, 0.55];
/// Least and greatest difference of the outputs at 10 cm and at 80 cm, in volts (datasheet).
const SPAN: [f64; 2] = [1.65, 2.15];

/// Output from 10 cm on, as (cm, volt): figure 2 of the datasheet E4-A00201EN, white paper.
const FAR_FIELD: [(f64, f64); 10] = [
    (10.0, 2.305),
    (15.0, 1.645),
    (20.0, 1.305),
    (25.0, 1.079),
    (30.0, 0.926),
    (40.0, 0.735),
    (50.0, 0.604),
    (60.0, 0.512),
    (70.0, 0.443),
    (80.0, 0.415),
];
/// The part below 10 cm, from the same figure.
const NEAR_FIELD: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.98, 0.469),
    (1.65, 0.938),
    (2.41, 1.442),
    (3.15, 1.942),
    (4.18, 2.59),
    (4.7, 3.007),
    (5.85, 3.137),
    (10.0, 2.305),
];
/// A GP2Y0A41SK0F, read by hand from its datasheet's curve, as (cm, volt).
const GP2Y0A41: [(f64, f64); 8] = [
    (4.0, 2.95),
    (5.0, 2.45),
    (6.667, 1.9),
    (10.0, 1.3),
    (20.0, 0.65),
    (25.0, 0.5),
    (29.0, 0.445),
    (33.333, 0.395),
];
/// A GP2Y0A02YK: its datasheet's two typical voltages.
const GP2Y0A02: [(f64, f64); 2] = [(20.0, 2.45), (150.0, 0.4)];
/// Output without any object, in volts.
const NOTHING: f64 = 0.15;
/// Range of the beam, in mm.
const REACH: f64 = 2_000.0;
/// Angles of the rays that together stand for the beam, in rad.
const BEAM: [f64; 3] = [-0.04, 0.0, 0.04];
/// Deviation of a measurement in volts, and the greatest gain error of a sensor.
const NOISE: f64 = 0.008;
const GAIN_ERROR: f64 = 0.02;

/// The ranger, which holds its last output.
#[derive(Clone, Debug)]
pub struct IrRanger {
    model: Ranger,
    gain: f64,
    /// Added after the gain, in volts.
    offset: f64,
    cycle_ns: u64,
    volts: f64,
    /// How far away somebody holds something, in mm.
    held: Option<f64>,
    next_ns: u64,
    noise: Noise,
}

impl IrRanger {
    /// A ranger with deviations from `noise`. Its first measurement is due at once.
    pub fn new(mut noise: Noise, make: Make) -> Self {
        let drawn = [FAR_FIELD[0].1, FAR_FIELD[FAR_FIELD.len() - 1].1];
        let typical = drawn[0] - drawn[1];
        let span = make.draw(&mut noise, typical, SPAN[0], SPAN[1]);
        let at_80 = make.draw(&mut noise, drawn[1], AT_80[0], AT_80[1]);
        let cycle_ms = make.draw(&mut noise, 38.3, CYCLES_MS[0], CYCLES_MS[1]);
        let gain = match make {
            Make::Nominal => 1.0 + noise.spread(GAIN_ERROR),
            Make::Varied => span / typical,
        };
        Self {
            model: Ranger::default(),
            gain,
            offset: match make {
                Make::Nominal => 0.0,
                Make::Varied => at_80 - gain * drawn[1],
            },
            cycle_ns: (cycle_ms * 1e6) as u64,
            volts: NOTHING,
            held: None,
            next_ns: 0,
            noise,
        }
    }

    /// Puts a ranger of another model in its place.
    pub fn set_model(&mut self, model: Ranger) {
        self.model = model;
    }

    /// Holds something so many mm away, or takes it away.
    pub fn hold(&mut self, millimetres: Option<f64>) {
        self.held = millimetres;
    }

    /// Makes a measurement if one is due.
    pub fn step(&mut self, now_ns: u64, pose: &Pose, blocks: &[Block]) {
        if now_ns < self.next_ns {
            return;
        }
        self.next_ns = now_ns + self.cycle_ns;
        let clean = match self.held.or_else(|| distance(pose, blocks)) {
            Some(millimetres) => self.clean(millimetres / 10.0),
            None => NOTHING,
        };
        self.volts = clean + self.noise.bell(NOISE);
    }

    /// The output in volts for an object at `cm`, without noise.
    fn clean(&self, cm: f64) -> f64 {
        match self.model {
            Ranger::Gp2y0a21 => volts(cm) * self.gain + self.offset,
            Ranger::Gp2y0a41 => along(&GP2Y0A41, cm),
            Ranger::Gp2y0a02 => along(&GP2Y0A02, cm),
        }
    }

    /// The output as read by a 10-bit ADC at 5 V.
    pub fn adc(&self) -> u16 {
        (self.volts / 5.0 * 1023.0).clamp(0.0, 1023.0) as u16
    }
}

/// Distance in mm from the ranger to the nearest thing in its beam.
pub fn distance(pose: &Pose, blocks: &[Block]) -> Option<f64> {
    let from = pose.point(IR_AHEAD, 0.0);
    BEAM.iter()
        .map(|angle| (pose.heading + angle).sin_cos())
        .flat_map(|(sin, cos)| {
            blocks
                .iter()
                .filter_map(move |block| hit(from, (cos, sin), block))
        })
        .min_by(f64::total_cmp)
        .filter(|distance| *distance < REACH)
}

/// The output in volts for an object at `cm`.
pub fn volts(cm: f64) -> f64 {
    let last = FAR_FIELD[FAR_FIELD.len() - 1];
    if cm < 10.0 {
        between(&NEAR_FIELD, cm.max(0.0), |cm| cm)
    } else if cm < last.0 {
        // The voltage is nearly linear in the inverse of the distance.
        between(&FAR_FIELD, cm, |cm| 1.0 / cm)
    } else {
        (last.1 * last.0 / cm).max(NOTHING)
    }
}

/// The output of a model of which only these points are known: nearer objects read lower again, and
/// farther ones ever less.
fn along(table: &[(f64, f64)], cm: f64) -> f64 {
    let (first, last) = (table[0], table[table.len() - 1]);
    if cm < first.0 {
        first.1 * cm / first.0
    } else if cm < last.0 {
        between(table, cm, |cm| 1.0 / cm)
    } else {
        last.1 * last.0 / cm
    }
}

fn between(table: &[(f64, f64)], cm: f64, scale: impl Fn(f64) -> f64) -> f64 {
    let after = table
        .partition_point(|point| point.0 <= cm)
        .clamp(1, table.len() - 1);
    let (a, b) = (table[after - 1], table[after]);
    let part = (scale(cm) - scale(a.0)) / (scale(b.0) - scale(a.0));
    a.1 + (b.1 - a.1) * part
}

/// Distance at which a ray enters a block; 0 if it starts inside.
fn hit(from: (f64, f64), direction: (f64, f64), block: &Block) -> Option<f64> {
    let (mut enter, mut leave) = (0.0_f64, f64::MAX);
    for (origin, step, low, high) in [
        (from.0, direction.0, block.low[0], block.high[0]),
        (from.1, direction.1, block.low[1], block.high[1]),
    ] {
        if step.abs() < 1e-9 {
            if origin < low || origin > high {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - origin) / step, (high - origin) / step);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some(enter)
}

#[cfg(test)]
mod tests {
    use lager_floor::Node;

    use super::*;
    use crate::scene::blocks;
    use crate::{Obstacle, Warehouse};

    fn blocked() -> Vec<Block> {
        let mut warehouse = Warehouse::builtin("small").unwrap();
        warehouse.obstacles.push(Obstacle {
            between: [Node::new(1, 0), Node::new(2, 0)],
        });
        blocks(&warehouse)
    }

    #[test]
    fn an_obstacle_ahead_is_seen_at_its_distance() {
        // The obstacle's face is at x = 710, the ranger 100 mm ahead of the axle.
        let pose = Pose {
            x: 200.0,
            y: 0.0,
            heading: 0.0,
        };
        assert!((distance(&pose, &blocked()).unwrap() - 410.0).abs() < 1e-6);
        let away = Pose {
            heading: core::f64::consts::PI,
            ..pose
        };
        assert_eq!(distance(&away, &blocked()), None);
    }

    #[test]
    fn the_shelf_behind_a_mark_is_seen() {
        let pose = Pose {
            x: 750.0,
            y: 0.0,
            heading: core::f64::consts::FRAC_PI_2,
        };
        let shelves = blocks(&Warehouse::builtin("small").unwrap());
        assert!((distance(&pose, &shelves).unwrap() - 110.0).abs() < 0.5);
    }

    #[test]
    fn the_curve_meets_the_datasheet_and_folds_back() {
        for (cm, volt) in FAR_FIELD {
            assert!((volts(cm) - volt).abs() < 1e-9, "{cm} cm");
        }
        assert!((volts(35.0) - 0.82).abs() < 0.02);
        assert!(volts(3.0) < volts(6.0) && volts(6.0) > volts(10.0));
        assert!(volts(150.0) < 0.25 && volts(150.0) > NOTHING);
    }

    #[test]
    fn the_output_holds_between_measurements() {
        let mut ranger = IrRanger::new(Noise::new(1, 1), Make::Nominal);
        let pose = Pose {
            x: 200.0,
            y: 0.0,
            heading: 0.0,
        };
        ranger.step(0, &pose, &blocked());
        let held = ranger.adc();
        assert!(
            (held as f64 - volts(41.0) / 5.0 * 1023.0).abs() < 12.0,
            "{held}"
        );
        let nearer = Pose { x: 400.0, ..pose };
        ranger.step(CYCLE_NS - 1, &nearer, &blocked());
        assert_eq!(ranger.adc(), held);
        ranger.step(CYCLE_NS, &nearer, &blocked());
        assert!(ranger.adc() > held + 50);
    }

    #[test]
    fn rangers_differ_within_the_datasheets_limits() {
        let block = |millimetres: f64| {
            let face = IR_AHEAD + millimetres;
            vec![Block {
                low: [face, -100.0],
                high: [face + 100.0, 100.0],
            }]
        };
        let mut lowest = f64::MAX;
        let mut highest = 0.0_f64;
        for seed in 0..200 {
            let mut ranger = IrRanger::new(Noise::new(seed, 1), Make::Varied);
            let mut output = |millimetres, at_ns| {
                ranger.step(at_ns, &Pose::default(), &block(millimetres));
                ranger.volts
            };
            let far = output(800.0, 0);
            let near = output(100.0, 100_000_000);
            let noise = 4.0 * NOISE;
            assert!((AT_80[0] - noise..AT_80[1] + noise).contains(&far), "{far}");
            let rise = near - far;
            assert!(
                (SPAN[0] - 2.0 * noise..SPAN[1] + 2.0 * noise).contains(&rise),
                "{rise}"
            );
            lowest = lowest.min(far);
            highest = highest.max(far);
        }
        assert!(highest - lowest > 0.2);
    }
}
