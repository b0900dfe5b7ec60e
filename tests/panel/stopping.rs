//! Tests of STOP at any time and for the right robot, of its traces, and of double presses.

use lager_tests::{pid, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// Reloads the page without its script or over a slow network, and presses STOP as soon as it
/// appears. The form's answer is a page of its own.
fn stop_early(scene: &mut Scene, page: &mut Page, press: fn(&mut Page)) {
    scene.wait_to_move();
    page.call("Page.navigate", &json!({ "url": scene.url }));
    page.wait_until("document.querySelector('#stop') !== null");
    press(page);
    page.wait_until("/both wheels stand after/.test(document.body?.textContent)");
    scene.assert_stands();
    scene.resume();
}

pub(crate) fn stop_works_before_any_script_and_without_a_socket(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.call("Network.enable", &json!({}));
    // A script that does not load, and no script at all.
    for (blocked, press) in [
        (
            json!(["*/main.js"]),
            (|page| page.click("#stop")) as fn(&mut Page),
        ),
        (json!(["*/main.js"]), |page| page.key_down("Escape")),
        (json!(["*.js"]), |page| page.click("#stop")),
    ] {
        page.call("Network.setBlockedURLs", &json!({ "urls": blocked }));
        stop_early(scene, page, press);
        page.key_up("Escape");
    }
    page.call("Network.setBlockedURLs", &json!({ "urls": [] }));
    // A delay of 400 ms, and 50 kB/s.
    let slow = |page: &mut Page, latency: u32, rate: i32| {
        let conditions = json!({
            "offline": false, "latency": latency, "downloadThroughput": rate, "uploadThroughput": rate,
        });
        page.call("Network.emulateNetworkConditions", &conditions);
    };
    slow(page, 400, 50_000);
    stop_early(scene, page, |page| page.click("#stop"));
    slow(page, 0, -1);

    // The socket is dead.
    page.call("Page.navigate", &json!({ "url": scene.url }));
    page.wait_for("#link", " ms");
    scene.wait_to_move();
    page.listen_in();
    page.value("window.WebSocket = class { close() {} }; tapped.close()");
    page.wait_for("#state", "no connection to the station");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "r1: both wheels stand after");
    scene.assert_stands();
    scene.resume();
}

pub(crate) fn a_stop_is_one_press_for_this_robot_by_name_and_another_robot_is_not_shown(
    scene: &mut Scene,
    page: &mut Page,
) {
    // The browser already has the token.
    let (here, _) = scene.url.split_once("/?").expect("a token");
    let here = here.to_owned();
    for at in ["/screen?r77", "/?r77"] {
        page.call("Page.navigate", &json!({ "url": format!("{here}{at}") }));
        page.wait_until("document.body?.textContent.includes('r77 is not here')");
        scene.wait_to_move();
        page.wait_until("document.documentElement.dataset.stops !== undefined");
        page.key_down("Escape");
        page.key_up("Escape");
        page.wait_for("#stop-said", "NOT SENT: r77 is not here");
        assert_eq!(
            page.value("document.body.textContent.includes('AUTONOMOUS')"),
            false
        );
        // No other robot was stopped instead.
        scene.wait_to_move();
    }
    // The display on the robot forgets a stop that a person has ended.
    page.call(
        "Page.navigate",
        &json!({ "url": format!("{here}/screen?r1") }),
    );
    page.wait_until("document.querySelector('.screen #figures')?.textContent.length > 0");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.wait_for("#state", "STOPPED");
    scene.resume();
    page.wait_until("document.querySelector('#stop-said').textContent === ''");
}

