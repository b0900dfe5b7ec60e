//! What only a station hears and orders that speaks the extension.

use lager_comm::Senses;
use lager_topics::{
    Answer, AskKind, BlockedWay, BlockedWays, DistanceFrame, Event, EventKind, Failure,
    FailureKind, Finish, Goal, Heading, InputKind, LineFrame, MapProduct, Mode, NavigatorStatus,
    Order, OrderQueue, Origin, Outcome, Phase, Pick, Refusal, Remedy, Role, SteeringReport,
    StopCause, Thought, ThoughtKind, Truth, WaitingOrder, WarehouseMap, WorldAnswer, WorldAskKind,
    WorldRefusal,
};

use crate::robot::Robot;

/// A robot that knows its warehouse and has a station that speaks the extension.
fn extended(mode: Mode) -> Robot {
    let mut map = WarehouseMap {
        width: 4,
        height: 3,
        side_length_cm: 40,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 7,
        ..MapProduct::default()
    };
    let mut robot = Robot::with_map(mode, Some(map));
    robot.does(Phase::WaitingForOrder, None);
    robot.connect();
    robot.hears(&["lager 1 station"]);
    robot
}

/// Passes time with a station that gives its sign of life.
fn pass(robot: &mut Robot, milliseconds: u64) -> Vec<String> {
    let mut said = Vec::new();
    for _ in 0..milliseconds / 10 {
        said.extend(robot.pass(10));
        said.extend(robot.hears(&["lager 1 station"]));
    }
    said.retain(|line| line != "lager 1 r1" && !line.starts_with("[renews"));
    said
}

/// The board says that the order given last is in force.
fn in_force(robot: &mut Robot) -> Vec<String> {
    let report = SteeringReport {
        current_id: robot.steered.expect("an order").0,
        current_origin: Origin::Operator.into(),
        left_duty: 100,
        right_duty: 100,
        ..SteeringReport::default()
    };
    robot.reports(&report)
}

fn ended(robot: &mut Robot, finish: Finish) -> Vec<String> {
    let report = SteeringReport {
        finished_id: robot.steered.expect("an order").0,
        finished_origin: Origin::Operator.into(),
        finish: finish.into(),
        ..SteeringReport::default()
    };
    robot.reports(&report)
}

fn queue(waiting: &[u32]) -> OrderQueue {
    let mut queue = OrderQueue {
        order_id: 1,
        product: 7,
        under_way: 1,
        count: waiting.len() as u8,
        ..OrderQueue::default()
    };
    for (place, id) in queue.orders.iter_mut().zip(waiting) {
        *place = WaitingOrder {
            id: *id,
            product: 7,
            ..WaitingOrder::default()
        };
    }
    queue
}

fn done(outcome: Outcome) -> Result<Answer, String> {
    Ok(Answer {
        outcome: outcome.into(),
        ..Answer::default()
    })
}

#[test]
fn a_station_is_told_the_state_twenty_times_a_second() {
    let mut robot = extended(Mode::Autonomous);
    robot.status(&NavigatorStatus {
        x: 1,
        y: 2,
        travelled_mm: 150,
        phase: Phase::WaitingForOrder.into(),
        heading: Heading::Right.into(),
        ..NavigatorStatus::default()
    });
    robot.health.sensor.up = 1;
    robot.told();
    robot.conversation.senses(Senses {
        line: Some(LineFrame {
            bits: 0b000_0111_0000,
            ..LineFrame::default()
        }),
        distance: Some(DistanceFrame {
            distance_cm: 52,
            ..DistanceFrame::default()
        }),
        truth: Some(Box::new(Truth {
            x_mm: 549.6,
            ..Truth::default()
        })),
        ..Senses::default()
    });
    robot.shown.clear();
    pass(&mut robot, 1_000);
    let states: Vec<_> = robot
        .shown
        .iter()
        .filter(|line| line.starts_with("state "))
        .collect();
    assert_eq!(states.len(), 20, "{:?}", robot.shown);
    for field in [
        " x_mm=550 y_mm=800 heading_deg=90 unsure_mm=38 node=1,2 looks=right ",
        " phase=waiting_for_order hold=none mode=autonomous pick=manual stopped=0 ",
        " line_bits=00001110000 ",
        " distance_cm=52 ",
        " sensor_up=1 steering_up=0 ",
    ] {
        assert!(states[0].contains(field), "{field}: {}", states[0]);
    }
    // The steering board is not there, so nothing is said of it.
    assert!(!states[0].contains("duty"), "{}", states[0]);
    let truths = robot.shown.iter().filter(|line| line.starts_with("truth"));
    let truths: Vec<_> = truths.collect();
    assert_eq!(truths, ["truth 550 0 90 -"], "it is told once");
}

