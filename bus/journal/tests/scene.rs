//! What viewers are shown, and that it stands in a file beside the samples without being one.

use std::collections::BTreeMap;

use lager_floor::Heading;
use lager_journal::{
    Check, Envelope, EnvelopeSchema, Journal, Learnt, Overview, OverviewReader, Recovery, Scene,
    Shown, Start, Times, View, Visit, Walk,
};
use lager_sample::{Description, Field, Payload, Stamp, describe};
use lager_topics::{
    BlockedWay, BlockedWays, Failure, FailureKind, LineFrame, MapProduct, NavigatorStatus, Phase,
    Role, Thought, ThoughtKind, Truth, TruthGood, WarehouseMap,
};
use serde_json::Value;

/// Some moment, in ns since 1970.
const BEGIN: u64 = 1_795_449_546_000_000_007;

fn message<P: Payload>(payload: P) -> Vec<u8> {
    let envelope = Envelope {
        stamp: Stamp::default(),
        lost: 0,
        dropped: 0,
        payload,
    };
    serde_json::to_vec(&envelope).unwrap()
}

fn map() -> WarehouseMap {
    let mut map = WarehouseMap {
        width: 3,
        height: 2,
        side_length_cm: 40,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 7,
        x: 1,
        y: 0,
        side: Heading::Up.into(),
        ..MapProduct::default()
    };
    map
}

fn truth(x_mm: f64) -> Truth {
    let mut truth = Truth {
        x_mm,
        y_mm: 200.0,
        heading_rad: std::f64::consts::FRAC_PI_2,
        good_count: 1,
        ..Truth::default()
    };
    truth.goods[0] = TruthGood {
        id: 7,
        x_mm: x_mm as f32,
        ..TruthGood::default()
    };
    truth
}

/// The message of a view, if it is shown.
fn of(shown: &[Shown], view: View) -> Option<Value> {
    let shown = shown.iter().find(|shown| shown.view == view)?;
    Some(serde_json::from_slice(&shown.message).unwrap())
}

fn close(value: &Value, to: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - to).abs() < 1e-9, "{value} for {to}");
}

#[test]
fn the_warehouse_is_lines_and_marks_in_metres() {
    let mut scene = Scene::default();
    let shown = scene.take("nav/map", BEGIN, &message(map()));
    let drawn = &of(&shown, View::Map).unwrap()["entities"][0];
    assert_eq!(drawn["frame_id"], "map");
    assert_eq!(drawn["timestamp"]["sec"], BEGIN / 1_000_000_000);
    assert_eq!(drawn["timestamp"]["nsec"], 7);
    // Three rows and four columns of tape, each with two ends.
    assert_eq!(drawn["lines"][0]["points"].as_array().unwrap().len(), 14);
    close(&drawn["lines"][0]["points"][1]["x"], 1.2);
    let goods = &drawn["cubes"][1]["pose"]["position"];
    close(&goods["x"], 0.6);
    close(&goods["y"], 0.4);
    assert_eq!(drawn["texts"][1]["text"], "7");

    let mut ways = BlockedWays {
        count: 1,
        ..BlockedWays::default()
    };
    ways.ways[0] = BlockedWay {
        x: 1,
        y: 1,
        heading: Heading::Left.into(),
        ..BlockedWay::default()
    };
    // A robot tells its blocked ways before it has a map.
    let mut early = Scene::default();
    assert_eq!(early.take("nav/blocks", BEGIN, &message(ways)), []);
    let shown = early.take("nav/map", BEGIN, &message(map()));
    assert!(of(&shown, View::Blocks).is_some());

    let shown = scene.take("nav/blocks", BEGIN, &message(ways));
    let blocked = &of(&shown, View::Blocks).unwrap()["entities"][0]["cubes"][0];
    close(&blocked["pose"]["position"]["x"], 0.2);
    close(&blocked["pose"]["position"]["y"], 0.4);
}

#[test]
fn the_robot_is_where_the_simulator_and_where_the_navigator_say() {
    let mut scene = Scene::default();
    let status = NavigatorStatus {
        x: 2,
        y: 1,
        travelled_mm: 100,
        phase: Phase::Driving.into(),
        heading: Heading::Left.into(),
        ..NavigatorStatus::default()
    };
    // Without a map nobody knows how far nodes are apart.
    assert_eq!(scene.take("nav/status", BEGIN, &message(status)), []);
    scene.take("nav/map", BEGIN, &message(map()));
    let shown = scene.take("nav/status", BEGIN, &message(status));
    let believed = &of(&shown, View::Believed).unwrap()["pose"];
    close(&believed["position"]["x"], 0.7);
    close(&believed["position"]["y"], 0.4);
    // Half a turn about the vertical.
    close(
        &believed["orientation"]["z"].as_f64().unwrap().abs().into(),
        1.0,
    );
    let frame = of(&shown, View::Frames).unwrap();
    assert_eq!(frame["child_frame_id"], "navigator");
    let bodies = of(&shown, View::Bodies).unwrap();
    let frames = [0, 1].map(|body| bodies["entities"][body]["frame_id"].clone());
    assert_eq!(frames, ["robot", "navigator"]);

    let shown = scene.take("truth/pose", BEGIN, &message(truth(300.0)));
    let pose = of(&shown, View::Pose).unwrap();
    close(&pose["pose"]["position"]["x"], 0.3);
    close(
        &pose["pose"]["orientation"]["z"],
        std::f64::consts::FRAC_1_SQRT_2,
    );
    let frame = of(&shown, View::Frames).unwrap();
    assert_eq!(
        (&frame["parent_frame_id"], &frame["child_frame_id"]),
        (&"map".into(), &"robot".into())
    );
    assert_eq!(of(&shown, View::Bodies), None, "they were shown");
}

