//! Why something is not done is told in the reader's language: whatever robot, station and panel
//! say of it the page knows in Swedish.

use std::fmt::Display;
use std::time::Duration;

use lager_lines::{Coord, Map, MapError, Name, Products, ProductsError, TooLate, check_names};
use lager_station::{ActRefused, CommandRefused, SaveError, WarehouseError, WishRefused};
use lager_topics::{
    Calibration, Coded, Failure, FailureKind, Finish, Health, OrderQueue, Outcome, Refusal,
    WorldRefusal,
};
use serde_json::{Value, json};

use crate::browser::Page;
use crate::played::Stage;

/// Where reasons are written down as sentences.
const SOURCES: [&str; 9] = [
    include_str!("../../services/comm/src/conversation.rs"),
    include_str!("../../services/comm/src/conversation/orders.rs"),
    include_str!("../../services/comm/src/conversation/samples.rs"),
    include_str!("../../services/comm/src/driving.rs"),
    include_str!("../../services/comm/src/known.rs"),
    include_str!("../../services/comm/src/map.rs"),
    include_str!("../../services/comm/src/tasks.rs"),
    include_str!("../../services/panel/src/socket.rs"),
    include_str!("../../services/panel/src/visit.rs"),
];
/// First words of lines between panel and page, which are no sentences.
const LINES: [&str; 13] = [
    "you",
    "done",
    "asked",
    "answer",
    "refused",
    "stopped",
    "thought",
    "past",
    "from",
    "warehouse",
    "about",
    "lost",
    "stop",
];

/// The sentences among the literals of a source, with a number in place of each value.
fn written(source: &str) -> Vec<String> {
    let code: String = source
        .lines()
        .take_while(|line| *line != "#[cfg(test)]")
        .filter(|line| !line.trim_start().starts_with("//"))
        .map(|line| format!("{line}\n"))
        .collect();
    let literals = code.split('"').skip(1).step_by(2);
    let sentences = literals.map(|literal| {
        let lines: Vec<_> = literal.split("\\\n").map(str::trim_start).collect();
        let mut parts = lines.concat();
        while let (Some(from), Some(to)) = (parts.find('{'), parts.find('}')) {
            parts.replace_range(from..=to, "7");
        }
        // What became of a command stands behind its name.
        match parts.split(' ').next() {
            Some("is" | "does") => format!("forward {parts}"),
            _ => parts,
        }
    });
    let is_one = |text: &String| {
        let first = text.split(' ').next().unwrap_or("");
        text.contains(' ') && !LINES.contains(&first) && text.contains(char::is_alphabetic)
    };
    sentences.filter(is_one).collect()
}

fn all<T: Coded + Display>() -> impl Iterator<Item = String> {
    T::VARIANTS.iter().map(|(variant, _)| variant.to_string())
}

/// The sentences that types make.
fn typed() -> Vec<String> {
    let mut all: Vec<String> = all::<Refusal>()
        .chain(all::<Outcome>())
        .chain(all::<WorldRefusal>())
        .chain(all::<Finish>().map(|finish| format!("forward {finish}")))
        .collect();
    let failures = FailureKind::VARIANTS.iter();
    all.extend(failures.map(|(kind, _)| Failure::new(*kind, (1, 2), 3, 4).to_string()));
    let partly = Health {
        calibration: Calibration::Partly.into(),
        ..Health::default()
    };
    all.extend([partly, Health::default()].map(|health| {
        let failure = health.calibration_failure();
        failure.expect("it has not ended well")
    }));
    let under_way = OrderQueue {
        under_way: 1,
        order_id: 7,
        ..OrderQueue::default()
    };
    all.extend([under_way, OrderQueue::default()].map(|queue| {
        let why = queue.before(7).expect_err("it does not wait");
        why.to_string()
    }));
    let by = "panel-3".to_owned();
    let robot = Name::new("r1").expect("a name");
    let coord = |x, y| Coord { x, y };
    let corner = Map::new(coord(2, 3), coord(1, 0)).expect_err("no corner");
    let empty = MapError::Empty { size: coord(0, 3) };
    let id = lager_lines::ProductId::new(7).expect("a number");
    let product = lager_lines::Product {
        id,
        square: coord(0, 0),
        side: lager_lines::Direction::Up,
    };
    let twice: ProductsError = Products::new(vec![product, product]).expect_err("it is twice");
    let unsaved = SaveError::Write {
        path: "warehouse.toml".into(),
        error: std::io::ErrorKind::StorageFull.into(),
    };
    let refused: [&dyn Display; 17] = [
        &ActRefused::Plain,
        &ActRefused::Full,
        &ActRefused::Driven { by },
        &ActRefused::NotDriver,
        &ActRefused::Late(TooLate(Duration::from_millis(7))),
        &CommandRefused::NotAsked,
        &CommandRefused::Full,
        &CommandRefused::NotPicking,
        &WishRefused::NoRobot(robot),
        &unsaved,
        &corner,
        &empty,
        &twice,
        &WarehouseError::SideLength,
        &WarehouseError::Negative { id: -7 },
        &WarehouseError::Side {
            id: 7,
            side: "north".into(),
        },
        &WarehouseError::TooMany { count: 7_000 },
    ];
    all.extend(refused.map(|reason| reason.to_string()));
    // Names that no product can have.
    let names: [&[&str]; 3] = [&["7"], &["a,b"], &["nails", "nails"]];
    all.extend(names.map(|names| {
        let refused = check_names(names.iter().copied());
        refused.expect_err("no such names").to_string()
    }));
    let outside = WarehouseError::Outside {
        id: 7,
        x: 3,
        y: 3,
        last_x: 1,
        last_y: 1,
    };
    all.push(outside.to_string());
    all
}

/// What the page says in place of these.
fn told(page: &mut Page, reasons: &[String]) -> Value {
    let expression = format!(
        "import('/reasons.js').then(({{ reason }}) => {}.map(reason))",
        json!(reasons)
    );
    let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
    let said = page.call("Runtime.evaluate", &params);
    assert!(said["exceptionDetails"].is_null(), "{said}");
    said["result"]["value"].clone()
}

#[test]
fn every_reason_that_is_told_is_told_in_swedish() {
    let mut reasons = typed();
    let before = reasons.len();
    reasons.extend(SOURCES.iter().flat_map(|source| written(source)));
    assert!(reasons.len() > before + 30, "{:#?}", &reasons[before..]);
    let stage = Stage::new(None);
    let mut page = stage.page(&stage.url);
    let english = told(&mut page, &reasons);
    for (told, said) in english.as_array().expect("a list").iter().zip(&reasons) {
        // But a page has buttons, where a terminal has commands.
        match said.contains("`lager ") {
            false => assert_eq!(told, said, "in English it is as it was said"),
            true => assert!(!told.as_str().expect("a text").contains("`lager resume`")),
        }
    }
    page.click("#language");
    let swedish = told(&mut page, &reasons);
    // Words that only English has.
    let english = [" the ", " is ", " it ", " are ", " has "];
    let left: Vec<_> = reasons
        .iter()
        .zip(swedish.as_array().expect("a list"))
        .filter(|(reason, told)| {
            let told = told.as_str().expect("a text");
            told == *reason || english.iter().any(|word| told.contains(word))
        })
        .collect();
    assert!(left.is_empty(), "{left:#?}");
    // One may stand in another.
    let stopped = format!("forward is not possible now: {}", Refusal::StopLatched);
    assert_eq!(
        told(&mut page, &[stopped]),
        json!(["framåt går inte nu: roboten är stoppad"])
    );
    drop(page);
    stage.end();
}
