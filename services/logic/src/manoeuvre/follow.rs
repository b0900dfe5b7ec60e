//! Follows a line until something comes: the node at its end, a pick station's mark, the cross bar
//! of the delivery, or the corner on the way back from there.
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
//! Each judged mark corrects the odometer: the sensors have just left the tape's far edge. The
//! navigator asks the map for the edge once, when the drive begins.
//!
//! At a pick station only the mark says where the robot is. The document would also use its
//! distance to the shelf (L7, L9), but that would place it worse. Of 300 simulated robots that
//! turned in by the mark none stood more than 7 mm from its place, while new rangers were up to 25
//! mm wrong. A board's table is the datasheet's typical one, and at the shelf, 11 cm away, a ranger
//! gives whole centimetres and nothing under 10 (2026-11-24,
//! `services/lager/src/simulate/placed.rs`). A claw grips firmly within 25 mm.

use core::time::Duration;

use lager_floor::Heading;
use lager_topics::{FailureKind, NavigatorStatus, Step, Thought, ThoughtKind};
use lager_wire::{Command, LineState, WheelCommand};

use super::behaviour::Behaviour;
use super::helm::{Helm, Senses, is_no_line, turning_place};
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::judge::{EdgeMarks, Verdict, judge};
use crate::marks::{Mark, Sides};

/// In a shorter pause between line frames no mark can pass unseen: the sensors take about 200 ms to
/// cross one.
const LONGEST_GAP: Duration = Duration::from_millis(100);

/// If a thing stands behind the node, the robot looks at it again when the axle is this near to the
/// node, in mm. From farther away the ranger does not show whether there is room.
const CLOSE_MM: f32 = 60.0;
/// How far behind the node the body's front (170 mm ahead of the axle) comes to rest, in mm.
const FRONT_MM: f32 = 175.0;

/// After this many frames in a row without the line, it has ended behind the cross bar.
const ENDED: u8 = 3;

/// What ends the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Until {
    /// The node at the end of the edge.
    Node,
    /// The mark of the goods' station, or else the node.
    Station,
    /// The cross bar at the end of the way out.
    Bar,
    /// The delivery corner, on the way back.
    Corner,
}

/// What the map has on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Ahead {
    /// The edge; none on the way out, whose length is unknown.
    pub(crate) edge: Option<EdgeMarks>,
    /// Tape goes straight on at its end.
    pub(crate) goes_on: bool,
    /// On which side the goods of the order stand.
    pub(crate) goods: Sides,
}

/// A drive along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Follow {
    pub(crate) until: Until,
    pub(crate) step: Step,
    ahead: Ahead,
    /// Where the line disappeared, in the odometer's mm.
    lost_at: Option<f32>,
    /// When the last line frame came, if this navigator has had all frames since the drive began:
    /// then no mark has passed unseen.
    watched: Option<Duration>,
    /// Frames in a row without the line, behind the cross bar.
    bare: u8,
}

impl Follow {
    /// A drive from where the robot stands, or the rest of a drive that an earlier navigator began.
    pub(crate) fn new(until: Until, ahead: Ahead) -> Self {
        Self {
            until,
            step: Step::Seeking,
            ahead,
            lost_at: None,
            watched: None,
            bare: 0,
        }
    }

    /// The floor is known, or another one, in the middle of the drive.
    pub(crate) fn look_ahead(&mut self, ahead: Ahead) {
        self.ahead = ahead;
    }

    /// What the map has on the line while the robot looks for the next mark; `None` once it is
    /// found.
    pub(crate) fn sought(&self) -> Option<&EdgeMarks> {
        self.ahead
            .edge
            .as_ref()
            .filter(|_| self.step == Step::Seeking && self.until != Until::Bar)
    }

    /// Whether the sensors are beyond the node ahead, and no tape goes straight on there.
    fn is_past_the_line(&self, senses: &Senses, config: &LogicConfig) -> bool {
        let Some(edge) = &self.ahead.edge else {
            return false;
        };
        matches!(self.step, Step::ToNode | Step::NearNode)
            && !self.ahead.goes_on
            && senses.odometer.travelled_mm + config.sensor_ahead_mm >= edge.length_mm
    }

    fn judge_mark(&mut self, mark: Mark, helm: &mut Helm<'_>) {
        let Some(edge) = self.ahead.edge else { return };
        let (config, senses) = (helm.config, &mut *helm.senses);
        let at_mm = senses.mark_at(config);
        let tolerance = match core::mem::take(&mut senses.mark_cut_short) {
            true => config.tolerance_cut_short,
            false => config.tolerance,
        };
        match judge(&edge, mark.sides, at_mm, tolerance) {
            Verdict::Node => {
                if self.until == Until::Corner {
                    // A way whose length the robot measured itself says nothing about its wheels.
                    senses.odometer.forget_way();
                }
                senses.set_by_mark(edge.length_mm, config);
                self.lost_at = None;
                self.step = Step::ToNode;
            }
            Verdict::Station => {
                senses.set_by_mark(edge.length_mm / 2.0, config);
                self.lost_at = None;
                if self.until == Until::Station && mark.sides.meets(self.ahead.goods) {
                    self.step = Step::ToStation;
                    helm.out.think(ThoughtKind::StationSeen);
                }
            }
            Verdict::Unexpected => helm.out.think(Thought {
                sides: mark.sides.to_bits(),
                seen: at_mm.round() as i32,
                ..ThoughtKind::MarkUnexpected.into()
            }),
        }
    }

