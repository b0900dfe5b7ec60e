//! Tests that `lager up` survives a damaged bus: its files are overwritten, removed or cut short,
//! or a process on it is silent. The robot comes up again by itself or ends with a sentence, and
//! Ctrl-C always ends it.

mod renewal;

use std::fs::{self, File};
use std::io::Read as _;
use std::net::TcpListener;
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use lager_ports::Subscriber;
use lager_tests::{Domain, Running, has_ended, is_stopped, pid, wait_for};
use lager_topics::{LinkHealth, NavStatus, Phase, StopCause};
use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

const MISSION: [&str; 8] = [
    "up",
    "--mission",
    "1",
    "--exit-when-done",
    "--json",
    "--headless",
    "--speed",
    "3",
];

/// The process of a service; waits until there is one other than `before`.
fn service(up: &mut Running, name: &str, before: Option<u32>) -> u32 {
    wait_for(name, || {
        assert!(up.is_running(), "{}{}", up.log(), up.output());
        up.service(name).filter(|process| Some(*process) != before)
    })
}

/// Waits until a process that joins the bus now hears a bridge with both boards connected.
fn wait_until_up(domain: &Domain, up: &mut Running) {
    wait_for("the robot to be up", || {
        assert!(up.is_running(), "{}{}", up.log(), up.output());
        let echo = ["topic", "echo", "link/health", "--count", "1", "--json"];
        let mut echo = domain.start(&echo);
        // This process may hang on a damaged bus, or wait on a bus that was replaced.
        let give_up = Instant::now() + Duration::from_secs(2);
        while echo.is_running() && Instant::now() < give_up {
            std::thread::sleep(Duration::from_millis(5));
        }
        if echo.is_running() {
            echo.signal(Signal::KILL);
            return None;
        }
        let health: Value = serde_json::from_str(echo.output().lines().next()?).ok()?;
        let whole =
            health["payload"]["sensor"]["up"] == 1 && health["payload"]["steering"]["up"] == 1;
        let bridge = up.service("bridge")?;
        (whole && health["writer"] == bridge).then_some(())
    });
}

/// Starts a robot, and waits until every service is at work.
fn start(domain: &Domain, args: &[&str]) -> Running {
    let mut up = domain.start(args);
    wait_until_up(domain, &mut up);
    service(&mut up, "logic", None);
    up
}

/// Ends a robot by Ctrl-C; `code` is the expected exit code. A robot that was started again in the
/// middle of its mission has not delivered it.
fn interrupt(up: &mut Running, code: i32) {
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(code), "{}{}", up.log(), up.output());
}

fn kill(process: u32, signal: Signal) {
    kill_process(pid(process), signal).expect("a living process");
}

/// A robot that was started again on a cleared bus stands until a person says where it is.
fn assert_stands_lost(domain: &Domain, cause: StopCause) {
    let observer = domain.observe("r1", 1.0);
    let mut health: Subscriber<LinkHealth> = observer.subscriber().expect("a topic");
    let mut status: Subscriber<NavStatus> = observer.subscriber().expect("a topic");
    let health = wait_for("the bridge", || health.latest().expect("readable"));
    assert_eq!(health.stopped, 1, "{health:?}");
    assert_eq!(health.stop_cause, cause, "{health:?}");
    let status = wait_for("logic", || status.latest().expect("readable"));
    assert_eq!(status.phase, Phase::Lost, "{status:?}");
}

/// Such a robot leaves nothing but a stop, because nobody knows where it is.
fn assert_only_a_stop_is_left(domain: &Domain) {
    let mut left = domain.leftovers();
    left.retain(|file| !file.ends_with("/r1/stop"));
    assert!(left.is_empty(), "left behind: {left:#?}");
}

fn segments(domain: &Domain) -> Vec<PathBuf> {
    domain.bus("r1", 1.0).home().expect("a folder").segments()
}

/// Cuts the shared memory of a bus to length 0; a process that reads its mapping gets SIGBUS.
fn cut_off(domain: &Domain) {
    for segment in segments(domain) {
        // Another process may remove a segment meanwhile.
        if let Ok(file) = File::options().write(true).open(segment) {
            let _ = file.set_len(0);
        }
    }
}

