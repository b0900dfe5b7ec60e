//! The arm's servos on their wire: golden bytes, faults, the lock.

use std::time::Duration;

use lager_ax12::ErrorBits;
use lager_emulator::chip::UsartId;
use lager_emulator::rig::Board;
use lager_plant::{ArmBuild, ServoFault};
use lager_wire::{
    ArmCommand, ArmProfile, Command, LIMP, OneOrTwo, Payload, Profile, Setting, SettingKey,
    SettingStatus, SteerFlags, WheelCommand,
};

use crate::support::Robot;

/// No arm command takes longer: the longest sequence has three parts of 4 s each.
const LONGEST: Duration = Duration::from_secs(14);

/// A robot whose servos are in service and whose arm is unlocked.
fn ready(seed: u64) -> Robot {
    let mut robot = Robot::up(seed);
    robot.run(Duration::from_millis(980));
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(20));
    assert_eq!(robot.report().servo_errors, 0);
    robot
}

/// Gives an arm command, waits for its end, and returns the flags of the report about it.
fn carry_out(robot: &mut Robot, command: ArmCommand) -> SteerFlags {
    let seq = robot.steering.order(&mut robot.rig, Command::Arm(command));
    let mut waited = Duration::ZERO;
    let step = Duration::from_millis(20);
    while robot.report().finished_seq != seq {
        robot.run(step);
        waited += step;
        assert!(waited < LONGEST, "{command:?} never ends");
    }
    robot.report().flags
}

/// Whole packets that the board wrote to the wire.
fn packets(robot: &Robot) -> Vec<Vec<u8>> {
    let bytes: Vec<u8> = robot
        .rig
        .servo_wire()
        .take()
        .iter()
        .filter(|byte| byte.from_board)
        .map(|byte| byte.byte)
        .collect();
    let mut packets = Vec::new();
    let mut rest = &bytes[..];
    while let [0xFF, 0xFF, _, length, ..] = rest {
        let (packet, others) = rest.split_at(usize::from(*length) + 4);
        packets.push(packet.to_owned());
        rest = others;
    }
    assert!(rest.is_empty(), "{rest:02X?} belongs to no packet");
    packets
}

/// Sends the board a setting; returns whether the board accepts it.
fn set(robot: &mut Robot, key: SettingKey, seq: u8, value: i16) -> bool {
    let setting = Setting { key, seq, value };
    robot.steering.packets.clear();
    robot
        .steering
        .send(&mut robot.rig, Payload::Setting(setting));
    robot.run(Duration::from_millis(10));
    robot
        .steering
        .packets
        .iter()
        .find_map(|arrived| match arrived.packet.payload {
            Payload::SettingReply(reply) if (reply.key, reply.seq) == (key, seq) => {
                Some(reply.status == SettingStatus::Accepted)
            }
            _ => None,
        })
        .expect("the board answers")
}

/// Tells the board a profile, value by value, and puts it in force.
fn tell(robot: &mut Robot, profile: &ArmProfile) {
    for (setting, seq) in profile.settings().zip(1..) {
        assert!(set(robot, setting.key, seq, setting.value), "{setting:?}");
    }
}

/// Packets as the manual writes them.
fn written(packets: &[Vec<u8>]) -> Vec<String> {
    let hex = |byte: &u8| format!("{byte:02X}");
    let line = |packet: &Vec<u8>| packet.iter().map(hex).collect::<Vec<_>>().join(" ");
    packets.iter().map(line).collect()
}

/// The packets that write (instruction 3), without the questions.
fn writes(robot: &Robot) -> Vec<Vec<u8>> {
    let mut packets = packets(robot);
    packets.retain(|packet| packet[4] == 3);
    packets
}

