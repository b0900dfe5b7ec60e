//! What peers and disks do that they should not: whoever does it is told or closed, and nobody else
//! notices.

use std::fs;
use std::net::Shutdown;
use std::time::Duration;

use lager_lines::Name;
use lager_station::{Wish, load};

use crate::sockets::{CROWD, Peer, Running, WATCHDOG};
use crate::transcript::product;

#[test]
fn lines_of_a_robot_that_no_robot_says_end_its_connection() {
    let station = Running::new();
    let mut good = station.robot();
    assert_eq!(good.asks("sidelength"), "sidelength 40");
    for bad in [
        "",
        "sidelen",
        "sidelength 40",
        "set_robot 256 0",
        "set_robot -1 0",
        "set_robot 1",
        "set_robot 1 2 3",
        "set_robot 99999999999999999999 0",
        "set_heading north",
        "karta 2 2 0 0",
        "Karta",
        "karta\0",
        "lager 1",
        "lager 99999999999 r1",
        "lager 1 Å",
        "done",
        "stopped 1",
    ] {
        let mut peer = station.robot();
        peer.says(format!("{bad}\n").as_bytes());
        assert_eq!(peer.hears(), None, "{bad:?}");
        assert_eq!(good.asks("karta"), "karta 4 3 0 0", "after {bad:?}");
    }
}

#[test]
fn numbers_of_a_gag_that_are_out_of_range_are_told_and_asked_again() {
    let station = Running::new();
    let mut robot = station.robot();
    let mut gag = station.gag();
    for (question, answers, right, passed_on) in [
        (
            "sidelength",
            &["sidelength 0", "sidelength 65536", "sidelength -4"][..],
            "sidelength 40",
            "sidelength 40",
        ),
        (
            "karta",
            &[
                "karta 0 0 0 0",
                "karta 10000 10000 0 0",
                "karta 256 1 0 0",
                "karta 2 2 1 1",
                "karta 2 2 0",
            ],
            "karta 2 2 0 0",
            "karta 2 2 0 0",
        ),
        (
            "prodlis",
            &[
                "prodlis 1",
                "prodlis 2 1 0 0 left",
                "prodlis 1 1 0 0 left 2 1 1 up",
                "prodlis 2 1 0 0 left 1 1 1 up",
                "prodlis 1 1 5 5 up",
                "prodlis 1 1 0 0 inwards",
                "prodlis 1 99999999999 0 0 up",
            ],
            "prodlis 1 1 0 0 left",
            "prodlis 1 1 0 0 left",
        ),
        (
            "fetchprod",
            &["fetchprod -1", "fetchprod 99999999999", "fetchprod 1 2"],
            "fetchprod 1",
            "fetchprod 1",
        ),
        (
            "armcomm",
            &["armcomm F0", "armcomm FB", "armcomm 251", "armcomm 1111000"],
            "armcomm F1",
            "armcomm 11110001",
        ),
        (
            "styrcomm",
            &["styrcomm 0", "styrcomm 10", "styrcomm 00001010", "styrcomm"],
            "styrcomm 9",
            "styrcomm 00001001",
        ),
    ] {
        robot.says(format!("{question}\n").as_bytes());
        assert_eq!(gag.hears().as_deref(), Some(question));
        for wrong in answers {
            gag.says(format!("{wrong}\n").as_bytes());
            let why = gag.hears().expect("a sentence");
            assert!(why.starts_with("thought "), "{wrong}: {why}");
            assert_eq!(gag.hears().as_deref(), Some(question), "after {wrong:?}");
        }
        gag.says(format!("{right}\n").as_bytes());
        assert_eq!(robot.hears().as_deref(), Some(passed_on));
    }
}

