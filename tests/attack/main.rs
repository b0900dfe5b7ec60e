//! Tests that damage every shared file of a running robot. The robot must run again or end with a
//! reason, no tool may hang, nothing may be left behind, and the motors must not run on. A part of
//! it runs here. `tests/soak attack` tries every kind of file in every way, a full memory and a
//! full disk, and kills thousands of observers.
//!
//! The boards are a process on a bus of their own, as real boards would be, behind a cable that
//! knows when the bridge last sent something. So the test sees the motors whatever happens to the
//! robot's bus.

mod boards;
mod full;
mod harm;

use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

use lager_tests::{Domain, Running, WATCHDOG, wait_for};
use rustix::process::Signal;

use boards::Boards;
use harm::{FILES, HARMS, Harm, SEGMENTS, Target};

/// The longest time that motors may run without the bridge, and the delay of a sample of the world.
const UNSTEERED: Duration = Duration::from_millis(200);
/// The longest time until the robot is up again or has ended with a reason.
const BACK: Duration = Duration::from_secs(25);
/// The longest time until a tool ends.
const TOOL: Duration = Duration::from_secs(5);

/// The number of observers to kill, in the soak only. Times are asserted nowhere else.
fn soak() -> Option<usize> {
    std::env::var("LAGER_SOAK_ATTACK").ok()?.parse().ok()
}

/// The output of a tool that has ended by itself; `None` if it hung.
fn tool(domain: &Domain, arguments: &[&str]) -> Option<Output> {
    let mut child = domain
        .lager(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("lager starts");
    let start = Instant::now();
    let limit = soak().map_or(WATCHDOG / 4, |_| TOOL);
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > limit {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Some(child.wait_with_output().expect("its output"))
}

/// Whether a new process hears the robot; panics if that process hangs.
fn answers(domain: &Domain, up: &Running) -> bool {
    let echo = tool(domain, &["topic", "echo", "sensor/line", "--count", "1"]);
    let Some(echo) = echo else {
        panic!("`topic echo` hangs:\n{}", up.log());
    };
    echo.status.success()
}

/// A robot that drives with these boards.
fn driving(domain: &Domain, boards: &Boards) -> Running {
    let config = domain.folder().join("robot.toml");
    let config = config.to_str().expect("UTF-8");
    let up = domain.start(&["--config", config, "up", "--script", "--mission", "1"]);
    // Real boards begin with a stop that a person has to release.
    wait_for("the stop to be released", || {
        domain.run(&["resume"]).status.success().then_some(())
    });
    wait_for("the robot to drive", || boards.watch.runs().then_some(()));
    up
}

/// The result of an attack.
struct AttackResult {
    what: String,
    said: String,
    took: Duration,
    unsteered: Duration,
}

/// Starts a robot, damages it with `spoil` while it drives, and judges the result.
fn attack(what: &str, spoil: impl FnOnce(&Domain, &Running)) -> AttackResult {
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let mut up = driving(&domain, &boards);
    let start = Instant::now();
    spoil(&domain, &up);
    let said = loop {
        if !up.is_running() {
            let log = up.log();
            let why = log.lines().last().unwrap_or_default().to_owned();
            assert!(
                up.wait() != Some(0) && !why.is_empty(),
                "{what}: no reason:\n{log}"
            );
            break format!("ended: {why}");
        }
        if answers(&domain, &up) {
            break "up".to_owned();
        }
        let limit = soak().map_or(WATCHDOG, |_| BACK);
        assert!(
            start.elapsed() < limit,
            "{what}: neither up nor ended:\n{}",
            up.log()
        );
    };
    let took = start.elapsed();
    let list = tool(&domain, &["topic", "list"]);
    assert!(list.is_some(), "{what}: `topic list` hangs");
    if up.is_running() {
        up.signal(Signal::INT);
        up.wait();
    }
    wait_for("the motors to stand", || {
        (!boards.watch.runs()).then_some(())
    });
    let unsteered = boards.watch.unsteered();
    drop(boards);
    let fixed = tool(&domain, &["doctor", "--fix"]).expect("`doctor --fix` ends");
    let mut left = domain.leftovers();
    // The stop of a stopped robot stays.
    left.retain(|file| !file.ends_with("/stop"));
    let report = String::from_utf8_lossy(&fixed.stdout).into_owned();
    assert!(
        left.is_empty(),
        "{what}: left {left:#?}\n{report}\n{}",
        up.log()
    );
    AttackResult {
        what: what.to_owned(),
        said,
        took,
        unsteered,
    }
}

fn spoilt(target: Target, harm: Harm) -> AttackResult {
    attack(&format!("{target:?} {harm:?}"), |domain, _| {
        let place = domain.bus("r1", 1.0).home().expect("the bus's folder");
        target.spoil(&place, harm);
    })
}

/// Prints the measured times; only the soak asserts them.
fn report(outcomes: &[AttackResult]) {
    for outcome in outcomes {
        println!(
            "{:40} {:>5.1} s  motors {:>4} ms without a word  {}",
            outcome.what,
            outcome.took.as_secs_f64(),
            outcome.unsteered.as_millis(),
            outcome.said
        );
    }
    if soak().is_some() {
        for outcome in outcomes {
            let unsteered = outcome.unsteered;
            assert!(unsteered <= UNSTEERED, "{}: {unsteered:?}", outcome.what);
        }
    }
}

#[test]
fn a_robot_whose_files_are_spoilt_is_up_again_or_ends_with_a_reason() {
    let segments = SEGMENTS.map(Target::Segments);
    let files = FILES.map(Target::Files);
    let kinds = segments.into_iter().chain(files);
    let mut attacks: Vec<(Target, Harm)> = match soak() {
        Some(_) => kinds
            .flat_map(|kind| HARMS.map(|harm| (kind, harm)))
            .collect(),
        None => vec![
            (Target::Segments(".dynamic"), Harm::Deleted),
            (Target::Segments(".connection"), Harm::Shortened),
            (Target::Files(".service"), Harm::Overwritten),
            (Target::Files("bells"), Harm::Deleted),
        ],
    };
    attacks.extend([Target::Contents, Target::Folder].map(|all| (all, Harm::Deleted)));
    for (target, harm) in attacks {
        report(&[spoilt(target, harm)]);
    }
}

#[test]
fn observers_killed_at_random_moments_cost_nobody_anything() {
    let count = soak().unwrap_or(20);
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let up = driving(&domain, &boards);
    let mut moment = 0_u64;
    for number in 0..count {
        let mut observer = domain
            .lager(&["topic", "echo", "sensor/line", "--count", "1000"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("lager starts");
        // Linear congruential steps: other moments for each attack, the same ones in every run.
        moment = moment
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695);
        std::thread::sleep(Duration::from_micros(2_000 + (moment >> 33) % 40_000));
        observer.kill().expect("a child");
        observer.wait().expect("a child");
        if number % 500 == 499 {
            assert!(answers(&domain, &up), "after {number}:\n{}", up.log());
        }
    }
    assert!(answers(&domain, &up), "{}", up.log());
    for service in ["bridge", "logic", "attend"] {
        assert!(up.service(service).is_some(), "{}", up.log());
    }
    let log = up.log();
    assert!(!log.contains("ended ("), "no service noticed:\n{log}");
    if soak().is_some() {
        assert!(boards.watch.unsteered() <= UNSTEERED);
    }
    drop((up, boards));
    wait_for("the dead processes' files to be removed", || {
        let _ = domain.run(&["doctor", "--fix"]);
        domain.leftovers().is_empty().then_some(())
    });
}