#[test]
fn a_bridge_comes_back_on_a_bus_with_a_segment_that_was_never_finished() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    let lager = domain.lager(&["topic", "echo", "sensor/line", "--count", "1"]);
    let ended = Command::new("strace")
        .args(["-f", "-qq", "-e", "trace=ftruncate"])
        .args(["-e", "inject=ftruncate:signal=SIGKILL:when=1"])
        .arg(lager.get_program())
        .args(lager.get_args())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("strace, which tests/run installs");
    assert!(!ended.success(), "it was to be killed");
    let bridge = service(&mut up, "bridge", None);
    kill(bridge, Signal::KILL);
    service(&mut up, "bridge", Some(bridge));
    wait_until_up(&domain, &mut up);
    up.signal(Signal::INT);
    // 0 if a process removed the unfinished file in time for the mission to be delivered.
    let code = up.wait();
    assert!(
        matches!(code, Some(0 | 3)),
        "{code:?}: {}{}",
        up.log(),
        up.output()
    );
}

#[test]
fn a_robot_comes_up_again_on_an_emptied_bus() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    // A cleared bus gives its files other names.
    for (emptied, next, cause) in [
        ("iceoryx2", "iceoryx2-1", StopCause::StateLost),
        // The bridge notices it first, and stops the robot.
        ("r1", "r1", StopCause::WordRemoved),
    ] {
        let folder = domain.bus_folder().join(emptied);
        let attendant = service(&mut up, "attend", None);
        // The robot makes new files in the folder meanwhile.
        wait_for("the folder to be emptied", || {
            fs::remove_dir_all(&folder).ok()
        });
        service(&mut up, "attend", Some(attendant));
        wait_until_up(&domain, &mut up);
        assert!(domain.bus_folder().join(next).is_dir());
        assert_stands_lost(&domain, cause);
    }
    interrupt(&mut up, 3);
    assert_only_a_stop_is_left(&domain);
}

#[test]
fn a_robot_comes_up_again_when_its_memory_is_cut_off() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    let attendant = service(&mut up, "attend", None);
    cut_off(&domain);
    service(&mut up, "attend", Some(attendant));
    wait_until_up(&domain, &mut up);
    let told = up.output();
    assert!(told.contains("the bus is damaged"), "{told}");
    assert_stands_lost(&domain, StopCause::StateLost);
    interrupt(&mut up, 3);
    assert_only_a_stop_is_left(&domain);
}

/// The segments with the lists of publishers and subscribers that `robot` has mapped and `others`
/// have not.
fn own_topics(domain: &Domain, robot: &[u32], others: &[u32]) -> Vec<PathBuf> {
    let maps = |process: &u32| {
        // A process that has ended has no mappings.
        fs::read_to_string(format!("/proc/{process}/maps")).unwrap_or_default()
    };
    let of = |processes: &[u32]| processes.iter().map(maps).collect::<String>();
    let (own, foreign) = (of(robot), of(others));
    let is_mapped = |maps: &str, path: &PathBuf| maps.contains(path.to_str().expect("UTF-8"));
    segments(domain)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|end| end == "dynamic"))
        .filter(|path| is_mapped(&own, path) && !is_mapped(&foreign, path))
        .collect()
}

#[test]
fn a_robot_whose_topics_are_overwritten_comes_up_again_beside_another_that_notices_nothing() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless", "--no-station"]);
    let mut other = domain.start(&["--name", "r2", "up", "--headless", "--no-station"]);
    const SERVICES: [&str; 4] = ["attend", "simulator", "bridge", "logic"];
    let others = |other: &mut Running| SERVICES.map(|name| service(other, name, None)).to_vec();
    let before = others(&mut other);
    let observer = domain.observe("r2", 1.0);
    let mut health: Subscriber<LinkHealth> = observer.subscriber().expect("a topic");
    let mut is_whole = || {
        let health = health.latest().expect("readable")?;
        let boards = [health.sensor.up, health.steering.up];
        (health.stopped == 0 && boards == [1, 1]).then_some(health.stamp().writer)
    };
    wait_for("the other robot", &mut is_whole);

    let attendant = service(&mut up, "attend", None);
    let own = SERVICES.map(|name| service(&mut up, name, None));
    let foreign: Vec<u32> = before.iter().copied().chain([std::process::id()]).collect();
    let topics = own_topics(&domain, &own, &foreign);
    assert!(topics.len() > 10, "{topics:#?}");
    for topic in topics {
        let length = fs::metadata(&topic).expect("a segment").len();
        let file = File::options().write(true).open(topic).expect("ours");
        let noise = vec![0xa5; usize::try_from(length).expect("a length")];
        file.write_all_at(&noise, 0).expect("as long as it was");
    }
    service(&mut up, "attend", Some(attendant));
    wait_until_up(&domain, &mut up);
    let told = up.output();
    assert!(told.contains("the bus is damaged"), "{told}");
    assert_stands_lost(&domain, StopCause::StateLost);

    let whole = wait_for("the other robot still", &mut is_whole);
    assert_eq!(others(&mut other), before, "{}", other.output());
    assert_eq!(Some(whole), other.service("bridge"));
    let told = other.output() + &other.log();
    assert!(
        !told.contains("damaged") && !told.contains("ended"),
        "{told}"
    );
    interrupt(&mut up, 3);
    interrupt(&mut other, 0);
    drop((health, observer));
    assert_only_a_stop_is_left(&domain);
}

