//! The inputs from people and from the bridge: the map, orders, hands on the robot, and who may
//! drive.

use core::time::Duration;

use lager_floor::{Heading, Node};
use lager_orders::{Mode, Pick};
use lager_topics::{
    BlockSource, FailureKind, Goal, GoneWhy, InputKind, Phase, ThoughtKind, WarehouseMap,
};

use super::{Input, Navigator};
use crate::blocks::Block;
use crate::ending::Ending;
use crate::manoeuvre::{Manoeuvre, STANDBY, Stand, ahead};
use crate::output::Output;

/// If the wheels have turned further than this in manual mode, in mm, nobody knows the position any
/// more. After a change of mode the robot rolls less than this.
const DISPLACED_MM: f32 = 15.0;

impl Navigator {
    /// The inputs of people and of the bridge, and the map.
    pub(super) fn take_word(&mut self, now: Duration, input: Input<'_>, out: &mut Output) {
        // The bridge repeats its mode, so only another one is a change.
        out.status_changed |= match input {
            Input::Map(_) | Input::Order(_) => true,
            Input::Mode { mode, stopped } => (self.mode, self.stopped) != (Some(mode), stopped),
            _ => false,
        };
        match input {
            Input::Map(map) => self.take_map(now, map, out),
            Input::Order(order) => self.mission.take_order(order, out),
            Input::Operator(input) => self.take_wish(now, input, out),
            Input::DrivenByHand(sum) => self.watch_manual_driving(now, sum, out),
            Input::Mode { mode, stopped } => self.set_mode(mode, stopped),
            Input::Line(_) | Input::Distance(_) | Input::Steering(_) | Input::Tick => {}
        }
    }

    /// Takes what a person has done. A press that this build does not know, or that makes no
    /// sense, changes nothing.
    fn take_wish(&mut self, now: Duration, wish: &lager_topics::Input, out: &mut Output) {
        let Some(kind) = wish.kind.get() else { return };
        let id = wish.order_id;
        let place = wish
            .heading
            .get()
            .map(|heading| (Node::new(wish.x, wish.y), heading));
        match kind {
            // The bridge handles the switch (E14) and the start, and its health then has the effect.
            InputKind::SwitchedToManual
            | InputKind::SwitchedToAutonomous
            | InputKind::StartPressed => return,
            InputKind::Horn => return out.think(ThoughtKind::Honks),
            InputKind::LinkLost | InputKind::LinkBack => {
                return self.take_link(now, kind == InputKind::LinkLost, out);
            }
            InputKind::PickByHand => return self.choose_pick(now, Pick::Manual, out),
            InputKind::PickByItself => return self.choose_pick(now, Pick::Auto, out),
            InputKind::PickupDone | InputKind::PickupForced => {
                self.picked(now, id, kind == InputKind::PickupForced, out);
            }
            InputKind::OrderCancelled if self.mission.is_under_way(id) => {
                self.cancel_under_way(now, out);
            }
            InputKind::OrderCancelled => self.mission.cancel(id, out),
            InputKind::OrderMovedUp => self.mission.move_up(id, out),
            InputKind::QueueCleared => self.mission.clear_queue(out),
            InputKind::GoodsGone | InputKind::GoodsGoneEarlier => match goods(id) {
                Some(product) => {
                    let why = match kind {
                        InputKind::GoodsGone => GoneWhy::Told,
                        _ => GoneWhy::EarlierRun,
                    };
                    self.mission.miss_goods(product, why, out);
                }
                None => return,
            },
            InputKind::GoodsBack => self.mission.find_goods(goods(id), out),
            InputKind::ResetPressed => self.put_down(None, out),
            InputKind::Placed => match place {
                Some(place) => self.put_down(Some(place), out),
                None => return,
            },
            InputKind::WayBlocked | InputKind::WayOpened => match place {
                Some(way) => self.take_way(now, way, kind == InputKind::WayOpened, out),
                None => return,
            },
        }
        out.status_changed = true;
    }

    /// A person says that a way is blocked, or open again.
    fn take_way(
        &mut self,
        now: Duration,
        (node, heading): (Node, Heading),
        open: bool,
        out: &mut Output,
    ) {
        let block = Block {
            node,
            heading,
            since: now,
            source: BlockSource::Person,
        };
        if self.mission.take_way(block, open, out) {
            self.begin(now, out);
        }
    }

    fn set_mode(&mut self, mode: Mode, stopped: bool) {
        // A successor may not have seen the events before it.
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
        out.status_changed = true;
        out.think(match lost {
            true => ThoughtKind::LinkLost,
            false => ThoughtKind::LinkBack,
        });
        self.leave_park(now, out);
    }

    /// Sets who picks the goods up from now on. An arm that is picking finishes its work.
    fn choose_pick(&mut self, now: Duration, pick: Pick, out: &mut Output) {
        if core::mem::replace(&mut self.mission.pick, pick) == pick {
            return;
        }
        out.status_changed = true;
        out.think(match pick {
            Pick::Manual => ThoughtKind::PicksByHand,
            Pick::Auto => ThoughtKind::PicksByItself,
        });
        // If a person's goods are in the claw already, the person hands them over.
        let waits = self.mission.phase == Phase::Picking
            && matches!(self.manoeuvre, Manoeuvre::Stand(_))
            && self.claw_is_empty().is_some();
        if waits && pick == Pick::Auto {
            self.begin(now, out);
        }
    }

    /// A person cancels the present order. Goods in the claw, or about to be, are delivered all the
    /// same.
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

    /// Why the claw seems to hold nothing, if it does.
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

    /// The floor becomes known, or changes, in the middle of a manoeuvre.
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

    /// The robot is where the mission says; everything from before is forgotten.
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
            // The routine finishes its arm move, and finds out by itself.
            return;
        }
        if self.mission.picked(order_id, forced, empty, out) {
            self.begin(now, out);
            self.watch_arm(out);
        }
    }

    fn watch_manual_driving(&mut self, now: Duration, sum: u64, out: &mut Output) {
        let known = self.by_hand.to_status();
        let driven_mm = self.by_hand.take(sum, &self.config);
        out.status_changed |= self.by_hand.to_status() != known;
        if self.mission.has_a_place() && driven_mm > DISPLACED_MM {
            let why = Ending::Failed(FailureKind::DrivenByHand, DISPLACED_MM, driven_mm);
            self.conclude(now, why, out);
        }
    }
}

/// The product of such a number; `None` = all of them.
fn goods(number: u32) -> Option<i32> {
    (number != lager_topics::Input::ALL_GOODS).then(|| number.cast_signed())
}