#[test]
fn lists_are_told_when_they_have_changed_and_anew_to_each_station() {
    let mut robot = extended(Mode::Autonomous);
    pass(&mut robot, 100);
    robot.shown.clear();
    robot.queue(&queue(&[4, 5]));
    let mut blocks = BlockedWays {
        count: 1,
        ..BlockedWays::default()
    };
    blocks.ways[0] = BlockedWay {
        x: 2,
        y: 0,
        heading: Heading::Up.into(),
        since_ns: 81_999_000_000,
        ..BlockedWay::default()
    };
    robot.conversation.senses(Senses {
        blocks: Some(Box::new(blocks)),
        ..Senses::default()
    });
    let lists = |robot: &mut Robot| {
        pass(robot, 200);
        let mut shown = core::mem::take(&mut robot.shown);
        shown.retain(|line| !line.starts_with("state "));
        shown
    };
    let wanted = ["blocked 1 2 0 up 81", "queue 2 4 7 5 7"];
    assert_eq!(lists(&mut robot), wanted);
    assert_eq!(lists(&mut robot), [""; 0]);
    robot.disconnect();
    robot.connect();
    assert_eq!(lists(&mut robot), wanted);
}

#[test]
fn a_plain_peer_hears_nothing_of_it() {
    let mut robot = Robot::connected(Mode::Manual);
    robot.queue(&queue(&[4]));
    let said = robot.event(&Event {
        kind: EventKind::InPosition.into(),
        ..Event::default()
    });
    assert_eq!(said, [""; 0]);
    let said = robot.hears(&["do 1 drive 2 100"]);
    assert!(said[0].starts_with("thought say `lager 1 "), "{said:?}");
    robot.pass(2_000);
    assert_eq!(robot.shown, [""; 0]);
}

#[test]
fn events_are_told_with_their_reason() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.event(&Event {
        kind: EventKind::Failed.into(),
        x: 3,
        y: 1,
        order_id: 4,
        product: 7,
        failure: Failure::new(FailureKind::DrivenByHand, (3, 1), 0, 30),
        ..Event::default()
    });
    assert_eq!(
        said,
        ["event failed 3 1 4 7 I have been driven by hand, 30 mm"]
    );
}

#[test]
fn a_thought_is_told_in_values_before_it_is_told_in_words() {
    let mut robot = extended(Mode::Autonomous);
    let mut thought = Thought::from(ThoughtKind::OrderRefused);
    thought.product = 9;
    thought.failure = Failure::new(FailureKind::UnknownProduct, (3, 1), 0, 9);
    robot.conversation.thought(&thought);
    assert_eq!(
        robot.done(),
        [
            "thinks kind=order_refused node=0,0 looks=left joint=base sides=0 product=9 expected=0 \
             seen=0 failure=unknown_product failure_node=3,1 failure_expected=0 failure_seen=9 \
             remedy=map",
            "thought I cannot fetch product 9: product 9 is not on my map.",
        ]
    );
    // The document has words only.
    let mut robot = Robot::connected(Mode::Autonomous);
    robot.conversation.thought(&thought);
    let said = robot.done();
    assert!(said[0].starts_with("thought I cannot"), "{said:?}");
}