/// The supervisor starts the robot again after growing pauses and says so. It succeeds when the
/// program that damages the bus has ended.
#[test]
fn a_bus_that_does_not_hold_is_tried_more_and_more_seldom_until_it_does() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    wait_for("the starts in vain", || {
        cut_off(&domain);
        assert!(up.is_running(), "{}{}", up.log(), up.output());
        up.output()
            .contains("new starts were in vain")
            .then_some(())
    });
    let said = up.output();
    let starts: Vec<&str> = said
        .lines()
        .filter_map(|line| line.split("starting everything again").nth(1))
        .collect();
    assert_eq!(
        starts,
        [" (1 of 3)", " in 1 s (2 of 3)", " in 4 s (3 of 3)"]
    );
    assert!(said.contains("tried every 15 s from now on"), "{said}");
    let told = "put it down, say where (`lager place`";
    assert_eq!(said.matches(told).count(), 1, "{said}");
    wait_until_up(&domain, &mut up);
    assert_stands_lost(&domain, StopCause::StateLost);
    interrupt(&mut up, 3);
    assert_only_a_stop_is_left(&domain);
}

#[test]
fn a_mission_is_delivered_though_its_attendant_is_killed_again_and_again() {
    let domain = Domain::new();
    let mut up = domain.start(&MISSION);
    let mut killed = 0;
    let mut attendant = None;
    while up.is_running() {
        // Each kill comes at another point of the mission, a third of which is work of the arm.
        std::thread::sleep(Duration::from_millis(600 + killed * 70));
        let Some(next) = up.service("attend").filter(|next| Some(*next) != attendant) else {
            continue;
        };
        if !has_ended(next) && kill_process(pid(next), Signal::KILL).is_ok() {
            killed += 1;
        }
        attendant = Some(next);
    }
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert!(killed > 3, "{killed} kills");
    assert_eq!(told["delivered"], json!([1]), "{told}");
    let restarts = told["restarts"].as_u64().expect("restarts");
    // The last kill may have come when the mission was just over.
    assert!(
        restarts == killed || restarts + 1 == killed,
        "{told}\n{}",
        up.log()
    );
    assert_eq!(told["failure"], Value::Null, "{told}");
    assert!(told["frames"].as_u64().expect("frames") > 1_000, "{told}");
    domain.assert_clean();
}

#[test]
fn a_stopped_attendant_is_replaced_and_the_mission_goes_on() {
    let domain = Domain::new();
    let mut up = domain.start(&MISSION);
    let observer = domain.observe("r1", 3.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        let status = status.latest().expect("readable")?;
        (status.phase.get() == Some(Phase::Driving)).then_some(())
    });
    let attendant = service(&mut up, "attend", None);
    kill(attendant, Signal::STOP);
    wait_for("it to stop", || is_stopped(attendant).then_some(()));
    service(&mut up, "attend", Some(attendant));
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], json!([1]), "{told}");
    assert_eq!(told["restarts"], 1, "{told}\n{}", up.log());
    drop((status, observer));
    domain.assert_clean();
}

