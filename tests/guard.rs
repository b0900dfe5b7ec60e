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
    /// The ratios of times that were judged.
    ratios: Vec<String>,
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
    let limits = findings["limits"].as_array().into_iter().flatten();
    let figures = |wanted: fn(&Value) -> bool| {
        let wanted = limits.clone().filter(|limit| wanted(limit));
        let figure = |limit: &Value| limit["figure"].as_str().unwrap().to_owned();
        wanted.map(figure).collect()
    };
    let failing = figures(|limit| limit["verdict"] == "broken" || limit["verdict"] == "missing");
    let ratios = figures(|limit| limit["source"] == "latency" && limit["verdict"] != "not-judged");
    Said {
        code: output.status.code(),
        failing,
        ratios,
        everything,
    }
}

/// Runs the guard with a slow-down and returns its output.
fn slowed(slow: &str, only: &str) -> Said {
    guard(&["--slow", slow, "--only", only, "--repetitions", "3"])
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
fn system_calls_in_what_is_timed_break_the_limit_of_every_ratio() {
    let said = slowed("system-call", "latency");
    assert_eq!(said.code, Some(1), "{}", said.everything);
    assert!(said.ratios.len() > 10, "{}", said.everything);
    let not_noticed = said
        .ratios
        .iter()
        .filter(|ratio| !said.failing.contains(ratio));
    let not_noticed: Vec<_> = not_noticed.collect();
    assert!(
        not_noticed.is_empty(),
        "{not_noticed:?}\n{}",
        said.everything
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

/// The logics of the measured robots, and the program that measures them, a child of the script.
fn logics(guard: u32) -> Option<(Vec<u32>, u32)> {
    let is_logic = |process: &u32| {
        let variables = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
        let name = b"LAGER_PROCESS=path, logic";
        variables.split(|byte| *byte == 0).any(|one| one == name)
    };
    proc::children(guard).into_iter().find_map(|program| {
        let children = proc::children(program).into_iter();
        let found: Vec<u32> = children.filter(is_logic).collect();
        (!found.is_empty()).then_some((found, program))
    })
}

fn signal(process: u32, signal: Signal) {
    // It may have ended meanwhile.
    let process = Pid::from_raw(process.cast_signed()).unwrap();
    let _ = kill_process(process, signal);
}

/// Lets no logic run until the measurement has ended for this reason. The program that measures stands
/// still for `stands` meanwhile.
fn freeze_the_logics(guard: u32, stands: Option<Duration>) {
    let sleep = || std::thread::sleep(Duration::from_millis(5));
    let is_up = || fs::exists(format!("/proc/{guard}")).unwrap_or(false);
    let tell = |logics: &[u32], what| logics.iter().for_each(|logic| signal(*logic, what));
    let (frozen, program) = loop {
        match logics(guard) {
            Some(found) => break found,
            None if !is_up() => return,
            None => sleep(),
        }
    };
    tell(&frozen, Signal::STOP);
    if let Some(stands) = stands {
        signal(program, Signal::STOP);
        std::thread::sleep(stands);
        signal(program, Signal::CONT);
    }
    // A chain whose turn comes is told to run, so it is told again and again.
    while let Some((now, _)) = logics(guard)
        && now.iter().any(|logic| frozen.contains(logic))
    {
        tell(&now, Signal::STOP);
        sleep();
    }
    // Those of the next measurement.
    if let Some((now, _)) = logics(guard) {
        tell(&now, Signal::CONT);
    }
}

const ONCE: [&str; 4] = ["--only", "latency", "--repetitions", "1"];

#[test]
#[ignore = "as above"]
fn a_measurement_that_ended_because_the_machine_was_held_up_is_made_again() {
    let said = guard_beside(&ONCE, |guard| {
        // As if another machine had this one's cores.
        freeze_the_logics(guard, Some(Duration::from_millis(300)));
    });
    // The machine may really be held up in the second one, and what that measures is not judged here.
    for words in ["that is measured again", "gave a core to nobody here"] {
        assert!(said.everything.contains(words), "{}", said.everything);
    }
}

#[test]
#[ignore = "as above"]
fn a_measurement_that_ended_on_a_machine_that_ran_is_not_made_again() {
    let said = guard_beside(&ONCE, |guard| freeze_the_logics(guard, None));
    // If this machine was really held up, there is nothing to see.
    if !said.everything.contains("gave a core to nobody here") {
        assert_eq!(said.code, Some(2), "{}", said.everything);
        assert!(
            !said.everything.contains("measured again"),
            "{}",
            said.everything
        );
    }
}
