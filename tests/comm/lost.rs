//! Tests of a robot that drives by itself when it loses its station.

use std::fs;

use lager_tests::{Domain, Running, wait_for};
use lager_topics::{Hold, NavStatus, Phase, TruthPose};
use rustix::process::Signal;

use crate::station_at;

/// The side of a square of the warehouse, in mm.
const SIDE_MM: f64 = 500.0;
/// The longest distance between a crossing and the middle of the axle "at" it, in mm.
const AT_CROSSING_MM: f64 = 30.0;

/// A robot on its way to product 1 whose station was killed, and the station's address.
fn robot_without_station(domain: &Domain, link_lost: &str) -> (Running, String) {
    let (mut station, address) = station_at(domain, "127.0.0.1:0", &[]);
    let config = domain.folder().join("lager.toml");
    fs::write(&config, format!("[comm]\nlink_lost = {link_lost:?}\n")).expect("a file");
    let file = domain.folder().join("warehouse.toml");
    let file = file.to_str().expect("UTF-8");
    let up = domain.start(&[
        "up",
        "--headless",
        "--speed",
        "2",
        "--warehouse",
        file,
        "--station",
        &address,
        "--mission",
        "1",
    ]);
    let bus = domain.observe("r1", 2.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        let status = status.latest().expect("readable")?;
        (status.phase == Phase::Driving).then_some(())
    });
    station.signal(Signal::KILL);
    station.wait();
    (up, address)
}

#[test]
fn a_robot_that_goes_on_delivers_without_its_station() {
    let domain = Domain::among_others();
    let (up, _) = robot_without_station(&domain, "go-on");
    wait_for("the delivery", || {
        up.output().contains("DELIVERED goods 1").then_some(())
    });
    drop(up);
    domain.assert_clean();
}

#[test]
fn a_robot_that_stands_ends_the_edge_and_goes_on_when_the_station_is_back() {
    let domain = Domain::among_others();
    let (up, address) = robot_without_station(&domain, "stand");
    let bus = domain.observe("r1", 2.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
    wait_for("it to stand for its link", || {
        let status = status.latest().expect("readable")?;
        (status.hold == Hold::Link).then_some(())
    });
    let mut stood = 0;
    while stood < 100 {
        let truth = wait_for("the truth", || truth.receive().expect("readable"));
        stood = match (truth.left_duty, truth.right_duty) {
            (0, 0) => stood + 1,
            // The robot may still be braking, but not for ever.
            _ => 0,
        };
        let off = [truth.x_mm, truth.y_mm].map(|mm| (mm / SIDE_MM - (mm / SIDE_MM).round()).abs());
        let off = off.map(|sides| sides * SIDE_MM);
        let at_crossing = off.iter().all(|off| *off <= AT_CROSSING_MM);
        assert!(stood < 100 || at_crossing, "{off:?} mm from a crossing");
    }
    let status = wait_for("a status", || status.latest().expect("readable"));
    assert_eq!(status.hold, Hold::Link);
    drop(status);
    assert!(!up.output().contains("DELIVERED"), "{}", up.output());

    // The robot starts again neither by a new comm nor by a new navigator, but by the station.
    for service in ["comm", "logic"] {
        let process = up.service(service).expect("it runs");
        rustix::process::kill_process(lager_tests::pid(process), Signal::KILL).expect("it runs");
        wait_for("its successor", || {
            up.service(service).filter(|next| *next != process)
        });
    }
    let since = wait_for("the truth", || truth.latest().expect("readable")).time_ns;
    loop {
        let truth = wait_for("the truth", || truth.receive().expect("readable"));
        assert_eq!((truth.left_duty, truth.right_duty), (0, 0));
        if truth.time_ns > since + 3_000_000_000 {
            break;
        }
    }
    let _back = station_at(&domain, &address, &[]);
    wait_for("the delivery", || {
        up.output().contains("DELIVERED goods 1").then_some(())
    });
}
