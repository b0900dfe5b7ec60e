//! Nothing comes back by itself, and no order moves the robot unseen: frozen processes, requests
//! that come too late, a cable whose half towards the bridge is cut, and a cable that is noisy in
//! each turn.

use std::time::Duration;

use lager_ports::{Clock, Subscriber};
use lager_tests::{Cable, Domain, Running, is_stopped, pid, wait_for};
use lager_topics::{
    Health, Hold, LinkHealth, Mode, NavStatus, Origin, Phase, Refusal, SteeringState, TruthPose,
};
use rustix::process::{Signal, kill_process};

/// What an observer sees of the robot.
struct Watch {
    truth: Subscriber<TruthPose>,
    health: Subscriber<LinkHealth>,
    steering: Subscriber<SteeringState>,
}

impl Watch {
    fn new(domain: &Domain) -> Self {
        let bus = domain.observe("r1", 1.0);
        Self {
            truth: bus.subscriber().expect("a topic"),
            health: bus.subscriber().expect("a topic"),
            steering: bus.subscriber().expect("a topic"),
        }
    }

    fn wait_for_health(&mut self, what: &str, wanted: impl Fn(&Health) -> bool) -> Health {
        wait_for(what, || {
            let health = self.health.latest().expect("readable")?;
            wanted(&health).then_some(*health)
        })
    }

    fn wait_to_stand(&mut self) {
        wait_for("the robot to stand", || self.moves().filter(|moves| !moves));
    }

    /// Whether its wheels turn, if the world has news.
    fn moves(&mut self) -> Option<bool> {
        let truth = self.truth.latest().expect("readable")?;
        Some(truth.left_duty != 0 || truth.right_duty != 0)
    }

    /// Whether an order of a person that was first given after `began` is in force, if the board
    /// has news. An order's id is the milliseconds of the moment when it was first given.
    fn obeys(&mut self, began: u64) -> Option<bool> {
        let report = self.steering.latest().expect("readable")?;
        let by_person = report.current_origin == Origin::Operator;
        let began = (began / 1_000_000) as u32;
        Some(by_person && report.current_id.wrapping_sub(began) < u32::MAX / 2)
    }

