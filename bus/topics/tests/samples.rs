//! Payloads as tools see them: as JSON, and in memory that another program has written.

use lager_floor::Heading;
use lager_sample::{Coded, Tag, Topic};
use lager_topics::{
    BoardHealth, DistanceFrame, FailureKind, Finish, Health, Hold, LineFrame, MapProduct, Remedy,
    Role, Route, RouteNode, SERVO_UNKNOWN, SteeringReport, TOPICS, Thought, ThoughtKind,
    TopicVisitor, Truth, WarehouseMap, visit,
};
use lager_wire::{BUILD, LineState};
use serde::Serialize;
use serde::de::DeserializeOwned;

fn json<T: Serialize>(value: &T) -> serde_json::Value {
    serde_json::to_value(value).unwrap()
}

fn there_and_back<T: Serialize + DeserializeOwned>(value: &T) -> T {
    serde_json::from_value(json(value)).unwrap()
}

#[test]
fn a_line_frame_reads_as_names_and_numbers() {
    let frame = LineFrame {
        link_epoch: 3,
        bits: 0b000_0111_0000,
        state: LineState::LeftOfLine.into(),
        packet_id: 9,
    };
    assert_eq!(
        json(&frame),
        serde_json::json!({"link_epoch": 3, "bits": 112, "state": "LeftOfLine", "packet_id": 9})
    );
    assert_eq!(there_and_back(&frame), frame);
}

#[test]
fn fields_left_out_of_json_are_blank() {
    let frame: DistanceFrame = serde_json::from_str("{\"packet_id\": 4}").unwrap();
    assert_eq!(frame.packet_id, 4);
    assert_eq!(frame.distance_cm, 255);
}

#[test]
fn reserved_bytes_do_not_show() {
    let shown = json(&Health::default());
    assert!(shown.get("reserved").is_none(), "{shown}");
    assert!(shown["sensor"].get("reserved").is_none(), "{shown}");
}

#[test]
fn a_list_shows_its_used_part_and_comes_back_whole() {
    let mut map = WarehouseMap {
        width: 2,
        height: 3,
        product_count: 2,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: -7,
        x: 1,
        y: 2,
        side: Heading::Down.into(),
        reserved: 0,
    };
    let shown = json(&map);
    assert_eq!(shown["products"].as_array().unwrap().len(), 1, "{shown}");
    assert_eq!(shown["products"][0]["side"], "Down");
    let back = there_and_back(&map);
    assert_eq!(back, map);
    assert_eq!(back.products().len(), 2);
}

#[test]
fn a_list_longer_than_its_place_is_refused() {
    let nodes: Vec<_> = (0..513).map(|_| RouteNode { x: 1, y: 1 }).collect();
    let text = serde_json::json!({"length": 513, "nodes": nodes}).to_string();
    let error = serde_json::from_str::<Route>(&text).unwrap_err();
    assert!(error.to_string().contains("at most 512"), "{error}");
}

#[test]
fn a_count_beyond_the_list_does_not_panic() {
    let route = Route {
        length: u16::MAX,
        ..Route::default()
    };
    assert_eq!(route.nodes().len(), 512);
    let truth = Truth {
        good_count: u16::MAX,
        ..Truth::default()
    };
    assert_eq!(truth.goods().len(), 256);
}

#[test]
fn a_thought_is_values_and_becomes_a_sentence_where_it_is_read() {
    let thought = Thought {
        from: Role::Logic.into(),
        product: 7,
        seen: 3,
        ..ThoughtKind::Fetching.into()
    };
    let told = json(&thought);
    assert_eq!(
        (&told["kind"], &told["from"], &told["seen"]),
        (&"Fetching".into(), &"Logic".into(), &3.into())
    );
    assert_eq!(there_and_back(&thought), thought);
    assert_eq!(thought.to_string(), "I fetch goods 7; crossings to go: 3.");
}

#[test]
fn every_failure_and_every_hold_but_none_names_what_would_end_it() {
    for (kind, name) in FailureKind::VARIANTS {
        let ended_already = matches!(kind, FailureKind::None | FailureKind::PutDown);
        assert_eq!(kind.remedy() == Remedy::None, ended_already, "{name}");
    }
    for (hold, name) in Hold::VARIANTS {
        let none = *hold == Hold::None;
        assert_eq!(hold.remedy() == Remedy::None, none, "{name}");
    }
}

#[test]
fn what_has_not_been_heard_is_marked_as_unknown() {
    let report = SteeringReport::default();
    assert_eq!(report.servo_position, [SERVO_UNKNOWN; 8]);
    assert_eq!(report.finish, Finish::None);
    assert_eq!(BoardHealth::default().version, BoardHealth::UNKNOWN);
    assert_eq!(BoardHealth::default().misfit(), None);
    assert_eq!(Health::default().gain_p, Health::NEVER_SET);
    assert_eq!(Health::default().gain_d, Health::NEVER_SET);
    assert_eq!(Truth::default().carrying, -1);
}

#[test]
fn an_unknown_code_of_a_newer_writer_survives_json() {
    let frame = LineFrame {
        state: Tag::from_raw(200),
        ..LineFrame::default()
    };
    assert_eq!(json(&frame)["state"], 200);
    assert_eq!(there_and_back(&frame).state.get(), None);
}

struct RoundTrip;

impl TopicVisitor for RoundTrip {
    type Output = ();

    fn visit<T: Topic>(self) {
        let blank = T::Payload::default();
        assert_eq!(there_and_back(&blank), blank, "{}", T::NAME);
    }
}

#[test]
fn every_blank_payload_comes_back_from_json() {
    for topic in TOPICS {
        visit(topic.name, RoundTrip).unwrap();
    }
}

#[test]
fn fields_lie_without_gaps() {
    for topic in TOPICS {
        let mut end = 0;
        for field in topic.layout.fields {
            assert_eq!(field.offset, end, "{}.{}", topic.name, field.name);
            end += field.size;
        }
        assert_eq!(end, topic.layout.size, "{}", topic.name);
    }
}

#[test]
fn an_image_that_does_not_fit_is_named_with_what_helps_and_an_original_board_is_no_fault() {
    let said = |version, build| {
        let board = BoardHealth {
            version,
            build,
            ..BoardHealth::default()
        };
        board.misfit().map(|misfit| misfit.to_string())
    };
    assert_eq!(said(1, BUILD), None);
    assert_eq!(said(0, 0), None, "an original board");
    for (build, helps) in [
        (0, "`lager board update`"),
        (BUILD - 1, "`lager board update`"),
        (BUILD + 1, "install the newer program"),
    ] {
        let said = said(1, build).expect("it does not fit");
        for words in [format!("build {build},"), format!("build {BUILD};")] {
            assert!(said.contains(&words), "{said}");
        }
        assert!(said.contains(helps), "{said}");
    }
}
