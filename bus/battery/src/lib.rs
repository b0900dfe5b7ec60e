//! How much charge the battery has left, and for how long that lasts, from its voltage alone.
//!
//! ```text
//!  4.2 V |\                          voltage of one lithium cell over its charge
//!        | \________
//!  3.7 V |          \_________       The robot always works, so its battery reads a little lower
//!        |                    \__    than at rest: the percentage is rather too low than too high.
//!  3.0 V |_______________________|
//!      100 %                     0
//! ```
//!
//! The voltage sags whenever the motors start, and the board tells it in steps of 0.1 V, which in
//! the middle of the curve are 8 %. So a percentage is the mean of about a minute. How long the
//! charge lasts is told only when it has fallen steadily for some minutes. Until somebody has told
//! how many cells the battery has, and for a robot that cannot measure it, nothing is told.
//!
//! It is apart, so that all who tell of a battery tell the same. It never reads a clock.

use core::time::Duration;
use std::collections::VecDeque;

/// Volts of a lithium-polymer cell that is discharged slowly, over the part of its charge that is
/// left.
const CELL: [(f64, f64); 8] = [
    (0.0, 3.0),
    (0.05, 3.45),
    (0.1, 3.6),
    (0.25, 3.7),
    (0.5, 3.8),
    (0.75, 3.95),
    (0.9, 4.07),
    (1.0, 4.2),
];
/// A mean forgets older readings after about this time.
const MEAN: Duration = Duration::from_secs(60);
/// How often the charge is kept.
const STEP: Duration = Duration::from_secs(10);
/// No time is told before the charge has been watched for this long, nor from older values than
/// `MOST`.
const LEAST: Duration = Duration::from_secs(300);
const MOST: Duration = Duration::from_secs(900);
/// How much of the change a straight line must explain (the square of the correlation).
const CLEAR: f64 = 0.8;
/// A fall of less than this in the time watched is none: one step of the board's reading is more.
const FALL: f64 = 0.03;

/// A robot's battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pack {
    /// Lithium cells in series; 0: not known.
    pub cells: u8,
    /// The voltage, in tenths of a volt, at which the robot stands; 0: never.
    pub low_decivolts: u8,
}

impl Pack {
    /// The part of its charge that is left at a voltage in tenths of a volt, 0 to 1.
    fn charge(self, decivolts: f64) -> f64 {
        let volts = decivolts / 10.0 / f64::from(self.cells);
        let after = CELL.partition_point(|point| point.1 <= volts);
        let (a, b) = match after {
            0 => return 0.0,
            after if after == CELL.len() => return 1.0,
            after => (CELL[after - 1], CELL[after]),
        };
        a.0 + (b.0 - a.0) * (volts - a.1) / (b.1 - a.1)
    }
}

/// The battery as its readings tell it.
#[derive(Clone, Debug, Default)]
pub struct Battery {
    pack: Pack,
    /// When the last reading came, and the mean of the charge until then.
    mean: Option<(Duration, f64)>,
    /// The charge of the last minutes, the oldest first.
    kept: VecDeque<(Duration, f64)>,
}

impl Battery {
    /// A battery without a reading.
    #[must_use]
    pub fn new(pack: Pack) -> Self {
        Self {
            pack,
            ..Self::default()
        }
    }

    /// Takes a reading of this moment of the robot's clock, in tenths of a volt; 0: not known.
    pub fn read(&mut self, now: Duration, decivolts: u8) {
        if self.pack.cells == 0 || decivolts == 0 {
            return;
        }
        let charge = self.pack.charge(f64::from(decivolts));
        let mean = match self.mean {
            Some((at, mean)) => {
                let passed = now.saturating_sub(at).as_secs_f64() / MEAN.as_secs_f64();
                mean + (charge - mean) * passed.min(1.0)
            }
            None => charge,
        };
        self.mean = Some((now, mean));
        let is_due = |(at, _): &(Duration, f64)| now.saturating_sub(*at) >= STEP;
        if self.kept.back().is_none_or(is_due) {
            self.kept.push_back((now, mean));
        }
        let is_old = |(at, _): &(Duration, f64)| now.saturating_sub(*at) > MOST;
        while self.kept.front().is_some_and(is_old) {
            self.kept.pop_front();
        }
    }

    /// The part of its charge that is left, in percent.
    #[must_use]
    pub fn percent(&self) -> Option<u8> {
        let (_, charge) = self.mean?;
        Some((charge * 100.0).round() as u8)
    }

