//! Tests of the tools as people use them: their messages, their exit codes, and that none hangs.

use std::fs;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use lager_tests::{Domain, Running, WATCHDOG, children, has_ended, is_stopped, pid, wait_for};
use lager_topics::{LinkHealth, NavStatus, Phase, SensorLine};
use rustix::process::{Signal, kill_process};
use serde_json::Value;

/// Every tool that needs the bus of a running robot.
const NEEDY: [&[&str]; 26] = [
    &["topic", "echo", "sensor/line"],
    &["topic", "echo", "link/health", "--json"],
    &["topic", "hz", "sensor/line"],
    &["topic", "bw", "sensor/line"],
    &["topic", "delay", "sensor/line"],
    &["top", "--once"],
    &["fetch", "2"],
    &["queue"],
    &["queue", "add", "2"],
    &["pick", "auto"],
    &["picked"],
    &["press", "switch"],
    &["place"],
    &["obstacle"],
    &["obstacle", "put", "1,0,up"],
    &["bag", "record", "hung.mcap"],
    &["reset"],
    &["mode", "manual"],
    &["resume"],
    &["gains", "2", "2"],
    &["calibrate"],
    &["drive", "forward"],
    &["drive", "left-diag"],
    &["arm", "up"],
    &["topic", "info", "sensor/line"],
    &["topic", "list"],
];

/// How many of them run at the same time.
const SOME: usize = 7;

/// Every tool should end within 3 s; this limit is longer, for a busy machine.
const LONG: Duration = Duration::from_secs(20);

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn said(output: &Output) -> String {
    text(&output.stdout) + &text(&output.stderr)
}

/// A robot that waits for orders.
fn up(domain: &Domain) -> Running {
    let up = domain.start(&["up", "--mission", "1", "--speed", "2"]);
    let observer = domain.observe("r1", 2.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        let status = status.latest().expect("readable")?;
        (status.phase.get() == Some(Phase::Driving)).then_some(())
    });
    up
}

/// A robot whose processes are all frozen, and whose topics nobody can open: their files in shared
/// memory have the size 0, as if their maker had been stopped before it set the size.
struct Frozen {
    processes: Vec<u32>,
    _up: Running,
}

impl Frozen {
    fn new(domain: &Domain) -> Self {
        let up = up(domain);
        let mut processes = vec![up.pid()];
        let mut seen = 0;
        while seen < processes.len() {
            processes.extend(children(processes[seen]));
            seen += 1;
        }
        for process in &processes {
            kill_process(pid(*process), Signal::STOP).expect("a living process");
        }
        for process in &processes {
            wait_for("all to be frozen", || is_stopped(*process).then_some(()));
        }
        cut(domain);
        let _up = up;
        Self { processes, _up }
    }
}

/// Cuts the shared memory of every topic and request to size 0.
fn cut(domain: &Domain) {
    let place = domain.bus("r1", 2.0).home().expect("the bus's folder");
    let mut cut = 0;
    for segment in place.segments() {
        if segment.to_string_lossy().ends_with(".dynamic") {
            let file = fs::File::options().write(true).open(segment);
            file.and_then(|file| file.set_len(0)).expect("our own file");
            cut += 1;
        }
    }
    assert!(cut > 10, "{cut} topics and requests were cut");
}

impl Drop for Frozen {
    /// The processes would find their memory gone and could not end in order, so they are killed.
    fn drop(&mut self) {
        for process in &self.processes {
            let _ = kill_process(pid(*process), Signal::KILL);
        }
        for process in &self.processes {
            wait_for("the end", || has_ended(*process).then_some(()));
        }
    }
}