/// The first writes of each command in the arm's pose for driving: position, speed and torque of
/// each joint's servo, checked by hand against the AX-12's manual. If this fails do not change it.
#[test]
fn each_command_writes_its_golden_bytes() {
    const GOLDEN: [(ArmCommand, &[&str]); 11] = [
        (
            ArmCommand::Left,
            &["FF FF 01 09 03 1E 03 02 00 00 FF 03 CD"],
        ),
        (
            ArmCommand::Right,
            &["FF FF 01 09 03 1E FD 01 00 00 FF 03 D4"],
        ),
        (
            ArmCommand::Up,
            &[
                "FF FF 02 09 03 1E 5B 02 00 00 FF 03 74",
                "FF FF 03 09 03 1E A4 01 00 00 FF 03 2B",
            ],
        ),
        (
            ArmCommand::Down,
            &[
                "FF FF 02 09 03 1E 55 02 00 00 FF 03 7A",
                "FF FF 03 09 03 1E AA 01 00 00 FF 03 25",
            ],
        ),
        (
            ArmCommand::Out,
            &[
                "FF FF 04 09 03 1E 93 01 00 00 FF 03 3B",
                "FF FF 05 09 03 1E 6C 02 00 00 FF 03 60",
            ],
        ),
        (
            ArmCommand::In,
            &[
                "FF FF 04 09 03 1E 8D 01 00 00 FF 03 41",
                "FF FF 05 09 03 1E 72 02 00 00 FF 03 5A",
            ],
        ),
        (
            ArmCommand::CounterClockwise,
            &["FF FF 07 09 03 1E 03 02 00 00 FF 03 C7"],
        ),
        (
            ArmCommand::Clockwise,
            &["FF FF 07 09 03 1E FD 01 00 00 FF 03 CE"],
        ),
        // Three steps of the claw, 3 units each.
        (
            ArmCommand::Squeeze,
            &[
                "FF FF 08 09 03 1E FD 01 00 00 FF 03 CD",
                "FF FF 08 09 03 1E FA 01 00 00 FF 03 D0",
                "FF FF 08 09 03 1E F7 01 00 00 FF 03 D3",
            ],
        ),
        // Opens softly: speed 100.
        (
            ArmCommand::Release,
            &["FF FF 08 09 03 1E 00 02 64 00 FF 03 65"],
        ),
        // Moves to the drop pose (512, 300 and 723, 512 and 511, 512), opens, and moves back.
        (
            ArmCommand::Drop,
            &[
                "FF FF 01 09 03 1E 00 02 64 00 FF 03 6C",
                "FF FF 02 09 03 1E 2C 01 64 00 FF 03 40",
                "FF FF 03 09 03 1E D3 02 64 00 FF 03 97",
                "FF FF 04 09 03 1E 00 02 64 00 FF 03 69",
                "FF FF 05 09 03 1E FF 01 64 00 FF 03 6A",
                "FF FF 06 09 03 1E 00 02 64 00 FF 03 67",
                "FF FF 08 09 03 1E 00 02 64 00 FF 03 65",
                "FF FF 01 09 03 1E 00 02 64 00 FF 03 6C",
                "FF FF 02 09 03 1E 58 02 64 00 FF 03 13",
                "FF FF 03 09 03 1E A7 01 64 00 FF 03 C4",
                "FF FF 04 09 03 1E 90 01 64 00 FF 03 DA",
                "FF FF 05 09 03 1E 6F 02 64 00 FF 03 F9",
                "FF FF 06 09 03 1E 00 02 64 00 FF 03 67",
            ],
        ),
    ];
    for (command, golden) in GOLDEN {
        let mut robot = ready(1);
        robot.rig.servo_wire().record();
        carry_out(&mut robot, command);
        let writes = writes(&robot);
        let written = written(&writes);
        let count = golden.len();
        assert!(written.len() >= count, "{command:?}: {written:#?}");
        assert_eq!(written[..count], *golden, "{command:?}");
        if command != ArmCommand::Squeeze {
            assert_eq!(written.len(), count, "{command:?} writes no more");
        }
        assert_eq!(robot.rig.servo_wire().strange_bytes(), 0);
    }
}

#[test]
fn no_byte_of_an_answer_is_lost_while_words_come_in() {
    // With these seeds answers and words met when only the servos' own interrupt took bytes.
    for seed in [1, 5, 7, 14, 21] {
        let mut robot = ready(seed);
        carry_out(&mut robot, ArmCommand::Drop);
        let chip = robot.rig.chip(Board::Steering);
        assert_eq!(chip.overruns(UsartId::One), 0, "seed {seed}");
    }
}

#[test]
fn an_arm_command_is_refused_while_the_robot_drives() {
    let mut robot = ready(2);
    robot.wheels(WheelCommand::ManualForward);
    robot.run(Duration::from_millis(100));
    robot.rig.servo_wire().record();
    robot.rig.take_motor_changes();
    let seq = robot
        .steering
        .order(&mut robot.rig, Command::Arm(ArmCommand::Left));
    robot.run(Duration::from_millis(50));
    let report = robot.report();
    assert_eq!(report.finished_seq, seq);
    assert!(
        report
            .flags
            .contains(SteerFlags::REFUSED.with(SteerFlags::ARM_LOCKED))
    );
    assert_eq!(robot.rig.take_motor_changes(), [], "it drives on");
    assert_eq!(writes(&robot), Vec::<Vec<u8>>::new());
}

