//! The modes of the wheels, one for each group of wheel commands, and the duties of each mode
//! (W1-W5, T5).
//!
//! ```text
//!        2,4,6,9 (any speed)          3,5                    7,8,10,11
//!   Manual <------------ any ------------------> Follow     any ----> Turn
//!      |                                           |                   | time up, tape
//!      '------------------- 1 ---------------------'---> Standby <-----'
//! ```
//!
//! Every wheel command replaces the mode before it; only a turn ends by itself. The duty is the
//! standard one or 0 in every mode except following; [`crate::pulses`] makes a person's lower speeds
//! of it. [`crate::follow`] gives following up without words or tape; the robot then stands until the
//! next command.

use lager_wire::{LineBits, WheelCommand, WheelsProfile};

use crate::Motor;
use crate::board::Motors;
use crate::follow::{Follow, Lost};
use crate::pulses::Pulses;
use crate::turn::{Angle, Rotation, Turn};

/// Both sides standing still.
pub(crate) const STILL: Motors = (Motor::OFF, Motor::OFF);

/// The direction in which the robot follows the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Along {
    Forward,
    Backward,
}

#[derive(Debug, Clone)]
enum Mode {
    Standby,
    Manual(WheelCommand, Pulses),
    Follow {
        along: Along,
        seq: u8,
        watch: Follow,
    },
    /// `under_way` is `None` until the wheels may turn.
    Turn {
        command: WheelCommand,
        seq: u8,
        rotation: Rotation,
        angle: Angle,
        under_way: Option<Turn>,
    },
}

/// The wheels' mode.
#[derive(Debug, Clone)]
pub(crate) struct Wheels {
    mode: Mode,
    profile: WheelsProfile,
}

impl Wheels {
    pub(crate) const fn new(profile: WheelsProfile) -> Self {
        Self {
            mode: Mode::Standby,
            profile,
        }
    }

    /// What is in force.
    pub(crate) fn profile(&self) -> &WheelsProfile {
        &self.profile
    }

    /// Puts another description of the wheels in force; they stand from now on. The caller has
    /// ended their command.
    pub(crate) fn set_profile(&mut self, profile: WheelsProfile) {
        self.mode = Mode::Standby;
        self.profile = profile;
    }

    /// The orders to the two drivers for these motors.
    pub(crate) fn at_drivers(&self, (mut left, mut right): Motors) -> Motors {
        let profile = &self.profile;
        left.reverse ^= profile.left_reversed;
        right.reverse ^= profile.right_reversed;
        if profile.swapped {
            (right, left)
        } else {
            (left, right)
        }
    }

    /// Enters the mode of a command.
    pub(crate) fn start(&mut self, command: WheelCommand, seq: u8, now_us: u32) {
        let turn = |rotation, angle| Mode::Turn {
            command,
            seq,
            rotation,
            angle,
            under_way: None,
        };
        let follow = |along| Mode::Follow {
            along,
            seq,
            watch: Follow::new(now_us),
        };
        self.mode = match command {
            WheelCommand::Standby => Mode::Standby,
            WheelCommand::ActiveForward => follow(Along::Forward),
            WheelCommand::ActiveBackward => follow(Along::Backward),
            WheelCommand::LeftPerp => turn(Rotation::Left, Angle::Perpendicular),
            WheelCommand::LeftDiag => turn(Rotation::Left, Angle::Diagonal),
            WheelCommand::RightPerp => turn(Rotation::Right, Angle::Perpendicular),
            WheelCommand::RightDiag => turn(Rotation::Right, Angle::Diagonal),
            by_hand => Mode::Manual(by_hand, Pulses::new(by_hand.speed(), now_us)),
        };
    }

    /// Breaks off a turn; returns its number if one was under way.
    pub(crate) fn abort_turn(&mut self) -> Option<u8> {
        let Mode::Turn { seq, .. } = self.mode else {
            return None;
        };
        self.mode = Mode::Standby;
        Some(seq)
    }

