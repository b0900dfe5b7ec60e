//! Tests of real-time scheduling: what `/proc` says of the services that `up` starts and of their
//! successors after `kill -9`, and what `lager` tells a user who has no right to real time.
//!
//! Tests that need this right, or a kernel with time slices, are ignored by default. `tests/run`
//! runs them where the machine has both; run elsewhere, they fail.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use lager_tests::{Domain, Running, pid, wait_for};
use rustix::process::{Resource, Signal, getrlimit, kill_process};
use rustix::thread::{CapabilitySet, capabilities};

/// The documented exit code when the kernel does not grant what was asked.
const NOT_GRANTED: Option<i32> = Some(5);

/// The kernel's numbers of `SCHED_OTHER` and `SCHED_FIFO`.
const OTHER: u32 = 0;
const FIFO: u32 = 1;

/// The scheduling of one thread.
#[derive(Debug, PartialEq, Eq)]
struct Scheduled {
    name: String,
    policy: u32,
    priority: u32,
    cores: String,
}

/// Every thread of a process; empty when the process has ended.
fn threads(process: u32) -> Vec<Scheduled> {
    fs::read_dir(format!("/proc/{process}/task"))
        .into_iter()
        .flatten()
        .filter_map(|task| {
            let task = task.ok()?.path();
            let stat = fs::read_to_string(task.join("stat")).ok()?;
            // The name before it is in parentheses and may contain any character. proc(5) counts
            // fields from 1, and the state, which follows the name, is field 3.
            let fields: Vec<&str> = stat.rsplit(") ").next()?.split_whitespace().collect();
            let field = |number: usize| fields[number - 3].parse().ok();
            Some(Scheduled {
                name: name_of(&task)?,
                priority: field(40)?,
                policy: field(41)?,
                cores: status(&task, "Cpus_allowed_list")?,
            })
        })
        .collect()
}

/// The name of a thread.
fn name_of(task: &Path) -> Option<String> {
    let name = fs::read_to_string(task.join("comm")).ok()?;
    Some(name.trim_end().to_owned())
}

/// How many steps less urgent than the bridge's main loop a thread of a service is. The farther
/// along the path a thread is, the more urgent it is.
fn behind(service: &str, name: &str) -> u32 {
    match (service, name) {
        ("bridge", "sensor-port" | "steering-port") => 2,
        ("logic", "lager") => 1,
        _ => 0,
    }
}

