//! What the boards are told of their robot: its rules, and how its values travel.

use lager_wire::{
    ArmProfile, IrModel, LineProfile, Profile, RangerProfile, SensorProfile, SettingKey,
    SteeringProfile, WheelsProfile,
};

/// Every setting of a profile, once and in order, the check value last.
fn travels<P: Profile + PartialEq + core::fmt::Debug>(profile: &P) {
    let values = profile.told();
    assert_eq!(P::obeyed(&values).as_ref(), Some(profile));
    let mut settings = profile.settings();
    for (index, value) in values.as_ref().iter().enumerate() {
        let setting = settings.next().expect("a setting for each value");
        assert_eq!(P::index(setting.key), Some(index));
        assert_eq!(P::key(index), Some(setting.key));
        assert_eq!(setting.value, value.cast_signed());
    }
    let last = settings.next().expect("the check value");
    assert_eq!((last.key, last.value), (P::CHECK, P::check(&values)));
    assert_eq!(settings.next(), None);
    assert_eq!(P::key(values.as_ref().len()), None);
    for key in [SettingKey::GainP, P::CHECK] {
        assert_eq!(P::index(key), None, "{key:?}");
    }
}

fn steering() -> SteeringProfile {
    SteeringProfile {
        wheels: WheelsProfile {
            swapped: true,
            left_reversed: true,
            right_reversed: true,
            duty: 140,
            full_turn_ms: 9_000,
        },
        divider: true,
    }
}

fn sensors() -> SensorProfile {
    SensorProfile {
        line: LineProfile {
            dark_is_high: false,
        },
        ranger: RangerProfile {
            model: IrModel::Own,
            near_cm: 12,
            near_reading: 500,
            far_cm: 60,
            far_reading: 90,
        },
    }
}

#[test]
fn every_value_travels() {
    travels(&ArmProfile::default());
    travels(&SteeringProfile::default());
    travels(&steering());
    travels(&SensorProfile::default());
    travels(&sensors());
}

/// Boards in robots compare these. CRC-8/AUTOSAR of the values, calculated apart from this code.
#[test]
fn the_check_values_of_the_defaults_are_fixed() {
    assert_eq!(ArmProfile::check(&ArmProfile::default().told()), 43);
    assert_eq!(SteeringProfile::default().told(), [0, 0, 0, 100, 12_000, 0]);
    assert_eq!(
        SteeringProfile::check(&SteeringProfile::default().told()),
        225
    );
    assert_eq!(SensorProfile::default(), SensorProfile::USUAL);
    assert_eq!(SensorProfile::default().told(), [1, 1, 10, 472, 80, 84]);
    assert_eq!(SensorProfile::check(&SensorProfile::default().told()), 106);
}

#[test]
fn no_setting_belongs_to_two_profiles() {
    for key in SettingKey::ALL {
        let places = [
            ArmProfile::index(*key),
            SteeringProfile::index(*key),
            SensorProfile::index(*key),
        ];
        assert!(places.iter().flatten().count() <= 1, "{key:?}");
    }
}

#[test]
fn values_that_no_board_can_obey_are_refused() {
    let good = steering().told();
    for (index, value) in [
        (0, 2),
        (1, 2),
        (2, 9),
        (3, 39),
        (3, 201),
        (3, 356),
        (4, 1_999),
        (5, 2),
    ] {
        let mut values = good;
        values[index] = value;
        assert_eq!(SteeringProfile::obeyed(&values), None, "{values:?}");
    }
    let good = sensors().told();
    for (index, value) in [
        (0, 2),
        (1, 4),
        (1, 257),
        (2, 60),
        (2, 2),
        (3, 109),
        (3, 1_024),
        (4, 201),
    ] {
        let mut values = good;
        values[index] = value;
        assert_eq!(SensorProfile::obeyed(&values), None, "{values:?}");
    }
}

#[test]
fn a_wrong_value_is_told_with_its_key_and_what_to_do() {
    let wheels = |change: fn(&mut WheelsProfile)| {
        let mut wheels = WheelsProfile::default();
        change(&mut wheels);
        wheels.validate().expect_err("wrong").to_string()
    };
    let ranger = |change: fn(&mut RangerProfile)| {
        let mut ranger = sensors().ranger;
        change(&mut ranger);
        ranger.validate().expect_err("wrong").to_string()
    };
    for (said, words) in [
        (
            wheels(|wheels| wheels.duty = 20),
            ["[wheels] duty is 20", "40 to 200"],
        ),
        (
            wheels(|wheels| wheels.full_turn_ms = 100),
            ["full_turn_ms is 100", "take the time"],
        ),
        (
            ranger(|ranger| ranger.near_cm = 1),
            ["near_cm is 1", "3 to 200"],
        ),
        (
            ranger(|ranger| ranger.far_cm = 12),
            ["far_cm is 12", "smaller"],
        ),
        (
            ranger(|ranger| ranger.near_reading = 91),
            ["near_reading is 91", "measure both again"],
        ),
        (
            ranger(|ranger| ranger.near_reading = 3_000),
            ["near_reading is 3000", "at most 1023"],
        ),
    ] {
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    }
    let named = RangerProfile {
        near_cm: 0,
        ..RangerProfile::default()
    };
    assert_eq!(named.validate(), Ok(()), "the points do not count");
}
