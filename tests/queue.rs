//! Tests of the waiting orders: how people see and change them, and what is left of them after a
//! kill of the service that keeps them.

use std::process::Output;
use std::time::Duration;

use lager_tests::{Domain, Running, pid, wait_for};
use lager_topics::TruthPose;
use rustix::process::{Signal, kill_process};

fn said(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{out}{err}").trim_end().into()
}

/// The output of `lager queue`.
fn listed(domain: &Domain) -> String {
    said(&domain.run(&["queue"]))
}

/// The numbers of the orders that wait for these products, in the queue's order.
fn waiting(domain: &Domain) -> Vec<(String, String)> {
    let listed = listed(domain);
    let waits = listed.lines().filter(|line| line.ends_with(", waits"));
    let parts = waits.filter_map(|line| {
        let (id, rest) = line.strip_prefix("order ")?.split_once(": goods ")?;
        Some((id.into(), rest.strip_suffix(", waits")?.into()))
    });
    parts.collect()
}

fn products(domain: &Domain) -> Vec<String> {
    waiting(domain)
        .into_iter()
        .map(|(_, product)| product)
        .collect()
}

/// A robot that had begun an order when a person stopped it.
fn robot(domain: &Domain) -> Running {
    let up = domain.start(&["up", "--headless", "--speed", "4", "--mission", "1"]);
    wait_for("an order under way", || {
        listed(domain).ends_with("goods 1, under way").then_some(())
    });
    domain.done(&["stop"]);
    up
}

#[test]
fn missions_among_things_that_come_and_go_are_delivered_in_their_order_without_a_collision() {
    let products = [3, 1, 2];
    let mission: Vec<String> = products.iter().map(i32::to_string).collect();
    let domain = Domain::new();
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        &mission.join(","),
        "--obstacles",
        "4",
        "--speed",
        "4",
        "--exit-when-done",
        "--json",
    ]);
    let bus = domain.observe("r1", 4.0);
    let mut truth = bus.subscriber::<TruthPose>().expect("a topic");
    let mut collisions = None;
    while up.is_running() {
        let seen = truth.latest().expect("readable");
        collisions = seen.map(|truth| truth.collisions).or(collisions);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!(products), "{told}");
    assert_eq!(collisions, Some(0), "{}", up.log());
    drop((truth, bus));
    domain.assert_clean();
}

#[test]
fn goods_that_cannot_be_reached_end_the_mission_with_what_logic_calls_it() {
    let domain = Domain::new();
    // Something stands on the edge with the goods.
    let file = |name: &str, text: &str| {
        let path = domain.folder().join(name);
        std::fs::write(&path, text).expect("a file");
        path.to_string_lossy().into_owned()
    };
    let warehouse = file(
        "closed.toml",
        "size = [2, 1]\nside_length_cm = 50\n\
         [[product]]\nid = 1\nsquare = [0, 0]\nside = \"up\"\n\
         [[obstacle]]\nbetween = [[0, 1], [1, 1]]\n",
    );
    let config = file("lager.toml", "[logic]\ntry_again_s = 2\n");
    let mut up = domain.start(&[
        "--config",
        &config,
        "up",
        "--headless",
        "--warehouse",
        &warehouse,
        "--mission",
        "1",
        "--speed",
        "3",
        "--exit-when-done",
        "--json",
    ]);
    assert_eq!(up.wait(), Some(3), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([]), "{told}");
    assert_eq!(told["failure_kind"], "Unreachable", "{told}");
    let why = told["failure"].as_str().expect("a sentence");
    assert!(why.contains("the robot cannot get from"), "{why}");
    domain.assert_clean();
}

#[test]
fn a_battery_that_nobody_charges_ends_the_mission_and_is_told() {
    let domain = Domain::new();
    // A limit so high that no battery is charged enough.
    let config = domain.folder().join("lager.toml");
    std::fs::write(&config, "[logic]\nlow_battery_decivolts = 255\n").expect("a file");
    let mut up = domain.start(&[
        "--config",
        config.to_str().expect("UTF-8"),
        "up",
        "--headless",
        "--mission",
        "1",
        "--speed",
        "3",
        "--exit-when-done",
        "--json",
    ]);
    assert_eq!(up.wait(), Some(3), "{}", up.log());
    let told = up.json();
    assert_eq!(told["delivered"], serde_json::json!([]), "{told}");
    assert_eq!(told["hold"], "Battery", "{told}");
    assert_eq!(told["failure_kind"], serde_json::Value::Null, "{told}");
    let why = told["failure"].as_str().expect("a sentence");
    assert!(why.contains("the battery is low"), "{why}");
    assert!(why.contains("Charge the battery"), "{why}");
    domain.assert_clean();
}

