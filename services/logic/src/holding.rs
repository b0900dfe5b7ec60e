//! Why the robot stands although its phase would turn the wheels: the steering board does not
//! report, the arm is not in the carry pose, the battery is low, the external computer is out of
//! reach, or no line frames come.
//!
//! ```text
//!   no report for 200 ms ------> Unheard ---- a report; a turn that was under way is judged --->
//!   goods, a joint elsewhere --> Arm -------- all joints are where they are carried ---------->
//!   low for a while, a node ---> Battery ---- charged for a while, or a person's reset ------->
//!   told so, a node -----------> Link ------- told that the link is there again -------------->
//!   no line frame for 120 ms --> Blind ------ a line frame ----------------------------------->
//! ```
//!
//! At the delivery corner, a low battery or a lost link holds the robot only if an order waits.
//!
//! This file stands apart from the phases because it can interrupt any of them, and the phase then
//! goes on where it was. Without reports the robot stands because every limit counts the odometer's
//! millimetres. Only a missing report or frame can hold the robot in the middle of a drive. The
//! other reasons wait until the robot stands anyway, or is at a node.

use core::time::Duration;

use lager_topics::{Joint, SERVO_UNKNOWN, Thought, ThoughtKind};

use crate::arm::ArmSeen;
use crate::config::LogicConfig;
use crate::output::Output;

/// The reasons to stand, without battery and link; those are the mission's.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Holding {
    /// When the steering board last reported. Before its first report: when the first one was
    /// missing.
    heard: Option<Duration>,
    /// No report for too long: stand until one comes.
    pub(crate) unheard: bool,
    /// No line frame for too long: stand until one comes.
    pub(crate) blind: bool,
    /// The joint that keeps the robot from driving with goods.
    pub(crate) joint_off: Option<Joint>,
}

impl Holding {
    /// The robot stands anyway, so the arm counts as for any later move.
    pub(crate) fn forget(&mut self) {
        self.blind = false;
        self.joint_off = None;
    }

    /// Stands if the steering board has not reported for too long. Returns whether that begins now.
    pub(crate) fn watch_board(&mut self, now: Duration, config: &LogicConfig) -> bool {
        let heard = *self.heard.get_or_insert(now);
        if self.unheard || now.saturating_sub(heard) <= config.unheard_board {
            return false;
        }
        self.unheard = true;
        true
    }

    /// The steering board has just reported. Returns whether it was silent before.
    pub(crate) fn hear_board(&mut self, now: Duration) -> bool {
        self.heard = Some(now);
        core::mem::take(&mut self.unheard)
    }

    /// Lets the wheels turn with goods only if the arm is in its carry pose. Call it whenever the
    /// robot stands.
    pub(crate) fn watch_arm(&mut self, arm: &ArmSeen, config: &LogicConfig, out: &mut Output) {
        let off = arm.joint_off(config.arm.carry, config.carry_tolerance);
        let before = core::mem::replace(&mut self.joint_off, off.map(|(joint, ..)| joint));
        match off {
            Some((joint, ..)) if before == Some(joint) => {}
            Some((joint, SERVO_UNKNOWN, _)) => out.think(Thought {
                joint: joint.into(),
                ..ThoughtKind::JointUnheard.into()
            }),
            Some((joint, found, wanted)) => out.think(Thought {
                joint: joint.into(),
                expected: wanted.into(),
                seen: found.into(),
                ..ThoughtKind::JointOff.into()
            }),
            None if before.is_some() => out.think(ThoughtKind::ArmCarried),
            None => {}
        }
    }
}
