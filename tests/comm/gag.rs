//! Tests of `lager gag` at the station that `lager up` starts, and of a GaG that disconnects.

use std::io::{BufReader, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use lager_tests::{Domain, wait_for};

use crate::scene::{Peer, Scene, WATCHDOG};
use crate::station_at;

#[test]
fn a_person_at_a_gag_has_goods_fetched_at_a_station_of_chosen_places() {
    let domain = Domain::among_others();
    let socket = domain.folder().join("my-gag");
    let socket = socket.to_str().expect("UTF-8");
    let up = domain.start(&[
        "up",
        "--headless",
        "--speed",
        "4",
        "--listen",
        "127.0.0.1:0",
        "--gag",
        socket,
    ]);
    let address = wait_for("the station", || {
        let said = up.output();
        let (_, address) = said.split_once("the external computer listens at ")?;
        Some(address.lines().next()?.to_owned())
    });
    TcpStream::connect(address).expect("robots may connect there");
    wait_for("the order of the station's queue", || {
        up.output().contains("fetches goods 1").then_some(())
    });

    let mut gag = domain
        .lager(&["gag", "--socket", socket])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("lager starts");
    let mut person = gag.stdin.take().expect("a pipe");
    // The first line is no valid answer; the second one waits until the robot asks.
    person
        .write_all(b"fetchprod two\nfetchprod 2\n")
        .expect("a pipe");
    drop(person);
    // The GaG waits until the robot has asked, and then ends.
    wait_for("the GaG to end", || gag.try_wait().expect("a child"));
    let ended = gag.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert!(ended.status.success(), "{said}");
    assert!(said.contains("column 11"), "{said}");
    assert!(said.contains("  > fetchprod 2"), "{said}");
    wait_for("the order of the person", || {
        up.output().contains("fetches goods 2").then_some(())
    });
    assert!(up.output().contains("DELIVERED goods 1"), "{}", up.output());
    drop(up);
    domain.assert_clean();
}

#[test]
fn a_gag_without_a_station_says_what_to_do() {
    let domain = Domain::among_others();
    let alone = domain.run(&["gag"]);
    let said = String::from_utf8_lossy(&alone.stderr).into_owned();
    assert_eq!(alone.status.code(), Some(1), "{said}");
    assert!(said.contains("`lager up` or `lager station`"), "{said}");
}

#[test]
fn a_gag_finds_the_station_of_its_robot_and_else_the_one_that_runs_alone() {
    let domain = Domain::among_others();
    let finds = |folder: &Path| {
        let gag = domain.lager(&["gag"]).stdin(Stdio::null()).output();
        let said = gag.expect("lager starts").stdout;
        let at = format!("you are the GaG at {};", folder.join("gag").display());
        String::from_utf8_lossy(&said)
            .starts_with(&at)
            .then_some(())
    };
    let bus = domain.bus_folder();
    let places = ["--listen", "127.0.0.1:0"];
    let _station = domain.start(&[&["station", "--no-panel"][..], &places].concat());
    wait_for("the station alone", || finds(bus));
    let _up = domain.start(&[&["up", "--headless"][..], &places].concat());
    wait_for("the robot's own", || finds(&bus.join("r1")));
}

#[test]
fn a_path_that_no_socket_can_have_is_refused_before_anything_runs() {
    let domain = Domain::among_others();
    let long = domain.folder().join("g".repeat(108));
    let long = long.to_str().expect("UTF-8");
    for command in [&["up", "--headless"][..], &["station", "--no-panel"]] {
        let listen = ["--listen", "127.0.0.1:0", "--gag", long];
        let refused = domain.run(&[command, &listen[..]].concat());
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(1), "{said}");
        assert!(said.contains("--gag takes another path"), "{said}");
    }
    domain.assert_clean();
}

#[test]
fn a_robot_stands_when_the_gag_that_drives_it_has_gone() {
    let domain = Domain::among_others();
    let socket = domain.folder().join("gag");
    let (_station, address) = station_at(&domain, "127.0.0.1:0", &[]);
    let mut scene = Scene::at(domain, &address);
    let gag = || {
        let stream = UnixStream::connect(&socket).expect("it listens");
        stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
        Peer(BufReader::new(stream))
    };
    let asks = ["sidelength", "karta", "prodlis", "styrcomm"];
    let mut driver = gag();
    let start = Instant::now();
    while scene.duties().is_none_or(|(left, _)| left == 0) {
        assert!(start.elapsed() < WATCHDOG, "the robot does not drive");
        let answer = match driver.waits_for(&asks).as_str() {
            "sidelength" => "sidelength 50",
            "karta" => "karta 2 2 0 0",
            "prodlis" => "prodlis 3 1 0 0 left 2 1 0 down 3 1 1 right",
            _ => "styrcomm 2",
        };
        driver.says(answer);
        // The wheels need a moment to start.
        std::thread::sleep(Duration::from_millis(50));
    }
    // The link between station and robot stays open.
    drop(driver);
    scene.wait_until_it_stands();
    let place = scene.place();
    let mut other = gag();
    assert_eq!(other.waits_for(&["styrcomm"]), "styrcomm");
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(scene.duties().unwrap_or_default(), (0, 0));
    let after = scene.place();
    let moved = (after.0 - place.0).hypot(after.1 - place.1);
    assert!(moved < 10.0, "it has moved by {moved} mm");
}
