//! A test of the page for who has no pointer: Tab, arrows and Enter reach and do everything.

use std::time::Duration;

use lager_tests::wait_for;
use serde_json::json;

use crate::Scene;
use crate::browser::Page;

/// Moves a key as a keyboard does: with what it writes, scrolls and presses.
pub(crate) fn stroke(page: &mut Page, kind: &str, key: &str, is_repeat: bool) {
    let (code, text) = match key {
        "Enter" => (13, "\r"),
        " " => (32, " "),
        "Escape" => (27, ""),
        "ArrowLeft" => (37, ""),
        "ArrowUp" => (38, ""),
        "ArrowDown" => (40, ""),
        letter => (u32::from(letter.to_ascii_uppercase().as_bytes()[0]), letter),
    };
    let kind = match (kind, text) {
        ("down", "") => "rawKeyDown",
        ("down", _) => "keyDown",
        _ => "keyUp",
    };
    let text = if kind == "keyDown" { text } else { "" };
    let params = json!({
        "type": kind, "key": key, "code": key, "text": text, "windowsVirtualKeyCode": code,
        "autoRepeat": is_repeat,
    });
    page.call("Input.dispatchKeyEvent", &params);
}

pub(crate) fn press(page: &mut Page, key: &str) {
    stroke(page, "down", key, false);
    stroke(page, "up", key, false);
}

/// Holds a key for more than a second, which repeats meanwhile.
pub(crate) fn hold_down(page: &mut Page, key: &str) {
    stroke(page, "down", key, false);
    for _ in 0..26 {
        std::thread::sleep(Duration::from_millis(50));
        stroke(page, "down", key, true);
    }
    stroke(page, "up", key, false);
}

/// More controls than a view has.
const CONTROLS: usize = 150;

/// Goes on by Tab until an element has the focus.
fn reach(page: &mut Page, selector: &str) {
    let is_there = format!("document.activeElement.matches({})", json!(selector));
    for _ in 0..CONTROLS {
        if page.value(&is_there) == true {
            return;
        }
        page.tab();
    }
    panic!("Tab does not reach {selector}");
}

/// Reaches a control and presses it, anew as long as that is not so: an order can be held up.
fn press_until(page: &mut Page, selector: &str, is_done: &str) {
    wait_for(is_done, || {
        reach(page, selector);
        press(page, "Enter");
        (0..100).find_map(|_| {
            std::thread::sleep(Duration::from_millis(20));
            (page.value(is_done) == true).then_some(())
        })
    });
}

/// Shows a view by the arrows in the list of views.
fn show(page: &mut Page, view: &str) {
    reach(page, "#tabs [aria-selected=true]");
    let is_shown = format!("document.body.dataset.view === '{view}'");
    for _ in 0..10 {
        if page.value(&is_shown) == true {
            return;
        }
        press(page, "ArrowDown");
    }
    panic!("the arrows do not reach {view}");
}

#[test]
fn keys_alone_order_drive_stop_resume_and_say_where_the_robot_stands() {
    let mut scene = Scene::new(1.0, &["--warehouse", "small"]);
    let mut page = scene.page();
    page.dress("light", 1280, 720, false);
    scene.wait_to_move();
    // Goods are ordered in the field that the slash reaches.
    press(&mut page, "/");
    assert_eq!(page.value("document.activeElement.id"), "goods");
    page.call("Input.insertText", &json!({ "text": "3" }));
    press(&mut page, "Enter");
    page.wait_for("#queue", "3");

    show(&mut page, "drive");
    press_until(
        &mut page,
        "#control",
        "/You drive/.test(document.querySelector('#control').textContent)",
    );
    press_until(
        &mut page,
        "#manual",
        "!document.querySelector('#hand').hidden",
    );
    press_until(
        &mut page,
        "#hand-now",
        "document.querySelector('#mode').textContent === 'BY HAND'",
    );
    press_until(
        &mut page,
        "#armed",
        "document.querySelector('#armed').checked",
    );
    scene.hold(&mut page, "ArrowLeft");
    press(&mut page, "Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.key_up("ArrowLeft");
    // A stop that nobody has confirmed in time is given again, and then Resume is held anew.
    wait_for("the stop to be released", || {
        reach(&mut page, "#resume");
        hold_down(&mut page, "Enter");
        (0..100).find_map(|_| {
            std::thread::sleep(Duration::from_millis(20));
            (page.value("document.body.dataset.look !== 'stopped'") == true).then_some(())
        })
    });
    press_until(
        &mut page,
        "#armed",
        "!document.querySelector('#armed').checked",
    );
    press_until(
        &mut page,
        "#where-ask",
        "document.querySelector('#where').open",
    );
    press_until(
        &mut page,
        "#where [type=submit]",
        "!document.querySelector('#where').open",
    );
    press_until(
        &mut page,
        "#autonomous",
        "document.querySelector('#mode').textContent === 'AUTONOMOUS'",
    );

    show(&mut page, "log");
    reach(&mut page, "#entries *");
    press_until(
        &mut page,
        "#help-open",
        "document.querySelector('#help').open",
    );
    press_until(
        &mut page,
        "#help-close",
        "!document.querySelector('#help').open",
    );
    reach(&mut page, "#time-line");
    press(&mut page, "ArrowLeft");
    page.wait_until("!document.querySelector('#moment').hidden");
    press_until(
        &mut page,
        "#time-now",
        "document.querySelector('#moment').hidden",
    );
    drop(page);
    scene.end();
}
