//! Tests that a mission survives `kill -9`: of every service in the middle of the mission, and of
//! the supervisor itself. `tests/soak` runs the same tests with more kills.
//!
//! The tests of the boards and of the simulator check the bounds of 200 ms and 1 s in virtual time.
//! In real time only `tests/soak` asserts them, on a machine that does nothing else.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_ports::{BusConfig, NodeState, Subscriber};
use lager_rig::behind_ports;
use lager_sample::Stamp;
use lager_tests::{Domain, Running, WATCHDOG, children, has_ended, pid, wait_for};
use lager_topics::{LinkHealth, NavStatus, TruthPose};
use rustix::process::{Signal, kill_process};

/// The longest time that the robot may drive while nobody steers it.
const UNSTEERED: Duration = Duration::from_millis(200);

/// The longest time until a successor is at work.
const BACK: Duration = Duration::from_secs(1);

/// Kills in one mission. More would end it: the arm cannot pick goods if its body dies too often.
const IN_A_MISSION: u64 = 40;

/// How one mission may end besides its delivery: the claw has closed on nothing, since the robot did
/// not stand before its goods, and a person must help. That is 6 missions of 400 with 15 kills each
/// in virtual time, and 2 with motors that are alike (`simulate/killed.rs`).
const ASTRAY: &str = "GoodsMissing";

/// What the boards keep without power, in these files of a folder.
const EEPROMS: [&str; 2] = ["sensor.eeprom", "steering.eeprom"];

const MISSION: [&str; 6] = [
    "up",
    "--headless",
    "--mission",
    "1",
    "--exit-when-done",
    "--json",
];

/// The configuration of a robot whose boards keep their EEPROM in the folder of `domain`.
fn with_eeproms(domain: &Domain) -> String {
    let config = domain.folder().join("robot.toml");
    let text = format!("[chip]\neeprom = {:?}\n", domain.folder());
    std::fs::write(&config, text).expect("a configuration file");
    config.to_str().expect("a path in UTF-8").to_owned()
}

/// What the boards keep after a mission without kills: a real robot has driven before its services
/// die, and its steering board knows how much its motors differ.
fn learnt() -> [Vec<u8>; 2] {
    let domain = Domain::new();
    let config = with_eeproms(&domain);
    let args = [&["--config", &config], &MISSION[..], &["--speed", "4"]];
    let mut up = domain.start(&args.concat());
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let kept = EEPROMS.map(|file| std::fs::read(domain.folder().join(file)).expect("a file"));
    domain.assert_clean();
    kept
}

/// How often each service is killed: 5 in `tests/run`, more in `tests/soak`.
fn kills() -> u32 {
    std::env::var("LAGER_SOAK_KILLS")
        .ok()
        .and_then(|kills| kills.parse().ok())
        .unwrap_or(5)
}

fn is_soak() -> bool {
    std::env::var_os("LAGER_SOAK_KILLS").is_some()
}

/// An observer of the robot.
struct KillObserver {
    config: BusConfig,
    truth: Subscriber<TruthPose>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
}

/// The result of one kill.
struct Kill {
    service: &'static str,
    /// From the signal until the successor was at work again.
    back: Duration,
    /// How long after the signal the last duty other than 0 was seen while nobody steered.
    unsteered: Option<Duration>,
}

impl KillObserver {
    fn new(domain: &Domain) -> Self {
        let bus = domain.observe("r1", 1.0);
        Self {
            config: domain.bus("r1", 1.0),
            truth: bus.subscriber().expect("a topic"),
            health: bus.subscriber().expect("a topic"),
            status: bus.subscriber().expect("a topic"),
        }
    }