#[test]
fn an_unplugged_servo_holds_up_nobody_for_long() {
    let mut robot = ready(3);
    robot.rig.world_mut().servos().set_present(3, false);
    let flags = carry_out(&mut robot, ArmCommand::Up);
    assert!(flags.contains(SteerFlags::ABORTED), "it needs servo 3");
    assert_eq!(robot.report().servo_errors, 1 << 2);
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(!flags.contains(SteerFlags::ABORTED), "servo 1 works");
    assert!(robot.steering_status().servo_timeouts > 0);
    // When servo 3 is plugged in again, the board brings it into service in its turn.
    robot.rig.world_mut().servos().set_present(3, true);
    robot.run(Duration::from_secs(3));
    assert_eq!(robot.report().servo_errors, 0);
    let flags = carry_out(&mut robot, ArmCommand::Up);
    assert!(!flags.contains(SteerFlags::ABORTED));
}

#[test]
fn answers_with_a_bad_checksum_are_no_answers() {
    let mut robot = ready(4);
    let fault = ServoFault {
        garbled: true,
        ..ServoFault::default()
    };
    robot.rig.world_mut().servos().set_fault(1, fault);
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(flags.contains(SteerFlags::ABORTED));
    assert_eq!(robot.report().servo_errors, 1);
    let flags = carry_out(&mut robot, ArmCommand::Clockwise);
    assert!(!flags.contains(SteerFlags::ABORTED), "servo 7 works");
}

#[test]
fn an_overloaded_servo_is_told_of_and_the_others_work() {
    let mut robot = ready(5);
    let fault = ServoFault {
        errors: ErrorBits::OVERLOAD,
        ..ServoFault::default()
    };
    robot.rig.world_mut().servos().set_fault(2, fault);
    carry_out(&mut robot, ArmCommand::Up);
    assert_eq!(robot.report().servo_errors, 1 << 1);
    let flags = carry_out(&mut robot, ArmCommand::Out);
    assert!(!flags.contains(SteerFlags::ABORTED), "the elbow works");
    robot
        .rig
        .world_mut()
        .servos()
        .set_fault(2, ServoFault::default());
    robot.run(Duration::from_secs(3));
    assert_eq!(robot.report().servo_errors, 0);
}

#[test]
fn an_arm_command_is_broken_off_by_a_silent_pi() {
    let mut robot = ready(6);
    let drop = Command::Arm(ArmCommand::Drop);
    let seq = robot.steering.order(&mut robot.rig, drop);
    robot.run(Duration::from_millis(300));
    assert!(robot.report().flags.contains(SteerFlags::BUSY));
    robot.steering.fall_silent();
    robot.run(Duration::from_millis(400));
    let report = robot.report();
    assert_eq!(report.finished_seq, seq);
    assert!(report.flags.contains(SteerFlags::ABORTED));
}

#[test]
fn at_power_up_the_arm_is_locked_until_the_first_standby() {
    let mut robot = Robot::up(21);
    robot.run(Duration::from_millis(1_000));
    assert!(robot.report().flags.contains(SteerFlags::ARM_LOCKED));
    robot.rig.servo_wire().record();
    let flags = carry_out(&mut robot, ArmCommand::Up);
    assert!(flags.contains(SteerFlags::REFUSED));
    assert_eq!(writes(&robot), Vec::<Vec<u8>>::new(), "nothing moved");
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(20));
    let flags = carry_out(&mut robot, ArmCommand::Up);
    assert!(!flags.contains(SteerFlags::REFUSED) && !flags.contains(SteerFlags::ABORTED));
    assert!(!writes(&robot).is_empty());
}

