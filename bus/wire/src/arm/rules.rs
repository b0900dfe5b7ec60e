//! The rules for a profile of the arm, and the sentences about a profile that breaks one.
//!
//! The rules use only values and their places, so that a board checks them in little flash. The
//! sentences are for the person who wrote the configuration.

use core::fmt;

use super::servos::{LAST_SERVO_ID, NO_SERVO, PLACES, REVERSED};
use super::{ArmLimits, ArmProfile, LIMP, SERVO_MAX, limits};

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
    /// An id that no servo has.
    Id {
        /// The joint.
        joint: &'static str,
        /// The id.
        id: u16,
    },
    /// Two servos with the same id.
    SameId {
        /// Their joints.
        joints: [&'static str; 2],
        /// The id.
        id: u16,
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
            Self::Id { joint, id } => write!(
                formatter,
                "[arm.servos] {joint} has id {id}; a servo's id is from 0 to {LAST_SERVO_ID} (all servos listen to 254): `lager doctor` says which ones answer"
            ),
            Self::SameId {
                joints: [one, other],
                id,
            } => write!(
                formatter,
                "[arm.servos] {one} and {other} have the same id {id}; two servos with one id answer at the same time, so give each an id of its own"
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
    /// The value at this place is no servo.
    Id(u8),
    /// The servos at these places have the same id.
    SameId(u8, u8),
}

const TORQUE: u8 = 0;
const SQUEEZE: u8 = 1;
const OPEN: u8 = 2;
const CLOSED: u8 = 3;
const FIRST_LIMITS: u8 = 4;
const GRIPPER_LIMITS: u8 = 14;
const NEUTRAL: u8 = 16;
const DROP: u8 = 20;
const SERVOS: u8 = 24;
/// The number of joints in a pose. Their limits come first and in the same order.
const POSE: u8 = 4;

/// The second servo of the shoulder and of the elbow: it may be absent, and turns as the first one.
const SECOND: [u8; 2] = [SERVOS + 2, SERVOS + 4];

const JOINTS: [&str; 6] = ["base", "shoulder", "elbow", "wrist", "rotation", "gripper"];

/// The joint of the servo with this index, as an index of [`JOINTS`].
pub(super) const fn joint_of(servo: usize) -> usize {
    match servo {
        0 => 0,
        1 | 2 => 1,
        3 | 4 => 2,
        after => after - 2,
    }
}

impl ArmProfile {
    /// The name of the joint that the servo with this index moves.
    #[must_use]
    pub fn joint_name(servo: usize) -> &'static str {
        JOINTS[joint_of(servo)]
    }
}

/// The first rule that values break.
pub(super) fn broken(values: &[u16; ArmProfile::VALUES]) -> Option<Rule> {
    let at = |place: u8| values.get(usize::from(place)).copied().unwrap_or(0);
    if at(TORQUE) > SERVO_MAX {
        return Some(Rule::Strength(TORQUE));
    }
    if at(SQUEEZE) == 0 || at(SQUEEZE) > SERVO_MAX {
        return Some(Rule::Strength(SQUEEZE));
    }
    if at(TORQUE) != LIMP && at(SQUEEZE) > at(TORQUE) {
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
    if at(OPEN) == at(CLOSED) {
        return Some(Rule::NoGrip);
    }
    for place in SERVOS..SERVOS + PLACES as u8 {
        let servo = at(place);
        if SECOND.contains(&place) {
            if servo == NO_SERVO {
                continue;
            }
            if (servo ^ at(place - 1)) & REVERSED != 0 {
                return Some(Rule::Id(place));
            }
        }
        if servo & !REVERSED > LAST_SERVO_ID {
            return Some(Rule::Id(place));
        }
        for before in SERVOS..place {
            if at(before) != NO_SERVO && (servo ^ at(before)) & !REVERSED == 0 {
                return Some(Rule::SameId(before, place));
            }
        }
    }
    None
}

impl Rule {
    /// A torque of 0, which no configuration may have.
    pub(super) const LIMP: Self = Self::Strength(TORQUE);

    /// The rule in words; `last_pose` is the name of the pose in the drop's place.
    pub(super) fn told(
        self,
        values: &[u16; ArmProfile::VALUES],
        last_pose: &'static str,
    ) -> ArmProfileError {
        let at = |place: u8| values[usize::from(place)];
        let joint = |limits: u8| JOINTS[usize::from((limits - FIRST_LIMITS) / 2)];
        let limits = |place: u8| limits(values, usize::from(place));
        let of_servo = |place: u8| ArmProfile::joint_name(usize::from(place - SERVOS));
        let id = |place: u8| at(place) & !REVERSED;
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
            Self::Id(place) => ArmProfileError::Id {
                joint: of_servo(place),
                id: id(place),
            },
            Self::SameId(one, other) => ArmProfileError::SameId {
                joints: [of_servo(one), of_servo(other)],
                id: id(other),
            },
        }
    }
}
