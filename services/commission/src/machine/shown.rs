//! The values that a person sees while a question waits.

use core::time::Duration;

use super::{Commissioning, State};
use crate::line;
use crate::step::Step;
use crate::words::Said;

impl Commissioning {
    /// The values that belong to the present step, as they are now.
    pub fn shown(&self, now: Duration) -> Said {
        let none = || Said::from("live_none");
        match (self.state, self.step) {
            (_, Step::Arm | Step::Poses | Step::Joints | Step::Claw) => {
                self.arm_shown().unwrap_or_else(none)
            }
            (State::Tells { .. }, _) => "live_tells".into(),
            (State::Calibrates { .. }, _) => {
                let sensors = self.health.iter().flat_map(|(_, health)| health.calibrated);
                let count = sensors.filter(|sensor| sensor.tells_apart != 0).count();
                Said::new("live_calibration", &[("count", &count)])
            }
            (
                State::Moves {
                    begun: Some(begun),
                    is_pulse: false,
                    ..
                },
                _,
            ) => {
                let seconds = format!("{:.1}", now.saturating_sub(begun).as_secs_f32());
                Said::new("live_seconds", &[("seconds", &seconds)])
            }
            (_, Step::Line) => self.bits.mode(now).map_or_else(none, |bits| {
                Said::new("live_line", &[("bits", &line::bar(bits))])
            }),
            (_, Step::Distance) => self.readings.median(now).map_or_else(none, |reading| {
                Said::new("live_range", &[("reading", &reading)])
            }),
            (_, Step::Wheels | Step::Turn | Step::Speed) => {
                self.report.map_or_else(none, |report| {
                    let duties: [(_, &dyn ToString); 2] =
                        [("left", &report.left_duty), ("right", &report.right_duty)];
                    Said::new("live_wheels", &duties)
                })
            }
            (_, Step::Battery) => self.volts(now).map_or_else(none, |[low, high]| {
                let values: [(_, &dyn ToString); 2] =
                    [("low", &volts(low)), ("high", &volts(high))];
                Said::new("live_battery", &values)
            }),
            (_, Step::Buttons) => self.buttons_shown().unwrap_or_else(none),
            (_, Step::Boards | Step::Finish) => {
                let health = self.health.map(|(_, health)| health).unwrap_or_default();
                let board = |board: lager_topics::BoardHealth| match board.up {
                    0 => Said::from("board_gone"),
                    _ => Said::new("board_up", &[("build", &board.build)]),
                };
                Said::of(
                    "live_boards",
                    [
                        ("sensor", board(health.sensor)),
                        ("steering", board(health.steering)),
                    ],
                )
            }
        }
    }

    /// The least and the greatest voltage of the last half second, in tenths of a volt.
    pub(super) fn volts(&self, now: Duration) -> Option<[u8; 2]> {
        let all = self.volts.all(now)?;
        Some([*all.first()?, *all.last()?])
    }
}

/// Volts, as a person reads them.
pub(super) fn volts(decivolts: u8) -> String {
    format!("{:.1}", f32::from(decivolts) / 10.0)
}