#[test]
fn a_stopped_service_is_replaced_by_itself() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    let others =
        |up: &mut Running| ["attend", "simulator", "logic"].map(|name| service(up, name, None));
    let before = others(&mut up);
    let bridge = service(&mut up, "bridge", None);
    kill(bridge, Signal::STOP);
    service(&mut up, "bridge", Some(bridge));
    wait_until_up(&domain, &mut up);
    assert_eq!(others(&mut up), before, "{}", up.output());
    interrupt(&mut up, 0);
    domain.assert_clean();
}

/// `strace` keeps one of its system calls from returning.
#[test]
fn a_comm_that_hangs_ends_itself_with_a_sentence() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless", "--no-station"]);
    let station = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = station.local_addr().expect("an address").to_string();
    let comm = domain.lager(&["comm", "--station", &address]);
    let mut traced = Command::new("strace")
        .args(["-f", "-o", "/dev/null", "-e", "trace=sendto"])
        .args(["-e", "inject=sendto:delay_enter=6000000"])
        .arg(comm.get_program())
        .args(comm.get_args())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("strace, which tests/run installs");
    let _robot = station.accept().expect("the robot's call");
    let ended = wait_for("its end", || traced.try_wait().expect("a child"));
    let mut said = String::new();
    let told = traced
        .stderr
        .take()
        .expect("its words")
        .read_to_string(&mut said);
    told.expect("UTF-8");
    assert_eq!(ended.code(), Some(1), "{said}");
    assert!(said.contains("has taken 3 s"), "{said}");
    interrupt(&mut up, 0);
    domain.assert_clean();
}

/// Comm writes nothing on the bus, and the station uses none, so each writes signs of life.
#[test]
fn a_stopped_comm_and_a_stopped_station_are_replaced_by_themselves() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless", "--listen", "127.0.0.1:0"]);
    let others = |up: &mut Running| {
        ["attend", "simulator", "bridge", "logic"].map(|name| service(up, name, None))
    };
    let before = others(&mut up);
    for (name, called) in [
        ("comm", "the link to the station (comm)"),
        ("station", "the station"),
    ] {
        let stopped = service(&mut up, name, None);
        wait_for("its sign of life", || {
            let bus = domain.bus("r1", 1.0);
            let place = bus.home().expect("a folder");
            let sign = place.sign_of(&bus.unit, name)?;
            (sign.pid == stopped).then_some(())
        });
        kill(stopped, Signal::STOP);
        service(&mut up, name, Some(stopped));
        let told = format!("{called} does not answer any more and is killed");
        wait_for("the word of it", || {
            up.output().contains(&told).then_some(())
        });
    }
    assert_eq!(others(&mut up), before, "{}", up.output());
    interrupt(&mut up, 0);
    domain.assert_clean();
}

/// Nobody supervises this comm, so it stays frozen while `top` looks at it.
#[test]
fn top_does_not_say_that_all_is_well_while_a_service_is_frozen() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless", "--no-station"]);
    let station = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = station.local_addr().expect("an address").to_string();
    let comm = domain.start(&["comm", "--station", &address]);
    let _robot = station.accept().expect("the robot's call");
    comm.signal(Signal::STOP);
    wait_for("it to stop", || is_stopped(comm.pid()).then_some(()));
    let top = domain.run(&["top", "--once", "--duration", "1"]);
    let shown = String::from_utf8_lossy(&top.stdout).into_owned();
    comm.signal(Signal::CONT);
    let first = shown.lines().next().unwrap_or_default();
    assert!(
        first.contains("1 service") && first.contains("IN TROUBLE"),
        "{shown}"
    );
    let frozen = format!(
        "the link to the station (comm), process {}, is frozen",
        comm.pid()
    );
    assert!(shown.contains(&frozen), "{shown}");
    drop(comm);
    interrupt(&mut up, 0);
    domain.assert_clean();
}

/// Twelve busy loops; dropping this ends them.
struct Busy(Vec<std::process::Child>);

impl Busy {
    fn begin() -> Self {
        let endless = || {
            let mut shell = Command::new("timeout");
            shell.args(["300", "sh", "-c", "while :; do :; done"]);
            shell.spawn().expect("a shell")
        };
        Self((0..12).map(|_| endless()).collect())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        for shell in &mut self.0 {
            // `timeout` ends the loop that it has started.
            let _ = kill_process(pid(shell.id()), Signal::TERM);
            let _ = shell.wait();
        }
    }
}

