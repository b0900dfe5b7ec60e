//! The IR ranger: turns a reading of the ADC into centimetres (S8, AMB-13, AMB-14).
//!
//! ```text
//!  volt
//!   3 |   _
//!     |  / \
//!   2 | /   \
//!     |/     '-._
//!   1 |          ''--..___
//!     |______________________ cm
//!        least          most
//! ```
//!
//! Near the peak, two distances have the same voltage. Only the branch beyond the model's least
//! distance is used. A nearer object therefore reads as the least distance near the peak and as too
//! far below it, but never as less than the least distance.
//!
//! Between two table points the inverse of the distance is linear in the voltage, as in every
//! triangulating sensor. All numbers are integers. A ranger of none of the models has an own curve of
//! two points, which its owner has measured.

use lager_wire::{Centimetres, IrModel, RangerProfile};

use crate::divide::divide;

/// One point of a curve.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// What a 10-bit ADC with a 5 V reference reads.
    adc: u16,
    millimetres: u16,
}

const fn at(adc: u16, millimetres: u16) -> Point {
    Point { adc, millimetres }
}

/// Figure 2 of Sharp's sheet E4-A00201EN, white paper.
const GP2Y0A21: [Point; 10] = [
    at(472, 100),
    at(336, 150),
    at(267, 200),
    at(220, 250),
    at(189, 300),
    at(150, 400),
    at(123, 500),
    at(104, 600),
    at(90, 700),
    at(84, 800),
];

/// Read by hand from the datasheet's curve; sheet gp2y0A41SK of J. Doggen's Arduino distance
/// library.
const GP2Y0A41: [Point; 7] = [
    at(604, 40),
    at(501, 50),
    at(389, 67),
    at(266, 100),
    at(133, 200),
    at(102, 250),
    at(81, 333),
];

/// 0.4 V at 150 cm and 2.05 V more at 20 cm, both typical.
const GP2Y0A02: [Point; 2] = [at(501, 200), at(81, 1500)];

/// The curve of a robot's ranger.
#[derive(Debug, Clone)]
pub struct Curve {
    model: IrModel,
    /// The points of an own curve.
    own: [Point; 2],
    least_cm: u8,
    most_cm: u8,
}

impl Curve {
    /// The curve of a ranger that was described so.
    #[must_use]
    pub const fn new(ranger: &RangerProfile) -> Self {
        let (least_cm, most_cm) = ranger.range_cm();
        Self {
            model: ranger.model,
            own: [
                at(ranger.near_reading, ranger.near_cm as u16 * 10),
                at(ranger.far_reading, ranger.far_cm as u16 * 10),
            ],
            least_cm,
            most_cm,
        }
    }

    /// The least distance that it measures; smaller values are never reported.
    #[must_use]
    pub const fn least_cm(&self) -> u8 {
        self.least_cm
    }

    /// The greatest distance that it measures; farther objects read as too far.
    #[must_use]
    pub const fn most_cm(&self) -> u8 {
        self.most_cm
    }

    /// The distance for a reading of a 10-bit ADC with a 5 V reference.
    #[must_use]
    pub fn distance(&self, adc: u16) -> Centimetres {
        let table = self.table();
        if adc >= table[0].adc {
            return Centimetres(self.least_cm);
        }
        let Some(pair) = table.windows(2).find(|pair| adc >= pair[1].adc) else {
            return Centimetres::NONE;
        };
        let centimetres = between(&pair[0], &pair[1], adc);
        match u8::try_from(centimetres) {
            Ok(centimetres) if centimetres <= self.most_cm => Centimetres(centimetres),
            _ => Centimetres::NONE,
        }
    }

    fn table(&self) -> &[Point] {
        match self.model {
            IrModel::Own => &self.own,
            IrModel::Gp2y0a21 => &GP2Y0A21,
            IrModel::Gp2y0a41 => &GP2Y0A41,
            IrModel::Gp2y0a02 => &GP2Y0A02,
        }
    }
}

/// Centimetres between two neighbouring points, interpolated over the inverse distance.
fn between(near: &Point, far: &Point, adc: u16) -> u32 {
    let (near_mm, far_mm) = (u32::from(near.millimetres), u32::from(far.millimetres));
    let from_near = u32::from(near.adc - adc);
    let from_far = u32::from(adc - far.adc);
    let divisor = 10 * (far_mm * from_far + near_mm * from_near);
    divide(
        near_mm * far_mm * (from_near + from_far) + divisor / 2,
        divisor,
    )
}
