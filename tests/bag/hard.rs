//! Tests that a recorder survives hard conditions: the same signal twice, kills at any moment, a
//! full disk beside a robot that drives, a queue that is too short, and 10 000 frames a second.
//! `tests/soak bag` runs the kills and the frames for longer. Only there their bounds are asserted,
//! because they need the whole machine.

use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_ports::Cause;
use lager_tests::{Domain, lager, wait_for};
use lager_topics::{LineFrame, SensorLine};
use rustix::process::Signal;
use serde_json::Value;

use crate::{Noisy, done, end, guest, info, must_be_right, must_be_swept, read, recorder, said};

/// The most that a `kill -9` may cost: the samples of this time.
const LOST_BY_A_KILL: Duration = Duration::from_millis(300);

/// The number that `tests/soak bag` gives for `what`; `None` if the soak does not run.
fn soak(what: &str) -> Option<u64> {
    std::env::var(what).ok()?.parse().ok()
}

/// Waits until that moment, and gives its core away only for short times.
fn until(moment: Instant) {
    let left = moment.saturating_duration_since(Instant::now());
    std::thread::sleep(left);
}

#[test]
fn a_recorder_that_gets_one_signal_twice_ends_in_order() {
    let domain = Domain::new();
    let bus = guest(&domain);
    for number in 0..5 {
        let mut noisy = Noisy::new(&bus);
        let file = format!("{number}.mcap");
        let mut recorder = recorder(&domain, &["--topic", "noise/now", &file]);
        noisy.meet(&recorder);
        for pause in [2, 0] {
            recorder.signal(Signal::INT);
            std::thread::sleep(Duration::from_millis(pause));
        }
        assert_eq!(recorder.wait(), Some(0), "{}", recorder.log());
        must_be_right(&domain, &file);
    }
    drop(bus);
    must_be_swept(&domain);
}

#[test]
fn a_kill_at_any_moment_takes_what_came_since_the_last_flush() {
    let kills = soak("LAGER_SOAK_BAG_KILLS");
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut taken = Vec::new();
    for kill in 0..kills.unwrap_or(3) {
        let mut noisy = Noisy::new(&bus);
        let file = format!("{kill}.mcap");
        let mut recorder = recorder(&domain, &["--topic", "noise/now", &file]);
        noisy.meet(&recorder);
        // Each kill comes at another point between two flushes, which come every 150 ms.
        let end = Instant::now() + Duration::from_millis(450 + kill * 617 % 400);
        let mut next = Instant::now();
        while next < end {
            noisy.send();
            next += Duration::from_millis(2);
            until(next);
        }
        let killed_ns = Clock::monotonic_ns();
        recorder.signal(Signal::KILL);
        recorder.wait();
        let copy = format!("{kill}.copy.mcap");
        done(&domain, &["bag", "recover", &file, "--output", &copy]);
        let seen = read(&domain.folder().join(&copy));
        let (_, last, ..) = seen.messages.last().expect("samples");
        let lost = Duration::from_nanos(killed_ns - last.publish_time_ns);
        assert!(last.sequence < noisy.sent);
        taken.push(lost);
        let _ = fs::remove_file(domain.folder().join(&file));
        let _ = fs::remove_file(domain.folder().join(&copy));
    }
    taken.sort();
    let longest = *taken.last().expect("kills");
    println!(
        "{} kills took {:.0} ms of samples at the median, {:.0} ms at the most",
        taken.len(),
        taken[taken.len() / 2].as_secs_f64() * 1e3,
        longest.as_secs_f64() * 1e3
    );
    if kills.is_some() {
        assert!(longest <= LOST_BY_A_KILL, "a kill took {longest:?}");
    }
    drop(bus);
    must_be_swept(&domain);
}