#[test]
fn a_peer_that_sends_a_byte_now_and_then_is_closed_and_keeps_nobody_waiting() {
    let station = Running::new();
    let mut good = station.robot();
    let mut slow = station.robot();
    let stream = slow.stream().try_clone().expect("a socket");
    let drip = std::thread::spawn(move || {
        use std::io::Write;
        // Until the station has closed it.
        while (&stream).write_all(b"t").is_ok() {
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    let start = std::time::Instant::now();
    while !drip.is_finished() {
        assert_eq!(good.asks("sidelength"), "sidelength 40");
        assert!(start.elapsed() < WATCHDOG, "it is never closed");
        std::thread::sleep(Duration::from_millis(10));
    }
    drip.join().expect("it has ended");
    assert_eq!(slow.hears(), None);
}

#[test]
fn a_robot_that_ends_one_half_of_its_connection_is_away_and_its_order_is_told_again() {
    let station = Running::new();
    let name = Name::new("r1").expect("a name");
    let mut robot = station.robot();
    assert_eq!(robot.asks("lager 1 r1"), "lager 1 lager");
    let wish = Wish::Fetch(product(7));
    station.handle.wish(&name, wish).expect("it is known");
    assert_eq!(robot.asks("fetchprod"), "fetchprod 7");
    robot
        .stream()
        .shutdown(Shutdown::Write)
        .expect("it is open");
    assert_eq!(robot.hears(), None);
    let mut again = station.robot();
    assert_eq!(again.asks("lager 1 r1"), "lager 1 lager");
    assert_eq!(again.asks("fetchprod"), "fetchprod 7");
}

#[test]
fn a_thousand_half_open_gags_leave_the_first_one_its_place_and_then_free_it() {
    let _crowd = CROWD.lock();
    let station = Running::new();
    let mut robot = station.robot();
    let mut gag = station.gag();
    let crowd: Vec<_> = (0..1000).map(|_| station.stranger()).collect();
    crowd.iter().step_by(2).for_each(Peer::half_closes);
    robot.says(b"fetchprod\n");
    assert_eq!(gag.hears().as_deref(), Some("fetchprod"));
    for mut one in crowd {
        assert_eq!(one.hears(), None, "none of them is let in");
    }
    gag.says(b"fetchprod 7\n");
    assert_eq!(robot.hears().as_deref(), Some("fetchprod 7"));
    // One that will never say anything has no place, though its socket is open.
    gag.half_closes();
    assert_eq!(gag.hears(), None);
    let mut next = station.gag();
    robot.says(b"fetchprod\n");
    assert_eq!(next.hears().as_deref(), Some("fetchprod"));
}

#[test]
fn what_cannot_be_saved_is_told_and_everybody_is_served_all_the_same() {
    let station = Running::new();
    // Nothing can be written under the name of a folder, whoever asks.
    fs::create_dir(station.folder().join("warehouse.toml.new")).expect("a folder");
    let mut robot = station.robot();
    let mut gag = station.gag();
    for (question, answer) in [
        ("sidelength", "sidelength 50"),
        ("karta", "karta 2 2 2 0"),
        ("prodlis", "prodlis 0"),
    ] {
        robot.says(format!("{question}\n").as_bytes());
        assert_eq!(gag.hears().as_deref(), Some(question));
        gag.says(format!("{answer}\n").as_bytes());
        assert_eq!(robot.hears().as_deref(), Some(answer));
    }
    let why = gag.hears().expect("a sentence");
    assert!(
        why.starts_with("thought ") && why.contains("warehouse.toml"),
        "{why}"
    );
    let described = station.handle.look(|station| station.warehouse().cloned());
    let described = described.expect("what GaG has said");
    let saving = station.handle.set_warehouse(described).expect("it can be");
    let why = saving.wait(WATCHDOG).expect("an end").expect_err("no disk");
    let why = why.to_string();
    assert!(why.contains("warehouse.toml is not saved"), "{why}");
    let saved = load(&station.folder().join("warehouse.toml")).expect("the file");
    assert_eq!(
        saved.size,
        lager_floor::Node::new(4, 3),
        "what was there before"
    );
    drop(gag);
    assert_eq!(robot.asks("karta"), "karta 2 2 2 0");
}
