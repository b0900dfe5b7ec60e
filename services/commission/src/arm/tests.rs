//! What servos that a person has moved say of an arm.

use super::*;

const IDS: [u8; 8] = [31, 32, 33, 34, 35, 36, 37, 38];

fn places() -> [Option<u8>; PLACES] {
    ids(&limp(&IDS))
}

/// All servos in the middle, but these.
fn at(servos: &[(u8, u16)]) -> Positions {
    let places = places();
    core::array::from_fn(|place| {
        let moved = servos.iter().find(|(id, _)| Some(*id) == places[place]);
        Some(moved.map_or(512, |(_, position)| *position))
    })
}

fn shown(of: Joint, low: &[(u8, u16)], high: &[(u8, u16)]) -> Result<Found, Said> {
    joint(of, &places(), &[at(low), at(high)], &[])
}

#[test]
fn every_id_is_looked_at_and_a_limp_arm_of_any_servos_is_sound() {
    let all: std::collections::BTreeSet<u8> = (0..LOOKS).flat_map(looked_at).collect();
    assert_eq!(all, (0..=253).collect());
    for count in 6..=8 {
        let told = limp(&IDS[..count]);
        let found: Vec<u8> = ids(&told).into_iter().flatten().collect();
        assert_eq!(found.len(), count);
        assert!(lager_wire::Profile::told(&told)[0] == LIMP);
        assert!(<ArmProfile as lager_wire::Profile>::is_sound(
            &told.values()
        ));
    }
    for number in 0..LOOKS {
        let told = limp(&looked_at(number));
        assert!(<ArmProfile as lager_wire::Profile>::is_sound(
            &told.values()
        ));
    }
    for count in [0, 5] {
        assert_eq!(
            enough(&IDS[..count]).expect_err("few").name(),
            "servos_count"
        );
    }
    assert!(enough(&[1, 2, 3, 4, 5, 6, 7, 8, 9]).is_err());
}

#[test]
fn one_servo_or_two_that_face_each_other_are_found_with_their_direction_and_limits() {
    let limits = ArmLimits {
        lowest: 200,
        highest: 800,
    };
    let one = shown(Joint::Base, &[(33, 200)], &[(33, 800)]).expect("a joint");
    assert_eq!(
        (one.first, one.second, one.limits),
        ((33, false), None, limits)
    );
    let turned = shown(Joint::Wrist, &[(33, 823)], &[(33, 223)]).expect("a joint");
    assert_eq!((turned.first, turned.limits), ((33, true), limits));
    let pair = shown(
        Joint::Elbow,
        &[(37, 823), (31, 210)],
        &[(37, 223), (31, 805)],
    );
    let pair = pair.expect("a pair");
    assert_eq!((pair.first, pair.second), ((31, false), Some(37)));
    assert_eq!((pair.limits.lowest, pair.limits.highest), (210, 805));
}

#[test]
fn what_makes_no_joint_is_refused_and_names_the_servos() {
    use Joint::{Base, Shoulder};
    for (of, low, high, name) in [
        (Base, vec![], vec![], "joint_still"),
        (Base, vec![(31, 500)], vec![(31, 540)], "joint_still"),
        (
            Base,
            vec![(31, 200), (32, 823)],
            vec![(31, 800), (32, 223)],
            "joint_many",
        ),
        (
            Shoulder,
            vec![(31, 200), (32, 200)],
            vec![(31, 800), (32, 800)],
            "joint_odd_pair",
        ),
        (
            Shoulder,
            vec![(31, 200), (32, 700)],
            vec![(31, 800), (32, 100)],
            "joint_odd_pair",
        ),
        (Base, vec![(31, 0)], vec![(31, 800)], "joint_beyond"),
        (Base, vec![(31, 200)], vec![(31, 1_023)], "joint_beyond"),
    ] {
        let refused = shown(of, &low, &high).expect_err("no joint");
        assert_eq!(refused.name(), name, "{low:?} {high:?}");
        let text = refused.text(lager_orders::Language::English);
        assert!(name == "joint_still" || text.contains("31"), "{text}");
    }
    // What belongs to another joint may sink meanwhile.
    let known = joint(
        Base,
        &places(),
        &[at(&[(31, 200), (32, 700)]), at(&[(31, 800), (32, 300)])],
        &[32],
    );
    assert_eq!(known.expect("a joint").first, (31, false));
}

fn six() -> [Found; 6] {
    core::array::from_fn(|index| Found {
        first: (10 + index as u8, index % 2 == 1),
        second: (index == 2).then_some(20),
        limits: ArmLimits {
            lowest: 450 + index as u16,
            highest: 520,
        },
    })
}

#[test]
fn the_joints_make_a_profile_whose_poses_lie_inside() {
    // The second of a pair counts as the first one does.
    let profile = profile(&ArmProfile::default(), &six());
    assert_eq!(profile.validate(), Ok(()));
    assert_eq!(profile.servos.elbow, OneOrTwo::Two([12, 20]));
    assert!(profile.reversed.shoulder && !profile.reversed.elbow);
    assert_eq!((profile.gripper_closed, profile.gripper_open), (455, 520));
    assert_eq!(profile.drop.shoulder, 451);
    for joint in Joint::ALL {
        let trial = in_bases_place(&profile, joint);
        assert_eq!(trial.validate(), Ok(()), "{joint:?}");
        let moved = trial.servo_id(place_of(joint));
        assert_eq!(moved, profile.servo_id(joint.servo()), "{joint:?}");
    }
}

#[test]
fn a_pose_outside_the_limits_names_the_joint() {
    let profile = profile(&ArmProfile::default(), &six());
    let mut positions = [Some(500); PLACES];
    assert_eq!(pose(&profile, &positions).map(|pose| pose.wrist), Ok(500));
    positions[servo::ELBOW] = Some(521);
    let refused = pose(&profile, &positions).expect_err("outside");
    let text = refused.text(lager_orders::Language::English);
    assert!(text.contains("elbow: it stands at 521"), "{text}");
    positions[servo::ELBOW] = None;
    assert_eq!(
        pose(&profile, &positions).expect_err("unheard").name(),
        "no_values"
    );
}

#[test]
fn a_claw_that_feels_no_goods_is_refused() {
    let profile = ArmProfile::default();
    for (empty, full, name) in [
        ((210, 60), (230, 380), "claw_same"),
        ((210, 380), (400, 380), "claw_slack"),
        ((400, 60), (210, 380), "claw_same"),
    ] {
        assert_eq!(claw(&profile, empty, full).expect_err("none").name(), name);
    }
    let found = claw(&profile, (215, 60), (400, 380)).expect("a claw");
    assert_eq!((found.gripper_closed, found.squeeze_load), (215, 300));
    assert_eq!(found.validate(), Ok(()));
    assert_eq!(claw_trial(&profile).validate(), Ok(()));
}
