//! The robot's own words on where the time goes, as rows.

use lager_topics::{CommandLatency, Durations, PathLatency};

use crate::report::{Mode, Regime, Row};
use crate::stats::Quantiles;

/// What the robot has counted so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counted {
    pub(super) path: PathLatency,
    pub(super) command: CommandLatency,
}

/// What was counted of a stage.
type Stage = fn(&Counted) -> &Durations;

/// The stages in the order of the way, and each whole.
const STAGES: [(&str, Stage); 7] = [
    ("read to publish", |counted| &counted.path.read_publish),
    ("publish to logic", |counted| &counted.path.publish_receive),
    ("logic to decided", |counted| &counted.path.decide),
    ("read to decided", |counted| &counted.path.total),
    ("order to bridge", |counted| &counted.command.order_receive),
    ("receive to written", |counted| {
        &counted.command.receive_write
    }),
    ("read to written", |counted| &counted.command.total),
];

/// One row for each stage, of what was counted between the two.
pub(super) fn rows(before: &Counted, after: &Counted, regime: Regime, mode: Mode) -> Vec<Row> {
    STAGES
        .into_iter()
        .map(|(stage, of)| row(stage, &of(after).since(of(before)), regime, mode))
        .collect()
}

fn row(stage: &str, counted: &Durations, regime: Regime, mode: Mode) -> Row {
    let times = Quantiles {
        n: counted.count,
        p50_ns: counted.quantile_ns(0.5),
        p99_ns: counted.quantile_ns(0.99),
        p999_ns: counted.quantile_ns(0.999),
    };
    Row {
        name: "lager".to_owned(),
        variant: stage.to_owned(),
        ..Row::of("path-stages", mode, regime, Some(times))
    }
}
