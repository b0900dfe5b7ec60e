//! What the navigator knows of the arm: where its joints are, and whether its claw holds something.

use lager_topics::{FailureKind, Joint, SERVO_UNKNOWN, SteeringReport};
use lager_wire::servo::{BASE, ELBOW, GRIPPER, SHOULDER, WRIST};
use lager_wire::{ArmPose, ArmProfile};

/// The last report of the arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArmSeen {
    position: [u16; 8],
    /// Which servos have reported in this life of the link.
    heard: [bool; 8],
    claw_load: i16,
    /// Servos in trouble, one bit each.
    errors: u8,
    life: Option<u32>,
}

impl Default for ArmSeen {
    fn default() -> Self {
        Self {
            position: [SERVO_UNKNOWN; 8],
            heard: [false; 8],
            claw_load: 0,
            errors: 0,
            life: None,
        }
    }
}

impl ArmSeen {
    /// Takes a report. A bridge that has just started knows no servo. The navigator then keeps its
    /// earlier knowledge, since only the bridge can move the arm; but see [`heard`](Self::heard).
    pub(crate) fn take(&mut self, report: &SteeringReport) {
        if self.life != Some(report.link_epoch) {
            (self.life, self.heard) = (Some(report.link_epoch), [false; 8]);
        }
        self.errors = report.servo_errors;
        let known = self.position.iter_mut().zip(&mut self.heard);
        for ((known, is_heard), position) in known.zip(report.servo_position) {
            if position != SERVO_UNKNOWN {
                (*known, *is_heard) = (position, true);
            }
        }
        if report.servo_position[GRIPPER] != SERVO_UNKNOWN {
            self.claw_load = report.servo_load[GRIPPER];
        }
    }

    /// A servo's position, if it has reported.
    pub(crate) fn position(&self, servo: usize) -> Option<u16> {
        Some(self.position[servo]).filter(|position| *position != SERVO_UNKNOWN)
    }

    /// A servo's position, if it has reported in this life of the link. When a board restarts, the
    /// arm may sag.
    pub(crate) fn heard(&self, servo: usize) -> Option<u16> {
        self.position(servo).filter(|_| self.heard[servo])
    }

    /// Whether no servo has reported in this life of the link.
    pub(crate) fn is_unheard(&self) -> bool {
        self.heard == [false; 8]
    }

    /// The id of the first servo that is in trouble and has not reported in this life of the link,
    /// and how many there are.
    pub(crate) fn silent(&self, profile: &ArmProfile) -> Option<(u8, u8)> {
        let is_silent = |index: &usize| self.errors >> index & 1 != 0 && !self.heard[*index];
        let mut silent = (0..self.heard.len())
            .filter(is_silent)
            .filter_map(|index| profile.servo_id(index));
        let first = silent.next()?;
        Some((first, 1 + silent.count() as u8))
    }

    /// The life of the link to the steering board in which the last report came.
    pub(crate) fn life(&self) -> Option<u32> {
        self.life
    }

    /// The first joint that is not as in `pose`, its position, and its position in `pose`.
    pub(crate) fn joint_off(&self, pose: ArmPose, tolerance: u16) -> Option<(Joint, u16, u16)> {
        [
            (Joint::Base, BASE, pose.base),
            (Joint::Shoulder, SHOULDER, pose.shoulder),
            (Joint::Elbow, ELBOW, pose.elbow),
            (Joint::Wrist, WRIST, pose.wrist),
        ]
        .into_iter()
        .map(|(joint, servo, wanted)| (joint, self.position[servo], wanted))
        .find(|(_, found, wanted)| found.abs_diff(*wanted) > tolerance)
    }

    /// Why the claw seems to hold nothing, with the expected and the seen value; `None` if it holds
    /// something. `margin` is how far goods keep it from closing, at least.
    pub(crate) fn claw_is_empty(
        &self,
        profile: &ArmProfile,
        margin: u16,
    ) -> Option<(FailureKind, i32, i32)> {
        let (closed, least) = (profile.gripper_closed, profile.squeeze_load / 2);
        let load = self.claw_load.unsigned_abs();
        match self.position(GRIPPER) {
            None => Some((FailureKind::ClawUnheard, closed.into(), 0)),
            Some(position) if position.abs_diff(closed) <= margin => {
                Some((FailureKind::ClawEmpty, closed.into(), position.into()))
            }
            Some(_) if load < least => Some((FailureKind::ClawSlack, least.into(), load.into())),
            Some(_) => None,
        }
    }
}
