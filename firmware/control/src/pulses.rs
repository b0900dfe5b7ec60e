//! Speeds below the full one, for a person who drives: the wheels get the standard duty for a part
//! of the time.
//!
//! ```text
//!  middle   100 |‾‾‾‾‾‾|______|‾‾‾‾‾‾|______|‾‾      slow   100 |‾‾‾|_________|‾‾‾|_________|‾‾
//!                40 ms  40 ms                                   20 ms  60 ms
//! ```
//!
//! A lower duty does not do it. The wheels break loose at a duty that differs from motor to motor,
//! about three quarters of the standard one: a little above it one side of a robot crawls and the
//! other stands. With pulses of the duty that drives every robot, both sides turn alike, and the
//! mean speed is a quarter or a half of the full one. A pulse begins with the command, so the wheels
//! obey at once.
//!
//! Only the motor drivers get pulses. Reports tell the mean duty, so that a robot that drives never
//! looks like one that stands.

use lager_wire::Speed;

use crate::Motor;
use crate::board::Motors;
use crate::time::reached;

/// A quarter of a pulse and its pause, in microseconds.
const QUARTER_US: u32 = 20_000;

/// The pulses of one command.
#[derive(Debug, Clone)]
pub(crate) struct Pulses {
    /// For how many quarters the wheels are powered: 4 at full speed.
    powered: u8,
    quarter: u8,
    due_us: u32,
}

impl Pulses {
    /// At full speed there is no pause.
    pub(crate) const NONE: Self = Self {
        powered: 4,
        quarter: 0,
        due_us: 0,
    };

    /// The first pulse begins now.
    pub(crate) fn new(speed: Speed, now_us: u32) -> Self {
        Self {
            powered: match speed {
                Speed::Slow => 1,
                Speed::Middle => 2,
                Speed::Full => 4,
            },
            quarter: 0,
            due_us: now_us.wrapping_add(QUARTER_US),
        }
    }

    pub(crate) fn advance(&mut self, now_us: u32) {
        if self.powered < 4 && reached(now_us, self.due_us) {
            self.quarter = (self.quarter + 1) % 4;
            self.due_us = now_us.wrapping_add(QUARTER_US);
        }
    }

    /// What the drivers get of these duties now.
    pub(crate) fn at_pins(&self, motors: Motors) -> Motors {
        match self.quarter < self.powered {
            true => motors,
            false => both(motors, |_| 0),
        }
    }

    /// The mean of these duties.
    pub(crate) fn mean(&self, motors: Motors) -> Motors {
        both(motors, |duty| {
            (u16::from(duty) * u16::from(self.powered) / 4) as u8
        })
    }

    /// When the drivers get other duties.
    pub(crate) fn next_due_us(&self) -> Option<u32> {
        (self.powered < 4).then_some(self.due_us)
    }
}

fn both((left, right): Motors, duty: impl Fn(u8) -> u8) -> Motors {
    let with = |motor: Motor| Motor {
        duty: duty(motor.duty),
        ..motor
    };
    (with(left), with(right))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: Motors = (Motor::forward(104), Motor::forward(96));

    /// For how many of 400 ms the wheels are powered, looked at every millisecond.
    fn powered_ms(speed: Speed, start_us: u32) -> usize {
        let mut pulses = Pulses::new(speed, start_us);
        let powered = |ms: &u32| {
            pulses.advance(start_us.wrapping_add(ms * 1_000));
            pulses.at_pins(AHEAD) == AHEAD
        };
        (0..400).filter(powered).count()
    }

    #[test]
    fn each_speed_powers_the_wheels_for_its_part_of_the_time() {
        // Also where the clock wraps.
        for start_us in [0, u32::MAX - 70_000] {
            assert_eq!(powered_ms(Speed::Slow, start_us), 100);
            assert_eq!(powered_ms(Speed::Middle, start_us), 200);
            assert_eq!(powered_ms(Speed::Full, start_us), 400);
        }
    }

    #[test]
    fn the_mean_is_told_and_a_pause_keeps_the_direction() {
        let back = (Motor::backward(100), Motor::forward(100));
        let mut slow = Pulses::new(Speed::Slow, 0);
        assert_eq!(slow.at_pins(back), back, "the first pulse begins at once");
        assert_eq!(slow.mean(AHEAD), (Motor::forward(26), Motor::forward(24)));
        slow.advance(QUARTER_US);
        assert_eq!(slow.at_pins(back), (Motor::backward(0), Motor::forward(0)));
        assert_eq!(slow.mean(back), (Motor::backward(25), Motor::forward(25)));
        assert_eq!(Pulses::new(Speed::Full, 0).mean(AHEAD), AHEAD);
        assert_eq!(Pulses::NONE.next_due_us(), None);
    }
}
