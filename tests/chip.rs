//! The robot on its boards' real images: `lager up --body chip`, whose emulator is a process that a
//! test can slow, stop or kill. `tests/run` builds the emulator and the images first.

use std::fs;
use std::time::Duration;

use lager_home::Clock;
use lager_ports::{Bus, BusConfig, Subscriber};
use lager_tests::{Domain, Running, children, has_ended, in_tree, is_stopped, pid, wait_for};
use lager_topics::{GoodState, LinkHealth, NavStatus, Phase, Role, TruthPose};
use rustix::process::{Signal, kill_process};

/// How long a test stops the emulator.
const HELD_UP: Duration = Duration::from_millis(1_500);

const MISSION: [&str; 8] = [
    "up",
    "--body",
    "chip",
    "--headless",
    "--mission",
    "1",
    "--exit-when-done",
    "--json",
];

const IMAGES: &str = "firmware/avr/target/images";

/// A mission on the images.
fn up(domain: &Domain, more: &[&str]) -> Running {
    let arguments: Vec<&str> = MISSION.iter().chain(more).copied().collect();
    started(domain, &arguments)
}

/// `lager` with the images. Built in another target folder it does not find them without a path.
fn started(domain: &Domain, given: &[&str]) -> Running {
    let emulator = lager_tests::emulator();
    let mut command = domain.lager(given);
    for (flag, path) in [("--emulator", emulator), ("--images", in_tree(IMAGES))] {
        if std::env::var_os("CARGO_TARGET_DIR").is_some() && !given.contains(&flag) {
            command.arg(flag).arg(path);
        }
    }
    domain.launch(command)
}

/// An observer of the robot, with the robot's own clock.
struct ChipObserver {
    clock: Clock,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    truth: Subscriber<TruthPose>,
}

impl ChipObserver {
    /// Joins as soon as the robot has a clock.
    fn new(domain: &Domain, up: &mut Running) -> Self {
        let config = BusConfig {
            clock: Some(domain.clock_page("r1")),
            ..domain.bus("r1", 1.0)
        };
        let bus = wait_for("the clock page", || {
            assert!(up.is_running(), "{}", up.log());
            Bus::open(&config, Role::Observer).ok()
        });
        Self {
            clock: bus.clock(),
            health: bus.subscriber().expect("a topic"),
            status: bus.subscriber().expect("a topic"),
            truth: bus.subscriber().expect("a topic"),
        }
    }

    fn wait_until(&mut self, up: &mut Running, phase: Phase) {
        wait_for(&format!("the robot to be {phase:?}"), || {
            assert!(up.is_running(), "{}", up.log());
            let status = self.status.latest().expect("readable")?;
            (status.phase.get() == Some(phase)).then_some(())
        });
    }

