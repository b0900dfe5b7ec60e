//! `lager gag` at the station that `lager up` starts where it is told to.

use std::io::Write;
use std::net::TcpStream;
use std::process::Stdio;

use lager_tests::{Domain, wait_for};

#[test]
fn a_person_at_a_gag_has_goods_fetched_at_a_station_of_chosen_places() {
    let domain = Domain::new();
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
        up.output().contains("fetches product 1").then_some(())
    });

    let mut gag = domain
        .lager(&["gag", "--socket", socket])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("lager starts");
    let mut person = gag.stdin.take().expect("a pipe");
    // The first is no answer, the second waits until the robot asks.
    person
        .write_all(b"fetchprod two\nfetchprod 2\n")
        .expect("a pipe");
    drop(person);
    let ended = gag.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert!(ended.status.success(), "{said}");
    assert!(said.contains("column 11"), "{said}");
    assert!(said.contains("  > fetchprod 2"), "{said}");
    wait_for("the order of the person", || {
        up.output().contains("fetches product 2").then_some(())
    });
    assert!(
        up.output().contains("DELIVERED product 1"),
        "{}",
        up.output()
    );
    drop(up);
    domain.assert_clean();
}

#[test]
fn a_gag_without_a_station_says_what_to_do() {
    let domain = Domain::new();
    let alone = domain.run(&["gag"]);
    let said = String::from_utf8_lossy(&alone.stderr).into_owned();
    assert_eq!(alone.status.code(), Some(1), "{said}");
    assert!(said.contains("`lager up` or `lager station`"), "{said}");
}
