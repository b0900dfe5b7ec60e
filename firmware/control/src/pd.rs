//! The line regulator: PD on integers (W3).
//!
//! `u = Kp * e + Kd * (e(t) - e(t - 10 ms))`, in duty steps, positive = turn right. P acts on every
//! word from the sensor board. D is a difference over 10 ms however often words come, so the gains
//! mean the same at every baud rate; a difference over another time is scaled to 10 ms.
//!
//! While the line is under the outer sensors, P counts once more: `u += Kp * (|e| - 5)` with the
//! sign of `e`. A robot whose motors need much duty for little speed gets round the tightest bend
//! with this. Without it the error stays at its limit there, and any small disturbance loses the
//! line.
//!
//! ```text
//!   samples:   ...  e3   e2   e1   e(now)
//!   age in ms:      15   10    5     0
//!                         '--------- D: the newest sample at least 7.5 ms old
//! ```

use crate::divide::divide;

/// Gains of the regulator, in duty steps per half sensor step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gains {
    /// `CONST_PROP`.
    pub p: u8,
    /// `CONST_DER`, over 10 ms.
    pub d: u8,
}

impl Default for Gains {
    /// The original's (W3).
    fn default() -> Self {
        Self { p: 2, d: 2 }
    }
}

/// Beyond this error, in half sensor steps, the line is under the outer sensors.
const OUTER: i8 = 5;

/// D is the difference over this time, in microseconds.
const SPAN_US: u32 = 10_000;
/// D uses the newest sample that is at least this old, in microseconds.
const LEAST_AGE_US: u32 = 7_500;
/// A sample is remembered only this long after the one before, in microseconds, so that four
/// samples always reach back far enough.
const SPACING_US: u32 = 2_400;
/// After a pause this long, in microseconds, older samples say nothing.
const STALE_US: u32 = 50_000;

#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    at_us: u32,
    error: i8,
}

/// The regulator, and the samples that it remembers, newest first.
#[derive(Debug, Clone, Default)]
pub struct Pd {
    gains: Gains,
    samples: [Sample; 4],
    count: u8,
}

impl Pd {
    /// A regulator that remembers no sample.
    #[must_use]
    pub fn new(gains: Gains) -> Self {
        Self {
            gains,
            samples: [Sample::default(); 4],
            count: 0,
        }
    }

    /// The gains in force.
    #[must_use]
    pub fn gains(&self) -> Gains {
        self.gains
    }

    /// Changes the gains; the samples stay.
    pub fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }

    /// Takes in the error at `now_us` and returns the correction `u` in duty steps.
    ///
    /// `error` is in half sensor steps, positive = the line is to the right.
    pub fn update(&mut self, error: i8, now_us: u32) -> i16 {
        let since_us = now_us.wrapping_sub(self.samples[0].at_us);
        if since_us > STALE_US {
            self.count = 0;
        }
        let beyond = error - error.clamp(-OUTER, OUTER);
        let p = i16::from(self.gains.p) * i16::from(error + beyond);
        let d = self.derivative(error, now_us);
        if self.count == 0 || since_us >= SPACING_US {
            self.remember(Sample {
                at_us: now_us,
                error,
            });
        }
        p + d
    }

    fn derivative(&self, error: i8, now_us: u32) -> i16 {
        let past = &self.samples[..usize::from(self.count)];
        let Some((age, sample)) = past
            .iter()
            .map(|sample| (now_us.wrapping_sub(sample.at_us), sample))
            .find(|(age, _)| *age >= LEAST_AGE_US)
        else {
            return 0;
        };
        let change = i32::from(error) - i32::from(sample.error);
        if change == 0 {
            return 0;
        }
        let scaled = change * i32::from(self.gains.d) * SPAN_US as i32;
        rounded(scaled, age) as i16
    }

    fn remember(&mut self, sample: Sample) {
        let last = self.samples.len() - 1;
        self.samples.copy_within(..last, 1);
        self.samples[0] = sample;
        self.count = (self.count + 1).min(self.samples.len() as u8);
    }
}

/// Quotient with halves rounded away from zero, so that left and right stay mirrored.
fn rounded(dividend: i32, divisor: u32) -> i32 {
    let size = divide(dividend.unsigned_abs() + divisor / 2, divisor).cast_signed();
    if dividend < 0 { -size } else { size }
}
