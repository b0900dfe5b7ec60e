//! The guard notices: with a deliberate slow-down in what it measures it fails and names the right
//! figure, and without one the same build passes.
//!
//! Each test runs `benches/guard` as people do. A slow-down adds to what is measured at all times,
//! so a test that wants the guard to fail cannot be disturbed by whatever else the machine does;
//! that unchanged code keeps its ratios is for `.ci/run` to show, which runs the guard itself.

use std::collections::BTreeMap;
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let output = Command::new(root.join("benches/guard"))
        .args(arguments)
        .arg("--json")
        .output()
        .unwrap();
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

/// The guard with a slow-down, which fails and names all of `figures`.
fn trips(slow: &str, only: &str, attempts: &str, figures: &[&str]) {
    let said = guard(&[
        "--slow",
        slow,
        "--only",
        only,
        "--runs",
        "1",
        "--attempts",
        attempts,
    ]);
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
fn an_allocation_beside_each_sample_is_noticed() {
    let unchanged = guard(&["--only", "instructions"]);
    assert_eq!(unchanged.code, Some(0), "{}", unchanged.everything);
    assert!(unchanged.failing.is_empty(), "{}", unchanged.everything);
    if unchanged
        .everything
        .contains("limits were measured with rustc")
    {
        // The checked-in counts are another compiler's and leave room for more than an
        // allocation, so they say nothing here. `.ci/run` has the compiler they are for.
        eprintln!("not judged: {}", unchanged.everything);
        return;
    }
    trips(
        "allocation",
        "instructions",
        "1",
        &["publish/to-1", "receive/sample"],
    );
}

#[test]
fn a_spin_of_five_microseconds_in_the_hop_is_noticed() {
    trips(
        "spin",
        "hop",
        // It does not slip through because the lower of two ratios counts.
        "2",
        &[
            "hop spin plain: lager / iceoryx2/header p50",
            "hop block same-core: lager / iceoryx2/event p50",
        ],
    );
}

#[test]
fn a_system_call_for_each_observer_is_noticed() {
    trips(
        "system-call",
        "hop,fanout",
        "1",
        &[
            "ring-64 block same-core: lager/ring / iceoryx2/notify p50",
            "publish-64 spin plain: lager / iceoryx2/header p50",
        ],
    );
}

/// What the guard says of counts that are handed over.
fn judged(counts: &Value) -> Said {
    let file = std::env::temp_dir().join(format!("lager-guard-{}.json", std::process::id()));
    std::fs::write(&file, counts.to_string()).unwrap();
    let said = guard(&["--only", "cycles", "--counts", file.to_str().unwrap()]);
    std::fs::remove_file(file).unwrap();
    said
}

/// The limits in what the guard said.
fn limits(said: &Said) -> Vec<Value> {
    let line = said.everything.lines().next().unwrap_or_default();
    let findings: Value =
        serde_json::from_str(line).unwrap_or_else(|_| panic!("{}", said.everything));
    findings["limits"].as_array().unwrap().clone()
}

/// The images are measured once; then each of their figures gets worse, alone, by 6 % of what its
/// limit was made of.
#[test]
fn six_percent_more_cycles_are_noticed() {
    let measured = guard(&["--only", "cycles"]);
    assert_eq!(measured.code, Some(0), "{}", measured.everything);
    let counts = |figures: &BTreeMap<String, f64>| {
        // The compiler of the limits, whatever built the images here.
        let built = serde_json::json!({"rustc": "1.96.0", "target": "avr-none"});
        serde_json::json!({"source": "cycles", "built": built, "figures": figures})
    };
    let name = |limit: &Value| limit["figure"].as_str().unwrap().to_owned();
    let seen = limits(&measured)
        .iter()
        .map(|limit| (name(limit), limit["measured"].as_f64().unwrap()))
        .collect();
    let limits = limits(&judged(&counts(&seen)));
    assert!(limits.len() >= 11, "{limits:?}");
    // The least that can be wrong: everything as it was when its limit was written.
    let base = |limit: &Value| match limit["at_least"] == true {
        true => limit["limit"].as_f64().unwrap(),
        false => (limit["limit"].as_f64().unwrap() / 1.05).round(),
    };
    let figures = limits
        .iter()
        .map(|limit| (name(limit), base(limit)))
        .collect();
    let unchanged = judged(&counts(&figures));
    assert_eq!(unchanged.code, Some(0), "{}", unchanged.everything);
    for limit in &limits {
        let worse = match limit["at_least"] == true {
            true => base(limit) * 0.94,
            false => (base(limit) * 1.06).ceil(),
        };
        let mut changed = figures.clone();
        changed.insert(name(limit), worse);
        let said = judged(&counts(&changed));
        assert_eq!(said.code, Some(1), "{}", said.everything);
        assert_eq!(said.failing, [name(limit)]);
    }
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
