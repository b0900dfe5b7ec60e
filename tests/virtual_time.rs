//! Tests of `lager simulate`, which runs the whole robot in one process, in virtual time.

use std::path::PathBuf;

use lager_tests::Domain;
use serde_json::Value;

fn simulate(args: &[&str]) -> (Vec<Value>, String) {
    let domain = Domain::new();
    let output = domain.run(&[&["simulate", "--json"], args].concat());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    domain.assert_clean();
    let runs = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON line"))
        .collect();
    (runs, text)
}

const WAREHOUSES: [&str; 6] = [
    "--warehouse",
    "small",
    "--warehouse",
    "curved",
    "--warehouse",
    "large",
];

#[test]
fn twenty_seeds_deliver_in_three_warehouses() {
    let (runs, text) = simulate(&[&["--seeds", "1..20"], &WAREHOUSES[..]].concat());
    assert_eq!(runs.len(), 60);
    for run in runs {
        assert_eq!(run["delivered"].as_array().map(Vec::len), Some(1), "{text}");
        assert_eq!(run["lost"], 0, "{run}");
        assert_eq!(run["collisions"], 0, "{run}");
        // E15: on the tightest bend the tape is still under the outer sensors. They are 35 mm from
        // the middle, and half the tape's width is added.
        let lateral = run["lateral_mm"].as_f64().expect("a number");
        assert!(lateral > 0.0 && lateral < 42.5, "{run}");
        if run["warehouse"] == "small" {
            assert!(lateral < 20.0, "it weaves on straight tape: {run}");
        }
        assert!(run.get("failure").is_none(), "{run}");
    }
}

#[test]
fn missions_among_things_that_come_and_go_are_delivered_without_a_collision() {
    let hall = lager_tests::in_tree("tests/data/hall.toml");
    let hall = hall.to_str().expect("a path in UTF-8");
    let mission = ["--seeds", "1..5", "--mission", "3,1,2", "--obstacles", "4"];
    let warehouses = [&WAREHOUSES[..], &["--warehouse", hall]].concat();
    let (runs, text) = simulate(&[&mission[..], &warehouses].concat());
    assert_eq!(runs.len(), 20);
    for run in &runs {
        assert_eq!(run["delivered"].as_array().map(Vec::len), Some(3), "{run}");
        assert_eq!(run["collisions"], 0, "{run}");
    }
    let blocked: u64 = runs.iter().filter_map(|run| run["blocked"].as_u64()).sum();
    assert!(blocked > 0, "no way was found blocked: {text}");
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let args = [&["--seeds", "3..5"], &WAREHOUSES[..]].concat();
    let strip = |mut runs: Vec<Value>| {
        for run in &mut runs {
            // Only the time that the machine took may differ.
            let run = run.as_object_mut().expect("an object");
            run.remove("wall_seconds").expect("wall_seconds");
            run.remove("times_real").expect("times_real");
        }
        runs
    };
    assert_eq!(strip(simulate(&args).0), strip(simulate(&args).0));
}

/// A warehouse file; dropping this removes it.
struct File(PathBuf);

impl File {
    fn new(name: &str, text: &str) -> Self {
        let name = format!("lager-{name}-{}.toml", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).expect("a temporary file");
        Self(path)
    }

    fn name(&self) -> &str {
        self.0.to_str().expect("a name")
    }
}

impl Drop for File {
    fn drop(&mut self) {
        std::fs::remove_file(&self.0).expect("the file is there");
    }
}

/// A warehouse of 3 x 3 squares with goods on edges of all four directions.
fn squares_of(side_cm: u16) -> File {
    let mut text = format!("size = [3, 3]\nside_length_cm = {side_cm}\n");
    for (id, [x, y], side) in [
        (1, [1, 0], "down"),
        (2, [0, 2], "left"),
        (3, [2, 1], "right"),
        (4, [1, 2], "up"),
    ] {
        text += &format!("[[product]]\nid = {id}\nsquare = [{x}, {y}]\nside = \"{side}\"\n");
    }
    File::new(&format!("squares-{side_cm}"), &text)
}

#[test]
fn squares_of_every_size_are_driven_without_a_collision() {
    // Where things come and go there must be room to turn beside them. The ranger sees 80 cm far.
    for (side_cm, things) in [
        (45, "0"),
        (50, "4"),
        (60, "4"),
        (80, "4"),
        (100, "4"),
        (150, "4"),
    ] {
        let file = squares_of(side_cm);
        let args = [
            "--warehouse",
            file.name(),
            "--mission",
            "1,2,3,4",
            "--battery",
            "100",
            "--seeds",
            "1..4",
        ];
        let (runs, text) = simulate(&[&args[..], &["--obstacles", things]].concat());
        assert_eq!(runs.len(), 4, "{text}");
        for run in runs {
            assert_eq!(run["delivered"].as_array().map(Vec::len), Some(4), "{run}");
            assert_eq!(run["collisions"], 0, "{run}");
        }
    }
}

#[test]
fn squares_in_which_the_robot_has_no_room_are_refused_and_the_sentence_says_why() {
    let refused = |file: &File, args: &[&str], why: &str| {
        let domain = Domain::new();
        let output = domain.run(&[&["simulate", "--warehouse", file.name()], args].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(why), "{said}");
        domain.assert_clean();
    };
    let goods = "where goods stand it must be 45 cm or more";
    refused(&squares_of(40), &["--mission", "1"], goods);
    let things = "where things stand on the ways it must be 50 cm or more";
    refused(
        &squares_of(49),
        &["--mission", "1", "--obstacles", "4"],
        things,
    );
    let bare = "size = [3, 3]\nside_length_cm = 40\n[[obstacle]]\nbetween = [[1, 0], [2, 0]]\n";
    refused(&File::new("narrow", bare), &["--mission", "1"], things);
}

/// The largest warehouse that is allowed: 100 by 100 crossings and 256 products. Things stand on
/// the straight ways to the farthest products.
fn largest_warehouse() -> String {
    let mut text = String::from("size = [99, 99]\nside_length_cm = 50\n");
    for index in 0..256 {
        let (id, x, y) = (index + 1, index % 16 * 6, index / 16 * 6);
        text += &format!("[[product]]\nid = {id}\nsquare = [{x}, {y}]\nside = \"up\"\n");
    }
    for at in (4..96).step_by(6) {
        for [x, y] in [[at, 0], [at, 91], [0, at], [90, at]] {
            let [to_x, to_y] = if y == at { [x, y + 1] } else { [x + 1, y] };
            text += &format!("[[obstacle]]\nbetween = [[{x}, {y}], [{to_x}, {to_y}]]\n");
        }
    }
    text
}

#[test]
fn the_largest_warehouse_is_crossed_round_what_stands_in_the_way() {
    let file = File::new("largest", &largest_warehouse());
    // 145 edges each way. For 170 edges, the battery of some robots would be empty too early.
    let args = [
        "--warehouse",
        file.name(),
        "--mission",
        "205",
        "--battery",
        "100",
        "--seeds",
        "1..3",
    ];
    let (runs, text) = simulate(&args);
    assert_eq!(runs.len(), 3, "{text}");
    for run in &runs {
        assert_eq!(run["delivered"], serde_json::json!([205]), "{run}");
        assert_eq!(run["collisions"], 0, "{run}");
        assert_eq!(run["lost"], 0, "{run}");
        let blocked = run["blocked"].as_u64();
        assert!(blocked.is_some_and(|count| count > 0), "{run}");
    }
}
