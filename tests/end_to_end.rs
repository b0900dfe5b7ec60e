//! The robot as people start it: real processes, real packets over ptys, a real bus.

use lager_tests::{Domain, wait_for};
use lager_topics::{Mode, NavStatus, Phase, SteeringState};
use rustix::process::Signal;
use serde_json::Value;

#[test]
fn a_mission_is_delivered_and_told_in_one_json_line() {
    for speed in ["1", "5"] {
        // Other work on the machine may keep a reader from its core for longer than its queue holds,
        // and that is a loss. Of three missions one must be without.
        let lost: Vec<u64> = (0..3)
            .map(|_| mission_at(speed))
            .take_while(|lost| *lost > 0)
            .collect();
        assert!(lost.len() < 3, "frames lost at {speed} x: {lost:?}");
    }
}

/// Runs a mission; how many frames were lost.
fn mission_at(speed: &str) -> u64 {
    let domain = Domain::new();
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
        "--speed",
        speed,
    ]);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]));
    assert_eq!(told["restarts"], 0, "{told}\n{}", up.log());
    let frames = told["frames"].as_u64().expect("frames");
    let lost = told["lost"].as_u64().expect("lost");
    let sim = told["sim_seconds"].as_f64().expect("sim_seconds");
    // 200 sensor packets and 200 reports a second, less the time to start.
    assert!((frames + lost) as f64 > 200.0 * sim, "{told}");
    domain.assert_clean();
    lost
}

#[test]
fn two_robots_run_side_by_side_and_a_name_is_taken_once() {
    let domain = Domain::new();
    let mission = [
        "up",
        "--headless",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
        "--speed",
        "3",
    ];
    let mut first = domain.start(&[&["--name", "r1"], &mission[..]].concat());
    let mut second = domain.start(&[&["--name", "r2"], &mission[..]].concat());
    let observer = domain.observe("r1", 3.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the first robot", || status.latest().expect("readable"));

    let third = domain.run(&["--name", "r1", "up"]);
    assert_eq!(third.status.code(), Some(4));
    let said = String::from_utf8_lossy(&third.stderr).into_owned();
    assert!(said.contains("`r1` is already up"), "{said}");
    assert!(said.contains("--name"), "{said}");

    assert_eq!(first.wait(), Some(0), "{}", first.log());
    assert_eq!(second.wait(), Some(0), "{}", second.log());
    drop((status, observer));
    domain.assert_clean();
}

#[test]
fn the_terminal_says_what_the_robot_does_and_a_person_orders_more() {
    let domain = Domain::new();
    let up = domain.start(&["up", "--speed", "5"]);
    let observer = domain.observe("r1", 5.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        status
            .latest()
            .expect("readable")
            .filter(|status| status.phase.get() == Some(Phase::Driving))
            .map(|_| ())
    });
    // A second order waits its turn, a third is refused, an unknown product too.
    let next = domain.run(&["fetch", "2"]);
    let said = String::from_utf8_lossy(&next.stdout).into_owned();
    assert!(
        next.status.success() && said.contains("next"),
        "{said} {next:?}"
    );
    for product in ["3", "99"] {
        let refused = domain.run(&["fetch", product]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            !refused.status.success() && said.contains("refuses"),
            "{said}"
        );
    }
    wait_for("the delivery of 1 and the way to 2", || {
        status
            .latest()
            .expect("readable")
            .filter(|status| status.delivered == 1 && status.product == 2)
            .map(|_| ())
    });
    let told = up.output();
    for words in [
        "fetches product 1",
        "is in position at product 1",
        "leaves the station with product 1",
        "DELIVERED product 1",
    ] {
        assert!(told.contains(words), "`{words}` is missing:\n{told}");
    }
    drop((status, observer, up));
    domain.assert_clean();
}

#[test]
fn an_interrupted_mission_is_no_success() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless", "--exit-when-done", "--json"]);
    let observer = domain.observe("r1", 1.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("logic", || status.latest().expect("readable").map(|_| ()));
    up.signal(Signal::TERM);
    assert_eq!(up.wait(), Some(3), "{}", up.log());
    let failure = up.json()["failure"].to_string();
    assert!(failure.contains("interrupted"), "{failure}");
    drop((status, observer));
    domain.assert_clean();
}

#[test]
fn ctrl_c_stops_the_motors_and_leaves_nothing() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless", "--speed", "2"]);
    let observer = domain.observe("r1", 2.0);
    let mut state = observer.subscriber::<SteeringState>().expect("a topic");
    wait_for("the robot to drive", || {
        state
            .latest()
            .expect("readable")
            .filter(|report| report.left_duty > 0)
            .map(|_| ())
    });
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let mut last = None;
    while let Some(report) = state.receive().expect("readable") {
        last = Some((report.left_duty, report.right_duty));
    }
    assert_eq!(last, Some((0, 0)), "the last report before the end");
    drop((state, observer));
    domain.assert_clean();
}

