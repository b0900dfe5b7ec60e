//! The arm's profile: its rules, and how its values travel.

use lager_wire::{ArmLimits, ArmProfile, LIMP, NO_SERVO, OneOrTwo, Profile, SERVO_MAX, SettingKey};

use crate::sample::Noise;

type Change = fn(&mut ArmProfile);

#[test]
fn the_default_is_valid_and_comes_back_from_its_values() {
    let profile = ArmProfile::default();
    assert_eq!(profile.validate(), Ok(()));
    assert_eq!(ArmProfile::from_values(&profile.values()), profile);
}

#[test]
fn every_value_has_a_place_and_a_setting_of_its_own() {
    let mut values = [0; ArmProfile::VALUES];
    for (index, value) in values.iter_mut().enumerate() {
        *value = 40 + index as u16;
        let key = ArmProfile::key(index).expect("a setting");
        assert_eq!(ArmProfile::index(key), Some(index));
    }
    assert_eq!(ArmProfile::from_values(&values).values(), values);
    assert_eq!(ArmProfile::key(ArmProfile::VALUES), None);
    for key in [SettingKey::GainP, SettingKey::ArmProfile] {
        assert_eq!(ArmProfile::index(key), None);
    }
}

#[test]
fn the_check_value_tells_profiles_apart_that_differ_in_one_bit() {
    let values = ArmProfile::default().values();
    let check = ArmProfile::check(&values);
    for index in 0..values.len() {
        for bit in 0..16 {
            let mut other = values;
            other[index] ^= 1 << bit;
            assert_ne!(ArmProfile::check(&other), check, "value {index} bit {bit}");
        }
    }
}

#[test]
fn what_no_arm_can_obey_is_refused_with_the_key() {
    let limits = |lowest, highest| ArmLimits { lowest, highest };
    let cases: [(Change, &str); 17] = [
        (|arm| arm.torque_limit = 0, "torque_limit"),
        (|arm| arm.torque_limit = 1024, "torque_limit"),
        (|arm| arm.squeeze_load = 0, "squeeze_load"),
        (|arm| arm.torque_limit = 200, "squeeze_load"),
        (|arm| arm.limits.base.highest = 2_000, "base"),
        (|arm| arm.limits.wrist.lowest = 1_000, "wrist"),
        (|arm| arm.gripper_closed = 512, "gripper_closed"),
        (|arm| arm.drop.shoulder = 1_024, "drop"),
        (|arm| arm.carry.elbow = 1_024, "carry"),
        (|arm| arm.servos.base = 254, "[arm.servos] base has id 254"),
        (|arm| arm.servos.gripper = 255, "gripper has id 255"),
        (
            |arm| arm.servos.elbow = OneOrTwo::One(254),
            "elbow has id 254",
        ),
        (
            |arm| arm.servos.elbow = OneOrTwo::Two([4, 255]),
            "from 0 to 253",
        ),
        (
            |arm| arm.servos.wrist = 1,
            "base and wrist have the same id 1",
        ),
        (|arm| arm.servos.rotation = 3, "shoulder and rotation"),
        (
            |arm| arm.servos.shoulder = OneOrTwo::Two([9, 9]),
            "shoulder and shoulder have the same id 9",
        ),
        (
            |arm| {
                arm.servos.gripper = 1;
                arm.reversed.gripper = true;
            },
            "give each an id of its own",
        ),
    ];
    for (change, word) in cases {
        let mut profile = ArmProfile::default();
        change(&mut profile);
        let error = profile.validate().expect_err(word).to_string();
        assert!(error.contains(word), "{error}");
    }
    let mut profile = ArmProfile::default();
    profile.limits.gripper = limits(300, 600);
    let error = profile.validate().expect_err("closed is outside");
    assert!(error.to_string().contains("gripper_closed"), "{error}");
    profile.gripper_closed = 300;
    assert_eq!(profile.validate(), Ok(()));
    profile.limits.shoulder = limits(600, 299);
    assert!(profile.validate().is_err(), "the lower one first");
}

#[test]
fn an_arm_has_other_ids_single_servos_and_reversed_joints() {
    let mut profile = ArmProfile::default();
    assert_eq!(profile.servo_values(), [1, 2, 3, 4, 5, 6, 7, 8]);
    profile.servos.base = 0;
    profile.servos.shoulder = OneOrTwo::One(253);
    profile.reversed.shoulder = true;
    profile.reversed.elbow = true;
    assert_eq!(profile.validate(), Ok(()));
    let values = profile.servo_values();
    assert_eq!(values, [0, 509, NO_SERVO, 260, 261, 6, 7, 8]);
    assert_eq!(ArmProfile::obeyed(&profile.values()), Some(profile));
    let ids: [_; 8] = std::array::from_fn(|index| profile.servo_id(index));
    let told = [0, 253, 0, 4, 5, 6, 7, 8].map(Some);
    assert_eq!(ids[..2], told[..2]);
    assert_eq!((ids[2], &ids[3..]), (None, &told[3..]));
}

#[test]
fn a_limp_arm_is_for_a_board_and_for_no_configuration() {
    let mut profile = ArmProfile {
        torque_limit: LIMP,
        ..ArmProfile::default()
    };
    assert!(ArmProfile::is_sound(&profile.values()));
    let error = profile.validate().expect_err("no torque").to_string();
    assert!(error.contains("torque_limit is 0"), "{error}");
    // What it must not do later, it must not be told now.
    profile.squeeze_load = SERVO_MAX + 1;
    assert!(!ArmProfile::is_sound(&profile.values()));
}

#[test]
fn a_pair_of_which_one_servo_counts_the_other_way_is_no_pair() {
    for (index, value) in [(26, 259), (28, 261), (24, NO_SERVO), (31, 1_032)] {
        let mut values = ArmProfile::default().values();
        values[index] = value;
        assert!(!ArmProfile::is_sound(&values), "{index}");
    }
}

#[test]
fn board_and_configuration_judge_alike() {
    let mut noise = Noise::new(5);
    let mut sound = 0;
    for _ in 0..20_000 {
        let mut values = ArmProfile::default().values();
        for _ in 0..1 + noise.byte() % 3 {
            let place = usize::from(noise.byte()) % values.len();
            values[place] = u16::from_le_bytes([noise.byte(), noise.byte() % 8]);
        }
        // Some values of a servo stand in no configuration.
        let profile = ArmProfile::from_values(&values);
        // A limp arm is only tried, and no configuration has one.
        let strong = ArmProfile {
            torque_limit: match profile.torque_limit {
                LIMP => SERVO_MAX,
                limit => limit,
            },
            ..profile
        };
        let judged = profile.values() == values && strong.validate().is_ok();
        assert_eq!(ArmProfile::is_sound(&values), judged, "{values:?}");
        sound += u32::from(judged);
    }
    assert!((2_000..18_000).contains(&sound), "{sound}");
}
