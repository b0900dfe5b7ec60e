//! Learns how much the two motors differ: on a straight line the regulator must always add the same
//! correction, and this bias is added to the duties from then on (W3, W6).
//!
//! ```text
//!   settled corrections --> mean of the last second --- at a mark --> bias: left + b, right - b
//! ```
//!
//! The line before a mark of the grid is straight; the way to the delivery may be curved. So the
//! mean becomes the bias only at a mark, but not at the delivery's bar and not at the first mark
//! after it. The corrections that bring the robot to its line after a turn say nothing about the
//! motors, and a station's mark may come soon after a turn, so a following must first settle.
//! The bias is a fraction of a duty step, rounded up and down in turn: near the duty at which the
//! wheels break loose, one step may be a tenth of the speed, and half a step too much bends a way
//! without a line by 5 degrees in 150 mm. The bias is added wherever both sides should turn alike:
//! to every correction, to turns on the spot (which would otherwise wander) and to the commands by
//! hand.
//!
//! The EEPROM keeps the bias, so that the first turn after a restart ends at its mark. It wears out
//! after 100 000 writes of a byte, so only a bias is kept that is confirmed (the robot has stopped
//! following, and no bar can take it back any more) and that differs from the kept one by half a
//! duty step or more. Twenty simulated robots saved it 43 times in 21 missions each, none more than 8
//! times (2026-11-30).

use lager_wire::LineState;

use crate::Motor;
use crate::board::Motors;
use crate::time::reached;

/// Time from one correction in the mean to the next, in microseconds.
const PERIOD_US: u32 = 20_000;
/// The mean is over about 2^6 corrections.
const MEAN_BITS: u8 = 6;
/// So many corrections do not count when following begins: in these 3 s the robot comes to its
/// line.
const SETTLED: u8 = 150;
/// The mean is used after this many corrections.
const LEAST: u8 = 225;
/// The greatest bias, in duty steps.
const MOST: i16 = 12;
/// A bias that differs by less from the kept one is not kept, in 256ths of a duty step.
const WORTH: i16 = 128;
/// A robot that leaves the bar at an angle may see a line for so many words after tape on both
/// sides: 150 ms.
const ASKEW: u8 = 30;
/// Value of `end` after the line has ended, until the next mark.
const ENDED: u8 = u8::MAX;

/// The mean of the corrections, and the bias learnt from it.
#[derive(Debug, Clone, Default)]
pub struct Sides {
    /// In 256ths of a duty step.
    mean: i16,
    seen: u8,
    due_us: u32,
    /// In 256ths of a duty step.
    bias: i16,
    /// The bias before the last mark, as long as that may be a bar's.
    before: i16,
    /// Words until tape on both sides no longer counts as the line's end, or [`ENDED`].
    // One byte for both: with two, a step took so long that a byte from the Pi had to wait.
    end: u8,
}

impl Sides {
    /// Both motors alike, as nothing is known yet.
    pub const fn new() -> Self {
        Self {
            mean: 0,
            seen: 0,
            due_us: 0,
            bias: 0,
            before: 0,
            end: 0,
        }
    }

    /// Begins with the bias that the EEPROM keeps; without a possible one as [`Self::new`].
    pub fn of_kept(kept: Option<[u8; 2]>) -> Self {
        let bias = possible(kept);
        Self {
            mean: bias,
            bias,
            before: bias,
            ..Self::new()
        }
    }

    /// What the EEPROM should keep in place of `kept`, if it is worth a write.
    pub fn to_keep(&self, kept: Option<[u8; 2]>) -> Option<[u8; 2]> {
        // A bias changes only while following counts, and after a bar it may be an old one.
        let is_confirmed = self.seen == 0 && self.end == 0;
        let is_other = || (self.bias - possible(kept)).abs() >= WORTH;
        (is_confirmed && is_other()).then(|| self.bias.to_le_bytes())
    }

    /// Takes in a correction in duty steps (bias included) and the line's state when it was given.
    // Not inlined: in the step itself it would take registers from code that cannot wait.
    #[inline(never)]
    pub fn observe(&mut self, correction: i16, state: LineState, now_us: u32) {
        let before = self.end;
        if before != 0 && before != ENDED {
            self.end = before - 1;
        }
        let goes_on = matches!(
            state,
            LineState::OnLine | LineState::LeftOfLine | LineState::RightOfLine
        );
        if before == 1 && goes_on {
            self.settle();
        }
        match state {
            LineState::StationToLeft | LineState::StationToRight | LineState::FourWay => {
                if state == LineState::FourWay {
                    self.end = ASKEW;
                } else if before == ENDED {
                    self.end = 0;
                }
                if before == ENDED {
                    self.pause();
                } else if self.seen >= LEAST {
                    self.before = self.bias;
                    self.bias = self.mean;
                    self.seen = SETTLED;
                }
            }
            LineState::NotOnLine | LineState::DropStation
                if before != 0 || state == LineState::DropStation =>
            {
                if before != ENDED {
                    self.bias = self.before;
                }
                self.end = ENDED;
            }
            _ if self.seen > 0 && !reached(now_us, self.due_us) => {}
            _ => {
                self.due_us = now_us.wrapping_add(PERIOD_US);
                self.seen = self.seen.saturating_add(1);
                if self.seen <= SETTLED {
                    return;
                }
                let missing = (correction.clamp(-MOST, MOST) << 8) - self.mean;
                self.mean += (missing + (1 << (MEAN_BITS - 1))) >> MEAN_BITS;
            }
        }
    }

