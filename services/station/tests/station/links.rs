//! Who has which name and which place: the living, the dead, crowds, and those who prove it.

use std::net::IpAddr;
use std::time::Duration;

use lager_lines::Name;
use lager_station::{Output, Peer, Saying, Station};

const HERE: [u8; 4] = [127, 0, 0, 1];

fn name(name: &str) -> Name {
    Name::new(name).expect("a name")
}

fn station() -> Station {
    Station::new(name("lager"), None).expect("no warehouse")
}

/// Connects from this address.
fn comes(station: &mut Station, link: u64, from: [u8; 4]) {
    station.connected(Peer::Robot(link));
    station.comes_from(link, IpAddr::from(from));
}

/// What each connection is told, and which end.
fn says(station: &mut Station, link: u64, line: &str) -> Vec<String> {
    station.heard(Peer::Robot(link), Ok(line));
    let who = |peer| match peer {
        Peer::Robot(link) => link.to_string(),
        Peer::Gag => "gag".to_owned(),
    };
    let written = |output| match output {
        Output::Say { to, line } | Output::SayFirst { to, line } => {
            format!("{}: {}", who(to), line.trim_end())
        }
        Output::Close { peer, .. } => format!("{} ends", who(peer)),
    };
    station.outputs().into_iter().map(written).collect()
}

