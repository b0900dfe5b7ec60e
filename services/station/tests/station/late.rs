//! What comes late moves no robot, what was meant for another one neither, and a GaG that does not
//! read drives nobody on.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::sync::{Arc, Mutex};
use std::thread::{sleep, yield_now};
use std::time::Duration;

use lager_lines::Name;
use lager_lines::command::read_wheels;
use lager_orders::{Action, Mode};
use lager_station::{ActRefused, Given, Output, Peer, Station};

use crate::sockets::Running;
use crate::transcript::warehouse;

const R1: Peer = Peer::Robot(1);
const R2: Peer = Peer::Robot(2);

fn name(name: &str) -> Name {
    Name::new(name).expect("a name")
}

fn at(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// What the station has to say, as `r1: line` or `gag: line`.
fn said(station: &mut Station) -> Vec<String> {
    let written = |output| match output {
        Output::Say { to, line } | Output::SayFirst { to, line } => match to {
            Peer::Robot(link) => format!("r{link}: {}", line.trim_end()),
            Peer::Gag => format!("gag: {}", line.trim_end()),
        },
        Output::Close { why, .. } => panic!("{why}"),
    };
    station.outputs().into_iter().map(written).collect()
}

/// What the station says to a line of a peer.
fn hears(station: &mut Station, peer: Peer, line: &str) -> Vec<String> {
    station.heard(peer, Ok(line));
    said(station)
}

/// A GaG, and the robot `north` that asks it for commands.
fn driven() -> Station {
    let mut station = Station::new(name("lager"), Some(warehouse())).expect("a warehouse");
    station.connected(Peer::Gag);
    station.connected(R1);
    hears(&mut station, R1, "lager 1 north");
    assert_eq!(hears(&mut station, R1, "styrcomm"), ["gag: styrcomm"]);
    station
}

/// Time passes in turns as the shell makes them, with a GaG that has read everything or has not.
fn pass(station: &mut Station, from: u64, to: u64, has_read: bool) -> Vec<String> {
    let mut all = Vec::new();
    for millis in (from..=to).step_by(50) {
        station.turn(at(millis));
        station.gag_has_read(has_read);
        all.extend(said(station));
    }
    all
}

#[test]
fn what_a_gag_said_while_the_station_was_held_up_moves_nothing_and_it_is_told() {
    let mut station = driven();
    for moves in ["styrcomm 6", "styrcomm 8", "armcomm F3"] {
        station.heard_late(Peer::Gag, at(500), Ok(moves));
        let told = said(&mut station);
        assert!(told[0].starts_with("gag: thought "), "{told:?}");
        assert!(
            told[0].ends_with(": came 500 ms late; give it anew"),
            "{told:?}"
        );
        assert_eq!(told[1..], ["gag: styrcomm"], "it is asked again");
    }
    // 200 ms are not too late, and to stand nothing is.
    station.heard_late(Peer::Gag, at(200), Ok("styrcomm 6"));
    assert_eq!(said(&mut station), ["r1: styrcomm 00000110"]);
    station.heard_late(Peer::Gag, at(4_000), Ok("styrcomm 1"));
    assert_eq!(said(&mut station), ["r1: styrcomm 00000001"]);
    // At goods, and for a product, which waits for its turn anyway.
    hears(&mut station, R1, "armcomm");
    station.heard_late(Peer::Gag, at(500), Ok("pickup_done"));
    assert!(said(&mut station)[0].contains("500 ms late"));
    hears(&mut station, R1, "fetchprod");
    station.heard_late(Peer::Gag, at(2_001), Ok("fetchprod 7"));
    assert!(said(&mut station)[0].contains("2001 ms late"));
    station.heard_late(Peer::Gag, at(500), Ok("fetchprod 7"));
    assert_eq!(said(&mut station), ["r1: fetchprod 7"]);
}

#[test]
fn commands_that_waited_while_the_station_was_held_up_are_dropped() {
    let mut station = driven();
    station.turn(at(1_000));
    hears(&mut station, Peer::Gag, "styrcomm 8");
    // The robot turns meanwhile.
    assert_eq!(hears(&mut station, Peer::Gag, "styrcomm 2"), [""; 0]);
    station.turn(at(1_200));
    assert_eq!(said(&mut station), [""; 0], "200 ms are no pause");
    station.turn(at(1_401));
    let told = said(&mut station);
    assert_eq!(told, ["gag: thought came 201 ms late; give it anew"]);
    assert_eq!(hears(&mut station, R1, "styrcomm"), ["gag: styrcomm"]);
}

#[test]
fn an_action_that_comes_late_is_refused_and_its_age_goes_with_it() {
    let mut station = driven();
    let anna = station.take_wheel(&name("north"), "anna").expect("free");
    said(&mut station);
    let turn = |millis| Given {
        what: read_wheels("8").expect("a code"),
        late: at(millis),
    };
    let refused = station.drive(&name("north"), anna, turn(201));
    let why = refused.expect_err("it is late").to_string();
    assert_eq!(why, "came 201 ms late; give it anew");
    assert!(station.drive(&name("north"), anna, turn(120)).is_ok());
    assert_eq!(said(&mut station), ["r1: do 1 late 120 drive 00001000 150"]);
    let mode = Given {
        what: Action::Mode(Mode::Autonomous),
        late: at(300),
    };
    let refused = station.act(&name("north"), mode);
    assert!(matches!(
        refused,
        Err(lager_station::WishRefused::Act(ActRefused::Late(_)))
    ));
    assert!(station.act(&name("north"), Action::Clear).is_ok());
    assert_eq!(said(&mut station), ["r1: do 2 clear"]);
}

#[test]
fn the_clock_in_a_sign_of_life_is_repeated() {
    let mut station = driven();
    for sign in ["lager 1 north 81250", "lager 1 north"] {
        let answer = sign.replace("north", "lager");
        assert_eq!(hears(&mut station, R1, sign), [format!("r1: {answer}")]);
    }
}

#[test]
fn a_gag_that_reads_nothing_drives_nobody_on_and_is_told_why() {
    let mut station = driven();
    assert_eq!(pass(&mut station, 0, 1_000, true), [""; 0], "nobody drives");
    hears(&mut station, Peer::Gag, "styrcomm 6");
    hears(&mut station, R1, "styrcomm");
    // As long as it reads it is asked again now and then, and drives on.
    let asked = pass(&mut station, 1_050, 3_000, true);
    assert!(asked.len() >= 8, "{asked:?}");
    assert!(
        asked.iter().all(|line| line == "gag: styrcomm"),
        "{asked:?}"
    );
    // It freezes.
    let told = pass(&mut station, 3_050, 3_450, false);
    assert_eq!(
        told[..told.len() - 2],
        vec!["gag: styrcomm"; told.len() - 2]
    );
    let why = "gag: thought you have read nothing for 200 ms, so the robot stands";
    let last = &told[told.len() - 2..];
    assert_eq!(last[0], "r1: styrcomm 00000001");
    assert!(last[1].starts_with(why), "{told:?}");
    assert_eq!(pass(&mut station, 3_500, 9_000, false), [""; 0], "once");
    // It goes on, and gives a new command.
    hears(&mut station, R1, "styrcomm");
    pass(&mut station, 9_050, 9_100, true);
    let again = hears(&mut station, Peer::Gag, "styrcomm 6");
    assert_eq!(again, ["r1: styrcomm 00000110"]);
}

#[test]
fn what_was_meant_for_a_robot_that_has_gone_reaches_no_other() {
    let mut station = driven();
    station.connected(R2);
    hears(&mut station, R2, "lager 1 south");
    hears(&mut station, R2, "styrcomm");
    hears(&mut station, Peer::Gag, "styrcomm 2");
    hears(&mut station, R1, "styrcomm");
    // Its next command waits in the socket when the first robot goes.
    station.disconnected(R1);
    assert_eq!(said(&mut station), ["gag: styrcomm"], "for the other one");
    for moves in ["styrcomm 6", "armcomm F3"] {
        let told = hears(&mut station, Peer::Gag, moves);
        assert!(told[0].contains(" may be meant for north; you speak for south"));
        assert_eq!(told[1..], ["gag: styrcomm"]);
    }
    station.gag_has_read(false);
    assert_eq!(hears(&mut station, Peer::Gag, "styrcomm 6").len(), 2);
    // Once it has read that, it speaks for the other one.
    station.gag_has_read(true);
    let drives = hears(&mut station, Peer::Gag, "styrcomm 6");
    assert_eq!(drives, ["r2: styrcomm 00000110"]);
}

#[test]
fn a_plain_robot_that_is_called_like_the_one_before_is_another_one() {
    let mut station = Station::new(name("lager"), Some(warehouse())).expect("a warehouse");
    station.connected(Peer::Gag);
    station.connected(R1);
    hears(&mut station, R1, "styrcomm");
    station.disconnected(R1);
    station.connected(R2);
    assert_eq!(hears(&mut station, R2, "styrcomm"), ["gag: styrcomm"]);
    let told = hears(&mut station, Peer::Gag, "styrcomm 2");
    assert!(told[0].contains("may be meant for robot-1"), "{told:?}");
    station.gag_has_read(true);
    let drives = hears(&mut station, Peer::Gag, "styrcomm 2");
    assert_eq!(drives, ["r2: styrcomm 00000010"]);
}

#[test]
fn a_gag_that_answers_at_once_is_soon_heard_for_the_next_robot() {
    let station = Running::new();
    let mut gag = station.gag();
    let mut first = station.robot();
    first.says(b"styrcomm\n");
    assert_eq!(gag.hears().as_deref(), Some("styrcomm"));
    drop(first);
    let mut second = station.robot();
    second.says(b"styrcomm\n");
    // Whatever is refused it gives anew.
    let answers = std::thread::spawn(move || {
        while let Some(line) = gag.hears() {
            if line == "styrcomm" {
                gag.says(b"styrcomm 2\n");
            }
        }
    });
    assert_eq!(second.hears().as_deref(), Some("styrcomm 00000010"));
    drop((second, station));
    answers.join().expect("it ends with the station");
}

#[test]
fn a_station_that_was_held_up_shows_no_state_after_which_the_robot_has_told_another_one() {
    let lock = Arc::new(Mutex::new(()));
    let station = Running::held_up_by(&lock, |_| {});
    let handle = &station.handle;
    let x_mm = || {
        let robots = handle.robots();
        robots.first()?.shown.state.as_ref()?.value.x_mm
    };
    let mut robot = station.robot();
    robot.asks("lager 1 north");
    for round in 0..5 {
        robot.says(b"state x_mm=0\n");
        while x_mm() != Some(0) || handle.is_behind() {
            yield_now();
        }
        let held_up = lock.lock().expect("a lock");
        while !handle.is_behind() {
            yield_now();
        }
        let mut states = String::new();
        for x_mm in 1..=1_000 {
            let _ = writeln!(states, "state x_mm={x_mm}");
        }
        robot.says(states.as_bytes());
        // Until they are there, on whichever way.
        sleep(at(200));
        drop(held_up);
        let mut seen = BTreeSet::new();
        while handle.is_behind() {
            seen.extend(x_mm());
        }
        assert_eq!(x_mm(), Some(1_000), "round {round}: it has caught up");
        seen.remove(&0);
        seen.remove(&1_000);
        assert!(seen.is_empty(), "round {round}: {seen:?}");
    }
}