#[test]
fn a_stop_and_a_failure_are_told_with_what_is_known_of_them() {
    let mut robot = extended(Mode::Autonomous);
    robot.health.stopped = 1;
    robot.health.stop_cause = StopCause::BoardResets.into();
    robot.health.stop_origin = Role::Bridge.into();
    robot.health.stopped_at_ns = robot.now.ns - 30_000_000;
    robot.health.gain_p = 20;
    robot.health.gain_d = 3;
    robot.told();
    robot.status(&NavigatorStatus {
        phase: Phase::Stuck.into(),
        failure: Failure::new(FailureKind::LineLost, (0, 0), 90, 120),
        remedy: Remedy::Reset.into(),
        ..NavigatorStatus::default()
    });
    robot.shown.clear();
    pass(&mut robot, 100);
    let state = robot.shown.iter().find(|line| line.starts_with("state "));
    let state = state.expect("one in 50 ms");
    let (_, age) = state.split_once(" stop_age_ms=").expect("its age");
    let age: u64 = age.split(' ').next().unwrap().parse().unwrap();
    assert!((30..=130).contains(&age), "{state}");
    for field in [
        " stopped=1 stop_cause=board_resets stop_by=bridge stop_age_ms=",
        " failure=line_lost failure_expected=90 failure_seen=120 remedy=reset ",
        " gain_p=20 gain_d=3",
    ] {
        assert!(state.contains(field), "{field}: {state}");
    }
}

#[test]
fn a_drive_holds_as_long_as_it_is_renewed() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 drive 2 150"]);
    assert_eq!(said, ["[steers 2]"], "done is what the board does");
    assert_eq!(in_force(&mut robot), ["done 1"]);
    for number in 2..10 {
        assert_eq!(pass(&mut robot, 100), [""; 0]);
        let renewal = format!("do {number} drive 2 150");
        assert_eq!(robot.hears(&[&renewal]), [""; 0]);
        assert_eq!(in_force(&mut robot), [format!("done {number}")]);
    }
    assert_eq!(pass(&mut robot, 140), [""; 0]);
    let said = pass(&mut robot, 10);
    assert_eq!(said[0], "[steers 1]", "its time is over");
    assert!(said[1].starts_with("thought the time"), "{said:?}");
    assert_eq!(pass(&mut robot, 1_000), [""; 0]);
    // Another command takes its place, and standing is one.
    robot.hears(&["do 10 drive 2 150"]);
    let said = robot.hears(&["do 11 drive 4 150"]);
    let replaced = "refused 10 another command has taken its place";
    assert_eq!(said, ["[steers 4]", replaced]);
    in_force(&mut robot);
    assert_eq!(
        robot.hears(&["do 12 drive 1 150"]),
        ["[steers 1]", "done 12"]
    );
}

#[test]
fn a_drive_ends_with_the_link_and_is_refused_where_logic_steers() {
    let mut robot = extended(Mode::Manual);
    robot.hears(&["do 1 drive 2 1000"]);
    assert_eq!(robot.disconnect(), ["[steers 1]"]);
    assert_eq!(robot.pass(500), [""; 0]);

    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 drive 2 100"]);
    assert!(
        said[0].starts_with("refused 1 somebody else steers"),
        "{said:?}"
    );
    assert_eq!(robot.steered, None);
    robot.mode(Mode::Manual);
    robot.health.blocked = Refusal::BoardSilent.into();
    robot.told();
    let said = robot.hears(&["do 2 drive 2 100"]);
    let why = "refused 2 forward is not possible now: the steering board";
    assert!(said[0].starts_with(why), "{said:?}");
}

#[test]
fn a_turn_and_a_step_of_the_arm_are_done_when_they_have_ended() {
    let mut robot = extended(Mode::Manual);
    assert_eq!(robot.hears(&["do 1 drive 8 100"]), ["[steers 8]"]);
    assert_eq!(in_force(&mut robot), [""; 0]);
    assert_eq!(pass(&mut robot, 500), [""; 0], "it needs no renewal");
    let said = ended(&mut robot, Finish::Done);
    assert_eq!(said, ["done 1", "styrcomm"]);
    robot.hears(&["do 2 arm F3"]);
    let said = ended(&mut robot, Finish::Aborted);
    assert!(
        said[0].starts_with("refused 2 in was cut short"),
        "{said:?}"
    );
    // Where the bridge does not say why it was refused, the board has.
    robot.hears(&["do 3 arm F3"]);
    assert_eq!(ended(&mut robot, Finish::Refused), [""; 0]);
    let said = pass(&mut robot, 50);
    assert!(
        said[0].starts_with("refused 3 in is refused by"),
        "{said:?}"
    );
}

