//! Driving along a line: marks, arrival, and the ways in which a drive can fail.
//!
//! The sensors run ahead of the axle, so a drive to a node has two steps:
//!
//! ```text
//!        axle        sensors
//!   A -----o------------|---------------- B        Seeking: looking for B's mark
//!   A --------------------------o---------|-- B'   ToNode: the mark is behind the sensors,
//!                                                  the axle still has the rest to go
//! ```
//!
//! Each judged mark sets the odometer anew: the sensors have just left the tape's far edge.

use core::time::Duration;

use lager_topics::{Mode, Phase, Step};
use lager_wire::{Command, LineState, WheelCommand};

use super::{Navigator, Output, Pause, say};
use crate::heading::Compass;
use crate::judge::{Edge, Verdict, judge};
use crate::marks::{Mark, Sides};

impl Navigator {
    /// Takes a line frame.
    pub(super) fn line(&mut self, now: Duration, state: LineState, out: &mut Output) {
        self.frames = self.frames.wrapping_add(1);
        let before = self.sight.replace((now, state)).map(|(_, before)| before);
        if before == Some(state) {
            self.sure_sight = before;
        }
        if core::mem::take(&mut self.blind) && before.is_some() && self.is_active() {
            say!(out, "I see again and drive on.");
        }
        if self.mode == Some(Mode::Manual) || !self.follows_line() {
            self.marks.clear();
            return;
        }
        if self.map.is_none() {
            // A successor that is not introduced yet; the mark is judged when it is.
            self.marks.hold(state);
            return;
        }
        let mark = self.marks.push(state);
        match (self.phase, self.step) {
            (Phase::Exiting, _) => self.look_for_cross_bar(mark, state, out),
            (_, Step::Seeking) => {
                if let Some(mark) = mark {
                    self.judge_mark(mark, out);
                }
            }
            (_, Step::NearNode) => {
                if let Some(mark) = mark {
                    self.correct_by_node(mark);
                }
            }
            _ => {}
        }
        self.watch_line(state, out);
    }

    /// Whether the phase drives along a line forwards.
    fn follows_line(&self) -> bool {
        matches!(
            self.phase,
            Phase::Driving | Phase::Approaching | Phase::Exiting | Phase::Returning
        )
    }

    /// The command of a phase that drives.
    pub(super) fn driving_command(&self) -> Option<Command> {
        let command = match self.phase {
            Phase::BackingOff => WheelCommand::ManualBackward,
            _ if !self.follows_line() => return None,
            _ if self.blind => WheelCommand::Standby,
            _ if self.is_past_the_line() => WheelCommand::ManualForward,
            _ => WheelCommand::ActiveForward,
        };
        Some(Command::Wheel(command))
    }

    /// Whether the sensors are beyond the node ahead, and no tape goes straight on there.
    fn is_past_the_line(&self) -> bool {
        let (Some(map), Some(edge)) = (&self.map, self.edge()) else {
            return false;
        };
        if !matches!(self.step, Step::ToNode | Step::NearNode) {
            return false;
        }
        let goes_on = self.phase == Phase::Returning
            || map
                .neighbour(self.node, self.heading)
                .is_some_and(|next| map.has_tape(next, self.heading));
        let sensors_at = self.odometer.travelled_mm + self.config.sensor_ahead_mm;
        !goes_on && sensors_at >= edge.length_mm
    }

    /// Begins to drive along a line on which the robot stands somewhere. A node that is too near
    /// for its mark to be relied on is driven to by dead reckoning, corrected by the mark if it
    /// comes.
    pub(super) fn drive_from_here(&mut self, phase: Phase) {
        self.phase = phase;
        self.step = Step::Seeking;
        self.line_lost_at = None;
        let sensors_at = self.odometer.travelled_mm + self.config.sensor_ahead_mm;
        if self
            .edge()
            .is_some_and(|edge| edge.length_mm - sensors_at < self.config.run_up_mm)
        {
            self.step = Step::NearNode;
        }
    }

    /// A mark seen from close by: the node's, if it is anywhere near its place.
    fn correct_by_node(&mut self, mark: Mark) {
        let Some(edge) = self.edge() else { return };
        let off_mm = (self.mark_at() - edge.length_mm).abs();
        if mark.sides.meets(edge.crossing) && off_mm < self.config.run_up_mm {
            self.set_by_mark(edge.length_mm);
            self.step = Step::ToNode;
        }
    }

    /// Where the middle of a tape is that the sensors have just left, in mm from the last node.
    fn mark_at(&self) -> f32 {
        self.odometer.travelled_mm + self.config.sensor_ahead_mm - self.config.tape_mm / 2.0
    }

    /// Sets the odometer by a tape whose middle is known to be at `at_mm`.
    fn set_by_mark(&mut self, at_mm: f32) {
        let correction = at_mm - self.mark_at();
        self.odometer.travelled_mm += correction;
        self.line_lost_at = None;
    }

    /// What the map promises on the line being driven along.
    fn edge(&self) -> Option<Edge> {
        let map = self.map.as_ref()?;
        let (end, length_mm, stations) = if self.phase == Phase::Returning {
            (map.delivery(), self.exit_mm, Sides::NONE)
        } else {
            (
                map.neighbour(self.node, self.heading)?,
                map.side_mm(),
                map.station_sides(self.node, self.heading),
            )
        };
        Some(Edge {
            length_mm,
            stations,
            crossing: map.crossing_sides(end, self.heading),
        })
    }