    /// The robot stands in everything the world shows from now on, for half a second of it.
    fn assert_stands(&mut self) {
        let from = Clock::monotonic_ns();
        let mut seen = 0;
        while seen < 20 {
            let truth = wait_for("the world", || self.truth.latest().expect("readable"));
            if truth.stamp().publish_time_ns > from {
                assert_eq!(
                    (truth.left_duty, truth.right_duty),
                    (0, 0),
                    "the robot moves, by {:?}; {:?}",
                    self.steering.latest().expect("readable").as_deref(),
                    self.health.latest().expect("readable").as_deref(),
                );
                seen += 1;
            }
            drop(truth);
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Runs `lager` with `args` until it succeeds.
fn insist(domain: &Domain, args: &[&str]) {
    wait_for(&format!("{args:?}"), || {
        domain.run(args).status.success().then_some(())
    });
}

fn freeze(process: u32) {
    kill_process(pid(process), Signal::STOP).expect("a living process");
    wait_for("the process to stop", || is_stopped(process).then_some(()));
}

/// A simulated robot in manual mode, driven forward by hand.
fn driven_by_hand(domain: &Domain) -> (Running, Watch, Running) {
    let up = domain.start(&["up"]);
    let mut watch = Watch::new(domain);
    watch.wait_for_health("the steering board", |health| health.steering.up != 0);
    insist(domain, &["mode", "manual"]);
    let drive = driving(domain, &mut watch, &["drive", "forward"]);
    (up, watch, drive)
}

/// Somebody who drives the robot, which moves. One who was held up for longer than his order lasts
/// has ended with a sentence, and somebody else drives; it is this one's order that the robot is
/// seen to move by.
fn driving(domain: &Domain, watch: &mut Watch, drive: &[&str]) -> Running {
    let mut began = Clock::monotonic_ns();
    let mut driver = domain.start(drive);
    let mut obeyed = false;
    wait_for("the robot to drive", || {
        if !driver.is_running() {
            began = Clock::monotonic_ns();
            driver = domain.start(drive);
            obeyed = false;
        }
        obeyed |= watch.obeys(began) == Some(true);
        (watch.moves() == Some(true) && obeyed).then_some(())
    });
    driver
}

#[test]
fn a_frozen_drive_does_not_move_the_robot_again() {
    let domain = Domain::new();
    let (up, mut watch, mut drive) = driven_by_hand(&domain);
    freeze(drive.pid());
    watch.wait_to_stand();
    // Long enough for every memory of the order to be gone.
    std::thread::sleep(Duration::from_millis(1_500));
    drive.signal(Signal::CONT);
    watch.assert_stands();
    assert_eq!(drive.wait(), Some(1), "{}", drive.log());
    let log = drive.log();
    assert!(
        log.contains("held up") || log.contains("cut short"),
        "it says so: {log}"
    );
    insist(&domain, &["drive", "forward", "--seconds", "0.2"]);
    drop((up, watch, drive));
    domain.assert_clean();
}

#[test]
fn a_request_that_a_frozen_bridge_finds_later_changes_nothing() {
    let domain = Domain::new();
    let up = domain.start(&["up"]);
    let mut watch = Watch::new(&domain);
    watch.wait_for_health("the steering board", |health| health.steering.up != 0);
    insist(&domain, &["mode", "manual"]);
    watch.wait_for_health("manual mode", |health| health.mode == Mode::Manual);
    let bridge = up.service("bridge").expect("a bridge");
    freeze(bridge);
    let refused = domain.run(&["mode", "autonomous"]);
    assert!(!refused.status.success());
    // The question of an asker that ends goes with it. Of one that is frozen as well it is still
    // there, and only its age tells that nobody waits any more.
    let mut asker = domain.start(&["mode", "autonomous"]);
    std::thread::sleep(Duration::from_millis(250));
    freeze(asker.pid());
    std::thread::sleep(Duration::from_millis(500));
    let from = Clock::monotonic_ns();
    kill_process(pid(bridge), Signal::CONT).expect("a living process");
    for _ in 0..5 {
        let health = wait_for("the bridge to go on", || {
            let health = watch.health.latest().expect("readable");
            health.filter(|health| health.stamp().publish_time_ns > from)
        });
        assert_eq!(health.mode, Mode::Manual);
    }
    // It ends in order, whether it had put its question by then or puts it now.
    asker.signal(Signal::CONT);
    asker.wait();
    drop((up, watch));
    domain.assert_clean();
}

#[test]
fn a_robot_whose_steering_board_is_not_heard_stands_and_goes_on_by_a_new_order_only() {
    let domain = Domain::new();
    let (body, plugged, config) = boards_at_a_cable(&domain);
    let bridge = domain.start(&["--config", &config, "bridge"]);
    let mut watch = Watch::new(&domain);
    watch.wait_for_health("both boards", |health| {
        health.steering.up != 0 && health.sensor.up != 0
    });
    insist(&domain, &["--config", &config, "mode", "manual"]);
    insist(&domain, &["--config", &config, "resume"]);
    let forward = ["--config", &config, "drive", "forward"];
    let mut drive = driving(&domain, &mut watch, &forward);

    plugged.cut_reports(true);
    watch.wait_for_health("people to see why", |health| {
        health.blocked == Refusal::BoardSilent
    });
    watch.wait_to_stand();
    assert_eq!(drive.wait(), Some(1), "{}", drive.log());
    let log = drive.log();
    let why = "steering board does not report";
    // One that was kept from its core meanwhile says that instead.
    assert!(log.contains(why) || log.contains("held up"), "{log}");
    let other = domain.run_renewed(&forward);
    assert!(!other.status.success());
    let said = String::from_utf8_lossy(&other.stderr);
    assert!(said.contains(why), "{said}");
    watch.assert_stands();

    plugged.cut_reports(false);
    watch.wait_for_health("the board to be heard", |health| {
        health.blocked == Refusal::None
    });
    watch.assert_stands();
    let seconds = ["--config", &config, "drive", "forward", "--seconds", "0.5"];
    let again = domain.run_renewed(&seconds);
    assert!(again.status.success(), "{again:?}");
    drop((bridge, plugged, body, watch, drive));
    domain.assert_clean();
}

/// Boards as a process, a cable at the steering board, and the configuration of who is wired to
/// them.
fn boards_at_a_cable(domain: &Domain) -> (Running, Cable, String) {
    let file = |name: &str| domain.folder().join(name);
    let [sensor, steering, cable] = ["sensor.tty", "steering.tty", "cable.tty"].map(file);
    let write = |name: &str, steering: &std::path::Path| {
        let path = file(name);
        let serial = format!("[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
        std::fs::write(&path, format!("body = \"serial\"\n{serial}")).expect("a configuration");
        path.to_str().expect("a path in UTF-8").to_owned()
    };
    let (boards, config) = (
        write("boards.toml", &steering),
        write("bridge.toml", &cable),
    );
    let body = domain.start(&["--config", &boards, "simulator"]);
    let plugged = wait_for("the boards' port", || {
        steering.exists().then(|| Cable::plug(&steering, &cable))
    });
    (body, plugged, config)
}

#[test]
fn a_mission_stands_while_the_steering_board_is_not_heard_and_is_delivered_after() {
    let domain = Domain::new();
    let (body, plugged, config) = boards_at_a_cable(&domain);
    let mut up = domain.start(&[
        "--config",
        &config,
        "up",
        "--script",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
    ]);
    let mut watch = Watch::new(&domain);
    let bus = domain.observe("r1", 1.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    insist(&domain, &["--config", &config, "resume"]);
    let mut wait_for_logic = |what: &str, phase: Phase, hold: Hold| {
        wait_for(what, || {
            let status = status.latest().expect("readable")?;
            (status.phase == phase && status.hold == hold).then_some(())
        });
    };
    wait_for_logic("the robot to drive", Phase::Driving, Hold::None);
    wait_for("the wheels to turn", || {
        watch.moves().filter(|moves| *moves)
    });

    plugged.cut_reports(true);
    wait_for_logic("logic to say why it stands", Phase::Driving, Hold::Unheard);
    watch.wait_for_health("the bridge to say so", |health| {
        health.blocked == Refusal::BoardSilent
    });
    watch.wait_to_stand();
    watch.assert_stands();

    plugged.cut_reports(false);
    wait_for_logic("logic to go on", Phase::Driving, Hold::None);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([1]), "{}", up.log());
    drop((body, plugged, watch, status, bus));
    domain.assert_clean();
}

#[test]
fn noise_on_the_cable_in_each_turn_costs_no_mission() {
    let domain = Domain::new();
    let (body, cable, config) = boards_at_a_cable(&domain);
    let mut up = domain.start(&[
        "--config",
        &config,
        "up",
        "--script",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
    ]);
    let bus = domain.observe("r1", 1.0);
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    insist(&domain, &["--config", &config, "resume"]);
    let mut turns = 0;
    let mut turning = false;
    while up.is_running() {
        if let Some(status) = status.latest().expect("readable") {
            let in_turns = [
                Phase::Turning,
                Phase::Positioning,
                Phase::Leaving,
                Phase::TurningRound,
            ];
            let turns_now = in_turns.into_iter().any(|phase| status.phase == phase);
            if turns_now && !turning {
                turns += 1;
                drop(status);
                // In the middle: a turn takes some two seconds.
                std::thread::sleep(Duration::from_millis(400));
                cable.make_noise(true);
                std::thread::sleep(Duration::from_secs(1));
                cable.make_noise(false);
            }
            turning = turns_now;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    assert!(turns >= 2, "{turns} turns");
    assert_eq!(
        up.json()["delivered"],
        serde_json::json!([1]),
        "{}",
        up.log()
    );
    drop((body, cable, status, bus));
    domain.assert_clean();
}