/// One line of a `status` file.
fn status(process: &Path, name: &str) -> Option<String> {
    let text = fs::read_to_string(process.join("status")).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The number of a process's mappings of the bus, and how many of them are locked in memory.
fn bus_mappings(process: u32) -> (usize, usize) {
    let smaps = fs::read_to_string(format!("/proc/{process}/smaps")).unwrap_or_default();
    let mut counts = (0, 0);
    let mut of_the_bus = false;
    for line in smaps.lines() {
        match line.strip_prefix("VmFlags:") {
            Some(flags) if of_the_bus => {
                counts.0 += 1;
                counts.1 += usize::from(flags.split_whitespace().any(|flag| flag == "lo"));
            }
            Some(_) => {}
            // The first line of a mapping begins with its addresses, each further one with a name.
            None if line
                .split(' ')
                .next()
                .is_some_and(|word| !word.ends_with(':')) =>
            {
                of_the_bus = line.contains("/dev/shm/");
            }
            None => {}
        }
    }
    counts
}

/// The first and the last core that this process may use; one core twice if it has only one.
fn two_cores() -> [String; 2] {
    let list = status(Path::new("/proc/self"), "Cpus_allowed_list").expect("cores");
    let end = |pick: fn(&str) -> Option<&str>| pick(&list).expect("a core").to_owned();
    [
        end(|list| list.split([',', '-']).next()),
        end(|list| list.split([',', '-']).next_back()),
    ]
}

/// Fails unless the user may set priority 20 and lock any amount of memory.
fn need_real_time() {
    let effective = capabilities(None).expect("the kernel says").effective;
    let unlimited = |resource, wanted| {
        let limit = getrlimit(resource).maximum;
        limit.is_none_or(|limit| limit >= wanted)
    };
    let priority = effective.contains(CapabilitySet::SYS_NICE) || unlimited(Resource::Rtprio, 20);
    let memory =
        effective.contains(CapabilitySet::IPC_LOCK) || unlimited(Resource::Memlock, 1 << 30);
    assert!(
        priority && memory,
        "the rights are missing: run it as root, or raise the limits"
    );
}

/// The same command for a user without these rights, whoever runs the test.
fn without_rights(command: &Command) -> Command {
    let mut poor;
    if rustix::process::geteuid().is_root() {
        let lost = "-sys_nice,-ipc_lock";
        poor = Command::new("setpriv");
        poor.args(["--bounding-set", lost, "--inh-caps", lost, "prlimit"]);
    } else {
        poor = Command::new("prlimit");
    }
    poor.args(["--rtprio=0", "--memlock=65536"])
        .arg(command.get_program())
        .args(command.get_args())
        .current_dir(command.get_current_dir().expect("the domain's folder"));
    for (name, value) in command.get_envs() {
        poor.env(name, value.expect("only values are set"));
    }
    poor
}

/// Runs `lager` with `args` as a user without these rights.
fn run_without_rights(domain: &Domain, args: &[&str]) -> Output {
    without_rights(&domain.lager(args))
        .output()
        .expect("setpriv and prlimit of util-linux")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Waits until `service` has a new process, other than `before`, with all its threads on the bus.
fn at_work(up: &Running, service: &str, before: Option<u32>) -> u32 {
    // The bridge has two threads for its ports; every child has one that surely ends it.
    let wanted = if service == "bridge" { 4 } else { 2 };
    wait_for(service, || {
        up.service(service)
            .filter(|process| Some(*process) != before)
            .filter(|process| threads(*process).len() >= wanted && bus_mappings(*process).0 > 0)
    })
}

#[test]
#[ignore = "needs the right to a real-time priority of 20 and to 1 GiB of locked memory; `tests/run` runs it where it has them"]
fn up_gives_its_services_what_was_asked_for_and_their_successors_too() {
    need_real_time();
    let domain = Domain::new();
    let [first, last] = two_cores();
    let cores = [("bridge", &first), ("logic", &last)];
    let flags = cores.map(|(service, core)| format!("{service}={core}"));
    let args = [
        "up",
        "--realtime",
        "20",
        "--lock-memory",
        "--core",
        &flags[0],
        "--core",
        &flags[1],
    ];
    let up = domain.start(&args);
    let mut before = [None; 2];
    for life in 0..2 {
        for (place, (service, core)) in cores.iter().enumerate() {
            let process = at_work(&up, service, before[place]);
            before[place] = Some(process);
            // A new thread first sets its own scheduling, so this takes a moment.
            wait_for("each thread in its place", || {
                let all = threads(process);
                let is_placed = |thread: &Scheduled| {
                    let place = (FIFO, 20 - behind(service, &thread.name), *core);
                    (thread.policy, thread.priority, &thread.cores) == place
                };
                println!("{service} in life {life}: {all:?}");
                (all.len() >= 2 && all.iter().all(is_placed)).then_some(())
            });
            let (mapped, locked) = bus_mappings(process);
            assert_eq!(mapped, locked, "{service} in life {life}");
            let folder = format!("/proc/{process}");
            let locked = status(Path::new(&folder), "VmLck").expect("a living process");
            println!("{service}: {locked} locked");
            let kib: u64 = locked
                .split(' ')
                .next()
                .and_then(|kib| kib.parse().ok())
                .expect("a size in kB");
            // The documentation tells people to allow 64 MiB. The program of the tests, with all
            // features and for debugging, has more in it than theirs, which locks 23 MiB.
            assert!(
                (1..=68 << 10).contains(&kib),
                "{service} in life {life}: {locked}"
            );
        }
        if life == 0 {
            for process in before.into_iter().flatten() {
                kill_process(pid(process), Signal::KILL).expect("a living service");
            }
        }
    }
    // Neither the supervisor nor the simulator, which replaces the boards, is part of the path.
    let simulator = up.service("simulator").expect("a simulated robot");
    for process in [up.pid(), simulator] {
        let all = threads(process);
        let normal = |thread: &Scheduled| (thread.policy, thread.priority) == (OTHER, 0);
        assert!(!all.is_empty() && all.iter().all(normal), "{all:?}");
    }
    drop(up);
    domain.assert_clean();
}

#[test]
#[ignore = "needs the right to a real-time priority of 20 and to 1 GiB of locked memory; `tests/run` runs it where it has them"]
fn a_mission_is_delivered_in_real_time_with_locked_memory() {
    need_real_time();
    let domain = Domain::new();
    let config = domain.folder().join("robot.toml");
    fs::write(&config, "[realtime]\npriority = 20\nlock_memory = true\n").expect("a file");
    let mut up = domain.start(&[
        "--config",
        config.to_str().expect("a path in UTF-8"),
        "up",
        "--headless",
        "--exit-when-done",
        "--json",
        "--speed",
        "3",
    ]);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]));
    assert_eq!(told["restarts"], 0, "{told}\n{}", up.log());
    domain.assert_clean();
}