pub(crate) fn one_press_on_fetch_is_one_order(_scene: &mut Scene, page: &mut Page) {
    page.wait_until("document.querySelectorAll('#tiles button').length > 0");
    page.listen_in();
    let orders = "sent.filter((line) => / order \\d+ 2$/.test(line)).length";
    wait_for("an order", || {
        page.value(
            "(() => { const goods = document.querySelector('#goods'); goods.value = '2'; \
         const fetch = document.querySelector('#fetch [type=submit]'); \
         for (let press = 0; press < 5; press++) fetch.click(); })()",
        );
        (page.value(orders) != 0).then_some(())
    });
    page.pause();
    page.value("document.querySelector('#fetch [type=submit]').click()");
    assert_eq!(page.value(orders), 1);
}

pub(crate) fn what_happens_to_the_robot_is_in_the_log_and_survives_the_station(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.click("#tab-log");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#entries", "STOPPED: it was ordered");
    page.wait_for("#entries", " stops it");
    scene.resume();
    page.wait_for("#entries", "the stop is released");
    let logic = pid(scene.up.service("logic").expect("it runs"));
    kill_process(logic, Signal::KILL).expect("it runs");
    page.wait_for("#entries", "its service logic was started anew");
    let entries = "[...document.querySelectorAll('#entries li')].map((line) => line.textContent)";
    let before = page.value(entries);
    let station = pid(scene.up.service("station").expect("it runs"));
    kill_process(station, Signal::KILL).expect("it runs");
    page.wait_for("#entries", "does not reach the station");
    // The station has kept all of it, and who asked for what. The robot repeats its reports to a new
    // station, which tells each once.
    for sentence in [
        "STOPPED: it was ordered",
        " stops it",
        "the stop is released",
        "its service logic",
    ] {
        let what = format!("{sentence:?}, no more often than in {before}");
        wait_for(&what, || {
            let now = page.value(entries);
            let count = |all: &serde_json::Value| {
                let all = all.as_array().expect("a list").iter();
                all.filter(|line| line.as_str().is_some_and(|line| line.contains(sentence)))
                    .count()
            };
            (count(&now) == count(&before)).then_some(())
        });
    }
    // Another page shows the same.
    let mut other = scene.page();
    other.click("#tab-log");
    for sentence in ["STOPPED: it was ordered", " stops it", "its service logic"] {
        other.wait_for("#entries", sentence);
    }
    scene.saves(&mut other);
    other.close();
}

