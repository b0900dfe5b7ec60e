//! What something costs the robot's path: `lager bench path` in turns, with it and without.

use serde_json::Value;

use crate::Domain;

/// How often the path is measured with it and without.
const TURNS: usize = 12;

/// p50 and p99 of the path on this machine now, in us. The bench has its own bus and boards.
fn path(domain: &Domain) -> [f64; 2] {
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

/// Measures the path in turns, alone and with what `begin` starts, which ends when it is dropped.
/// Prints the times, and returns the middle of the ratios of p50 and p99.
///
/// # Panics
/// When the bench has no result.
pub fn compare<W>(domain: &Domain, what: &str, mut begin: impl FnMut() -> W) -> [f64; 2] {
    let turns: Vec<_> = (0..TURNS)
        .map(|_| {
            let alone = path(domain);
            let guests = begin();
            let beside = path(domain);
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