#[test]
fn a_stop_latches_until_it_is_resumed() {
    let domain = Domain::new();
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
        "--speed",
        "3",
    ]);
    let observer = domain.observe("r1", 3.0);
    let mut state = observer.subscriber::<SteeringState>().expect("a topic");
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        state
            .latest()
            .expect("readable")
            .filter(|report| report.left_duty > 0)
            .map(|_| ())
    });
    assert!(domain.run(&["stop"]).status.success());
    wait_for("the robot to stand", || {
        state
            .latest()
            .expect("readable")
            .filter(|report| report.left_duty == 0 && report.right_duty == 0)
            .map(|_| ())
    });
    // Logic goes on renewing its orders; none of the next 400 reports shows a duty.
    let mut seen = 0;
    while seen < 400 {
        let report = wait_for("a report", || state.receive().expect("readable"));
        assert_eq!((report.left_duty, report.right_duty), (0, 0));
        seen += 1;
    }
    let still = wait_for("nav/status", || status.latest().expect("readable"));
    assert_ne!(still.phase.get(), Some(Phase::Stuck));
    assert_eq!(still.mode.get(), Some(Mode::Autonomous));
    drop(still);
    let refused = domain.run(&["drive", "forward"]);
    assert!(!refused.status.success(), "driving needs a resume first");
    assert!(domain.run(&["resume"]).status.success());
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    assert_eq!(up.json()["delivered"], serde_json::json!([1]));
    drop((state, status, observer));
    domain.assert_clean();
}

#[test]
fn a_person_can_do_by_hand_what_the_script_does() {
    let domain = Domain::new();
    let _up = domain.start(&["up", "--headless", "--mission", "1", "--speed", "3"]);
    let observer = domain.observe("r1", 3.0);
    let mut state = observer.subscriber::<SteeringState>().expect("a topic");
    wait_for("the boards", || {
        state.latest().expect("readable").map(|_| ())
    });
    let said = |args: &[&str]| {
        let output = domain.run(args);
        let text = format!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        (output.status.success(), text)
    };
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the script to have taken over", || {
        status
            .latest()
            .expect("readable")
            .filter(|status| status.phase.get() == Some(Phase::Driving))
            .map(|_| ())
    });
    let (fine, text) = said(&["mode", "manual"]);
    assert!(fine, "{text}");
    let (fine, text) = said(&["drive", "0x02", "--seconds", "0.5"]);
    assert!(fine, "{text}");
    let (fine, text) = said(&["drive", "left-diag"]);
    assert!(fine && text.contains("done"), "{text}");
    let (fine, text) = said(&["arm", "up"]);
    assert!(fine && text.contains("done"), "{text}");
    let (fine, text) = said(&["drive", "00001111"]);
    assert!(!fine && text.contains("no command"), "{text}");
    let (fine, text) = said(&["arm", "forward"]);
    assert!(!fine && text.contains("no command"), "{text}");
    let (fine, text) = said(&["arm", "2"]);
    assert!(!fine && text.contains("lager drive"), "{text}");
    let (fine, text) = said(&["picked"]);
    assert!(!fine && text.contains("pick station"), "{text}");
    let (fine, text) = said(&["gains", "3", "1"]);
    assert!(fine && text.contains("3 and 1"), "{text}");
    let (fine, text) = said(&["reset"]);
    assert!(fine, "{text}");
    drop((state, status, observer));
}

#[test]
fn the_topic_tools_show_a_running_robot() {
    let domain = Domain::new();
    let _up = domain.start(&["up", "--headless", "--speed", "1"]);
    let list = wait_for("the topics", || {
        let output = domain.run(&["topic", "list"]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.contains("sensor/line").then_some(text)
    });
    assert!(list.contains("lager/r1/sensor/line"), "{list}");

    let echo = domain.run(&["topic", "echo", "sensor/line", "--count", "20", "--json"]);
    let text = String::from_utf8_lossy(&echo.stdout).into_owned();
    let samples: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(samples.len(), 20);
    for pair in samples.windows(2) {
        let number = |sample: &Value| sample["sequence"].as_u64().expect("a number");
        assert_eq!(number(&pair[1]), number(&pair[0]) + 1);
        assert_eq!(pair[1]["lost"], 0);
    }

    let hz = domain.run(&["topic", "hz", "sensor/line", "--count", "2", "--json"]);
    let text = String::from_utf8_lossy(&hz.stdout).into_owned();
    let window: Value = serde_json::from_str(text.lines().last().expect("a line")).expect("JSON");
    assert!(window["samples"].as_u64().expect("samples") > 0, "{text}");

    let info = domain.run(&["topic", "info", "steering/command"]);
    let text = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(
        text.contains("origin") && text.contains("wakes       bridge"),
        "{text}"
    );

    let unknown = domain.run(&["topic", "echo", "sensor/lime"]);
    let said = String::from_utf8_lossy(&unknown.stderr).into_owned();
    assert!(
        !unknown.status.success() && said.contains("sensor/line"),
        "{said}"
    );

    let doctor = domain.run(&["doctor"]);
    let text = String::from_utf8_lossy(&doctor.stdout).into_owned();
    for check in [
        "shared memory",
        "open files",
        "versions",
        "serial rights",
        "bus",
    ] {
        assert!(text.contains(check), "{text}");
    }
}