fn at(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

#[test]
fn a_second_connection_by_the_name_of_a_living_robot_is_refused_and_both_are_told() {
    let mut station = station();
    comes(&mut station, 1, HERE);
    assert_eq!(says(&mut station, 1, "lager 1 r1"), ["1: lager 1 lager"]);
    for (link, millis) in [(2, 900), (3, 1_800), (4, 2_700)] {
        station.turn(at(millis));
        assert_eq!(says(&mut station, 1, "lager 1 r1"), ["1: lager 1 lager"]);
        comes(&mut station, link, HERE);
        let told = says(&mut station, link, "lager 1 r1");
        // The robot is told once in a while, not each time.
        let (first, rest) = told.split_at(usize::from(link == 2));
        assert!(
            first
                .iter()
                .all(|line| line.starts_with("1: thought somebody else at 127.0.0.1")),
            "{told:?}"
        );
        assert!(
            rest[0].starts_with(&format!("{link}: thought robot r1 is connected already")),
            "{told:?}"
        );
        assert_eq!(rest[1..], [format!("{link} ends")]);
    }
    // Whoever looks at the robot reads it.
    let news = station.news();
    assert_eq!(news.len(), 1, "{news:?}");
    assert!(matches!(&news[0].told, Saying::Thought(why) if why.as_str().contains("is refused")));
    // The robot has lost nothing, and is the one that is stopped.
    station.stop(&name("r1")).expect("it is there");
    assert_eq!(says(&mut station, 1, "set_robot 1 0"), ["1: stop 1"]);
}

#[test]
fn a_robot_whose_link_was_cut_comes_back_as_soon_as_its_old_connection_is_dead() {
    let mut station = station();
    comes(&mut station, 1, HERE);
    says(&mut station, 1, "lager 1 r1");
    for (link, millis) in [(2, 150), (3, 300), (4, 999)] {
        station.turn(at(millis));
        comes(&mut station, link, HERE);
        let told = says(&mut station, link, "lager 1 r1");
        assert_eq!(told.last(), Some(&format!("{link} ends")));
    }
    station.turn(at(1_000));
    comes(&mut station, 5, HERE);
    let told = says(&mut station, 5, "lager 1 r1");
    assert_eq!(told, ["1 ends", "5: lager 1 lager"]);
    // One whose end was noticed is not waited for.
    station.disconnected(Peer::Robot(5));
    comes(&mut station, 6, HERE);
    assert_eq!(says(&mut station, 6, "lager 1 r1"), ["6: lager 1 lager"]);
}

#[test]
fn a_robot_that_has_announced_itself_and_falls_silent_is_given_up_and_a_plain_one_is_not() {
    let mut station = station();
    comes(&mut station, 1, HERE);
    comes(&mut station, 2, HERE);
    says(&mut station, 1, "lager 1 r1");
    says(&mut station, 2, "fetchprod");
    station.turn(at(29_999));
    assert_eq!(station.outputs(), []);
    station.turn(at(30_000));
    let closed = station.outputs();
    assert!(
        matches!(
            closed[..],
            [Output::Close {
                peer: Peer::Robot(1),
                ..
            }]
        ),
        "{closed:?}"
    );
}

#[test]
fn a_crowd_at_one_address_takes_the_places_of_that_address_alone() {
    let mut station = station();
    let most = Station::MOST_OF_ONE_ADDRESS as u64;
    for link in 0..most {
        comes(&mut station, link, HERE);
        says(&mut station, link, &format!("lager 1 x{link}"));
    }
    station.turn(at(10));
    comes(&mut station, 100, HERE);
    let told = says(&mut station, 100, "lager 1 late");
    assert!(told[0].contains("--robots-secret FILE"), "{told:?}");
    assert_eq!(told[1..], ["100 ends"]);
    comes(&mut station, 101, [10, 0, 0, 2]);
    assert_eq!(
        says(&mut station, 101, "lager 1 r1"),
        ["101: lager 1 lager"]
    );
    // One that has proved it needs none of those places.
    comes(&mut station, 102, HERE);
    station.proved(102);
    assert_eq!(
        says(&mut station, 102, "lager 1 r2"),
        ["102: lager 1 lager"]
    );
}

#[test]
fn who_has_been_known_for_longer_gets_the_place_of_who_has_come_since() {
    let mut station = station();
    comes(&mut station, 0, HERE);
    says(&mut station, 0, "lager 1 r1");
    station.turn(at(50));
    let most = Station::MOST_OF_ONE_ADDRESS as u64;
    station.disconnected(Peer::Robot(0));
    for link in 1..=most {
        comes(&mut station, link, HERE);
        says(&mut station, link, "sidelength");
    }
    comes(&mut station, 100, HERE);
    let told = says(&mut station, 100, "lager 1 r1");
    assert!(
        told[0].starts_with(&format!("{most}: thought its place is robot r1's")),
        "{told:?}"
    );
    assert_eq!(
        told[1..],
        [format!("{most} ends"), "100: lager 1 lager".to_owned()]
    );
}

#[test]
fn where_all_places_are_taken_whoever_proves_who_he_is_gets_one() {
    let mut station = station();
    let most = Station::MOST_ROBOTS as u64;
    for link in 0..most {
        // As from many addresses.
        comes(&mut station, link, [10, 0, 0, (link / 8) as u8]);
        says(&mut station, link, "sidelength");
    }
    comes(&mut station, 100, [10, 0, 1, 0]);
    let told = says(&mut station, 100, "sidelength");
    assert!(told[0].contains("no more can be"), "{told:?}");
    comes(&mut station, 101, [10, 0, 1, 0]);
    station.proved(101);
    let told = says(&mut station, 101, "lager 1 r1");
    assert_eq!(told.last().map(String::as_str), Some("101: lager 1 lager"));
    assert_eq!(told[1], format!("{} ends", most - 1), "{told:?}");
}

#[test]
fn a_robot_without_a_name_is_never_called_as_one_that_has_announced_itself() {
    let mut station = station();
    comes(&mut station, 1, HERE);
    station.proved(1);
    says(&mut station, 1, "lager 1 robot-1");
    station.disconnected(Peer::Robot(1));
    comes(&mut station, 2, HERE);
    says(&mut station, 2, "fetchprod");
    assert!(station.robot(&name("robot-2")).is_some());
    // Nor does a GaG speak for it, where robots prove who they are.
    station.connected(Peer::Gag);
    assert_eq!(says(&mut station, 2, "fetchprod"), [""; 0]);
    comes(&mut station, 3, HERE);
    station.proved(3);
    says(&mut station, 3, "lager 1 robot-1");
    assert_eq!(says(&mut station, 3, "fetchprod"), ["gag: fetchprod"]);
}
