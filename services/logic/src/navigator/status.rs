//! Writes the state into `nav/status`, and reads it back into a navigator after a restart.
//!
//! The status does not have everything. Others tell some of it again (map, mode), and the rest may
//! begin anew without harm (the last line state, how long the robot has stood). If a mark ends
//! before a successor has its map, it is judged when the map comes. The blocked ways and the
//! waiting orders are published besides the status.

use lager_orders::Mode;
use lager_topics::{BlockedWays, Hold, Joint, NavigatorStatus, Order, OrderQueue, Phase, Remedy};
use lager_wire::{Command, WheelCommand};

use super::Navigator;
use crate::battery::Battery;
use crate::belief::{Belief, Doubt};
use crate::by_hand::ByHand;
use crate::command::Standing;
use crate::config::LogicConfig;
use crate::manoeuvre::{Behaviour, STANDBY, is_no_line};
use crate::marks::MarkReader;
use lager_floor::{Node, Spin};

impl Navigator {
    /// The state in its published form.
    pub fn status(&self) -> NavigatorStatus {
        let (mission, senses) = (&self.mission, &self.senses);
        let Belief { node, heading, .. } = mission.place;
        let mut status = NavigatorStatus {
            frames: self.frames,
            order_id: mission.order.id,
            product: mission.order.product,
            command_id: self.command.id(),
            delivered: mission.delivered,
            travelled_mm: senses.odometer.travelled_mm.round() as i32,
            exit_mm: senses.exit_mm.round() as i32,
            failure: mission.failure,
            x: node.x.into(),
            y: node.y.into(),
            turned_deg: senses.odometer.turned_deg.round() as i16,
            phase: mission.phase.into(),
            heading: heading.into(),
            target: mission.target.into(),
            goal: mission.goal.into(),
            mark: senses.marks.to_bits(),
            code: self.command.command().code(),
            misses: mission.misses,
            waiting: mission.queue.waiting().len() as u8,
            mode: self.mode.unwrap_or(Mode::Manual).into(),
            stopped: self.stopped.into(),
            driven_by_hand: self.by_hand.to_status(),
            hold: self.steady.hold.into(),
            forced: mission.forced.into(),
            remedy: self.remedy().into(),
            pick: mission.pick.into(),
            at_start: self.is_at_start().into(),
            ..NavigatorStatus::default()
        };
        if let Some((heard, distance_cm)) = senses.distance {
            let age_ms = self.now.saturating_sub(heard).as_millis();
            status.distance_cm = distance_cm;
            status.distance_age_ms = age_ms.try_into().unwrap_or(u16::MAX);
        }
        self.manoeuvre.fill(&mut status);
        mission.place.doubt.fill(&mut status);
        status
    }

    /// Whether it stands on the delivery node, looks into the warehouse, sees tape there, and has
    /// not moved since somebody put it there. It may have begun an order.
    fn is_at_start(&self) -> bool {
        let (mission, senses) = (&self.mission, &self.senses);
        let Some(map) = mission.map.as_ref().filter(|_| mission.has_a_place()) else {
            return false;
        };
        let Belief { node, heading, .. } = mission.place;
        let sees_tape = senses.sure_sight.is_some_and(|seen| !is_no_line(seen));
        let (moved_mm, turned_deg) = (senses.odometer.travelled_mm, senses.odometer.turned_deg);
        let has_not_left = matches!(
            mission.phase,
            Phase::WaitingForOrder
                | Phase::Turning
                | Phase::Looking
                | Phase::Driving
                | Phase::Approaching
        );
        (node, heading) == (map.grid.delivery(), map.grid.exit().back())
            && mission.place.doubt.is_none()
            && has_not_left
            && moved_mm.abs() < 1.0
            && turned_deg.abs() < 1.0
            && sees_tape
    }

    /// The remedy: what makes a standing robot go on, if a person must act.
    fn remedy(&self) -> Remedy {
        let hold = self.steady.hold;
        match self.mission.failure.remedy.get() {
            Some(remedy) if remedy != Remedy::None => remedy,
            _ if hold != Hold::None => hold.remedy(),
            _ if self.stopped => Remedy::Resume,
            _ if self.mode != Some(Mode::Autonomous) => Remedy::Mode,
            _ if self.mission.phase == Phase::WaitingForMap => Remedy::Map,
            _ if self.waits_for_hand() => Remedy::Hand,
            _ => Remedy::None,
        }
    }

