//! Tests of the text for Prometheus, and of the dashboard's queries.

use lager_sample::Stamp;
use lager_topics::{NavigatorStatus, Role, SteeringReport};
use serde_json::Value;

use super::*;
use crate::DASHBOARD;

fn line<'a>(text: &'a str, begin: &str) -> Option<&'a str> {
    text.lines().find_map(|line| line.strip_prefix(begin))
}

#[test]
fn what_is_not_known_yet_has_a_description_and_no_value() {
    let text = text(&Figures::new("r1"), None);
    assert!(line(&text, "# HELP lager_battery_volts ").is_some());
    assert_eq!(line(&text, "# TYPE lager_battery_volts "), Some("gauge"));
    for unknown in ["lager_battery_volts{", "lager_mode{", "lager_stop_latched{"] {
        assert_eq!(line(&text, unknown), None);
    }
}

#[test]
fn a_state_is_a_one_among_noughts() {
    let mut figures = Figures::new("r1");
    figures.health = Some(lager_topics::Health {
        mode: Mode::Autonomous.into(),
        ..Default::default()
    });
    figures.status = Some(NavigatorStatus {
        phase: Phase::TurningBack.into(),
        ..Default::default()
    });
    let stop = Stop::new(Role::Operator, StopCause::BoardResets, 1_000);
    let text = text(&figures, Some(Some(stop)));
    let value = |begin: &str| line(&text, begin);
    assert_eq!(
        value("lager_mode{robot=\"r1\",mode=\"autonomous\"} "),
        Some("1")
    );
    assert_eq!(
        value("lager_mode{robot=\"r1\",mode=\"manual\"} "),
        Some("0")
    );
    assert_eq!(
        value("lager_navigator_phase{robot=\"r1\",phase=\"turning_back\"} "),
        Some("1")
    );
    assert_eq!(
        value("lager_stop_latched{robot=\"r1\",cause=\"board_resets\"} "),
        Some("1")
    );
    assert_eq!(
        value("lager_stop_latched{robot=\"r1\",cause=\"ordered\"} "),
        Some("0")
    );
    assert!(value("lager_stop_timestamp_seconds{robot=\"r1\"} ").is_some());
}

#[test]
fn a_robot_that_is_not_stopped_has_a_nought_at_every_cause() {
    let text = text(&Figures::new("r1"), Some(None));
    let latches = text
        .lines()
        .filter(|line| line.starts_with("lager_stop_latched{"));
    assert_eq!(latches.clone().count(), StopCause::VARIANTS.len() - 1);
    assert!(latches.into_iter().all(|line| line.ends_with(" 0")));
}

#[test]
fn a_histogram_has_a_bucket_for_each_doubling_and_counts_what_is_longer() {
    let mut figures = Figures::new("r1");
    let mut latency = lager_topics::PathLatency::default();
    for duration_ns in [100, 1_000, 1_024, 1_025, 5_000_000_000] {
        latency.total.record(duration_ns);
    }
    figures.path = Some(Box::new(latency));
    let text = text(&figures, None);
    let name = "lager_path_seconds";
    let within = |end: &str| {
        let begin = format!("{name}_bucket{{robot=\"r1\",stage=\"total\",le=\"{end}\"}} ");
        line(&text, &begin).map(str::to_owned)
    };
    assert_eq!(within("0.000000256").as_deref(), Some("1"));
    assert_eq!(within("0.000001024").as_deref(), Some("3"));
    assert_eq!(within("0.000002048").as_deref(), Some("4"));
    assert_eq!(within("1.073741824").as_deref(), Some("4"));
    assert_eq!(within("+Inf").as_deref(), Some("5"));
    let begin = format!("{name}_sum{{robot=\"r1\",stage=\"total\"}} ");
    assert_eq!(line(&text, &begin), Some("5.000003149"));
    let buckets = text.matches("_bucket{robot=\"r1\",stage=\"total\"").count();
    assert_eq!(buckets, 24);
}

