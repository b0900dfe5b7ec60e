//! How well a robot stands at its goods, and what its ranger could add to that (L7).
//!
//! The mark beside the line ends the drive, and the robot turns in on it. What is left to set right
//! by the ranger is its distance from the shelf. It reads 10 cm for everything nearer, whole
//! centimetres for the rest, and differs from the datasheet's typical one, which the board's table
//! has, by as much as that sheet allows.

use std::time::Duration;

use lager_plant::{Warehouse, goods, ir, scene};
use lager_topics::Phase;

use super::Whole;
use crate::config::Config;

/// Virtual time in which a robot must be at the goods.
const LIMIT: Duration = Duration::from_secs(300);
/// How long a ranger may take to tell what is so now.
const SETTLES: Duration = Duration::from_millis(300);

/// How much farther than it should the ranger is from the shelf when the arm begins, and how much
/// farther than that it says it is; in mm.
fn errors(warehouse: &Warehouse, seed: u64) -> (f64, Option<f64>) {
    let product = &warehouse.products[0];
    let mission = [product.id];
    let mut whole = Whole::new(&Config::default(), warehouse, &mission, seed, 0).expect("a robot");
    while whole.navigator.status().phase != Phase::Picking {
        assert_eq!(whole.turn(), None, "seed {seed}");
        assert!(whole.now < LIMIT, "seed {seed}: it never gets there");
    }
    let end = whole.now + SETTLES;
    while whole.now < end {
        assert_eq!(whole.turn(), None, "seed {seed}");
    }
    let shelves = scene::blocks(warehouse);
    let pose = whole.robot.world().pose();
    let really = ir::distance(&pose, &shelves).expect("it looks at a shelf");
    let wanted = scene::STAND - scene::SHELF / 2.0 - lager_plant::body::IR_AHEAD;
    let told = whole.tape.distance_cm().map(|cm| f64::from(cm) * 10.0);
    (really - wanted, told.map(|told| told - really))
}

#[test]
fn a_robot_stands_by_the_mark_more_exactly_than_its_ranger_could_tell_it() {
    let seeds = std::env::var("LAGER_SEEDS").map_or(20, |seeds| seeds.parse().expect("a number"));
    let mut by_mark: Vec<f64> = Vec::new();
    let mut by_ranger: Vec<f64> = Vec::new();
    for name in ["small", "curved"] {
        let warehouse = Warehouse::builtin(name).expect("built in");
        for seed in 1..=seeds {
            let (placed, told) = errors(&warehouse, seed);
            by_mark.push(placed);
            by_ranger.extend(told);
        }
    }
    let spread = |errors: &mut Vec<f64>| {
        errors.sort_by(f64::total_cmp);
        let outside = errors.iter().filter(|error| error.abs() > goods::FIRM);
        (errors[0], errors[errors.len() - 1], outside.count())
    };
    let (low, high, outside) = spread(&mut by_mark);
    let all = by_mark.len();
    println!("by the mark: {low:.0} to {high:.0} mm, {outside} of {all} beyond a firm grip");
    let (told_low, told_high, told_outside) = spread(&mut by_ranger);
    let heard = by_ranger.len();
    println!("the ranger: {told_low:.0} to {told_high:.0} mm, {told_outside} of {heard} beyond it");
    assert_eq!(outside, 0, "the claw would not grip firmly");
    assert!(
        told_high - told_low > high - low,
        "the ranger could place the robot better than the mark does"
    );
}