fn spawn(domain: &Domain, words: &[&str]) -> Child {
    domain
        .lager(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("lager starts")
}

/// Waits until a tool ends, which must not take long.
fn end(words: &[&str], mut tool: Child, began: Instant) -> Output {
    while tool.try_wait().expect("a child").is_none() {
        if began.elapsed() >= LONG {
            let _ = tool.kill();
            panic!("`lager {}` hangs", words.join(" "));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    tool.wait_with_output().expect("a child")
}

#[test]
fn no_tool_hangs_on_a_bus_that_does_not_answer() {
    let domain = Domain::new();
    let frozen = Frozen::new(&domain);
    // A few at a time: the machine has few cores, and a tool that hangs in the transport uses one.
    for some in NEEDY.chunks(SOME) {
        let tools: Vec<_> = some
            .iter()
            .map(|words| (*words, spawn(&domain, words), Instant::now()))
            .collect();
        for (words, tool, began) in tools {
            let output = end(words, tool, began);
            let told = said(&output);
            // These two tools report what they find, and wait for no answer.
            if !matches!(words, ["topic", "list" | "info", ..]) {
                assert_eq!(output.status.code(), Some(1), "{words:?}: {told}");
                assert!(told.contains("is frozen"), "{words:?}: {told}");
                assert!(told.contains(".dynamic is damaged"), "{words:?}: {told}");
            }
        }
    }
    drop(frozen);
}

#[test]
fn one_ctrl_c_ends_every_tool_also_while_the_bus_does_not_answer() {
    let domain = Domain::new();
    let frozen = Frozen::new(&domain);
    for some in NEEDY.chunks(SOME) {
        let tools: Vec<_> = some.iter().map(|words| spawn(&domain, words)).collect();
        // A tool handles signals once its watch has started; before that any signal ends it.
        std::thread::sleep(Duration::from_millis(400));
        for (words, mut tool) in some.iter().zip(tools) {
            let began = Instant::now();
            if tool.try_wait().expect("a child").is_none() {
                kill_process(pid(tool.id()), Signal::INT).expect("a child of ours");
            }
            end(words, tool, began);
        }
    }
    drop(frozen);
}

#[test]
fn a_player_is_refused_also_by_a_robot_that_is_frozen() {
    let domain = Domain::new();
    let mut recorder = domain.start(&["bag", "record", "tour.mcap", "--wait"]);
    let frozen = {
        let _up = up(&domain);
        std::thread::sleep(Duration::from_secs(1));
        recorder.signal(Signal::INT);
        assert_eq!(recorder.wait(), Some(0), "{}", recorder.log());
        drop(_up);
        Frozen::new(&domain)
    };
    let play = ["bag", "play", "tour.mcap"];
    let output = end(&play, spawn(&domain, &play), Instant::now());
    let told = said(&output);
    assert_eq!(output.status.code(), Some(4), "{told}");
    assert!(told.contains("`r1` is already up"), "{told}");
    drop(frozen);
}

#[test]
fn ctrl_c_ends_what_needs_no_bus() {
    let domain = Domain::new();
    let long = ["simulate", "--seeds", "1..1000", "--warehouse", "large"];
    let tool = spawn(&domain, &long);
    std::thread::sleep(Duration::from_millis(500));
    let began = Instant::now();
    kill_process(pid(tool.id()), Signal::INT).expect("a child of ours");
    assert_eq!(end(&long, tool, began).status.code(), Some(130));
}

#[test]
fn ctrl_c_ends_a_measurement_and_leaves_nothing() {
    lager_tests::lager_bench();
    let domain = Domain::new();
    let stop = ["bench", "stop"];
    let tool = spawn(&domain, &stop);
    let folder = format!("/dev/shm/lager-bench-{}-0", tool.id());
    wait_for("the robot to be measured", || {
        std::fs::exists(format!("{folder}/r1"))
            .is_ok_and(|there| there)
            .then_some(())
    });
    let began = Instant::now();
    kill_process(pid(tool.id()), Signal::INT).expect("a child of ours");
    let output = end(&stop, tool, began);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("nothing was left behind"));
    assert!(!std::fs::exists(folder).expect("a name"));
}

#[test]
fn a_robot_that_is_not_up_is_told_at_once() {
    let domain = Domain::new();
    let _up = up(&domain);
    let away = |words: &[&str]| domain.run(&[&["--name", "r9"], words].concat());
    for words in NEEDY {
        if matches!(words, ["topic", "info", ..]) {
            continue;
        }
        let output = away(words);
        let told = said(&output);
        assert_eq!(output.status.code(), Some(1), "{words:?}: {told}");
        assert!(told.contains("no robot `r9` is up"), "{words:?}: {told}");
        assert!(told.contains("up are: r1"), "{words:?}: {told}");
    }
    let all = domain.run(&["topic", "list"]);
    assert!(
        said(&all).contains("lager/r1/sensor/line"),
        "{}",
        said(&all)
    );
    assert!(said(&all).contains(" 1 publisher "), "{}", said(&all));
    assert!(!said(&all).contains(" 1 publishers"), "{}", said(&all));
    assert!(!said(&all).contains(" 1 subscribers"), "{}", said(&all));
}

#[test]
fn a_tool_can_wait_for_the_robot() {
    let domain = Domain::new();
    let words = ["topic", "echo", "sensor/line", "--count", "1", "--wait"];
    let mut tool = spawn(&domain, &words);
    std::thread::sleep(Duration::from_millis(300));
    assert!(tool.try_wait().expect("a child").is_none(), "it waits");
    let _up = up(&domain);
    let output = wait_for("the sample", || tool.try_wait().expect("a child"));
    assert!(output.success());
}

#[test]
fn a_frozen_service_is_told_by_its_name() {
    let domain = Domain::new();
    let up = up(&domain);
    for service in ["bridge", "logic"] {
        let process = up.service(service).expect("a service");
        // Freezes the supervisor too: it would replace a process that is silent for 2 s.
        let frozen = [up.pid(), process];
        for process in frozen {
            kill_process(pid(process), Signal::STOP).expect("a living process");
            wait_for("it to be frozen", || is_stopped(process).then_some(()));
        }
        let output = domain.run(match service {
            "bridge" => &["mode", "autonomous"][..],
            _ => &["reset"],
        });
        for process in frozen.into_iter().rev() {
            kill_process(pid(process), Signal::CONT).expect("a living process");
        }
        let told = said(&output);
        let frozen = format!("the {service} of the robot `r1` (process {process}) is frozen");
        assert!(told.contains(&frozen), "{told}");
        assert_eq!(output.status.code(), Some(1), "{told}");
        let observer = domain.observe("r1", 2.0);
        let mut health = observer.subscriber::<LinkHealth>().expect("a topic");
        wait_for("the robot to go on", || {
            health.latest().expect("readable").map(|_| ())
        });
    }
}

#[test]
fn an_order_that_cannot_be_carried_out_now_is_refused_with_its_reason() {
    let domain = Domain::new();
    let _up = up(&domain);
    let driven = said(&domain.run(&["drive", "forward"]));
    assert!(driven.contains("`lager mode manual`"), "{driven}");
    let manual = domain.run(&["mode", "manual"]);
    assert!(manual.status.success(), "{}", said(&manual));
    let fetched = domain.run(&["fetch", "2"]);
    assert_eq!(fetched.status.code(), Some(1));
    let told = said(&fetched);
    assert!(told.contains("`lager mode autonomous`"), "{told}");
}

#[test]
fn a_calibration_tells_how_it_went() {
    let domain = Domain::new();
    let _up = up(&domain);
    let manual = domain.run(&["mode", "manual"]);
    assert!(manual.status.success(), "{}", said(&manual));
    // The sensors of a standing robot see either tape or floor, not both.
    let standing = domain.run(&["calibrate"]);
    let told = said(&standing);
    assert_eq!(standing.status.code(), Some(1), "{told}");
    assert!(
        told.contains("of 11; the others keep their thresholds"),
        "{told}"
    );
    // A robot that turns on the spot moves most or all sensors across the line in that time.
    let moving = domain.start(&["drive", "left", "--seconds", "20"]);
    let turning = domain.run(&["calibrate"]);
    let told = said(&turning);
    if turning.status.success() {
        assert!(told.contains("are calibrated"), "{told}");
    } else {
        let sensors = told
            .split("only ")
            .nth(1)
            .and_then(|told| told.split(' ').next());
        let sensors: u8 = sensors.and_then(|number| number.parse().ok()).expect(&told);
        assert!(sensors > 2, "{told}\n{}", moving.log());
    }
}

#[test]
fn what_is_short_is_named() {
    let domain = Domain::new();
    let _up = up(&domain);
    let tool = domain.lager(&["topic", "echo", "sensor/line", "--count", "1"]);
    // Too few for the bus, or for the topic. With 12, an earlier file may have been closed in time.
    for files in [5, 7, 9] {
        let mut poor = Command::new("sh");
        poor.args(["-c", &format!("ulimit -n {files}; exec \"$0\" \"$@\"")])
            .arg(tool.get_program())
            .args(tool.get_args())
            .current_dir(domain.folder());
        let output = poor.output().expect("a shell");
        let told = said(&output);
        assert_eq!(output.status.code(), Some(1), "{told}");
        let short = format!("may open {files} files");
        assert!(told.contains(&short), "{told}");
    }
}

/// The output and the exit code of `topic list` after the script `mounts` has mounted another
/// `/dev/shm`. The bus is in `/dev/shm/bus`.
fn listed_where(domain: &Domain, mounts: &str, user: &[&str]) -> Output {
    let script = format!("{mounts}\ncp \"$0\" program\nexec \"$@\"");
    let program = domain.lager(&[]);
    let mut command = Command::new("unshare");
    command
        .args(["--mount", "sh", "-ec", &script])
        .arg(program.get_program())
        .args(user)
        .args(["./program", "--bus", "/dev/shm/bus", "topic", "list"])
        .current_dir(domain.folder())
        .output()
        .expect("`unshare` is there")
}

#[test]
#[ignore = "mounts file systems, which needs root; `tests/soak attack` runs it"]
fn a_full_memory_and_a_missing_right_are_told_with_file_and_cause() {
    let domain = Domain::new();
    let full = "mount -t tmpfs -o size=2m tmpfs /dev/shm
        mkdir -m 700 /dev/shm/bus
        head -c 64M /dev/zero >/dev/shm/full || true";
    let output = listed_where(&domain, full, &[]);
    let told = said(&output);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("/dev/shm is full"), "{told}");
    assert!(told.contains("ENOSPC"), "{told}");

    let forbidden = "mount -t tmpfs -o mode=755 tmpfs /dev/shm
        mkdir -m 700 /dev/shm/bus
        chown 12345 /dev/shm/bus
        chmod 755 .";
    let user = ["setpriv", "--reuid", "12345", "--clear-groups"];
    let output = listed_where(&domain, forbidden, &user);
    let told = said(&output);
    assert_eq!(output.status.code(), Some(1), "{told}");
    let why = "this user may not write to /dev/shm (EACCES)";
    assert!(told.contains(why), "{told}");
}

#[test]
fn wrong_usage_ends_with_two_and_a_sentence() {
    lager_tests::lager_bench();
    let domain = Domain::new();
    for (words, sentence) in [
        (&["up", "--mission", "99"][..], "no goods 99"),
        (&["simulate", "--seeds", "3..1"], "first seed comes first"),
        (&["simulate", "--mission", "99"], "no goods 99"),
        (&["drive", "bogus"], "follow-forward"),
        (&["topic", "echo", "sensor/lime"], "sensor/line"),
        (&["fetch", "-1"], "numbered from 0"),
        (&["bench", "chip", "--quick"], "nothing else"),
    ] {
        let output = domain.run(words);
        let told = said(&output);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains(sentence), "{words:?}: {told}");
    }
    // `config` refuses a configuration that `up` refuses.
    fs::write(
        domain.folder().join("lager.toml"),
        "warehouse = \"nowhere\"\n",
    )
    .expect("a file");
    for words in [&["config"][..], &["up"]] {
        let output = domain.run(words);
        assert_eq!(output.status.code(), Some(1));
        assert!(
            said(&output).contains("no warehouse `nowhere`"),
            "{}",
            said(&output)
        );
    }
}