    /// A mark that is seen from close by is the node's, if it is anywhere near the node.
    fn correct_by_node(&mut self, mark: Mark, helm: &mut Helm<'_>) {
        let Some(edge) = self.ahead.edge else { return };
        let off_mm = (helm.senses.mark_at(helm.config) - edge.length_mm).abs();
        if mark.sides.meets(edge.crossing) && off_mm < helm.config.run_up_mm {
            helm.senses.set_by_mark(edge.length_mm, helm.config);
            self.lost_at = None;
            self.step = Step::ToNode;
        }
    }

    /// The cross bar at the end of the way out is the place of delivery (E4, AMB-18).
    ///
    /// If the robot leaves it at an angle, the bar can look like a line for some more frames. So
    /// the navigator waits for the end of the line.
    fn look_for_cross_bar(
        &mut self,
        mark: Option<Mark>,
        state: LineState,
        helm: &mut Helm<'_>,
    ) -> Option<Ending> {
        let mark_at = helm.senses.mark_at(helm.config);
        match mark {
            Some(mark) if mark.sides == Sides::BOTH => {
                helm.senses.exit_mm = mark_at;
                self.step = Step::AtBar;
            }
            Some(mark) => helm.out.think(Thought {
                sides: mark.sides.to_bits(),
                ..ThoughtKind::MarkOnWayOut.into()
            }),
            None => {}
        }
        if self.step != Step::AtBar {
            return None;
        }
        // A few frames may be noise, and goods that are released before the bar are not delivered.
        // The frames of the mark itself do not count as the end of the line.
        self.bare = match is_no_line(state) {
            true => self.bare.saturating_add(1),
            false => 0,
        };
        if self.bare >= ENDED {
            return Some(Ending::Done);
        }
        if mark_at > helm.senses.exit_mm + helm.config.bar_end_mm {
            self.step = Step::Seeking;
            helm.out.think(ThoughtKind::CrossingOnWayOut);
        }
        None
    }

    /// Notes where the line disappeared, and gives up if it stays away.
    fn watch_line(&mut self, state: LineState, helm: &mut Helm<'_>) -> Option<Ending> {
        if !is_no_line(state) || self.is_past_the_line(helm.senses, helm.config) {
            self.lost_at = None;
            return None;
        }
        if self.is_at_unseen_node(state, helm.senses, helm.config) {
            self.step = Step::NearNode;
            return None;
        }
        let travelled = helm.senses.odometer.travelled_mm;
        let without = travelled - *self.lost_at.get_or_insert(travelled);
        let most = helm.config.line_lost_mm;
        let kind = match helm.senses.tape_seen {
            true => FailureKind::LineLost,
            false => FailureKind::LineUnseen,
        };
        (without > most).then_some(Ending::Failed(kind, most, without))
    }

    /// Whether the line has ended at the node where it should, and the node's mark may have passed
    /// unseen.
    fn is_at_unseen_node(&self, state: LineState, senses: &Senses, config: &LogicConfig) -> bool {
        let may_be_unseen = self.watched.is_none() && !self.ahead.goes_on;
        let Some(edge) = self.sought().filter(|_| may_be_unseen) else {
            return false;
        };
        let off_mm = (senses.mark_at(config) - edge.length_mm).abs();
        senses.sure_sight == Some(state) && off_mm <= edge.length_mm * config.tolerance_cut_short
    }

    /// Whether the corner's mark, on the way back, must have passed unseen.
    ///
    /// The length from the way out is less reliable than the mark: unequal wheels are faster round
    /// a bend to one side than to the other, and the way back may measure up to a quarter more.
    /// Only on a short way the sensors are so far behind the corner before the axle has reached it.
    /// There the robot may still be beside its line after the turn, and pass beside the mark. If
    /// the mark may have passed unseen, the measured length counts at once.
    fn is_behind_unseen_corner(
        &self,
        length_mm: f32,
        senses: &Senses,
        config: &LogicConfig,
    ) -> bool {
        let late_mm = senses.mark_at(config) - length_mm;
        match self.watched {
            None => late_mm > config.tape_mm,
            Some(_) => {
                let before_axle = senses.odometer.travelled_mm < length_mm - config.coast_mm;
                before_axle && late_mm > length_mm * config.tolerance
            }
        }
    }
}

