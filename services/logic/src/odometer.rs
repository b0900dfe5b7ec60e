//! Dead reckoning from the steering board's reports: how far the axle has come and how far the
//! robot has turned.
//!
//! It takes speed as proportional to duty, which is wrong by ten per cent and more. So every judged
//! mark corrects the distance, and teaches how fast these wheels really are: the odometer takes
//! over half of the error between two marks. A successor learns it again. Dead reckoning only fills
//! the gap between two marks. It never goes beyond the reports: without a recent report the wheels
//! count as standing still, because a board that is silent stops by itself.

use core::time::Duration;

use lager_topics::SteeringReport;
use lager_wire::{COMMAND_AGE, Command, SteerFlags, WheelCommand};

use crate::config::LogicConfig;

/// If two marks are nearer than this, in mm, the odometer learns nothing between them: a mark's own
/// position is not exact enough.
const LEAST_LESSON_MM: f32 = 150.0;
/// The part of the error that it takes over.
const BELIEVED: f32 = 0.5;
/// How much faster or slower than configured wheels can be, at most.
const MOST_FASTER: f32 = 0.3;

/// Way and angle since they were last set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometer {
    /// Distance of the axle in mm, negative when backing.
    pub travelled_mm: f32,
    /// Angle turned in degrees, positive = clockwise.
    pub turned_deg: f32,
    /// Distance since the last mark, in mm, by dead reckoning.
    lesson_mm: f32,
    /// How much faster than configured these wheels are, as a part.
    faster: f32,
    mm_per_s: f32,
    deg_per_s: f32,
    reported: Duration,
    reckoned: Duration,
}

impl Odometer {
    /// Goes on to `now` at the last reported speed.
    pub fn advance(&mut self, now: Duration) {
        let until = now.min(self.reported + COMMAND_AGE);
        let span = until.saturating_sub(self.reckoned).as_secs_f32();
        self.reckoned = now.max(self.reckoned);
        let way_mm = self.mm_per_s * span;
        self.travelled_mm += way_mm;
        self.lesson_mm += way_mm;
        self.turned_deg += self.deg_per_s * span;
    }

    /// Takes the duties of a report that has just come.
    pub fn report(&mut self, now: Duration, report: &SteeringReport, config: &LogicConfig) {
        self.advance(now);
        let (left, right) = speeds(report, config.duty);
        let (left, right) = (left * (1.0 + self.faster), right * (1.0 + self.faster));
        // In a turn on the spot the board makes both sides turn alike. So different duties then
        // show how much the motors differ, not that the axle moves.
        self.mm_per_s = match left * right < 0.0 {
            true => 0.0,
            false => (left + right) / 2.0 * config.cruise_mm_per_s,
        };
        self.deg_per_s = (left - right) / 2.0 * config.turn_deg_per_s;
        self.reported = now;
    }

    /// A mark with a known place shows that the distance is `missing_mm` longer than reckoned.
    pub fn correct(&mut self, missing_mm: f32) {
        self.travelled_mm += missing_mm;
        let reckoned_mm = core::mem::take(&mut self.lesson_mm);
        if reckoned_mm >= LEAST_LESSON_MM {
            let missing = (missing_mm / reckoned_mm).clamp(-MOST_FASTER, MOST_FASTER);
            let faster = (1.0 + self.faster) * (1.0 + BELIEVED * missing) - 1.0;
            self.faster = faster.clamp(-MOST_FASTER, MOST_FASTER);
        }
    }

    /// A person has moved the robot: the distance since the last mark teaches nothing.
    pub fn forget_way(&mut self) {
        self.lesson_mm = 0.0;
    }
}

/// Speed of both wheels, as a part of the speed at the standard duty.
fn speeds(report: &SteeringReport, standard: u8) -> (f32, f32) {
    let flags = SteerFlags(report.flags);
    // A board of ours locks its arm while the wheels move. A report without flags is that of an
    // original board, which reports nothing: the bridge fills in the command that it was sent, and
    // such a board uses the standard duty.
    if flags == SteerFlags::NONE && report.left_duty == 0 && report.right_duty == 0 {
        return nominal(report.code);
    }
    let share = |duty: u8, reverse: SteerFlags| {
        let share = f32::from(duty) / f32::from(standard);
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

/// The speeds at which a board carries out a command (W1).
fn nominal(code: u8) -> (f32, f32) {
    use WheelCommand::{
        ActiveBackward, ActiveForward, LeftDiag, LeftPerp, ManualBackward, ManualForward,
        ManualLeft, ManualRight, RightDiag, RightPerp, Standby,
    };
    let Some(Command::Wheel(command)) = Command::from_code(code) else {
        return (0.0, 0.0);
    };
    match command.at_full() {
        Standby => (0.0, 0.0),
        ManualForward | ActiveForward => (1.0, 1.0),
        ManualBackward | ActiveBackward => (-1.0, -1.0),
        ManualLeft | LeftPerp | LeftDiag => (-1.0, 1.0),
        ManualRight | RightPerp | RightDiag => (1.0, -1.0),
        // `at_full` gives none of these.
        _ => (0.0, 0.0),
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
    fn marks_teach_how_fast_the_wheels_are() {
        let config = LogicConfig::default();
        let mut odometer = Odometer::default();
        let mut now = Duration::ZERO;
        let mut missing = f32::MAX;
        // Wheels that are 12 % slower than configured, a mark each 500 mm.
        for _ in 0..8 {
            odometer.travelled_mm = 0.0;
            let mut really_mm = 0.0;
            while really_mm < 500.0 {
                odometer.report(now, &report(100, 100, SteerFlags(0)), &config);
                now += Duration::from_millis(10);
                odometer.advance(now);
                really_mm += 0.88 * config.cruise_mm_per_s * 0.01;
            }
            missing = 500.0 - odometer.travelled_mm;
            odometer.correct(missing);
            assert!((odometer.travelled_mm - 500.0).abs() < 0.1);
        }
        assert!(missing.abs() < 5.0, "{missing}");
    }

    #[test]
    fn a_short_way_teaches_nothing() {
        let mut odometer = after_a_second(&report(100, 100, SteerFlags(0)));
        odometer.correct(40.0);
        assert_eq!(odometer.faster, 0.0);
        assert!((odometer.travelled_mm - 113.3).abs() < 0.1);
    }

    #[test]
    fn a_quarter_turn_takes_three_seconds_and_no_way() {
        let right = after_a_second(&report(100, 100, SteerFlags::RIGHT_REVERSE));
        assert!((right.turned_deg - 30.0).abs() < 0.1, "{right:?}");
        assert!(right.travelled_mm.abs() < 0.01, "{right:?}");
        // A report of a board that compensates for unequal motors.
        let unlike = after_a_second(&report(105, 95, SteerFlags::RIGHT_REVERSE));
        assert!(unlike.travelled_mm.abs() < 0.01, "{unlike:?}");
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