    /// Waits until all three services are at work and both boards are connected.
    fn wait_until_whole(&mut self, up: &mut Running) -> bool {
        let mut seen = (false, false, false);
        let give_up = Instant::now() + WATCHDOG;
        loop {
            assert!(Instant::now() < give_up, "never whole:\n{}", up.log());
            if !up.is_running() {
                return false;
            }
            seen.0 |= self.truth.latest().expect("readable").is_some();
            seen.1 |= self
                .health
                .latest()
                .expect("readable")
                .is_some_and(|health| health.sensor.up != 0 && health.steering.up != 0);
            seen.2 |= self.status.latest().expect("readable").is_some();
            if seen == (true, true, true) {
                return true;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Kills a service and watches until its successor is at work. `None` when the mission
    /// ended first.
    fn kill(&mut self, up: &mut Running, service: &'static str) -> Option<Kill> {
        let victim = up.service(service)?;
        let killed = Clock::monotonic_ns();
        kill_process(pid(victim), Signal::KILL).expect("a living service");
        let start = Instant::now();
        // When the world showed a duty other than 0, and when a service could steer again.
        let mut driven = Vec::new();
        let mut steered_again = None;
        loop {
            assert!(
                start.elapsed() < WATCHDOG,
                "{service} does not come back:\n{}",
                up.log()
            );
            if !up.is_running() {
                return None;
            }
            // What the supervisor publishes between the two processes is not the successor's.
            let successor = up.service(service).filter(|successor| *successor != victim);
            let is_back = |stamp: &Stamp| Some(stamp.writer) == successor;
            if let Some(truth) = self.truth.latest().expect("readable") {
                let duties = (truth.left_duty, truth.right_duty);
                if service == "simulator" && is_back(truth.stamp()) {
                    assert_eq!(duties, (0, 0), "a new body starts with its motors off");
                    break;
                }
                if duties != (0, 0) {
                    driven.push(truth.stamp().source_time_ns);
                }
            }
            let health = self.health.latest().expect("readable");
            if let Some(health) = health.filter(|health| is_back(health.stamp()))
                && service == "bridge"
                && health.steering.up != 0
            {
                steered_again.get_or_insert(health.stamp().publish_time_ns);
                if health.sensor.up != 0 {
                    break;
                }
            }
            let status = self.status.latest().expect("readable");
            if let Some(status) = status.filter(|status| is_back(status.stamp()))
                && service == "logic"
            {
                steered_again.get_or_insert(status.stamp().publish_time_ns);
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let back = start.elapsed();
        wait_for("the dead processes' files to be removed", || {
            let nodes = lager_ports::nodes(&self.config).expect("a bus");
            let stale = nodes.iter().any(|node| node.state == NodeState::Stale);
            (!stale).then_some(())
        });
        let unsteered = driven
            .into_iter()
            .filter(|at| steered_again.is_some_and(|steered| *at < steered))
            .map(|at| Duration::from_nanos(at.saturating_sub(killed)))
            .max()
            .unwrap_or_default();
        if is_soak() {
            // A time of this machine, so asserted only where nothing else runs. The boards' and the
            // simulator's tests check the bound itself in virtual time.
            assert!(
                unsteered <= UNSTEERED,
                "there was duty {unsteered:?} after the {service} had been killed"
            );
            assert!(back <= BACK, "the {service} took {back:?} to come back");
        }
        Some(Kill {
            service,
            back,
            // The motors of a killed simulator are gone with it, so there is no duty to see.
            unsteered: (service != "simulator").then_some(unsteered),
        })
    }
}

#[test]
fn a_killed_service_comes_back_and_the_mission_still_ends() {
    let mut left: BTreeMap<&'static str, u32> = ["bridge", "logic", "simulator"]
        .into_iter()
        .map(|service| (service, kills()))
        .collect();
    let mut done: Vec<Kill> = Vec::new();
    let mut missions = 0;
    let mut astray = false;
    let kept = learnt();
    while left.values().any(|kills| *kills > 0) {
        let domain = Domain::new();
        for (file, kept) in EEPROMS.iter().zip(&kept) {
            std::fs::write(domain.folder().join(file), kept).expect("a file");
        }
        let config = with_eeproms(&domain);
        let mut up = domain.start(&[&["--config", &config], &MISSION[..]].concat());
        let mut watch = KillObserver::new(&domain);
        let mut of_this_mission = 0;
        'mission: loop {
            let next = left
                .iter()
                .filter(|(_, kills)| **kills > 0)
                .max_by_key(|(_, kills)| **kills)
                .map(|(service, _)| *service);
            let Some(service) = next.filter(|_| of_this_mission < IN_A_MISSION) else {
                break 'mission;
            };
            if !watch.wait_until_whole(&mut up) {
                break 'mission;
            }
            // Every kill comes at another point of the mission, since the steps of the pause share
            // no factor with the lengths of drives and turns.
            let pause = 400 + (done.len() as u64 * 617) % 1_300;
            std::thread::sleep(Duration::from_millis(pause));
            let Some(kill) = watch.kill(&mut up, service) else {
                break 'mission;
            };
            *left.get_mut(service).expect("a service") -= 1;
            done.push(kill);
            of_this_mission += 1;
        }
        let ended = up.wait();
        let told = up.json();
        let why = told["failure_kind"].as_str().unwrap_or_default();
        if why == ASTRAY && !astray {
            // The same number of kills again, in another mission.
            astray = true;
            println!("a mission ended in a standstill: {}", told["failure"]);
            for kill in done.iter().rev().take(of_this_mission as usize) {
                *left.get_mut(kill.service).expect("a service") += 1;
            }
            assert_eq!(ended, Some(3), "{}", up.log());
        } else {
            assert_eq!(ended, Some(0), "{}", up.log());
            assert_eq!(told["delivered"], serde_json::json!([1]), "{}", up.log());
        }
        // On a busy machine the supervisor also restarts services that were silent for too long.
        let restarts = told["restarts"].as_u64().expect("restarts");
        assert!(restarts >= of_this_mission, "{told}\n{}", up.log());
        assert!(
            of_this_mission > 0,
            "the mission met no kill:\n{}",
            up.log()
        );
        missions += 1;
        drop(watch);
        domain.assert_clean();
    }
    report(&done, missions);
}

/// Prints the measured times. No test fails because of them.
fn report(kills: &[Kill], missions: u32) {
    println!("{missions} missions");
    println!("service      kills   back: median    longest   last duty after");
    for service in ["bridge", "logic", "simulator"] {
        let mut back: Vec<Duration> = Vec::new();
        let mut unsteered = None;
        for kill in kills.iter().filter(|kill| kill.service == service) {
            back.push(kill.back);
            unsteered = unsteered.max(kill.unsteered);
        }
        back.sort();
        println!(
            "{service:12} {:5} {:12.1} ms {:7.1} ms {:>9}",
            back.len(),
            back[back.len() / 2].as_secs_f64() * 1e3,
            back[back.len() - 1].as_secs_f64() * 1e3,
            unsteered.map_or("-".into(), |after| format!(
                "{:.1} ms",
                after.as_secs_f64() * 1e3
            )),
        );
    }
}

#[test]
fn a_killed_supervisor_stops_the_robot_and_takes_its_children_along() {
    let domain = Domain::new();
    // The robot is a process of its own, as real boards are, and survives the supervisor.
    let [sensor, steering] = ["sensor.tty", "steering.tty"].map(|name| domain.folder().join(name));
    let config = domain.folder().join("robot.toml");
    let text = behind_ports(&sensor, &steering).expect("a description");
    std::fs::write(&config, format!("warehouse = \"small\"\n{text}"))
        .expect("a configuration file");
    let config = config.to_str().expect("a path in UTF-8");
    let body = domain.start(&["--config", config, "simulator"]);
    let up = ["--config", config, "up", "--script", "--mission", "1"];
    let mut first = domain.start(&up);
    let mut watch = KillObserver::new(&domain);
    let driving = |watch: &mut KillObserver| {
        wait_for("the robot to drive", || {
            watch
                .truth
                .latest()
                .expect("readable")
                .filter(|truth| truth.left_duty > 0)
                .map(|_| ())
        });
    };
    // Real boards begin with a stop that a person has to release.
    let resume = || {
        wait_for("the stop to be released", || {
            let said = domain.run(&["resume"]);
            said.status.success().then_some(())
        });
    };
    resume();
    driving(&mut watch);
    let services = children(first.pid());
    assert_eq!(services.len(), 5, "{services:?}");

    first.signal(Signal::KILL);
    first.wait();
    wait_for("the motors to stop", || {
        watch
            .truth
            .latest()
            .expect("readable")
            .filter(|truth| truth.left_duty == 0 && truth.right_duty == 0)
            .map(|_| ())
    });
    for service in services {
        wait_for("the child to end", || has_ended(service).then_some(()));
    }

    // Nobody has to clean up by hand: the same name starts again beside the running boards.
    let second = domain.start(&up);
    resume();
    driving(&mut watch);
    drop((second, watch, body));
    domain.assert_clean();
}
