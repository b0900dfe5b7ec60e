//! What all manoeuvres share: what the robot senses of the floor and of itself, and how to report.

use core::time::Duration;

use lager_floor::Heading;
use lager_wire::{Command, LineState, WheelCommand};

use crate::arm::ArmSeen;
use crate::command::Standing;
use crate::config::LogicConfig;
use crate::marks::MarkReader;
use crate::odometer::Odometer;
use crate::output::Output;

/// Standing still.
pub(crate) const STANDBY: Command = Command::Wheel(WheelCommand::Standby);

/// What the robot has sensed of the floor and of itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Senses {
    pub(crate) odometer: Odometer,
    pub(crate) marks: MarkReader,
    /// An earlier navigator began the mark under the sensors; it may be one frame of noise.
    pub(crate) mark_cut_short: bool,
    /// The last line state, and when it came.
    pub(crate) sight: Option<(Duration, LineState)>,
    /// The last line state that two frames in a row have shown. One frame of noise cannot do that.
    pub(crate) sure_sight: Option<LineState>,
    /// Whether tape was seen since the robot was put down, or since this navigator began.
    pub(crate) tape_seen: bool,
    /// From the delivery corner to the cross bar, as measured on the way out; 0 = never driven.
    pub(crate) exit_mm: f32,
    pub(crate) arm: ArmSeen,
    /// The last distance in front, in cm, and when it came.
    pub(crate) distance: Option<(Duration, u8)>,
    /// When the robot last turned.
    pub(crate) turned_at: Duration,
    /// The robot came along the line along which it looks, so nothing stands close behind it.
    pub(crate) free_behind: bool,
}

impl Senses {
    /// Takes a line frame.
    pub(crate) fn see(&mut self, now: Duration, state: LineState) {
        let before = self.sight.replace((now, state)).map(|(_, before)| before);
        if before == Some(state) {
            self.sure_sight = before;
            self.tape_seen |= !is_no_line(state);
        }
    }

    /// The middle of the tape that the sensors have just left, in mm from the last node.
    pub(crate) fn mark_at(&self, config: &LogicConfig) -> f32 {
        self.odometer.travelled_mm + config.sensor_ahead_mm - config.tape_mm / 2.0
    }

    /// Corrects the odometer by a tape whose middle is known to be at `at_mm`.
    pub(crate) fn set_by_mark(&mut self, at_mm: f32, config: &LogicConfig) {
        let missing_mm = at_mm - self.mark_at(config);
        self.odometer.correct(missing_mm);
    }
}

/// Whether the sensors see no tape.
pub(crate) fn is_no_line(state: LineState) -> bool {
    matches!(state, LineState::NotOnLine | LineState::DropStation)
}

/// A moment of standing before a one-shot is judged or begun.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Pause {
    /// No such moment: the robot does its work.
    #[default]
    None,
    /// It has to begin.
    Wanted,
    /// It ends then.
    Until(Duration),
}

impl Pause {
    /// Goes on. Returns whether the moment has ended now; it ends only if the robot may drive.
    pub(crate) fn is_over(&mut self, now: Duration, settle: Duration, active: bool) -> bool {
        match *self {
            Self::Wanted => *self = Self::Until(now + settle),
            Self::Until(end) if now >= end && active => {
                *self = Self::None;
                return true;
            }
            _ => {}
        }
        false
    }
}

/// What a manoeuvre may read and change while it decides on one input.
pub(crate) struct Helm<'a> {
    pub(crate) now: Duration,
    pub(crate) config: &'a LogicConfig,
    /// The navigator may drive, and the steering board is heard.
    pub(crate) active: bool,
    pub(crate) senses: &'a mut Senses,
    /// Where the robot looks.
    pub(crate) heading: &'a mut Heading,
    /// The order in force.
    pub(crate) order: &'a mut Standing,
    pub(crate) out: &'a mut Output,
}

/// Where the axle must stand to turn round on the way out, in mm from the corner. A turn ends on
/// the first tape under the sensors, so the place is far enough from the cross bar and, on a short
/// way out, from the corner.
pub(crate) fn turning_place(exit_mm: f32, config: &LogicConfig) -> f32 {
    let reach = config.sensor_ahead_mm + config.tape_mm;
    (exit_mm - config.sensor_ahead_mm - config.back_off_mm).max(reach)
}
