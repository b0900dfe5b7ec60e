//! The order of the core's effects, in virtual time.

use lager_orders::Mode;
use lager_stop::Stop;
use lager_topics::{
    Ask, AskKind, Origin, Outcome, Part, ProfileState, Role, SteeringOrder, SteeringReport,
    StopCause,
};
use lager_wire::link::Up;
use lager_wire::{
    Callsign, Command, Profile as _, ResetCause, RobotProfile, SettingReply, SettingStatus,
    SteerData, SteerFlags, Version, WheelCommand,
};

use super::*;
use crate::events::{BoardUp, PortEvent};

pub(super) const STEERING: usize = 1;

pub(super) fn at(millis: u64) -> Moment {
    let robot = Duration::from_millis(millis);
    let ns = millis * 1_000_000;
    Moment { robot, ns }
}

pub(super) fn options() -> CoreOptions {
    CoreOptions {
        baud: 500_000,
        raw_line: false,
        original_boards: false,
        robot: RobotProfile::default(),
    }
}

/// A core with a steering board that has reported, in the hands of a person.
pub(super) fn core() -> BridgeCore {
    let mut core = BridgeCore::new(options(), None);
    board_up(&mut core, 1_000, Callsign::Steering);
    obey(&mut core, 1_000, Callsign::Steering);
    report(&mut core, 1_001, IDLE);
    turn(&mut core, 1_001);
    core
}

/// The board takes what it is told of wheels or sensors; the arm's profile stays unanswered.
fn obey(core: &mut BridgeCore, millis: u64, board: Callsign) {
    let robot = options().robot;
    let settings: Vec<_> = match board {
        Callsign::Steering => robot.steering.settings().collect(),
        _ => robot.sensors.settings().collect(),
    };
    for (setting, seq) in settings.into_iter().zip(1..) {
        let reply = SettingReply {
            key: setting.key,
            seq,
            value: setting.value,
            status: SettingStatus::Accepted,
        };
        let place = usize::from(board == Callsign::Steering);
        core.port(at(millis), place, PortEvent::Setting(reply));
        turn(core, millis);
    }
}

/// A board comes up on the port that bears its name.
fn board_up(core: &mut BridgeCore, millis: u64, callsign: Callsign) {
    let up = Up {
        callsign,
        version: Version::One,
        epoch: 1,
        reset: ResetCause::PowerOn,
        rebooted: false,
        fresh: true,
        build: 1,
    };
    let up = Some(BoardUp { up, link_epoch: 1 });
    let version = Version::One;
    let place = usize::from(callsign == Callsign::Steering);
    core.port(at(millis), place, PortEvent::SendAck { version, up });
    turn(core, millis);
}

pub(super) fn sensor_up(core: &mut BridgeCore, millis: u64) {
    board_up(core, millis, Callsign::Sensor);
    obey(core, millis, Callsign::Sensor);
}

/// What a steering board reports that does nothing.
pub(super) const IDLE: SteerData = SteerData {
    code: 0,
    left_duty: 0,
    right_duty: 0,
    flags: SteerFlags::NONE,
    line_error: 0,
    finished_seq: 0,
    servo_errors: 0,
    battery_decivolts: 0,
};

pub(super) fn report(core: &mut BridgeCore, millis: u64, data: SteerData) {
    let at = at(millis);
    core.port(at, STEERING, PortEvent::Steer { data, at });
}

/// The next effect, carried out: a word for it, and the command if it is one.
fn step(core: &mut BridgeCore, millis: u64) -> Option<(&'static str, Option<u8>)> {
    let effect = core.next(at(millis))?;
    Some(match effect {
        Effect::Write(write) => {
            core.wrote(&write, true, at(millis));
            match write.command {
                Some(command) => ("command", Some(command.code)),
                None => ("packet", None),
            }
        }
        Effect::PublishHealth { .. } => {
            core.health_told();
            ("health", None)
        }
        Effect::PublishState { .. } => {
            let mut shown = SteeringReport::default();
            core.fill_state(at(millis).robot, &mut shown);
            let what = match core.is_news(&shown) {
                true => "state",
                false => "same state",
            };
            core.state_told(&shown);
            (what, None)
        }
        Effect::Discard { .. } => ("discard", None),
        Effect::ShowReport(shown) if shown.proves_rest => ("at rest", None),
        Effect::ShowReport(_) => ("report", None),
        Effect::Stop(_) => ("stop", None),
        Effect::Release(_) => ("release", None),
        Effect::Say(Notice::Profile(Part::Arm, ProfileState::Unanswered)) => ("no answer", None),
        Effect::Say(_) => ("news", None),
    })
}

