//! What people and the bridge say: the map, orders, hands on the robot, and who may drive.

use core::time::Duration;

use lager_topics::{FailureKind, Goal, Heading, Mode, Phase, Pick, ThoughtKind, WarehouseMap};

use super::{Input, Navigator};
use crate::blocks::Block;
use crate::manoeuvre::{Manoeuvre, STANDBY, Stand, ahead};
use crate::node::Node;
use crate::outcome::Outcome;
use crate::output::Output;

/// Way of the wheels in manual mode, in mm, after which the known position is useless. The robot
/// rolls less far than this after a change of mode.
const DISPLACED_MM: f32 = 15.0;

impl Navigator {
    /// Takes what people and the bridge say.
    pub(super) fn take_word(&mut self, now: Duration, input: Input<'_>, out: &mut Output) {
        // The bridge says the same again and again.
        out.status_changed |= match input {
            Input::DrivenByHand(_) => false,
            Input::Mode { mode, stopped } => (self.mode, self.stopped) != (Some(mode), stopped),
            Input::Link { lost } => self.mission.link_lost != lost,
            Input::Pick(pick) => self.mission.pick != pick,
            _ => true,
        };
        match input {
            Input::Map(map) => self.take_map(now, map, out),
            Input::Order(order) => self.mission.take_order(order, out),
            Input::Cancel(id) if self.mission.is_under_way(id) => self.cancel_under_way(now, out),
            Input::Cancel(id) => self.mission.cancel(id, out),
            Input::MoveUp(id) => self.mission.move_up(id, out),
            Input::ClearQueue => self.mission.clear_queue(out),
            Input::GoodsGone(product) => self.mission.miss_goods(product, out),
            Input::GoodsBack(product) => self.mission.find_goods(product, out),
            Input::PickupDone { order_id, forced } => self.picked(now, order_id, forced, out),
            Input::Pick(pick) => self.choose_pick(now, pick, out),
            Input::DrivenByHand(sum) => self.watch_manual_driving(now, sum, out),
            Input::Reset => self.put_down(None, out),
            Input::Placed { node, heading } => self.put_down(Some((node, heading)), out),
            Input::Way {
                node,
                heading,
                open,
                source,
            } => {
                let block = Block {
                    node,
                    heading,
                    since: now,
                    source,
                };
                if self.mission.take_way(block, open, out) {
                    self.begin(now, out);
                }
            }
            Input::Link { lost } => self.take_link(now, lost, out),
            Input::Mode { mode, stopped } => self.set_mode(mode, stopped),
            Input::Line(_) | Input::Distance(_) | Input::Steering(_) | Input::Tick => {}
        }
    }

    fn set_mode(&mut self, mode: Mode, stopped: bool) {
        // A successor may not have seen what happened before it.
        if self.mode == Some(Mode::Autonomous) && mode == Mode::Manual {
            self.by_hand.stand_here();
        }
        self.mode = Some(mode);
        self.stopped = stopped;
        self.learn_whether_active();
    }

    fn take_link(&mut self, now: Duration, lost: bool, out: &mut Output) {
        if core::mem::replace(&mut self.mission.link_lost, lost) == lost {
            return;
        }
        out.think(match lost {
            true => ThoughtKind::LinkLost,
            false => ThoughtKind::LinkBack,
        });
        self.leave_park(now, out);
    }

    /// Who picks the goods up from now on. An arm that is picking ends what it does.
    fn choose_pick(&mut self, now: Duration, pick: Pick, out: &mut Output) {
        if core::mem::replace(&mut self.mission.pick, pick) == pick {
            return;
        }
        out.think(match pick {
            Pick::Manual => ThoughtKind::PicksByHand,
            Pick::Auto => ThoughtKind::PicksByItself,
        });
        // Goods that a person holds in the claw already are his to hand over.
        let waits = self.mission.phase == Phase::Picking
            && matches!(self.manoeuvre, Manoeuvre::Stand(_))
            && self.claw_is_empty().is_some();
        if waits && pick == Pick::Auto {
            self.begin(now, out);
        }
    }

