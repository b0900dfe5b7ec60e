//! Takes pictures of the panel's views: each in both themes, on a laptop, at a desk and on a phone, one
//! on a large screen. Played robots show states that a simulated robot hardly gets into.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use crate::Scene;
use crate::browser::Page;
use crate::commissioning::AT_WORK;
use crate::played::Stage;

/// Name, width and height in pixels, and whether the screen is held in the hand.
const SCREENS: [(&str, u32, u32, bool); 3] = [
    ("laptop", 1280, 720, false),
    ("desk", 1920, 1080, false),
    ("phone", 360, 740, true),
];

/// Takes a picture of the current view.
fn view(page: &mut Page, name: &str) {
    for (screen, width, height, in_hand) in SCREENS {
        for theme in ["light", "dark"] {
            page.dress(theme, width, height, in_hand);
            take(page, &format!("{name}-{screen}-{theme}"));
        }
    }
    page.dress("light", 1280, 720, false);
}

fn take(page: &mut Page, name: &str) {
    let folder = PathBuf::from(std::env::var_os("LAGER_PICTURES").expect("LAGER_PICTURES"));
    page.value("document.activeElement?.blur()");
    // The page redraws its drawings five times a second.
    std::thread::sleep(Duration::from_millis(400));
    let file = folder.join(format!("{name}.png"));
    std::fs::write(&file, page.picture()).expect("a folder that can be written to");
}

#[test]
#[ignore = "it makes pictures: tests/screenshots"]
fn of_every_view() {
    let mut scene = Scene::new(1.0, &["--warehouse", "small"]);
    let mut page = scene.page();
    scene.wait_to_move();
    page.click_at_mm(0.0, 750.0);
    page.wait_for("#map-said", "obstacle put");
    page.order("2", &Page::fetches("2"));
    view(&mut page, "under-way");
    page.dress("light", 3840, 2160, false);
    take(&mut page, "under-way-4k-light");
    page.dress("light", 1280, 720, false);
    for tab in ["setup", "line", "log", "health", "signals"] {
        page.open_view(tab);
        view(&mut page, tab);
    }
    page.click("#help-open");
    view(&mut page, "help");
    page.click("#help-close");
    page.change_language();
    page.click("#tab-missions");
    view(&mut page, "under-way-swedish");
    page.change_language();
    page.click("#tab-missions");
    page.wait_for("#state", "stands at the goods");
    view(&mut page, "picking");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    view(&mut page, "stopped");
    scene.resume();
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");
    view(&mut page, "blocked");
    page.click("#time-before");
    page.wait_until("!document.querySelector('#moment').hidden");
    view(&mut page, "past");
    page.click("#time-now");
    // As seen by people who cannot tell some colours apart, or see none.
    for eyes in ["protanopia", "deuteranopia", "tritanopia", "achromatopsia"] {
        let params = serde_json::json!({ "type": eyes });
        page.call("Emulation.setEmulatedVisionDeficiency", &params);
        take(&mut page, &format!("blocked-laptop-{eyes}"));
    }
    let params = serde_json::json!({ "type": "none" });
    page.call("Emulation.setEmulatedVisionDeficiency", &params);
    let frozen = scene.freeze("comm");
    page.wait_for("#state", "r1 is not heard");
    view(&mut page, "link-lost");
    drop(frozen);
    page.wait_for("#link", " ms");
    scene.take_over(&mut page);
    view(&mut page, "by-hand");
    let mut other = scene.page();
    other.click("#tab-drive");
    view(&mut other, "another-drives");
    other.click("#control");
    page.wait_for("#asked", "asks for the wheel");
    view(&mut page, "asked-for-the-wheel");
    page.click("#keep");
    page.click("#where-ask");
    view(&mut page, "where-it-stands");
    page.click("#where-later");
    let screen = scene.screen();
    page.call("Page.navigate", &serde_json::json!({ "url": screen }));
    page.wait_until("document.querySelector('.screen #doing')?.textContent.length > 0");
    view(&mut page, "screen");
    drop((page, other));
    scene.end();
}

const SMALL: &str = "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 1\nname = \"matches\"\nsquare = [1, 1]\nside = \"left\"\n\
    [[product]]\nid = 2\nname = \"nails\"\nsquare = [0, 0]\nside = \"right\"\n";

