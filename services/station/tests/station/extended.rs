//! A robot that speaks the extension, as the station sees it: actions and their answers, what it
//! shows, and who drives it.

use std::time::Duration;

use lager_lines::Name;
use lager_lines::command::{read_arm, read_wheels};
use lager_orders::{Action, Commission, Mode, Wheels};
use lager_station::{ActRefused, Output, Peer, Reply, Saying, Station, Wish, WishRefused};
use lager_wire::{OperatorCommand, Speed};

use crate::transcript::warehouse;

const LINK: Peer = Peer::Robot(1);

fn name(name: &str) -> Name {
    Name::new(name).expect("a name")
}

fn r1() -> Name {
    name("r1")
}

fn wheels(code: &str) -> Wheels {
    read_wheels(code).expect("a code")
}

fn at(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// What the robot is told, in its order.
fn said(station: &mut Station) -> Vec<String> {
    let written = |output| match output {
        Output::Say { line, .. } | Output::SayFirst { line, .. } => line.trim_end().to_owned(),
        Output::Close { why, .. } => panic!("{why}"),
    };
    station.outputs().into_iter().map(written).collect()
}

/// A station with one robot, which speaks the extension.
fn extended() -> Station {
    let mut station = Station::new(name("lager"), Some(warehouse())).expect("a warehouse");
    station.connected(LINK);
    station.heard(LINK, Ok("lager 1 r1"));
    station.outputs();
    station
}

/// The answers among the news.
fn replies(station: &mut Station) -> Vec<(u32, Reply)> {
    let reply = |told| match told {
        Saying::Replied { number, reply } => Some((number, reply)),
        _ => None,
    };
    let news = station.news().into_iter();
    news.filter_map(|news| reply(news.told)).collect()
}

#[test]
fn a_stop_that_a_dead_connection_got_is_given_to_the_next_one_soon_after() {
    let again = |confirmed: bool, later: u64| {
        let mut station = extended();
        station.turn(at(1_000));
        station.stop(&r1()).expect("it takes stops");
        assert_eq!(said(&mut station), ["stop 1"]);
        if confirmed {
            station.heard(LINK, Ok("stopped 1 10"));
        }
        station.disconnected(LINK);
        station.turn(at(later));
        station.connected(Peer::Robot(2));
        station.heard(Peer::Robot(2), Ok("lager 1 r1"));
        let said = said(&mut station);
        // It repeats that line as a sign of life.
        station.heard(Peer::Robot(2), Ok("lager 1 r1"));
        said
    };
    assert_eq!(again(false, 6_000), ["stop 2", "lager 1 lager"]);
    let nobody_means_it = again(false, 6_001);
    assert_eq!(nobody_means_it, ["lager 1 lager"]);
    assert_eq!(again(true, 1_500), ["lager 1 lager"]);
}

#[test]
fn actions_are_numbered_and_each_is_answered_once() {
    let mut station = extended();
    assert_eq!(station.act(&r1(), Action::Mode(Mode::Manual)), Ok(1));
    assert_eq!(station.act(&r1(), Action::Reset), Ok(2));
    assert_eq!(station.stop(&r1()), Ok(Some(3)));
    // A stop stands before all that waits to be said.
    assert_eq!(
        said(&mut station),
        ["stop 3", "do 1 mode manual", "do 2 reset"]
    );
    for line in [
        "refused 2 logic does not react",
        "stopped 3 21",
        "done 1",
        "done 1",
        "done 99",
    ] {
        station.heard(LINK, Ok(line));
    }
    let answered = replies(&mut station);
    assert_eq!(answered.len(), 3, "{answered:?}");
    assert!(matches!(&answered[0], (2, Reply::Refused(why)) if why.as_str().contains("react")));
    assert_eq!(answered[1], (3, Reply::Stopped { after_ms: 21 }));
    assert_eq!(answered[2], (1, Reply::Done));
}

#[test]
fn what_a_robot_does_not_answer_is_lost_in_the_end() {
    let mut station = extended();
    let first = station.act(&r1(), Action::Calibrate).expect("a number");
    station.disconnected(LINK);
    assert_eq!(replies(&mut station), [(first, Reply::Lost)]);
    let refused = station.act(&r1(), Action::Calibrate);
    assert_eq!(refused, Err(ActRefused::Plain.into()), "it is away");

    let mut station = extended();
    let mut given = 0;
    let refused = loop {
        match station.act(&r1(), Action::Clear) {
            Ok(_) => given += 1,
            Err(refused) => break refused,
        }
    };
    assert_eq!((given, refused), (64, ActRefused::Full.into()));
    assert!(station.stop(&r1()).is_ok(), "it is stopped all the same");
    for seconds in (10..=60).step_by(10) {
        station.turn(at(1_000 * seconds));
        // It answers nothing, and is there.
        station.heard(LINK, Ok("lager 1 r1"));
    }
    assert_eq!(replies(&mut station).len(), 65);
    assert!(station.act(&r1(), Action::Clear).is_ok());
}

#[test]
fn a_robot_that_speaks_the_documents_language_alone_takes_no_actions() {
    let mut station = Station::new(name("lager"), None).expect("a station");
    station.connected(LINK);
    station.heard(LINK, Ok("styrcomm"));
    let plain = name("robot-1");
    let refused = station.act(&plain, Action::Resume { stop: 7 });
    assert_eq!(refused, Err(ActRefused::Plain.into()));
    assert_eq!(station.stop(&plain), Ok(None));
    assert_eq!(said(&mut station), ["styrcomm 00000001"]);
    let nobody = station.act(&name("r9"), Action::Resume { stop: 7 });
    assert_eq!(nobody, Err(WishRefused::NoRobot(name("r9"))));
}

#[test]
fn what_it_shows_is_kept_with_its_time_and_events_are_news() {
    let mut station = extended();
    station.turn(at(1_000));
    for line in [
        "state x_mm=400 phase=driving",
        "truth 401 2 90 7",
        "queue 1 4 7",
        "event in_position 1 0 4 7",
        "thought I am here",
    ] {
        station.heard(LINK, Ok(line));
    }
    station.turn(at(1_250));
    let told: Vec<Saying> = station.news().into_iter().map(|news| news.told).collect();
    assert!(
        matches!(told[..], [Saying::Event(_), Saying::Thought(_)]),
        "{told:?}"
    );
    let now = station.now();
    let shown = station.robot(&r1()).expect("it is known").shown();
    let state = shown.state.as_ref().expect("a state");
    assert_eq!((state.value.x_mm, state.age(now)), (Some(400), at(250)));
    assert_eq!(
        shown.truth.as_ref().map(|truth| truth.value.x_mm),
        Some(401)
    );
    assert_eq!(
        shown.queue.as_ref().map(|queue| queue.value.total()),
        Some(1)
    );
    assert_eq!(shown.route, None);
    // It stays when the robot has gone, and grows old.
    station.disconnected(LINK);
    station.turn(at(9_000));
    let shown = station.robot(&r1()).expect("it is known").shown();
    let state = shown.state.as_ref().expect("a state");
    assert_eq!(state.age(station.now()), at(8_000));
}

#[test]
fn one_drives_and_the_next_is_refused_with_his_name() {
    let mut station = extended();
    let anna = station.take_wheel(&r1(), "anna").expect("the seat is free");
    let refused = station.take_wheel(&r1(), "bo").unwrap_err();
    assert!(refused.to_string().starts_with("anna drives"), "{refused}");
    assert_eq!(station.drive(&r1(), anna, wheels("2")), Ok(1));
    assert_eq!(
        station.arm(&r1(), anna, read_arm("F3").expect("a step")),
        Ok(2)
    );
    assert_eq!(
        said(&mut station),
        ["do 1 drive 00000010 150", "do 2 arm 11110011"]
    );
    // Nobody drives without the seat, and anybody stops.
    let around = Action::Drive {
        wheels: wheels("2"),
        lease: lager_orders::LeaseMs::new(100).expect("a time"),
    };
    assert_eq!(
        station.act(&r1(), around),
        Err(ActRefused::NotDriver.into())
    );
    station.heard(LINK, Ok("styrcomm"));
    let refused = station.wish(&r1(), Wish::Command(OperatorCommand::Forward(Speed::Full)));
    assert!(matches!(
        refused,
        Err(WishRefused::Act(ActRefused::Driven { .. }))
    ));
    assert_eq!(station.stop(&r1()), Ok(Some(3)));
    said(&mut station);

    // Who leaves while the wheels may turn makes it stand.
    station.leave_wheel(&r1(), anna);
    assert_eq!(said(&mut station), ["do 4 drive 00000001 150"]);
    let bo = station.take_wheel(&r1(), "bo").expect("the seat is free");
    let refused = station.drive(&r1(), anna, wheels("2")).unwrap_err();
    assert!(refused.to_string().starts_with("bo drives"), "{refused}");
    station.leave_wheel(&r1(), anna);
    assert_eq!(station.drive(&r1(), bo, wheels("1")), Ok(5));
    station.leave_wheel(&r1(), bo);
    assert_eq!(
        said(&mut station),
        ["do 5 drive 00000001 150"],
        "it stands already"
    );
}

#[test]
fn a_driver_who_says_nothing_loses_the_seat() {
    let mut station = extended();
    let anna = station.take_wheel(&r1(), "anna").expect("the seat is free");
    station.drive(&r1(), anna, wheels("2")).expect("he drives");
    said(&mut station);
    station.turn(at(2_900));
    station.stay(&r1(), anna).expect("he drives");
    station.turn(at(5_800));
    assert_eq!(
        station.robot(&r1()).and_then(|robot| robot.driver()),
        Some("anna")
    );
    station.turn(at(5_900));
    assert_eq!(said(&mut station), ["do 2 drive 00000001 150"]);
    assert_eq!(station.robot(&r1()).and_then(|robot| robot.driver()), None);
    let refused = station.stay(&r1(), anna);
    assert_eq!(refused, Err(ActRefused::NotDriver.into()));
}

#[test]
fn a_gag_does_not_drive_a_robot_that_somebody_drives() {
    let mut station = extended();
    station.connected(Peer::Gag);
    station.heard(LINK, Ok("styrcomm"));
    assert_eq!(said(&mut station), ["styrcomm"]);
    let anna = station.take_wheel(&r1(), "anna").expect("the seat is free");
    station.heard(Peer::Gag, Ok("styrcomm 2"));
    let told = said(&mut station);
    assert!(told[0].starts_with("thought anna drives"), "{told:?}");
    assert_eq!(told[1..], ["styrcomm"], "it is asked again");
    station.heard(Peer::Gag, Ok("styrcomm 1"));
    assert_eq!(
        said(&mut station),
        ["styrcomm 00000001"],
        "anybody stops it"
    );
    station.leave_wheel(&r1(), anna);
    station.heard(LINK, Ok("styrcomm"));
    said(&mut station);
    station.heard(Peer::Gag, Ok("styrcomm 2"));
    assert_eq!(said(&mut station), ["styrcomm 00000010"]);
}

#[test]
fn whoever_takes_the_wheel_from_a_gag_ends_what_it_gave() {
    let mut station = extended();
    station.connected(Peer::Gag);
    station.heard(LINK, Ok("styrcomm"));
    station.heard(Peer::Gag, Ok("styrcomm 8"));
    assert_eq!(said(&mut station), ["styrcomm", "styrcomm 00001000"]);
    // The robot turns, and more waits.
    station.heard(Peer::Gag, Ok("styrcomm 2"));
    let anna = station.take_wheel(&r1(), "anna").expect("the seat is free");
    let told = said(&mut station);
    assert_eq!(told[0], "styrcomm 00000001", "it stands until she drives");
    assert!(told[1].starts_with("thought anna drives"), "{told:?}");
    assert_eq!(told.len(), 2);
    station.heard(LINK, Ok("styrcomm"));
    assert_eq!(said(&mut station), ["styrcomm"], "nothing waits");
    // A GaG that leaves does not stop what she does.
    station.drive(&r1(), anna, wheels("2")).expect("she drives");
    said(&mut station);
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), [""; 0]);
    // Nor does she stop a robot that stands.
    station.leave_wheel(&r1(), anna);
    said(&mut station);
    assert!(station.take_wheel(&r1(), "bo").is_ok());
    assert_eq!(said(&mut station), [""; 0]);
}

