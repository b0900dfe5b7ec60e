//! [`ArmProfile`]: what a robot's arm may do and where its poses are (AMB-32), and how it travels.
//!
//! ```text
//!  Pi                                              steering board
//!   | -- setting ArmTorqueLimit, value -----------> |  the board stores it and answers
//!   |    ... one setting for each value ...         |
//!   | -- setting ArmProfile, check value ---------> |  all values are in force, or none
//!   | <------- reply, check value in force -------- |
//! ```
//!
//! A board obeys a profile as a whole, because half of a new profile beside half of the old one may
//! allow what neither of them allows. The carry pose stays on the Pi, because the code that turns
//! the wheels needs it there.
//!
//! The type stands here because configuration, bridge, board and simulator must agree on it. Its
//! default is the robot of the simulator's world, and the profile of a board that has got none.

mod kept;
mod rules;
mod servos;

use crate::profile::{Profile, profile};
use crate::setting::SettingKey;

pub use kept::ArmValues;
pub use rules::ArmProfileError;
use rules::{Rule, broken};
pub use servos::{JointServos, LAST_SERVO_ID, NO_SERVO, OneOrTwo, REVERSED, ReversedJoints};

/// The greatest position, load and torque of a servo.
pub const SERVO_MAX: u16 = 1023;

/// The torque limit of an arm that is limp: the board switches the torque of all its servos off, and
/// on again where they are then. Only a trial has it, so that a person can move the joints by hand;
/// no configuration may.
pub const LIMP: u16 = 0;

/// The positions to which a joint may go: 0 to 1023 of its (first) servo, counted as on the robot as
/// drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "[u16; 2]", into = "[u16; 2]"))]
pub struct ArmLimits {
    /// Least position.
    pub lowest: u16,
    /// Greatest position.
    pub highest: u16,
}

impl ArmLimits {
    /// All positions a servo has.
    pub const ALL: Self = Self {
        lowest: 0,
        highest: SERVO_MAX,
    };
}

impl From<[u16; 2]> for ArmLimits {
    fn from([lowest, highest]: [u16; 2]) -> Self {
        Self { lowest, highest }
    }
}

impl From<ArmLimits> for [u16; 2] {
    fn from(limits: ArmLimits) -> Self {
        [limits.lowest, limits.highest]
    }
}

/// The limits of all joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct JointLimits {
    /// Grows to the left.
    pub base: ArmLimits,
    /// Grows upwards; a second servo is mirrored.
    pub shoulder: ArmLimits,
    /// Grows outwards; a second servo is mirrored.
    pub elbow: ArmLimits,
    /// Grows when the gripper tilts up.
    pub wrist: ArmLimits,
    /// Grows counter-clockwise.
    pub rotation: ArmLimits,
    /// Grows when it opens.
    pub gripper: ArmLimits,
}

impl Default for JointLimits {
    fn default() -> Self {
        Self {
            base: ArmLimits::ALL,
            shoulder: ArmLimits::ALL,
            elbow: ArmLimits::ALL,
            wrist: ArmLimits::ALL,
            rotation: ArmLimits::ALL,
            gripper: ArmLimits::ALL,
        }
    }
}

/// A pose of the joints that carry the gripper; positions 0 to 1023, as [`JointLimits`] counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ArmPose {
    /// Of the base.
    pub base: u16,
    /// Of the shoulder.
    pub shoulder: u16,
    /// Of the elbow.
    pub elbow: u16,
    /// Of the wrist.
    pub wrist: u16,
}

impl ArmPose {
    const RAISED: Self = Self {
        base: 512,
        shoulder: 600,
        elbow: 400,
        wrist: 512,
    };
}

profile! {
    /// What the arm may do; the steering board is told at every start, and the arm stands until
    /// the board has taken it. Positions are those of the servos, 0 to 1023, 0.29 degrees each, of a
    /// reversed joint 1023 minus that; torque and load are 1 to 1023 of full.
    pub struct ArmProfile {
        /// Torque limit of all servos ...
        pub torque_limit: u16 = SERVO_MAX,
        /// ... and load that ends a squeeze.
        pub squeeze_load: u16 = 300,
        /// Position of the gripper when open, ...
        pub gripper_open: u16 = 512,
        /// ... and when closed on nothing.
        pub gripper_closed: u16 = 210,
        /// The ids of the servos, 0 to 253. One or two move the shoulder and the elbow, as in
        /// shoulder = 2 or shoulder = [2, 3]; the second one faces the first.
        pub servos: JointServos = JointServos::default(),
        /// Whether the servos of a joint count the other way: a position grows to the left (base),
        /// upwards (shoulder, wrist), outwards (elbow), counter-clockwise (rotation), and when the
        /// gripper opens.
        pub reversed: ReversedJoints = ReversedJoints::default(),
        /// Where each joint may be sent, [lowest, highest]. A step that would lead outside is
        /// refused. Of the shoulder and the elbow the first servo counts.
        pub limits: JointLimits = JointLimits::default(),
        /// Where the arm goes when it has let go of goods, ...
        pub neutral: ArmPose = ArmPose::RAISED,
        /// ... where it lets go, ...
        pub drop: ArmPose = ArmPose {
            shoulder: 300,
            elbow: 512,
            ..ArmPose::RAISED
        },
        /// ... and where it is while the robot drives with goods.
        pub carry: ArmPose = ArmPose::RAISED,
    }
}

