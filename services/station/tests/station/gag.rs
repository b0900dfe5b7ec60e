//! A GaG that speaks for a robot, as a reader sees both conversations side by side.

use lager_lines::Name;
use lager_station::{Output, Peer, Robot, Station, Wish, WishRefused};
use lager_wire::{OperatorCommand, Speed};

use crate::transcript::{product, warehouse};

const R1: Peer = Peer::Robot(1);
const R2: Peer = Peer::Robot(2);

fn name(name: &str) -> Name {
    Name::new(name).expect("a name")
}

fn station() -> Station {
    Station::new(name("lager"), Some(warehouse())).expect("a warehouse")
}

/// What the station has to say, as `r1: line` or `gag: line`, or `r1 ends`.
fn said(station: &mut Station) -> Vec<String> {
    let who = |peer| match peer {
        Peer::Robot(link) => format!("r{link}"),
        Peer::Gag => "gag".into(),
    };
    let written = |output| match output {
        Output::Say { to, line } | Output::SayFirst { to, line } => {
            format!("{}: {}", who(to), line.trim_end())
        }
        Output::Close { peer, .. } => format!("{} ends", who(peer)),
    };
    station.outputs().into_iter().map(written).collect()
}

/// Plays lines of peers and compares what the station says to each.
fn play(station: &mut Station, lines: &[(Peer, &str, &[&str])]) {
    for (peer, line, wanted) in lines {
        station.heard(*peer, Ok(line));
        assert_eq!(&said(station), wanted, "after {line:?}");
    }
}

/// A station to which both are connected.
fn between_a_gag_and_a_robot() -> Station {
    let mut station = station();
    station.connected(Peer::Gag);
    station.connected(R1);
    station
}

#[test]
fn a_session_of_a_plain_robot_with_a_gag() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "sidelength", &["gag: sidelength"]),
            (Peer::Gag, "sidelength 40", &["r1: sidelength 40"]),
            (R1, "karta", &["gag: karta"]),
            (Peer::Gag, "karta 2 1 0 0", &["r1: karta 2 1 0 0"]),
            (R1, "prodlis", &["gag: prodlis"]),
            // The other spelling is understood, and answered as it was asked.
            (
                Peer::Gag,
                "prodlist 1 3 1 0 up",
                &["r1: prodlis 1 3 1 0 up"],
            ),
            (R1, "fetchprod", &["gag: fetchprod"]),
            (R1, "thought hej", &["gag: thought hej"]),
            (Peer::Gag, "fetchprod 3", &["r1: fetchprod 3"]),
            (R1, "set_robot 1 0", &["gag: set_robot 1 0"]),
            (R1, "set_heading right", &["gag: set_heading right"]),
            (R1, "armcomm", &["gag: armcomm"]),
            (Peer::Gag, "armcomm F4", &["r1: armcomm 11110100"]),
            (R1, "armcomm", &["gag: armcomm"]),
            (Peer::Gag, "pickup_done", &["r1: pickup_done"]),
            (R1, "fetchprod", &["gag: fetchprod"]),
            // Switched to manual while the question is held.
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "armcomm 0xF1", &["r1: armcomm 11110001"]),
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "styrcomm 00000010", &["r1: styrcomm 00000010"]),
        ],
    );
    let learned = station.unsaved().expect("another warehouse");
    assert_eq!(
        (learned.size, learned.products[0].id),
        (lager_floor::Node::new(2, 1), 3)
    );
    assert_eq!(station.unsaved(), None);
}

#[test]
fn what_a_gag_says_wrongly_it_is_told_and_asked_again() {
    let mut station = between_a_gag_and_a_robot();
    play(&mut station, &[(R1, "karta", &["gag: karta"])]);
    for wrong in [
        "karta 0 0 0 0",
        "karta 10000 10000 0 0",
        "karta 4 3 2 3",
        "karta",
        "hej",
        "sidelength 40",
        "",
    ] {
        station.heard(Peer::Gag, Ok(wrong));
        let said = said(&mut station);
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].starts_with("gag: thought "), "{said:?}");
        assert_eq!(said[1], "gag: karta");
    }
    play(
        &mut station,
        &[(Peer::Gag, "karta 4 3 4 3", &["r1: karta 4 3 4 3"])],
    );
}