/// A turn to its end; what was done.
pub(super) fn turn(core: &mut BridgeCore, millis: u64) -> Vec<(&'static str, Option<u8>)> {
    core.decide(at(millis).robot);
    std::iter::from_fn(|| step(core, millis)).collect()
}

fn order(core: &mut BridgeCore, millis: u64, id: u32, command: WheelCommand) {
    assert!(order_at(core, millis, millis, id, command).is_some());
}

/// A person's order that was sent at `sent` and is read at `millis`.
fn order_at(
    core: &mut BridgeCore,
    millis: u64,
    sent: u64,
    id: u32,
    command: WheelCommand,
) -> Option<OrderKey> {
    let order = SteeringOrder {
        id,
        origin: Origin::Operator.into(),
        code: Command::Wheel(command).code(),
        ..SteeringOrder::default()
    };
    let [now, sent] = [millis, sent].map(|ms| at(ms).robot);
    core.order(now, sent, now - sent, &order)
}

fn code(command: WheelCommand) -> Option<u8> {
    Some(Command::Wheel(command).code())
}

const FORWARD: WheelCommand = WheelCommand::ManualForward;
pub(super) const FOLLOW: WheelCommand = WheelCommand::ActiveForward;
const STANDBY: WheelCommand = WheelCommand::Standby;

#[test]
fn the_state_is_told_before_the_bytes_unless_one_setpoint_takes_the_place_of_another() {
    let mut core = core();
    order(&mut core, 1_002, 1, FORWARD);
    let done = turn(&mut core, 1_002);
    assert_eq!(done[..2], [("health", None), ("command", code(FORWARD))]);
    order(&mut core, 1_003, 2, FOLLOW);
    let done = turn(&mut core, 1_003);
    assert_eq!(done[..2], [("command", code(FOLLOW)), ("health", None)]);
}

#[test]
fn what_falls_due_before_the_next_report_is_done_with_this_one() {
    let mut core = core();
    order(&mut core, 1_002, 1, FORWARD);
    turn(&mut core, 1_002);
    let again = ("command", code(FORWARD));
    report(&mut core, 1_036, IDLE);
    assert!(!turn(&mut core, 1_036).contains(&again));
    report(&mut core, 1_037, IDLE);
    assert!(turn(&mut core, 1_037).contains(&again));
    // Nothing comes any more, and the command goes out on time.
    assert!(!turn(&mut core, 1_076).contains(&again));
    assert!(turn(&mut core, 1_077).contains(&again));
    // The same with the health, told last when the order came.
    report(&mut core, 1_096, IDLE);
    assert!(!turn(&mut core, 1_096).contains(&("health", None)));
    report(&mut core, 1_097, IDLE);
    assert!(turn(&mut core, 1_097).contains(&("health", None)));
}

#[test]
fn a_stop_in_the_middle_of_a_turn_overtakes_what_the_turn_decided() {
    let mut core = core();
    order(&mut core, 1_002, 1, FORWARD);
    core.decide(at(1_002).robot);
    assert_eq!(step(&mut core, 1_002), Some(("health", None)));
    core.stop(Stop::new(Role::Operator, StopCause::Ordered, 0));
    let done: Vec<_> = std::iter::from_fn(|| step(&mut core, 1_002)).collect();
    let standby = ("command", code(STANDBY));
    assert_eq!(done[..3], [("discard", None), standby, ("health", None)]);
    assert!(!done.contains(&("command", code(FORWARD))));

    // Two reports of wheels at rest, read late enough after the standby, prove that they are.
    let mut shown = Vec::new();
    for millis in [1_004, 1_008, 1_013] {
        report(&mut core, millis, IDLE);
        shown.extend(step(&mut core, millis));
        turn(&mut core, millis);
    }
    let [early, one, two] = [("report", None), ("report", None), ("at rest", None)];
    assert_eq!(shown, [early, one, two]);
}