    /// A person takes the order under way back. Goods that are held, or are being gripped, are
    /// delivered all the same.
    fn cancel_under_way(&mut self, now: Duration, out: &mut Output) {
        let is_at_goods = self.mission.phase == Phase::Picking;
        let has_goods = match is_at_goods {
            true => {
                let is_gripping = matches!(self.manoeuvre, Manoeuvre::ArmSequence(_));
                is_gripping || self.claw_is_empty().is_none()
            }
            false => self.mission.goal == Goal::Delivery,
        };
        if has_goods {
            return self.mission.keep_order(out);
        }
        let goes_on = self.mission.cancel_under_way(out);
        if is_at_goods {
            self.holding.watch_arm(&self.senses.arm, &self.config, out);
        }
        if goes_on {
            self.begin(now, out);
        }
    }

    /// Why the claw is believed to hold nothing, if it is.
    fn claw_is_empty(&self) -> Option<(FailureKind, i32, i32)> {
        let config = &self.config;
        let arm = &self.senses.arm;
        arm.claw_is_empty(&config.arm, config.held_margin)
    }

    fn learn_whether_active(&mut self) {
        let may_drive = self.mode == Some(Mode::Autonomous) && !self.stopped;
        self.active = may_drive && self.mission.map.is_some();
    }

    fn take_map(&mut self, now: Duration, map: &WarehouseMap, out: &mut Output) {
        let (known, phase) = (self.mission.map.is_some(), self.mission.phase);
        if self.mission.take_map(map, out) {
            self.stand_here();
        }
        self.learn_whether_active();
        if self.mission.phase != phase {
            self.begin(now, out);
        } else if self.mission.map.is_some() {
            self.look_ahead(known);
        }
    }

    /// The floor is known, or known anew, in the middle of a manoeuvre.
    fn look_ahead(&mut self, was_known: bool) {
        match &mut self.manoeuvre {
            Manoeuvre::Follow(follow) => {
                follow.look_ahead(ahead(&self.mission, follow.until, &self.senses));
            }
            Manoeuvre::Turn(_) if !was_known => {
                if let (Manoeuvre::Turn(known), Manoeuvre::Turn(turn)) =
                    (self.chosen(), &mut self.manoeuvre)
                {
                    turn.learn(&known);
                }
            }
            _ => {}
        }
    }

    /// A person has put the robot down.
    fn put_down(&mut self, place: Option<(Node, Heading)>, out: &mut Output) {
        if self.active && self.command.command() != STANDBY {
            return out.think(ThoughtKind::MovesAlone);
        }
        if self.mission.put_down(place, out) {
            self.stand_here();
        }
    }

    /// The robot stands where the mission says, with nothing left of what was before.
    fn stand_here(&mut self) {
        self.manoeuvre = Stand.into();
        self.holding.forget();
        self.senses.odometer.travelled_mm = 0.0;
        self.senses.odometer.forget_way();
        self.senses.marks.clear();
        self.senses.tape_seen = false;
        self.by_hand.stand_here();
    }

    fn picked(&mut self, now: Duration, order_id: u32, forced: bool, out: &mut Output) {
        let empty = self.claw_is_empty();
        let picks = matches!(self.manoeuvre, Manoeuvre::ArmSequence(_));
        if picks && !forced && empty.is_none() {
            // The routine brings the arm to its end, and finds out by itself.
            return;
        }
        if self.mission.picked(order_id, forced, empty, out) {
            self.begin(now, out);
            self.watch_arm(out);
        }
    }

    fn watch_manual_driving(&mut self, now: Duration, sum: u64, out: &mut Output) {
        let known = self.by_hand.to_status();
        let driven_mm = self.by_hand.take(sum, self.config.cruise_mm_per_s);
        out.status_changed |= self.by_hand.to_status() != known;
        if self.mission.has_a_place() && driven_mm > DISPLACED_MM {
            let why = Outcome::Failed(FailureKind::DrivenByHand, DISPLACED_MM, driven_mm);
            self.conclude(now, why, out);
        }
    }
}