#[test]
fn the_board_obeys_the_profile_it_is_told() {
    let mut robot = ready(22);
    let mut profile = ArmProfile {
        torque_limit: 0x0155,
        squeeze_load: 200,
        ..ArmProfile::default()
    };
    profile.limits.base.highest = 514;
    robot.rig.servo_wire().record();
    for (index, value) in profile.values().into_iter().enumerate() {
        let key = ArmProfile::key(index).expect("a key");
        assert!(set(&mut robot, key, index as u8, value.cast_signed()));
    }
    assert_eq!(writes(&robot), Vec::<Vec<u8>>::new(), "not yet in force");
    let check = ArmProfile::check(&profile.values());
    assert!(!set(&mut robot, SettingKey::ArmProfile, 98, check ^ 1));
    assert!(set(&mut robot, SettingKey::ArmProfile, 99, check));
    robot.run(Duration::from_millis(50));
    let told = writes(&robot);
    let torque = told
        .iter()
        .filter(|packet| packet[5] == 0x1E && packet[10..12] == [0x55, 0x01]);
    assert_eq!(torque.count(), 8, "{told:02X?}");
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(!flags.contains(SteerFlags::REFUSED), "to the limit");
    let refused = robot.steering_status().refused;
    let _ = writes(&robot);
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(flags.contains(SteerFlags::REFUSED));
    assert_eq!(writes(&robot), Vec::<Vec<u8>>::new());
    assert_eq!(robot.steering_status().refused, refused + 1);
    let flags = carry_out(&mut robot, ArmCommand::Right);
    assert!(!flags.contains(SteerFlags::REFUSED), "back");
}

/// A robot whose base has id 21 and counts the other way, and whose shoulder has one servo.
#[test]
fn an_arm_that_is_built_otherwise_moves_as_it_is_described() {
    let mut robot = Robot::new(23);
    let mut arm = ArmBuild::default();
    arm.ids[0] = Some(21);
    arm.ids[2] = None;
    (arm.reversed[0], arm.reversed[7]) = (true, true);
    robot.rig.world_mut().servos().fit(&arm);
    robot.run(Duration::from_millis(1_480));
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(20));
    assert_eq!(robot.report().servo_errors, 0b101, "1 and 3 do not answer");
    let mut profile = ArmProfile::default();
    profile.servos.base = 21;
    profile.servos.shoulder = OneOrTwo::One(2);
    (profile.reversed.base, profile.reversed.gripper) = (true, true);
    tell(&mut robot, &profile);
    robot.run(Duration::from_millis(500));
    assert_eq!(robot.report().servo_errors, 0);

    let positions = |robot: &mut Robot| robot.rig.world_mut().servos().positions();
    let before = positions(&mut robot);
    robot.rig.servo_wire().record();
    for command in [ArmCommand::Left, ArmCommand::Up] {
        let flags = carry_out(&mut robot, command);
        assert!(!flags.contains(SteerFlags::ABORTED), "{command:?}");
    }
    let goals = written(&writes(&robot));
    // To the left from 512 is down to 1023 - 515.
    assert_eq!(goals[0], "FF FF 15 09 03 1E FC 01 00 00 FF 03 C1");
    assert_eq!(goals.len(), 2, "{goals:?}");
    assert!(goals[1].starts_with("FF FF 02 "), "{goals:?}");
    let after = positions(&mut robot);
    assert_eq!(after[0] - before[0], 3.0, "to the left");
    assert_eq!(after[1] - before[1], 3.0, "up");
    let flags = carry_out(&mut robot, ArmCommand::Squeeze);
    assert!(!flags.contains(SteerFlags::ABORTED));
    assert!(positions(&mut robot)[7] < 215.0, "closed on nothing");
}

/// What a limp arm's servos are told, checked by hand against the AX-12's manual: torque enable 0.
#[test]
fn a_limp_arms_torque_is_off_and_it_holds_afterwards_where_a_hand_has_brought_it() {
    let mut robot = ready(24);
    let limp = ArmProfile {
        torque_limit: LIMP,
        ..ArmProfile::default()
    };
    robot.rig.servo_wire().record();
    tell(&mut robot, &limp);
    robot.run(Duration::from_millis(100));
    let told = written(&writes(&robot));
    let off: Vec<_> = (1..=8_u8)
        .map(|id| {
            let sum = !(id + 4 + 3 + 0x18);
            format!("FF FF {id:02X} 04 03 18 00 {sum:02X}")
        })
        .collect();
    assert_eq!(off[0], "FF FF 01 04 03 18 00 DF");
    assert_eq!(told, off);
    robot.rig.world_mut().servos().bring(0, 700.0);
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(flags.contains(SteerFlags::ABORTED), "it has no torque");
    tell(&mut robot, &ArmProfile::default());
    robot.run(Duration::from_millis(500));
    let base = |robot: &mut Robot| robot.rig.world_mut().servos().positions()[0];
    assert_eq!(base(&mut robot), 700.0);
    let flags = carry_out(&mut robot, ArmCommand::Left);
    assert!(!flags.contains(SteerFlags::ABORTED));
    assert_eq!(base(&mut robot), 703.0);
}
