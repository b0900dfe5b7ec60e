//! Dead reckoning from the steering board's reports: how far the axle has come and how far the
//! robot has turned.
//!
//! Speed is taken as proportional to duty. That is wrong by some per cent, so every judged mark
//! sets the way anew; this is only the bridge between two marks. It never guesses beyond the
//! reports: what the board did not confirm lately counts as standing still, because a board that
//! is silent stops by itself.

use core::time::Duration;

use lager_topics::SteeringReport;
use lager_wire::{Command, SteerFlags, WheelCommand};

use crate::config::LogicConfig;

/// Duty at which the configured speeds hold (PWM_STANDARD).
const STANDARD_DUTY: f32 = 100.0;

/// How long a report is believed; the board stops by itself when its command is this old.
const REPORT_AGE: Duration = Duration::from_millis(150);

/// Way and angle since they were last set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometer {
    /// Way of the axle in mm, negative when backing.
    pub travelled_mm: f32,
    /// Angle turned in degrees, positive = clockwise.
    pub turned_deg: f32,
    /// Way of both wheels in mm, whatever the direction: is the robot moved at all?
    pub stirred_mm: f32,
    left_mm_per_s: f32,
    right_mm_per_s: f32,
    deg_per_s: f32,
    reported: Duration,
    reckoned: Duration,
}

impl Odometer {
    /// Goes on to `now` at the speed last reported.
    pub fn advance(&mut self, now: Duration) {
        let until = now.min(self.reported + REPORT_AGE);
        let span = until.saturating_sub(self.reckoned).as_secs_f32();
        self.reckoned = now.max(self.reckoned);
        let (left, right) = (self.left_mm_per_s, self.right_mm_per_s);
        self.travelled_mm += (left + right) / 2.0 * span;
        self.stirred_mm += (left.abs() + right.abs()) / 2.0 * span;
        self.turned_deg += self.deg_per_s * span;
    }

    /// Takes the duties of a report that has just come.
    pub fn report(&mut self, now: Duration, report: &SteeringReport, config: &LogicConfig) {
        self.advance(now);
        let (left, right) = speeds(report);
        self.left_mm_per_s = left * config.cruise_mm_per_s;
        self.right_mm_per_s = right * config.cruise_mm_per_s;
        self.deg_per_s = (left - right) / 2.0 * config.turn_deg_per_s;
        self.reported = now;
    }
}

/// Speed of both wheels as a share of that at the standard duty.
fn speeds(report: &SteeringReport) -> (f32, f32) {
    let flags = SteerFlags(report.flags);
    // A board of ours locks its arm while the wheels move. No flag at all is an original board,
    // which reports nothing, and the bridge tells what it was told: its duty is the standard one.
    if flags == SteerFlags::NONE && report.left_duty == 0 && report.right_duty == 0 {
        return nominal(report.code);
    }
    let share = |duty: u8, reverse: SteerFlags| {
        let share = f32::from(duty) / STANDARD_DUTY;
        if flags.contains(reverse) {
            -share
        } else {
            share
        }
    };
    (
        share(report.left_duty, SteerFlags::LEFT_REVERSE),
        share(report.right_duty, SteerFlags::RIGHT_REVERSE),
    )
}