#[test]
#[ignore = "keeps every core busy for minutes; `tests/soak busy` runs it"]
fn on_a_busy_machine_nothing_is_called_damaged_and_the_mission_is_carried_out() {
    let domain = Domain::new();
    let busy = Busy::begin();
    let args = ["up", "--headless", "--no-station", "--mission", "1"];
    let drives = |up: &Running| up.output().contains("drives from").then_some(());
    // The test kills all processes of the robot at once, and starts the robot again.
    for _ in 0..2 {
        let mut up = domain.start(&args);
        wait_for("the robot to drive", || drives(&up));
        let mut all = lager_tests::children(up.pid());
        all.push(up.pid());
        all.iter().for_each(|process| kill(*process, Signal::KILL));
        up.wait();
        assert!(!up.output().contains("damaged"), "{}", up.output());
    }
    let mut up = domain.start(&args);
    let was_delivered = |up: &Running| up.output().contains("DELIVERED goods 1");
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(120) && !was_delivered(&up) {
        assert!(up.is_running(), "{}{}", up.log(), up.output());
        std::thread::sleep(Duration::from_millis(100));
    }
    drop(busy);
    // When the load ends, the robot goes on by itself.
    wait_for("the delivery", || {
        assert!(up.is_running(), "{}{}", up.log(), up.output());
        was_delivered(&up).then_some(())
    });
    let said = up.output();
    assert!(
        !said.contains("damaged") && !said.contains("does not answer"),
        "{said}"
    );
    interrupt(&mut up, 0);
    domain.assert_clean();
}

#[test]
fn a_second_ctrl_c_ends_what_does_not_stop() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless"]);
    let observer = domain.observe("r1", 1.0);
    let mut health: Subscriber<LinkHealth> = observer.subscriber().expect("a topic");
    wait_for("the bridge", || {
        health.latest().expect("readable").map(|_| ())
    });
    let frozen: Vec<u32> = ["bridge", "logic", "simulator", "attend"]
        .into_iter()
        .map(|name| service(&mut up, name, None))
        .collect();
    for process in &frozen {
        kill(*process, Signal::STOP);
    }
    up.signal(Signal::INT);
    // Two presses with a shorter pause would count as one.
    std::thread::sleep(Duration::from_millis(400));
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}{}", up.log(), up.output());
    let told = up.log() + &up.output();
    assert!(!told.contains("does not stop"), "it waited: {told}");
    for process in frozen {
        assert!(has_ended(process));
    }
    drop((health, observer));
}

#[test]
fn up_says_how_it_ends_and_each_thing_once_and_counts_what_anybody_orders() {
    let domain = Domain::new();
    let mut up = start(&domain, &["up", "--headless", "--speed", "5"]);
    let says = |words: &str| {
        wait_for(words, || up.output().contains(words).then_some(()));
    };
    says("fetches goods 1");
    let run = |words: &[&str]| {
        let told = domain.run(words);
        assert!(told.status.success(), "{words:?}: {told:?}");
    };
    run(&["fetch", "2"]);
    run(&["stop"]);
    says("STOPPED");
    run(&["resume"]);
    says("the stop is released");
    says("DELIVERED goods 1");
    says("DELIVERED goods 2");
    interrupt(&mut up, 0);
    let told = up.output() + &up.log();
    let first = up.output().lines().next().map(str::to_owned);
    let first = first.unwrap_or_default();
    for words in ["Ctrl-C ends", "`lager top`", "`lager fetch 2`"] {
        assert!(first.contains(words), "{first}");
    }
    let lines = |words: &str| {
        let lines = told.lines().filter(|line| line.contains(words));
        lines.collect::<Vec<_>>()
    };
    let stops = told.lines().filter(|line| {
        let line = line.to_lowercase();
        line.contains("stopped")
    });
    assert_eq!(stops.count(), 1, "{told}");
    // The robot's lines say these, so its thoughts do not.
    for thought in ["I fetch goods", "are delivered", "I turn ", "take them to"] {
        assert!(lines(thought).is_empty(), "{thought}: {told}");
    }
    assert!(!lines("to go.").is_empty(), "{told}");
    assert_eq!(lines("2 delivered in").len(), 1, "{told}");
}