#[test]
fn an_order_is_done_when_logic_has_it() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 order 4 7"]), ["[orders 7]"]);
    assert_eq!(robot.ordered, Some(Order { id: 4, product: 7 }));
    assert_eq!(pass(&mut robot, 250), ["[orders 7]"], "it is repeated");
    assert_eq!(robot.queue(&queue(&[4])), ["done 1"]);
    let said = robot.hears(&["do 2 order 4 7", "do 3 order 0 7"]);
    assert!(
        said[0].starts_with("refused 2 there is an order 4"),
        "{said:?}"
    );
    assert!(said[1].starts_with("refused 3 "), "{said:?}");

    robot.hears(&["do 4 order 5 8"]);
    let said = robot.event(&Event {
        kind: EventKind::Refused.into(),
        order_id: 5,
        product: 8,
        failure: Failure::new(FailureKind::UnknownProduct, (0, 0), 0, 8),
        ..Event::default()
    });
    let why = "product 8 is not on my map";
    assert_eq!(
        said,
        [
            format!("event refused 0 0 5 8 {why}"),
            format!("refused 4 {why}")
        ]
    );

    robot.hears(&["do 5 order 6 7"]);
    let said = pass(&mut robot, 2_500);
    let last = said.last().map(String::as_str);
    assert_eq!(last, Some("refused 5 logic does not take the order"));
}

#[test]
fn orders_are_cancelled_moved_and_cleared() {
    let mut robot = extended(Mode::Autonomous);
    robot.queue(&queue(&[4, 5, 6]));
    assert_eq!(
        robot.hears(&["do 1 cancel 5"]),
        ["[presses OrderCancelled]"]
    );
    assert_eq!(robot.pressed.expect("a press").order_id, 5);
    assert_eq!(pass(&mut robot, 300), [""; 0], "it is not pressed twice");
    assert_eq!(robot.queue(&queue(&[4, 6])), ["done 1"]);
    let said = robot.hears(&["do 2 cancel 9"]);
    assert!(
        said[0].starts_with("refused 2 no order 9 waits"),
        "{said:?}"
    );
    let said = robot.hears(&["do 3 first 1"]);
    assert!(
        said[0].starts_with("refused 3 order 1 is under way"),
        "{said:?}"
    );

    // What is under way is taken back as long as its goods are not held.
    assert_eq!(
        robot.hears(&["do 7 cancel 1"]),
        ["[presses OrderCancelled]"]
    );
    let left = OrderQueue {
        under_way: 0,
        ..queue(&[4, 6])
    };
    assert_eq!(robot.queue(&left), ["done 7"]);
    robot.queue(&queue(&[4, 6]));
    robot.status(&NavigatorStatus {
        goal: Goal::Delivery.into(),
        ..NavigatorStatus::default()
    });
    robot.told();
    let said = robot.hears(&["do 8 cancel 1"]);
    assert!(
        said[0].starts_with("refused 8 order 1 is under way and its goods are in the claw"),
        "{said:?}"
    );

    // Each press takes it one place further.
    robot.queue(&queue(&[4, 6, 8]));
    let press = ["[presses OrderMovedUp]"];
    assert_eq!(robot.hears(&["do 4 first 8"]), press);
    let first = robot.pressed.expect("a press").id;
    assert_eq!(robot.queue(&queue(&[4, 8, 6])), press);
    assert_ne!(robot.pressed.expect("a press").id, first);
    assert_eq!(robot.queue(&queue(&[8, 4, 6])), ["done 4"]);
    assert_eq!(robot.hears(&["do 5 first 8"]), ["done 5"]);
    assert_eq!(robot.hears(&["do 7 up 6"]), press);
    assert_eq!(
        robot.queue(&queue(&[8, 6, 4])),
        ["done 7"],
        "one place, not to the front"
    );

    assert_eq!(robot.hears(&["do 6 clear"]), ["[presses QueueCleared]"]);
    assert_eq!(robot.queue(&queue(&[])), ["done 6"]);
}

