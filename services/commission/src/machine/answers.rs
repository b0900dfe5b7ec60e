//! What follows from each answer.

use core::time::Duration;

use lager_orders::{Mode, Moment};
use lager_wire::{BUILD, FULL_TURNS_MS, OperatorCommand, Speed, Version};

use super::shown::volts;
use super::{Commissioning, Effect, State, is_obeyed};
use crate::answer::{Answer, Way};
use crate::range::{DISTANCES_CM, Point};
use crate::step::{Question, Step};
use crate::words::Said;
use crate::{line, range, wheels};

/// How far a meter's voltage may be from the board's, in tenths of a volt.
const METER: u8 = 10;
/// Possible lengths of a measured drive, in cm.
const LENGTHS_CM: [f32; 2] = [30.0, 300.0];
/// Possible speeds, in mm/s.
const SPEEDS_MM_PER_S: [f32; 2] = [10.0, 1_000.0];

impl Commissioning {
    pub(super) fn answered(&mut self, now: Moment, answer: Answer) -> Result<(), Said> {
        let silent = || Said::from("no_values");
        match (self.question, answer) {
            (Question::Boards, Answer::Yes) => {
                self.boards_fit(now.robot)?;
                self.enter_unchanged(now, Step::Line);
            }
            (Question::LineSway, Answer::Yes) => {
                let health = self.known(now.robot).ok_or("bridge_silent")?;
                self.state = State::Calibrates {
                    since: now.robot,
                    ended_before: health.calibrations_ended,
                };
                self.effects.push(Effect::Calibrate);
            }
            (Question::LineFloor, Answer::Yes) => {
                self.found.floor = self.bits.mode(now.robot).ok_or_else(silent)?;
                self.ask(Question::LineTape);
            }
            (Question::LineTape, Answer::Yes) => {
                let tape = self.bits.mode(now.robot).ok_or_else(silent)?;
                let is_inverted = line::is_inverted(self.found.floor, tape)?;
                let line = &mut self.built.robot.sensors.line;
                line.dark_is_high ^= is_inverted;
                let said = match line.dark_is_high {
                    true => "found_polarity_high",
                    false => "found_polarity_low",
                };
                self.done(now, said);
            }
            (Question::RangeFar, Answer::Number(cm)) => {
                self.found.far = self.point(now.robot, cm)?;
                self.ask(Question::RangeNear);
            }
            (Question::RangeNear, Answer::Number(cm)) => {
                let near = self.point(now.robot, cm)?;
                let ranger = range::sensor(self.found.far, near)?;
                self.built.robot.sensors.ranger = ranger;
                self.done(now, range::said(&ranger));
            }
            (Question::WheelsAhead, Answer::Yes) => {
                self.begin(now, OperatorCommand::Forward(Speed::Full), true)?;
            }
            (Question::WheelsLeft, Answer::Yes) => {
                self.begin(now, OperatorCommand::Left(Speed::Full), true)?;
            }
            (Question::SawAhead, Answer::Ways(ways)) => {
                if ways.contains(&Way::Still) {
                    return Err("wheel_still".into());
                }
                self.found.ahead = Some(ways);
                self.ask(Question::WheelsLeft);
            }
            (Question::SawLeft, Answer::Ways(left)) => {
                let ahead = self.found.ahead.unwrap_or([Way::Still; 2]);
                let plain = self.built.robot.steering.wheels;
                let wheels = wheels::connected(plain, ahead, left)?;
                self.built.robot.steering.wheels = wheels;
                self.done(now, wheels::said(&wheels));
            }
            (Question::Battery, Answer::No) => {
                self.built.robot.steering.divider = false;
                self.done(now, "found_no_divider");
            }
            (Question::Battery, Answer::Number(meter)) => {
                let [low, high] = self.volts(now.robot).ok_or_else(silent)?;
                let meter_decivolts = (meter * 10.0).round().clamp(0.0, 255.0) as u8;
                let is_near = |value: u8| value.abs_diff(meter_decivolts) <= METER;
                if !is_near(low) || !is_near(high) {
                    let values: [(_, &dyn ToString); 3] = [
                        ("low", &volts(low)),
                        ("high", &volts(high)),
                        ("volts", &meter),
                    ];
                    return Err(Said::new("battery_unfit", &values));
                }
                self.built.robot.steering.divider = true;
                self.done(now, "found_divider");
            }
            (Question::Turn, Answer::Yes) => {
                self.begin(now, OperatorCommand::Left(Speed::Full), false)?;
                self.question = Question::TurnRound;
            }
            (Question::Speed, Answer::Number(cm)) => {
                let [least, most] = LENGTHS_CM;
                within(cm, least, most)?;
                self.found.length_mm = cm * 10.0;
                self.begin(now, OperatorCommand::FollowForward, false)?;
                self.question = Question::SpeedThere;
            }
            (Question::Finish, Answer::Yes) => {
                self.effects.push(Effect::Keep(self.built));
                self.state = State::Over;
            }
            (Question::Finish, Answer::No) => self.quit(now),
            (
                Question::ButtonsFree
                | Question::ResetButton
                | Question::ModeSwitch
                | Question::SwitchAutonomous,
                _,
            ) => return self.buttons_answered(now, answer),
            // A person who says no to a movement, or not yet, is asked again.
            _ => return self.arm_answered(now, answer),
        }
        Ok(())
    }