    fn judge_mark(&mut self, mark: Mark, out: &mut Output) {
        let Some(edge) = self.edge() else { return };
        let at_mm = self.mark_at();
        let tolerance = if core::mem::take(&mut self.mark_cut_short) {
            self.config.tolerance_cut_short
        } else {
            self.config.tolerance
        };
        match judge(&edge, mark.sides, at_mm, tolerance) {
            Verdict::Node => {
                self.set_by_mark(edge.length_mm);
                self.step = Step::ToNode;
            }
            Verdict::Station => {
                self.set_by_mark(edge.length_mm / 2.0);
                if self.phase == Phase::Approaching && self.is_goal_station(mark.sides) {
                    self.step = Step::ToStation;
                    say!(out, "There is the pick station's mark.");
                }
            }
            Verdict::Unexpected => say!(
                out,
                "A mark to {} {at_mm:.0} mm behind {} is not on my map; I ignore it.",
                mark.sides,
                self.node
            ),
        }
    }

    /// Whether a mark has the side on which the goods of the order stand.
    fn is_goal_station(&self, sides: Sides) -> bool {
        self.station().is_some_and(|station| {
            (sides.left && station.into == self.heading.left())
                || (sides.right && station.into == self.heading.right())
        })
    }

    /// The cross bar at the end of the way out is the place of delivery (E4, AMB-18).
    ///
    /// Left at an angle the bar can look like a line for some frames more, so the end of the line
    /// is waited for.
    fn look_for_cross_bar(&mut self, mark: Option<Mark>, state: LineState, out: &mut Output) {
        match mark {
            Some(mark) if mark.sides == Sides::BOTH => {
                self.exit_mm = self.mark_at();
                self.step = Step::AtBar;
            }
            Some(mark) => say!(out, "A mark to {} on the way out; I ignore it.", mark.sides),
            None => {}
        }
        if self.step != Step::AtBar {
            return;
        }
        if is_no_line(state) {
            self.phase = Phase::Dropping;
            self.step = Step::Seeking;
            self.tries = 0;
            self.pause = Pause::Wanted;
            say!(out, "I am at the place of delivery and let go.");
        } else if self.mark_at() > self.exit_mm + self.config.bar_end_mm {
            self.step = Step::Seeking;
            say!(out, "A crossing on the way out; I ignore it.");
        }
    }

    /// Notes where the line went out of sight and gives up when it stays away.
    fn watch_line(&mut self, state: LineState, out: &mut Output) {
        let should_see = self.follows_line()
            && self.driving_command() == Some(Command::Wheel(WheelCommand::ActiveForward));
        if !should_see || !is_no_line(state) {
            self.line_lost_at = None;
            return;
        }
        let travelled = self.odometer.travelled_mm;
        let since = *self.line_lost_at.get_or_insert(travelled);
        if travelled - since > self.config.line_lost_mm {
            self.get_stuck("I have lost the line", out);
        }
    }

    /// Goes on along the line as far as the odometer says.
    pub(super) fn drive_on(&mut self, now: Duration, out: &mut Output) {
        if self.follows_line() {
            self.watch_frames(now, out);
        }
        let travelled = self.odometer.travelled_mm;
        let coast = self.config.coast_mm;
        match self.phase {
            Phase::Driving | Phase::Approaching | Phase::Returning => {
                let Some(edge) = self.edge() else { return };
                match self.step {
                    Step::ToNode | Step::NearNode if travelled >= edge.length_mm - coast => {
                        self.reach_node(out);
                    }
                    Step::ToStation if travelled >= edge.length_mm / 2.0 - coast => {
                        self.turn_in(edge.length_mm / 2.0, out);
                    }
                    // The way back was measured on the way out by the same wheels, so it may be
                    // relied on where the corner's mark did not come.
                    Step::Seeking
                        if self.phase == Phase::Returning
                            && self.mark_at() > edge.length_mm + self.config.tape_mm =>
                    {
                        self.step = Step::NearNode;
                    }
                    Step::Seeking if self.mark_at() > edge.length_mm * self.config.overdue => {
                        self.get_stuck("The next crossing did not come", out);
                    }
                    _ => {}
                }
            }
            Phase::Exiting if travelled > self.config.longest_exit_mm => {
                self.get_stuck("The cross bar of the delivery did not come", out);
            }
            Phase::BackingOff if travelled <= self.turning_place() => {
                self.begin_turn(self.heading.back(), Phase::TurningRound, out);
            }
            _ => {}
        }
    }

    /// Where the axle stands to turn round on the way out, in mm from the corner: far enough from
    /// the cross bar and, on a short way out, from the corner, because a turn ends on the first
    /// tape that comes under the sensors.
    fn turning_place(&self) -> f32 {
        let reach = self.config.sensor_ahead_mm + self.config.tape_mm;
        (self.exit_mm - self.config.sensor_ahead_mm - self.config.back_off_mm).max(reach)
    }

    /// The axle stands on the pick station's mark: turn in towards the product (L7).
    fn turn_in(&mut self, at_mm: f32, out: &mut Output) {
        let Some(into) = self.station().map(|station| station.into) else {
            return;
        };
        self.odometer.travelled_mm = at_mm;
        self.step = Step::Seeking;
        self.begin_turn(into, Phase::Positioning, out);
    }

    /// Stands still while no line frames come (AMB-49: a silent board).
    fn watch_frames(&mut self, now: Duration, out: &mut Output) {
        let seen = self.sight.map(|(at, _)| at);
        let blind = seen.is_none_or(|at| now.saturating_sub(at) > self.config.blind_after);
        if blind && !self.blind && seen.is_some() && self.is_active() {
            say!(out, "No line frames come; I stand until I see again.");
        }
        self.blind |= blind;
    }
}

fn is_no_line(state: LineState) -> bool {
    matches!(state, LineState::NotOnLine | LineState::DropStation)
}