impl Behaviour for Follow {
    /// Begins on a line on which the robot stands somewhere. If a node is too near for its mark to
    /// be reliable, the robot drives there by dead reckoning, and the mark corrects that if it
    /// comes.
    fn begin(&mut self, helm: &mut Helm<'_>) {
        let sensors_at = helm.senses.odometer.travelled_mm + helm.config.sensor_ahead_mm;
        let is_near = |edge: EdgeMarks| edge.length_mm - sensors_at < helm.config.run_up_mm;
        if self.until != Until::Bar && self.ahead.edge.is_some_and(is_near) {
            self.step = Step::NearNode;
        }
        helm.senses.marks.clear();
        helm.senses.free_behind = true;
        self.watched = Some(helm.now);
    }

    /// The command that the drive needs now.
    fn wanted(&self, senses: &Senses, _: Heading, config: &LogicConfig) -> Command {
        Command::Wheel(match self.is_past_the_line(senses, config) {
            true => WheelCommand::ManualForward,
            false => WheelCommand::ActiveForward,
        })
    }

    /// Takes a line frame, and the mark that ended with it.
    fn see(&mut self, state: LineState, mark: Option<Mark>, helm: &mut Helm<'_>) -> Option<Ending> {
        let goes_on = |seen: &Duration| helm.now.saturating_sub(*seen) <= LONGEST_GAP;
        self.watched = self.watched.filter(goes_on).map(|_| helm.now);
        let outcome = match (self.until, self.step, mark) {
            (Until::Bar, ..) => self.look_for_cross_bar(mark, state, helm),
            (_, Step::Seeking, Some(mark)) => {
                self.judge_mark(mark, helm);
                None
            }
            (_, Step::NearNode, Some(mark)) => {
                self.correct_by_node(mark, helm);
                None
            }
            _ => None,
        };
        outcome.or_else(|| self.watch_line(state, helm))
    }

    /// Takes a distance. A thing blocks the way if it stands before the next node, on it, or so
    /// close behind it that the body would touch it there. If it stands farther behind, the robot
    /// looks again at the node. It does not look on the way out: there is no other way, and
    /// delivered goods lie at its end.
    fn range(&mut self, centimetres: u8, helm: &mut Helm<'_>) -> Option<Ending> {
        let between_nodes = matches!(self.until, Until::Node | Until::Station);
        let edge = self.ahead.edge.filter(|_| between_nodes)?;
        let (config, senses) = (helm.config, &helm.senses);
        let ranger_at = senses.odometer.travelled_mm + config.ranger_ahead_mm;
        let at_mm = ranger_at + f32::from(centimetres) * 10.0;
        let is_close = edge.length_mm - senses.odometer.travelled_mm <= CLOSE_MM;
        let beyond_mm = match self.step {
            Step::ToNode | Step::NearNode if is_close => FRONT_MM,
            _ => config.beyond_node_mm,
        };
        let is_ahead = at_mm < edge.length_mm + beyond_mm;
        if config.ranger_cm == 0 || centimetres >= config.halt_cm || !is_ahead || !helm.active {
            return None;
        }
        helm.out.think(Thought {
            seen: centimetres.into(),
            ..ThoughtKind::Halts.into()
        });
        Some(Ending::Blocked)
    }

    /// Goes on along the line, as far as the odometer says.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let (config, senses) = (helm.config, &mut *helm.senses);
        let travelled = senses.odometer.travelled_mm;
        if self.until == Until::Bar {
            let longest = config.longest_exit_mm;
            return (travelled > longest).then_some(Ending::Failed(
                FailureKind::BarMissing,
                longest,
                travelled,
            ));
        }
        let length_mm = self.ahead.edge?.length_mm;
        match self.step {
            Step::ToNode | Step::NearNode if travelled >= length_mm - config.coast_mm => {
                senses.odometer.travelled_mm -= length_mm;
                return Some(match (self.until, self.step) {
                    (Until::Station, _) => Ending::Missed,
                    (Until::Corner, Step::NearNode) if !is_near(length_mm, config) => {
                        Ending::Missed
                    }
                    _ => Ending::Done,
                });
            }
            Step::ToStation if travelled >= length_mm / 2.0 - config.coast_mm => {
                return Some(Ending::Done);
            }
            Step::Seeking
                if self.until == Until::Corner
                    && self.is_behind_unseen_corner(length_mm, senses, config) =>
            {
                self.step = Step::NearNode;
            }
            Step::Seeking if senses.mark_at(config) > length_mm * config.overdue => {
                let past_mm = travelled - length_mm;
                if self.until == Until::Corner && past_mm <= config.sensor_ahead_mm {
                    senses.odometer.travelled_mm = past_mm;
                    return Some(Ending::Missed);
                }
                let seen = senses.mark_at(config);
                return Some(Ending::Failed(FailureKind::NodeMissing, length_mm, seen));
            }
            _ => {}
        }
        None
    }

    fn restore(&mut self, status: &NavigatorStatus, _: Command) {
        self.step = status.step.get().unwrap_or(self.step);
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.step = self.step.into();
    }
}

/// Whether the corner is too near for its mark to be reliable, if the way back begins where the
/// robot turns round on a way out of this length.
fn is_near(exit_mm: f32, config: &LogicConfig) -> bool {
    turning_place(exit_mm, config) - config.sensor_ahead_mm < config.run_up_mm
}
