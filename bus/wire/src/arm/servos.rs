//! Which servos move the joints, by their ids on the servos' wire, and which way they count.
//!
//! ```text
//!   number    1      2   3      4   5    6      7         8
//!   joint     base   shoulder   elbow    wrist  rotation  gripper
//!   value     id of the servo, + 256 if it counts the other way; 512: the joint has one servo only
//! ```
//!
//! The board turns positions and loads round at the servos' wire. So everything else, from the limits
//! of a profile to the pictures of the panel, counts as on the robot as drawn.

use super::ArmProfile;

/// How many servos an arm has at most.
pub(super) const PLACES: usize = 8;
/// The greatest id of a servo. All servos listen to the next one.
pub const LAST_SERVO_ID: u16 = 253;
/// Added to the id of a servo that counts the other way.
pub const REVERSED: u16 = 256;
/// In place of the second servo of a joint that has only one.
pub const NO_SERVO: u16 = 512;

/// The servo that moves a joint, or the two that face each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(untagged))]
pub enum OneOrTwo {
    /// One servo.
    One(u8),
    /// Two servos; the second one stands at 1023 minus the position of the first.
    Two([u8; 2]),
}

/// The ids of the servos of all joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct JointServos {
    /// Turns the arm on the robot.
    pub base: u8,
    /// Lift the upper arm.
    pub shoulder: OneOrTwo,
    /// Lift the forearm.
    pub elbow: OneOrTwo,
    /// Lifts the gripper.
    pub wrist: u8,
    /// Turns the gripper.
    pub rotation: u8,
    /// Opens and closes the gripper.
    pub gripper: u8,
}

impl Default for JointServos {
    fn default() -> Self {
        Self {
            base: 1,
            shoulder: OneOrTwo::Two([2, 3]),
            elbow: OneOrTwo::Two([4, 5]),
            wrist: 6,
            rotation: 7,
            gripper: 8,
        }
    }
}

/// The joints whose servos count the other way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct ReversedJoints {
    /// Its position grows to the right.
    pub base: bool,
    /// Its first servo's position grows downwards.
    pub shoulder: bool,
    /// Its first servo's position grows inwards.
    pub elbow: bool,
    /// Its position grows when the gripper tilts down.
    pub wrist: bool,
    /// Its position grows clockwise.
    pub rotation: bool,
    /// Its position grows when the gripper closes.
    pub gripper: bool,
}

impl ArmProfile {
    /// The servo with each number, at index number - 1, as a board is told.
    #[must_use]
    pub const fn servo_values(&self) -> [u16; PLACES] {
        let Self {
            servos, reversed, ..
        } = self;
        let shoulder = both(servos.shoulder, reversed.shoulder);
        let elbow = both(servos.elbow, reversed.elbow);
        [
            value(servos.base, reversed.base),
            shoulder[0],
            shoulder[1],
            elbow[0],
            elbow[1],
            value(servos.wrist, reversed.wrist),
            value(servos.rotation, reversed.rotation),
            value(servos.gripper, reversed.gripper),
        ]
    }

    /// The id of the servo with this index, its number - 1; `None` if the arm has none.
    #[must_use]
    pub const fn servo_id(&self, index: usize) -> Option<u8> {
        let value = self.servo_values()[index];
        if value == NO_SERVO {
            return None;
        }
        Some(value as u8)
    }
}

/// The joints' servos and directions in these values, of which the first is at `at`.
pub(super) const fn from_values(
    values: &[u16; ArmProfile::VALUES],
    at: usize,
) -> (JointServos, ReversedJoints) {
    let servos = JointServos {
        base: values[at] as u8,
        shoulder: one_or_two(values, at + 1),
        elbow: one_or_two(values, at + 3),
        wrist: values[at + 5] as u8,
        rotation: values[at + 6] as u8,
        gripper: values[at + 7] as u8,
    };
    let reversed = ReversedJoints {
        base: is_reversed(values[at]),
        shoulder: is_reversed(values[at + 1]),
        elbow: is_reversed(values[at + 3]),
        wrist: is_reversed(values[at + 5]),
        rotation: is_reversed(values[at + 6]),
        gripper: is_reversed(values[at + 7]),
    };
    (servos, reversed)
}

const fn one_or_two(values: &[u16; ArmProfile::VALUES], at: usize) -> OneOrTwo {
    match values[at + 1] {
        NO_SERVO => OneOrTwo::One(values[at] as u8),
        second => OneOrTwo::Two([values[at] as u8, second as u8]),
    }
}

const fn is_reversed(value: u16) -> bool {
    value & REVERSED != 0
}

const fn both(servos: OneOrTwo, reversed: bool) -> [u16; 2] {
    match servos {
        OneOrTwo::One(id) => [value(id, reversed), NO_SERVO],
        OneOrTwo::Two([first, second]) => [value(first, reversed), value(second, reversed)],
    }
}

const fn value(id: u8, reversed: bool) -> u16 {
    id as u16 + if reversed { REVERSED } else { 0 }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for OneOrTwo {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Ids)
    }
}

#[cfg(feature = "serde")]
struct Ids;

#[cfg(feature = "serde")]
impl<'de> serde::de::Visitor<'de> for Ids {
    type Value = OneOrTwo;

    fn expecting(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("the id of one servo, or the two of a pair as in [2, 3]")
    }

    fn visit_i64<E: serde::de::Error>(self, id: i64) -> Result<OneOrTwo, E> {
        let wrong = |_| E::invalid_value(serde::de::Unexpected::Signed(id), &"u8");
        u8::try_from(id).map(OneOrTwo::One).map_err(wrong)
    }

    fn visit_u64<E: serde::de::Error>(self, id: u64) -> Result<OneOrTwo, E> {
        let wrong = |_| E::invalid_value(serde::de::Unexpected::Unsigned(id), &"u8");
        u8::try_from(id).map(OneOrTwo::One).map_err(wrong)
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut ids: A) -> Result<OneOrTwo, A::Error> {
        let wrong = |count| serde::de::Error::invalid_length(count, &self);
        let first: u8 = ids.next_element()?.ok_or_else(|| wrong(0))?;
        let Some(second) = ids.next_element()? else {
            return Ok(OneOrTwo::One(first));
        };
        match ids.next_element::<u8>()? {
            None => Ok(OneOrTwo::Two([first, second])),
            Some(_) => Err(wrong(3)),
        }
    }
}
