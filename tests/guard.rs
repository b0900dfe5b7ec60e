//! Tests that the guard finds a slow-down: a test adds a deliberate one to the measured code, and
//! the guard must fail and name the right figure.
//!
//! The tests start the program of `benches/guard`, as people do. A slow-down adds to the measured
//! time whatever else the machine does, so a busy machine cannot make these tests fail. `.ci/run`
//! shows the opposite, that unchanged code keeps its limits: it runs the guard itself with the same
//! build.

use std::process::Command;

use serde_json::Value;

/// The guard's output.
struct Said {
    code: Option<i32>,
    failing: Vec<String>,
    everything: String,
}

fn guard(arguments: &[&str]) -> Said {
    let _alone = lager_tests::alone();
    let guard = lager_tests::in_tree("benches/guard");
    let mut command = Command::new(guard);
    let output = command.args(arguments).arg("--json").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let everything = format!("{text}{}", String::from_utf8_lossy(&output.stderr));
    let findings: Value = serde_json::from_str(&text).unwrap_or_default();
    let failing = findings["limits"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|limit| limit["verdict"] == "broken" || limit["verdict"] == "missing")
        .map(|limit| limit["figure"].as_str().unwrap().to_owned())
        .collect();
    Said {
        code: output.status.code(),
        failing,
        everything,
    }
}

/// Runs the guard with a slow-down and returns its output.
fn slowed(slow: &str, only: &str) -> Said {
    guard(&[
        "--slow",
        slow,
        "--only",
        only,
        "--runs",
        "1",
        "--attempts",
        "1",
    ])
}

/// Asserts that the guard failed and named all of `figures`.
fn assert_broken(said: &Said, figures: &[&str]) {
    assert_eq!(said.code, Some(1), "{}", said.everything);
    for figure in figures {
        assert!(
            said.failing
                .iter()
                .any(|failing| failing.starts_with(figure)),
            "{figure} is not among the failing:\n{}",
            said.everything
        );
    }
}

#[test]
#[ignore = "needs the compiler of benches/limits.toml, as other compilers' counts get more room than an allocation takes; `tests/run` runs it where it has that"]
fn an_allocation_beside_each_sample_is_noticed() {
    let said = slowed("allocation", "instructions");
    let other = said.everything.contains("limits were measured with rustc");
    assert!(!other, "not judged: {}", said.everything);
    assert_broken(&said, &["publish/to-1", "receive/sample"]);
}

#[test]
#[ignore = "measures with a build of its own; `tests/run` runs it"]
fn a_system_call_for_each_observer_is_noticed() {
    assert_broken(
        &slowed("system-call", "hop,fanout"),
        &[
            "ring-64 block same-core: lager/ring / iceoryx2/notify p50",
            "publish-64 spin plain: lager / iceoryx2/header p50",
        ],
    );
}

#[test]
#[ignore = "as above"]
fn a_slow_down_that_does_not_exist_is_refused() {
    let said = guard(&["--slow", "everything"]);
    assert_eq!(said.code, Some(2), "{}", said.everything);
}

#[test]
#[ignore = "as above"]
fn a_source_without_limits_is_refused() {
    let said = guard(&["--only", "weather"]);
    assert_eq!(said.code, Some(2), "{}", said.everything);
    assert!(
        said.everything.contains("instructions"),
        "{}",
        said.everything
    );
}
