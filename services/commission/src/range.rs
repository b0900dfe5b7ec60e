//! Which distance sensor it is, from what it reads at two known distances.
//!
//! A board tells distances, not readings. So for this step it gets an own curve, from whose
//! distances the readings can be calculated: 1 cm of it is 1 to 17 steps of the reading.

use lager_control::ir::Curve;
use lager_wire::{IR_MAX, IrModel, RangerProfile};

use crate::words::Said;

/// The distances that all models measure, in cm.
pub(crate) const DISTANCES_CM: [u8; 2] = [20, 30];
/// How much the two distances must differ at least, in cm.
const LEAST_APART_CM: u8 = 5;
/// How much more it must read at the near one.
const LEAST_RISE: u16 = 20;
/// By which factor a model's distance may differ from the true one: datasheets allow as much.
const MOST_WRONG: f32 = 1.5;

/// The curve by which readings are measured.
pub(crate) const MEASURING: RangerProfile = RangerProfile {
    model: IrModel::Own,
    near_cm: 20,
    near_reading: IR_MAX,
    far_cm: 200,
    far_reading: 0,
};

/// The reading for a distance that was told by [`MEASURING`]; 0 for nothing.
pub(crate) fn reading(cm: u8) -> u16 {
    let RangerProfile {
        near_cm, far_cm, ..
    } = MEASURING;
    let inverse = |cm: u8| 1.0 / f32::from(cm.clamp(near_cm, far_cm));
    let part = (inverse(cm) - inverse(far_cm)) / (inverse(near_cm) - inverse(far_cm));
    (part * f32::from(IR_MAX)).round() as u16
}

/// A known distance in cm, and the reading there.
pub(crate) type Point = (u8, u16);

/// The sensor that reads so: one of the models, or an own curve of these two points.
///
/// # Errors
/// No sensor reads so.
pub(crate) fn sensor(far: Point, near: Point) -> Result<RangerProfile, Said> {
    if far.0 < near.0 + LEAST_APART_CM {
        return Err("range_close".into());
    }
    if near.1 < far.1 + LEAST_RISE {
        let values: [(_, &dyn ToString); 4] = [
            ("far", &far.1),
            ("far_cm", &far.0),
            ("near", &near.1),
            ("near_cm", &near.0),
        ];
        return Err(Said::new("range_flat", &values));
    }
    let models = [IrModel::Gp2y0a21, IrModel::Gp2y0a41, IrModel::Gp2y0a02];
    let fits = models.into_iter().filter_map(|model| {
        let profile = RangerProfile {
            model,
            ..RangerProfile::default()
        };
        let curve = Curve::new(&profile);
        let wrong = |(cm, reading): Point| {
            // Where even a much weaker reading is the nearest distance, nothing is told apart.
            let weaker = curve.distance(reading - reading / 4);
            let told = f32::from(curve.distance(reading).get()?);
            if weaker.0 == curve.least_cm() {
                return None;
            }
            Some((told / f32::from(cm)).max(f32::from(cm) / told))
        };
        let (far, near) = (wrong(far)?, wrong(near)?);
        (far.max(near) <= MOST_WRONG).then_some((far * near, profile))
    });
    let best = fits.min_by(|(one, _), (other, _)| one.total_cmp(other));
    Ok(best.map_or_else(
        || RangerProfile {
            model: IrModel::Own,
            near_cm: near.0,
            near_reading: near.1,
            far_cm: far.0,
            far_reading: far.1,
        },
        |(_, profile)| profile,
    ))
}

/// What was found, as a sentence.
pub(crate) fn said(ranger: &RangerProfile) -> Said {
    if ranger.model == IrModel::Own {
        let values: [(_, &dyn ToString); 2] = [("near", &ranger.near_cm), ("far", &ranger.far_cm)];
        return Said::new("found_own", &values);
    }
    let model = format!("{:?}", ranger.model).to_uppercase();
    Said::new("found_model", &[("model", &model)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_found_again_from_the_distance_that_the_board_tells() {
        let curve = Curve::new(&MEASURING);
        assert_eq!(MEASURING.validate(), Ok(()));
        for adc in 80..600 {
            let told = reading(curve.distance(adc).0);
            assert!(told.abs_diff(adc) <= 3 + adc / 40, "{adc}: {told}");
        }
    }

    #[test]
    fn each_model_is_known_by_what_its_datasheet_says() {
        for (far, near, model) in [
            (189, 267, IrModel::Gp2y0a21),
            (89, 133, IrModel::Gp2y0a41),
            (339, 501, IrModel::Gp2y0a02),
            // The weakest and the strongest that the datasheet of the first one allows.
            (142, 210, IrModel::Gp2y0a21),
            (232, 319, IrModel::Gp2y0a21),
            // None of them.
            (700, 900, IrModel::Own),
            (20, 60, IrModel::Own),
        ] {
            let found = sensor((30, far), (20, near)).map(|found| found.model);
            assert_eq!(found, Ok(model), "{far} {near}");
        }
        let own = sensor((30, 20), (22, 60)).expect("a curve");
        assert_eq!(own.validate(), Ok(()));
        assert_eq!(own.range_cm(), (22, 30));
    }

    #[test]
    fn readings_that_do_not_rise_as_the_thing_comes_nearer_are_refused() {
        for (far, near, name) in [
            ((30, 200), (20, 200), "range_flat"),
            ((30, 267), (20, 189), "range_flat"),
            ((30, 0), (20, 0), "range_flat"),
            ((24, 189), (20, 267), "range_close"),
            ((20, 189), (30, 267), "range_close"),
        ] {
            let refused = sensor(far, near).expect_err("impossible");
            assert_eq!(refused.name(), name, "{far:?} {near:?}");
        }
    }
}
