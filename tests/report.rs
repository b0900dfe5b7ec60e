//! Tests that `lager report` packs what tells of a fault, whatever state the robot is in, and
//! nothing that is secret.

use std::fs;
use std::io::Read as _;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use lager_tests::{Domain, Running, is_stopped, pid, wait_for};
use rustix::process::{Signal, kill_process};

/// Secrets with everything at which a pattern may stop, and with a word that nothing else has.
const SECRET: &str = "MarkedRobotSecret0123456789abcdefghijk";
const TOKEN: &str = "marked \"token\" with=blanks";
const WIFI: &str = "Marked Network's name";
const PASSWORD: &str = "marked pass word: x=\"y\"";
const ADDRESS: &str = "b8:27:eb:4d:41:52";
const PERSON: &str = "markedperson";
const MARKS: [&str; 9] = [
    SECRET,
    TOKEN,
    "with=blanks",
    WIFI,
    "Network's",
    PASSWORD,
    "pass word",
    ADDRESS,
    PERSON,
];

fn said(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{out}{err}")
}

/// The files in a report, without the name of its folder.
fn unpacked(path: &Path) -> Vec<(String, String)> {
    let file = fs::File::open(path).expect("a report");
    let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(file));
    let entries = archive.entries().expect("an archive");
    let files = entries.map(|entry| {
        let mut entry = entry.expect("whole");
        let path = entry.path().expect("a path").display().to_string();
        let (_, name) = path.split_once('/').expect("in a folder");
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("whole");
        (name.to_owned(), String::from_utf8(bytes).expect("text"))
    });
    files.collect()
}

fn text<'a>(files: &'a [(String, String)], name: &str) -> &'a str {
    let found = files.iter().find(|(file, _)| file == name);
    let names: Vec<&String> = files.iter().map(|(name, _)| name).collect();
    found.map_or_else(|| panic!("no {name} in {names:?}"), |(_, text)| text)
}

/// A folder whose `journalctl` tells of the services, with secrets among it.
fn journal(domain: &Domain) -> PathBuf {
    let folder = domain.folder().join("bin");
    fs::create_dir(&folder).expect("a folder");
    let program = folder.join("journalctl");
    let lines = [
        "2026-11-28T20:00:00 lager[7]: up: the journal of a fault".to_owned(),
        format!("2026-11-28T20:00:01 lager[7]: GET /?token={TOKEN}"),
        format!("2026-11-28T20:00:02 lager[7]: joined SSID {WIFI} with psk {PASSWORD}"),
        format!("2026-11-28T20:00:03 lager[7]: from {ADDRESS}, as {PERSON}"),
        format!("2026-11-28T20:00:04 lager[7]: proof of {SECRET}"),
    ];
    let script = format!("#!/bin/sh\ncat <<'END'\n{}\nEND\n", lines.join("\n"));
    fs::write(&program, script).expect("a program");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("its mode");
    folder
}

/// `lager report` among secrets in its environment.
fn report(domain: &Domain, bin: Option<&Path>, args: &[&str]) -> Command {
    let mut report = domain.lager(&[&["report"][..], args].concat());
    report
        .env("HOME", format!("/home/{PERSON}"))
        .env("STATION_TOKEN", TOKEN)
        .env("WIFI_SSID", WIFI)
        .env("WIFI_PASSWORD", PASSWORD);
    if let Some(bin) = bin {
        let path = std::env::var("PATH").expect("a path");
        report.env("PATH", format!("{}:{path}", bin.display()));
    }
    report
}

fn robot(domain: &Domain, args: &[&str]) -> Running {
    let up = domain.start(&[&["up", "--listen", "127.0.0.1:0"][..], args].concat());
    wait_for("a robot under way", || {
        let frame = domain.run(&["topic", "echo", "sensor/line", "--count", "1"]);
        (up.service("logic").is_some() && frame.status.success()).then_some(())
    });
    up
}