#[test]
fn echo_is_a_table_or_a_block_for_people() {
    let domain = Domain::new();
    let _up = up(&domain);
    let frames = domain.run(&["topic", "echo", "sensor/line", "--count", "3"]);
    let told = said(&frames);
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), 4, "a head and three rows: {told}");
    assert!(
        lines[0].contains("age ms") && lines[0].contains("state"),
        "{told}"
    );
    assert!(lines[1].contains("bridge ("), "{told}");
    let health = said(&domain.run(&["topic", "echo", "link/health", "--count", "1"]));
    assert!(!health.contains('{'), "no JSON: {health}");
    assert!(health.contains("by bridge ("), "{health}");
    let mode = health.lines().find(|line| line.starts_with("  mode"));
    assert!(
        mode.is_some_and(|line| line.ends_with("  autonomous")),
        "{health}"
    );
}

#[test]
fn up_speaks_with_one_voice_and_traces_only_where_it_is_asked_to() {
    let domain = Domain::new();
    let log = domain.folder().join("traces.log");
    let mut up = domain.start(&[
        "up",
        "--mission",
        "1",
        "--exit-when-done",
        "--speed",
        "5",
        "--log",
        log.to_str().expect("a path in UTF-8"),
    ]);
    assert!(WATCHDOG > LONG);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.output() + &up.log();
    assert!(!told.is_empty());
    for line in told.lines() {
        let mut words = line.split_whitespace();
        let time: Option<f64> = words.next().and_then(|time| time.parse().ok());
        let who = (words.next() == Some("s")).then(|| words.next()).flatten();
        assert!(time.is_some(), "`{line}` begins with no time:\n{told}");
        let known = [
            "up",
            "bridge",
            "logic",
            "simulator",
            "comm",
            "station",
            "robot",
        ];
        assert!(
            who.is_some_and(|who| known.contains(&who)),
            "`{line}` does not say who speaks:\n{told}"
        );
    }
    let traces = fs::read_to_string(log).expect("the traces' file");
    assert!(traces.contains("INFO"), "{traces}");
}

