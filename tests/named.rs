//! Tests that people can order goods by the names in the warehouse's file, in each place that takes
//! an order.

use std::fs;
use std::process::Output;

use lager_tests::{Domain, Running, wait_for};

const WAREHOUSE: &str = "size = [2, 2]
side_length_cm = 50

[[product]]
id = 1
name = \"screws\"
square = [0, 0]
side = \"left\"

[[product]]
id = 2
name = \"wood glue\"
square = [1, 0]
side = \"down\"

[[product]]
id = 3
square = [1, 1]
side = \"right\"
";

const KNOWN: &str = "it has 1 (screws), 2 (wood glue), 3";

fn said(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{out}{err}")
}

/// A copy of the warehouse's file in which `to` replaces `from`.
fn file(domain: &Domain, from: &str, to: &str) -> String {
    let path = domain.folder().join("warehouse.toml");
    fs::write(&path, WAREHOUSE.replacen(from, to, 1)).expect("a file");
    path.to_string_lossy().into_owned()
}

/// A robot that fetches screws and that the test stops on the way.
fn robot(domain: &Domain, flags: &[&str]) -> Running {
    let warehouse = file(domain, "", "");
    let args = ["up", "--headless", "--warehouse", &warehouse, "--mission"];
    let up = domain.start(&[&args[..], &["screws"], flags].concat());
    wait_for("an order under way", || {
        let listed = said(&domain.run(&["queue"]));
        listed.contains("goods 1, under way").then_some(())
    });
    domain.done(&["stop"]);
    up
}

#[test]
fn goods_are_ordered_by_name_with_a_station_and_without_one() {
    for flags in [&[][..], &["--no-station"]] {
        let domain = Domain::new();
        let up = robot(&domain, flags);
        domain.done(&["queue", "add", "wood glue"]);
        domain.done(&["fetch", "3"]);
        let twice = said(&domain.run(&["fetch", "screws"]));
        assert!(twice.contains("goods 1 are ordered already"), "{twice}");
        let listed = said(&domain.run(&["queue"]));
        let products = listed.lines().filter_map(|line| line.split_once(": "));
        let products: Vec<_> = products.map(|(_, product)| product).collect();
        let wanted = ["1, under way", "2, waits", "3, waits"];
        assert_eq!(products, wanted.map(|one| format!("goods {one}")));

        for command in [&["fetch"][..], &["queue", "add"]] {
            let refused = domain.run(&[command, &["nails"]].concat());
            let why = said(&refused);
            assert_eq!(refused.status.code(), Some(1), "{why}");
            assert!(why.contains(&format!("no goods nails; {KNOWN}")), "{why}");
        }
        let map = said(&domain.run(&["map"]));
        assert!(map.contains("goods 2 (wood glue): at"), "{map}");
        assert!(map.contains("goods 3: at"), "{map}");
        // A stop would outlive the robot, so the test releases it.
        domain.done(&["resume"]);
        drop(up);
        domain.assert_clean();
    }
}

#[test]
fn what_nothing_is_called_is_no_mission() {
    let domain = Domain::new();
    let warehouse = file(&domain, "", "");
    let flags = ["--warehouse", &warehouse, "--mission", "screws,nails"];
    let elsewhere = ["--station", "127.0.0.1:9"];
    for (command, more, why) in [
        (&["up"][..], &[][..], KNOWN),
        (&["simulate"], &[], KNOWN),
        (&["up"], &elsewhere, "not known here what screws is"),
    ] {
        let refused = domain.run(&[command, &flags, more].concat());
        let told = said(&refused);
        assert_eq!(refused.status.code(), Some(2), "{told}");
        assert!(told.contains("--mission: ") && told.contains(why), "{told}");
    }
    let flags = [
        "--warehouse",
        &warehouse,
        "--mission",
        "wood glue",
        "--json",
    ];
    let done = said(&domain.run(&[&["simulate"][..], &flags].concat()));
    assert!(done.contains("\"delivered\":[2]"), "{done}");
    domain.assert_clean();
}

#[test]
fn a_file_whose_names_would_mean_two_things_is_refused() {
    let domain = Domain::new();
    for (name, why) in [
        ("screws", "two goods are named screws;"),
        ("3", "named 3, which people would take for their number"),
    ] {
        let warehouse = file(&domain, "wood glue", name);
        for command in ["up", "station"] {
            let refused = domain.run(&[command, "--warehouse", &warehouse]);
            let told = said(&refused);
            assert_eq!(refused.status.code(), Some(1), "{told}");
            assert!(told.contains(why), "{command}: {told}");
        }
    }
    domain.assert_clean();
}

#[test]
fn a_robot_of_somebody_elses_station_takes_numbers_only() {
    let domain = Domain::new();
    let warehouse = file(&domain, "", "");
    let station = domain.start(&[
        "station",
        "--listen",
        "127.0.0.1:0",
        "--no-panel",
        "--warehouse",
        &warehouse,
        "--fetch",
        "r1=screws,3",
    ]);
    let address = wait_for("the station", || {
        let said = station.output();
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    });
    let args = ["up", "--headless", "--warehouse", &warehouse, "--station"];
    let up = domain.start(&[&args[..], &[address.as_str()]].concat());
    wait_for("what the station orders by its name", || {
        up.output().contains("fetches goods 1").then_some(())
    });
    let refused = domain.run(&["fetch", "screws"]);
    let why = said(&refused);
    assert_eq!(refused.status.code(), Some(1), "{why}");
    assert!(why.contains("give the number"), "{why}");
    drop((up, station));
}
