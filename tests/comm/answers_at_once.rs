//! Tests with an external computer that answers at once, and with one that closes every connection
//! at once: neither makes the robot ask or connect too often.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use crate::scene::Scene;

/// How long the test answers the robot at once.
const ANSWERED: Duration = Duration::from_secs(3);
/// The most questions for a command that a robot may ask in a second.
const MOST_A_SECOND: f64 = 1_000.0;

#[test]
fn a_robot_that_is_answered_at_once_asks_a_thousand_times_a_second_at_most() {
    let mut scene = Scene::new();
    let start = Instant::now();
    let mut robot = scene.robot();
    let mut asked = 0_u32;
    while start.elapsed() < ANSWERED {
        robot.waits_for(&["styrcomm"]);
        asked += 1;
        robot.says("styrcomm 1");
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.0} questions a second", f64::from(asked) / seconds);
    // The robot asked the first question before `start`.
    let most = seconds * MOST_A_SECOND + 1.0;
    assert!(f64::from(asked) <= most, "{asked} in {seconds} s");
    assert!(asked > 100, "{asked} in {seconds} s");

    // The robot still obeys each answer, and stands when told to.
    let mut answers_until = |code: &str, turn: bool| {
        while scene
            .duties()
            .is_none_or(|(left, right)| turn != (left > 0 && right > 0))
        {
            robot.waits_for(&["styrcomm"]);
            robot.says(code);
        }
    };
    answers_until("styrcomm 2", true);
    answers_until("styrcomm 1", false);
}

#[test]
fn a_station_that_closes_every_connection_at_once_is_asked_for_longer_and_longer() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let scene = Scene::with(listener);
    drop(scene.robot());
    let start = Instant::now();
    // Chance shortens each pause by a quarter at most.
    let pauses = [75, 150, 300, 600, 1_200].map(Duration::from_millis);
    let mut least = Duration::ZERO;
    for pause in pauses {
        drop(scene.robot());
        least += pause;
        assert!(
            start.elapsed() >= least,
            "{:?} for {least:?}",
            start.elapsed()
        );
    }
    // The robot still tries to connect.
    let mut robot = scene.robot();
    robot.waits_for(&["styrcomm"]);
}
