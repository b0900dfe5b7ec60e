//! The extension: every line of it, and that lists and states always fit.

use lager_floor::{Heading, Node, Place, ProductId};
use lager_lines::conversation::{RobotLine, StationLine};
use lager_lines::extension::{
    Block, Degrees, Finding, Findings, Health, Hello, Listed, Loads, Order, Queued, Release,
    Report, Service, Services, Servos, State,
};
use lager_lines::{Name, to_line};
use lager_orders::{Action, LeaseMs, Mode, Pick};
use lager_wire::{Binary, LineBits, OperatorCommand, Speed};

#[test]
fn every_line_of_the_station_is_read_and_written() {
    for line in [
        "lager 1 station",
        "stop",
        "stop 1",
        "do 0 order 4294967295 7",
        "do 1 cancel 4",
        "do 2 first 4",
        "do 3 clear",
        "do 4 mode manual",
        "do 5 mode autonomous",
        "do 6 resume 9223372036854775809",
        "do 6 late 35 drive 00000010 150",
        "lager 1 station 81250",
        "do 7 reset",
        "do 8 picked",
        "do 9 picked force",
        "do 10 pick auto",
        "do 11 pick manual",
        "do 10 drive 00000010 1",
        "do 11 drive 00001001 1000",
        "do 11 drive 00000010 slow 150",
        "do 11 late 35 drive 00000111 middle 150",
        "do 12 arm 11111010",
        "do 13 gains 0 255",
        "do 14 calibrate",
        "do 15 obstacle put 1 2 up",
        "do 16 obstacle take 0 0 right",
        "do 17 place 2 1 up",
    ] {
        let read = StationLine::read(line).expect(line);
        assert!(!matches!(read, StationLine::Answer(_)), "{line}");
        assert_eq!(read.to_string(), line);
    }
}

#[test]
fn a_drive_says_its_own_speed_and_is_full_without_one() {
    let read = |line: &str| match StationLine::read(line) {
        Ok(StationLine::Order(Order::Do { action, .. })) => action,
        other => panic!("{line}: {other:?}"),
    };
    assert_eq!(read("do 1 drive 2 full 150"), read("do 1 drive 2 150"));
    let Action::Drive { wheels, lease } = read("do 1 drive 4 slow 150") else {
        panic!("a drive");
    };
    assert_eq!(
        OperatorCommand::from(wheels),
        OperatorCommand::Backward(Speed::Slow)
    );
    assert_eq!(lease.get(), 150);
}

/// The last of the line sensors has seen tape.
const SENSORS: &str = "sensors 20 20 21 0 20 20 21 0 20 20 21 0 20 20 21 0 20 20 21 0 20 20 21 0 \
                       20 20 21 0 20 20 21 0 20 20 21 0 20 20 21 0 255 0 255 1";

#[test]
fn every_line_of_the_robot_is_read_and_written() {
    for line in [
        "lager 1 r1",
        "stopped 4294967295 23",
        "done 17",
        "refused 17 the arm is locked while the wheels move",
        "refused 17 ",
        "state",
        "state time_ms=81250 x_mm=-400 y_mm=0 heading_deg=90 unsure_mm=70 node=1,0 looks=right next=2,0",
        "state phase=waiting_for_order hold=none mode=manual stopped=1 order=4 product=7",
        "state line_bits=00000110000 line_error=-3 distance_cm=25 left_duty=0 right_duty=255",
        "state code=00000011 servos=512,-,0,1023,-,-,-,1 battery_dv=114 sensor_up=1 steering_up=0",
        "state delivered=3 sensor_lost=0 steering_lost=1 bus_lost=18446744073709551615",
        "route 0",
        "route 2 1 0 2 0",
        "route 300 1 0 2 0",
        "blocked 1 2 0 up 81",
        "queue 2 4 7 5 12",
        "event next_node 2 1 - -",
        "event in_position 1 0 4 7",
        "event getting_item 1 0 4 7",
        "event item_delivered 0 0 4 7",
        "event refused 1 0 4 7 product 7 is not on my map",
        "event way_blocked 1 0 4 7 up",
        "event pickup_refused 1 0 4 7 the claw is closed on nothing, at 300 of 310",
        "event failed 1 0 - - I have lost the line",
        "latency 0",
        "latency 4294967295 0 1 30 400 89 999999",
        "health",
        "health release=0.1.0 load_percent=37 cores=4 memory_mib=3794 memory_free_mib=2100 trip_ms=2",
        "health sensor_age_ms=3 steering_version=1 services=bridge:up:812:0,logic:down:0:2",
        "health services= found=shared_memory:12,overload:310",
        "truth -35 2147483647 359 -",
        "truth 0 0 0 7",
        SENSORS,
    ] {
        let read = RobotLine::read(line).expect(line);
        assert!(!matches!(read, RobotLine::Request(_)), "{line}");
        assert_eq!(read.to_string(), line);
    }
}

