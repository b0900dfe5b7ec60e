//! What positions of servos, which a person has moved by hand, say of an arm.
//!
//! ```text
//!   ids that answer   -> they stand in the places of a profile, nobody knows yet where they belong
//!   one joint, from its lowest to its highest position:
//!     which ids moved -> its servo, or the two that face each other
//!     which way       -> whether it counts the other way
//!     the two ends    -> its limits
//! ```

use lager_topics::{SERVO_UNKNOWN, SteeringReport};
use lager_wire::{
    ArmLimits, ArmPose, ArmProfile, JointLimits, JointServos, LAST_SERVO_ID, LIMP, OneOrTwo,
    ReversedJoints, SERVO_MAX, servo,
};

use crate::words::Said;

/// How many servos a profile has room for.
pub(crate) const PLACES: usize = 8;
/// So many servos an arm has at least: one for each joint.
const FEWEST: usize = 6;
/// A servo that has moved less than this between two answers was not moved by a person.
const MOVED: u16 = 60;
/// How far two servos that face each other may be from 1023 together.
const FACING: u16 = 40;
/// The positions nearest to the ends of what a servo measures; beyond them it measures nothing.
const EDGE: u16 = 2;
/// How much farther open the claw must be with goods than without, in units of position. It is more
/// than by what logic tells a claw with goods from an empty one.
const GOODS: u16 = 50;
/// How much more load the claw must feel with goods than without.
const FELT: u16 = 40;

/// A joint of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the table of sentences names each one")]
pub enum Joint {
    Base,
    Shoulder,
    Elbow,
    Wrist,
    Rotation,
    Gripper,
}

impl Joint {
    /// All joints, in the order in which they are found out: what lies nearer to the floor first, so
    /// that what sinks later is known already.
    pub const ALL: [Self; 6] = [
        Self::Base,
        Self::Shoulder,
        Self::Elbow,
        Self::Wrist,
        Self::Rotation,
        Self::Gripper,
    ];

    /// The index of its (first) servo, its number - 1.
    pub const fn servo(self) -> usize {
        match self {
            Self::Base => servo::BASE,
            Self::Shoulder => servo::SHOULDER,
            Self::Elbow => servo::ELBOW,
            Self::Wrist => servo::WRIST,
            Self::Rotation => servo::ROTATION,
            Self::Gripper => servo::GRIPPER,
        }
    }

    /// Whether two servos may move it.
    const fn may_be_pair(self) -> bool {
        matches!(self, Self::Shoulder | Self::Elbow)
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Base => "joint_base",
            Self::Shoulder => "joint_shoulder",
            Self::Elbow => "joint_elbow",
            Self::Wrist => "joint_wrist",
            Self::Rotation => "joint_rotation",
            Self::Gripper => "joint_gripper",
        }
    }

    /// The way in which its position grows, or the other one.
    pub(crate) const fn way(self, grows: bool) -> &'static str {
        match (self, grows) {
            (Self::Base, true) => "way_left",
            (Self::Base, false) => "way_right",
            (Self::Shoulder, true) => "way_up",
            (Self::Shoulder, false) => "way_down",
            (Self::Elbow, true) => "way_out",
            (Self::Elbow, false) => "way_in",
            (Self::Wrist, true) => "way_tilt_up",
            (Self::Wrist, false) => "way_tilt_down",
            (Self::Rotation, true) => "way_counter_clockwise",
            (Self::Rotation, false) => "way_clockwise",
            (Self::Gripper, true) => "way_open",
            (Self::Gripper, false) => "way_closed",
        }
    }

    /// Its limits in a profile.
    pub(crate) const fn limits(self, limits: &mut JointLimits) -> &mut ArmLimits {
        match self {
            Self::Base => &mut limits.base,
            Self::Shoulder => &mut limits.shoulder,
            Self::Elbow => &mut limits.elbow,
            Self::Wrist => &mut limits.wrist,
            Self::Rotation => &mut limits.rotation,
            Self::Gripper => &mut limits.gripper,
        }
    }
}

/// Positions of the servos in all places; `None` where none has been heard.
pub(crate) type Positions = [Option<u16>; PLACES];

/// The positions in a report.
pub(crate) fn positions(report: &SteeringReport) -> Positions {
    let known = |position: u16| (position != SERVO_UNKNOWN).then_some(position);
    report.servo_position.map(known)
}

/// The ids at which one look is taken, the `number`-th of [`LOOKS`].
pub(crate) fn looked_at(number: u16) -> [u8; PLACES] {
    let last = LAST_SERVO_ID + 1 - PLACES as u16;
    let first = (number * PLACES as u16).min(last) as u8;
    core::array::from_fn(|place| first + place as u8)
}

/// How many looks it takes to see all ids.
pub(crate) const LOOKS: u16 = (LAST_SERVO_ID + PLACES as u16) / PLACES as u16;

