//! The robot's own words on where the time goes, as rows.

use lager_topics::{PathLatency, StageLatency};

use crate::report::{Mode, Regime, Row};

/// One row for each stage, in the order of the way, and one for all of it.
pub(super) fn rows(latency: &PathLatency, regime: Regime, mode: Mode) -> Vec<Row> {
    [
        ("read to publish", &latency.read_publish),
        ("publish to logic", &latency.publish_receive),
        ("decision", &latency.decide),
        ("order to bridge", &latency.order_receive),
        ("receive to written", &latency.receive_write),
        ("read to written", &latency.total),
    ]
    .into_iter()
    .map(|(stage, seen)| row(stage, seen, regime, mode))
    .collect()
}

fn row(stage: &str, seen: &StageLatency, regime: Regime, mode: Mode) -> Row {
    Row {
        name: "lager".to_owned(),
        variant: stage.to_owned(),
        what: "path-stages".to_owned(),
        mode,
        regime,
        n: seen.count,
        p50_ns: seen.p50_ns,
        p99_ns: seen.p99_ns,
        p999_ns: seen.p999_ns,
        ratio_to: String::new(),
        ratio_p50: 1.0,
        ratio_p99: 1.0,
        ratios: Vec::new(),
        cpu_percent: None,
    }
}
