//! What is known of the arm: where its joints are, and what its claw holds.

use lager_topics::{FailureKind, Joint, SERVO_UNKNOWN, SteeringReport};
use lager_wire::{ArmPose, ArmProfile};

/// Place of the base's servo in a report.
pub(crate) const BASE: usize = 0;
/// Place of the shoulder's servo.
pub(crate) const SHOULDER: usize = 1;
/// Place of the elbow's servo.
pub(crate) const ELBOW: usize = 3;
const WRIST: usize = 5;
const CLAW: usize = 7;

/// What was last heard of the arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArmSeen {
    position: [u16; 8],
    /// Which of them were heard in this life of the link.
    heard: [bool; 8],
    claw_load: i16,
    life: Option<u32>,
}

impl Default for ArmSeen {
    fn default() -> Self {
        Self {
            position: [SERVO_UNKNOWN; 8],
            heard: [false; 8],
            claw_load: 0,
            life: None,
        }
    }
}

impl ArmSeen {
    /// A bridge that has just started knows no servo. What was known before is still believed of
    /// an arm at rest, since only the bridge can move it; but see [`heard`](Self::heard).
    pub(crate) fn take(&mut self, report: &SteeringReport) {
        if self.life != Some(report.link_epoch) {
            (self.life, self.heard) = (Some(report.link_epoch), [false; 8]);
        }
        let known = self.position.iter_mut().zip(&mut self.heard);
        for ((known, is_heard), position) in known.zip(report.servo_position) {
            if position != SERVO_UNKNOWN {
                (*known, *is_heard) = (position, true);
            }
        }
        if report.servo_position[CLAW] != SERVO_UNKNOWN {
            self.claw_load = report.servo_load[CLAW];
        }
    }

    /// Where a servo stands, if it has been heard.
    pub(crate) fn position(&self, servo: usize) -> Option<u16> {
        Some(self.position[servo]).filter(|position| *position != SERVO_UNKNOWN)
    }

    /// Where a servo stands, if it was heard in this life of the link. A board that has restarted
    /// may have let the arm sag.
    pub(crate) fn heard(&self, servo: usize) -> Option<u16> {
        self.position(servo).filter(|_| self.heard[servo])
    }

    /// Whether no servo has been heard in this life of the link.
    pub(crate) fn is_unheard(&self) -> bool {
        self.heard == [false; 8]
    }

    /// Which life of the link to the steering board the last report came from.
    pub(crate) fn life(&self) -> Option<u32> {
        self.life
    }

    /// The first joint that is not where `pose` has it, where it is, and where it should be.
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

    /// Why the claw is believed to hold nothing, with what was expected and seen; `None` if it
    /// holds something. `margin` is how far goods keep it from closing, at least.
    pub(crate) fn claw_is_empty(
        &self,
        profile: &ArmProfile,
        margin: u16,
    ) -> Option<(FailureKind, i32, i32)> {
        let (closed, least) = (profile.gripper_closed, profile.squeeze_load / 2);
        let load = self.claw_load.unsigned_abs();
        match self.position(CLAW) {
            None => Some((FailureKind::ClawUnheard, closed.into(), 0)),
            Some(position) if position.abs_diff(closed) <= margin => {
                Some((FailureKind::ClawEmpty, closed.into(), position.into()))
            }
            Some(_) if load < least => Some((FailureKind::ClawSlack, least.into(), load.into())),
            Some(_) => None,
        }
    }
}