#[test]
fn what_waits_outlives_up_and_a_script_leaves_it_alone() {
    let domain = Domain::new();
    let mut up = robot(&domain);
    domain.done(&["queue", "add", "3"]);
    domain.done(&["queue", "add", "2"]);
    let kept = domain.bus_folder().join(".state/r1/orders.toml");
    wait_for("them to be kept", || {
        let text = std::fs::read_to_string(&kept).ok()?;
        (text.matches("product = ").count() == 3).then_some(())
    });
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let before = std::fs::read_to_string(&kept).expect("they are kept");

    // The stop has outlived the robot as well, and no waiting order releases it.
    let mut up = domain.start(&["up", "--headless", "--speed", "4"]);
    wait_for("all three to wait", || {
        (products(&domain) == ["1", "3", "2"] || listed(&domain).contains("goods 1, under way"))
            .then_some(())
    });
    wait_for("people to be told", || {
        let told = "3 orders wait from before, for goods 1, 3, 2; `lager queue clear`";
        up.output().contains(told).then_some(())
    });
    assert!(
        !up.output().contains("the stop is released"),
        "{}",
        up.output()
    );
    let twice = said(&domain.run(&["queue", "add", "3"]));
    assert!(twice.contains("goods 3 are ordered already"), "{twice}");
    domain.done(&["resume"]);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());

    let script = [
        "up",
        "--headless",
        "--speed",
        "6",
        "--mission",
        "2",
        "--exit-when-done",
        "--json",
    ];
    let mut up = domain.start(&script);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    assert_eq!(up.json()["delivered"], serde_json::json!([2]));
    assert_eq!(std::fs::read_to_string(&kept).expect("still kept"), before);

    // A damaged file is moved out of the way, and the robot starts.
    std::fs::write(&kept, "[[order]]\nid = ").expect("a file");
    let mut up = domain.start(&["up", "--headless", "--speed", "4"]);
    wait_for("the robot", || {
        up.output().contains("fetches goods 1").then_some(())
    });
    assert!(
        up.output().contains("orders.toml.damaged-"),
        "{}",
        up.output()
    );
    domain.done(&["stop"]);
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
}

#[test]
fn delivered_goods_are_shown_as_gone_and_not_fetched_again() {
    let domain = Domain::new();
    let mut up = domain.start(&["up", "--headless", "--speed", "6", "--mission", "1"]);
    wait_for("the delivery", || {
        up.output().contains("DELIVERED goods 1").then_some(())
    });
    wait_for("it to be shown", || {
        let map = said(&domain.run(&["map"]));
        map.contains("it was delivered").then_some(())
    });
    let again = domain.run(&["fetch", "1"]);
    assert!(!again.status.success());
    let why = said(&again);
    assert!(why.contains("goods 1 were delivered "), "{why}");
    assert!(
        why.contains("put them back") && why.contains("`lager map back`"),
        "{why}"
    );
    // In the simulated world the goods are in another place, and it says so.
    let back = said(&domain.run(&["map", "back", "1"]));
    assert!(
        back.contains("goods 1 are not in their place in the simulated world"),
        "{back}"
    );
    let back = said(&domain.run(&["map", "back", "2"]));
    assert_eq!(back, "nobody has missed goods 2");
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0), "{}", up.log());
}

#[test]
fn the_queue_is_shown_and_changed_and_outlives_the_navigator() {
    let domain = Domain::new();
    let mut up = robot(&domain);
    for (product, answer) in [
        ("3", "logic fetches goods 3 next"),
        ("2", "logic fetches goods 2; waiting before it: 1"),
    ] {
        assert_eq!(said(&domain.run(&["queue", "add", product])), answer);
    }
    assert_eq!(products(&domain), ["3", "2"]);
    for product in ["1", "3"] {
        let twice = said(&domain.run(&["queue", "add", product]));
        assert!(
            twice.contains(&format!("goods {product} are ordered already")),
            "{twice}"
        );
    }

    let refused = domain.run(&["queue", "add", "99"]);
    assert!(!refused.status.success());
    assert!(said(&refused).contains("goods 99"), "{}", said(&refused));
    let unknown = domain.run(&["queue", "cancel", "7"]);
    assert!(
        said(&unknown).contains("no order 7 waits"),
        "{}",
        said(&unknown)
    );

    let numbers = waiting(&domain);
    domain.done(&["queue", "up", &numbers[1].0]);
    assert_eq!(products(&domain), ["2", "3"]);

    let logic = up.service("logic").expect("a navigator");
    kill_process(pid(logic), Signal::KILL).expect("a living navigator");
    wait_for("its successor", || {
        up.service("logic").filter(|successor| *successor != logic)
    });
    wait_for("the queue of before", || {
        let under_way = listed(&domain).contains("goods 1, under way");
        (under_way && products(&domain) == ["2", "3"]).then_some(())
    });

    domain.done(&["queue", "clear"]);
    assert_eq!(products(&domain), [""; 0]);
    // The robot has not got the goods of product 1 yet.
    let under_way = listed(&domain);
    let number = under_way.split([' ', ':']).nth(1).expect("a number");
    domain.done(&["cancel", number]);
    let map = said(&domain.run(&["map"]));
    assert!(
        map.starts_with("2 x 2 squares of 50 cm; delivery at (0, 0)\ngoods 1: "),
        "{map}"
    );
    assert_eq!(listed(&domain), "no order is under way or waits");
    let again = said(&domain.run(&["queue", "add", "2"]));
    assert_eq!(again, "logic fetches goods 2 next");
    domain.done(&["queue", "add", "1"]);
    domain.done(&["resume"]);
    wait_for("both to be delivered", || {
        (listed(&domain) == "no order is under way or waits").then_some(())
    });
    // The log reports a delivery after the state shows it.
    let delivered = |up: &Running| up.output().matches("DELIVERED goods").count();
    wait_for("both to be told", || (delivered(&up) >= 2).then_some(()));
    assert_eq!(delivered(&up), 2, "{}", up.output());
    up.signal(Signal::INT);
    assert_eq!(up.wait(), Some(0));
    domain.assert_clean();
}
