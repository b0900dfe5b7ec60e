//! What such a station is told of the robot, and no other peer is.

use lager_comm::{Conversation, LinkLost, Machine, Senses};
use lager_floor::Heading;
use lager_home::Watched;
use lager_lines::Name;
use lager_lines::extension::{Finding, Latency};
use lager_orders::Mode;
use lager_topics::{
    BlockedWay, BlockedWays, DistanceFrame, Durations, Event, EventKind, Failure, FailureKind,
    LineFrame, NavigatorStatus, Phase, Remedy, Role, Route, RouteNode, SERVO_UNKNOWN,
    SteeringReport, StopCause, Thought, ThoughtKind, Truth, TruthObstacle,
};

use super::{extended, pass, queue};
use crate::robot::Robot;

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
fn what_the_boards_do_what_is_lost_and_where_it_goes_are_told() {
    let mut robot = extended(Mode::Autonomous);
    robot.health.sensor.up = 1;
    robot.health.steering.up = 1;
    (robot.health.sensor.lost_total, robot.health.bus_lost) = (3, 5);
    robot.health.steering.lost_total = 4;
    robot.told();
    robot.queue(&queue(&[]));
    robot.status(&NavigatorStatus {
        phase: Phase::Driving.into(),
        frames_lost: 6,
        delivered: 2,
        ..NavigatorStatus::default()
    });
    let mut route = Route {
        length: 2,
        ..Route::default()
    };
    route.nodes[..2].copy_from_slice(&[RouteNode { x: 1, y: 0 }, RouteNode { x: 1, y: 1 }]);
    robot.conversation.route(&route);
    let mut counted = Durations::default();
    for ns in [20_000, 20_000, 20_000, 900_000] {
        counted.record(ns);
    }
    robot.conversation.senses(Senses {
        latency: Some(Box::new(counted)),
        ..Senses::default()
    });
    robot.reports(&SteeringReport {
        code: 3,
        left_duty: 104,
        right_duty: 96,
        line_error: -2,
        servo_errors: 0b0010_0000,
        battery_decivolts: 118,
        servo_position: [512, 300, 301, 488, 512, 512, 200, SERVO_UNKNOWN],
        servo_load: [0, -40, 40, 0, 0, 0, 900, 0],
        age_ms: 0,
        ..SteeringReport::default()
    });
    robot.shown.clear();
    pass(&mut robot, 100);
    let told = |kind: &str| {
        let line = robot.shown.iter().find(|line| line.starts_with(kind));
        line.unwrap_or_else(|| panic!("no {kind}: {:?}", robot.shown))
    };
    let state = told("state ");
    for field in [
        " next=1,0 phase=driving ",
        " order=1 product=7 delivered=2 ",
        " line_error=-2 left_duty=104 right_duty=96 code=00000011 ",
        " servos=512,300,301,488,512,512,200,- loads=0,-40,40,0,0,0,900,0 ",
        " servo_errors=00100000 battery_dv=118 battery_percent=72 ",
        " sensor_up=1 steering_up=1 sensor_lost=3 steering_lost=4 bus_lost=11",
    ] {
        assert!(state.contains(field), "{field}: {state}");
    }
    assert_eq!(told("route "), "route 2 1 0 1 1");
    // Three took from 16.384 to 20.48 us, and one 900 us.
    assert_eq!(told("latency "), "latency 900 25 3 47 1");
    for bucket in 0..Latency::BUCKETS {
        assert_eq!(Latency::upper_ns(bucket), Durations::upper_ns(bucket));
    }
    // What is old is told no more.
    robot.reports(&SteeringReport {
        left_duty: 104,
        age_ms: 501,
        ..SteeringReport::default()
    });
    robot.shown.clear();
    pass(&mut robot, 100);
    assert!(!robot.shown[0].contains("duty"), "{:?}", robot.shown);
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
        shown.retain(|line| !line.starts_with("state ") && !line.starts_with("health "));
        shown
    };
    let wanted = ["blocked 1 2 0 up 81", "queue 2 4 7 5 7"];
    assert_eq!(lists(&mut robot), wanted);
    assert_eq!(lists(&mut robot), [""; 0]);
    robot.disconnect();
    robot.connect();
    assert_eq!(lists(&mut robot)[..2], wanted);
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
        ["event failed 3 1 4 7 the robot has been driven by hand, 30 mm"]
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
            "thought I cannot fetch goods 9: goods 9 are not on the map.",
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
    robot.health.stop_word = 9_223_372_036_854_775_809;
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
        " stopped=1 stop_cause=board_resets stop_by=bridge stop=9223372036854775809 stop_age_ms=",
        " failure=line_lost failure_expected=90 failure_seen=120 remedy=reset ",
        " gain_p=20 gain_d=3",
    ] {
        assert!(state.contains(field), "{field}: {state}");
    }
}