#[test]
#[ignore = "needs the right to a real-time priority of 20 and to 1 GiB of locked memory; `tests/run` runs it where it has them"]
fn a_service_on_its_own_takes_the_same_flags() {
    need_real_time();
    let domain = Domain::new();
    let [_, last] = two_cores();
    let logic = domain.start(&["logic", "--realtime", "7", "--core", &last]);
    wait_for("logic", || (bus_mappings(logic.pid()).0 > 0).then_some(()));
    for thread in threads(logic.pid()) {
        let priority = 7 - behind("logic", &thread.name);
        assert_eq!((thread.policy, thread.priority), (FIFO, priority));
        assert_eq!(thread.cores, last);
    }
    drop(logic);
    domain.assert_clean();
}

/// The name and the time slice, in ns, of each thread of a process; empty when it has ended.
fn slices(process: u32) -> Vec<(String, u64)> {
    let slice = |task: std::io::Result<fs::DirEntry>| {
        let task = task.ok()?.path();
        let told = fs::read_to_string(task.join("sched")).ok()?;
        let line = told.lines().find(|line| line.starts_with("se.slice"))?;
        Some((
            name_of(&task)?,
            line.rsplit(':').next()?.trim().parse().ok()?,
        ))
    };
    let tasks = fs::read_dir(format!("/proc/{process}/task"));
    tasks.into_iter().flatten().filter_map(slice).collect()
}

#[test]
#[ignore = "needs Linux 6.12, whose threads have slices of their own; `tests/run` runs it there"]
fn the_path_has_short_time_slices_without_any_right_and_nobody_else_has() {
    let domain = Domain::new();
    let up = domain.launch(without_rights(&domain.lager(&["up", "--headless"])));
    let [bridge, logic] = ["bridge", "logic"].map(|service| at_work(&up, service, None));
    let simulator = up.service("simulator").expect("a simulated robot");
    for (service, process) in [("bridge", bridge), ("logic", logic)] {
        wait_for("each thread to have its slices", || {
            let all = slices(process);
            println!("{service}: {all:?}");
            let is_its = |(name, slice): &(String, u64)| *slice == 100_000 << behind(service, name);
            (!all.is_empty() && all.iter().all(is_its)).then_some(())
        });
    }
    for process in [up.pid(), simulator] {
        let all = slices(process);
        let is_long = |(_, slice): &(String, u64)| *slice > 400_000;
        assert!(!all.is_empty() && all.iter().all(is_long), "{all:?}");
    }
    drop(up);
    domain.assert_clean();
}

