//! The state on its way out to `nav/status`, and back into a navigator after a restart.
//!
//! What is not in the status is either told again by others (map, mode), or begins anew without
//! harm (which line state was seen last, how long the robot has stood). The map's blocked ways
//! are what has been seen and are seen again.

use lager_topics::{Mode, NavigatorStatus, Order};
use lager_wire::{Command, WheelCommand};

use super::{Navigator, Pause, STANDBY};
use crate::command::Standing;
use crate::config::LogicConfig;
use crate::heading::Spin;
use crate::map::Node;
use crate::marks::MarkReader;

impl Navigator {
    /// The state as it is published.
    pub fn status(&self) -> NavigatorStatus {
        let pending = self.pending.unwrap_or_default();
        NavigatorStatus {
            frames: self.frames,
            order_id: self.order.id,
            product: self.order.product,
            pending_id: pending.id,
            pending_product: pending.product,
            command_id: self.command.id(),
            delivered: self.delivered,
            travelled_mm: self.odometer.travelled_mm.round() as i32,
            exit_mm: self.exit_mm.round() as i32,
            x: self.node.x.into(),
            y: self.node.y.into(),
            turned_deg: self.odometer.turned_deg.round() as i16,
            phase: self.phase.into(),
            step: self.step.into(),
            heading: self.heading.into(),
            target: self.target.into(),
            goal: self.goal.into(),
            mark: self.marks.to_bits(),
            code: self.command.command().code(),
            tries: self.tries,
            misses: self.misses,
            pending: self.pending.is_some().into(),
            distance_cm: self.distance_cm,
            mode: self.mode.unwrap_or(Mode::Manual).into(),
            stopped: self.stopped.into(),
            ..NavigatorStatus::default()
        }
    }

    /// Whether a status has to go out at once: anything but what changes all the time is another.
    pub fn is_news(before: &NavigatorStatus, after: &NavigatorStatus) -> bool {
        let steady = |status: &NavigatorStatus| NavigatorStatus {
            frames: 0,
            frames_lost: 0,
            travelled_mm: 0,
            turned_deg: 0,
            distance_cm: 0,
            ..*status
        };
        steady(before) != steady(after)
    }

    /// Goes on from the last status of a navigator that was killed.
    ///
    /// The robot moved on until the lease of its order ended; that way is added. A status that
    /// makes no sense (a foreign writer's) yields a fresh navigator.
    pub fn resume(config: LogicConfig, status: &NavigatorStatus) -> Self {
        Self::from_status(config, status).unwrap_or_else(|| Self::new(config))
    }

    fn from_status(config: LogicConfig, status: &NavigatorStatus) -> Option<Self> {
        let mut navigator = Self::new(config);
        navigator.node = Node::new(u8::try_from(status.x).ok()?, u8::try_from(status.y).ok()?);
        navigator.phase = status.phase.get()?;
        navigator.step = status.step.get()?;
        navigator.heading = status.heading.get()?;
        navigator.target = status.target.get()?;
        navigator.goal = status.goal.get()?;
        navigator.order = Order {
            id: status.order_id,
            product: status.product,
        };
        navigator.pending = (status.pending != 0).then_some(Order {
            id: status.pending_id,
            product: status.pending_product,
        });
        navigator.delivered = status.delivered;
        navigator.misses = status.misses;
        navigator.tries = status.tries;
        navigator.marks = MarkReader::from_bits(status.mark);
        navigator.exit_mm = status.exit_mm as f32;
        navigator.frames = status.frames;
        navigator.odometer.travelled_mm = status.travelled_mm as f32;
        navigator.odometer.turned_deg = f32::from(status.turned_deg);
        let command = Command::from_code(status.code).unwrap_or(STANDBY);
        navigator.command = Standing::resumed(status.command_id, command);
        let was_driving = status.mode == Mode::Autonomous && status.stopped == 0;
        if was_driving {
            navigator.mark_cut_short = navigator.marks.has_begun();
            navigator.marks.believe();
            navigator.reckon_outage(command);
        }
        // A turn or drop whose order is out is read from the reports; else it begins anew.
        if navigator
            .one_shot_command()
            .is_some_and(|wanted| wanted != command)
        {
            navigator.pause = Pause::Wanted;
        }
        Some(navigator)
    }

    /// Adds what the robot moved under `command` after its navigator was killed.
    fn reckon_outage(&mut self, command: Command) {
        let seconds = self.config.outage.as_secs_f32();
        let way = self.config.cruise_mm_per_s * seconds;
        let angle = self.config.turn_deg_per_s * seconds;
        match command {
            Command::Wheel(WheelCommand::ActiveForward | WheelCommand::ManualForward) => {
                self.odometer.travelled_mm += way;
            }
            Command::Wheel(WheelCommand::ManualBackward) => self.odometer.travelled_mm -= way,
            Command::Wheel(WheelCommand::LeftPerp) => {
                self.odometer.turned_deg += angle * Spin::Left.sign();
            }
            Command::Wheel(WheelCommand::RightPerp) => {
                self.odometer.turned_deg += angle * Spin::Right.sign();
            }
            _ => {}
        }
    }
}
