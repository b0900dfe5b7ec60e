//! The screen as text at two sizes, and what the keys do to it.
//!
//! The pictures in `pictures/` are what the screen showed when they were taken;
//! `LAGER_PICTURES=take` takes them anew.

use std::path::Path;
use std::time::Duration;

use lager_home::UnitName;
use lager_orders::Mode;
use lager_ports::{Layout, Peer, TopicInfo};
use lager_sample::{Description, Stamp};
use lager_topics::{
    CommandLatency, Durations, Health, LineFrame, NavigatorStatus, OrderQueue, PathLatency, Phase,
    Role, StopCause, TOPICS,
};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::head::Load;
use super::model::{Key, Model, Pressed};
use super::render;
use super::{Lacking, Recorded};
use crate::life::{Failing, Life};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;

/// Who writes the topics of the table.
fn author(topic: &str) -> (Role, u32) {
    match topic {
        name if name.starts_with("nav/") || name.starts_with("mission/e") => (Role::Logic, 4_103),
        "steering/command" | "mission/queue" | "log/thought" => (Role::Logic, 4_103),
        "mission/order" | "operator/input" => (Role::Comm, 4_105),
        "truth/pose" => (Role::Simulator, 4_101),
        _ => (Role::Bridge, 4_102),
    }
}

fn info(topic: &str, writers: Vec<Peer>) -> TopicInfo {
    TopicInfo {
        unit: "r1".parse::<UnitName>().expect("a name"),
        name: topic.to_owned(),
        entry: TOPICS.iter().find(|entry| entry.name == topic),
        layout: Layout::Ours,
        description: None,
        publishers: writers.len(),
        subscribers: 3,
        observers: 1,
        places: TOPICS.iter().all(|entry| entry.name != topic).then_some(74),
        writers,
        readers: Vec::new(),
        woken: Vec::new(),
    }
}

fn peer(role: Role, pid: u32) -> Peer {
    Peer {
        part: Some(role.to_string()),
        pid,
        observes: role.is_observer(),
    }
}

/// A robot that drives, ten seconds after the start of time; `weather/now` loses one in five.
fn driving() -> Model {
    let mut model = Model::new("r1");
    let mut topics: Vec<TopicInfo> = TOPICS
        .iter()
        .map(|entry| {
            let (role, pid) = author(entry.name);
            info(entry.name, vec![peer(role, pid)])
        })
        .collect();
    topics.push(info("weather/now", vec![peer(Role::Guest, 4_200)]));
    model.take_ends(&topics, |_| Life::Alive);
    model.end_window(9 * S);
    for entry in TOPICS {
        let Some(period) = entry.period_ms else {
            continue;
        };
        let period = u64::from(period) * MS;
        for number in 1..=S / period {
            // Every tenth comes a little late.
            let late = if number % 10 == 0 { MS / 2 } else { 0 };
            let at = 9 * S + number * period + late;
            let stamp = Stamp {
                sequence: number,
                publish_time_ns: at,
                source_time_ns: at - 300_000 - late / 4,
                ..Stamp::default()
            };
            model.hear(entry.name, &stamp);
            model.row(entry.name).look((1, entry.qos.buffer), 0, at);
        }
    }
    for number in (0..100_u64).filter(|number| number % 5 > 0) {
        let at = 9 * S + number * 10 * MS;
        let stamp = Stamp {
            sequence: number,
            publish_time_ns: at,
            source_time_ns: at,
            ..Stamp::default()
        };
        model.hear("weather/now", &stamp);
        let lost = u64::from(number % 5 == 1);
        model.row("weather/now").look((1, 16), lost, at);
    }
    let mut health = Health {
        mode: Mode::Autonomous.into(),
        ..Health::default()
    };
    for board in [&mut health.sensor, &mut health.steering] {
        (board.up, board.packets, board.epoch) = (1, 1_000, 1);
        board.board_load_percent = 12;
    }
    health.sensor.lost_total = 2;
    health.sensor.bad_crc = 1;
    model.head.take_health(health, 10 * S - 40 * MS);
    model.head.status = Some(NavigatorStatus {
        phase: Phase::Driving.into(),
        x: 3,
        y: 1,
        delivered: 4,
        ..NavigatorStatus::default()
    });
    model.head.queue = Some(OrderQueue {
        order_id: 7,
        product: 2,
        under_way: 1,
        count: 3,
        ..OrderQueue::default()
    });
    let stage = |scale: u64| {
        let mut stage = Durations::default();
        for number in 0..1_000 {
            // Most take 60 us, some longer, one 2.1 ms.
            let us = match number {
                0 => 2_100,
                1..=9 => 700,
                10..=99 => 90 + number,
                _ => 40 + number / 25,
            };
            stage.record(us * 1_000 * scale);
        }
        stage
    };
    model.head.path.take(PathLatency {
        read_publish: stage(1),
        publish_receive: stage(1),
        decide: stage(1),
        total: stage(3),
    });
    model.head.command.take(CommandLatency {
        order_receive: stage(2),
        receive_write: stage(1),
        total: stage(5),
    });
    model.head.load = Load {
        minute: 0.84,
        cores: 4,
    };
    model.head.pace = Some(1.0);
    model.end_window(10 * S + 5 * MS);
    model
}