/// The speeds a command is carried out with (W1).
fn nominal(code: u8) -> (f32, f32) {
    use WheelCommand::{
        ActiveBackward, ActiveForward, LeftDiag, LeftPerp, ManualBackward, ManualForward,
        ManualLeft, ManualRight, RightDiag, RightPerp, Standby,
    };
    let Some(Command::Wheel(command)) = Command::from_code(code) else {
        return (0.0, 0.0);
    };
    match command {
        Standby => (0.0, 0.0),
        ManualForward | ActiveForward => (1.0, 1.0),
        ManualBackward | ActiveBackward => (-1.0, -1.0),
        ManualLeft | LeftPerp | LeftDiag => (-1.0, 1.0),
        ManualRight | RightPerp | RightDiag => (1.0, -1.0),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn report(left: u8, right: u8, flags: SteerFlags) -> SteeringReport {
        SteeringReport {
            left_duty: left,
            right_duty: right,
            flags: flags.0,
            ..SteeringReport::default()
        }
    }

    fn after_a_second(reports: &SteeringReport) -> Odometer {
        let mut odometer = Odometer::default();
        for step in 0..10 {
            odometer.report(
                Duration::from_millis(step * 100),
                reports,
                &LogicConfig::default(),
            );
        }
        odometer.advance(Duration::from_secs(1));
        odometer
    }

    #[test]
    fn standard_duty_is_cruising_speed() {
        let odometer = after_a_second(&report(100, 100, SteerFlags(0)));
        assert!((odometer.travelled_mm - 73.3).abs() < 0.1, "{odometer:?}");
        assert!(odometer.turned_deg.abs() < 0.01, "{odometer:?}");
    }

    #[test]
    fn a_quarter_turn_takes_three_seconds_and_no_way() {
        let right = after_a_second(&report(100, 100, SteerFlags::RIGHT_REVERSE));
        assert!((right.turned_deg - 30.0).abs() < 0.1, "{right:?}");
        assert!(right.travelled_mm.abs() < 0.01, "{right:?}");
        assert!((right.stirred_mm - 73.3).abs() < 0.1, "{right:?}");
        let left = after_a_second(&report(100, 100, SteerFlags::LEFT_REVERSE));
        assert!((left.turned_deg + 30.0).abs() < 0.1, "{left:?}");
    }

    #[test]
    fn an_original_board_is_believed_to_do_what_it_was_told() {
        let told = |command: WheelCommand| SteeringReport {
            code: Command::Wheel(command).code(),
            ..SteeringReport::default()
        };
        let forward = after_a_second(&told(WheelCommand::ActiveForward));
        assert!((forward.travelled_mm - 73.3).abs() < 0.1, "{forward:?}");
        let left = after_a_second(&told(WheelCommand::LeftPerp));
        assert!((left.turned_deg + 30.0).abs() < 0.1, "{left:?}");
        // A board of ours that has not started its motors yet shows its locked arm.
        let waiting = SteeringReport {
            flags: SteerFlags::ARM_LOCKED.0,
            ..told(WheelCommand::ActiveForward)
        };
        assert!(after_a_second(&waiting).travelled_mm.abs() < 0.01);
    }

    #[test]
    fn a_silent_board_stands_still() {
        let mut odometer = Odometer::default();
        let config = LogicConfig::default();
        odometer.report(Duration::ZERO, &report(100, 100, SteerFlags(0)), &config);
        odometer.advance(Duration::from_secs(10));
        assert!(
            (odometer.travelled_mm - 73.3 * 0.15).abs() < 0.1,
            "{odometer:?}"
        );
        odometer.report(
            Duration::from_secs(20),
            &report(0, 0, SteerFlags(0)),
            &config,
        );
        assert!(
            (odometer.travelled_mm - 73.3 * 0.15).abs() < 0.1,
            "{odometer:?}"
        );
    }

    proptest! {
        #[test]
        fn how_often_it_is_advanced_does_not_matter(
            left in 0u8..=255,
            right in 0u8..=255,
            steps in prop::collection::vec(1u64..40, 1..30),
        ) {
            let reports = report(left, right, SteerFlags(0));
            let config = LogicConfig::default();
            let (mut often, mut once) = (Odometer::default(), Odometer::default());
            often.report(Duration::ZERO, &reports, &config);
            once.report(Duration::ZERO, &reports, &config);
            let mut now = Duration::ZERO;
            for step in steps {
                now += Duration::from_millis(step);
                often.advance(now);
            }
            once.advance(now);
            prop_assert!((often.travelled_mm - once.travelled_mm).abs() < 0.05);
            prop_assert!((often.turned_deg - once.turned_deg).abs() < 0.05);
        }
    }
}