#[test]
fn the_far_end_is_that_of_all_frames_and_a_percentile_has_ten_beyond_it() {
    let mut figures = Figures::new("r1");
    let mut latency = lager_topics::PathLatency::default();
    (0..9_989).for_each(|_| latency.total.record(100_000));
    (0..11).for_each(|_| latency.total.record(3_000_000));
    latency.decide.record(7_000);
    figures.path = Some(Box::new(latency));
    let text = text(&figures, None);
    let of = |name: &str, stage: &str| {
        let begin = format!("{name}{{robot=\"r1\",stage=\"{stage}\"}} ");
        line(&text, &begin).map(|value| value.parse::<f64>().expect("a number"))
    };
    // A doubling of the histogram would only say 2.1 to 4.2 ms.
    let p999 = of("lager_path_p999_seconds", "total").expect("enough frames");
    assert!((2.6e-3..=3e-3).contains(&p999), "{p999}");
    assert_eq!(of("lager_path_max_seconds", "total"), Some(3e-3));
    assert_eq!(of("lager_path_p999_seconds", "decide"), None);
    assert_eq!(of("lager_path_max_seconds", "decide"), Some(7e-6));
    assert_eq!(of("lager_path_max_seconds", "read_publish"), None);
    assert!(line(&text, "# TYPE lager_command_p999_seconds ").is_some());
}

#[test]
fn a_label_is_escaped_and_a_sample_without_loss_is_a_nought() {
    let mut figures = Figures::new("r1");
    figures.count("a\"b\\c", &Stamp::default(), 0);
    let text = text(&figures, None);
    assert_eq!(
        line(
            &text,
            "lager_topic_samples_total{robot=\"r1\",topic=\"a\\\"b\\\\c\"} "
        ),
        Some("1")
    );
    assert_eq!(
        line(
            &text,
            "lager_topic_lost_samples_total{robot=\"r1\",topic=\"a\\\"b\\\\c\"} "
        ),
        Some("0")
    );
}

#[test]
fn a_board_that_was_never_heard_has_no_age() {
    let mut figures = Figures::new("r1");
    let mut report = SteeringReport {
        age_ms: SteeringReport::NEVER_HEARD,
        ..Default::default()
    };
    let stamp = Stamp {
        publish_time_ns: 5_000_000_000,
        ..Stamp::default()
    };
    // A robot at twice its speed.
    let real = |robot: std::time::Duration| robot / 2;
    figures.learn(&stamp, &report, &real);
    assert_eq!(figures.heard_ns, [None; 2]);
    report.age_ms = 20;
    figures.learn(&stamp, &report, &real);
    assert_eq!(figures.heard_ns[1], Some(4_990_000_000));
}

/// Every word of a query that is the name of a figure.
fn names(query: &str) -> impl Iterator<Item = &str> {
    let is_of_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let words = query.split(move |letter| !is_of_word(letter));
    words.filter(|word| word.starts_with("lager_"))
}

#[test]
fn every_query_of_the_dashboard_is_of_a_figure_that_there_is() {
    let text = text(&Figures::new("r1"), None);
    let kind = |name: &str| line(&text, &format!("# TYPE {name} "));
    let dashboard: Value = serde_json::from_str(DASHBOARD).expect("JSON");
    let panels = dashboard["panels"].as_array().expect("panels");
    let mut queries = Vec::new();
    for panel in panels {
        for target in panel["targets"].as_array().into_iter().flatten() {
            queries.push(target["expr"].as_str().expect("a query"));
        }
    }
    for variable in dashboard["templating"]["list"].as_array().expect("a list") {
        queries.extend(
            variable["query"]
                .as_str()
                .filter(|query| query.contains("lager_")),
        );
    }
    assert!(queries.len() > 15, "{}", queries.len());
    let mut asked = std::collections::BTreeSet::new();
    for query in queries {
        let mut found = 0;
        for name in names(query) {
            found += 1;
            let bucket = name.strip_suffix("_bucket");
            let is_there = match bucket {
                Some(name) => kind(name) == Some("histogram"),
                None => kind(name).is_some(),
            };
            assert!(is_there, "{name} in {query}");
            asked.insert(bucket.unwrap_or(name));
            // A counter alone says nothing: it is asked for its rate or its increase.
            if kind(name) == Some("counter") {
                assert!(
                    query.contains("rate(") || query.contains("increase("),
                    "{query}"
                );
            }
        }
        assert!(found > 0, "{query}");
    }
    let told = text.lines().filter_map(|line| line.strip_prefix("# TYPE "));
    for name in told.filter_map(|line| line.split(' ').next()) {
        let is_shown = asked.contains(name) || name == "lager_build_info";
        assert!(is_shown, "{name} is on no panel");
    }
}