    /// A movement that waited for an answer has taken so long.
    pub(super) fn measured(&mut self, now: Moment, span: Duration) -> Result<(), Said> {
        if self.question == Question::TurnRound {
            let [least, most] = [*FULL_TURNS_MS.start(), *FULL_TURNS_MS.end()];
            let ms = u16::try_from(span.as_millis()).unwrap_or(u16::MAX);
            if !FULL_TURNS_MS.contains(&ms) {
                let values: [(_, &dyn ToString); 3] =
                    [("ms", &ms), ("least", &least), ("most", &most)];
                return Err(Said::new("turn_unfit", &values));
            }
            self.built.robot.steering.wheels.full_turn_ms = ms;
            self.done(now, Said::new("found_turn", &[("ms", &ms)]));
            return Ok(());
        }
        let speed = (self.found.length_mm / span.as_secs_f32() * 10.0).round() / 10.0;
        let [least, most] = SPEEDS_MM_PER_S;
        if !(least..=most).contains(&speed) {
            let values: [(_, &dyn ToString); 3] =
                [("speed", &speed), ("least", &least), ("most", &most)];
            return Err(Said::new("speed_unfit", &values));
        }
        self.built.cruise_mm_per_s = speed;
        self.done(now, Said::new("found_speed", &[("speed", &speed)]));
        Ok(())
    }

    /// Whether both boards are there, fit, and may be moved by hand.
    fn boards_fit(&self, now: Duration) -> Result<(), Said> {
        let health = self.known(now).ok_or("bridge_silent")?;
        for board in [&health.sensor, &health.steering] {
            if board.up == 0 {
                return Err("not_both_boards".into());
            }
            if board.version == Version::Original as u8 {
                return Err("original_board".into());
            }
            if board.misfit().is_some() {
                let values: [(_, &dyn ToString); 2] = [("build", &board.build), ("wanted", &BUILD)];
                return Err(Said::new("board_misfit", &values));
            }
        }
        if health.mode != Mode::Manual {
            return Err("not_by_hand".into());
        }
        if health.stopped != 0 {
            return Err("stop_in_force".into());
        }
        if !is_obeyed(health) {
            return Err("undescribed".into());
        }
        Ok(())
    }

    /// A known distance, and what the sensor reads there.
    fn point(&self, now: Duration, cm: f32) -> Result<Point, Said> {
        let [least, most] = DISTANCES_CM;
        within(cm, least.into(), most.into())?;
        let reading = self.readings.median(now).ok_or("no_values")?;
        Ok((cm.round() as u8, reading))
    }
}

fn within(value: f32, least: f32, most: f32) -> Result<(), Said> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let values: [(_, &dyn ToString); 3] = [("value", &value), ("least", &least), ("most", &most)];
    Err(Said::new("number_unfit", &values))
}