    /// Ends a turn that is over, and returns its number. Starts the clock of a turn that may begin.
    pub(crate) fn advance(&mut self, may_turn: bool, now_us: u32) -> Option<u8> {
        let (seq, rotation, angle, under_way) = match &mut self.mode {
            Mode::Turn {
                seq,
                rotation,
                angle,
                under_way,
                ..
            } => (seq, rotation, angle, under_way),
            Mode::Manual(_, pulses) => {
                pulses.advance(now_us);
                return None;
            }
            _ => return None,
        };
        match under_way {
            Some(turn) if turn.is_over(now_us) => {
                let seq = *seq;
                self.mode = Mode::Standby;
                Some(seq)
            }
            Some(_) => None,
            None => {
                if may_turn {
                    let full_turn_us = u32::from(self.profile.full_turn_ms) * 1_000;
                    let duration_us = angle.duration_us(full_turn_us);
                    *under_way = Some(Turn::new(*rotation, duration_us, now_us));
                }
                None
            }
        }
    }

    /// Takes in a word from the sensor board.
    pub(crate) fn on_word(&mut self, bits: LineBits, at_us: u32) {
        match &mut self.mode {
            Mode::Turn {
                under_way: Some(turn),
                ..
            } => turn.on_word(bits, at_us),
            Mode::Follow { watch, .. } => watch.on_word(bits, at_us),
            _ => {}
        }
    }

    /// Gives up following without words or tape; returns its number once.
    pub(crate) fn give_up(&mut self, now_us: u32) -> Option<u8> {
        match &mut self.mode {
            Mode::Follow { seq, watch, .. } => watch.gives_up(now_us).then_some(*seq),
            _ => None,
        }
    }

    /// What stayed away, if following was given up, until the next command.
    pub(crate) fn lost(&self) -> Option<Lost> {
        match &self.mode {
            Mode::Follow { watch, .. } => watch.lost(),
            _ => None,
        }
    }

    /// The motors in this mode. `correction` is the regulator's, or `None` without a line to
    /// follow.
    pub(crate) fn motors(&self, correction: Option<i16>) -> Motors {
        let ahead = Motor::forward(self.profile.duty);
        let back = Motor::backward(self.profile.duty);
        match &self.mode {
            Mode::Manual(command, _) => match command.at_full() {
                WheelCommand::ManualForward => (ahead, ahead),
                WheelCommand::ManualBackward => (back, back),
                WheelCommand::ManualLeft => (back, ahead),
                WheelCommand::ManualRight => (ahead, back),
                _ => STILL,
            },
            Mode::Follow { along, watch, .. } if watch.lost().is_none() => {
                correction.map_or(STILL, |u| follow(*along, self.profile.duty, u))
            }
            Mode::Turn {
                under_way: Some(turn),
                ..
            } => match turn.rotation() {
                Rotation::Left => (back, ahead),
                Rotation::Right => (ahead, back),
            },
            Mode::Standby | Mode::Follow { .. } | Mode::Turn { .. } => STILL,
        }
    }

    /// The pulses in which the motors get their duties.
    pub(crate) fn pulses(&self) -> &Pulses {
        match &self.mode {
            Mode::Manual(_, pulses) => pulses,
            _ => &Pulses::NONE,
        }
    }

    pub(crate) fn is_standby(&self) -> bool {
        matches!(self.mode, Mode::Standby)
    }

    pub(crate) fn is_turning(&self) -> bool {
        matches!(self.mode, Mode::Turn { .. })
    }

    /// Whether the robot follows a line.
    pub(crate) fn follows(&self) -> bool {
        matches!(self.mode, Mode::Follow { .. })
    }

    /// Whether the robot follows a line forwards.
    pub(crate) fn follows_forward(&self) -> bool {
        matches!(
            self.mode,
            Mode::Follow {
                along: Along::Forward,
                ..
            }
        )
    }

    /// The command of this mode.
    pub(crate) fn command(&self) -> WheelCommand {
        match self.mode {
            Mode::Standby => WheelCommand::Standby,
            Mode::Manual(command, _) | Mode::Turn { command, .. } => command,
            Mode::Follow {
                along: Along::Forward,
                ..
            } => WheelCommand::ActiveForward,
            Mode::Follow {
                along: Along::Backward,
                ..
            } => WheelCommand::ActiveBackward,
        }
    }

    /// When a turn ends at the latest, following is given up if nothing comes, or a pulse ends.
    pub(crate) fn next_due_us(&self) -> Option<u32> {
        match &self.mode {
            Mode::Turn {
                under_way: Some(turn),
                ..
            } => Some(turn.ends_us()),
            Mode::Follow { watch, .. } => watch.next_due_us(),
            Mode::Manual(_, pulses) => pulses.next_due_us(),
            _ => None,
        }
    }
}

