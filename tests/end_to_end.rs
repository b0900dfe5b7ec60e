//! Tests of the robot as people start it: real processes, real packets over ptys, a real bus.

use lager_tests::{Domain, pid, wait_for};
use lager_topics::{NavStatus, NavigatorStatus, Phase, SteeringState};
use rustix::process::{Signal, kill_process};
use serde_json::Value;

#[test]
fn a_mission_is_delivered_and_told_in_one_json_line() {
    let domain = Domain::new();
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
        "--speed",
        "2",
    ]);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]));
    assert_eq!(told["restarts"], 0, "{told}\n{}", up.log());
    let frames = told["frames"].as_u64().expect("frames");
    let lost = told["lost"].as_u64().expect("lost");
    let sim = told["sim_seconds"].as_f64().expect("sim_seconds");
    // 200 sensor packets and 200 reports a second, less during the start. If others keep a reader
    // from its core until its queue is full, the reader counts a loss.
    assert!((frames + lost) as f64 > 200.0 * sim, "{told}");
    domain.assert_clean();
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
    // Others wait their turn, and an unknown product is refused.
    for (product, turn) in [("2", "goods 2 next"), ("3", "waiting before it: 1")] {
        let taken = domain.run(&["fetch", product]);
        let said = String::from_utf8_lossy(&taken.stdout).into_owned();
        assert!(
            taken.status.success() && said.contains(turn),
            "{said} {taken:?}"
        );
    }
    let refused = domain.run(&["fetch", "99"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && said.contains("refuses"),
        "{said}"
    );
    wait_for("the delivery of 1 and the way to 2", || {
        status
            .latest()
            .expect("readable")
            .filter(|status| status.delivered == 1 && status.product == 2)
            .map(|_| ())
    });
    // The log reports a delivery after the state shows it.
    for words in [
        "fetches goods 1",
        "is in position at goods 1",
        "leaves the station with goods 1",
        "DELIVERED goods 1",
    ] {
        wait_for(words, || up.output().contains(words).then_some(()));
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
fn real_boards_are_driven_by_a_script_only_if_it_and_its_mission_are_asked_for() {
    let domain = Domain::new();
    let ports = ["up", "--sensor", "/dev/null", "--steering", "/dev/null"];
    for (flags, words) in [
        (&["--headless", "--mission", "1"][..], "--script"),
        (&["--headless", "--script"], "--mission"),
        (
            &["--headless", "--exit-when-done"],
            "--script and --mission",
        ),
        (&["--body", "sim"], "leave one of them out"),
        (&["--body", "chip"], "leave one of them out"),
    ] {
        let refused = domain.run(&[&ports[..], flags].concat());
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{flags:?}: {said}");
        assert!(said.contains(words), "{flags:?}: {said}");
    }
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
fn a_person_can_do_everything_by_hand() {
    let domain = Domain::new();
    let _up = domain.start(&["up", "--headless", "--mission", "1", "--speed", "3"]);
    let observer = domain.observe("r1", 3.0);
    let mut state = observer.subscriber::<SteeringState>().expect("a topic");
    wait_for("the boards", || {
        state.latest().expect("readable").map(|_| ())
    });
    let said = |args: &[&str]| {
        let output = domain.run_renewed(args);
        let text = format!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        (output.status.success(), text)
    };
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
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
    assert!(!fine && text.contains("does not wait at goods"), "{text}");
    let (fine, text) = said(&["gains", "3", "1"]);
    assert!(fine && text.contains("3 and 1"), "{text}");
    for reset in [&["reset"][..], &["press", "reset"]] {
        let (fine, text) = said(reset);
        assert!(fine, "{text}");
    }
    // Each press of the switch changes to the other mode.
    for mode in ["logic steers", "the operator steers"] {
        let (fine, text) = said(&["press", "switch"]);
        assert!(fine && text.contains(mode), "{text}");
    }
    drop((state, status, observer));
}

#[test]
fn a_robot_driven_by_hand_is_put_down_and_delivers() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless", "--mission", "1", "--speed", "4"]);
    let observer = domain.observe("r1", 4.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    let mut until = |what: &str, done: &dyn Fn(&NavigatorStatus) -> bool| {
        wait_for(what, || {
            assert!(up.is_running(), "{}", up.log());
            let status = status.latest().expect("readable")?;
            done(&status).then_some(())
        });
    };
    let run = |args: &[&str]| domain.done(args);
    until("the robot to drive", &|status| {
        status.phase == Phase::Driving
    });
    let refused = domain.run(&["place"]);
    assert!(!refused.status.success(), "it is moving");
    run(&["mode", "manual"]);
    run(&["drive", "right", "--seconds", "2"]);
    run(&["drive", "forward", "--seconds", "2"]);
    until("it to know that it is lost", &|status| {
        status.phase == Phase::Stuck
    });
    // What is known of the wheels may still be from the drive that has just ended.
    wait_for("the floor's size to be the reason", || {
        let refused = domain.run(&["place", "9,9,up"]);
        let why = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success(), "{why}");
        why.contains("2,2").then_some(())
    });
    run(&["place", "1,2,down"]);
    until("it to stand there", &|status| {
        (status.x, status.y) == (1, 2)
    });
    run(&["place"]);
    until("it to stand at the start", &|status| {
        (status.x, status.y) == (0, 0)
    });
    run(&["place", "2,1,left"]);
    run(&["mode", "autonomous"]);
    run(&["fetch", "1"]);
    until("it to stand at the goods", &|status| {
        status.phase == Phase::Picking
    });
    let refused = domain.run(&["picked"]);
    let why = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && why.contains("--force"),
        "{why}"
    );
    run(&["picked", "--force"]);
    until("the delivery", &|status| status.delivered == 1);
    drop((status, observer));
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

    let hz = domain.run(&["topic", "hz", "sensor/line", "--count", "50", "--json"]);
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
        "load",
        "serial rights",
        "bus",
    ] {
        assert!(text.contains(check), "{text}");
    }
}

