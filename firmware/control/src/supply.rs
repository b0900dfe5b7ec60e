//! Keeps the battery's voltage from changing the wheels' speed. With the same duty a full battery
//! drives faster than a nearly empty one, and much faster near the duty at which the wheels break
//! loose.
//!
//! `duty at the pins = duty * 11.1 V / battery`. Every duty that is decided, ordered or reported is
//! meant for 11.1 V (three lithium cells at rest); only the motor drivers get another one. The
//! voltage is the mean of the last readings, because it sags with every start. Nothing is corrected
//! within one step of a reading of 11.1 V, or at a voltage that no battery can have.

use crate::Motor;
use crate::board::Motors;
use crate::divide::divide;

/// All duties are meant for this battery, in tenths of a volt.
const NOMINAL_DECIVOLTS: u8 = 111;
/// Possible voltages of three lithium cells, in tenths of a volt.
const BELIEVED: core::ops::RangeInclusive<u8> = 80..=135;
/// A mean is over this many readings, as a power of two.
const MEAN_BITS: u8 = 4;
/// The mean must move this far before it is used, in sixteenths of a reading's step.
const TAKEN: u16 = 4;
/// This near to 11.1 V nothing is corrected, in sixteenths of a reading's step.
const NEAR: u16 = 12;
/// The factor 1. The largest factor, 1.39 at the lowest battery, still fits 8 bits, so the path
/// from the line to the wheels needs only two products of bytes.
const ONE: u8 = 128;

/// The mean of the battery's readings, and the factor from it.
#[derive(Debug, Clone)]
pub(crate) struct Supply {
    /// In sixteenths of a tenth of a volt; 0 before the first reading.
    mean: u16,
    taken: u16,
    factor: u8,
}

impl Supply {
    /// A battery without any reading.
    pub(crate) const fn new() -> Self {
        Self {
            mean: 0,
            taken: 0,
            factor: ONE,
        }
    }

    /// Takes in a reading of the battery in tenths of a volt.
    pub(crate) fn observe(&mut self, decivolts: u8) {
        if !BELIEVED.contains(&decivolts) {
            *self = Self::new();
            return;
        }
        // A reading is rounded down; the middle of its step is the best estimate.
        let reading = (u16::from(decivolts) << MEAN_BITS) + (1 << (MEAN_BITS - 1));
        self.mean = if self.mean == 0 {
            reading
        } else {
            self.mean - (self.mean >> MEAN_BITS) + (reading >> MEAN_BITS)
        };
        if self.mean.abs_diff(self.taken) >= TAKEN {
            self.taken = self.mean;
            self.factor = factor(self.mean);
        }
    }

    /// The drivers' duties for these duties; over all values of `round` the mean is exact.
    pub(crate) fn at_pins(&self, motors: Motors, round: u8) -> Motors {
        (self.scaled(motors.0, round), self.scaled(motors.1, round))
    }

    fn scaled(&self, motor: Motor, round: u8) -> Motor {
        let scaled = u16::from(motor.duty) * u16::from(self.factor) + u16::from(round % ONE);
        Motor {
            duty: (scaled / u16::from(ONE)).min(255) as u8,
            ..motor
        }
    }
}

fn factor(mean: u16) -> u8 {
    let nominal = u16::from(NOMINAL_DECIVOLTS) << MEAN_BITS;
    if mean.abs_diff(nominal) <= NEAR {
        return ONE;
    }
    divide(
        u32::from(nominal) * u32::from(ONE) + u32::from(mean) / 2,
        u32::from(mean),
    ) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over all values of `round`.
    fn at(decivolts: u8, duty: u8) -> f32 {
        let mut supply = Supply::new();
        for _ in 0..100 {
            supply.observe(decivolts);
        }
        let motors = (Motor::forward(duty), Motor::backward(duty));
        let mut sum = 0.0;
        for round in 0..=u8::MAX {
            let (left, right) = supply.at_pins(motors, round);
            assert_eq!((left.duty, left.reverse), (right.duty, false));
            assert!(right.reverse);
            sum += f32::from(left.duty);
        }
        sum / 256.0
    }

    #[test]
    fn a_duty_means_the_same_voltage_on_every_battery() {
        for decivolts in [100, 105, 118, 126] {
            let duty = 100.0 * 11.1 / (f32::from(decivolts) / 10.0 + 0.05);
            let at = at(decivolts, 100);
            // The factor has steps of 1/128.
            assert!((at - duty).abs() <= 0.5, "{decivolts}: {at}");
        }
        assert_eq!(at(90, 255), 255.0, "there is no more than all");
        assert_eq!(at(126, 0), 0.0);
    }

    #[test]
    fn about_the_nominal_battery_and_without_one_nothing_is_corrected() {
        for decivolts in [0, 50, 110, 111, 150, 255] {
            assert_eq!(at(decivolts, 100), 100.0, "{decivolts}");
        }
    }

    #[test]
    fn one_wrong_reading_changes_little() {
        let mut supply = Supply::new();
        for _ in 0..100 {
            supply.observe(111);
        }
        supply.observe(130);
        let (left, _) = supply.at_pins((Motor::forward(100), Motor::OFF), 0);
        assert!((98..=100).contains(&left.duty), "{}", left.duty);
    }
}
