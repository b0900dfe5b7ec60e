//! Settings that change at run time, and settings that survive without power.

use std::time::Duration;

use lager_emulator::rig::Board;
use lager_wire::{
    LineReading, Payload, Profile, Setting, SettingKey, SettingReply, SettingStatus,
    SteeringProfile, WheelCommand, WheelsProfile, checksum,
};

use crate::support::Robot;

/// How many bytes of EEPROM the boards use.
const USED: usize = 192;

/// Sends a setting to the steering board and returns its answer.
fn set(robot: &mut Robot, value: i16) -> SettingReply {
    let setting = Setting {
        key: SettingKey::GainP,
        seq: 5,
        value,
    };
    robot.steering.packets.clear();
    robot
        .steering
        .send(&mut robot.rig, Payload::Setting(setting));
    robot.run(Duration::from_millis(400));
    let answer = robot
        .steering
        .packets
        .iter()
        .find_map(|arrived| match arrived.packet.payload {
            Payload::SettingReply(reply) => Some(reply),
            _ => None,
        });
    answer.expect("the board answers")
}

/// The gain in force: the board answers an impossible gain with it.
fn in_force(robot: &mut Robot) -> i16 {
    let reply = set(robot, 300);
    assert_eq!(reply.status, SettingStatus::OutOfRange);
    reply.value
}

/// A robot whose steering board starts with this EEPROM.
fn with_eeprom(content: &[u8]) -> Robot {
    let mut robot = Robot::new(2);
    robot.rig.chip(Board::Steering).set_eeprom(content);
    robot.run(Duration::from_millis(500));
    assert!(robot.steering.is_up());
    robot
}

#[test]
fn a_gain_outlives_the_power() {
    let mut robot = Robot::up(1);
    assert_eq!(in_force(&mut robot), 2, "the original's");
    assert_eq!(set(&mut robot, 9).status, SettingStatus::Accepted);
    let kept = robot.rig.chip(Board::Steering).eeprom(USED);
    assert_ne!(kept, [0xFF; USED]);
    assert_eq!(in_force(&mut with_eeprom(&kept)), 9);
}

#[test]
fn a_damaged_eeprom_is_not_believed() {
    let mut robot = Robot::up(3);
    set(&mut robot, 9);
    let kept = robot.rig.chip(Board::Steering).eeprom(USED);
    let written = kept.iter().filter(|byte| **byte != 0xFF).count();
    assert!(written > 0);
    for place in (0..USED).filter(|place| kept[*place] != 0xFF) {
        let mut damaged = kept.clone();
        damaged[place] ^= 0x10;
        assert_eq!(in_force(&mut with_eeprom(&damaged)), 2, "byte {place}");
    }
}

/// Tells the steering board its robot; it takes every value.
fn tell(robot: &mut Robot, profile: &SteeringProfile) {
    for (setting, seq) in profile.settings().zip(1..) {
        let setting = Setting { seq, ..setting };
        robot.steering.packets.clear();
        robot
            .steering
            .send(&mut robot.rig, Payload::Setting(setting));
        robot.run(Duration::from_millis(100));
        let taken = SettingReply {
            key: setting.key,
            seq,
            value: setting.value,
            status: SettingStatus::Accepted,
        };
        let mut packets = robot.steering.packets.iter();
        let is_taken =
            packets.any(|arrived| arrived.packet.payload == Payload::SettingReply(taken));
        assert!(is_taken, "{setting:?}");
    }
}

/// The duties at the drivers, as a part of the same forwards.
fn forwards(robot: &mut Robot) -> [i16; 2] {
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(50));
    robot.wheels(WheelCommand::ManualForward);
    robot.run(Duration::from_millis(50));
    robot.rig.duties().map(i16::signum)
}

#[test]
fn how_the_motors_are_connected_is_told_and_outlives_the_power() {
    let mut robot = Robot::up(5);
    assert_eq!(forwards(&mut robot), [1, 1]);
    let profile = SteeringProfile {
        wheels: WheelsProfile {
            swapped: true,
            right_reversed: true,
            ..WheelsProfile::default()
        },
        divider: false,
    };
    robot.wheels(WheelCommand::Standby);
    tell(&mut robot, &profile);
    // The left driver has the right motor.
    assert_eq!(forwards(&mut robot), [-1, 1]);
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(500));
    let kept = robot.rig.chip(Board::Steering).eeprom(USED);
    assert_eq!(forwards(&mut with_eeprom(&kept)), [-1, 1]);
}

#[test]
fn how_much_the_motors_differ_is_kept_and_used_in_the_first_turn() {
    // Four duty steps, in 256ths of one.
    let mut copy = vec![1, 1, 0, 4];
    copy.push(checksum(&copy));
    let mut kept = vec![0xFF; USED];
    kept[128..133].copy_from_slice(&copy);
    let mut robot = with_eeprom(&kept);
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(50));
    robot.wheels(WheelCommand::LeftPerp);
    robot.run(Duration::from_millis(50));
    let [left, right] = robot.rig.duties();
    assert_eq!((left, right), (-104, 96));
}

#[test]
fn while_the_line_sensors_are_calibrated_each_tells_in_turn_what_it_has_read() {
    let mut robot = Robot::up(4);
    let start = Setting {
        key: SettingKey::Calibrate,
        seq: 7,
        value: 1,
    };
    robot.place(0.0);
    robot.sensor.packets.clear();
    robot.sensor.send(&mut robot.rig, Payload::Setting(start));
    robot.run(Duration::from_millis(200));
    let told = robot.sensor.packets.iter().map(|arrived| arrived.packet);
    let readings: Vec<LineReading> = told
        .clone()
        .filter_map(|packet| match packet.payload {
            Payload::LineReading(reading) => Some(reading),
            _ => None,
        })
        .collect();
    assert!(readings.len() > 5 * 11, "{}", readings.len());
    for (place, reading) in readings.iter().enumerate() {
        assert_eq!(usize::from(reading.sensor), place % 11);
        assert!((reading.lowest..=reading.highest).contains(&reading.reading));
    }
    // The sensor in the middle is over the tape.
    let [edge, middle] = [0, 5].map(|sensor| readings[sensor].reading);
    assert!(middle > edge, "{middle} {edge}");
    // A distance comes between two readings.
    let distances = told.filter(|packet| matches!(packet.payload, Payload::Distance(_)));
    assert!(distances.count() >= readings.len() - 2);
}
