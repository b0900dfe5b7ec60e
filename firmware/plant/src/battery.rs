//! The battery: three lithium cells that sag under load and run down.
//!
//! ```text
//!  12.6 V |\
//!         | \________                  voltage at rest over charge
//!  11.1 V |          \_________
//!         |                    \__     under load: less by the current times the resistance
//!   9.0 V |_______________________|
//!       100 %                     0
//! ```
//! The curve is that of three lithium-polymer cells in series that are discharged slowly, 4.2 V to
//! 3.0 V each. The currents are those of a Raspberry Pi with two boards, two pairs of gear motors
//! and eight servos that hold a pose. A robot as drawn always has 11.1 V.

use crate::make::Make;
use crate::noise::Noise;

/// The voltage at which the standard duty gives cruising speed.
pub const NOMINAL: f64 = 11.1;
/// Charge of a full battery in ampere-hours.
pub const CAPACITY: f64 = 2.2;
/// Voltage at rest over the charge that is left.
const AT_REST: [(f64, f64); 8] = [
    (0.0, 9.0),
    (0.05, 10.35),
    (0.1, 10.8),
    (0.25, 11.1),
    (0.5, 11.4),
    (0.75, 11.85),
    (0.9, 12.2),
    (1.0, 12.6),
];
/// Current of the Pi, the boards and the servos in amperes.
const STANDING: f64 = 1.6;
/// Current of one motor at the standard duty in amperes.
const DRIVING: f64 = 0.8;

/// The battery and its charge.
#[derive(Clone, Debug)]
pub struct Battery {
    make: Make,
    resistance: f64,
    charge: f64,
    volts: f64,
}

impl Battery {
    /// A battery; its charge and its resistance come from `noise`.
    pub fn new(mut noise: Noise, make: Make) -> Self {
        let mut battery = Self {
            make,
            resistance: make.draw(&mut noise, 0.0, 0.06, 0.14),
            charge: make.draw(&mut noise, 1.0, 0.5, 1.0),
            volts: NOMINAL,
        };
        battery.step(0.0, [0, 0]);
        battery
    }

    /// Takes the robot's current at these duties from the charge for `seconds`.
    pub fn step(&mut self, seconds: f64, duties: [i16; 2]) {
        if self.make == Make::Nominal {
            return;
        }
        let duty: f64 = duties.iter().map(|duty| f64::from(duty.abs())).sum();
        let amperes = STANDING + DRIVING * duty / 100.0;
        self.charge = (self.charge - amperes * seconds / 3_600.0 / CAPACITY).max(0.0);
        self.volts = at_rest(self.charge) - amperes * self.resistance;
    }

    /// The voltage now.
    pub fn volts(&self) -> f64 {
        self.volts
    }

    /// The part of the charge that is left, 0 to 1.
    pub fn charge(&self) -> f64 {
        self.charge
    }

    /// Sets the charge, 0 to 1.
    pub fn set_charge(&mut self, charge: f64) {
        self.charge = charge.clamp(0.0, 1.0);
        self.step(0.0, [0, 0]);
    }
}

fn at_rest(charge: f64) -> f64 {
    let after = AT_REST
        .partition_point(|point| point.0 <= charge)
        .clamp(1, AT_REST.len() - 1);
    let (a, b) = (AT_REST[after - 1], AT_REST[after]);
    a.1 + (b.1 - a.1) * (charge - a.0) / (b.0 - a.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn battery(make: Make) -> Battery {
        Battery::new(Noise::new(3, 1), make)
    }

    #[test]
    fn it_sags_under_load_and_comes_back() {
        let mut battery = battery(Make::Varied);
        let rest = battery.volts();
        battery.step(0.001, [100, -100]);
        let driven = battery.volts();
        battery.step(0.001, [0, 0]);
        assert!(driven < rest - 0.05, "{rest} {driven}");
        assert!((battery.volts() - rest).abs() < 0.001);
    }

    #[test]
    fn it_runs_down_in_about_an_hour() {
        let mut battery = battery(Make::Varied);
        battery.set_charge(1.0);
        let full = battery.volts();
        for _ in 0..30 {
            battery.step(60.0, [100, 100]);
        }
        assert!(battery.volts() < full - 0.5, "{}", battery.volts());
        for _ in 0..30 {
            battery.step(60.0, [100, 100]);
        }
        assert_eq!(battery.charge(), 0.0);
        assert!(battery.volts() < 9.0);
    }

    #[test]
    fn one_as_drawn_never_changes() {
        let mut battery = battery(Make::Nominal);
        battery.step(3_600.0, [255, 255]);
        assert_eq!(battery.volts(), NOMINAL);
    }
}
