//! How profiles reach their boards.

use lager_wire::{ResetCause, SettingKey};

use super::*;

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn accepted(to: &Setting) -> SettingReply {
    SettingReply {
        key: to.key,
        seq: to.seq,
        value: to.value,
        status: SettingStatus::Accepted,
    }
}

fn up() -> ProfileTeller {
    let mut teller = ProfileTeller::new(&ArmProfile::default());
    assert_eq!(teller.poll(ms(0)), None, "nobody is there");
    teller.board_up(ms(0), Version::One, true);
    teller
}

#[test]
fn every_value_is_told_once_and_then_put_in_force() {
    let mut teller = up();
    let mut told = Vec::new();
    while let Some(setting) = teller.poll(ms(0)) {
        assert_eq!(teller.state(), ProfileState::Telling);
        assert_eq!(teller.poll(ms(0)), None, "one at a time");
        assert!(teller.answer(ms(0), &accepted(&setting)));
        assert!(!teller.answer(ms(0), &accepted(&setting)), "once");
        told.push(setting);
    }
    assert_eq!(teller.state(), ProfileState::Accepted);
    assert_eq!(teller.next_due(), None);
    let values = ArmProfile::default().values();
    assert_eq!(told.len(), values.len() + 1);
    for (index, setting) in told.iter().take(values.len()).enumerate() {
        assert_eq!(ArmProfile::index(setting.key), Some(index));
        assert_eq!(setting.value, values[index].cast_signed());
    }
    let last = told.last().expect("a check value");
    assert_eq!(last.key, SettingKey::ArmProfile);
    assert_eq!(last.value, ArmProfile::check(&values));
}

#[test]
fn a_board_that_does_not_answer_is_asked_again_and_said_to_be_silent() {
    let mut teller = up();
    let asked: Vec<u64> = (0..6_000)
        .filter(|now| teller.poll(ms(*now)).is_some())
        .collect();
    assert_eq!(asked[..5], [0, 60, 120, 180, 5_240]);
    assert_eq!(teller.state(), ProfileState::Unanswered);
    let setting = teller.poll(ms(11_000)).expect("it goes on asking");
    teller.answer(ms(11_000), &accepted(&setting));
    assert_eq!(teller.state(), ProfileState::Telling);
}

#[test]
fn what_the_board_does_not_take_is_refused_whatever_its_words() {
    for (status, off_by) in [
        (SettingStatus::OutOfRange, 0),
        (SettingStatus::NotHere, 0),
        (SettingStatus::Accepted, 1),
    ] {
        let mut teller = up();
        let setting = teller.poll(ms(0)).expect("the first value");
        let reply = SettingReply {
            value: setting.value - off_by,
            status,
            ..accepted(&setting)
        };
        assert!(teller.answer(ms(0), &reply));
        assert_eq!(teller.state(), ProfileState::Refused);
        assert_eq!(teller.poll(ms(5_000)), None);
    }
}

#[test]
fn a_board_that_comes_up_again_is_told_from_the_beginning() {
    let mut teller = up();
    for _ in 0..7 {
        let setting = teller.poll(ms(0)).expect("a value");
        teller.answer(ms(0), &accepted(&setting));
    }
    teller.board_down();
    assert_eq!(teller.state(), ProfileState::NoBoard);
    teller.board_up(ms(9), Version::One, true);
    let setting = teller.poll(ms(9)).expect("the first value");
    assert_eq!(ArmProfile::index(setting.key), Some(0));
    teller.board_up(ms(20), Version::Original, true);
    assert_eq!(teller.state(), ProfileState::NoBoard);
    assert_eq!(teller.poll(ms(20)), None);
}
fn board(callsign: Callsign, rebooted: bool) -> Up {
    Up {
        callsign,
        version: Version::One,
        epoch: 1,
        reset: ResetCause::PowerOn,
        rebooted,
        fresh: false,
        build: 1,
    }
}

/// Answers everything that a board is asked; what it was asked.
fn obey(profiles: &mut Profiles, callsign: Callsign) -> Vec<Setting> {
    obey_at(profiles, callsign, ms(0))
}

fn obey_at(profiles: &mut Profiles, callsign: Callsign, now: Duration) -> Vec<Setting> {
    let mut told = Vec::new();
    while let Some(setting) = profiles.poll(now, callsign) {
        assert!(profiles.answer(now, &accepted(&setting)));
        told.push(setting);
    }
    told
}

