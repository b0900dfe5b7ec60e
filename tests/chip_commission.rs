//! Robots on their boards' real images that nobody has described are commissioned by `lager commission`
//! and deliver after a restart. `tests/run` builds the emulator and the images first.
//!
//! Two emulated chips are about as fast as real ones, so one robot takes some minutes. The first
//! `LAGER_CHIP_SEEDS` robots are commissioned, 1 unless that says more; `LAGER_CHIP_SEEDS=4..10` begins
//! with the fourth.

#[path = "commission/person.rs"]
mod person;

use std::fs;
use std::time::{Duration, Instant};

use lager_plant::Build;
use lager_ports::{Bus, BusConfig};
use lager_tests::{Domain, Running, in_tree, wait_for};
use lager_topics::{Role, TruthPose};
use person::{Person, let_logic_drive};
use rustix::process::Signal;

const IMAGES: &str = "firmware/avr/target/images";

/// `lager up` with the images. Built in another target folder it does not find them without a path.
fn up(domain: &Domain, config: &str, more: &[&str]) -> Running {
    let given = [
        &["up", "--body", "chip", "--config", config, "--headless"],
        more,
    ]
    .concat();
    let mut command = domain.lager(&given);
    if std::env::var_os("CARGO_TARGET_DIR").is_some() {
        command.arg("--emulator").arg(lager_tests::emulator());
        command.arg("--images").arg(in_tree(IMAGES));
    }
    domain.launch(command)
}

/// The robot's bus, with the robot's own clock.
fn joined(domain: &Domain) -> Bus {
    let config = BusConfig {
        clock: Some(domain.clock_page("r1")),
        ..domain.bus("r1", 1.0)
    };
    wait_for("the bus", || Bus::open(&config, Role::Operator).ok())
}

fn commission(seed: u64) {
    let domain = Domain::new();
    let [config, robot] = ["lager.toml", "robot.toml"].map(|name| domain.folder().join(name));
    fs::write(&robot, "").expect("a file");
    let text = format!(
        "robot = {:?}\n[simulator]\nseed = {seed}\nbuilt = {seed}\n",
        robot.display().to_string()
    );
    fs::write(&config, text).expect("a file");
    let config = config.display().to_string();
    let build = Build::drawn(seed);

    let mut robot = up(&domain, &config, &[]);
    wait_for("the manual mode", || {
        let done = domain.run(&["mode", "manual"]).status.success();
        done.then_some(())
    });
    let bus = joined(&domain);
    let mut person = Person::new(&domain, &bus, &config, &build);
    person.commission();
    drop((person, bus));
    robot.signal(Signal::INT);
    // Whether it had a mission that failed is of no interest.
    robot.wait().expect("it ends");

    let mission = ["--mission", "1", "--exit-when-done", "--json"];
    let mut robot = up(&domain, &config, &mission);
    let bus = joined(&domain);
    let_logic_drive(&bus, build.buttons);
    let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
    let mut collisions = None;
    while robot.is_running() {
        if let Some(seen) = truth.latest().expect("readable") {
            collisions = Some(seen.collisions);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(
        robot.wait(),
        Some(0),
        "seed {seed}: {build:?}\n{}",
        robot.log()
    );
    assert_eq!(
        robot.json()["delivered"],
        serde_json::json!([1]),
        "seed {seed}"
    );
    assert_eq!(collisions, Some(0), "seed {seed}");
    drop((truth, bus));
    domain.assert_clean();
}

#[test]
fn robots_on_their_real_images_are_commissioned_and_deliver() {
    let seeds = std::env::var("LAGER_CHIP_SEEDS").unwrap_or_else(|_| "1".into());
    let (first, last) = seeds.split_once("..").unwrap_or(("1", &seeds));
    let [first, last] = [first, last].map(|seed| seed.parse::<u64>().expect("a number"));
    for seed in first..=last {
        let begun = Instant::now();
        commission(seed);
        println!("seed {seed}: {} s", begun.elapsed().as_secs());
    }
}