#[test]
fn a_report_tells_of_a_fault_and_of_no_secret_wherever_one_stands() {
    let domain = Domain::new();
    let file = |name: &str| domain.folder().join(name);
    let secret = file("secrets");
    let mut options = fs::OpenOptions::new();
    let mut to = options
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(&secret)
        .expect("a file");
    std::io::Write::write_all(&mut to, format!("r1 {SECRET}\n").as_bytes()).expect("room");
    let log = file("robot.txt");
    let lines = [
        format!("{{\"fields\":{{\"message\":{TOKEN:?},\"error\":\"a fault\"}}}}"),
        format!("network {{ ssid=\"{WIFI}\" psk=\"{PASSWORD}\" }}"),
        format!("-----BEGIN PRIVATE KEY-----\n{SECRET}\n-----END PRIVATE KEY-----"),
        format!("cannot open /home/{PERSON}/hall.toml at {ADDRESS}"),
        "an error that tells of a fault".to_owned(),
    ];
    fs::write(&log, lines.join("\n") + "\n").expect("a log");
    let secret = secret.to_str().expect("UTF-8");
    let up = robot(&domain, &["--secret", secret, "--panel", "127.0.0.1:0"]);
    // The panel's tokens are secrets that nobody has chosen.
    let panel = wait_for("the panel's address", || {
        let told = up.log() + &up.output();
        let (_, rest) = told.split_once("?token=")?;
        Some(
            rest.chars()
                .take_while(char::is_ascii_alphanumeric)
                .collect::<String>(),
        )
    });
    assert!(panel.len() > 20, "{panel}");
    fs::write(
        &log,
        fs::read_to_string(&log).expect("a log") + &format!("opened {panel}\n"),
    )
    .expect("a log");
    wait_for("events", || {
        let history = domain.bus_folder().join(".state/r1/history");
        let mut files = fs::read_dir(history).ok()?.flatten();
        files.find(|file| file.file_name().to_string_lossy().starts_with("events-"))
    });
    let bin = journal(&domain);
    let out = file("fault.tar.gz");
    let log = log.to_str().expect("UTF-8");
    let mut report = report(
        &domain,
        Some(&bin),
        &["--out", "fault.tar.gz", "--log", log],
    );
    let told = report.output().expect("lager starts");
    assert!(told.status.success(), "{}", said(&told));
    let files = unpacked(&out);
    let mut all = said(&told);
    for (name, text) in &files {
        all += name;
        all += text;
    }
    for mark in MARKS.into_iter().chain([panel.as_str()]) {
        let escaped = mark.replace('"', "\\\"");
        let twice = escaped.replace('\\', "\\\\");
        let percent = mark.replace(' ', "%20").replace('"', "%22");
        for form in [mark, &escaped, &twice, &percent] {
            let at = all.find(form).map(|at| &all[at.saturating_sub(200)..at]);
            assert_eq!(at, None, "{form:?} is in the report");
        }
    }
    let raw = fs::read(&out).expect("a report");
    assert!(
        !raw.windows(SECRET.len())
            .any(|piece| piece == SECRET.as_bytes())
    );
    // Only its owner may read it, and it still tells of the fault.
    assert_eq!(
        fs::metadata(&out).expect("a report").permissions().mode() & 0o777,
        0o600
    );
    for (name, words) in [
        ("report.txt", "marked \"(left out)\""),
        ("versions.txt", "iceoryx2"),
        ("versions.txt", "steering board protocol 1"),
        ("doctor.txt", "shared memory"),
        ("robot.txt", "bridge is process"),
        ("config.toml", "cruise_mm_per_s"),
        ("running.toml", "body = \"sim\""),
        ("link-health.json", "steering"),
        ("journal.txt", "the journal of a fault"),
        ("log.txt", "an error that tells of a fault"),
        ("state/r1/history/events.txt", "r1"),
    ] {
        assert!(
            text(&files, name).contains(words),
            "{name}: {}",
            text(&files, name)
        );
    }
    drop(up);
}

#[test]
fn a_report_needs_neither_a_robot_nor_a_state_folder_and_overwrites_nothing() {
    let domain = Domain::new();
    let mut command = report(&domain, None, &[]);
    let state = domain.folder().join("nowhere");
    command.arg("--state").arg(&state);
    let told = command.output().expect("lager starts");
    assert!(told.status.success(), "{}", said(&told));
    assert!(!state.exists(), "a report makes no folder");
    let reports = || {
        let files = fs::read_dir(domain.folder()).expect("a folder").flatten();
        let is_it = |path: &PathBuf| path.extension().is_some_and(|end| end == "gz");
        files
            .map(|file| file.path())
            .filter(is_it)
            .collect::<Vec<_>>()
    };
    let [path] = &reports()[..] else {
        panic!("{:?}", reports());
    };
    let files = unpacked(path);
    let first = text(&files, "report.txt");
    for missing in [
        "running.toml",
        "link-health.json",
        "state (",
        "recording.jsonl",
    ] {
        assert!(first.contains(missing), "{missing}: {first}");
        assert!(said(&told).contains(missing), "{missing}: {}", said(&told));
    }
    assert!(text(&files, "robot.txt").contains("no robot is up"));
    let before = fs::read(path).expect("a report");
    let again = report(&domain, None, &["--out", path.to_str().expect("UTF-8")]).output();
    let again = again.expect("lager starts");
    assert!(
        !again.status.success() && said(&again).contains("--out"),
        "{}",
        said(&again)
    );
    assert_eq!(fs::read(path).expect("a report"), before);
}

#[test]
fn a_report_of_a_frozen_robot_says_so_and_has_the_end_of_its_recording() {
    let domain = Domain::new();
    let up = robot(&domain, &["--headless"]);
    let record = domain.start(&["bag", "record"]);
    let recording = wait_for("a recording", || {
        let files = fs::read_dir(domain.folder()).expect("a folder").flatten();
        let is_it = |path: &PathBuf| path.extension().is_some_and(|end| end == "mcap");
        let mut files = files.map(|file| file.path()).filter(is_it);
        files.find(|file| file.metadata().is_ok_and(|file| file.len() > 200_000))
    });
    let bridge = up.service("bridge").expect("a bridge");
    for process in [up.pid(), bridge] {
        kill_process(pid(process), Signal::STOP).expect("a living process");
        wait_for("it to stop", || is_stopped(process).then_some(()));
    }
    let told = report(&domain, None, &["--out", "frozen.tar.gz"]).output();
    for process in [bridge, up.pid()] {
        kill_process(pid(process), Signal::CONT).expect("a living process");
    }
    let told = told.expect("lager starts");
    assert!(told.status.success(), "{}", said(&told));
    let files = unpacked(&domain.folder().join("frozen.tar.gz"));
    let robot = text(&files, "robot.txt");
    assert!(
        robot.contains(&format!("process {bridge}, frozen")),
        "{robot}"
    );
    assert!(!said(&told).contains("recording.jsonl"), "{}", said(&told));
    let end = text(&files, "recording.jsonl");
    let lines: Vec<serde_json::Value> = end
        .lines()
        .map(|line| serde_json::from_str(line).expect("a line of JSON"))
        .collect();
    let times: Vec<&str> = lines
        .iter()
        .filter_map(|line| line["at"].as_str())
        .collect();
    assert!(times.is_sorted(), "the oldest first");
    assert!(
        lines.iter().any(|line| line["topic"] == "sensor/line"),
        "{}",
        recording.display()
    );
    drop((record, up));
}