/// Starts `lager bag record` with `args` onto a disk of `kib` KiB of its own. A copy of the
/// recording is left as `full.mcap`. The disk is removed when the recorder ends.
pub(crate) fn record_on_a_small_disk(domain: &Domain, kib: u32, args: &[&str]) -> Child {
    fs::create_dir(domain.folder().join("disk")).expect("a folder");
    let script = format!(
        "mount -t tmpfs -o size={kib}k none disk || exit 99; \"$@\"; code=$?; \
         cp disk/full.mcap full.mcap; exit $code"
    );
    Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script, "sh"])
        .arg(lager())
        .arg("--bus")
        .arg(domain.bus_folder())
        .args(["bag", "record", "disk/full.mcap"])
        .args(args)
        .current_dir(domain.folder())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("`unshare` is there")
}

/// Asserts that a recorder on such a disk has ended, says why, and has left a correct file.
pub(crate) fn must_have_filled_its_disk(domain: &Domain, recorder: Child) {
    let output = recorder.wait_with_output().expect("a child");
    let told = said(&output);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("the disk is full"), "{told}");
    must_be_right(domain, "full.mcap");
}

/// Starts `lager bag record` with `args` where no file may be longer than `blocks` blocks of 512
/// bytes.
fn record_with_short_files(domain: &Domain, blocks: u32, args: &[&str]) -> Child {
    Command::new("sh")
        .args(["-c", &format!("ulimit -f {blocks} && exec \"$@\""), "sh"])
        .arg(lager())
        .arg("--bus")
        .arg(domain.bus_folder())
        .args(["bag", "record"])
        .args(args)
        .current_dir(domain.folder())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a shell")
}

#[test]
fn a_file_that_may_not_become_longer_ends_whole_and_kills_nobody() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let args = ["long.mcap", "--topic", "noise/now"];
    let mut recorder = record_with_short_files(&domain, 8_192, &args);
    wait_for("the file to be as long as it may", || {
        (0..4).for_each(|_| noisy.send());
        recorder.try_wait().expect("a child")
    });
    let output = recorder.wait_with_output().expect("a child");
    let told = said(&output);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(
        told.contains("may not become longer (`ulimit -f`"),
        "{told}"
    );
    must_be_right(&domain, "long.mcap");
    let long = fs::metadata(domain.folder().join("long.mcap")).expect("a file");
    assert!(long.len() <= 4 << 20, "{}", long.len());

    // If not even the bus's own files may have their length, the recorder does not begin.
    let none = record_with_short_files(&domain, 16, &["--wait", "none.mcap"]);
    let none = none.wait_with_output().expect("a child");
    let told = said(&none);
    assert_eq!(none.status.code(), Some(1), "{told}");
    assert!(
        told.contains("files of this process may have 8 KiB"),
        "{told}"
    );
    drop((noisy, bus));
    domain.assert_clean();
}

#[test]
fn a_file_that_somebody_removes_is_told_at_once_and_is_no_success() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let mut recorder = recorder(&domain, &["--topic", "noise/now", "gone.mcap"]);
    noisy.meet(&recorder);
    let file = domain.folder().join("gone.mcap");
    fs::remove_file(&file).expect("it records into it");
    wait_for("another file, and a word of it", || {
        noisy.send();
        let is_told = recorder.log().contains("was removed while it was recorded");
        (file.is_file() && is_told).then_some(())
    });
    (0..10).for_each(|_| noisy.send());
    recorder.signal(Signal::TERM);
    assert_eq!(recorder.wait(), Some(1), "{}", recorder.log());
    assert!(
        recorder
            .log()
            .contains("the recording goes on in gone.mcap"),
        "{}",
        recorder.log()
    );
    must_be_right(&domain, "gone.mcap");
    drop((noisy, bus));
    domain.assert_clean();
}

#[test]
fn a_robot_delivers_while_the_disk_of_its_recorder_fills_up() {
    let domain = Domain::new();
    let mut recorder = record_on_a_small_disk(&domain, 1_536, &["--wait"]);
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1",
        "--speed",
        "4",
        "--exit-when-done",
        "--json",
        "--no-station",
    ]);
    wait_for("the disk to be full", || {
        recorder.try_wait().expect("a child")
    });
    // The mission still runs, so the recorder ended before the robot did.
    assert!(up.is_running(), "{}", up.log());
    must_have_filled_its_disk(&domain, recorder);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    assert_eq!(up.json()["delivered"], serde_json::json!([1]));
    let seen = read(&domain.folder().join("full.mcap"));
    assert!(seen.messages.len() > 500, "{}", seen.messages.len());
    domain.assert_clean();
}