fn picture(model: &Model, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a screen");
    let drawn = terminal.draw(|frame| render::draw(model, frame.area(), frame.buffer_mut()));
    let text = render::text(drawn.expect("drawn").buffer);
    assert!(
        text.lines()
            .all(|line| line.chars().count() <= width.into())
    );
    text
}

/// Compares with the picture that was kept.
fn check(name: &str, seen: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/top/pictures");
    let path = folder.join(name);
    if std::env::var_os("LAGER_PICTURES").is_some() {
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(&path, seen).expect("a file");
    }
    let kept = std::fs::read_to_string(&path).expect("a kept picture");
    assert_eq!(seen, kept, "{name} shows something else now:\n{seen}");
}

fn press(model: &mut Model, keys: &str) {
    for key in keys.chars() {
        assert_eq!(model.press(Key::Char(key)), Pressed::Taken);
    }
}

#[test]
fn a_driving_robot_at_both_sizes() {
    let model = driving();
    check("driving-80x24.txt", &picture(&model, 80, 24));
    check("driving-200x60.txt", &picture(&model, 200, 60));
}

#[test]
fn the_keys_explain_themselves_and_a_stop_is_seen() {
    let mut model = driving();
    press(&mut model, "?");
    check("help-80x24.txt", &picture(&model, 80, 24));
    press(&mut model, "x");
    let mut health = model.head.health.expect("a state");
    (health.stopped, health.stop_cause) = (1, StopCause::BoardResets.into());
    health.steering.up = 0;
    model.head.take_health(health, 10 * S);
    press(&mut model, "p");
    check("stopped-80x24.txt", &picture(&model, 80, 24));
}

#[test]
fn an_image_that_does_not_fit_is_named_below_its_board() {
    let mut model = driving();
    let mut health = model.head.health.expect("a state");
    (health.steering.version, health.steering.build) = (1, 1);
    model.head.take_health(health, 10 * S);
    let text = picture(&model, 120, 40);
    let mut lines = text
        .lines()
        .skip_while(|line| !line.starts_with("steering"));
    let below = lines.nth(1).expect("a line below");
    let words = ["its image has build 1,", "`lager board update`"];
    assert!(words.iter().all(|word| below.contains(word)), "{text}");
    let told = model.head.as_json(10 * S);
    assert_eq!(
        (&told["steering"]["fits"], &told["sensor"]["fits"]),
        (&false.into(), &true.into())
    );
}

/// The topics in the order of the screen.
fn topics(model: &Model) -> Vec<String> {
    model.shown().iter().map(|row| row.name.clone()).collect()
}

#[test]
fn what_loses_samples_stands_first_and_is_marked() {
    let mut model = driving();
    assert_eq!(topics(&model)[..2], ["weather/now", "sensor/line"]);
    let text = picture(&model, 80, 24);
    assert!(text.contains("1 topic IN TROUBLE"), "{text}");
    let marked: Vec<&str> = text.lines().filter(|line| line.starts_with('!')).collect();
    assert!(
        marked.len() == 1 && marked[0].contains("weather/now"),
        "{text}"
    );
    // Frozen rows keep their places, whatever happens to them.
    press(&mut model, "f");
    model.row("truth/pose").lose(3, 10 * S);
    model.end_window(11 * S);
    assert_eq!(topics(&model)[1], "sensor/line");
    press(&mut model, "f");
    assert_eq!(topics(&model)[..2], ["truth/pose", "weather/now"]);
}

#[test]
fn rows_are_sorted_by_what_one_asks_for() {
    let mut model = driving();
    press(&mut model, ">");
    assert_eq!(topics(&model)[0], "latency/command");
    press(&mut model, ">");
    assert_eq!(topics(&model)[0], "steering/state");
    press(&mut model, "I");
    assert_eq!(
        topics(&model).last().map(String::as_str),
        Some("steering/state")
    );
    press(&mut model, "I<<<");
    assert_eq!(model.view.sort.name(), "delay");
}