#[test]
fn the_wheels_wait_for_both_boards_and_the_steering_board_hears_of_them_first() {
    let robot = RobotProfile::default();
    let mut profiles = Profiles::new(&robot, None);
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Open, Gate::Open)
    );
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Held, Gate::Held)
    );
    let told = obey(&mut profiles, Callsign::Steering);
    let wheels: Vec<_> = robot
        .steering
        .settings()
        .map(|setting| setting.key)
        .collect();
    let keys: Vec<_> = told.iter().map(|setting| setting.key).collect();
    assert_eq!(keys[..wheels.len()], wheels);
    assert_eq!(keys.len(), wheels.len() + ArmProfile::VALUES + 1);
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Open, Gate::Open)
    );
    profiles.board_up(ms(0), &board(Callsign::Sensor, true));
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Held, Gate::Open)
    );
    obey(&mut profiles, Callsign::Sensor);
    assert_eq!(profiles.wheels(), Gate::Open);
}

#[test]
fn a_board_that_does_not_take_it_keeps_the_wheels_still() {
    let mut profiles = Profiles::new(&RobotProfile::default(), None);
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    profiles.board_up(ms(0), &board(Callsign::Sensor, true));
    let setting = profiles.poll(ms(0), Callsign::Sensor).expect("a value");
    let refused = SettingReply {
        status: SettingStatus::NotHere,
        ..accepted(&setting)
    };
    assert!(profiles.answer(ms(0), &refused));
    obey(&mut profiles, Callsign::Steering);
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Shut, Gate::Open)
    );
}

#[test]
fn a_board_that_was_told_and_did_not_restart_is_told_again_while_it_moves() {
    let robot = RobotProfile::default();
    let mut profiles = Profiles::new(&robot, None);
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    obey(&mut profiles, Callsign::Steering);
    let mut kept = Health::default();
    profiles.fill(&mut kept);
    for mut profiles in [profiles, Profiles::new(&robot, Some(&kept))] {
        profiles.board_up(ms(0), &board(Callsign::Steering, false));
        assert_eq!(profiles.wheels(), Gate::Open);
        assert_eq!(profiles.states()[0].1, ProfileState::Telling);
        obey(&mut profiles, Callsign::Steering);
        profiles.board_up(ms(0), &board(Callsign::Steering, true));
        assert_eq!(profiles.wheels(), Gate::Held);
        obey(&mut profiles, Callsign::Steering);
        profiles.board_down(Callsign::Steering);
        profiles.board_up(ms(0), &board(Callsign::Steering, false));
        assert_eq!(profiles.wheels(), Gate::Held, "it may be another board");
    }
}

/// A robot with its motors swapped.
fn swapped() -> RobotProfile {
    let mut robot = RobotProfile::default();
    robot.steering.wheels.swapped = true;
    robot
}

#[test]
fn what_is_tried_is_told_as_a_whole_and_the_wheels_stand_meanwhile() {
    let mut profiles = Profiles::new(&RobotProfile::default(), None);
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    obey(&mut profiles, Callsign::Steering);
    let before = profiles.told;

    let ask = Ask::describe(Part::Steering, &swapped());
    let mut cut = ask;
    cut.described -= 1;
    let mut wild = ask;
    wild.values[3] = 1;
    for wrong in [cut, wild, Ask::default()] {
        assert!(!profiles.describe(ms(0), Part::Steering, &wrong, Version::One));
    }
    assert_eq!((profiles.told, profiles.wheels()), (before, Gate::Open));

    assert!(profiles.describe(ms(0), Part::Steering, &ask, Version::One));
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Held, Gate::Open)
    );
    let told = obey(&mut profiles, Callsign::Steering);
    assert_eq!(
        told.iter().map(|setting| setting.value).collect::<Vec<_>>(),
        swapped()
            .steering
            .settings()
            .map(|told| told.value)
            .collect::<Vec<_>>()
    );
    assert_eq!(profiles.state(Part::Steering), ProfileState::Accepted);
    assert_eq!(profiles.wheels(), Gate::Open);
    assert_ne!(profiles.told, before);
}

#[test]
fn while_the_arm_is_limp_the_wheels_stand() {
    let mut robot = RobotProfile::default();
    let mut profiles = Profiles::new(&robot, None);
    for callsign in [Callsign::Sensor, Callsign::Steering] {
        profiles.board_up(ms(0), &board(callsign, true));
        obey(&mut profiles, callsign);
    }
    for (torque_limit, gate) in [(LIMP, Gate::Held), (600, Gate::Open)] {
        robot.arm.torque_limit = torque_limit;
        robot.arm.squeeze_load = 300;
        let ask = Ask::describe(Part::Arm, &robot);
        assert!(profiles.describe(ms(0), Part::Arm, &ask, Version::One));
        obey(&mut profiles, Callsign::Steering);
        assert_eq!(profiles.state(Part::Arm), ProfileState::Accepted);
        assert_eq!(profiles.wheels(), gate);
    }
}