pub(crate) fn each_service_that_is_killed_has_its_end_and_its_return_in_the_log(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.click("#tab-log");
    let rows = |page: &mut Page, service: &str, what: &str| {
        let rows = page.value(&format!(
            "[...document.querySelectorAll('.entry')].filter(({{ textContent }}) => \
             textContent.includes('its service {service} {what}')).length"
        ));
        rows.as_u64().expect("a number")
    };
    let (ended, back) = ("has ended", "was started anew");
    for service in ["simulator", "bridge", "logic", "comm", "station"] {
        let process = pid(scene.up.service(service).expect("it runs"));
        kill_process(process, Signal::KILL).expect("it runs");
        page.wait_for("#entries", &format!("its service {service} {back}"));
        let both = [ended, back].map(|what| rows(page, service, what));
        assert_eq!(both, [1, 1], "{service}");
    }
    // One that does not come back has an end, and no return until it does.
    let logic = |page: &mut Page| [ended, back].map(|what| rows(page, "logic", what));
    wait_for("an end without a return", || {
        if let Some(logic) = scene.up.service("logic") {
            let _ = kill_process(pid(logic), Signal::KILL);
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
        let [ends, returns] = logic(page);
        (ends == returns + 1).then_some(())
    });
    wait_for("its return", || {
        let [ends, returns] = logic(page);
        (ends == returns).then_some(())
    });
}

pub(crate) fn what_is_ordered_in_a_terminal_is_in_the_log_with_who(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.click("#tab-log");
    let orders: [&[&str]; 6] = [
        &["queue", "add", "2"],
        &["mode", "manual"],
        &["gains", "3", "2"],
        &["obstacle", "put", "1,1,up"],
        &["calibrate"],
        &["drive", "forward", "--seconds", "0.3"],
    ];
    for order in orders {
        let done = scene.domain.run(order);
        // Nobody moves the robot over tape and floor, so no sensor sees both.
        assert!(done.status.success() || order == ["calibrate"], "{done:?}");
    }
    // What the command line itself refuses nobody has asked of the robot.
    assert!(!scene.domain.run(&["fetch", "3"]).status.success());
    let mode = page.text("#mode");
    for what in [
        "orders 2",
        &format!("makes it {mode}"),
        "sets the line control to 3 2",
        "puts an obstacle at (1, 1)",
        "calibrates",
        "drives it",
    ] {
        let told = format!("a command in a terminal {what}");
        page.wait_for("#entries", &told);
        let rows = page.value(&format!(
            "[...document.querySelectorAll('.entry')].filter(({{ textContent }}) => textContent.includes('{told}')).length"
        ));
        assert_eq!(rows, 1, "{told}");
    }
    assert!(!page.text("#entries").contains("orders 3"));
    // The queue has it from there, too.
    page.click("#tab-missions");
    page.wait_for("#queue", "by a command in a terminal");
}

/// How a state looks: the page's style, the colour behind its sentence, and the text at the robot.
const LOOK: &str = "(() => { const at = (part) => document.querySelector(part); \
    return [document.body.dataset.look, getComputedStyle(at('#state') ?? document.body).backgroundColor, \
      at('#map .chip:not([hidden]) text')?.textContent ?? '-'].join('; '); })()";

#[test]
fn a_state_has_one_look_in_the_bar_on_the_map_and_on_the_display() {
    let stage = Stage::new(Some(
        "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n",
    ));
    let state = "state hold=none mode=autonomous stopped=0 battery_dv=114 sensor_up=1";
    let placed = "phase=waiting_for_order x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up";
    let robot = stage.robot("r1", &[&format!("{state} {placed} steering_up=1")]);
    let mut page = stage.page(&stage.url);
    let mut screen = stage.browser.page(&stage.url.replacen("/?", "/screen?", 1));
    let caution = "rgb(255, 208, 66)";
    let mut looks = |look: &str, colour: &str, words: &str, said: &str| {
        page.dress("light", 1280, 720, false);
        screen.dress("light", 1280, 720, false);
        for (page, words) in [(&mut page, words), (&mut screen, "-")] {
            page.wait_until(&format!("{LOOK}.startsWith('{look}; {colour}; {words}')"));
            page.wait_for("#state", said);
        }
    };
    looks("waits", "rgba(0, 0, 0, 0)", "-", "waits for an order");
    robot.says(&[&format!("{state} {placed} steering_up=0")]);
    let board = "the steering board is not heard";
    looks("board", caution, board, "he steering board is not heard");
    robot.says(&[&format!("{state} phase=lost steering_up=1")]);
    looks("lost", caution, "place unknown", "oes not know where it is");
    drop(robot);
    looks("unheard", caution, "seen ", "r1 is not heard for ");
    drop((page, screen));
    stage.end();
}

#[test]
fn a_stop_that_cannot_reach_its_robot_says_so() {
    let stage = Stage::new(None);
    let robot = stage.robot("r1", &["state sensor_up=1 steering_up=1 stopped=0"]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    drop(robot);
    page.wait_for("#state", "r1 is not heard");
    page.click("#stop");
    page.wait_for("#stop-said", "NOT SENT: r1 is not heard");
    // The same without the script.
    page.call("Network.enable", &json!({}));
    page.call("Network.setBlockedURLs", &json!({ "urls": ["*.js"] }));
    page.call("Page.reload", &json!({}));
    page.wait_until(
        "document.readyState !== 'loading' && document.querySelector('#stop') !== null",
    );
    page.click("#stop");
    page.wait_for(".stop-answer [role=alert]", "NOT SENT: r1 is not heard");
    drop(page);
    stage.end();
}