#[test]
fn a_request_whose_asker_has_given_up_changes_nothing() {
    let ask = |millis: u64| Ask {
        issued_ns: at(millis).ns,
        lifetime_ms: 500,
        kind: AskKind::SetMode.into(),
        mode: Mode::Autonomous.into(),
        ..Ask::default()
    };
    for (asked, found, outcome, mode) in [
        (1_002, 1_502, Outcome::Late, Mode::Manual),
        // A time that has not come yet is none of this machine's clock.
        (1_502, 1_002, Outcome::Late, Mode::Manual),
        (1_002, 1_203, Outcome::Late, Mode::Manual),
        (1_002, 1_202, Outcome::Done, Mode::Autonomous),
    ] {
        let mut core = core();
        core.ask(at(found), &ask(asked));
        turn(&mut core, found);
        let answer = core.answer().expect("an answer at once");
        assert_eq!(
            answer.outcome, outcome,
            "asked at {asked}, found at {found}"
        );
        assert_eq!(core.mode(), mode, "asked at {asked}, found at {found}");
    }
}

#[test]
fn what_lets_the_robot_move_is_asked_for_at_once_or_not_at_all() {
    let asks = [
        (AskKind::Resume, Mode::Manual, Outcome::Late),
        (AskKind::Begin, Mode::Manual, Outcome::Late),
        (AskKind::SetMode, Mode::Autonomous, Outcome::Late),
        (AskKind::SetMode, Mode::Manual, Outcome::Done),
    ];
    for (kind, mode, outcome) in asks {
        let ask = Ask {
            issued_ns: at(1_002).ns,
            lifetime_ms: 500,
            kind: kind.into(),
            mode: mode.into(),
            ..Ask::default()
        };
        for (found, outcome) in [(1_202, Outcome::Done), (1_203, outcome)] {
            let mut core = core();
            core.ask(at(found), &ask);
            turn(&mut core, found);
            let answer = core.answer().expect("an answer at once");
            assert_eq!(answer.outcome, outcome, "{kind:?}, found at {found}");
        }
    }
}

#[test]
fn what_was_decided_before_a_pause_is_not_written_after_it() {
    let mut core = core();
    order(&mut core, 1_002, 1, FORWARD);
    core.decide(at(1_002).robot);
    // The process is frozen between its decision and the first effect.
    let done: Vec<_> = std::iter::from_fn(|| step(&mut core, 1_502)).collect();
    let commands: Vec<_> = done.iter().filter(|(what, _)| *what == "command").collect();
    assert!(
        commands.iter().all(|(_, told)| *told == code(STANDBY)),
        "{done:?}"
    );
    // What lay in its queue meanwhile is of before, too.
    order_at(&mut core, 1_503, 1_042, 1, FORWARD);
    let done = turn(&mut core, 1_503);
    assert!(!done.contains(&("command", code(FORWARD))), "{done:?}");
}

#[test]
fn a_robot_that_begins_by_itself_leaves_the_mode_that_somebody_has_set() {
    let begin = Ask {
        issued_ns: at(1_002).ns,
        lifetime_ms: 500,
        kind: AskKind::Begin.into(),
        ..Ask::default()
    };
    let manual = Ask {
        kind: AskKind::SetMode.into(),
        mode: Mode::Manual.into(),
        ..begin
    };
    let done = |core: &mut BridgeCore, ask: &Ask| {
        core.ask(at(1_002), ask);
        turn(core, 1_002);
        assert_eq!(
            core.answer().map(|answer| answer.outcome.get()),
            Some(Some(Outcome::Done))
        );
        core.mode()
    };
    let mut core = core();
    assert_eq!(done(&mut core, &begin), Mode::Autonomous);
    assert_eq!(done(&mut core, &manual), Mode::Manual);
    assert_eq!(done(&mut core, &begin), Mode::Manual);
    // It was in manual mode, and somebody wants it to be; the switch says so, too.
    let mut core = self::core();
    assert_eq!(done(&mut core, &manual), Mode::Manual);
    assert_eq!(done(&mut core, &begin), Mode::Manual);
    let mut core = self::core();
    core.switch(Mode::Manual);
    assert_eq!(done(&mut core, &begin), Mode::Manual);
    // The bridge's successor knows that it was set.
    let mut kept = Health::default();
    core.fill_health(at(1_002).robot, &crate::Counts::default(), &mut kept);
    let mut heir = BridgeCore::new(options(), Some((&kept, at(1_002).robot)));
    assert_eq!(done(&mut heir, &begin), Mode::Manual);
}

#[test]
fn what_the_last_stage_of_a_turn_finds_out_is_told_in_that_turn() {
    let mut core = core();
    for millis in 1_002..1_300 {
        let done = turn(&mut core, millis);
        if let Some(told) = done.iter().position(|what| *what == ("no answer", None)) {
            assert_eq!(done[told - 1], ("health", None));
            return;
        }
    }
    panic!("the board never answered, and nobody was told");
}