#[test]
fn only_a_driver_sets_a_robot_up_and_what_moves_by_it_stands_when_he_leaves() {
    let mut station = extended();
    station.turn(at(1_000));
    let begin = Action::Commission(Commission::Begin);
    let refused = station.act(&r1(), begin).expect_err("nobody drives it");
    assert_eq!(refused, WishRefused::Act(ActRefused::NotDriver));
    for (moves, told) in [(0, false), (1, true)] {
        for falls_silent in [false, true] {
            let mut station = extended();
            station.turn(at(1_000));
            let key = station.take_wheel(&r1(), "anna").expect("it is free");
            station.act(&r1(), begin).expect("anna drives it");
            assert_eq!(said(&mut station), ["do 1 commission begin"]);
            let how = format!("commission asked=3 step=turn moves={moves}");
            station.heard(LINK, Ok(&how));
            match falls_silent {
                true => station.turn(at(9_000)),
                false => station.leave_wheel(&r1(), key),
            }
            let said = said(&mut station);
            assert_eq!(
                said.contains(&"do 2 commission stand".into()),
                told,
                "{said:?}"
            );
        }
    }
}

#[test]
fn the_saved_description_is_shown_line_by_line_and_a_new_one_replaces_it() {
    let mut station = extended();
    let kept = |station: &Station| -> Vec<String> {
        let shown = station.robot(&r1()).expect("it is here").shown();
        let kept = shown.kept.as_ref().expect("lines").value.iter();
        kept.map(|line| line.text.to_string()).collect()
    };
    for line in ["kept 1 2 [wheels]", "kept 2 2 swapped = true"] {
        station.heard(LINK, Ok(line));
    }
    assert_eq!(kept(&station), ["[wheels]", "swapped = true"]);
    station.heard(LINK, Ok("kept 1 1 [line]"));
    assert_eq!(kept(&station), ["[line]"]);
    // One that tells without end does not fill the station's memory.
    for number in 2..3_000 {
        station.heard(LINK, Ok(&format!("kept {number} 3000 x")));
    }
    assert_eq!(kept(&station).len(), 1_000);
}