#[test]
fn how_soon_both_wheels_stood_is_told_where_it_was_seen() {
    let stood = |robot: &mut Robot| -> Option<String> {
        robot.shown.clear();
        pass(robot, 100);
        let state = robot.shown.iter().find(|line| line.starts_with("state "));
        let mut words = state.expect("one in 50 ms").split(' ');
        words.find_map(|word| word.strip_prefix("stood_ms=").map(str::to_owned))
    };
    let report = |left_duty| SteeringReport {
        left_duty,
        age_ms: 0,
        ..SteeringReport::default()
    };
    let stop = |robot: &mut Robot| {
        robot.health.stopped = 1;
        robot.health.stopped_at_ns = robot.now.ns;
        robot.told();
    };
    let mut robot = extended(Mode::Autonomous);
    robot.health.steering.version = 1;
    robot.told();
    robot.reports(&report(120));
    stop(&mut robot);
    robot.leap(7);
    robot.reports(&report(60));
    assert_eq!(stood(&mut robot), None, "they turn");
    robot.leap(3);
    robot.reports(&report(0));
    let after = (robot.now.ns - robot.health.stopped_at_ns) / 1_000_000;
    assert_eq!(stood(&mut robot), Some(after.to_string()));
    robot.reports(&report(0));
    assert_eq!(stood(&mut robot), Some(after.to_string()), "the first time");
    robot.health.stopped = 0;
    robot.told();
    assert_eq!(stood(&mut robot), None);
    stop(&mut robot);
    robot.reports(&report(0));
    assert_eq!(stood(&mut robot), Some("0".to_owned()), "of the newer stop");

    // Who comes later does not know when they stood.
    let name = Name::new("r1").expect("a name");
    robot.conversation = Conversation::new(name, None, LinkLost::GoOn);
    robot.told();
    robot.connect();
    robot.hears(&["lager 1 station"]);
    robot.reports(&report(0));
    assert_eq!(stood(&mut robot), None);
}

#[test]
fn what_stands_on_ways_of_a_simulated_world_is_told_at_once_and_when_it_changes() {
    let mut robot = extended(Mode::Autonomous);
    let mut truth = Truth::default();
    let mut stands = |truth: &Truth| {
        robot.conversation.senses(Senses {
            truth: Some(Box::new(*truth)),
            ..Senses::default()
        });
        robot.shown.clear();
        pass(&mut robot, 100);
        let shown = robot.shown.iter();
        let told = shown.filter(|line| line.starts_with("obstacles"));
        told.cloned().collect::<Vec<_>>()
    };
    assert_eq!(stands(&truth), ["obstacles 0"]);
    assert_eq!(stands(&truth), [""; 0], "nothing has changed");
    truth.obstacles[0] = TruthObstacle {
        x: 2,
        y: 1,
        heading: Heading::Up.into(),
        by_chance: 0,
    };
    truth.obstacle_count = 1;
    assert_eq!(stands(&truth), ["obstacles 1 2 1 up"]);
}

#[test]
fn what_happens_to_the_robot_is_told_and_told_again_to_a_station_that_comes_later() {
    let mut robot = extended(Mode::Autonomous);
    let happened = |said: &[String]| -> Vec<String> {
        let said = said.iter();
        let events = said.filter(|line| line.starts_with("event ") || line.starts_with("past "));
        events.cloned().collect()
    };
    robot.told();
    robot.health.stopped = 1;
    robot.health.stopped_at_ns = 5;
    robot.health.stop_cause = StopCause::Ordered.into();
    robot.health.stop_origin = Role::Operator.into();
    assert_eq!(
        happened(&robot.told()),
        ["event stopped 0 0 - - ordered operator"]
    );
    robot.health.stopped = 0;
    assert_eq!(happened(&robot.told()), ["event resumed 0 0 - -"]);
    assert_eq!(
        happened(&robot.mode(Mode::Manual)),
        ["event mode 0 0 - - manual"]
    );
    robot.conversation.asked(robot.now.ns, "operator gains 3 2");
    assert_eq!(
        happened(&robot.done()),
        ["event asked 0 0 - - operator gains 3 2"]
    );
    let now = robot.now;
    robot.conversation.services(now, vec![logic(Some(7), 0)]);
    robot.conversation.services(now, vec![logic(None, 0)]);
    assert_eq!(happened(&robot.done()), ["event ended 0 0 - - logic"]);
    robot.disconnect();
    robot.leap(2_000);
    robot.connect();
    let said = happened(&robot.hears(&["lager 1 station"]));
    let words = said
        .iter()
        .map(|line| line.splitn(3, ' ').collect::<Vec<_>>());
    let words: Vec<_> = words.collect();
    let events: Vec<_> = words.iter().map(|words| words[2]).collect();
    assert_eq!(
        events,
        [
            "event stopped 0 0 - - ordered operator",
            "event resumed 0 0 - -",
            "event mode 0 0 - - manual",
            "event asked 0 0 - - operator gains 3 2",
            "event ended 0 0 - - logic",
            "event link_lost 0 0 - -",
            "event link_back 0 0 - -",
        ]
    );
    assert!(words.iter().all(|words| words[0] == "past"));
    let ages: Vec<u64> = words
        .iter()
        .map(|words| words[1].parse().unwrap())
        .collect();
    assert!(ages[..6].iter().all(|age| *age >= 2_000), "{ages:?}");
    assert!(ages.is_sorted_by(|before, after| before >= after));
}

