//! Attacks that fill the memory or the disk of a robot.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lager_tests::{Domain, children, lager, pid, wait_for};
use rustix::process::{Signal, kill_process};

use crate::boards::Boards;
use crate::harm::files;
use crate::{AttackResult, BACK, report};

/// A robot in a mount namespace of its own, so that a full disk is full for this robot alone. Its
/// output goes to `log`, a path below the domain's folder.
fn in_its_own_mounts(domain: &Domain, log: &str) -> Child {
    let script = r#"
        mount -t tmpfs -o size=24m tmpfs /dev/shm
        mkdir -p -m 700 /dev/shm/bus
        mkdir disk
        mount -t tmpfs -o size=1m tmpfs disk
        exec "$1" --bus /dev/shm/bus --config "$2" up --script --mission 1 2>"$3""#;
    Command::new("unshare")
        .args(["--mount", "sh", "-ec", script, "sh"])
        .arg(lager())
        .arg(domain.folder().join("robot.toml"))
        .arg(log)
        .current_dir(domain.folder())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("`unshare` is there")
}

/// Runs a command in the mounts of `robot`; returns whether it succeeded. Panics if it hangs.
fn enters(robot: u32, command: &[&str]) -> bool {
    // The exit codes of `timeout` for a command that it had to end.
    const ENDED: [i32; 2] = [124, 137];
    let status = Command::new("timeout")
        .args(["-k", "1", "5", "nsenter", "--mount", "--wd", "--target"])
        .arg(robot.to_string())
        .args(command)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("`nsenter` is there");
    let hung = status.code().is_some_and(|code| ENDED.contains(&code));
    assert!(!hung, "{command:?} hangs");
    status.success()
}

/// A process that does nothing but keep the mounts of another process alive.
fn stays_in(robot: u32) -> Child {
    Command::new("nsenter")
        .args(["--mount", "--target"])
        .arg(robot.to_string())
        .args(["sleep", "600"])
        .stdin(Stdio::null())
        .spawn()
        .expect("`nsenter` is there")
}

fn has_argument(process: u32, wanted: &[u8]) -> bool {
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split(|byte| *byte == 0).any(|word| word == wanted)
}

/// Fills `full`, kills the bridge meanwhile, and makes room again.
fn fill(full: &str, log: &str) -> AttackResult {
    let domain = Domain::new();
    let boards = Boards::start(&domain);
    let mut robot = in_its_own_mounts(&domain, log);
    let id = robot.id();
    let binary = lager();
    let tool = |words: &[&str]| {
        let binary = binary.to_str().expect("UTF-8");
        enters(id, &[&[binary, "--bus", "/dev/shm/bus"], words].concat())
    };
    let answers = || tool(&["topic", "echo", "sensor/line", "--count", "1"]);
    // Until `unshare` has become the robot, its mounts are those of this process.
    wait_for("the robot's process", || {
        has_argument(id, b"up").then_some(())
    });
    let mut witness = stays_in(id);
    wait_for("the stop to be released", || {
        tool(&["resume"]).then_some(())
    });
    wait_for("the robot to drive", || boards.watch.runs().then_some(()));

    let all = format!("head -c 64M /dev/zero >{full}");
    assert!(
        !enters(id, &["sh", "-c", &all]),
        "there was room for all of it"
    );
    // New processes find no room; the running ones continue.
    let filled = Instant::now();
    while filled.elapsed() < Duration::from_secs(3) {
        answers();
    }
    // A killed service's successor finds no room either.
    let services = children(id);
    if let Some(bridge) = services
        .iter()
        .find(|child| has_argument(**child, b"bridge"))
    {
        let _ = kill_process(pid(*bridge), Signal::KILL);
        wait_for("the motors to stand", || {
            (!boards.watch.runs()).then_some(())
        });
        std::thread::sleep(Duration::from_secs(1));
    }
    enters(id, &["rm", "-f", full]);
    let room = Instant::now();
    let said = loop {
        if let Some(status) = robot.try_wait().expect("a child") {
            assert_ne!(status.code(), Some(0));
            let log = fs::read_to_string(domain.folder().join(log)).unwrap_or_default();
            let why = log.lines().last().unwrap_or_default().to_owned();
            assert!(
                full != "/dev/shm/full" || !why.is_empty(),
                "{full}: no reason"
            );
            break format!("ended ({status}): {why}");
        }
        if answers() {
            break "up".to_owned();
        }
        assert!(room.elapsed() < BACK, "{full}: neither up nor ended");
    };
    let took = room.elapsed();
    let _ = kill_process(pid(id), Signal::INT);
    wait_for("its end", || robot.try_wait().expect("a child"));
    wait_for("the motors to stand", || {
        (!boards.watch.runs()).then_some(())
    });
    let memory = PathBuf::from(format!("/proc/{}/root/dev/shm", witness.id()));
    let binary = binary.to_str().expect("UTF-8");
    enters(
        witness.id(),
        &[binary, "--bus", "/dev/shm/bus", "doctor", "--fix"],
    );
    let mut left = files(&memory);
    // The stop of a stopped robot stays.
    left.retain(|file| !file.ends_with("stop"));
    let _ = witness.kill();
    let _ = witness.wait();
    assert!(left.is_empty(), "{full}: left {left:#?}");
    AttackResult {
        what: format!("{full}, and the bridge killed"),
        said,
        took,
        unsteered: boards.watch.unsteered(),
    }
}

#[test]
#[ignore = "mounts file systems, which needs root; `tests/soak attack` runs it"]
fn a_full_memory_and_a_full_disk_are_survived_or_said() {
    for (full, log) in [("/dev/shm/full", "log"), ("disk/full", "disk/log")] {
        report(&[fill(full, log)]);
    }
}
