//! What the panel costs, and how long it takes from a key to the motors, from STOP to motors at 0,
//! and from a pose to the picture: with a browser, the station, comm and the simulated boards
//! between.
//!
//! A pose is that of the simulator's truth, whose outline is drawn where it is told; the robot
//! itself glides there within 100 ms. The times of motors are those of the first report of the
//! steering board that shows it, which it sends every few ms. A pose is told twenty times a second,
//! so up to 50 ms of its time are waiting.

use std::fmt;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use lager_benches::times::{Times, table};
use lager_ports::{Clock, Subscriber};
use lager_topics::SteeringState;
use serde_json::json;

use crate::Scene;

const ROUNDS: usize = 100;
const WATCHED: Duration = Duration::from_secs(10);

/// What was measured, in milliseconds.
struct Figures {
    pose_to_picture: Times,
    key_to_duty: Times,
    stop_to_rest: Times,
    stop_to_page: Times,
}

impl Figures {
    fn json(&self) -> serde_json::Value {
        json!({
            "rounds": ROUNDS,
            "pose_to_picture": self.pose_to_picture,
            "key_to_duty": self.key_to_duty,
            "stop_to_rest": self.stop_to_rest,
            "stop_to_page": self.stop_to_page,
        })
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{ROUNDS} keys and stops in a browser on this machine, whose robot drives and stands in turn,\n\
             500 000 Bd, real time, and {} s of poses; in ms\n",
            WATCHED.as_secs()
        )?;
        let rows = [
            ("pose -> picture", &self.pose_to_picture),
            ("key down -> motors turn", &self.key_to_duty),
            ("STOP -> motors at 0", &self.stop_to_rest),
            ("STOP -> page says so", &self.stop_to_page),
        ];
        table(formatter, "from -> until", &rows)
    }
}

/// When the board first reports, after `from_ns`, that the motors turn or stand; in ns after it.
fn motors(reports: &mut Subscriber<SteeringState>, from_ns: u64, turn: bool) -> u64 {
    let end = Instant::now() + Duration::from_secs(2);
    while Instant::now() < end {
        let Some(report) = reports.receive().expect("readable") else {
            std::thread::sleep(Duration::from_micros(500));
            continue;
        };
        let at = report.stamp().publish_time_ns;
        if at > from_ns && turn == (report.left_duty != 0 || report.right_duty != 0) {
            return at - from_ns;
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
    // What the page's clock says, in ns of the robot's.
    let monotonic = |page_ms: f64| ((page_ms - origin_ms) * 1e6) as u64;
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
        let drawn_ns = monotonic(seen[1].as_f64().expect("a time"));
        times.push(drawn_ns.saturating_sub(*at_ns));
        last = Some(pose.clone());
    }

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
        told.push(monotonic(at).saturating_sub(from));
        scene.resume();
        page.wait_until("document.querySelector('#resume').hidden");
    }
    let figures = Figures {
        pose_to_picture: Times::of(times),
        key_to_duty: Times::of(starts),
        stop_to_rest: Times::of(stops),
        stop_to_page: Times::of(told),
    };
    match std::env::var_os("LAGER_JSON").is_some() {
        true => println!("{}", figures.json()),
        false => println!("{figures}"),
    }
    drop((page, reports));
    scene.end();
}