    /// How long it lasts until the robot stands, if its charge falls clearly.
    #[must_use]
    pub fn left(&self) -> Option<Duration> {
        let (first, now) = (self.kept.front()?.0, self.kept.back()?.0);
        let watched = now.saturating_sub(first);
        if watched < LEAST {
            return None;
        }
        let points = self.kept.iter().map(|(at, charge)| {
            let since = at.saturating_sub(first).as_secs_f64();
            (since, *charge)
        });
        let (slope, explained) = line(points);
        let falls = -slope * watched.as_secs_f64();
        if falls < FALL || explained < CLEAR {
            return None;
        }
        let low = match self.pack.low_decivolts {
            0 => 0.0,
            low => self.pack.charge(f64::from(low)),
        };
        let (_, charge) = self.mean?;
        Some(Duration::from_secs_f64((charge - low).max(0.0) / -slope))
    }
}

/// The slope of the straight line through these points, and how much of their change it explains,
/// 0 to 1.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let count = points.clone().count() as f64;
    let mean = |of: fn((f64, f64)) -> f64| points.clone().map(of).sum::<f64>() / count;
    let (x_mean, y_mean) = (mean(|(x, _)| x), mean(|(_, y)| y));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in points {
        let (dx, dy) = (x - x_mean, y - y_mean);
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    if xx == 0.0 || yy == 0.0 {
        return (0.0, 0.0);
    }
    (xy / xx, xy * xy / (xx * yy))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACK: Pack = Pack {
        cells: 3,
        low_decivolts: 100,
    };

    /// A battery that has been read ten times a second for these minutes, at the voltage that
    /// `volts` gives for each second.
    fn read_for(minutes: u64, volts: impl Fn(u64) -> f64) -> Battery {
        let mut battery = Battery::new(PACK);
        for tenth in 0..minutes * 600 {
            let decivolts = (volts(tenth / 10) * 10.0).round() as u8;
            battery.read(Duration::from_millis(tenth * 100), decivolts);
        }
        battery
    }

    #[test]
    fn a_voltage_is_a_percentage_between_empty_and_full() {
        for (volts, percent) in [
            (8.0, 0),
            (9.0, 0),
            (11.1, 25),
            (11.4, 50),
            (12.6, 100),
            (13.5, 100),
        ] {
            assert_eq!(read_for(1, |_| volts).percent(), Some(percent), "{volts}");
        }
        let all: Vec<_> = (80..=135_u8).map(|it| PACK.charge(it.into())).collect();
        assert!(all.is_sorted(), "{all:?}");
    }

    #[test]
    fn what_nobody_has_told_or_measured_is_not_known() {
        let mut unknown = Battery::new(Pack::default());
        unknown.read(Duration::from_secs(1), 111);
        assert_eq!((unknown.percent(), unknown.left()), (None, None));
        let mut unread = Battery::new(PACK);
        unread.read(Duration::from_secs(1), 0);
        assert_eq!((unread.percent(), unread.left()), (None, None));
    }

    #[test]
    fn a_start_of_the_motors_is_no_loss_of_charge() {
        let mut battery = read_for(3, |_| 11.4);
        for tenth in 1_800..1_830 {
            battery.read(Duration::from_millis(tenth * 100), 108);
        }
        assert!(battery.percent() >= Some(47), "{:?}", battery.percent());
    }

    #[test]
    fn a_battery_that_falls_steadily_tells_how_long_it_lasts() {
        // From 75 % to 50 % in twelve minutes; the motors start again and again.
        let battery = read_for(12, |second| {
            let sag = if second % 20 < 12 { 0.1 } else { 0.0 };
            11.85 - 0.45 * second as f64 / 720.0 - sag
        });
        let minutes = battery.left().expect("it falls").as_secs() as f64 / 60.0;
        let right = (0.5 - PACK.charge(100.0)) / (0.25 / 12.0);
        let off = minutes / right;
        assert!((0.6..1.6).contains(&off), "{minutes} {right}");
    }

    #[test]
    fn a_battery_that_does_not_fall_clearly_tells_no_time() {
        for battery in [
            read_for(4, |second| 11.85 - second as f64 / 1_000.0),
            read_for(12, |_| 11.4),
            // It is charged.
            read_for(12, |second| 11.4 + second as f64 / 2_000.0),
            // It drives and stands in turns, each for two minutes.
            read_for(12, |second| 11.4 - 0.2 * (second / 120 % 2) as f64),
        ] {
            assert_eq!(battery.left(), None, "{:?}", battery.kept);
        }
    }
}
