//! What the panel costs, and how long it takes from a key to the motors, from STOP to motors at 0, and
//! from a pose to the picture: with a browser, the station, comm and the simulated boards between.
//!
//! A pose is that of the simulator's truth, whose outline is drawn where it is told; the robot itself
//! glides there within 100 ms. The times of motors are those of the first report of the steering board that shows it, which it
//! sends every few ms. A pose is told twenty times a second, so up to 50 ms of its time are waiting.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use lager_ports::{Clock, Subscriber};
use lager_topics::SteeringState;

use crate::Scene;

const ROUNDS: usize = 40;
const WATCHED: Duration = Duration::from_secs(10);

/// Prints one figure: how often, and in ms the middle, the nineteen in twentieth and the longest.
fn row(name: &str, mut times: Vec<f64>) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
    println!(
        "{name:<26} n {:>4}   p50 {:>6.1} ms   p95 {:>6.1} ms   max {:>6.1} ms",
        times.len(),
        at(0.5),
        at(0.95),
        at(1.0),
    );
}

/// When the board first reports, after `from_ns`, that the motors turn or stand; in ms after it.
fn motors(reports: &mut Subscriber<SteeringState>, from_ns: u64, turn: bool) -> f64 {
    let end = Instant::now() + Duration::from_secs(2);
    while Instant::now() < end {
        let Some(report) = reports.receive().expect("readable") else {
            std::thread::sleep(Duration::from_micros(500));
            continue;
        };
        let at = report.stamp().publish_time_ns;
        if at > from_ns && turn == (report.left_duty != 0 || report.right_duty != 0) {
            return (at - from_ns) as f64 / 1e6;
        }
    }
    panic!("the motors did not do it in 2 s");
}

#[test]
#[ignore = "it prints figures: tests/soak panel"]
fn from_the_key_and_to_the_picture() {
    let mut scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    let mut reports = scene.bus.subscriber::<SteeringState>().expect("a topic");

    // The robot drives by itself: its poses, and when they are in the picture.
    scene.wait_to_move();
    page.value(
        "window.seen = []; new MutationObserver(() => { \
           const place = document.querySelector('#map .ghost').getAttribute('transform'); \
           requestAnimationFrame(() => setTimeout(() => \
             seen.push([place, performance.timeOrigin + performance.now()]))); \
         }).observe(document.querySelector('#map .ghost'), { attributes: true })",
    );
    let mut poses = Vec::new();
    let end = Instant::now() + WATCHED;
    while Instant::now() < end {
        if let Some(truth) = scene.truth.receive().expect("readable") {
            let place = format!(
                "translate({:.1} {:.1})",
                truth.x_mm.round(),
                -truth.y_mm.round() + 0.0
            );
            poses.push((place, truth.stamp().publish_time_ns));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let wall = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .expect("a date");
    let origin_ms = wall.as_secs_f64() * 1e3 - Clock::monotonic_ns() as f64 / 1e6;
    let seen = page.value("seen");
    let mut times = Vec::new();
    let mut last = None;
    for seen in seen.as_array().expect("a list") {
        let place = seen[0].as_str().expect("a place").split(" rotate").next();
        // Of poses in the same millimetre the oldest counts, and each counts once.
        let pose = poses.iter().find(|(pose, _)| Some(pose.as_str()) == place);
        let Some((pose, at_ns)) = pose.filter(|(pose, _)| last.as_ref() != Some(pose)) else {
            continue;
        };
        times.push(seen[1].as_f64().expect("a time") - origin_ms - *at_ns as f64 / 1e6);
        last = Some(pose.clone());
    }
    row("pose -> picture", times);

    scene.take_over(&mut page);
    page.click("#armed");
    page.value("document.activeElement.blur()");
    let (mut starts, mut stops, mut told) = (Vec::new(), Vec::new(), Vec::new());
    page.value(
        "window.stands = []; const said = document.querySelector('#stop-said'); \
         new MutationObserver(() => said.textContent.includes('both wheels stand') && \
           stands.push(performance.timeOrigin + performance.now())).observe(said, { childList: true })",
    );
    for round in 0..ROUNDS {
        // To and fro, so that it stays where there is room.
        let key = ["ArrowLeft", "ArrowRight"][round % 2];
        let from = Clock::monotonic_ns();
        page.key_down(key);
        starts.push(motors(&mut reports, from, true));
        std::thread::sleep(Duration::from_millis(100));
        let from = Clock::monotonic_ns();
        page.key_down("Escape");
        stops.push(motors(&mut reports, from, false));
        page.key_up("Escape");
        page.key_up(key);
        page.wait_for("#stop-said", "both wheels stand");
        let at = page.value("stands.at(-1)").as_f64().expect("a time");
        told.push(at - origin_ms - from as f64 / 1e6);
        scene.resume();
        page.wait_until("document.querySelector('#resume').hidden");
    }
    row("key -> motors turn", starts);
    row("STOP -> motors at 0", stops);
    row("STOP -> page says so", told);
    drop((page, reports));
    scene.end();
}
