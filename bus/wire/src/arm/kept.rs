//! [`ArmValues`]: an arm's profile as the board keeps it.
//!
//! A board looks at single values, and to make a struct of them and back takes 2 KiB of its flash.

use super::rules::{broken, joint_of};
use super::servos::{NO_SERVO, REVERSED};
use super::{ArmLimits, ArmPose, ArmProfile, limits, pose};
use crate::profile::Profile;
use crate::setting::SettingKey;

/// The values of a profile that an arm can obey, except its carry pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmValues([u16; ArmProfile::VALUES]);

impl ArmValues {
    /// Torque limit of all servos.
    #[must_use]
    pub const fn torque_limit(&self) -> u16 {
        self.0[0]
    }

    /// Whether the servos have no torque ([`super::LIMP`]).
    #[must_use]
    pub const fn is_limp(&self) -> bool {
        self.torque_limit() == super::LIMP
    }

    /// The load that ends a squeeze.
    #[must_use]
    pub const fn squeeze_load(&self) -> u16 {
        self.0[1]
    }

    /// Position of the open gripper.
    #[must_use]
    pub const fn gripper_open(&self) -> u16 {
        self.0[2]
    }

    /// Position of the gripper closed on nothing.
    #[must_use]
    pub const fn gripper_closed(&self) -> u16 {
        self.0[3]
    }

    /// The limits of the joint that the servo with this index moves.
    #[must_use]
    pub const fn limits(&self, servo: usize) -> ArmLimits {
        limits(&self.0, 4 + 2 * joint_of(servo))
    }

    /// The neutral pose.
    #[must_use]
    pub const fn neutral(&self) -> ArmPose {
        pose(&self.0, 16)
    }

    /// The drop pose.
    #[must_use]
    pub const fn drop_pose(&self) -> ArmPose {
        pose(&self.0, 20)
    }

    /// Whether the arm has the servo with this index, its number - 1.
    #[must_use]
    pub const fn has(&self, servo: usize) -> bool {
        self.0[24 + servo] != NO_SERVO
    }

    /// The id of the servo with this index, if the arm has it.
    #[must_use]
    pub const fn id(&self, servo: usize) -> u8 {
        self.0[24 + servo] as u8
    }

    /// Whether the servo with this index counts the other way.
    #[must_use]
    pub const fn is_reversed(&self, servo: usize) -> bool {
        self.0[24 + servo] & REVERSED != 0
    }

    /// Whether another profile has the same servos, which count the same way, and both are limp or
    /// neither is.
    #[must_use]
    pub fn has_servos_of(&self, other: &Self) -> bool {
        self.0[24..] == other.0[24..] && self.is_limp() == other.is_limp()
    }
}

impl From<ArmProfile> for ArmValues {
    fn from(profile: ArmProfile) -> Self {
        Self(profile.values())
    }
}

impl Profile for ArmValues {
    type Values = [u16; ArmProfile::VALUES];
    const FIRST: SettingKey = ArmProfile::FIRST;
    const CHECK: SettingKey = ArmProfile::CHECK;

    fn told(&self) -> Self::Values {
        self.0
    }

    fn obeyed(values: &Self::Values) -> Option<Self> {
        broken(values).is_none().then_some(Self(*values))
    }
}
