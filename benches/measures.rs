//! Tests of the scenarios with their real processes, from the start to the report: whether they
//! measure what they say, end when a process dies, and leave nothing behind. No time is asserted.
//!
//! They do not use the standard test harness, because this program is also its own child processes.

use std::path::Path;
use std::time::Duration;

use lager_benches::{BenchError, FAMILY, Mode, Options, Regime, Report, Scenario, run_if_asked};
use lager_rig::ProcessError;
use lager_rig::proc::children;
use rustix::process::{Pid, Signal, kill_process};

fn main() {
    run_if_asked();
    macro_rules! named {
        ($($test:ident),* $(,)?) => { [$((stringify!($test), $test as fn())),*] };
    }
    // As under the standard harness, a word chooses the tests whose names contain it.
    let chosen = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    let chosen = chosen.unwrap_or_default();
    for (name, test) in named![
        a_hop_yields_every_row_once,
        a_killed_process_ends_the_measurement,
        what_cannot_be_measured_is_refused,
    ] {
        if name.contains(&chosen) {
            test();
            assert_eq!(left_behind(), Vec::<String>::new(), "after {name}");
            println!("test {name} ... ok");
        }
    }
}

fn options(modes: &[Mode], regime: Regime) -> Options {
    Options {
        runs: 1,
        quick: true,
        modes: modes.to_vec(),
        regimes: vec![regime],
    }
}

fn a_hop_yields_every_row_once() {
    // The cheapest measurement: one core, and no receiver spins.
    let report = Scenario::Hop
        .measure(&options(&[Mode::Block], Regime::SameCore))
        .expect("a report");
    let labels: Vec<String> = report
        .rows
        .iter()
        .filter(|row| row.what == "hop")
        .map(lager_benches::Row::label)
        .collect();
    let expected = "lager iceoryx2/event futex eventfd pipe uds tcp";
    let zenoh = if cfg!(feature = "zenoh") {
        " zenoh"
    } else {
        ""
    };
    assert_eq!(labels.join(" "), format!("{expected}{zenoh}"));
    for row in &report.rows {
        let times = [row.times.p50_ns, row.times.p90_ns, Some(row.times.max_ns)];
        assert!(row.times.n >= 200 && times.is_sorted(), "{row:?}");
    }
    let compared = |what: &str, label: &str, to: &str| {
        let mut rows = report.rows.iter();
        let row = rows.find(|row| row.what == what && row.label() == label);
        let mut ratios = row.into_iter().flat_map(|row| &row.ratios);
        ratios.any(|ratio| ratio.to == to && ratio.p50 > 0.0)
    };
    assert!(compared("hop", "lager", "futex"), "{report}");
    assert!(
        compared("ring-64", "lager/ring", "iceoryx2/notify"),
        "{report}"
    );
    let json = serde_json::to_string(&report).expect("names and numbers");
    let again: Report = serde_json::from_str(&json).expect("the same layout");
    assert_eq!(again, report);
    for line in report.to_string().lines() {
        assert!(line.chars().count() <= 100, "{line}");
    }
}

fn a_killed_process_ends_the_measurement() {
    let killer = std::thread::spawn(|| {
        loop {
            if let Some(child) = children(std::process::id()).first() {
                // At any point of its work.
                std::thread::sleep(Duration::from_millis(30));
                let child = Pid::from_raw(*child as i32).expect("not 0");
                if kill_process(child, Signal::KILL).is_ok() {
                    return;
                }
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    let ended = Scenario::Hop.measure(&options(&[Mode::Block], Regime::SameCore));
    killer.join().expect("the killer finds a process");
    assert!(
        matches!(ended, Err(BenchError::Process(ProcessError::Ended { .. }))),
        "{ended:?}"
    );
}

fn what_cannot_be_measured_is_refused() {
    let refused = Scenario::Hop.measure(&options(&[Mode::Spin], Regime::SameCore));
    assert!(
        matches!(refused, Err(BenchError::NothingToMeasure(_))),
        "{refused:?}"
    );
}

/// The shared memory and temporary files that measurements of this process have left.
fn left_behind() -> Vec<String> {
    let own = format!("{FAMILY}-{}-", std::process::id());
    [Path::new("/dev/shm"), &std::env::temp_dir()]
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.starts_with(&own))
        .collect()
}
