//! Tests of `lager bench topic`: it measures any topic of a bus that runs, and disturbs nobody.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use lager_sample::Topic;
use lager_tests::{Domain, lager_bench, wait_for};
use lager_topics::{LinkHealth, SteeringCommand};
use serde_json::Value;

use crate::{WeatherNow, guest, said, up};

/// The rows of a measurement.
fn rows(domain: &Domain, words: &[&str]) -> Vec<Value> {
    let run = domain.run(&[&["bench", "topic", "--json"], words].concat());
    assert!(run.status.success(), "{words:?}: {}", said(&run));
    let report: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    report["rows"].as_array().expect("rows").clone()
}

/// Why it does not measure.
fn refused(domain: &Domain, words: &[&str]) -> String {
    let run = domain.run(&[&["bench", "topic"], words].concat());
    assert_eq!(run.status.code(), Some(1), "{words:?}: {}", said(&run));
    said(&run)
}

#[test]
fn a_topic_of_ones_own_is_measured_as_who_only_watches() {
    lager_bench();
    let domain = Domain::new();
    let nothing = refused(&domain, &["weather/now"]);
    assert!(nothing.contains("has no topic `weather/now`"), "{nothing}");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (domain, is_over) = (&domain, &is_over);
        scope.spawn(move || {
            let bus = guest(domain);
            let weather = bus.publisher::<WeatherNow>().expect("a topic");
            while !is_over.load(Ordering::Relaxed) {
                let mut sample = weather.loan().expect("a place");
                sample.wind = 3_200;
                sample.send().expect("sent");
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        let listed = || said(&domain.run(&["topic", "list"])).contains(WeatherNow::NAME);
        wait_for("the weather", || listed().then_some(()));
        let rows = rows(domain, &["weather/now", "--samples", "200", "--runs", "2"]);
        let actor = refused(domain, &["weather/now", "--wait", "block"]);
        is_over.store(true, Ordering::Relaxed);
        let [row] = &rows[..] else { panic!("{rows:?}") };
        assert_eq!(
            (&row["name"], &row["mode"]),
            (&"observer".into(), &"poll".into())
        );
        assert_eq!(
            (&row["what"], &row["n"]),
            (&"weather/now".into(), &400.into())
        );
        // The weather begins when it is published, so both ways are as long.
        assert_eq!(row["p50_ns"], row["service"]["p50_ns"], "{row}");
        assert!(actor.contains("only an observer"), "{actor}");
    });
    domain.assert_clean();
}

#[test]
fn a_robot_that_is_measured_is_commanded_as_before() {
    lager_bench();
    let domain = Domain::new();
    let up = up(&domain);
    let observer = domain.observe("r1", 1.0);
    let mut commands = observer.subscriber::<SteeringCommand>().expect("a topic");
    let mut health = observer.subscriber::<LinkHealth>().expect("a topic");
    let mut writers = Vec::new();
    let mut hear = || {
        while let Some(sample) = commands.receive().expect("readable") {
            if !writers.contains(&sample.stamp().writer) {
                writers.push(sample.stamp().writer);
            }
        }
        writers.clone()
    };
    let before = wait_for("a command", || {
        Some(hear()).filter(|writers| !writers.is_empty())
    });
    let words = [
        "sensor/line",
        "--wait",
        "block,poll",
        "--samples",
        "100",
        "--runs",
        "1",
    ];
    let rows = rows(&domain, &words);
    let names: Vec<&Value> = rows.iter().map(|row| &row["name"]).collect();
    assert_eq!(names, ["actor", "observer"]);
    for row in &rows {
        assert_eq!(
            (&row["n"], &row["disordered"]),
            (&100.into(), &Value::Null),
            "{row}"
        );
        // The bytes were read before the sample was published.
        assert!(
            row["p50_ns"].as_u64() >= row["service"]["p50_ns"].as_u64(),
            "{row}"
        );
    }
    let told = wait_for("health", || {
        health.latest().expect("readable").map(|health| *health)
    });
    assert_eq!((told.stopped, told.bus_lost), (0, 0));
    assert_eq!(hear(), before, "nobody else commands it");
    let quiet = refused(&domain, &["mission/order", "--wait", "poll"]);
    assert!(quiet.contains("no sample of `mission/order`"), "{quiet}");
    drop((commands, health, observer));
    drop(up);
    domain.assert_clean();
}
