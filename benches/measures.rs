//! Tests of the scenarios with their real processes, from the start to the report: whether they
//! measure what they say, end when a process dies, and leave nothing behind. No time is asserted.
//!
//! They do not use the standard test harness, because this program is also its own child processes.

use std::path::Path;
use std::time::Duration;

use lager_benches::{
    BenchError, FAMILY, Mode, Options, Regime, Report, Scenario, Taken, run_if_asked,
};
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
        a_stall_hurts_every_sample_that_was_due_meanwhile,
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
        samples: None,
        cores: None,
        pace: None,
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
    // The runs stay out of it.
    assert_eq!(serde_json::to_string(&again).expect("the same"), json);
    for line in report.to_string().lines() {
        assert!(line.chars().count() <= 100, "{line}");
    }
}

/// Ten thousand samples a second, and a receiver that stands still for 50 ms.
fn a_stall_hurts_every_sample_that_was_due_meanwhile() {
    const STALL: Duration = Duration::from_millis(50);
    let (tell, told) = std::sync::mpsc::channel();
    let stalling = std::thread::spawn(move || {
        // In the middle of a round: each takes two seconds.
        std::thread::sleep(Duration::from_secs(3));
        let receiver = named("receiver of the hop");
        let signal = |signal| kill_process(receiver, signal).expect("it measures");
        signal(Signal::STOP);
        std::thread::sleep(STALL);
        signal(Signal::CONT);
        tell.send(()).expect("the measurement waits");
    });
    let options = Options {
        samples: Some(20_000),
        ..options(&[Mode::Adaptive], Regime::Plain)
    };
    let mut groups = Scenario::Hop.groups(&options).into_iter();
    let paced = groups.find(|group| group.what == "hop@10kHz");
    let mut session = paced.expect("it is measured").open().expect("it opens");
    let mut taken = Vec::new();
    // The round may have begun late, on a busy machine.
    while taken.len() < 2 || told.try_recv().is_err() {
        taken.push(session.round(0, 20_000).expect("samples"));
    }
    stalling.join().expect("the receiver was found");
    let at_least = |limit: Duration, times: fn(&Taken) -> &Vec<u64>| {
        let all = taken.iter().flat_map(times);
        all.filter(|ns| u128::from(**ns) >= limit.as_nanos())
            .count()
    };
    // One sample was on its way, and each that was due meanwhile is as late as it had to wait.
    assert!(at_least(STALL / 2, |taken| &taken.service) >= 1);
    assert!(at_least(STALL / 2, |taken| &taken.response) >= 240);
    assert!(at_least(STALL / 50, |taken| &taken.response) >= 480);
    for taken in &taken {
        let all = [taken.service.len(), taken.response.len()];
        assert_eq!(
            (all, taken.disordered),
            ([20_000; 2], 0),
            "nothing is left out"
        );
    }
}

/// The child that does the named work.
fn named(name: &str) -> Pid {
    let variable = format!("LAGER_PROCESS={name}");
    let is_it = |child: &u32| {
        let variables = std::fs::read(format!("/proc/{child}/environ")).unwrap_or_default();
        let mut variables = variables.split(|byte| *byte == 0);
        variables.any(|one| one == variable.as_bytes())
    };
    let child = children(std::process::id()).into_iter().find(is_it);
    Pid::from_raw(child.expect("it measures").cast_signed()).expect("not 0")
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