#[test]
fn the_goods_are_in_the_gripper_when_logic_leaves() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 picked"]);
    assert_eq!(said, ["refused 1 the robot does not wait at goods"]);
    let order = Some(Order { id: 4, product: 7 });
    robot.does(Phase::Picking, order);
    assert_eq!(robot.hears(&["do 2 picked"])[0], "[picked]");
    let said = robot.event(&Event {
        kind: EventKind::PickupRefused.into(),
        order_id: 4,
        product: 7,
        failure: Failure::new(FailureKind::ClawEmpty, (0, 0), 500, 500),
        ..Event::default()
    });
    assert!(
        said[1].starts_with("refused 2 the claw is closed on nothing"),
        "{said:?}"
    );
    let said = robot.hears(&["do 3 picked force"]);
    assert_eq!(said[0], "[presses PickupForced]");
    assert_eq!(robot.does(Phase::Leaving, order), ["done 3"]);
}

#[test]
fn who_picks_is_chosen_when_logic_says_so() {
    let mut robot = extended(Mode::Autonomous);
    // Logic shows who picks, and some time passes.
    let shows = |robot: &mut Robot, pick: Pick| {
        robot.status(&NavigatorStatus {
            pick: pick.into(),
            ..NavigatorStatus::default()
        });
        robot.shown.clear();
        let mut said = pass(robot, 300);
        said.retain(|line| !line.starts_with("set_"));
        said
    };
    let press = "[presses PickByItself]";
    assert_eq!(robot.hears(&["do 1 pick auto"]), [press]);
    assert_eq!(shows(&mut robot, Pick::Manual), [press]);
    assert_eq!(shows(&mut robot, Pick::Auto), ["done 1"]);
    assert!(robot.shown[0].contains(" pick=auto "), "{:?}", robot.shown);
    let said = robot.hears(&["do 2 pick manual"]);
    assert_eq!(said, ["[presses PickByHand]"]);
    assert_eq!(shows(&mut robot, Pick::Manual), ["done 2"]);
    let said = robot.hears(&["do 3 pick nobody"]);
    assert!(said[0].starts_with("refused 3 "), "{said:?}");
    assert!(said[0].contains("manual or auto"), "{said:?}");
}

#[test]
fn a_reset_is_done_when_logic_says_so_after_it() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 reset"]), ["[presses ResetPressed]"]);
    assert_eq!(
        robot.pressed.expect("a press").kind,
        InputKind::ResetPressed
    );
    // What logic had said before is no answer.
    assert_eq!(robot.does(Phase::WaitingForOrder, None), [""; 0]);
    assert_eq!(pass(&mut robot, 250), ["[presses ResetPressed]"]);
    assert_eq!(robot.does(Phase::WaitingForOrder, None), ["done 1"]);
}

#[test]
fn what_the_bridge_answers_is_handed_on() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 mode manual"]), ["[asks SetMode]"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!(ask.mode, Mode::Manual);
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), ["done 1"]);

    robot.hears(&["do 2 gains 3 4"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!((ask.gain_p, ask.gain_d), (3, 4));
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::NoBoard));
    let said = robot.done();
    assert!(
        said[0].starts_with("refused 2 the board that would"),
        "{said:?}"
    );

    robot.hears(&["do 3 calibrate"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!(ask.kind, AskKind::Calibrate);
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(pass(&mut robot, 5_000), [""; 0], "it has only begun");
    robot.health.calibrations_ended += 1;
    robot.health.calibration = lager_topics::Calibration::Partly.into();
    robot.health.calibrated_sensors = 9;
    let said = robot.told();
    assert!(
        said[0].starts_with("refused 3 only 9 of the 11"),
        "{said:?}"
    );
}

#[test]
fn obstacles_are_put_into_a_simulated_world() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 obstacle put 2 1 left"]);
    assert_eq!(said, ["[asks the world Put]"]);
    let (id, ask) = robot.asked_world.expect("a request");
    assert_eq!((ask.x, ask.y), (2, 1));
    assert_eq!(
        (ask.heading.get(), ask.kind.get()),
        (Some(Heading::Left), Some(WorldAskKind::Put))
    );
    let answer = WorldAnswer {
        outcome: Outcome::Refused.into(),
        refusal: WorldRefusal::RobotThere.into(),
        ..WorldAnswer::default()
    };
    robot
        .conversation
        .answered_by_world(robot.now, id, &Ok(answer));
    let said = robot.done();
    assert!(
        said[0].starts_with("refused 1 the robot is there"),
        "{said:?}"
    );
    robot.hears(&["do 2 obstacle take 2 1 left"]);
    let (id, _) = robot.asked_world.expect("a request");
    let nobody = Err("nobody answers".to_owned());
    robot.conversation.answered_by_world(robot.now, id, &nobody);
    assert_eq!(robot.done(), ["refused 2 nobody answers"]);
}

