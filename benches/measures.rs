//! Tests of the scenarios with their real processes, from the start to the report: whether they
//! measure what they say, end when a process dies, and leave nothing behind. No time is asserted.
//!
//! They do not use the standard test harness, because this program is also its own child processes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use lager_benches::{
    BenchError, FAMILY, Load, Mode, Options, Regime, Report, Scenario, Taken, run_if_asked,
};
use lager_rig::ProcessError;
use lager_rig::proc::children;
use rustix::process::{Pid, Signal, kill_process};

fn main() {
    run_if_asked();
    if std::env::var_os(UNDER_LOAD).is_some() {
        return under_load();
    }
    macro_rules! named {
        ($($test:ident),* $(,)?) => { [$((stringify!($test), $test as fn())),*] };
    }
    // As under the standard harness, a word chooses the tests whose names contain it.
    let chosen = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    let chosen = chosen.unwrap_or_default();
    for (name, test) in named![
        a_hop_yields_every_row_once,
        a_hop_of_any_size_is_measured_alone_and_beside_observers,
        a_load_is_named_and_has_the_floor_beside_it,
        no_load_stays_however_the_measurement_ends,
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
        modes: modes.to_vec(),
        regimes: vec![regime],
        ..Options::default()
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
    let expected = "lager lager/watcher iceoryx2/event futex eventfd pipe uds tcp";
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

fn a_hop_of_any_size_is_measured_alone_and_beside_observers() {
    for (size, samples, what) in [
        (4_096, 200, "hop@4KiB,2 observers"),
        (1 << 20, 20, "hop@1MiB,2 observers"),
    ] {
        let options = Options {
            size: Some(size),
            observers: Some(2),
            samples: Some(samples),
            ..options(&[Mode::Block], Regime::SameCore)
        };
        let report = Scenario::Hop.measure(&options).expect("a report");
        let labels: Vec<String> = report.rows.iter().map(lager_benches::Row::label).collect();
        let expected = "lager lager/observed iceoryx2/event pipe tcp";
        assert_eq!(labels.join(" "), expected);
        for row in &report.rows {
            assert_eq!((&*row.what, row.times.n), (what, 2 * samples as u64));
        }
        let ratios = &report.rows[1].ratios;
        assert!(ratios.iter().any(|ratio| ratio.to == "lager"), "{report}");
    }
}

/// Says to this program that it is to measure under load, and with which mark.
const UNDER_LOAD: &str = "LAGER_BENCH_UNDER_LOAD";

/// Says that it is to measure once, and to print the report.
const ONCE: &str = "LAGER_BENCH_ONCE";

/// A short hop beside the load that the programs in PATH make.
fn loaded() -> Options {
    Options {
        load: Some(Load::Cpu),
        samples: Some(100),
        ..options(&[Mode::Block], Regime::SameCore)
    }
}

fn under_load() {
    loop {
        match Scenario::Hop.measure(&loaded()) {
            Ok(report) if std::env::var_os(ONCE).is_some() => {
                let report = serde_json::to_string(&report).expect("names and numbers");
                return println!("{report}");
            }
            Ok(_) => {}
            Err(error) => {
                eprintln!("{error}");
                std::process::exit(1);
            }
        }
    }
}

/// Programs in the place of `stress-ng` and `cyclictest`, in a folder that goes with this.
struct StandIns(PathBuf);

impl StandIns {
    fn new() -> Self {
        use std::os::unix::fs::PermissionsExt;
        let name = format!("{FAMILY}-{}-stand-ins", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).expect("a folder");
        // Children that heed no signal but KILL, one of them in a session of its own and an orphan.
        let stress = "#!/bin/sh\ntrap '' INT TERM HUP\n(setsid sleep 1000 &)\nsleep 1000 &\n\
                      sleep 1000 &\nwhile :; do sleep 1; done\n";
        let cyclic = "#!/bin/sh\ntrap 'echo \"# Histogram\"; echo \"000050 001000\"; exit 0' INT\n\
                      while :; do sleep 0.05; done\n";
        for (name, text) in [("stress-ng", stress), ("cyclictest", cyclic)] {
            let path = folder.join(name);
            std::fs::write(&path, text).expect("a file");
            let may_run = std::fs::Permissions::from_mode(0o755);
            std::fs::set_permissions(&path, may_run).expect("it is this user's");
        }
        Self(folder)
    }

    /// This program, measuring under their load. Every process below has the mark in its environment.
    fn measured(&self, mark: &str) -> Command {
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new(std::env::current_exe().expect("a path"));
        command
            .env(UNDER_LOAD, mark)
            .env("PATH", format!("{}:{path}", self.0.display()));
        command
    }
}

impl Drop for StandIns {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The processes with that mark, by what they run.
fn marked(mark: &str) -> Vec<(u32, String)> {
    let variable = format!("{UNDER_LOAD}={mark}");
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let of = |pid: u32| {
        let environment = std::fs::read(format!("/proc/{pid}/environ")).ok()?;
        let mut variables = environment.split(|byte| *byte == 0);
        variables.find(|one| *one == variable.as_bytes())?;
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        Some((pid, String::from_utf8_lossy(&words).replace('\0', " ")))
    };
    pids.filter_map(of).collect()
}

fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < Duration::from_secs(120), "no {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn a_load_is_named_and_has_the_floor_beside_it() {
    let stand_ins = StandIns::new();
    let mark = format!("{}-floor", std::process::id());
    let printed = stand_ins.measured(&mark).env(ONCE, "1").output();
    let printed = printed.expect("it runs");
    let said = String::from_utf8_lossy(&printed.stdout);
    let report: Report = serde_json::from_str(&said).unwrap_or_else(|error| {
        panic!(
            "{error}: {said}{}",
            String::from_utf8_lossy(&printed.stderr)
        )
    });
    let hop = &report.rows[0];
    assert_eq!((&*hop.what, &*hop.name), ("hop under cpu", "lager"));
    let to_floor = hop.ratios.iter().find(|ratio| ratio.to == "cyclictest");
    assert!(to_floor.is_some_and(|ratio| ratio.p50 > 0.0), "{report}");
    let floor = report.rows.iter().find(|row| row.what == "floor under cpu");
    let floor = floor.expect("its floor").times;
    assert_eq!((floor.n, floor.max_ns), (1_000, 50_000));
    wait_for("quiet", || marked(&mark).is_empty());
    // Without them, it says what to install.
    let nothing = stand_ins.measured(&mark).env("PATH", "/nowhere").output();
    let said = nothing.expect("it runs").stderr;
    assert!(String::from_utf8_lossy(&said).contains("apt-get install stress-ng"));
}

fn no_load_stays_however_the_measurement_ends() {
    let stand_ins = StandIns::new();
    for (end, signal) in [
        ("Ctrl-C", Signal::INT),
        ("TERM", Signal::TERM),
        ("KILL", Signal::KILL),
        ("silence", Signal::STOP),
    ] {
        let mark = format!("{}-{end}", std::process::id());
        let mut bench = stand_ins.measured(&mark).spawn().expect("it starts");
        let is_there = |word: &str| marked(&mark).iter().any(|(_, words)| words.contains(word));
        wait_for("load", || is_there("sleep 1000") && is_there("cyclictest"));
        let own = Pid::from_child(&bench);
        if end == "silence" {
            // A process of the measurement stands still, so it gives up.
            wait_for("receiver", || child_named(bench.id(), RECEIVER).is_some());
            let receiver = child_named(bench.id(), RECEIVER).expect("it measures");
            kill_process(receiver, signal).expect("it is there");
        } else {
            kill_process(own, signal).expect("it is there");
        }
        bench.wait().expect("it ends");
        wait_for(end, || marked(&mark).is_empty());
        let folder = format!("{FAMILY}-{}-load", bench.id());
        wait_for("folder's end", || {
            !std::env::temp_dir().join(&folder).exists()
        });
    }
}

/// Ten thousand samples a second, and a receiver that stands still for 50 ms.
fn a_stall_hurts_every_sample_that_was_due_meanwhile() {
    const STALL: Duration = Duration::from_millis(50);
    let (tell, told) = std::sync::mpsc::channel();
    let stalling = std::thread::spawn(move || {
        // In the middle of a round: each takes two seconds.
        std::thread::sleep(Duration::from_secs(3));
        let receiver = child_named(std::process::id(), RECEIVER).expect("it measures");
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

const RECEIVER: &str = "receiver of the hop";

/// The child of a process that does the named work.
fn child_named(parent: u32, name: &str) -> Option<Pid> {
    let variable = format!("LAGER_PROCESS={name}");
    let is_it = |child: &u32| {
        let variables = std::fs::read(format!("/proc/{child}/environ")).unwrap_or_default();
        let mut variables = variables.split(|byte| *byte == 0);
        variables.any(|one| one == variable.as_bytes())
    };
    let child = children(parent).into_iter().find(is_it)?;
    Pid::from_raw(child.cast_signed())
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