impl ArmProfile {
    /// How many values a board receives: all but the carry pose.
    pub const VALUES: usize = 32;

    /// Checks that an arm can obey this profile, and work.
    ///
    /// # Errors
    /// The first rule that the profile breaks.
    pub fn validate(&self) -> Result<(), ArmProfileError> {
        // The carry pose must keep the rules of a pose that a board receives.
        let carried = Self {
            drop: self.carry,
            ..*self
        };
        for (profile, last_pose) in [(self, "drop"), (&carried, "carry")] {
            let values = profile.values();
            let limp = (profile.torque_limit == LIMP).then_some(Rule::LIMP);
            if let Some(rule) = limp.or_else(|| broken(&values)) {
                return Err(rule.told(&values, last_pose));
            }
        }
        Ok(())
    }

    /// The values that a board receives, in the order of [`Profile::key`].
    pub const fn values(&self) -> [u16; Self::VALUES] {
        let limits = &self.limits;
        let servos = self.servo_values();
        [
            self.torque_limit,
            self.squeeze_load,
            self.gripper_open,
            self.gripper_closed,
            limits.base.lowest,
            limits.base.highest,
            limits.shoulder.lowest,
            limits.shoulder.highest,
            limits.elbow.lowest,
            limits.elbow.highest,
            limits.wrist.lowest,
            limits.wrist.highest,
            limits.rotation.lowest,
            limits.rotation.highest,
            limits.gripper.lowest,
            limits.gripper.highest,
            self.neutral.base,
            self.neutral.shoulder,
            self.neutral.elbow,
            self.neutral.wrist,
            self.drop.base,
            self.drop.shoulder,
            self.drop.elbow,
            self.drop.wrist,
            servos[0],
            servos[1],
            servos[2],
            servos[3],
            servos[4],
            servos[5],
            servos[6],
            servos[7],
        ]
    }

    /// The profile with these values. A board has no carry pose; this takes the neutral one.
    pub const fn from_values(values: &[u16; Self::VALUES]) -> Self {
        let neutral = pose(values, 16);
        let (servos, reversed) = servos::from_values(values, 24);
        Self {
            torque_limit: values[0],
            squeeze_load: values[1],
            gripper_open: values[2],
            gripper_closed: values[3],
            servos,
            reversed,
            limits: JointLimits {
                base: limits(values, 4),
                shoulder: limits(values, 6),
                elbow: limits(values, 8),
                wrist: limits(values, 10),
                rotation: limits(values, 12),
                gripper: limits(values, 14),
            },
            neutral,
            drop: pose(values, 20),
            carry: neutral,
        }
    }
}

impl Profile for ArmProfile {
    type Values = [u16; Self::VALUES];
    const FIRST: SettingKey = SettingKey::ArmTorqueLimit;
    const CHECK: SettingKey = SettingKey::ArmProfile;

    fn told(&self) -> Self::Values {
        self.values()
    }

    fn obeyed(values: &Self::Values) -> Option<Self> {
        broken(values).is_none().then(|| Self::from_values(values))
    }
}

const LAST: u8 = SettingKey::ArmServo8.code();
const _: () = assert!((LAST - ArmProfile::FIRST.code() + 1) as usize == ArmProfile::VALUES);

const fn limits(values: &[u16; ArmProfile::VALUES], at: usize) -> ArmLimits {
    ArmLimits {
        lowest: values[at],
        highest: values[at + 1],
    }
}

const fn pose(values: &[u16; ArmProfile::VALUES], at: usize) -> ArmPose {
    ArmPose {
        base: values[at],
        shoulder: values[at + 1],
        elbow: values[at + 2],
        wrist: values[at + 3],
    }
}