#[test]
fn what_finds_the_queue_full_is_told_live_and_in_the_file() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let args = ["--topic", "noise/now", "--queue", "10", "slow.mcap"];
    let recorder = recorder(&domain, &args);
    noisy.meet(&recorder);
    // Many more samples within one flush than the queue's ten.
    for _ in 0..10 {
        (0..40).for_each(|_| noisy.send());
        std::thread::sleep(Duration::from_millis(20));
    }
    // The recorder prints its live line once a second.
    let live = wait_for("the live line", || {
        let said = recorder.output();
        let progress: Value = serde_json::from_str(said.lines().last()?).ok()?;
        progress["topics"][0]["dropped"]
            .as_u64()
            .filter(|dropped| *dropped > 0)
    });
    assert!(
        recorder.log().contains("the disk is too slow"),
        "{}",
        recorder.log()
    );
    let told = end(recorder);
    let count = &told["topics"][0];
    let [received, lost, dropped] =
        ["received", "lost", "dropped"].map(|what| count[what].as_u64().expect("a number"));
    assert!(dropped >= live && dropped > 100, "{told}");

    let seen = read(&domain.folder().join("slow.mcap"));
    assert_eq!(seen.messages.len() as u64, received - dropped, "{told}");
    let numbers: Vec<u64> = seen
        .messages
        .iter()
        .map(|(_, stamp, ..)| stamp.sequence)
        .collect();
    let skipped = numbers
        .windows(2)
        .map(|pair| pair[1] - pair[0] - 1)
        .sum::<u64>();
    let behind = noisy.sent - 1 - numbers.last().expect("samples");
    assert_eq!(skipped + behind, lost + dropped, "{told}");
    let info = info(&domain, "slow.mcap");
    assert_eq!(
        info["topics"][0]["dropped"].as_u64(),
        Some(dropped),
        "{info}"
    );
    let checked = must_be_right(&domain, "slow.mcap");
    assert!(
        checked.contains(&format!("{dropped} dropped by it")),
        "{checked}"
    );
    drop((noisy, bus));
    domain.assert_clean();
}

#[test]
fn ten_thousand_frames_a_second_are_all_recorded_or_counted() {
    let seconds = soak("LAGER_SOAK_BAG_SECONDS");
    let domain = Domain::new();
    let bus = guest(&domain);
    let lines = bus.publisher::<SensorLine>().expect("a topic");
    let recorder = recorder(&domain, &["--topic", "sensor/line", "fast.mcap"]);
    // The recorder finds this writer at its next look.
    std::thread::sleep(Duration::from_millis(300));
    let frames = seconds.unwrap_or(2) * 10_000;
    let begun = Instant::now();
    for packet in 0..frames {
        let line = LineFrame {
            packet_id: (packet % 16) as u8,
            ..LineFrame::default()
        };
        lines.send(Cause::OWN, line).expect("a sample");
        let due = begun + Duration::from_micros((packet + 1) * 100);
        // At most two samples in a row, even if this machine sleeps too long.
        if due > Instant::now() + Duration::from_micros(100) {
            std::thread::sleep(Duration::from_micros(60));
        }
        while Instant::now() < due {
            std::hint::spin_loop();
        }
    }
    let took = begun.elapsed();
    std::thread::sleep(Duration::from_millis(300));
    end(recorder);
    let info = info(&domain, "fast.mcap");
    let topic = &info["topics"][0];
    let [messages, lost, dropped] =
        ["messages", "lost", "dropped"].map(|what| topic[what].as_u64().expect("a number"));
    println!("{frames} frames in {took:?}: {messages} in the file, {lost} lost, {dropped} dropped");
    assert_eq!(messages + lost + dropped, frames, "{info}");
    must_be_right(&domain, "fast.mcap");
    if seconds.is_some() {
        assert_eq!((lost, dropped), (0, 0), "{info}");
    }
    drop((lines, bus));
    domain.assert_clean();
}
