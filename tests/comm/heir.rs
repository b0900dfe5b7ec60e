//! Tests with a bridge that is killed, or frozen and replaced, while a person's order is in force:
//! its successor turns no wheel by that order, and the person is told.

use std::time::{Duration, Instant};

use lager_tests::{WATCHDOG, pid, wait_for};
use lager_topics::LinkHealth;
use rustix::process::{Signal, kill_process};

use crate::scene::Scene;

/// How long the test watches the successor after it has the board.
const AFTER: Duration = Duration::from_millis(1_500);

/// The signals that end a bridge. A stopped bridge is silent, and the supervisor replaces it.
const ENDS: [Signal; 2] = [Signal::KILL, Signal::STOP];

/// Sends `signal` to the bridge of a robot that drives, and watches until its successor has had the
/// board for a while. Wheels that stand must not turn again. Returns whether they stood; they need
/// not if the successor came within the lease.
fn replace_bridge(scene: &mut Scene, signal: Signal) -> bool {
    let bus = scene.domain.observe("r1", 1.0);
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    let bridge = scene.up.service("bridge").expect("it runs");
    kill_process(pid(bridge), signal).expect("it runs");
    let start = Instant::now();
    let mut back: Option<Instant> = None;
    let mut stood = false;
    while back.is_none_or(|back| back.elapsed() < AFTER) {
        assert!(start.elapsed() < WATCHDOG, "no successor");
        if let Some(duties) = scene.duties() {
            stood |= duties == (0, 0);
            assert!(
                !stood || duties == (0, 0),
                "{duties:?}, {:?} after {signal:?}",
                start.elapsed()
            );
        }
        if let Some(health) = health.latest().expect("readable")
            && health.steering.up != 0
            && health.stamp().writer != bridge
            && Some(health.stamp().writer) == scene.up.service("bridge")
        {
            back.get_or_insert_with(Instant::now);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    stood
}

#[test]
fn a_gags_command_moves_nothing_after_the_death_of_the_bridge() {
    let mut scene = Scene::new();
    for signal in ENDS {
        let mut robot = scene.drive(false);
        if replace_bridge(&mut scene, signal) {
            // The station is told the reason, and is asked for another command.
            let told = wait_for("it to be told", || {
                robot.hears().filter(|line| line.starts_with("thought"))
            });
            let why = ["was cut short", "has not reported", "held up"];
            assert!(why.iter().any(|why| told.contains(why)), "{told}");
        }
        drop(robot);
        scene.wait_until_it_stands();
    }
}

#[test]
fn lager_drive_moves_nothing_after_the_death_of_the_bridge() {
    let mut scene = Scene::new();
    for signal in ENDS {
        // If this machine was held up, the command ended and is given again.
        let mut drive = wait_for("the robot to drive", || {
            let mut drive = scene.domain.start(&["drive", "left", "--seconds", "120"]);
            loop {
                if !drive.is_running() {
                    return None;
                }
                if scene.duties().is_some_and(|(left, _)| left > 0) {
                    return Some(drive);
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        if replace_bridge(&mut scene, signal) {
            assert_ne!(drive.wait(), Some(0));
            let why = ["give it anew", "was cut short", "fallen silent"];
            let said = drive.log();
            assert!(why.iter().any(|why| said.contains(why)), "{said}");
        }
        drop(drive);
        scene.wait_until_it_stands();
    }
}