/// A limp arm that has these servos in its places, all counted as they count themselves.
pub(crate) fn limp(ids: &[u8]) -> ArmProfile {
    // The places in which a servo must stand come first.
    let id = |number: usize| ids.get(number).copied();
    let must = |number: usize| id(number).unwrap_or(0);
    let pair = |first: usize, second: usize| match id(second) {
        Some(second) => OneOrTwo::Two([must(first), second]),
        None => OneOrTwo::One(must(first)),
    };
    ArmProfile {
        torque_limit: LIMP,
        servos: JointServos {
            base: must(0),
            shoulder: pair(1, 6),
            elbow: pair(2, 7),
            wrist: must(3),
            rotation: must(4),
            gripper: must(5),
        },
        ..ArmProfile::default()
    }
}

/// Whether so many servos make an arm.
///
/// # Errors
/// They do not.
pub(crate) fn enough(ids: &[u8]) -> Result<(), Said> {
    if (FEWEST..=PLACES).contains(&ids.len()) {
        return Ok(());
    }
    let values: [(_, &dyn ToString); 2] = [("count", &ids.len()), ("ids", &list(ids))];
    Err(Said::new("servos_count", &values))
}

pub(crate) fn list(ids: &[u8]) -> String {
    let ids: Vec<_> = ids.iter().map(ToString::to_string).collect();
    ids.join(", ")
}

/// The servos of a joint: the value of each place in a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Found {
    /// The id of the first one, and whether it counts the other way.
    first: (u8, bool),
    /// The one that faces it.
    second: Option<u8>,
    pub(crate) limits: ArmLimits,
}

impl Found {
    /// Its servos.
    pub(crate) fn ids(&self) -> impl Iterator<Item = u8> {
        [Some(self.first.0), self.second].into_iter().flatten()
    }
}

/// What `joint` is made of, whose servos stood so at its lowest and at its highest position;
/// `of` are the ids in these places, and `known` those that belong to other joints.
///
/// # Errors
/// No servo moved, or such as make no joint.
pub(crate) fn joint(
    joint: Joint,
    of: &[Option<u8>; PLACES],
    [low, high]: &[Positions; 2],
    known: &[u8],
) -> Result<Found, Said> {
    let moved = (0..PLACES).filter_map(|place| {
        let (id, low, high) = (of[place]?, low[place]?, high[place]?);
        let is_new = !known.contains(&id) && low.abs_diff(high) >= MOVED;
        is_new.then_some((id, low, high))
    });
    let moved: Vec<_> = moved.collect();
    let ids: Vec<u8> = moved.iter().map(|(id, ..)| *id).collect();
    let refused = |name, ids: &[u8]| {
        Err(Said::of(
            name,
            [
                ("joint", joint.name().into()),
                ("ids", Said::Plain(list(ids))),
            ],
        ))
    };
    let edges = [EDGE, SERVO_MAX - EDGE];
    let is_at_end = |position: &u16| *position < edges[0] || *position > edges[1];
    if moved
        .iter()
        .any(|(_, low, high)| is_at_end(low) || is_at_end(high))
    {
        return refused("joint_beyond", &ids);
    }
    let counted = |reversed: bool, position: u16| match reversed {
        true => SERVO_MAX - position,
        false => position,
    };
    match moved[..] {
        [] => refused("joint_still", &ids),
        [(id, low, high)] => {
            let reversed = low > high;
            Ok(Found {
                first: (id, reversed),
                second: None,
                limits: ArmLimits {
                    lowest: counted(reversed, low),
                    highest: counted(reversed, high),
                },
            })
        }
        [one, other] if joint.may_be_pair() => {
            let (first, second) = if one.1 < one.2 {
                (one, other)
            } else {
                (other, one)
            };
            let faces = |first: u16, second: u16| (first + second).abs_diff(SERVO_MAX) <= FACING;
            let is_pair = first.1 < first.2
                && second.1 > second.2
                && faces(first.1, second.1)
                && faces(first.2, second.2);
            if !is_pair {
                return refused("joint_odd_pair", &ids);
            }
            Ok(Found {
                first: (first.0, false),
                second: Some(second.0),
                limits: ArmLimits {
                    lowest: first.1,
                    highest: first.2,
                },
            })
        }
        _ => refused("joint_many", &ids),
    }
}

/// The profile of an arm of these joints, in the order of [`Joint::ALL`]. Poses that it had before
/// are moved inside the limits.
pub(crate) fn profile(before: &ArmProfile, joints: &[Found; 6]) -> ArmProfile {
    let id = |joint: Joint| joints[joint as usize].first.0;
    let reversed = |joint: Joint| joints[joint as usize].first.1;
    let both = |joint: Joint| match joints[joint as usize].second {
        Some(second) => OneOrTwo::Two([id(joint), second]),
        None => OneOrTwo::One(id(joint)),
    };
    let mut limits = JointLimits::default();
    for joint in Joint::ALL {
        *joint.limits(&mut limits) = joints[joint as usize].limits;
    }
    let pose = |pose: ArmPose| inside(pose, &limits);
    ArmProfile {
        gripper_open: limits.gripper.highest,
        gripper_closed: limits.gripper.lowest,
        servos: JointServos {
            base: id(Joint::Base),
            shoulder: both(Joint::Shoulder),
            elbow: both(Joint::Elbow),
            wrist: id(Joint::Wrist),
            rotation: id(Joint::Rotation),
            gripper: id(Joint::Gripper),
        },
        reversed: ReversedJoints {
            base: reversed(Joint::Base),
            shoulder: reversed(Joint::Shoulder),
            elbow: reversed(Joint::Elbow),
            wrist: reversed(Joint::Wrist),
            rotation: reversed(Joint::Rotation),
            gripper: reversed(Joint::Gripper),
        },
        limits,
        neutral: pose(before.neutral),
        drop: pose(before.drop),
        carry: pose(before.carry),
        ..*before
    }
}