#[test]
fn goods_outside_the_map_are_refused_and_the_warehouse_stays() {
    let mut station = between_a_gag_and_a_robot();
    for (question, answer) in [("sidelength", "sidelength 40"), ("karta", "karta 2 1 0 0")] {
        station.heard(R1, Ok(question));
        station.heard(Peer::Gag, Ok(answer));
    }
    station.heard(R1, Ok("prodlis"));
    said(&mut station);
    station.heard(Peer::Gag, Ok("prodlis 1 3 9 0 up"));
    let answer = said(&mut station);
    assert!(
        answer[0].contains("stand in the square (9, 0)"),
        "{answer:?}"
    );
    assert_eq!(answer[1], "gag: prodlis");
    assert_eq!(station.warehouse(), Some(&warehouse()));
}

#[test]
fn the_station_answers_by_itself_before_a_gag_comes_and_after_it_has_gone() {
    let mut station = station();
    station.connected(R1);
    play(
        &mut station,
        &[
            (R1, "sidelength", &["r1: sidelength 40"]),
            (R1, "set_robot 0 0", &[]),
            (R1, "fetchprod", &[]),
        ],
    );
    station.connected(Peer::Gag);
    assert_eq!(said(&mut station), ["gag: set_robot 0 0", "gag: fetchprod"]);
    // What waits here is for the time without a GaG.
    assert_eq!(
        station.wish(&name("robot-1"), Wish::Fetch(product(7))),
        Ok(())
    );
    assert_eq!(said(&mut station), [""; 0]);
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), ["r1: fetchprod 7"]);
}

#[test]
fn a_stop_of_the_station_goes_to_a_robot_that_a_gag_drives() {
    let mut station = between_a_gag_and_a_robot();
    play(&mut station, &[(R1, "styrcomm", &["gag: styrcomm"])]);
    let stopped = station.stop(&name("robot-1"));
    assert_eq!(stopped, Ok(None), "nothing is confirmed");
    assert_eq!(said(&mut station), ["r1: styrcomm 00000001"]);
    // The GaG's answer comes for a question that is answered already.
    play(
        &mut station,
        &[
            (Peer::Gag, "styrcomm 2", &[]),
            (R1, "styrcomm", &["gag: styrcomm"]),
        ],
    );
}

#[test]
fn commands_that_nobody_has_asked_a_gag_for_wait_in_their_order() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "styrcomm 8", &["r1: styrcomm 00001000"]),
            // The robot turns, which takes a while.
            (Peer::Gag, "armcomm F1", &[]),
            (Peer::Gag, "styrcomm 9", &[]),
            (R1, "styrcomm", &["r1: armcomm 11110001"]),
            (R1, "styrcomm", &["r1: styrcomm 00001001"]),
            // Then it is the GaG's turn to be asked.
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "styrcomm 2", &["r1: styrcomm 00000010"]),
            // At goods the arm's steps, and that it is done.
            (R1, "armcomm", &["gag: armcomm"]),
            (Peer::Gag, "armcomm F3", &["r1: armcomm 11110011"]),
            (Peer::Gag, "armcomm F9", &[]),
            (Peer::Gag, "pickup_done", &[]),
            (R1, "armcomm", &["r1: armcomm 11111001"]),
            (R1, "armcomm", &["r1: pickup_done"]),
        ],
    );
}

#[test]
fn a_stop_takes_the_place_of_a_gags_commands_that_wait() {
    let mut station = between_a_gag_and_a_robot();
    let waits: &[(Peer, &str, &[&str])] = &[
        (R1, "styrcomm", &["gag: styrcomm"]),
        (Peer::Gag, "styrcomm 8", &["r1: styrcomm 00001000"]),
        (Peer::Gag, "styrcomm 9", &[]),
        (Peer::Gag, "styrcomm 2", &[]),
    ];
    play(&mut station, waits);
    play(
        &mut station,
        &[
            (Peer::Gag, "styrcomm 1", &[]),
            (R1, "styrcomm", &["r1: styrcomm 00000001"]),
            (R1, "styrcomm", &["gag: styrcomm"]),
            (R1, "lager 1 north", &["r1: lager 1 lager"]),
            (Peer::Gag, "styrcomm 8", &["r1: styrcomm 00001000"]),
            (Peer::Gag, "styrcomm 9", &[]),
            // A robot that speaks the extension stands though it has asked nothing.
            (Peer::Gag, "styrcomm 1", &["r1: styrcomm 00000001"]),
            (R1, "styrcomm", &["gag: styrcomm"]),
        ],
    );
}