    /// Goes on from the last status of a navigator that was killed.
    ///
    /// The robot moved on until the lease of its order ended, so that distance is added. An
    /// impossible status (from another program) counts as none: the robot may be anywhere.
    pub fn resume(
        config: LogicConfig,
        status: &NavigatorStatus,
        blocks: &BlockedWays,
        queue: &OrderQueue,
    ) -> Self {
        let mut navigator = Self::from_status(config, status).unwrap_or_else(|| Self::lost(config));
        navigator.mission.restore_blocks(blocks);
        navigator.mission.restore_queue(queue);
        navigator
    }

    fn from_status(config: LogicConfig, status: &NavigatorStatus) -> Option<Self> {
        let mut navigator = Self::new(config);
        let node = Node::new(u8::try_from(status.x).ok()?, u8::try_from(status.y).ok()?);
        let mission = &mut navigator.mission;
        mission.place = Belief {
            doubt: Doubt::of(status),
            ..Belief::at(node, status.heading.get()?)
        };
        mission.phase = status.phase.get()?;
        mission.target = status.target.get()?;
        mission.goal = status.goal.get()?;
        mission.order = Order {
            id: status.order_id,
            product: status.product,
        };
        mission.delivered = status.delivered;
        mission.misses = status.misses;
        mission.forced = status.forced != 0;
        mission.failure = status.failure;
        mission.pick = status.pick.get()?;
        if status.hold == Hold::Battery {
            mission.battery = Battery::LOW;
        }
        mission.link_lost = status.hold == Hold::Link;
        // At home it waits for its order, as before.
        mission.parked = mission.must_park() && mission.phase != Phase::WaitingForOrder;
        if status.hold == Hold::Arm {
            // The next report shows which joint it is, if it is still one.
            navigator.holding.joint_off = Some(Joint::Base);
        }
        navigator.frames = status.frames;
        navigator.by_hand = ByHand::from_status(status.driven_by_hand);
        let senses = &mut navigator.senses;
        senses.marks = MarkReader::from_bits(status.mark);
        senses.exit_mm = status.exit_mm as f32;
        senses.odometer.travelled_mm = status.travelled_mm as f32;
        senses.odometer.turned_deg = f32::from(status.turned_deg);
        status.step.get()?;
        navigator.manoeuvre = navigator.chosen();
        let command = Command::from_code(status.code).unwrap_or(STANDBY);
        let config = &navigator.config;
        navigator.manoeuvre.resume(status, command, config);
        navigator.command = Standing::resumed(status.command_id, command);
        let was_driving = status.mode == Mode::Autonomous && status.stopped == 0;
        if was_driving {
            let senses = &mut navigator.senses;
            senses.mark_cut_short = senses.marks.has_begun();
            senses.marks.believe();
            navigator.reckon_outage(command);
        }
        // If the order of a turn or drop has left, the reports show its end. Otherwise it begins
        // anew.
        if navigator.needed() != command {
            navigator.manoeuvre.interrupt();
        }
        navigator.steady = navigator.steady_now(navigator.hold());
        Some(navigator)
    }

    /// Adds how far the robot moved under `command` after its navigator was killed.
    fn reckon_outage(&mut self, command: Command) {
        let seconds = self.config.outage.as_secs_f32();
        let way = self.config.cruise_mm_per_s * seconds;
        let angle = self.config.turn_deg_per_s * seconds;
        match command {
            Command::Wheel(WheelCommand::ActiveForward | WheelCommand::ManualForward) => {
                self.senses.odometer.travelled_mm += way;
            }
            Command::Wheel(WheelCommand::ManualBackward) => {
                self.senses.odometer.travelled_mm -= way;
            }
            Command::Wheel(WheelCommand::LeftPerp) => {
                self.senses.odometer.turned_deg += angle * Spin::Left.sign();
            }
            Command::Wheel(WheelCommand::RightPerp) => {
                self.senses.odometer.turned_deg += angle * Spin::Right.sign();
            }
            _ => {}
        }
    }
}