/// A robot's state line; `more` adds what the robot does, and boards that do not report.
fn state(more: &str) -> String {
    format!(
        "state time_ms=81250 node=1,1 looks=up delivered=3 line_bits=00001110000 line_error=0 \
         distance_cm=42 servos=512,400,623,600,423,512,512,230 loads=0,120,-120,80,-80,10,0,210 \
         servo_errors=00000000 sensor_lost=0 steering_lost=1 bus_lost=0 gain_p=2 gain_d=2 {more}"
    )
}

const DRIVES: &str = "x_mm=500 y_mm=760 heading_deg=0 unsure_mm=24 next=1,2 phase=driving hold=none \
    mode=autonomous pick=auto stopped=0 order=4 product=2 left_duty=104 right_duty=98 \
    code=00000011 battery_dv=114 sensor_up=1 steering_up=1";

#[test]
#[ignore = "it makes pictures: tests/screenshots"]
fn of_what_is_rare() {
    let stage = Stage::new(None);
    let mut page = stage.page(&stage.url);
    page.wait_for("#state", "No robot has connected yet");
    view(&mut page, "first-start");
    page.open_view("setup");
    view(&mut page, "empty-warehouse");
    drop(page);
    stage.end();

    let stage = Stage::new(Some(SMALL));
    let viewer = stage.viewer.clone();
    let lists = [
        "route 3 1 2 0 2 0 3",
        "blocked 1 1 1 right 40",
        "queue 2 5 1 6 2",
    ];
    let robot = |more: &str| {
        let state = state(more);
        let mut lines = vec![state.as_str()];
        lines.extend(lists);
        stage.robot("r1", &lines)
    };
    let drives = robot(DRIVES);
    let mut page = stage.page(&viewer);
    page.wait_for("#driver", "you may look and stop");
    page.wait_for("#link", " ms");
    view(&mut page, "viewer");
    let second = stage.robot("r2", &[&state(&DRIVES.replace("x_mm=500", "x_mm=0"))]);
    page.wait_until("document.querySelectorAll('#robot option').length === 2");
    view(&mut page, "two-robots");
    drop(second);
    let now = |more: &str| {
        let state = state(more);
        let mut lines = vec![state.as_str()];
        lines.extend(lists);
        drives.says(&lines);
    };
    now(
        "x_mm=500 y_mm=500 heading_deg=0 unsure_mm=10 phase=driving hold=unheard remedy=report \
         mode=autonomous pick=auto stopped=0 order=4 product=2 sensor_up=1 steering_up=0",
    );
    page.wait_for("#state", "the steering board does not report");
    view(&mut page, "board-lost");
    now(
        "x_mm=500 y_mm=500 heading_deg=0 unsure_mm=10 phase=driving hold=battery remedy=charge \
         mode=autonomous pick=auto stopped=0 order=4 product=2 left_duty=0 right_duty=0 \
         code=00000001 battery_dv=98 sensor_up=1 steering_up=1",
    );
    page.wait_for("#state", "the battery is low");
    view(&mut page, "battery-low");
    now(
        "x_mm=500 y_mm=500 heading_deg=0 unsure_mm=10 phase=waiting_for_order hold=none \
         failure=no_way failure_expected=0 failure_seen=0 remedy=way mode=autonomous pick=auto \
         stopped=0 order=4 product=2 left_duty=0 right_duty=0 code=00000001 battery_dv=114 \
         sensor_up=1 steering_up=1",
    );
    page.wait_until("document.querySelector('#map .out-of-reach .why')?.textContent.length > 0");
    view(&mut page, "unreachable");
    drop((page, drives));
    stage.end();

    let middle = "size = [5, 4]\nside_length_cm = 50\ndelivery = [0, 0]\n\
        [[product]]\nid = 1\nname = \"matches\"\nsquare = [1, 1]\nside = \"left\"\n\
        [[product]]\nid = 2\nname = \"nails\"\nsquare = [3, 2]\nside = \"up\"\n\
        [[product]]\nid = 3\nname = \"bolts\"\nsquare = [2, 0]\nside = \"down\"\n";
    let stage = Stage::new(Some(middle));
    let carries = state(&DRIVES.replace("x_mm=500 y_mm=760", "x_mm=1500 y_mm=760"));
    let carries = carries.replace("next=1,2", "next=3,2");
    let lists = [
        carries.as_str(),
        "truth 1512 756 2 2",
        "route 3 3 2 2 2 2 1",
        "blocked 1 2 1 right 40",
        "obstacles 2 2 1 right 4 2 up",
        "queue 1 5 1",
        "gone 2 2 3",
    ];
    let robot = stage.robot("r1", &lists);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    view(&mut page, "carries");
    page.click("#map-legend summary");
    view(&mut page, "legend");
    drop((page, robot));
    stage.end();

    let mut large = "size = [20, 20]\nside_length_cm = 50\ndelivery = [20, 0]\n".to_owned();
    for id in 1..=24 {
        let (x, y) = (id * 7 % 20, id * 11 % 20);
        let side = ["left", "up", "right", "down"][id % 4];
        let product = format!("[[product]]\nid = {id}\nsquare = [{x}, {y}]\nside = \"{side}\"\n");
        let _ = large.write_str(&product);
    }
    let stage = Stage::new(Some(&large));
    let state = state(&DRIVES.replace("x_mm=500 y_mm=760", "x_mm=7000 y_mm=6120"));
    let far = "route 12 14 13 14 14 13 14 12 14 11 14 10 14 9 14 8 14 7 14 7 15 7 16 6 16";
    let robot = stage.robot("r1", &[&state.replace("next=1,2", "next=14,13"), far]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    view(&mut page, "large");
    drop((page, robot));
    stage.end();
}

#[test]
#[ignore = "it makes pictures: tests/screenshots"]
fn of_setting_up_a_robot() {
    let stage = Stage::new(None);
    let robot = stage.robot("r1", &[AT_WORK[0], "commission"]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#remedy", "Set up a robot");
    view(&mut page, "undescribed");
    page.click("#remedy");
    page.wait_for("#commission", "Begin");
    view(&mut page, "set-up-robot");
    page.click("#tab-drive");
    page.click("#control");
    page.wait_for("#control", "You drive");
    page.click("#tab-setup");
    page.click("#commission-open");
    let found = "found 4 line found_polarity_low distance found_model%20gp2y0a02 wheels \
        found_wheels%20are%20are%20not battery found_no_divider";
    let asks = |name: &str, how: &str, more: &str, page: &mut Page| {
        let state = format!("{} {more}", AT_WORK[0]);
        robot.says(&[&state, &format!("commission {how}"), found]);
        page.wait_for("#commission .steps [aria-current]", "");
        std::thread::sleep(Duration::from_millis(800));
        view(page, &format!("set-up-robot-{name}"));
    };
    let line = AT_WORK[1].replacen("commission ", "", 1);
    asks("line", &line, "", &mut page);
    asks(
        "distance",
        "asked=9 step=distance place=3 steps=8 question=ask_range_far takes=number moves=0 \
         shows=live_range%20289",
        "",
        &mut page,
    );
    asks(
        "ways",
        "asked=12 step=wheels place=4 steps=8 question=ask_saw_ahead takes=ways moves=0 \
         shows=live_wheels%200%200",
        "",
        &mut page,
    );
    asks(
        "turn",
        "asked=15 step=turn place=6 steps=8 question=ask_turn_round takes=yes moves=1 \
         shows=live_seconds%203.4",
        "",
        &mut page,
    );
    let file = "/var/lib/lager/r1/robot.toml";
    robot.says(&[
        AT_WORK[0],
        &format!("commission ended=ended_kept%20{file}"),
        found,
        "kept 1 1 [wheels]",
    ]);
    page.wait_for("#commission .question", "has it");
    view(&mut page, "set-up-robot-over");
    page.change_language();
    view(&mut page, "set-up-robot-over-swedish");
    drop((page, robot));
    stage.end();
}

#[test]
#[ignore = "it makes pictures: tests/screenshots"]
fn of_several_robots() {
    let stage = Stage::new(Some(SMALL));
    let at = |x_mm: u32, more: &str| {
        let drives = DRIVES.replace("x_mm=500", &format!("x_mm={x_mm}"));
        state(&format!("{drives} {more}"))
    };
    let lines = [
        at(500, ""),
        at(1_000, "").replace("steering_up=1", "steering_up=0"),
        at(0, "").replace("stopped=0", "stopped=1 stop_cause=ordered stop_by=comm"),
    ];
    let names = ["r1", "r2", "r3"];
    let robots = names.map(|name| {
        let line = lines[usize::from(name.as_bytes()[1] - b'1')].as_str();
        stage.robot(name, &[line, "queue 2 5 1 6 2"])
    });
    let mut page = stage.page(&stage.url.replacen("/?", "/?r1&", 1));
    page.wait_until("document.querySelectorAll('#map .other').length === 2");
    page.click("#tab-fleet");
    view(&mut page, "fleet");
    drop((page, robots));
    stage.end();
}
