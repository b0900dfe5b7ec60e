//! Compares the IR curves with Sharp's data, and checks the laws that every curve keeps.
//!
//! The points are copied from figure 2 of Sharp's datasheet E4-A00201EN (GP2Y0A21YK0F, white
//! paper; the drawing is exact to about 0.02 V) and from the hand-read table gp2y0A41SK of J.
//! Doggen's Arduino distance library.

use lager_control::ir::Curve;
use lager_wire::{Centimetres, IrModel, RangerProfile};

const GP2Y0A21: [(f64, f64); 10] = [
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

/// Below 10 cm the output of the GP2Y0A21 folds back.
const GP2Y0A21_FOLDED: [(f64, f64); 15] = [
    (0.09, 0.007),
    (0.98, 0.469),
    (1.3, 0.69),
    (1.65, 0.938),
    (2.03, 1.175),
    (2.41, 1.442),
    (2.77, 1.694),
    (3.15, 1.942),
    (3.53, 2.235),
    (4.18, 2.59),
    (4.5, 2.816),
    (4.7, 3.007),
    (4.79, 3.06),
    (4.85, 3.081),
    (5.85, 3.137),
];

const GP2Y0A41: [(f64, f64); 7] = [
    (25.0, 0.5),
    (20.0, 0.65),
    (10.0, 1.3),
    (6.667, 1.9),
    (5.0, 2.45),
    (4.0, 2.95),
    (29.0, 0.445),
];

const MODELS: [IrModel; 3] = [IrModel::Gp2y0a21, IrModel::Gp2y0a41, IrModel::Gp2y0a02];

/// The curve of a ranger of this model.
fn curve(model: IrModel) -> Curve {
    Curve::new(&RangerProfile {
        model,
        ..RangerProfile::default()
    })
}

/// What a 10-bit ADC with a 5 V reference reads at a voltage.
fn adc(volt: f64) -> u16 {
    (volt * 1024.0 / 5.0) as u16
}

/// Whether the distance is within 1 cm or 5 %, whichever is more.
fn near(measured: Centimetres, cm: f64) -> bool {
    let measured = f64::from(measured.get().expect("a distance"));
    (measured - cm).abs() <= (cm * 0.05).max(1.0)
}

#[test]
fn the_gp2y0a21_agrees_with_the_data_sheet() {
    for (cm, volt) in GP2Y0A21 {
        let measured = curve(IrModel::Gp2y0a21).distance(adc(volt));
        assert!(near(measured, cm), "{cm} cm, {volt} V: {measured}");
    }
}

#[test]
fn the_gp2y0a41_agrees_with_the_hand_read_curve() {
    for (cm, volt) in GP2Y0A41 {
        let measured = curve(IrModel::Gp2y0a41).distance(adc(volt));
        assert!(near(measured, cm), "{cm} cm, {volt} V: {measured}");
    }
}

#[test]
fn the_gp2y0a02_agrees_with_the_data_sheets_typical_voltages() {
    assert!(near(curve(IrModel::Gp2y0a02).distance(adc(2.45)), 20.0));
    assert!(near(curve(IrModel::Gp2y0a02).distance(adc(0.4)), 150.0));
    // Phidgets gives 9.462 / (ratio - 0.01692) for the same sensor (product 3522).
    for volt in [0.5, 0.7, 1.0, 1.5, 2.0] {
        let cm = 9.462 / (volt / 5.0 - 0.016_92);
        let measured = curve(IrModel::Gp2y0a02).distance(adc(volt));
        assert!(near(measured, cm), "{volt} V: {measured}, not {cm}");
    }
}

#[test]
fn between_the_points_the_curve_is_that_of_a_triangulating_sensor() {
    // Halfway in voltage between 10 and 15 cm lies their harmonic mean, 12 cm, and not 12.5 cm.
    let halfway = u16::midpoint(adc(2.305), adc(1.645));
    assert_eq!(curve(IrModel::Gp2y0a21).distance(halfway), Centimetres(12));
}

#[test]
fn a_higher_voltage_is_never_farther() {
    for model in MODELS {
        let curve = curve(model);
        let mut last = u8::MAX;
        for adc in 0..=1023 {
            let distance = curve.distance(adc).0;
            assert!(distance <= last, "{model:?} at {adc}");
            last = distance;
        }
    }
}

#[test]
fn every_reading_is_within_the_models_range_or_no_distance() {
    for model in MODELS {
        let curve = curve(model);
        let (mut least, mut most) = (u8::MAX, 0);
        for adc in 0..=u16::MAX {
            let Some(cm) = curve.distance(adc).get() else {
                continue;
            };
            least = least.min(cm);
            most = most.max(cm);
        }
        assert_eq!(
            (least, most),
            (curve.least_cm(), curve.most_cm()),
            "{model:?}"
        );
    }
}

#[test]
fn what_is_nearer_than_the_least_never_reads_below_it() {
    for (cm, volt) in GP2Y0A21_FOLDED {
        let measured = curve(IrModel::Gp2y0a21).distance(adc(volt));
        assert!(measured.0 >= 10, "{cm} cm: {measured}");
        if volt > 2.305 {
            assert_eq!(measured, Centimetres(10), "{cm} cm is near the peak");
        }
    }
}

#[test]
fn nothing_in_range_is_no_distance() {
    for model in MODELS {
        let curve = curve(model);
        assert_eq!(curve.distance(0), Centimetres::NONE);
        assert_eq!(curve.distance(70), Centimetres::NONE);
        assert_eq!(curve.distance(1023), Centimetres(curve.least_cm()));
    }
    assert_eq!(RangerProfile::default().model, IrModel::Gp2y0a21);
}

#[test]
fn an_own_curve_goes_through_its_two_points_and_keeps_their_range() {
    let curve = Curve::new(&RangerProfile {
        model: IrModel::Own,
        near_cm: 15,
        near_reading: 400,
        far_cm: 60,
        far_reading: 100,
    });
    for (reading, expected) in [
        (1_023, Centimetres(15)),
        (400, Centimetres(15)),
        // A third of the way from far to near in the inverse of the distance.
        (200, Centimetres(30)),
        (100, Centimetres(60)),
        (99, Centimetres::NONE),
        (0, Centimetres::NONE),
    ] {
        assert_eq!(curve.distance(reading), expected, "{reading}");
    }
}
