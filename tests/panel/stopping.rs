//! STOP at any time and for the right robot; what is kept of it; and one press that is one order.

use lager_tests::{pid, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// Loads the page anew without its script, or over a slow network, and presses STOP as soon as it is
/// there; the form is answered by a page of its own.
fn stop_early(scene: &mut Scene, page: &mut Page, press: fn(&mut Page)) {
    scene.wait_to_move();
    page.call("Page.navigate", &json!({ "url": scene.url }));
    page.wait_until("document.querySelector('#stop') !== null");
    press(page);
    page.wait_until("/r1 stands after|both wheels stand/.test(document.body?.textContent)");
    scene.assert_stands();
    scene.resume();
}

pub(crate) fn stop_works_before_any_script_and_without_a_socket(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.call("Network.enable", &json!({}));
    // A module that does not load, and no script at all.
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
    // 400 ms and 50 kB/s.
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
    page.wait_for("#link", "no connection to the station");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "r1 stands after");
    scene.assert_stands();
    scene.resume();
}

pub(crate) fn a_stop_is_one_press_for_this_robot_by_name_and_another_robot_is_not_shown(
    scene: &mut Scene,
    page: &mut Page,
) {
    // The browser has the token by now.
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
        // Nobody else was stopped in its place.
        scene.wait_to_move();
    }
    // The display forgets a stop that somebody has ended.
    page.call(
        "Page.navigate",
        &json!({ "url": format!("{here}/screen?r1") }),
    );
    page.wait_until("document.querySelector('.screen #figures')?.textContent.length > 0");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.wait_for("#doing", "STOPPED");
    scene.resume();
    page.wait_until("document.querySelector('#stop-said').textContent === ''");
}

pub(crate) fn one_press_on_fetch_is_one_order(_scene: &mut Scene, page: &mut Page) {
    page.wait_until("document.querySelectorAll('#goods option').length > 0");
    page.listen_in();
    page.value(
        "(() => { const goods = document.querySelector('#goods'); goods.value = '2'; \
         const fetch = document.querySelector('#fetch [type=submit]'); \
         for (let press = 0; press < 5; press++) fetch.click(); })()",
    );
    page.pause();
    page.value("document.querySelector('#fetch [type=submit]').click()");
    let orders = page.value("sent.filter((line) => / order \\d+ 2$/.test(line)).length");
    assert_eq!(orders, 1);
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
    // What the robot has told the station before is told again, with its time, and once.
    for sentence in [
        "STOPPED: it was ordered",
        "the stop is released",
        "its service logic",
    ] {
        wait_for(sentence, || {
            let now = page.value(entries);
            let count = |all: &serde_json::Value| {
                let all = all.as_array().expect("a list").iter();
                all.filter(|line| line.as_str().is_some_and(|line| line.contains(sentence)))
                    .count()
            };
            // It keeps the last ones, and no more of them than there were.
            (1..=count(&before)).contains(&count(&now)).then_some(())
        });
    }
}

#[test]
fn a_stop_that_cannot_reach_its_robot_says_so() {
    let stage = Stage::new(None);
    let robot = stage.robot("r1", &["state sensor_up=1 steering_up=1 stopped=0"]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", "link ");
    drop(robot);
    page.wait_for("#link", "no link, last heard");
    page.click("#stop");
    page.wait_for("#stop-said", "NOT SENT: r1 is not heard");
    // Without the script likewise.
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
