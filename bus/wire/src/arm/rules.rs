//! The rules for a profile of the arm, and the sentences about a profile that breaks one.
//!
//! The rules use only values and their places, so that a board checks them in little flash. The
//! sentences are for the person who wrote the configuration.

use core::fmt;

use super::{ArmLimits, ArmProfile, SERVO_MAX, limits};

/// Why a profile is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmProfileError {
    /// A torque or load that no servo has.
    Strength {
        /// Its key.
        key: &'static str,
        /// Its value.
        value: u16,
    },
    /// The gripper would squeeze harder than the servos may.
    SqueezeAboveTorque {
        /// `squeeze_load`.
        squeeze_load: u16,
        /// `torque_limit`.
        torque_limit: u16,
    },
    /// Limits that contain no position, or that no servo reaches.
    Limits {
        /// The joint.
        joint: &'static str,
        /// Its limits.
        limits: ArmLimits,
    },
    /// A position outside the joint's limits.
    Outside {
        /// The key of the position.
        key: &'static str,
        /// The joint.
        joint: &'static str,
        /// The position to which the joint would go.
        position: u16,
        /// The joint's limits.
        limits: ArmLimits,
    },
    /// The open and the closed gripper have the same position.
    NoGrip {
        /// `gripper_open` and `gripper_closed`.
        position: u16,
    },
}

impl fmt::Display for ArmProfileError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Strength { key, value } => write!(
                formatter,
                "[arm] {key} is {value}; it must be from 1 to {SERVO_MAX}, which is a servo's full torque"
            ),
            Self::SqueezeAboveTorque {
                squeeze_load,
                torque_limit,
            } => write!(
                formatter,
                "[arm] squeeze_load is {squeeze_load}, above torque_limit {torque_limit}: the servos would never feel it; make it smaller"
            ),
            Self::Limits { joint, limits } => write!(
                formatter,
                "[arm.limits] {joint} is [{}, {}]; it must be [lowest, highest] from 0 to {SERVO_MAX}, the lower one first",
                limits.lowest, limits.highest
            ),
            Self::Outside {
                key,
                joint,
                position,
                limits,
            } => write!(
                formatter,
                "[arm] {key} sends the {joint} to {position}, outside its limits [{}, {}]; change one of them",
                limits.lowest, limits.highest
            ),
            Self::NoGrip { position } => write!(
                formatter,
                "[arm] gripper_open and gripper_closed are both {position}; the gripper needs a way to close"
            ),
        }
    }
}

impl core::error::Error for ArmProfileError {}

/// A rule that values break, with the places of those values.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// The value at this place is not a torque or a load.
    Strength(u8),
    /// The load of a squeeze is above the torque limit.
    Squeeze,
    /// The values at this place are not limits.
    Limits(u8),
    /// The position at the first place is outside the limits at the second.
    Outside(u8, u8),
    /// The open and the closed gripper have the same position.
    NoGrip,
}

const TORQUE: u8 = 0;
const SQUEEZE: u8 = 1;
const OPEN: u8 = 2;
const CLOSED: u8 = 3;
const FIRST_LIMITS: u8 = 4;
const GRIPPER_LIMITS: u8 = 14;
const NEUTRAL: u8 = 16;
const DROP: u8 = 20;
/// The number of joints in a pose. Their limits come first and in the same order.
const POSE: u8 = 4;

const JOINTS: [&str; 6] = ["base", "shoulder", "elbow", "wrist", "rotation", "gripper"];

/// The first rule that values break.
pub(super) fn broken(values: &[u16; ArmProfile::VALUES]) -> Option<Rule> {
    let at = |place: u8| values.get(usize::from(place)).copied().unwrap_or(0);
    for place in [TORQUE, SQUEEZE] {
        if at(place) == 0 || at(place) > SERVO_MAX {
            return Some(Rule::Strength(place));
        }
    }
    if at(SQUEEZE) > at(TORQUE) {
        return Some(Rule::Squeeze);
    }
    let mut place = FIRST_LIMITS;
    while place <= GRIPPER_LIMITS {
        if at(place) > at(place + 1) || at(place + 1) > SERVO_MAX {
            return Some(Rule::Limits(place));
        }
        place += 2;
    }
    let outside = |place: u8, limits: u8| {
        let position = at(place);
        position < at(limits) || position > at(limits + 1)
    };
    for place in NEUTRAL..DROP + POSE {
        let limits = FIRST_LIMITS + 2 * ((place - NEUTRAL) % POSE);
        if outside(place, limits) {
            return Some(Rule::Outside(place, limits));
        }
    }
    for place in [OPEN, CLOSED] {
        if outside(place, GRIPPER_LIMITS) {
            return Some(Rule::Outside(place, GRIPPER_LIMITS));
        }
    }
    (at(OPEN) == at(CLOSED)).then_some(Rule::NoGrip)
}

impl Rule {
    /// The rule in words; `last_pose` is the name of the pose in the drop's place.
    pub(super) fn told(
        self,
        values: &[u16; ArmProfile::VALUES],
        last_pose: &'static str,
    ) -> ArmProfileError {
        let at = |place: u8| values[usize::from(place)];
        let joint = |limits: u8| JOINTS[usize::from((limits - FIRST_LIMITS) / 2)];
        let limits = |place: u8| limits(values, usize::from(place));
        match self {
            Self::Strength(place) => ArmProfileError::Strength {
                key: if place == TORQUE {
                    "torque_limit"
                } else {
                    "squeeze_load"
                },
                value: at(place),
            },
            Self::Squeeze => ArmProfileError::SqueezeAboveTorque {
                squeeze_load: at(SQUEEZE),
                torque_limit: at(TORQUE),
            },
            Self::Limits(place) => ArmProfileError::Limits {
                joint: joint(place),
                limits: limits(place),
            },
            Self::Outside(place, of) => ArmProfileError::Outside {
                key: match place {
                    OPEN => "gripper_open",
                    CLOSED => "gripper_closed",
                    DROP.. => last_pose,
                    _ => "neutral",
                },
                joint: joint(of),
                position: at(place),
                limits: limits(of),
            },
            Self::NoGrip => ArmProfileError::NoGrip { position: at(OPEN) },
        }
    }
}