#[test]
fn only_rows_that_are_shown_and_open_are_read() {
    let mut model = driving();
    let wanted = |model: &Model| -> Vec<String> { model.wanted().map(str::to_owned).collect() };
    assert_eq!(wanted(&model).len(), TOPICS.len() + 1);
    press(&mut model, "/sensor");
    assert_eq!(wanted(&model), ["sensor/distance", "sensor/line"]);
    assert_eq!(model.press(Key::Enter), Pressed::Taken);
    // The first row is closed, and then the one that is chosen.
    press(&mut model, " ");
    assert_eq!(wanted(&model), ["sensor/distance"]);
    let text = picture(&model, 80, 24);
    assert!(
        text.lines().any(|line| line.starts_with("-sensor/line")),
        "{text}"
    );
    assert!(text.contains("filter sensor"), "{text}");
    model.press(Key::Down);
    model.press(Key::Down);
    press(&mut model, " ");
    assert!(wanted(&model).is_empty());
    press(&mut model, "+");
    assert_eq!(wanted(&model).len(), 2);
    press(&mut model, "/");
    model.press(Key::Escape);
    assert_eq!(wanted(&model).len(), TOPICS.len() + 1);
    press(&mut model, "-");
    assert!(wanted(&model).is_empty());
    assert_eq!(model.press(Key::Char('q')), Pressed::Quit);
}

/// The heads of the columns that are shown.
fn heads(model: &Model) -> Vec<String> {
    let text = picture(model, 80, 24);
    let head = text.lines().find(|line| line.starts_with(" TOPIC"));
    let words = head.expect("a head").split_whitespace();
    words.map(str::to_owned).collect()
}

#[test]
fn a_narrow_screen_shows_every_column_page_by_page() {
    let mut model = driving();
    let first = heads(&model);
    let mut seen = Vec::new();
    loop {
        seen.append(&mut heads(&model));
        model.press(Key::Right);
        if heads(&model) == first {
            break;
        }
    }
    for head in [
        "WRITER", "STATE", "READERS", "HZ", "EXPECT", "AGE", "LOST", "SKIP", "QUEUE", "JITTER99",
        "KIB/S", "DELAY50", "DELAY99", "DELAYMAX", "SAMPLES",
    ] {
        let times = seen.iter().filter(|seen| *seen == head).count();
        assert_eq!(times, 1, "{head} in {seen:?}");
    }
    model.press(Key::Left);
    assert_ne!(heads(&model), first);
    model.press(Key::Right);
    assert_eq!(heads(&model), first);
}

#[test]
fn the_number_of_a_writer_and_what_is_wrong_are_never_cut() {
    let mut model = driving();
    model.head.load.minute = 123.45;
    let writers = vec![peer(Role::Supervisor, 4_194_304), peer(Role::Supervisor, 7)];
    model.take_ends(&[info("sensor/line", writers)], |_| Life::Alive);
    let text = picture(&model, 80, 24);
    let line = text.lines().find(|line| line.contains("sensor/line"));
    assert!(
        line.is_some_and(|line| line.contains(" supe 4194304 +1 ")),
        "{text}"
    );
    assert!(text.contains("1 topic IN TROUBLE  "), "{text}");
}

#[test]
fn a_topic_that_cannot_be_read_says_so() {
    let mut model = driving();
    let mut maps = info("nav/map", Vec::new());
    maps.layout = Layout::Other;
    model.take_ends(&[maps], |_| Life::Alive);
    let text = picture(&model, 200, 60);
    assert!(
        text.lines().any(|line| line.starts_with("?nav/map")),
        "{text}"
    );
    let rows = model.as_json()["topics"].clone();
    let of = |name: &str| {
        let mut rows = rows.as_array().expect("rows").iter();
        rows.find(|row| row["topic"] == name).expect("the row")["unread"].clone()
    };
    assert!(
        of("nav/map")
            .as_str()
            .is_some_and(|why| why.contains("another build")),
        "{rows}"
    );
    assert!(of("nav/status").is_null(), "{rows}");
}