    /// Waits for the end of the mission and returns its JSON. Before that it waits until the world
    /// shows product 1 at its destination.
    fn delivered(&mut self, up: &mut Running) -> serde_json::Value {
        let mut state = None;
        while up.is_running() {
            if let Some(truth) = self.truth.latest().expect("readable") {
                let good = truth.goods().iter().find(|good| good.id == 1);
                state = good.and_then(|good| good.state.get());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        assert_eq!(up.wait(), Some(0), "{}", up.log());
        assert_eq!(state, Some(GoodState::Delivered), "{}", up.log());
        let told = up.json();
        assert_eq!(told["delivered"], serde_json::json!([1]), "{told}");
        told
    }
}

/// The process of the emulator.
fn emulator(up: &Running) -> u32 {
    wait_for("the emulator", || {
        children(up.service("emulator")?).first().copied()
    })
}

#[test]
fn a_mission_on_the_real_images_is_delivered_even_if_they_are_held_up() {
    let domain = Domain::new();
    let mut up = up(&domain, &[]);
    let mut watch = ChipObserver::new(&domain, &mut up);
    watch.wait_until(&mut up, Phase::Driving);

    let chips = emulator(&up);
    kill_process(pid(chips), Signal::STOP).expect("a living emulator");
    wait_for("the emulator to stop", || is_stopped(chips).then_some(()));
    let before = watch.clock.now();
    std::thread::sleep(HELD_UP);
    assert_eq!(watch.clock.now(), before, "the robot's time stands still");
    kill_process(pid(chips), Signal::CONT).expect("a living emulator");
    wait_for("time to go on", || {
        (watch.clock.now() > before + Duration::from_millis(500)).then_some(())
    });

    let told = watch.delivered(&mut up);
    assert_eq!(told["restarts"], 0, "{told}\n{}", up.log());
    assert!(!up.log().contains("silent"), "{}", up.log());
    drop(watch);
    domain.assert_clean();
}

#[test]
fn gains_outlive_a_clean_end() {
    let domain = Domain::new();
    let steering = domain.eeprom("r1").join("steering.eeprom");
    let mut up = up(&domain, &[]);
    let mut watch = ChipObserver::new(&domain, &mut up);
    watch.wait_until(&mut up, Phase::Driving);
    let told = domain.run(&["gains", "7", "9"]);
    assert!(told.status.success(), "{told:?}");
    // A board takes 50 ms of its time for one save.
    let kept = wait_for("the gains to be kept", || {
        fs::read(&steering)
            .ok()
            .filter(|bytes| bytes[2..4] == [7, 9])
    });
    drop(watch);
    up.signal(Signal::INT);
    // The test interrupts it before the mission is delivered.
    assert_eq!(up.wait(), Some(3), "{}", up.log());
    assert_eq!(fs::read(&steering).expect("it is still there"), kept);

    let mut again = self::up(&domain, &[]);
    let mut watch = ChipObserver::new(&domain, &mut again);
    watch.wait_until(&mut again, Phase::Driving);
    drop(watch);
    again.signal(Signal::INT);
    assert_eq!(again.wait(), Some(3), "{}", again.log());
    assert_eq!(fs::read(&steering).expect("and for the next"), kept);
}

#[test]
fn a_robot_on_the_images_is_put_down_by_hand_and_drives_from_there() {
    let domain = Domain::new();
    let mut up = started(
        &domain,
        &["up", "--body", "chip", "--headless", "--mission", "1"],
    );
    let mut watch = ChipObserver::new(&domain, &mut up);
    watch.wait_until(&mut up, Phase::Driving);
    let run = |args: &[&str]| domain.done(args);
    run(&["mode", "manual"]);
    run(&["place", "1,2,down"]);
    let put_down = wait_for("it to stand there", || {
        let status = watch.status.latest().expect("readable")?;
        ((status.x, status.y) == (1, 2))
            .then(|| wait_for("the truth", || watch.truth.latest().ok()?))
    });
    // The world of the images has movable things, too; they outlive the emulator.
    run(&["obstacle", "put", "0,1,up"]);
    let refused = domain.run(&["obstacle", "put", "1,2,down"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && said.contains("the robot is there"),
        "{said}"
    );
    let emulator = up.service("emulator").expect("it runs");
    kill_process(pid(emulator), Signal::KILL).expect("a process of ours");
    wait_for("another emulator", || {
        up.service("emulator").filter(|now| *now != emulator)
    });
    wait_for("its world", || {
        let listed = domain.run(&["obstacle"]);
        (listed.stdout == b"0,1,up\n").then_some(())
    });
    run(&["obstacle", "take", "0,2,down"]);
    run(&["place"]);
    wait_for("it to stand at the start", || {
        let status = watch.status.latest().expect("readable")?;
        ((status.x, status.y) == (0, 0)).then_some(())
    });
    let start = wait_for("the truth", || watch.truth.latest().ok()?);
    let away = (put_down.x_mm - start.x_mm).hypot(put_down.y_mm - start.y_mm);
    // From (1,2) to the delivery node at (0,0), in a world of edges of some 400 mm.
    assert!(away > 500.0, "the body has moved {away} mm");
    drop((put_down, start));
    run(&["mode", "autonomous"]);
    run(&["fetch", "1"]);
    watch.wait_until(&mut up, Phase::Driving);
    drop((up, watch));
    domain.assert_clean();
}

#[test]
fn a_killed_emulator_is_started_again_and_the_mission_ends() {
    let domain = Domain::new();
    // `--speed 20`: as fast as the machine can, and the services keep up.
    let mut up = up(&domain, &["--speed", "20"]);
    let mut watch = ChipObserver::new(&domain, &mut up);
    let restarted = |watch: &mut ChipObserver, up: &mut Running, victim: u32, chips: u32| {
        let before = watch.clock.now();
        kill_process(pid(victim), Signal::KILL).expect("a living process");
        wait_for("the emulator to end", || has_ended(chips).then_some(()));
        let next = wait_for("another emulator", || {
            assert!(up.is_running(), "{}", up.log());
            let service = up.service("emulator")?;
            children(service)
                .first()
                .copied()
                .filter(|next| *next != chips)
        });
        wait_for("its boards", || {
            let health = watch.health.latest().expect("readable")?;
            let whole = health.sensor.up != 0 && health.steering.up != 0;
            (whole && watch.clock.now() > before + Duration::from_secs(1)).then_some(())
        });
        next
    };

    watch.wait_until(&mut up, Phase::Driving);
    let first = emulator(&up);
    let second = restarted(&mut watch, &mut up, first, first);
    // When the service that started the emulator ends, it ends the emulator, too.
    watch.wait_until(&mut up, Phase::Leaving);
    let service = up.service("emulator").expect("a service");
    restarted(&mut watch, &mut up, service, second);

    let told = watch.delivered(&mut up);
    assert_eq!(told["restarts"], 2, "{told}\n{}", up.log());
    drop(watch);
    domain.assert_clean();
}

#[test]
fn a_killed_supervisor_takes_the_emulator_along_and_the_next_one_starts() {
    let domain = Domain::new();
    let mut first = up(&domain, &[]);
    let mut watch = ChipObserver::new(&domain, &mut first);
    watch.wait_until(&mut first, Phase::Driving);
    let (service, chips) = (
        first.service("emulator").expect("a service"),
        emulator(&first),
    );
    drop(watch);
    first.signal(Signal::KILL);
    first.wait();
    for process in [service, chips] {
        wait_for("the child to end", || has_ended(process).then_some(()));
    }

    let mut second = up(&domain, &[]);
    // The clock page of the killed robot may still exist for a moment; the new robot's time moves.
    wait_for("the next robot to drive", || {
        let mut watch = ChipObserver::new(&domain, &mut second);
        let start = watch.clock.now();
        let moves = (0..1_000).any(|_| {
            std::thread::sleep(Duration::from_millis(1));
            watch.clock.now() > start
        });
        moves.then(|| watch.wait_until(&mut second, Phase::Driving))
    });
    second.signal(Signal::TERM);
    assert_eq!(second.wait(), Some(3), "{}", second.log());
    domain.assert_clean();
}

#[test]
fn what_is_missing_is_an_error_that_tells_how_to_build_it() {
    let domain = Domain::new();
    let nowhere = domain.folder().join("nowhere");
    let nowhere = nowhere.to_str().expect("a path in UTF-8");
    let refused = domain.run(&["up", "--images", nowhere, "--emulator", nowhere]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    for words in [
        "firmware/avr/build",
        "cargo build --release` in firmware/emulator",
    ] {
        assert!(said.contains(words), "`{words}` is missing: {said}");
    }

    let config = domain.folder().join("robot.toml");
    let chip = format!("body = \"chip\"\n[chip]\nemulator = {nowhere:?}\n");
    std::fs::write(&config, chip).expect("a configuration file");
    let config = config.to_str().expect("a path in UTF-8");
    let doctor = domain.run(&["--config", config, "doctor"]);
    assert_eq!(doctor.status.code(), Some(1));
    let said = String::from_utf8_lossy(&doctor.stdout).into_owned();
    let line = said.lines().find(|line| line.contains("emulated boards"));
    let line = line.expect("a line on the emulated boards");
    assert!(line.starts_with("BAD"), "{said}");
    assert!(said.contains("firmware/emulator"), "{said}");
    domain.assert_clean();
}

#[test]
fn images_for_another_baud_rate_are_told_and_given_up() {
    let domain = Domain::new();
    let images = in_tree(IMAGES);
    let images = images.to_str().expect("a path in UTF-8");
    let mut up = up(&domain, &["--baud", "9600", "--images", images]);
    assert_eq!(up.wait(), Some(1), "{}", up.log());
    let log = up.log();
    assert!(
        log.contains("the emulated boards (emulator) cannot start"),
        "{log}"
    );
    assert!(
        log.contains("sends at 500000 Bd and the port is at 9600"),
        "{log}"
    );
    domain.assert_clean();
}

#[test]
fn an_emulator_that_cannot_run_ends_up_with_a_sentence() {
    let domain = Domain::new();
    let images = domain.folder().join("images");
    std::fs::create_dir(&images).expect("a folder");
    for image in ["sensor.elf", "steering.elf"] {
        std::fs::write(images.join(image), b":10000000").expect("a file");
    }
    let mut up = up(
        &domain,
        &["--images", images.to_str().expect("a path in UTF-8")],
    );
    assert_eq!(up.wait(), Some(1), "{}", up.log());
    let log = up.log();
    assert!(log.contains("not an ELF file for an AVR"), "{log}");
    assert!(
        log.contains("the emulated boards (emulator) cannot start"),
        "{log}"
    );
    domain.assert_clean();
}
