//! The guard notices: with a deliberate slow-down in what it measures it fails and names the right
//! figure.
//!
//! What is measured here is measured by `benches/guard` as people run it. A slow-down adds to what
//! is measured at all times, so a test that wants the guard to fail cannot be disturbed by whatever
//! else the machine does; that unchanged code keeps its limits is for `.ci/run` to show, which runs
//! the guard itself with the same build.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What the guard said.
struct Said {
    code: Option<i32>,
    failing: Vec<String>,
    everything: String,
}

fn guard(arguments: &[&str]) -> Said {
    let _alone = lager_tests::alone();
    let guard = Path::new(env!("CARGO_MANIFEST_DIR")).join("../benches/guard");
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

/// What the guard says with a slow-down.
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

/// It failed and named all of `figures`.
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

/// The slow-down is computed from each limit and from what the machine shows without it. The p99 of
/// a busy machine are for people to try (`benches/guard --try`).
#[test]
fn a_slow_down_just_above_a_limit_on_the_median_hop_is_noticed() {
    let said = guard(&["--only", "hop", "--try"]);
    let planted: Vec<Value> = said
        .everything
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    let medians: Vec<_> = planted
        .iter()
        .filter(|one| one["figure"].as_str().unwrap().ends_with(" p50"))
        .collect();
    assert!(medians.len() >= 8, "{}", said.everything);
    for one in medians {
        assert_eq!(one["noticed"], true, "{one}");
    }
}

#[test]
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
fn a_slow_down_that_does_not_exist_is_refused() {
    let said = guard(&["--slow", "everything"]);
    assert_eq!(said.code, Some(2), "{}", said.everything);
}

#[test]
fn a_source_without_limits_is_refused() {
    let said = guard(&["--only", "weather"]);
    assert_eq!(said.code, Some(2), "{}", said.everything);
    assert!(
        said.everything.contains("instructions"),
        "{}",
        said.everything
    );
}