#[test]
fn things_are_put_on_the_simulated_floor_and_outlive_the_simulator() {
    let domain = Domain::new();
    let up = domain.start(&["up", "--headless", "--speed", "1"]);
    wait_for("the simulator", || up.service("simulator"));
    let run = |args: &[&str]| {
        let output = domain.run(&[&["obstacle"], args].concat());
        let said = [&output.stdout[..], &output.stderr].concat();
        (
            output.status.success(),
            String::from_utf8(said).expect("text"),
        )
    };
    let told = |args: &[&str], success: bool, words: &str| {
        let (succeeded, said) = run(args);
        assert_eq!(succeeded, success, "{args:?}: {said}");
        assert!(said.contains(words), "{args:?}: {said}");
    };
    wait_for("the world", || run(&[]).0.then_some(()));
    told(&[], true, "nothing stands");
    told(&["put", "0,0,right"], false, "the robot is there");
    told(&["put", "9,9,up"], false, "crossings go from 0,0 to");
    told(&["take", "1,0,up"], false, "nothing stands there");
    told(&["put", "1,0,up"], true, "the way from (1, 0) up");
    told(&["put", "2,1,left"], true, "the way from (2, 1) left");

    let simulator = up.service("simulator").expect("it runs");
    kill_process(pid(simulator), Signal::KILL).expect("a process of ours");
    wait_for("another simulator", || {
        up.service("simulator").filter(|now| *now != simulator)
    });
    let both = "1,0,up\n1,1,right\n";
    wait_for("its world", || (run(&[]).1 == both).then_some(()));
    told(&["take", "1,1,down"], true, "is gone");
    assert_eq!(run(&[]).1, "1,1,right\n");
    drop(up);
    domain.assert_clean();
}
