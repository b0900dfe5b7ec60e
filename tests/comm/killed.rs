//! Tests what a station that is killed has kept of its robots.

use std::fs;
use std::io::Write as _;
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use lager_tests::{Domain, pid};
use rustix::process::{Signal, kill_process};

use crate::station;

/// The most that may be lost, in ms.
const LOST_MS: u64 = 1_000;
/// How often the robot says something, in ms.
const SAYS_MS: u64 = 50;

/// The time of the last whole line with `words`, in ms since 1970.
fn last(history: &Path, words: &str) -> u64 {
    let parts = fs::read_dir(history).expect("a folder").flatten();
    let texts = parts.map(|part| fs::read_to_string(part.path()).expect("text"));
    let times = texts.flat_map(|text| {
        let whole = text
            .split_inclusive('\n')
            .filter(|line| line.ends_with('\n'));
        let told = whole.filter(|line| line.contains(words));
        let time = |line: &str| line.split(' ').nth(1)?.parse().ok();
        told.filter_map(time).collect::<Vec<u64>>()
    });
    times.max().expect("something is kept")
}

#[test]
fn a_station_that_is_killed_has_kept_all_but_the_last_second() {
    let domain = Domain::among_others();
    let (up, address) = station(&domain, &[]);
    let mut robot = TcpStream::connect(&address).expect("it listens");
    robot.write_all(b"lager 1 r1\n").expect("it hears");
    for number in 0..60 {
        let lines = format!("state x_mm={number}\nthought number {number}\n");
        robot.write_all(lines.as_bytes()).expect("it hears");
        std::thread::sleep(Duration::from_millis(SAYS_MS));
    }
    kill_process(pid(up.pid()), Signal::KILL).expect("it runs");
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .expect("a time");
    let killed_ms = u64::try_from(now.as_millis()).expect("a time");
    let history = domain.folder().join("warehouse.toml.history");
    for words in [" state x_mm=", " thought number "] {
        let kept_ms = last(&history, words);
        let lost_ms = killed_ms - kept_ms;
        assert!(
            lost_ms <= LOST_MS + 2 * SAYS_MS,
            "{words}: {lost_ms} ms are lost"
        );
    }
}
