//! One motor driver with its wheel pair: duty in, wheel speed out.
//!
//! ```text
//!  speed
//!    |            /           speed = gain * CRUISE * (duty - DEAD_BAND) / (100 - DEAD_BAND)
//!    |           /            followed with a lag of 90 ms
//!    |__________/____ duty
//!       dead band
//! ```
//! Each motor of each seed has its own gain error and a slowly wandering disturbance, so the
//! robot does not drive straight by itself, as the real one does not (W6).

use crate::noise::Noise;

/// Wheel speed in mm/s at the standard duty.
pub const CRUISE: f64 = 73.3;
/// The standard duty (W1).
pub const STANDARD_DUTY: f64 = 100.0;
/// Duty at which a wheel pair begins to move: a four-wheeled platform that turns by skidding and
/// carries an arm needs about a third of the supply to break loose.
pub const DEAD_BAND: f64 = 75.0;
/// Time constant of the speed in s.
pub const LAG: f64 = 0.09;
/// Largest gain error of a motor.
pub const GAIN_ERROR: f64 = 0.03;

/// Time constant of the wandering disturbance in s.
const WANDER_LAG: f64 = 0.5;
/// Standard deviation of the wandering disturbance, as a part of the speed.
const WANDER: f64 = 0.008;

/// A motor and its state.
#[derive(Clone, Debug)]
pub struct Motor {
    gain: f64,
    wander: f64,
    target: f64,
    speed: f64,
    noise: Noise,
}

impl Motor {
    /// A motor at rest whose gain error and disturbance come from `noise`.
    pub fn new(mut noise: Noise) -> Self {
        Self {
            gain: 1.0 + noise.spread(GAIN_ERROR),
            wander: 0.0,
            target: 0.0,
            speed: 0.0,
            noise,
        }
    }

    /// Sets the duty, -255..=255; negative turns the wheels backwards.
    pub fn set_duty(&mut self, duty: i16) {
        let duty = f64::from(duty.clamp(-255, 255));
        let effective = (duty.abs() - DEAD_BAND).max(0.0) / (STANDARD_DUTY - DEAD_BAND);
        self.target = (effective * CRUISE * self.gain).copysign(duty);
    }

    /// Advances by `seconds`, which is short against the lag.
    pub fn step(&mut self, seconds: f64) {
        if self.target == 0.0 && self.speed == 0.0 {
            return;
        }
        let kick = WANDER * (2.0 * seconds / WANDER_LAG).sqrt();
        self.wander += self.noise.bell(kick) - self.wander * seconds / WANDER_LAG;
        let target = self.target * (1.0 + self.wander);
        self.speed += (target - self.speed) * seconds / LAG;
        if self.target == 0.0 && self.speed.abs() < 0.05 {
            self.speed = 0.0;
        }
    }

    /// Speed of the wheels in mm/s, positive forwards.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Takes up a speed, as when a kept world is resumed.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(duty: i16, milliseconds: usize) -> Motor {
        let mut motor = Motor::new(Noise::new(5, 1));
        motor.set_duty(duty);
        for _ in 0..milliseconds {
            motor.step(0.001);
        }
        motor
    }

    #[test]
    fn the_standard_duty_gives_cruise_speed_within_the_gain_error() {
        let speed = run(100, 2_000).speed();
        assert!(
            (speed / CRUISE - 1.0).abs() < GAIN_ERROR + 4.0 * WANDER,
            "{speed}"
        );
        let back = run(-100, 2_000).speed();
        assert!((back + speed).abs() < 1e-9, "{back}");
    }

    #[test]
    fn below_the_dead_band_nothing_moves() {
        assert_eq!(run(DEAD_BAND as i16, 500).speed(), 0.0);
    }

    #[test]
    fn speed_follows_with_a_lag_and_comes_to_rest() {
        let mut motor = run(100, 90);
        let reached = motor.speed() / CRUISE;
        assert!(
            (0.55..0.72).contains(&reached),
            "63 % after one lag, not {reached}"
        );
        motor.set_duty(0);
        for _ in 0..1_000 {
            motor.step(0.001);
        }
        assert_eq!(motor.speed(), 0.0);
    }
}