/// Logic says that it waits for an order on a crossing.
fn waits_on(x: i16, y: i16, heading: Heading) -> NavigatorStatus {
    NavigatorStatus {
        x,
        y,
        heading: heading.into(),
        phase: Phase::WaitingForOrder.into(),
        ..NavigatorStatus::default()
    }
}

#[test]
fn a_robot_is_told_where_it_stands_and_a_simulated_one_is_put_there() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 place 2 1 up"]);
    assert_eq!(said, ["[presses Placed]"], "a person has carried it");
    let pressed = robot.pressed.expect("a press");
    assert_eq!((pressed.x, pressed.y), (2, 1));
    assert_eq!(pressed.heading.get(), Some(Heading::Up));
    robot.pass(1);
    let is_done = |robot: &mut Robot, status, line: &str| {
        robot.status(&status);
        robot.done().contains(&line.to_owned())
    };
    assert!(!is_done(
        &mut robot,
        waits_on(2, 1, Heading::Left),
        "done 1"
    ));
    assert!(is_done(&mut robot, waits_on(2, 1, Heading::Up), "done 1"));

    robot.conversation.senses(Senses {
        truth: Some(Box::default()),
        ..Senses::default()
    });
    assert_eq!(
        robot.hears(&["do 2 place 0 3 right"]),
        ["[asks the world Place]"]
    );
    let (id, ask) = robot.asked_world.expect("a request");
    assert_eq!(
        (ask.x, ask.y, ask.heading.get()),
        (0, 3, Some(Heading::Right))
    );
    let answer = WorldAnswer {
        outcome: Outcome::Done.into(),
        ..WorldAnswer::default()
    };
    robot
        .conversation
        .answered_by_world(robot.now, id, &Ok(answer));
    assert_eq!(robot.done(), ["[presses Placed]"]);
    robot.pass(1);
    assert!(is_done(
        &mut robot,
        waits_on(0, 3, Heading::Right),
        "done 2"
    ));

    // Nobody says that of a robot that drives.
    robot.hears(&["do 3 drive 2 200"]);
    robot.health.current_code = robot.steered.expect("an order").1;
    robot.told();
    let said = robot.hears(&["do 4 place 1 1 up"]);
    assert!(
        said[0].starts_with("refused 4 the robot is moving"),
        "{said:?}"
    );
}

#[test]
fn nothing_undoes_a_stop_that_comes_with_it_or_after_it() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 resume", "do 2 drive 2 100", "stop 3"]);
    assert_eq!(said[0], "[stops]");
    assert!(said[1].starts_with("refused 1 a stop has come"), "{said:?}");
    assert!(said[2].starts_with("refused 2 a stop has come"), "{said:?}");

    assert_eq!(robot.hears(&["do 4 resume"]), ["[asks Resume]"]);
    let (id, _) = robot.asked.expect("a request");
    assert_eq!(robot.hears(&["stop 5"]), ["[stops]"]);
    // It may have released the later stop as well.
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), ["[stops]", "done 4"]);
    robot.hears(&["do 6 resume"]);
    let (id, _) = robot.asked.expect("a request");
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), ["done 6"]);
    // Nor does a new connection.
    robot.hears(&["do 7 resume"]);
    let (id, _) = robot.asked.expect("a request");
    robot.disconnect();
    robot.connect();
    assert_eq!(robot.hears(&["lager 1 station", "stop 1"])[0], "[stops]");
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), ["[stops]"]);
}

#[test]
fn what_cannot_be_read_is_refused_by_its_number_and_too_much_is_refused() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 9 dance"]);
    assert!(said[0].starts_with("refused 9 column 6"), "{said:?}");
    let orders: Vec<String> = (1..=17).map(|n| format!("do {n} order {n} 7")).collect();
    let orders: Vec<&str> = orders.iter().map(String::as_str).collect();
    let said = robot.hears(&orders);
    assert_eq!(said.len(), 17);
    let refused = said.iter().find(|line| line.starts_with("refused"));
    let refused = refused.map(String::as_str);
    assert_eq!(
        refused,
        Some("refused 17 16 actions are under way; wait for their end")
    );
}
