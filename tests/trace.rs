//! `lager trace` says why frames of a running robot are late. `tests/run` runs it where the kernel's
//! events may be read.

use std::time::Duration;

use lager_tests::{Domain, pid, wait_for};
use lager_topics::NavStatus;
use rustix::process::{Signal, kill_process};

#[test]
#[ignore = "needs the kernel's events; `tests/run` runs it where they can be had"]
fn a_service_that_was_stopped_is_the_cause_of_late_frames() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless"]);
    let bus = domain.observe("r1", 1.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    wait_for("logic", || status.latest().expect("readable").map(drop));
    drop((status, bus));

    let picture = domain.folder().join("late.json");
    let out = picture.display().to_string();
    let words = ["trace", "--late", "20ms", "--duration", "6", "--json"];
    let mut trace = domain.start(&[&words[..], &["--out", &out]].concat());
    let logic = pid(up.service("logic").expect("it runs"));
    let mut stops = 0;
    while trace.is_running() {
        // Shorter than what its supervisor takes for a hang.
        kill_process(logic, Signal::STOP).expect("it runs");
        std::thread::sleep(Duration::from_millis(100));
        kill_process(logic, Signal::CONT).expect("it runs");
        stops += 1;
        std::thread::sleep(Duration::from_millis(300));
    }
    assert_eq!(trace.wait(), Some(0), "{}", trace.log());
    let told = trace.json();
    let late = told["late"].as_array().expect("a list");
    let stopped = late.iter().filter(|frame| frame["cause"] == "stopped");
    // At the beginning and at the end it listens to no frames.
    assert!(stopped.count() > stops / 2, "{stops} stops: {told}");
    let drawn = std::fs::read(&picture).expect("a file");
    let drawn: serde_json::Value = serde_json::from_slice(&drawn).expect("JSON");
    assert!(
        drawn["traceEvents"]
            .as_array()
            .is_some_and(|all| !all.is_empty())
    );

    up.signal(Signal::INT);
    // Whether its mission has failed is of no interest.
    up.wait().expect("it ends");
    domain.assert_clean();
}
