//! What something costs the robot's path, in turns, with it and without: the path that `lager bench
//! path` measures on a bus of its own, or that of a robot that is up.

use std::time::Duration;

use lager_topics::LatencyPath;
use serde_json::Value;

use crate::{Domain, wait_for};

/// How often the path is measured with it and without.
const TURNS: usize = 12;

/// How long the path of a robot that is up is measured at a time.
const BLOCK: Duration = Duration::from_secs(8);

/// Measures the path in turns, alone and with what `begin` starts, which ends when it is dropped.
/// Prints the times, and returns the middle of the ratios of p50 and p99.
///
/// # Panics
/// When the bench has no result.
pub fn compare<W>(domain: &Domain, what: &str, begin: impl FnMut() -> W) -> [f64; 2] {
    in_turns(what, || bench(domain), begin)
}

/// The same with the path of robot `r1`, which is up in `domain` and must stay so, as its logic
/// counts it. Prints how many frames a second it had, too.
///
/// # Panics
/// When the robot is not up.
pub fn compare_on_robot<W>(domain: &Domain, what: &str, begin: impl FnMut() -> W) -> [f64; 2] {
    let observer = domain.observe("r1", 1.0);
    let mut told = observer.subscriber::<LatencyPath>().expect("a topic");
    let mut next = || {
        wait_for("logic to tell", || {
            let told = told.latest().expect("readable")?;
            Some((told.stamp().publish_time_ns, told.total))
        })
    };
    let mut rates = Vec::new();
    let block = || {
        // What was told before the block began may lie there yet.
        next();
        let (began_ns, before) = next();
        loop {
            let (now_ns, after) = next();
            let took = Duration::from_nanos(now_ns - began_ns);
            if took >= BLOCK {
                let total = after.since(&before);
                rates.push(total.count as f64 / took.as_secs_f64());
                return [0.5, 0.99].map(|part| total.quantile_ns(part) as f64 / 1e3);
            }
        }
    };
    let ratios = in_turns(what, block, begin);
    println!(
        "{what:<26} {:.0} frames a second, in blocks of {BLOCK:?}",
        median(rates)
    );
    ratios
}

/// p50 and p99 of the path on this machine now, in us. The bench has its own bus and boards.
fn bench(domain: &Domain) -> [f64; 2] {
    let args = "bench path --mode block --regime plain --quick --json --runs 1";
    let out = domain.run(&args.split(' ').collect::<Vec<_>>());
    let told: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    let rows = told["rows"].as_array().expect("rows");
    let is_ours = |row: &&Value| row["what"] == "path" && row["name"] == "lager";
    let row = rows.iter().find(is_ours).expect("a row");
    ["p50_ns", "p99_ns"].map(|key| row[key].as_f64().expect("ns") / 1e3)
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    f64::midpoint(of[(of.len() - 1) / 2], of[of.len() / 2])
}

fn in_turns<W>(
    what: &str,
    mut path: impl FnMut() -> [f64; 2],
    mut begin: impl FnMut() -> W,
) -> [f64; 2] {
    let turns: Vec<_> = (0..TURNS)
        .map(|_| {
            let alone = path();
            let guests = begin();
            let beside = path();
            drop(guests);
            (alone, beside)
        })
        .collect();
    let middle = [0, 1].map(|index| {
        let alone = median(turns.iter().map(|(alone, _)| alone[index]).collect());
        let beside = median(turns.iter().map(|(_, beside)| beside[index]).collect());
        let ratio = median(turns.iter().map(|(a, b)| b[index] / a[index]).collect());
        (alone, beside, ratio)
    });
    for (name, (alone, beside, ratio)) in ["p50", "p99"].into_iter().zip(middle) {
        println!(
            "{what:<26} {name}: alone {alone:.0} us, beside it {beside:.0} us, middle of {TURNS} \
             ratios {ratio:.2}"
        );
    }
    middle.map(|(.., ratio)| ratio)
}