#[test]
fn goods_are_shown_when_they_have_moved_and_not_too_often() {
    let mut scene = Scene::default();
    let mut is_shown = |ms: u64, x_mm: f64| {
        let time = BEGIN + ms * 1_000_000;
        let shown = scene.take("truth/pose", time, &message(truth(x_mm)));
        of(&shown, View::World).is_some()
    };
    assert!(is_shown(0, 0.0));
    assert!(!is_shown(500, 0.0), "nothing has moved");
    assert!(is_shown(510, 1.0));
    assert!(!is_shown(520, 2.0), "too early");
    assert!(is_shown(611, 2.0));
}

#[test]
fn a_thought_is_a_line_of_a_log_and_a_failure_is_a_warning() {
    let mut scene = Scene::default();
    let mut thought = Thought {
        product: 3,
        from: Role::Logic.into(),
        ..ThoughtKind::Delivered.into()
    };
    let shown = scene.take("log/thought", BEGIN, &message(thought));
    let log = of(&shown, View::Log).unwrap();
    assert_eq!(log["message"], "Goods 3 are delivered. I go back.");
    assert_eq!((&log["name"], &log["level"]), (&"logic".into(), &2.into()));
    thought.kind = ThoughtKind::Failed.into();
    thought.failure = Failure {
        kind: FailureKind::LineLost.into(),
        ..Failure::default()
    };
    let shown = scene.take("log/thought", BEGIN, &message(thought));
    assert_eq!(of(&shown, View::Log).unwrap()["level"], 3);
}

#[test]
fn what_lasts_is_shown_again_to_who_begins_later_and_other_topics_show_nothing() {
    let mut scene = Scene::default();
    scene.take("nav/map", BEGIN, &message(map()));
    scene.take("truth/pose", BEGIN, &message(truth(1.0)));
    let lasting: Vec<View> = scene.lasting().iter().map(|shown| shown.view).collect();
    assert_eq!(lasting, [View::Map, View::Bodies, View::World]);
    assert_eq!(
        scene.take("sensor/line", BEGIN, &message(LineFrame::default())),
        []
    );
    assert_eq!(
        scene.take("nav/map", BEGIN, b"{\"payload\":{\"width\":\"wide\"}}"),
        []
    );
}

/// A file with samples of `truth/pose` and what is derived of them, and where its last chunk ends.
fn file() -> (Vec<u8>, usize, u64) {
    let mut journal = Journal::begin(&Start::default()).unwrap();
    let description = Description::parse(&describe(&Truth::MAKE)).unwrap();
    let topic = journal
        .topic("truth/pose", &EnvelopeSchema::of(&description))
        .unwrap();
    let (mut scene, mut views) = (Scene::default(), BTreeMap::new());
    let mut derived = 0;
    for number in 0..10 {
        let stamp = Stamp {
            sequence: number,
            ..Stamp::default()
        };
        let payload = truth(number as f64);
        let envelope = Envelope {
            stamp,
            lost: 0,
            dropped: 0,
            payload,
        };
        let message = serde_json::to_vec(&envelope).unwrap();
        let time = BEGIN + 200_000_000 * number;
        let times = Times {
            log: time,
            publish: time,
        };
        journal.write(topic, times, number, &message).unwrap();
        for shown in scene.take("truth/pose", time, &message) {
            let view = shown.view;
            let channel = *views
                .entry(view)
                .or_insert_with(|| journal.view(view).unwrap());
            journal
                .write(channel, times, number, &shown.message)
                .unwrap();
            derived += 1;
        }
    }
    let mut bytes = Vec::new();
    journal.flush().unwrap();
    journal.take(&mut bytes);
    let whole = bytes.len();
    let count = lager_journal::Count {
        received: 10,
        ..Default::default()
    };
    let counts = [("truth/pose".to_owned(), count)].into();
    bytes.append(&mut journal.end(&counts).unwrap());
    (bytes, whole, derived)
}

fn walk(bytes: &[u8], visit: &mut impl Visit) -> Learnt {
    let mut walk = Walk::default();
    walk.feed(bytes, visit);
    walk.finish(visit)
}

fn overview(bytes: &[u8]) -> Overview {
    let mut reader = OverviewReader::new(bytes.len() as u64);
    while let Some(part) = reader.wants().unwrap() {
        let (from, to) = (part.at as usize, part.at as usize + part.length);
        reader.supply(&bytes[from..to.min(bytes.len())]);
    }
    reader.finish().unwrap()
}

#[test]
fn derived_messages_are_counted_as_no_samples_and_are_recovered_with_the_rest() {
    let (bytes, whole, derived) = file();
    let saved = {
        let mut recovery = Recovery::default();
        walk(&bytes[..whole + 3], &mut recovery);
        let mut saved = Vec::new();
        recovery.take(&mut saved);
        let (mut last, _) = recovery.finish().unwrap();
        saved.append(&mut last);
        saved
    };
    for bytes in [bytes, saved] {
        let mut check = Check::default();
        walk(&bytes, &mut check);
        let report = check.finish();
        assert!(report.faults.is_empty(), "{:?}", report.faults);
        assert_eq!(report.topics["truth/pose"].gaps, 0);
        let overview = overview(&bytes);
        assert_eq!(overview.messages, 10 + derived);
        let derived = overview.topics.iter().filter(|topic| topic.is_derived);
        let names: Vec<&str> = derived.map(|topic| topic.name.as_str()).collect();
        let views = [View::Bodies, View::Frames, View::Pose, View::World];
        assert_eq!(names, views.map(View::topic));
        for topic in &overview.topics {
            assert_eq!(topic.count.is_some(), !topic.is_derived, "{}", topic.name);
        }
    }
}