#[test]
fn a_stop_takes_the_place_of_a_gags_pickup_done_that_waits() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "armcomm", &["gag: armcomm"]),
            (Peer::Gag, "armcomm F3", &["r1: armcomm 11110011"]),
            (Peer::Gag, "armcomm F9", &[]),
            (Peer::Gag, "pickup_done", &[]),
            (Peer::Gag, "styrcomm 1", &[]),
            (R1, "armcomm", &["r1: styrcomm 00000001"]),
            (R1, "armcomm", &["gag: armcomm"]),
        ],
    );
}

#[test]
fn a_robot_stands_when_the_gag_that_drives_it_leaves() {
    let mut station = between_a_gag_and_a_robot();
    let drives: &[(Peer, &str, &[&str])] = &[
        (R1, "styrcomm", &["gag: styrcomm"]),
        (Peer::Gag, "styrcomm 2", &["r1: styrcomm 00000010"]),
    ];
    play(&mut station, drives);
    play(&mut station, &[(R1, "styrcomm", &["gag: styrcomm"])]);
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), ["r1: styrcomm 00000001"]);
    // What waits goes with it as well, and a robot that asks nothing is told when it asks.
    station.connected(Peer::Gag);
    play(&mut station, drives);
    play(&mut station, &[(Peer::Gag, "styrcomm 8", &[])]);
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), [""; 0]);
    play(
        &mut station,
        &[
            (R1, "styrcomm", &["r1: styrcomm 00000001"]),
            (R1, "styrcomm", &[]),
        ],
    );
    // One that speaks the extension is told at once.
    play(
        &mut station,
        &[(R1, "lager 1 north", &["r1: lager 1 lager"])],
    );
    station.connected(Peer::Gag);
    assert_eq!(said(&mut station), ["gag: styrcomm"]);
    play(
        &mut station,
        &[(Peer::Gag, "styrcomm 2", &["r1: styrcomm 00000010"])],
    );
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), ["r1: styrcomm 00000001"]);
    // A robot that stands by its word, or fetches by itself, is left alone.
    station.connected(Peer::Gag);
    play(&mut station, drives);
    play(
        &mut station,
        &[
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "styrcomm 1", &["r1: styrcomm 00000001"]),
            (R1, "styrcomm", &["gag: styrcomm"]),
        ],
    );
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), [""; 0]);
    station.connected(Peer::Gag);
    assert_eq!(said(&mut station), ["gag: styrcomm"]);
    play(
        &mut station,
        &[
            (Peer::Gag, "styrcomm 2", &["r1: styrcomm 00000010"]),
            (R1, "fetchprod", &["gag: fetchprod"]),
        ],
    );
    station.disconnected(Peer::Gag);
    assert_eq!(said(&mut station), [""; 0]);
}

#[test]
fn what_a_gag_gave_by_hand_does_not_move_the_arm_at_goods() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "lager 1 north", &["r1: lager 1 lager"]),
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "armcomm F1", &["r1: armcomm 11110001"]),
            (Peer::Gag, "armcomm F3", &[]),
            // The switch is turned while the arm moves.
            (R1, "armcomm", &["gag: armcomm"]),
            (Peer::Gag, "armcomm F4", &["r1: armcomm 11110100"]),
            (Peer::Gag, "armcomm F3", &[]),
            (R1, "styrcomm", &["gag: styrcomm"]),
        ],
    );
}

#[test]
fn a_gags_commands_that_wait_are_bounded_and_none_is_older_than_the_mode() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "styrcomm", &["gag: styrcomm"]),
            (Peer::Gag, "styrcomm 8", &["r1: styrcomm 00001000"]),
        ],
    );
    for _ in 0..Robot::MOST_COMMANDS {
        play(&mut station, &[(Peer::Gag, "styrcomm 2", &[])]);
    }
    station.heard(Peer::Gag, Ok("styrcomm 2"));
    let told = said(&mut station);
    assert!(told[0].starts_with("gag: thought 32 commands"), "{told:?}");
    assert_eq!(told.len(), 1);
    // The switch is turned: what waits moves nobody later, and nothing more is taken.
    play(&mut station, &[(R1, "fetchprod", &["gag: fetchprod"])]);
    for unasked in ["styrcomm 2", "pickup_done", "armcomm F1"] {
        station.heard(Peer::Gag, Ok(unasked));
        let told = said(&mut station);
        assert!(told[0].starts_with("gag: thought the robot"), "{told:?}");
        assert_eq!(told[1..], ["gag: fetchprod"]);
    }
    play(&mut station, &[(R1, "styrcomm", &["gag: styrcomm"])]);
    // Nobody is there to take any.
    station.disconnected(R1);
    said(&mut station);
    station.heard(Peer::Gag, Ok("styrcomm 2"));
    let told = said(&mut station);
    assert!(told[0].contains("may be meant for robot-1"), "{told:?}");
    assert_eq!(told.len(), 1);
}