#[test]
fn two_versions_meet_at_the_lower_one() {
    let hello = |version| Hello {
        version,
        name: Name::new("r1").expect("a name"),
        clock_ms: None,
    };
    let ours = hello(Hello::VERSION);
    assert_eq!(ours.version_with(&hello(9)), 1);
    assert_eq!(hello(9).version_with(&ours), 1);
}

#[test]
fn a_state_may_have_fields_that_are_not_known_here() {
    let line = "state mood=fine x_mm=1 y_mm=2 mood=bad";
    let Some(Ok(Report::State(state))) = Report::read(line) else {
        panic!("a state");
    };
    let known = State {
        x_mm: Some(1),
        y_mm: Some(2),
        ..State::default()
    };
    assert_eq!(*state, known);
}

#[test]
fn the_fullest_state_fits_in_a_line() {
    let name = || Name::new("x".repeat(Name::MAX_LENGTH)).ok();
    let node = Some(Node { x: 255, y: 255 });
    let full = State {
        time_ms: Some(u64::MAX),
        x_mm: Some(i32::MIN),
        y_mm: Some(i32::MIN),
        heading_deg: Some(Degrees::new(-1)),
        unsure_mm: Some(u32::MAX),
        node,
        looks: Some(Heading::Right),
        next: node,
        phase: name(),
        hold: name(),
        mode: Some(Mode::Autonomous),
        pick: Some(Pick::Auto),
        stopped: Some(true),
        stop_cause: name(),
        stop_by: name(),
        stop: Some(u64::MAX),
        stop_age_ms: Some(u64::MAX),
        stood_ms: Some(u64::MAX),
        failure: name(),
        failure_expected: Some(i32::MIN),
        failure_seen: Some(i32::MIN),
        remedy: name(),
        order: Some(u32::MAX),
        product: ProductId::new(i32::MAX),
        delivered: Some(u32::MAX),
        line_bits: Some(LineBits::new(LineBits::MASK)),
        line_error: Some(i8::MIN),
        distance_cm: Some(255),
        left_duty: Some(255),
        right_duty: Some(255),
        code: Some(Binary(255)),
        servos: Some(Servos::new([Some(1023); 8])),
        loads: Some(Loads::new([-1023; 8])),
        servo_errors: Some(Binary(255)),
        battery_dv: Some(255),
        battery_percent: Some(255),
        battery_left_s: Some(u16::MAX),
        sensor_up: Some(true),
        steering_up: Some(true),
        sensor_lost: Some(u32::MAX),
        steering_lost: Some(u32::MAX),
        bus_lost: Some(u64::MAX),
        gain_p: Some(255),
        gain_d: Some(255),
    };
    let line = to_line(&Report::State(Box::new(full.clone()))).expect("it fits");
    let read = Report::read(line.trim_end());
    assert_eq!(read, Some(Ok(Report::State(Box::new(full)))));
}

#[test]
fn the_fullest_health_fits_in_a_line() {
    let name = Name::new("x".repeat(Name::MAX_LENGTH)).expect("a name");
    let service = Service {
        name: name.clone(),
        is_up: false,
        since_s: u32::MAX,
        restarts: u32::MAX,
    };
    let finding = Finding {
        code: name,
        seen: u32::MAX,
    };
    let (count, small) = (Some(u32::MAX), Some(255));
    let full = Health {
        release: Some(Release([u16::MAX; 3])),
        load_percent: count,
        cores: Some(u16::MAX),
        memory_mib: count,
        memory_free_mib: count,
        trip_ms: count,
        sensor_age_ms: count,
        steering_age_ms: count,
        sensor_version: small,
        steering_version: small,
        sensor_build: Some(u16::MAX),
        steering_build: Some(u16::MAX),
        program_build: Some(u16::MAX),
        sensor_restarts: count,
        steering_restarts: count,
        sensor_damaged: count,
        steering_damaged: count,
        services: Some(Services::new(vec![service; Services::FIT + 1])),
        found: Some(Findings::new(vec![finding; Findings::FIT + 1])),
    };
    let line = to_line(&Report::Health(Box::new(full.clone()))).expect("it fits");
    assert_eq!(
        Report::read(line.trim_end()),
        Some(Ok(Report::Health(Box::new(full))))
    );
}

