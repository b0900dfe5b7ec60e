//! Tests that the guard finds a slow-down: a test adds a deliberate one to the measured code, and
//! the guard must fail and name the right figure.
//!
//! The tests start the program of `benches/guard`, as people do. A slow-down adds to the measured
//! time whatever else the machine does, so a busy machine cannot make these tests fail. `.ci/run`
//! shows the opposite, that unchanged code keeps its limits: it runs the guard itself with the same
//! build.

use core::time::Duration;
use std::fs;
use std::process::{Command, Stdio};

use lager_rig::proc;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// The guard's output.
struct Said {
    code: Option<i32>,
    failing: Vec<String>,
    everything: String,
}

fn guard(arguments: &[&str]) -> Said {
    guard_beside(arguments, |_| ())
}

/// Runs the guard, and `work` beside it, which gets the process's number.
fn guard_beside(arguments: &[&str], work: impl FnOnce(u32)) -> Said {
    let _alone = lager_tests::alone();
    let guard = lager_tests::in_tree("benches/guard");
    let mut command = Command::new(guard);
    command.args(arguments).arg("--json");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    work(child.id());
    let output = child.wait_with_output().unwrap();
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

/// The logics of the measured robots. The script becomes the guard, whose children they are.
fn logics(guard: u32) -> Vec<u32> {
    let is_logic = |process: &u32| {
        let variables = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
        let name = b"LAGER_PROCESS=path, logic";
        variables.split(|byte| *byte == 0).any(|one| one == name)
    };
    proc::children(guard).into_iter().filter(is_logic).collect()
}

fn signal(process: u32, signal: Signal) {
    // It may have ended meanwhile.
    let process = Pid::from_raw(process.cast_signed()).unwrap();
    let _ = kill_process(process, signal);
}

/// Lets no logic run until the measurement has ended for this reason.
fn freeze_the_logics(guard: u32) {
    let sleep = || std::thread::sleep(Duration::from_millis(5));
    let is_up = || fs::exists(format!("/proc/{guard}")).unwrap_or(false);
    let found = loop {
        match logics(guard) {
            found if !found.is_empty() || !is_up() => break found,
            _ => sleep(),
        }
    };
    while logics(guard).iter().any(|logic| found.contains(logic)) {
        // A chain whose turn comes is told to run, so it is told again and again.
        logics(guard)
            .iter()
            .for_each(|logic| signal(*logic, Signal::STOP));
        sleep();
    }
    // Those of the next measurement.
    logics(guard)
        .iter()
        .for_each(|logic| signal(*logic, Signal::CONT));
}

const PATH_ONCE: [&str; 6] = ["--only", "path", "--runs", "1", "--attempts", "2"];

#[test]
#[ignore = "as above"]
fn a_measurement_that_ended_because_the_machine_was_held_up_is_made_again() {
    let said = guard_beside(&PATH_ONCE, |guard| {
        std::thread::scope(|scope| {
            scope.spawn(|| freeze_the_logics(guard));
            while logics(guard).is_empty() {
                std::thread::sleep(Duration::from_millis(5));
            }
            // As if another machine had this one's cores.
            signal(guard, Signal::STOP);
            std::thread::sleep(Duration::from_millis(300));
            signal(guard, Signal::CONT);
        });
    });
    // The machine may really be held up in the second one, and what that measures is not judged here.
    for words in ["path is measured again: ", "gave a core to nobody here"] {
        assert!(said.everything.contains(words), "{}", said.everything);
    }
}

#[test]
#[ignore = "as above"]
fn a_measurement_that_ended_on_a_machine_that_ran_is_not_made_again() {
    let said = guard_beside(&PATH_ONCE, freeze_the_logics);
    // If this machine was really held up, there is nothing to see.
    if !said.everything.contains("gave a core to nobody here") {
        assert_eq!(said.code, Some(2), "{}", said.everything);
        let is_told = said
            .everything
            .contains("start again, and report it if it happens twice");
        assert!(is_told, "{}", said.everything);
    }
}