#[test]
fn traces_of_a_mission_are_few_and_have_their_spans() {
    let domain = Domain::new();
    let log = domain.folder().join("traces.json");
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1,2",
        "--exit-when-done",
        "--speed",
        "5",
        "--log",
        log.to_str().expect("a path in UTF-8"),
        "--log-json",
    ]);
    let observer = domain.observe("r1", 5.0);
    let mut lines = observer.subscriber::<SensorLine>().expect("a topic");
    let mut frames = 0_u64;
    wait_for("the mission", || {
        while lines.receive().expect("readable").is_some() {
            frames += 1;
        }
        (!up.is_running()).then_some(())
    });
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let traces = fs::read_to_string(log).expect("the traces' file");
    let traces: Vec<Value> = traces
        .lines()
        .map(|line| serde_json::from_str(line).expect("a line is a JSON value"))
        .collect();
    // The log grows with events (processes, links, orders) and not with frames.
    let told = traces
        .iter()
        .filter(|trace| trace["level"] == "INFO")
        .count() as u64;
    assert!(frames > 1_000, "{frames} frames");
    assert!(told < 150, "{told} lines for {frames} frames");
    assert!(traces.iter().all(|trace| trace["level"] != "DEBUG"));
    let begun = |name: &str| -> Vec<&Value> {
        let is_begin = |trace: &&Value| trace["message"] == "new" && trace["span"]["name"] == name;
        traces.iter().filter(is_begin).collect()
    };
    for span in ["service", "start", "link"] {
        assert!(!begun(span).is_empty(), "no span `{span}`: {traces:#?}");
    }
    // The station may hand over the second order when the robot has done the first one.
    assert!((1..=2).contains(&begun("mission").len()), "{traces:#?}");
    let orders = begun("order");
    let products: Vec<_> = orders
        .iter()
        .map(|order| &order["span"]["product"])
        .collect();
    assert_eq!(products, [1, 2]);
    let around: Vec<_> = orders[0]["spans"]
        .as_array()
        .expect("spans")
        .iter()
        .map(|span| span["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(around[..2], ["service", "mission"]);
}

#[test]
fn every_shell_is_told_how_to_complete() {
    let domain = Domain::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = domain.run(&["completions", shell]);
        let told = said(&output);
        assert!(output.status.success(), "{shell}: {told}");
        assert!(
            told.contains("obstacle") && told.contains("delay"),
            "{shell}"
        );
        if matches!(shell, "bash" | "zsh" | "fish") {
            assert!(told.contains("sensor/line"), "{shell}");
        }
    }
    let wrong = domain.run(&["completions", "cmd"]);
    assert_eq!(wrong.status.code(), Some(2));
}
