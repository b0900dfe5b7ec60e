//! Tests that one name has one robot: which second process is refused, which files the refusal
//! names, and how the files are removed when their processes hang or are dead.

use std::fs;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use lager_home::Home;
use lager_rig::Cable;
use lager_tests::{Domain, Running, WATCHDOG, children, has_ended, lager, pid, wait_for};
use rustix::process::{Signal, kill_process};

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a command until it ends; a command that hangs fails the test.
fn to_its_end(mut command: Command) -> Output {
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > WATCHDOG / 4 {
            let _ = child.kill();
            panic!("{command:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().expect("its output")
}

fn home(domain: &Domain) -> Home {
    domain.bus("r1", 1.0).home().expect("the bus's folder")
}

/// A simulated robot that drives.
fn robot(domain: &Domain) -> Running {
    let up = domain.start(&["up", "--headless", "--mission", "1,2,3"]);
    wait_for("a robot under way", || {
        let frame = domain.lager(&["topic", "echo", "sensor/line", "--count", "1"]);
        (up.service("logic").is_some() && to_its_end(frame).status.success()).then_some(())
    });
    up
}

#[test]
fn a_second_robot_of_a_name_is_refused_whatever_its_session() {
    let domain = Domain::new();
    // Serial ports with no board behind them.
    let ports = [(); 2].map(|()| Cable::new().expect("a pseudo terminal"));
    let [sensor, steering] = ports
        .each_ref()
        .map(|port| port.path().to_str().expect("UTF-8"));
    let up = domain.start(&[
        "up",
        "--name",
        "x",
        "--sensor",
        sensor,
        "--steering",
        steering,
    ]);
    wait_for("the waiting robot", || up.service("logic"));
    let session = domain.folder().join("session");
    fs::create_dir(&session).expect("a folder");
    let mut second = domain.lager(&["up", "--name", "x"]);
    second.env("XDG_RUNTIME_DIR", &session);
    let refused = to_its_end(second);
    assert_eq!(refused.status.code(), Some(4), "{}", said(&refused));
    let holder = format!("process {}", up.pid());
    assert!(said(&refused).contains(&holder), "{}", said(&refused));
    drop(up);
}

#[test]
fn a_second_bridge_is_refused_with_the_first_ones_process() {
    let domain = Domain::new();
    let mut up = robot(&domain);
    let bridge = up.service("bridge").expect("a bridge");
    let config = domain.bus_folder().join("r1/lager.toml");
    let mut second = domain.lager(&["bridge", "--config"]);
    second.arg(config);
    let refused = to_its_end(second);
    assert_eq!(refused.status.code(), Some(4), "{}", said(&refused));
    let holder = format!("the bridge of `r1` already runs (process {bridge})");
    assert!(said(&refused).contains(&holder), "{}", said(&refused));
    // The kernel releases the lock of a dead process, so a successor gets it.
    kill_process(pid(bridge), Signal::KILL).expect("a living bridge");
    wait_for("its successor", || {
        let lock = fs::read_to_string(domain.bus_folder().join("r1/bridge.lock"));
        let holder = lock.ok()?.parse::<u32>().ok()?;
        (Some(holder) == up.service("bridge") && holder != bridge).then_some(())
    });
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0));
}

/// Runs `lager` with `args` and kills it at its `when`th call of `ftruncate`. The file that it was
/// making keeps the size 0.
fn killed_half_way(domain: &Domain, when: u32, args: &[&str]) -> Output {
    let whole = domain.lager(args);
    let mut strace = Command::new("strace");
    strace
        .args(["-f", "-o", "/dev/null", "-e", "trace=ftruncate", "-e"])
        .arg(format!("inject=ftruncate:signal=SIGKILL:when={when}"))
        .arg(whole.get_program())
        .args(whole.get_args())
        .current_dir(domain.folder())
        .stdin(Stdio::null());
    to_its_end(strace)
}