fn inside(pose: ArmPose, limits: &JointLimits) -> ArmPose {
    let near = |position: u16, limits: ArmLimits| position.clamp(limits.lowest, limits.highest);
    ArmPose {
        base: near(pose.base, limits.base),
        shoulder: near(pose.shoulder, limits.shoulder),
        elbow: near(pose.elbow, limits.elbow),
        wrist: near(pose.wrist, limits.wrist),
    }
}

/// The pose in which an arm with this profile stands.
///
/// # Errors
/// A joint is not heard, or outside its limits.
pub(crate) fn pose(profile: &ArmProfile, positions: &Positions) -> Result<ArmPose, Said> {
    let mut limits = profile.limits;
    let mut at = |joint: Joint| {
        let position = positions[joint.servo()].ok_or("no_values")?;
        let ArmLimits { lowest, highest } = *joint.limits(&mut limits);
        if (lowest..=highest).contains(&position) {
            return Ok(position);
        }
        let plain = |value: u16| Said::Plain(value.to_string());
        Err(Said::of(
            "pose_outside",
            [
                ("joint", joint.name().into()),
                ("position", plain(position)),
                ("least", plain(lowest)),
                ("most", plain(highest)),
            ],
        ))
    };
    Ok(ArmPose {
        base: at(Joint::Base)?,
        shoulder: at(Joint::Shoulder)?,
        elbow: at(Joint::Elbow)?,
        wrist: at(Joint::Wrist)?,
    })
}

/// A profile for a trial, in which the servo of `joint` stands in the base's place: only that joint
/// has steps, and the wrist and the claw have none of their own.
pub(crate) fn in_bases_place(profile: &ArmProfile, joint: Joint) -> ArmProfile {
    let mut trial = *profile;
    let (servos, reversed, limits) = (&mut trial.servos, &mut trial.reversed, &mut trial.limits);
    match joint {
        Joint::Wrist => {
            core::mem::swap(&mut servos.base, &mut servos.wrist);
            core::mem::swap(&mut reversed.base, &mut reversed.wrist);
            core::mem::swap(&mut limits.base, &mut limits.wrist);
        }
        Joint::Gripper => {
            core::mem::swap(&mut servos.base, &mut servos.gripper);
            core::mem::swap(&mut reversed.base, &mut reversed.gripper);
            core::mem::swap(&mut limits.base, &mut limits.gripper);
            (trial.gripper_open, trial.gripper_closed) =
                (limits.gripper.highest, limits.gripper.lowest);
        }
        _ => {}
    }
    let limits = trial.limits;
    for pose in [&mut trial.neutral, &mut trial.drop, &mut trial.carry] {
        *pose = inside(*pose, &limits);
    }
    trial
}

/// The place in which `joint` stands then.
pub(crate) const fn place_of(joint: Joint) -> usize {
    match joint {
        Joint::Wrist | Joint::Gripper => servo::BASE,
        _ => joint.servo(),
    }
}

/// A closed claw: the position and the load of its servo.
pub(crate) type Grip = (u16, u16);

/// A profile for a trial of the claw: it closes as far as it can.
pub(crate) fn claw_trial(profile: &ArmProfile) -> ArmProfile {
    ArmProfile {
        squeeze_load: profile.torque_limit,
        gripper_open: profile.limits.gripper.highest,
        gripper_closed: profile.limits.gripper.lowest,
        ..*profile
    }
}

/// The claw's figures, by what it told when it had closed on nothing and on goods.
///
/// # Errors
/// The two are alike.
pub(crate) fn claw(profile: &ArmProfile, empty: Grip, full: Grip) -> Result<ArmProfile, Said> {
    let values: [(_, &dyn ToString); 4] = [
        ("empty", &empty.0),
        ("full", &full.0),
        ("without", &empty.1),
        ("with", &full.1),
    ];
    if full.0 < empty.0 + GOODS {
        return Err(Said::new("claw_same", &values));
    }
    if full.1 < empty.1 + FELT {
        return Err(Said::new("claw_slack", &values));
    }
    // Well below what goods are felt with, because load is measured roughly.
    let load = empty.1 + (full.1 - empty.1) / 4 * 3;
    Ok(ArmProfile {
        squeeze_load: load.clamp(1, profile.torque_limit),
        gripper_open: profile.limits.gripper.highest,
        gripper_closed: empty.0,
        ..*profile
    })
}

/// The ids in the places of a profile.
pub(crate) fn ids(profile: &ArmProfile) -> [Option<u8>; PLACES] {
    core::array::from_fn(|place| profile.servo_id(place))
}

#[cfg(test)]
mod tests;
