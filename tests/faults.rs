//! What the robot survives: every service killed with -9 in the middle of a mission, and the
//! supervisor itself. `tests/soak` runs the same with more kills.
//!
//! The bounds of 200 ms and of one second are held in virtual time by the tests of the boards and
//! of the simulator. In real time only `tests/soak` asserts them, which wants a machine of its own.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lager_ports::{BusConfig, Clock, NodeState, Subscriber};
use lager_tests::{Domain, Running, WATCHDOG, children, has_ended, pid, wait_for};
use lager_topics::{LinkHealth, NavStatus, Stamp, TruthPose};
use rustix::process::{Signal, kill_process};

/// The safe bound on driving without being steered.
const UNSTEERED: Duration = Duration::from_millis(200);

/// The bound on coming back.
const BACK: Duration = Duration::from_secs(1);

/// Kills in one mission: the arm gets no goods picked while its body dies every few seconds.
const IN_A_MISSION: u64 = 40;

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

/// What an observer sees of the robot.
struct Watch {
    config: BusConfig,
    truth: Subscriber<TruthPose>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
}

/// What one kill came to.
struct Kill {
    service: &'static str,
    /// From the signal until the successor was at work again.
    back: Duration,
    /// How long after the signal the last duty other than 0 was seen while nobody steered.
    unsteered: Option<Duration>,
}

impl Watch {
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
        // When the world showed a duty other than 0, and when somebody could steer again.
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
            // What the supervisor hands over between the two is not the successor's word.
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
        wait_for("the dead to be swept", || {
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
            // Measured, so only where nothing else runs; the bound itself is held in virtual
            // time, by the boards' and the simulator's tests.
            assert!(
                unsteered <= UNSTEERED,
                "there was duty {unsteered:?} after the {service} had been killed"
            );
            assert!(back <= BACK, "the {service} took {back:?} to come back");
        }
        Some(Kill {
            service,
            back,
            // A killed simulator takes the motors with it: there is nothing to see.
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
    while left.values().any(|kills| *kills > 0) {
        let domain = Domain::new();
        let mut up = domain.start(&[
            "up",
            "--headless",
            "--mission",
            "1",
            "--exit-when-done",
            "--json",
        ]);
        let mut watch = Watch::new(&domain);
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
            // Every kill meets the mission in another place; the steps share no factor with the
            // lengths of drives and turns.
            let pause = 400 + (done.len() as u64 * 617) % 1_300;
            std::thread::sleep(Duration::from_millis(pause));
            let Some(kill) = watch.kill(&mut up, service) else {
                break 'mission;
            };
            *left.get_mut(service).expect("a service") -= 1;
            done.push(kill);
            of_this_mission += 1;
        }
        assert_eq!(up.wait(), Some(0), "{}", up.log());
        let told = up.json();
        assert_eq!(told["delivered"], serde_json::json!([1]), "{}", up.log());
        // What a held-up machine kept silent for too long was started again as well.
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

/// Prints what was measured; a figure here is no verdict.
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
    // The robot is a process of its own, as real boards are, and lives on.
    let [sensor, steering] = ["sensor.tty", "steering.tty"].map(|name| domain.folder().join(name));
    let config = domain.folder().join("robot.toml");
    std::fs::write(
        &config,
        format!("body = \"serial\"\n[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n"),
    )
    .expect("a configuration file");
    let config = config.to_str().expect("a path in UTF-8");
    let body = domain.start(&["--config", config, "simulator"]);
    let up = ["--config", config, "up", "--script", "--mission", "1"];
    let mut first = domain.start(&up);
    let mut watch = Watch::new(&domain);
    let driving = |watch: &mut Watch| {
        wait_for("the robot to drive", || {
            watch
                .truth
                .latest()
                .expect("readable")
                .filter(|truth| truth.left_duty > 0)
                .map(|_| ())
        });
    };
    // Real boards start stopped.
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

    // Nothing has to be cleaned by hand: the same name starts again beside the running boards.
    let second = domain.start(&up);
    resume();
    driving(&mut watch);
    drop((second, watch, body));
    domain.assert_clean();
}