/// Logic as its supervisor sees it; it was started or has ended long ago.
fn logic(pid: Option<u32>, restarts: u32) -> Watched {
    Watched {
        name: "logic".to_owned(),
        pid,
        since_ns: 0,
        restarts,
    }
}

#[test]
fn a_service_that_ends_has_one_end_and_one_return_however_often_it_dies_in_between() {
    let mut robot = extended(Mode::Autonomous);
    robot.leap(2_000);
    let now = robot.now;
    let mut look = |service: Watched| {
        robot.conversation.services(now, vec![service]);
        let said = robot.done().into_iter();
        let events = said.filter(|line| line.starts_with("event "));
        events.collect::<Vec<_>>()
    };
    let (ended, back) = ("event ended 0 0 - - logic", "event restarted 0 0 - - logic");
    // How often it was started before anybody looked is no news.
    assert_eq!(look(logic(Some(1), 4)), [""; 0]);
    // It dies at every start.
    assert_eq!(look(logic(None, 4)), [ended]);
    let starts = |pid, restarts| Watched {
        since_ns: now.ns,
        ..logic(pid, restarts)
    };
    assert_eq!(look(starts(Some(2), 5)), [""; 0]);
    assert_eq!(look(starts(None, 5)), [""; 0]);
    assert_eq!(look(starts(Some(3), 6)), [""; 0]);
    // It has run for a while.
    assert_eq!(look(logic(Some(3), 6)), [back]);
    assert_eq!(look(logic(Some(3), 6)), [""; 0]);
    // Nobody has looked between its end and its next start.
    assert_eq!(look(logic(Some(4), 7)), [ended, back]);
    // One that is away when it is seen first has ended.
    let mut other = logic(None, 0);
    other.name = "station".to_owned();
    assert_eq!(look(other), ["event ended 0 0 - - station"]);
}

#[test]
fn a_comm_that_was_started_anew_tells_its_own_end_and_return() {
    let mut robot = extended(Mode::Autonomous);
    robot.conversation.lives_again(robot.now);
    let told = robot.done();
    assert_eq!(
        told[told.len() - 2..],
        ["event ended 0 0 - - comm", "event restarted 0 0 - - comm"]
    );
}

#[test]
fn one_that_is_on_its_way_is_not_calibrated() {
    let mut robot = extended(Mode::Autonomous);
    robot.told();
    robot.queue(&queue(&[]));
    let said = robot.hears(&["do 1 calibrate"]);
    assert_eq!(
        said,
        ["refused 1 the robot is on its way by itself; stop it or drive it by hand before that"]
    );
    robot.health.stopped = 1;
    robot.told();
    robot.hears(&["do 2 calibrate"]);
    assert!(robot.asked.is_some(), "a person moves one that is stopped");
}

#[test]
fn how_machine_services_and_boards_are_is_told_once_a_second() {
    let mut robot = extended(Mode::Autonomous);
    (robot.health.sensor.up, robot.health.sensor.packets) = (1, 9);
    (robot.health.sensor.version, robot.health.sensor.build) = (1, 7);
    robot.health.steering.reboots = 4;
    robot.told();
    let service = |name: &str, pid, restarts, since_ns| Watched {
        name: name.to_owned(),
        pid,
        since_ns,
        restarts,
    };
    let began = robot.now.ns;
    let services = vec![
        service("bridge", Some(7), 0, 0),
        service("logic", None, 2, began),
    ];
    robot.conversation.services(robot.now, services);
    robot.conversation.machine(Machine {
        load_percent: Some(37),
        cores: Some(4),
        memory_mib: Some([3_794, 2_100]),
        found: vec![Finding {
            code: Name::new("shared_memory").expect("a name"),
            seen: 12,
        }],
    });
    robot.shown.clear();
    pass(&mut robot, 3_000);
    let told = robot
        .shown
        .iter()
        .filter(|line| line.starts_with("health "));
    let told: Vec<_> = told.collect();
    assert_eq!(told.len(), 3, "{told:?}");
    for field in [
        " load_percent=37 cores=4 ",
        " memory_mib=3794 memory_free_mib=2100 ",
        " sensor_age_ms=",
        " sensor_version=1 ",
        " sensor_build=7 ",
        " steering_restarts=4 ",
        " found=shared_memory:12",
    ] {
        assert!(told[0].contains(field), "{field}: {}", told[0]);
    }
    let services = " services=bridge:up:";
    assert!(
        told[0].contains(services) && told[0].contains(",logic:down:"),
        "{}",
        told[0]
    );
    assert!(told[0].contains(":2 found"), "{}", told[0]);
    // The steering board has never been heard.
    assert!(!told[0].contains("steering_age_ms"), "{}", told[0]);
}