#[test]
fn a_release_ends_the_stop_that_it_names_and_no_other() {
    let mut core = core();
    let [older, newer] =
        [1_990, 2_000].map(|millis| Stop::new(Role::Operator, StopCause::Ordered, at(millis).ns));
    core.stop(older);
    core.stop(newer);
    turn(&mut core, 2_000);
    let resume = |stop: Stop| Ask {
        kind: AskKind::Resume.into(),
        stop_word: stop.word(),
        issued_ns: at(2_001).ns,
        lifetime_ms: 500,
        ..Ask::default()
    };
    // It is younger than both.
    core.ask(at(2_001), &resume(older));
    let did = turn(&mut core, 2_001);
    assert!(!did.contains(&("release", None)), "{did:?}");
    let answer = core.answer().expect("an answer");
    assert_eq!(
        (answer.outcome.get(), answer.stopped),
        (Some(Outcome::Refused), 1)
    );
    core.ask(at(2_002), &resume(newer));
    let did = turn(&mut core, 2_002);
    assert!(did.contains(&("release", None)), "{did:?}");
}

#[test]
fn ports_are_lent_once_the_stop_of_whoever_wants_them_has_been_obeyed_for_a_while() {
    let mut core = core();
    let stop = |cause, millis| Stop::new(Role::Operator, cause, at(millis).ns);
    core.stop(stop(StopCause::Ordered, 1_100));
    turn(&mut core, 1_100);
    turn(&mut core, 1_500);
    assert!(!core.may_lend(at(1_500).robot), "nobody wants them");
    // This process was frozen when the stop was set, and sees it late.
    core.stop(stop(StopCause::BoardWork, 1_600));
    assert!(!core.may_lend(at(3_000).robot), "not obeyed yet");
    turn(&mut core, 3_000);
    assert!(!core.may_lend(at(3_199).robot));
    assert!(core.may_lend(at(3_200).robot));
    core.lend(true);
    let resume = |millis| Ask {
        kind: AskKind::Resume.into(),
        stop_word: stop(StopCause::BoardWork, 1_600).word(),
        issued_ns: at(millis).ns,
        lifetime_ms: 500,
        ..Ask::default()
    };
    for (is_lent, millis, outcome) in [
        (true, 3_300, Outcome::NoBoard),
        (false, 3_400, Outcome::Done),
    ] {
        core.lend(is_lent);
        core.ask(at(millis), &resume(millis));
        core.decide(at(millis).robot);
        while let Some(effect) = core.next(at(millis)) {
            match effect {
                Effect::Release(_) => core.released(true),
                Effect::PublishHealth { .. } => core.health_told(),
                _ => {}
            }
        }
        let answer = core.answer().expect("an answer");
        assert_eq!(answer.outcome.get(), Some(outcome), "lent: {is_lent}");
    }
    assert!(!core.may_lend(at(3_900).robot), "it may go on");
}

#[test]
fn a_report_rings_if_the_robot_moves_or_does_something_else() {
    let mut core = core();
    let mut rings = |millis: u64, data: SteerData| {
        report(&mut core, millis, data);
        let told = turn(&mut core, millis);
        let states = told.iter().map(|(what, _)| *what);
        let states: Vec<_> = states.filter(|what| what.ends_with("state")).collect();
        match states[..] {
            ["state"] => true,
            ["same state"] => false,
            _ => panic!("not one state: {told:?}"),
        }
    };
    assert!(!rings(1_006, IDLE));
    assert!(!rings(
        1_011,
        SteerData {
            line_error: 3,
            ..IDLE
        }
    ));
    assert!(!rings(
        1_016,
        SteerData {
            battery_decivolts: 111,
            ..IDLE
        }
    ));
    assert!(rings(
        1_021,
        SteerData {
            servo_errors: 1,
            ..IDLE
        }
    ));
    assert!(rings(1_026, SteerData { code: 1, ..IDLE }));
    for millis in [1_031, 1_036] {
        assert!(rings(
            millis,
            SteerData {
                right_duty: 1,
                ..IDLE
            }
        ));
    }
    assert!(rings(1_041, IDLE), "it has come to rest");
    assert!(!rings(1_046, IDLE));
}

#[test]
fn a_report_grows_old_where_none_follows() {
    let mut core = core();
    let mut age = |millis: u64| {
        turn(&mut core, millis);
        let mut shown = SteeringReport::default();
        core.fill_state(at(millis).robot, &mut shown);
        (shown.left_duty, shown.age_ms)
    };
    assert_eq!(age(1_002), (0, 1));
    assert_eq!(age(1_301), (0, 300));
}