#[test]
fn a_health_that_is_misspelt_is_refused() {
    for line in [
        "health release=0.1",
        "health release=0.1.0-dev",
        "health services=bridge:up:1",
        "health services=bridge:well:1:0",
        "health services=bridge:up:1:0:9",
        "health services=bridge:up:1:0,",
        "health found=shared_memory",
        "health found=shared_memory:-1",
    ] {
        assert!(
            Report::read(line).is_some_and(|read| read.is_err()),
            "{line}"
        );
    }
}

#[test]
fn a_thought_is_told_in_values() {
    let line = "thinks kind=node_passed node=2,1 seen=3";
    let Some(Ok(Report::Thinks(thinks))) = Report::read(line) else {
        panic!("a thought");
    };
    assert_eq!(thinks.kind, Name::new("node_passed").ok());
    assert_eq!(thinks.node, Some(Node { x: 2, y: 1 }));
    assert_eq!(Report::Thinks(thinks).to_string(), line);
    assert!(Report::read("thinks sides=256").is_some_and(|read| read.is_err()));
}

#[test]
fn the_longest_lists_fit_in_a_line_and_tell_how_many_there_are() {
    let node = Node { x: 255, y: 255 };
    let heading = Heading::Right;
    let product = ProductId::new(i32::MAX).expect("a number");
    let queued = Queued {
        order: u32::MAX,
        product,
    };
    let route = Listed::<Node>::new(&vec![node; 512]);
    assert_eq!(
        (route.total(), route.first().len()),
        (512, Listed::<Node>::FIT)
    );
    let block = Block {
        way: Place::new(node, heading),
        since_s: u32::MAX,
    };
    let blocked = Listed::<Block>::new(&vec![block; 512]);
    assert_eq!(
        (blocked.total(), blocked.first().len()),
        (512, Listed::<Block>::FIT)
    );
    let queue = Listed::<Queued>::new(&vec![queued; 46]);
    assert_eq!(
        (queue.total(), queue.first().len()),
        (46, Listed::<Queued>::FIT)
    );
    for report in [
        Report::Route(route),
        Report::Blocked(blocked),
        Report::Queue(queue),
        Report::Gone(Listed::<ProductId>::new(&[product; 86])),
    ] {
        let line = to_line(&report).expect("it fits");
        assert_eq!(Report::read(line.trim_end()), Some(Ok(report)));
    }
}

#[test]
fn angles_and_servos_are_brought_into_their_ranges() {
    for (degrees, expected) in [(-1, 359), (0, 0), (359, 359), (360, 0), (i32::MIN, 232)] {
        assert_eq!(Degrees::new(degrees).get(), expected, "{degrees}");
    }
    let mut positions = [Some(1023); 8];
    positions[2] = Some(1024);
    positions[3] = None;
    let heard = Servos::new(positions)
        .get()
        .map(|position| position.is_some());
    assert_eq!(heard, [true, true, false, false, true, true, true, true]);
}

#[test]
fn a_lease_is_from_1_to_1000_ms() {
    let leases = [0, 1, 1000, 1001].map(|ms| LeaseMs::new(ms).map(LeaseMs::get));
    assert_eq!(leases, [None, Some(1), Some(1000), None]);
}

#[test]
fn an_action_that_cannot_be_read_still_has_the_number_to_refuse_it_with() {
    for (line, number) in [
        ("do", None),
        ("do x clear", None),
        ("do 4294967296 clear", None),
        ("do 7", Some(7)),
        ("do 7 dance", Some(7)),
        ("do 7 clear all", Some(7)),
        ("do 7 arm 9", Some(7)),
    ] {
        let error = Order::read(line).expect("an action").expect_err(line);
        assert_eq!(error.number(), number, "{line}");
    }
    let good = Order::read("do 7 clear");
    let action = Action::Clear;
    let (number, late_ms) = (7, 0);
    assert_eq!(
        good,
        Some(Ok(Order::Do {
            number,
            late_ms,
            action
        }))
    );
}
