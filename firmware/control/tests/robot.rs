//! What the Pi tells a board of its robot: obeyed as a whole, and kept without power.

mod support;

use lager_control::{Motor, SensorConfig, SensorUnit, SteeringConfig, SteeringUnit};
use lager_wire::{
    Centimetres, IrModel, LineProfile, LineState, Payload, Profile, RangerProfile, SensorProfile,
    Setting, SettingKey, SettingReply, SettingStatus, SteeringProfile, WheelCommand, WheelsProfile,
};
use support::servos::Servos;
use support::{Bench, Pi, SensorBench};

const FORWARD: u8 = WheelCommand::ManualForward.code();
const LEFT: u8 = WheelCommand::ManualLeft.code();
const STANDBY: u8 = WheelCommand::Standby.code();

fn other() -> SteeringProfile {
    SteeringProfile {
        wheels: WheelsProfile {
            swapped: true,
            left_reversed: false,
            right_reversed: true,
            duty: 140,
            full_turn_ms: 8_000,
        },
        divider: true,
    }
}

fn other_sensors() -> SensorProfile {
    SensorProfile {
        line: LineProfile {
            dark_is_high: false,
        },
        ranger: RangerProfile {
            model: IrModel::Own,
            near_cm: 15,
            near_reading: 400,
            far_cm: 60,
            far_reading: 100,
        },
    }
}

/// The answers to settings that the Pi has heard.
fn replies(pi: &Pi) -> Vec<SettingReply> {
    let all = pi.all(|payload| match payload {
        Payload::SettingReply(reply) => Some(reply),
        _ => None,
    });
    all.into_iter().map(|(_, reply)| reply).collect()
}

/// Tells a profile; the answer to its check value.
fn tell(profile: &impl Profile, mut ask: impl FnMut(Setting) -> SettingReply) -> SettingReply {
    let mut last = None;
    for (number, setting) in profile.settings().enumerate() {
        let setting = Setting {
            seq: number as u8,
            ..setting
        };
        let reply = ask(setting);
        assert_eq!((reply.key, reply.seq), (setting.key, setting.seq));
        last = Some(reply);
    }
    last.expect("a check value")
}

fn tell_steering(bench: &mut Bench, profile: &SteeringProfile) -> SettingReply {
    tell(profile, |setting| {
        bench.pi.packets.clear();
        bench.send(Payload::Setting(setting));
        bench.run_ms(20);
        replies(&bench.pi)[0]
    })
}

fn tell_sensors(bench: &mut SensorBench, profile: &SensorProfile) -> SettingReply {
    tell(profile, |setting| {
        bench.pi.packets.clear();
        bench.send(Payload::Setting(setting));
        bench.run_ms(40);
        replies(&bench.pi)[0]
    })
}

#[test]
fn the_drivers_get_what_turns_this_robots_motors_the_right_way() {
    let mut bench = Bench::ready();
    let reply = tell_steering(&mut bench, &other());
    assert_eq!(reply.status, SettingStatus::Accepted);
    assert_eq!(reply.value, SteeringProfile::check(&other().told()));
    bench.command(FORWARD);
    bench.run_ms(20);
    // The left driver has the right motor, which is reversed.
    assert_eq!(
        bench.pins.motors,
        (Motor::backward(140), Motor::forward(140))
    );
    let report = bench.report();
    assert_eq!((report.left_duty, report.right_duty), (140, 140));
    assert_eq!(report.battery_decivolts, 111);
    bench.command(LEFT);
    bench.run_ms(20);
    assert_eq!(
        bench.pins.motors,
        (Motor::backward(140), Motor::backward(140))
    );
}

#[test]
fn another_robot_told_while_the_wheels_turn_makes_them_stand_until_a_new_command() {
    let mut bench = Bench::ready();
    let same = SteeringProfile::default();
    bench.command(FORWARD);
    bench.run_ms(20);
    tell_steering(&mut bench, &same);
    assert_eq!(bench.duties(), (100, 100), "nothing has changed");
    tell_steering(&mut bench, &other());
    assert_eq!(bench.duties(), (0, 0));
    bench.run_ms(100);
    assert_eq!(bench.duties(), (0, 0), "a renewal moves nothing");
    bench.command(STANDBY);
    bench.run_ms(20);
    bench.command(FORWARD);
    bench.run_ms(20);
    assert_eq!(bench.duties(), (140, 140));
}