#[test]
fn who_lacks_a_right_is_told_what_to_do_before_anything_runs() {
    let domain = Domain::new();
    for (flags, words) in [
        (
            &["--realtime", "20"][..],
            &[
                "LimitRTPRIO=20",
                "ulimit -r 20",
                "CAP_SYS_NICE",
                "priority = 0",
            ][..],
        ),
        (
            &["--lock-memory"],
            &[
                "64 KiB",
                "LimitMEMLOCK=",
                "ulimit -l",
                "CAP_IPC_LOCK",
                "lock_memory = false",
            ],
        ),
    ] {
        for command in ["up", "bridge", "logic"] {
            let refused = run_without_rights(&domain, &[&[command], flags].concat());
            let said = said(&refused);
            assert_eq!(refused.status.code(), NOT_GRANTED, "{command}: {said}");
            for word in words {
                assert!(
                    said.contains(word),
                    "{command}: `{word}` is missing: {said}"
                );
            }
            assert_eq!(said.lines().count(), 1, "{command}: one sentence: {said}");
        }
    }
    domain.assert_clean();
}

/// As root the robot has every right, and whoever asks has fewer: the kernel hides its files.
#[test]
fn who_has_fewer_rights_than_the_robot_finds_it_all_the_same() {
    let domain = Domain::new();
    let up = domain.start(&["up", "--headless"]);
    wait_for("the robot", || {
        up.output().contains("drives from").then_some(())
    });
    let asked = run_without_rights(&domain, &["map"]);
    assert!(asked.status.success(), "{}", said(&asked));
    drop(up);
    domain.assert_clean();
}

#[test]
fn cores_that_are_not_there_and_spinning_on_all_of_them_are_refused() {
    let domain = Domain::new();
    let spin = domain.folder().join("spin.toml");
    fs::write(&spin, "[bus]\nwaiting = \"spin\"\n").expect("a file");
    let spin = spin.to_str().expect("a path in UTF-8");
    let [first, _] = two_cores();
    for (args, word) in [
        (&["up", "--core", "1000"][..], "no core 1000"),
        (&["simulator", "--core", "1000"], "no core 1000"),
        // Two threads that never sleep on one core: too many on any machine.
        (
            &["--config", spin, "up", "--realtime", "20", "--core", &first],
            "adaptive",
        ),
    ] {
        let refused = domain.run(args);
        let said = said(&refused);
        assert_eq!(refused.status.code(), NOT_GRANTED, "{args:?}: {said}");
        assert!(said.contains(word), "{args:?}: {said}");
    }
    domain.assert_clean();
}

#[test]
fn the_doctor_tries_what_was_asked_for_and_does_not_guess() {
    let domain = Domain::new();
    let asked = ["doctor", "--realtime", "20", "--lock-memory"];
    let poor = run_without_rights(&domain, &asked);
    let text = String::from_utf8_lossy(&poor.stdout).into_owned();
    assert_eq!(poor.status.code(), Some(1), "{text}");
    for (what, cure) in [
        ("real time", "LimitRTPRIO=20"),
        ("locked memory", "LimitMEMLOCK="),
    ] {
        let bad = |line: &str| line.starts_with("BAD") && line.contains(what);
        assert!(text.lines().any(bad), "{what}: {text}");
        assert!(text.contains(cure), "{what}: {text}");
    }
    // A user without these rights needs none for a robot that is not in real time.
    let poor = run_without_rights(&domain, &["doctor"]);
    let text = String::from_utf8_lossy(&poor.stdout).into_owned();
    assert_eq!(poor.status.code(), Some(0), "{text}");
    assert!(text.contains("not used"), "{text}");
    assert!(text.contains("with --realtime 20"), "{text}");
    domain.assert_clean();
}

#[test]
#[ignore = "needs the right to a real-time priority of 20 and to 1 GiB of locked memory; `tests/run` runs it where it has them"]
fn the_doctor_says_what_is_granted() {
    need_real_time();
    let domain = Domain::new();
    let rich = domain.run(&["doctor", "--realtime", "20", "--lock-memory"]);
    let text = String::from_utf8_lossy(&rich.stdout).into_owned();
    assert_eq!(rich.status.code(), Some(0), "{text}");
    assert!(text.contains("priority 20 is granted"), "{text}");
    domain.assert_clean();
}
