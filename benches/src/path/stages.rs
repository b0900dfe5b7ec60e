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

/// One row for each stage, in the order of the way, and one for each whole, of what was counted
/// between the two.
pub(super) fn rows(before: &Counted, after: &Counted, regime: Regime, mode: Mode) -> Vec<Row> {
    let ([path, earlier_path], [command, earlier_command]) = (
        [&after.path, &before.path],
        [&after.command, &before.command],
    );
    [
        (
            "read to publish",
            &path.read_publish,
            &earlier_path.read_publish,
        ),
        (
            "publish to logic",
            &path.publish_receive,
            &earlier_path.publish_receive,
        ),
        ("logic to decided", &path.decide, &earlier_path.decide),
        ("read to decided", &path.total, &earlier_path.total),
        (
            "order to bridge",
            &command.order_receive,
            &earlier_command.order_receive,
        ),
        (
            "receive to written",
            &command.receive_write,
            &earlier_command.receive_write,
        ),
        ("read to written", &command.total, &earlier_command.total),
    ]
    .into_iter()
    .map(|(stage, after, before)| row(stage, &after.since(before), regime, mode))
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