#[test]
fn a_successor_that_tells_otherwise_does_not_trust_what_the_board_knows() {
    let robot = RobotProfile::default();
    let mut profiles = Profiles::new(&robot, None);
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    obey(&mut profiles, Callsign::Steering);
    let ask = Ask::describe(Part::Steering, &swapped());
    assert!(profiles.describe(ms(0), Part::Steering, &ask, Version::One));
    obey(&mut profiles, Callsign::Steering);
    let mut kept = Health::default();
    profiles.fill(&mut kept);
    for (configured, gate) in [(robot, Gate::Held), (swapped(), Gate::Open)] {
        let mut successor = Profiles::new(&configured, Some(&kept));
        successor.board_up(ms(0), &board(Callsign::Steering, false));
        assert_eq!(successor.wheels(), gate);
    }
}

#[test]
fn a_board_that_never_answers_hears_of_its_arm_all_the_same() {
    let mut profiles = Profiles::new(&RobotProfile::default(), None);
    profiles.board_up(ms(0), &board(Callsign::Steering, true));
    let mut asked = Vec::new();
    for now in 0..1_000 {
        asked.extend(profiles.poll(ms(now), Callsign::Steering));
    }
    let keys: Vec<_> = asked.iter().map(|setting| setting.key).collect();
    assert_eq!(keys[..4], [SettingKey::SteeringSwapped; 4]);
    assert_eq!(keys[4..], [SettingKey::ArmTorqueLimit; 4]);
    assert_eq!(
        (profiles.wheels(), profiles.arm()),
        (Gate::Shut, Gate::Shut)
    );
}

fn told(profiles: &Profiles) -> u32 {
    let mut health = Health::default();
    profiles.fill(&mut health);
    health.description
}

/// Profiles of which the steering board's is tried from 0 s on, and the hash of the former ones.
fn tried(ask: &Ask) -> (Profiles, u32) {
    let mut profiles = Profiles::new(&RobotProfile::default(), None);
    let before = told(&profiles);
    assert!(
        !profiles.renew(ms(0), Part::Steering, ask),
        "nobody obeys it yet"
    );
    assert!(profiles.describe(ms(0), Part::Steering, ask, Version::One));
    obey(&mut profiles, Callsign::Steering);
    assert_ne!(told(&profiles), before);
    (profiles, before)
}

#[test]
fn a_description_that_nobody_tries_any_more_is_taken_back() {
    let ask = Ask::try_out(Part::Steering, &swapped());
    let (mut profiles, before) = tried(&ask);
    assert!(profiles.renew(ms(4_000), Part::Steering, &ask));
    assert_eq!(profiles.lapse(ms(8_999)), []);
    assert_eq!(profiles.next_due(), Some(ms(9_000)));
    assert_eq!(profiles.lapse(ms(9_000)), [Part::Steering]);
    assert_eq!(told(&profiles), before);
    assert_eq!(profiles.wheels(), Gate::Held, "the board has to take it");
    obey_at(&mut profiles, Callsign::Steering, ms(9_000));
    assert_eq!(profiles.wheels(), Gate::Open);
    assert_eq!(profiles.lapse(ms(99_000)), []);
}

#[test]
fn of_trials_one_after_the_other_that_is_taken_back_which_held_before_all() {
    let ask = Ask::try_out(Part::Steering, &swapped());
    let (mut profiles, before) = tried(&ask);
    let mut third = swapped();
    third.steering.wheels.left_reversed = true;
    let ask = Ask::try_out(Part::Steering, &third);
    assert!(profiles.describe(ms(2_000), Part::Steering, &ask, Version::One));
    obey_at(&mut profiles, Callsign::Steering, ms(2_000));
    assert_eq!(profiles.lapse(ms(6_999)), []);
    assert_eq!(profiles.lapse(ms(7_000)), [Part::Steering]);
    assert_eq!(told(&profiles), before);
}

#[test]
fn what_is_told_for_good_after_a_trial_stays() {
    let (mut profiles, before) = tried(&Ask::try_out(Part::Steering, &swapped()));
    let ask = Ask::describe(Part::Steering, &swapped());
    assert!(profiles.renew(ms(1_000), Part::Steering, &ask));
    assert_eq!(profiles.lapse(ms(99_000)), []);
    assert_ne!(told(&profiles), before);
}