    /// To be called while the robot does not follow a line.
    pub fn pause(&mut self) {
        self.mean = self.bias;
        self.seen = 0;
        self.settle();
    }

    /// What the last mark has taught holds, if that was no bar.
    fn settle(&mut self) {
        if self.end == 0 {
            self.before = self.bias;
        }
    }

    /// Duty steps to add to the left side and to take from the right. `round` decides how the
    /// fraction is rounded; over all its values the mean is exact to a 256th of a step.
    pub fn bias(&self, round: u8) -> i16 {
        (self.bias + i16::from(round)) >> 8
    }

    /// Adds the bias to duties that should move both sides alike: the standard one or 0.
    pub fn alike(&self, motors: Motors, round: u8) -> Motors {
        let bias = self.bias(round);
        let with = |motor: Motor, bias: i16| Motor {
            duty: if motor.duty == 0 {
                0
            } else {
                (i16::from(motor.duty) + bias) as u8
            },
            ..motor
        };
        (with(motors.0, bias), with(motors.1, -bias))
    }
}

/// The bias in these bytes of the EEPROM, in 256ths of a duty step; 0 if it cannot be one.
fn possible(kept: Option<[u8; 2]>) -> i16 {
    let bias = kept.map_or(0, i16::from_le_bytes);
    match (-MOST << 8..=MOST << 8).contains(&bias) {
        true => bias,
        false => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: LineState = LineState::OnLine;
    const MARK: LineState = LineState::FourWay;

    /// The mean of the bias over all values of `round`.
    fn bias(sides: &Sides) -> f32 {
        let sum: i32 = (0..=255).map(|round| i32::from(sides.bias(round))).sum();
        sum as f32 / 256.0
    }

    fn follow(sides: &mut Sides, correction: i16, ms: u32, state: LineState) {
        let start_us = sides.due_us;
        for at_ms in 0..ms {
            let now_us = start_us.wrapping_add(at_ms * 1_000);
            sides.observe(correction, state, now_us);
        }
    }

    /// A mean of a second and a half still holds a little of what was before.
    fn assert_about(bias: f32, expected: f32) {
        assert!((bias - expected).abs() < 0.25, "{bias} for {expected}");
    }

    #[test]
    fn what_is_always_added_before_a_mark_is_learnt() {
        let mut sides = Sides::new();
        follow(&mut sides, 4, 10_000, LINE);
        assert_about(bias(&sides), 0.0);
        follow(&mut sides, 4, 100, MARK);
        assert_about(bias(&sides), 4.0);
        let turning = (Motor::backward(100), Motor::forward(100));
        let both = sides.alike(turning, u8::MAX);
        assert_eq!(both, (Motor::backward(104), Motor::forward(96)));
        assert_eq!(
            sides.alike((Motor::OFF, Motor::OFF), 0),
            (Motor::OFF, Motor::OFF)
        );
    }

    #[test]
    fn a_part_of_a_step_is_learnt_and_given_as_a_mean() {
        let mut sides = Sides::new();
        // The regulator gives three quarters of a step.
        for round in 0..400 {
            let correction = i16::from(round % 4 != 0);
            follow(&mut sides, correction, 20, LINE);
        }
        follow(&mut sides, 1, 100, MARK);
        let bias = bias(&sides);
        assert!((0.6..0.8).contains(&bias), "{bias}");
        assert!((0..=255).all(|round| [0, 1].contains(&sides.bias(round))));
    }

    #[test]
    fn a_mark_soon_after_a_turn_teaches_nothing_and_a_curve_is_forgotten() {
        let mut sides = Sides::new();
        follow(&mut sides, 20, 3_000, LINE);
        follow(&mut sides, 20, 100, MARK);
        assert_about(bias(&sides), 0.0);
        sides.pause();
        follow(&mut sides, 20, 1_900, LINE);
        follow(&mut sides, 0, 2_000, LINE);
        follow(&mut sides, 0, 100, MARK);
        assert_about(bias(&sides), 0.0);
        sides.pause();
        follow(&mut sides, 20, 5_000, LINE);
        follow(&mut sides, 0, 10_000, LINE);
        follow(&mut sides, 0, 100, MARK);
        assert_about(bias(&sides), 0.0);
    }

    #[test]
    fn the_way_to_the_delivery_and_back_teaches_nothing() {
        let mut sides = Sides::new();
        follow(&mut sides, 4, 10_000, LINE);
        follow(&mut sides, 4, 100, MARK);
        for _ in 0..2 {
            // A bend, the bar and its end, then a bend and the corner.
            follow(&mut sides, 20, 10_000, LINE);
            follow(&mut sides, 20, 100, MARK);
            follow(&mut sides, 20, 100, LineState::DropStation);
            assert_about(bias(&sides), 4.0);
            sides.pause();
            follow(&mut sides, -20, 10_000, LINE);
            follow(&mut sides, -20, 100, MARK);
            assert_about(bias(&sides), 4.0);
        }
        follow(&mut sides, 7, 10_000, LINE);
        follow(&mut sides, 7, 100, MARK);
        assert_about(bias(&sides), 7.0);
    }

    #[test]
    fn the_bar_may_be_left_at_an_angle() {
        let mut sides = Sides::new();
        follow(&mut sides, 20, 10_000, LINE);
        follow(&mut sides, 20, 15, LineState::StationToRight);
        follow(&mut sides, 20, 20, MARK);
        assert_about(bias(&sides), f32::from(MOST));
        follow(&mut sides, 20, 20, LineState::RightOfLine);
        follow(&mut sides, 20, 20, LineState::NotOnLine);
        assert_about(bias(&sides), 0.0);
        // The corner, on the way back.
        follow(&mut sides, -20, 10_000, LINE);
        follow(&mut sides, -20, 100, MARK);
        assert_about(bias(&sides), 0.0);
    }

    #[test]
    fn a_bias_is_kept_when_following_ends_and_is_there_after_a_restart() {
        let mut sides = Sides::new();
        assert_eq!(sides.to_keep(None), None);
        follow(&mut sides, 4, 10_000, LINE);
        follow(&mut sides, 4, 100, LineState::StationToLeft);
        assert_eq!(sides.to_keep(None), None, "it still follows");
        sides.pause();
        let kept = sides.to_keep(None);
        assert_about(bias(&Sides::of_kept(kept)), 4.0);
        assert_eq!(sides.to_keep(kept), None);
        // Over a mark on both sides, which may be a bar's, to the next line.
        follow(&mut sides, 7, 10_000, LINE);
        follow(&mut sides, 7, 100, MARK);
        sides.pause();
        assert_eq!(sides.to_keep(kept), None);
        follow(&mut sides, 7, 500, LINE);
        sides.pause();
        assert_about(bias(&Sides::of_kept(sides.to_keep(kept))), 7.0);
    }

    #[test]
    fn what_a_bar_takes_back_is_not_kept() {
        let kept = Some((4_i16 << 8).to_le_bytes());
        let mut sides = Sides::of_kept(kept);
        follow(&mut sides, 10, 10_000, LINE);
        follow(&mut sides, 10, 100, MARK);
        sides.pause();
        assert_eq!(sides.to_keep(kept), None, "it stands on the bar");
        follow(&mut sides, 10, 20, MARK);
        follow(&mut sides, 10, 20, LineState::NotOnLine);
        sides.pause();
        assert_eq!(sides.to_keep(kept), None, "it has taken it back");
        assert_about(bias(&sides), 4.0);
        // The corner, on the way back.
        follow(&mut sides, -10, 10_000, LINE);
        follow(&mut sides, -10, 100, LineState::StationToLeft);
        sides.pause();
        assert_eq!(sides.to_keep(kept), None);
    }

    #[test]
    fn a_bar_that_has_taught_nothing_takes_nothing_back() {
        for way_ms in [0, 500] {
            let mut sides = Sides::new();
            follow(&mut sides, 4, 10_000, LINE);
            follow(&mut sides, 4, 100, MARK);
            follow(&mut sides, 4, way_ms, LINE);
            sides.pause();
            follow(&mut sides, 4, 1_000, LINE);
            follow(&mut sides, 4, 100, MARK);
            follow(&mut sides, 4, 100, LineState::DropStation);
            assert_about(bias(&sides), 4.0);
        }
    }

    #[test]
    fn less_than_half_a_step_is_not_worth_a_write() {
        for kept in [-700_i16, 0, 700] {
            for (other, is_worth) in [(0, false), (127, false), (-127, false), (128, true)] {
                let sides = Sides::of_kept(Some((kept + other).to_le_bytes()));
                let to_keep = sides.to_keep(Some(kept.to_le_bytes()));
                assert_eq!(to_keep.is_some(), is_worth, "{kept} {other}");
            }
        }
    }

    #[test]
    fn what_no_bias_can_be_is_not_taken() {
        for (kept, taken) in [
            (3_072, 3_072),
            (-3_072, -3_072),
            (3_073, 0),
            (-3_073, 0),
            (i16::MAX, 0),
            (i16::MIN, 0),
        ] {
            let sides = Sides::of_kept(Some(i16::to_le_bytes(kept)));
            assert_eq!(sides.bias, taken);
        }
    }

    #[test]
    fn there_is_a_most() {
        for way in [1, -1] {
            let mut sides = Sides::new();
            follow(&mut sides, way * 2_000, 20_000, LINE);
            follow(&mut sides, 0, 10, MARK);
            assert_about(bias(&sides), f32::from(way * MOST));
        }
    }
}