#[test]
fn a_recording_shows_who_wrote_it_and_what_it_lacks_and_claims_no_readers() {
    let mut recorded = Recorded::new("tour.mcap", "r1", "");
    for number in 0..1_000 {
        let at = S + number * 100 * MS;
        let stamp = Stamp {
            sequence: number,
            publish_time_ns: at,
            source_time_ns: at,
            writer: 4_711,
            ..Stamp::default()
        };
        // From early on three are lacking.
        let lost = if number > 5 { 3 } else { 0 };
        let lacking = Lacking { lost, dropped: 0 };
        for topic in ["link/health", "sensor/line", "weather/now"] {
            recorded.take(topic, &stamp, lacking, serde_json::Value::Null);
        }
        let dropped = Lacking {
            lost: 0,
            dropped: lost,
        };
        recorded.take("nav/status", &stamp, dropped, serde_json::Value::Null);
    }
    // The file has the layout of somebody's own topic, which is in no table.
    recorded.describe("weather/now", &Description::of::<LineFrame>());
    recorded.model.end_recording();
    let text = picture(&recorded.model, 200, 60);
    let row = |topic: &str| -> Vec<String> {
        let line = text.lines().find(|line| line.contains(topic));
        let words = line.expect("a row").split_whitespace();
        words.map(str::to_owned).collect()
    };
    // Topic, writer, its process and state, readers, two rates, age, lost, skipped.
    let health = row("link/health");
    assert_eq!(health[..5], ["!link/health", "process", "4711", "-", "-"]);
    assert_eq!(health[5..7], ["10.0", "10.0"], "{text}");
    assert_eq!(health[8..10], ["3", "0"], "{text}");
    let line = row("sensor/line");
    assert_eq!(
        (line[0].as_str(), &line[8..10]),
        ("!sensor/line", &["3", "0"].map(str::to_owned)[..])
    );
    let status = row("nav/status");
    assert_eq!(
        (status[0].as_str(), status[8].as_str()),
        ("!nav/status", "3")
    );
    let weather = row("weather/now");
    assert_eq!(
        (weather[0].as_str(), weather[12].as_str()),
        ("!weather/now", "0.62")
    );
    let rows = recorded.model.as_json()["topics"].clone();
    assert_eq!(rows[0]["writers"][0]["pid"], 4_711, "{rows}");
    assert!(rows[0]["writers"][0]["state"].is_null(), "{rows}");
    assert!(rows[0]["subscribers"].is_null(), "{rows}");
}

#[test]
fn the_chosen_row_is_always_in_sight() {
    let mut model = driving();
    for _ in 0..3 {
        model.press(Key::End);
        let chosen = model.view.chosen.clone().expect("a row");
        assert_eq!(topics(&model).last(), Some(&chosen));
        assert!(picture(&model, 80, 16).contains(&chosen));
    }
    model.press(Key::Home);
    assert!(picture(&model, 80, 16).contains("weather/now"));
}

#[test]
fn before_anything_is_known_it_is_looking_and_nothing_is_in_trouble() {
    let mut model = Model::new("r1");
    let peers = vec![peer(Role::Bridge, 7)];
    model.take_ends(&[info("sensor/line", peers)], |_| Life::Alive);
    model.end_window(9 * S);
    for number in 1..4 {
        let stamp = Stamp {
            sequence: number,
            publish_time_ns: 9 * S + number * 10 * MS,
            ..Stamp::default()
        };
        model.hear("sensor/line", &stamp);
    }
    let head = |model: &Model| picture(model, 80, 24).lines().next().map(str::to_owned);
    let first = head(&model).expect("a line");
    assert!(first.contains("looking"), "{first}");
    assert!(
        !first.contains("well") && !first.contains("TROUBLE"),
        "{first}"
    );
    let whole = picture(&model, 80, 24);
    assert!(
        !whole.contains("no bridge") && !whole.contains("no navigator"),
        "{whole}"
    );
    model.end_window(10 * S);
    let next = head(&model).expect("a line");
    assert!(!next.contains("looking"), "{next}");
}

#[test]
fn all_is_not_well_while_a_service_does_not_go_on() {
    let mut model = driving();
    model.row("weather/now").rest();
    let failing = |who: &str, pid, silent| Failing {
        who: who.to_owned(),
        pid,
        silent,
    };
    let silent = Some(Duration::from_millis(2_300));
    model.head.failing = vec![
        failing("comm", 4_105, None),
        failing("station", 4_107, silent),
    ];
    let text = picture(&model, 100, 30);
    let first = text.lines().next().expect("a line");
    assert!(first.contains("2 services"), "{text}");
    assert!(
        first.contains("IN TROUBLE") && !first.contains("well"),
        "{text}"
    );
    assert!(
        text.contains("the link to the station (comm), process 4105, is frozen"),
        "{text}"
    );
    assert!(
        text.contains("the station, process 4107, has not gone on for 2.3 s"),
        "{text}"
    );
    let json = model.as_json();
    assert_eq!(json["failing"][0]["state"], "frozen");
    assert_eq!(json["failing"][1]["silent_ns"], 2_300_000_000_u64);
}