#[test]
fn what_a_tool_killed_half_way_leaves_keeps_nobody_waiting() {
    let domain = Domain::new();
    let mut up = robot(&domain);
    for when in 1..=3 {
        killed_half_way(
            &domain,
            when,
            &["topic", "echo", "sensor/line", "--count", "1"],
        );
        for args in [
            &["topic", "list"][..],
            &["topic", "echo", "sensor/line", "--count", "1"],
            &["doctor", "--fix"],
        ] {
            let ended = to_its_end(domain.lager(args));
            assert!(ended.status.success() || args[0] == "doctor", "{ended:?}");
        }
    }
    // The supervisor notices a death and the robot ends, both as usual.
    let bridge = up.service("bridge").expect("a bridge");
    kill_process(pid(bridge), Signal::KILL).expect("a living bridge");
    wait_for("its successor", || {
        up.service("bridge").filter(|process| *process != bridge)
    });
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0));
}

#[test]
fn of_a_robot_that_was_killed_whole_doctor_leaves_nothing() {
    let domain = Domain::new();
    let up = robot(&domain);
    let processes: Vec<u32> = children(up.pid()).into_iter().chain([up.pid()]).collect();
    // A frozen process cannot clean up.
    let all = |signal| {
        for process in &processes {
            let _ = kill_process(pid(*process), signal);
        }
    };
    all(Signal::STOP);
    all(Signal::KILL);
    wait_for("their end", || {
        processes
            .iter()
            .all(|process| has_ended(*process))
            .then_some(())
    });
    for (number, segment) in home(&domain).segments().iter().enumerate() {
        // Some files stay as they were; others become empty, short or random.
        match number % 4 {
            1 => fs::write(segment, []),
            2 => fs::write(segment, [0x55; 100]),
            3 => fs::write(segment, [0xff; 1_000_000]),
            _ => Ok(()),
        }
        .expect("a segment");
    }
    killed_half_way(
        &domain,
        1,
        &["topic", "echo", "sensor/line", "--count", "1"],
    );
    let fixed = to_its_end(domain.lager(&["doctor", "--fix"]));
    let report = String::from_utf8_lossy(&fixed.stdout).into_owned();
    let left = domain.leftovers();
    let stop = |path: &String| path.ends_with("/stop");
    assert!(left.iter().all(stop), "{report}\n{left:#?}");
    assert_eq!(home(&domain).segments(), Vec::<PathBuf>::new());
}

#[test]
fn another_user_is_told_whose_the_robot_is() {
    let domain = Domain::new();
    let _up = robot(&domain);
    if !rustix::process::geteuid().is_root() {
        // Root starts it as another user; any other user tries files of root.
        let mut other = Command::new(lager());
        other.args(["--bus", "/proc/1/task", "topic", "list"]);
        assert!(said(&to_its_end(other)).contains("`sudo -u root`"));
        return;
    }
    // A copy of the program in a folder that every user may enter.
    let program = PathBuf::from(format!("/dev/shm/lager-{}-program", std::process::id()));
    fs::copy(lager(), &program).expect("room for a copy");
    let mut other = Command::new(&program);
    other
        .args(["topic", "list", "--bus"])
        .arg(domain.bus_folder());
    other.uid(12345).gid(12345).current_dir("/");
    let refused = to_its_end(other);
    fs::remove_file(&program).expect("the copy");
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        said(&refused)
            .contains("belongs to UID 0 (root); use the bus as that user (`sudo -u root`)")
            && said(&refused).contains("`--bus` names another folder"),
        "{}",
        said(&refused)
    );
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the iceoryx2 0.10.0 wheel"]
fn python_joins_with_what_config_prints() {
    let python = std::env::var_os("LAGER_PYTHON").expect("LAGER_PYTHON names a Python");
    let domain = Domain::new();
    let mut up = robot(&domain);
    let printed = to_its_end(domain.lager(&["config", "--iceoryx2"]));
    let file = domain.folder().join("iceoryx2.toml");
    fs::write(&file, &printed.stdout).expect("a file");
    let mut join = Command::new(python);
    join.args(["-c", PYTHON]).arg(&file);
    let joined = to_its_end(join);
    assert!(joined.status.success(), "{}", said(&joined));
    let listed = String::from_utf8_lossy(&joined.stdout).into_owned();
    assert!(listed.contains("lager/r1/sensor/line"), "{listed}");
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0));
}

/// A Python program that joins the bus of a configuration file and lists its services.
const PYTHON: &str = "
import sys, iceoryx2 as iox2
config = iox2.config.from_file(iox2.FilePath.new(sys.argv[1]))
node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
for service in iox2.Service.list(config, iox2.ServiceType.Ipc):
    print(service.name())
";