/// Duties around the standard one (AMB-20). Backwards the sensors trail the axle, so the correction
/// has the other sign and is halved (AMB-21). That is unproven and cannot be stable: with trailing
/// sensors any correction lets the axle drift off at about speed / sensor distance. So it is for
/// short ways only.
fn follow(along: Along, duty: u8, correction: i16) -> Motors {
    let around = |correction| around(duty, correction);
    match along {
        Along::Forward => (
            Motor::forward(around(correction)),
            Motor::forward(around(-correction)),
        ),
        Along::Backward => (
            Motor::backward(around(-correction / 2)),
            Motor::backward(around(correction / 2)),
        ),
    }
}

fn around(duty: u8, correction: i16) -> u8 {
    (i16::from(duty) + correction).clamp(0, 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_duties_stand_around_the_standard_and_are_clamped() {
        // Calculated by hand: left = 100 + u, right = 100 - u, both within 0..=255.
        for (u, left, right) in [
            (0, 100, 100),
            (2, 102, 98),
            (-36, 64, 136),
            (100, 200, 0),
            (101, 201, 0),
            (155, 255, 0),
            (156, 255, 0),
            (-7_650, 0, 255),
        ] {
            assert_eq!(
                follow(Along::Forward, 100, u),
                (Motor::forward(left), Motor::forward(right)),
                "u = {u}"
            );
        }
    }

    #[test]
    fn backwards_the_correction_is_halved_and_mirrored() {
        for (u, left, right) in [(0, 100, 100), (10, 95, 105), (-11, 105, 95), (400, 0, 255)] {
            assert_eq!(
                follow(Along::Backward, 100, u),
                (Motor::backward(left), Motor::backward(right)),
                "u = {u}"
            );
        }
    }

    #[test]
    fn a_turn_waits_until_it_may_begin_and_then_has_its_whole_time() {
        let mut wheels = Wheels::new(WheelsProfile::default());
        wheels.start(WheelCommand::RightDiag, 5, 0);
        assert_eq!(wheels.advance(false, 0), None);
        assert_eq!(wheels.motors(None), STILL);
        assert_eq!(wheels.advance(true, 10_000), None);
        assert_eq!(
            wheels.motors(None),
            (Motor::forward(100), Motor::backward(100))
        );
        assert_eq!(wheels.advance(true, 1_509_999), None);
        assert_eq!(wheels.advance(true, 1_510_000), Some(5));
        assert!(wheels.is_standby());
    }

    #[test]
    fn every_way_to_connect_two_motors_drives_the_robot_alike() {
        let wanted = (Motor::forward(90), Motor::backward(110));
        for ways in 0..8_u8 {
            let profile = WheelsProfile {
                swapped: ways & 1 != 0,
                left_reversed: ways & 2 != 0,
                right_reversed: ways & 4 != 0,
                ..WheelsProfile::default()
            };
            let drivers = Wheels::new(profile).at_drivers(wanted);
            // What the wiring makes of the drivers' orders.
            let (mut left, mut right) = if profile.swapped {
                (drivers.1, drivers.0)
            } else {
                drivers
            };
            left.reverse ^= profile.left_reversed;
            right.reverse ^= profile.right_reversed;
            assert_eq!((left, right), wanted, "{profile:?}");
        }
    }

    #[test]
    fn duty_and_time_of_a_turn_are_those_of_the_robot() {
        let mut wheels = Wheels::new(WheelsProfile {
            duty: 140,
            full_turn_ms: 8_000,
            ..WheelsProfile::default()
        });
        wheels.start(WheelCommand::LeftPerp, 5, 0);
        assert_eq!(wheels.advance(true, 0), None);
        assert_eq!(
            wheels.motors(None),
            (Motor::backward(140), Motor::forward(140))
        );
        assert_eq!(wheels.advance(true, 1_999_999), None);
        assert_eq!(wheels.advance(true, 2_000_000), Some(5));
        wheels.start(WheelCommand::ActiveForward, 6, 0);
        assert_eq!(
            wheels.motors(Some(4)),
            (Motor::forward(144), Motor::forward(136))
        );
        wheels.set_profile(WheelsProfile::default());
        assert_eq!(wheels.motors(Some(4)), STILL);
    }

    #[test]
    fn without_a_line_following_stands_still() {
        let mut wheels = Wheels::new(WheelsProfile::default());
        wheels.start(WheelCommand::ActiveForward, 1, 0);
        assert_eq!(wheels.motors(None), STILL);
        assert_eq!(
            wheels.motors(Some(4)),
            (Motor::forward(104), Motor::forward(96))
        );
    }
}
