//! Computes for the external computer where the robot is between nodes, and whether anybody knows
//! that.

use lager_lines::extension::Degrees;
use lager_topics::{NavigatorStatus, Phase, WarehouseMap};

/// How far the wheels may turn by hand before nobody knows the robot's place any more, in duty × µs
/// of both motors: some 2 cm.
const KNOWN_BY_HAND: u64 = 50_000_000;

/// How exactly a robot knows its place when it sees a mark.
const UNSURE_AT_MARK_MM: u32 = 20;
/// How far the odometry may be wrong, as a part of the way since the mark: motors differ by a
/// tenth.
const UNSURE_PART: u32 = 8;

/// A place in the warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pose {
    pub(crate) x_mm: i32,
    pub(crate) y_mm: i32,
    pub(crate) heading: Degrees,
    /// How far the robot may be from there.
    pub(crate) unsure_mm: u32,
}

/// Whether logic knows its place. `by_hand` is the bridge's count of the wheels in manual mode.
pub(crate) fn is_known(status: &NavigatorStatus, by_hand: u64) -> bool {
    let is_nowhere = |phase| phase == Phase::WaitingForMap || status.needs_reset();
    let has_place = status.phase.get().is_some_and(|phase| !is_nowhere(phase));
    // No count has come, so nobody has driven without logic.
    let since = by_hand.saturating_sub(status.driven_by_hand);
    has_place && since < KNOWN_BY_HAND
}

/// Where the middle of the axle is, if the warehouse is known.
pub(crate) fn pose(status: &NavigatorStatus, map: &WarehouseMap) -> Option<Pose> {
    let pose = status.pose(map)?;
    Some(Pose {
        x_mm: pose.x_mm,
        y_mm: pose.y_mm,
        heading: Degrees::new(pose.heading_deg),
        unsure_mm: UNSURE_AT_MARK_MM + status.travelled_mm.unsigned_abs() / UNSURE_PART,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(phase: Phase) -> NavigatorStatus {
        NavigatorStatus {
            x: 2,
            y: 0,
            travelled_mm: 150,
            turned_deg: 30,
            phase: phase.into(),
            heading: lager_floor::Heading::Left.into(),
            ..NavigatorStatus::default()
        }
    }

    #[test]
    fn the_farther_from_the_last_mark_the_less_it_is_sure() {
        let map = WarehouseMap {
            side_length_cm: 40,
            ..WarehouseMap::default()
        };
        let pose = pose(&status(Phase::TurningBack), &map).expect("a pose");
        assert_eq!((pose.x_mm, pose.y_mm, pose.heading.get()), (650, 0, 300));
        assert_eq!(pose.unsure_mm, 38);
    }

    #[test]
    fn nobody_knows_where_a_robot_is_that_was_driven_by_hand_or_is_lost() {
        let mut here = status(Phase::WaitingForOrder);
        here.driven_by_hand = 1_000;
        assert!(is_known(&here, 1_000));
        assert!(!is_known(&here, 1_000 + KNOWN_BY_HAND));
        assert!(!is_known(&status(Phase::Lost), 0));
    }
}