#[test]
fn a_gag_speaks_for_the_robot_that_has_been_there_for_longest() {
    let mut station = station();
    station.connected(R1);
    station.connected(R2);
    play(
        &mut station,
        &[
            (R2, "lager 1 north", &["r2: lager 1 lager"]),
            (R1, "lager 1 south", &["r1: lager 1 lager"]),
            (R1, "fetchprod", &[]),
            (R2, "fetchprod", &[]),
        ],
    );
    station.connected(Peer::Gag);
    assert_eq!(said(&mut station), ["gag: fetchprod"]);
    play(
        &mut station,
        &[(Peer::Gag, "fetchprod 12", &["r1: fetchprod 12"])],
    );
    assert_eq!(
        station.wish(&name("north"), Wish::Fetch(product(7))),
        Ok(())
    );
    assert_eq!(said(&mut station), ["r2: fetchprod 7"]);
    station.disconnected(R1);
    play(&mut station, &[(R2, "fetchprod", &["gag: fetchprod"])]);
    let away = WishRefused::NoRobot(name("east"));
    assert_eq!(station.stop(&name("east")), Err(away));
}

#[test]
fn a_robot_that_comes_back_has_its_queue_and_its_dead_connection_counts_no_more() {
    let mut station = station();
    station.connected(R1);
    play(
        &mut station,
        &[(R1, "lager 1 north", &["r1: lager 1 lager"])],
    );
    assert_eq!(
        station.wish(&name("north"), Wish::Fetch(product(7))),
        Ok(())
    );
    // Its old connection has been silent.
    station.turn(std::time::Duration::from_secs(1));
    station.connected(R2);
    play(
        &mut station,
        &[
            (R2, "lager 1 north", &["r1 ends", "r2: lager 1 lager"]),
            (R2, "fetchprod", &["r2: fetchprod 7"]),
            // What the old one had still sent counts no more.
            (R1, "styrcomm", &[]),
            (R1, "nonsense", &[]),
        ],
    );
    station.disconnected(R1);
    // Its answer has not been confirmed by another word.
    station.disconnected(R2);
    let robot = station.robot(&name("north")).expect("it is known");
    assert_eq!(robot.queue().collect::<Vec<_>>(), [product(7)]);
}

#[test]
fn a_line_that_no_robot_says_ends_its_connection_alone() {
    let mut station = station();
    station.connected(R1);
    station.connected(R2);
    play(
        &mut station,
        &[
            (R1, "sidelength", &["r1: sidelength 40"]),
            (R2, "GET / HTTP/1.1", &["r2 ends"]),
            (R1, "karta", &["r1: karta 4 3 0 0"]),
            (R1, "set_robot 256 0", &["r1 ends"]),
        ],
    );
}

#[test]
fn robots_that_have_gone_are_forgotten_when_there_are_too_many() {
    let mut station = station();
    for number in 0..3 * Station::MOST_ROBOTS as u64 {
        let peer = Peer::Robot(number);
        station.connected(peer);
        station.heard(peer, Ok(&format!("lager 1 robot{number}")));
        station.disconnected(peer);
    }
    assert!(station.robots().count() <= Station::MOST_ROBOTS);
}

#[test]
fn a_command_that_nobody_asks_for_is_refused() {
    let mut station = station();
    station.connected(R1);
    play(&mut station, &[(R1, "fetchprod", &[])]);
    let forward = Wish::Command(OperatorCommand::Forward(Speed::Full));
    let refused = station.wish(&name("robot-1"), forward).unwrap_err();
    assert!(
        refused.to_string().contains("takes no commands now"),
        "{refused}"
    );
}

#[test]
fn what_a_gag_has_fetched_is_its_own_to_repeat() {
    let mut station = between_a_gag_and_a_robot();
    play(
        &mut station,
        &[
            (R1, "lager 1 north", &["r1: lager 1 lager"]),
            (R1, "fetchprod", &["gag: fetchprod"]),
            (Peer::Gag, "fetchprod 7", &["r1: fetchprod 7"]),
        ],
    );
    station.disconnected(R1);
    let robot = station.robot(&name("north")).expect("it is known");
    assert_eq!(robot.queue().count(), 0);
}