#[test]
fn what_did_not_come_whole_or_cannot_be_obeyed_changes_nothing() {
    let mut bench = Bench::ready();
    let mut wrong = other();
    wrong.wheels.duty = 250;
    let reply = tell_steering(&mut bench, &wrong);
    assert_eq!(reply.status, SettingStatus::OutOfRange);
    assert_eq!(
        reply.value,
        SteeringProfile::check(&SteeringProfile::default().told())
    );
    bench.set(SettingKey::SteeringDuty, 9, 140);
    bench.run_ms(20);
    let check = SteeringProfile::check(&other().told());
    bench.pi.packets.clear();
    bench.set(SettingKey::Steering, 10, check ^ 1);
    bench.run_ms(20);
    assert_eq!(replies(&bench.pi)[0].status, SettingStatus::OutOfRange);
    bench.command(FORWARD);
    bench.run_ms(20);
    assert_eq!(
        bench.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    bench.set(SettingKey::Steering, 11, check);
    bench.run_ms(20);
    assert_eq!(replies(&bench.pi)[1].status, SettingStatus::Accepted);
}

#[test]
fn a_board_that_resets_still_knows_its_robot_and_its_gains() {
    let mut bench = Bench::ready();
    bench.set(SettingKey::GainP, 1, 5);
    tell_steering(&mut bench, &other());
    bench.run_ms(500);
    let config = SteeringConfig::default();
    let mut again = Bench::boot(0, config, Servos::at([512; 8]));
    again.pins.eeprom = bench.pins.eeprom;
    again.unit = SteeringUnit::new(&again.pins, config);
    again.run_ms(200);
    again.command(STANDBY);
    again.run_ms(20);
    again.command(FORWARD);
    again.run_ms(20);
    assert_eq!(
        again.pins.motors,
        (Motor::backward(140), Motor::forward(140))
    );
    again.pi.packets.clear();
    again.set(SettingKey::GainP, 2, -1);
    again.run_ms(20);
    assert_eq!(replies(&again.pi)[0].value, 5, "the gain in force");
}

/// The line state that the Pi heard last.
fn state(bench: &SensorBench) -> LineState {
    let states = bench.pi.all(|payload| match payload {
        Payload::Line(state) => Some(state),
        _ => None,
    });
    states.last().expect("a state").1
}

#[test]
fn sensors_that_read_low_over_tape_see_the_same_line() {
    let line = 0b000_0111_0000;
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.tape(!line & 0x7FF);
    bench.run_ms(40);
    assert!(
        bench
            .pins
            .words
            .iter()
            .all(|(_, word)| *word == !line & 0x7FF)
    );
    let reply = tell_sensors(&mut bench, &other_sensors());
    assert_eq!(reply.status, SettingStatus::Accepted);
    bench.pi.packets.clear();
    bench.pins.words.clear();
    bench.run_ms(40);
    assert_eq!(state(&bench), LineState::OnLine);
    assert!(bench.pins.words.iter().all(|(_, word)| *word == line));
    bench.tape(0x7FF);
    bench.run_ms(40);
    assert_eq!(state(&bench), LineState::NotOnLine);
}

#[test]
fn a_sensor_board_that_resets_still_knows_its_robot() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    tell_sensors(&mut bench, &other_sensors());
    bench.run_ms(500);
    let config = SensorConfig::default();
    let mut again = SensorBench::boot(0, config);
    again.pins.eeprom = bench.pins.eeprom;
    again.unit = SensorUnit::new(&again.pins, config);
    again.tape(!0b000_0111_0000 & 0x7FF);
    again.pins.ir = 200;
    again.run_ms(100);
    assert_eq!(state(&again), LineState::OnLine);
    let distances = again.pi.all(|payload| match payload {
        Payload::Distance(distance) => Some(distance),
        _ => None,
    });
    assert_eq!(distances.last().expect("one").1, Centimetres(30));
}
