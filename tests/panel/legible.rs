//! Tests of what can be read on the map: goods that share a square, and labels beside what stands over the map.

use serde_json::json;

use crate::browser::Page;
use crate::played::Stage;

const STATE: &str = "state time_ms=64000 hold=none mode=autonomous pick=auto stopped=0 \
    phase=waiting_for_order x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up unsure_mm=20";

/// A warehouse of 20 by 20 squares; two goods stand at one side, three share a square, one stands alone.
fn floor() -> String {
    let goods = [
        (1, "3, 3", "left"),
        (2, "3, 3", "right"),
        (12, "3, 3", "up"),
        (4, "9, 9", "up"),
        (5, "9, 9", "up"),
        (7, "15, 2", "down"),
    ];
    let mut floor = "size = [20, 20]\nside_length_cm = 40\ndelivery = [0, 0]\n".to_owned();
    for (id, square, side) in goods {
        floor += &format!(
            "[[product]]\nid = {id}\nname = \"n{id}\"\nsquare = [{square}]\nside = \"{side}\"\n"
        );
    }
    floor
}

fn number(page: &mut Page, goods: &str) -> String {
    page.text(&format!("#map [data-product=\"{goods}\"] .number"))
}

#[test]
fn goods_that_share_a_square_are_read_and_each_is_ordered_where_there_is_no_room_for_its_number() {
    let stage = Stage::new(Some(&floor()));
    let robot = stage.robot("r1", &[STATE]);
    let mut page = stage.page(&stage.url);
    page.dress("light", 1280, 720, false);
    page.wait_for("#link", " ms");
    page.wait_until("document.querySelectorAll('#map .good').length === 3");
    page.wait_until(
        "document.querySelector('#map [data-product=\"7\"] .number').textContent === '7'",
    );
    assert_eq!(number(&mut page, "1 2 12"), "×3");
    assert_eq!(number(&mut page, "4 5"), "×2");
    assert_eq!(number(&mut page, "7"), "7");
    let small = "[...document.querySelectorAll('#map .number')].filter((one) => one.textContent && \
        one.getBoundingClientRect().height < 9).map((one) => one.textContent)";
    assert_eq!(page.value(small), json!([]));

    // A click lists them, and a click in the list orders one.
    page.listen_in();
    let at = page.middle("#map [data-product=\"1 2 12\"] rect:last-of-type");
    page.mouse("mouseMoved", at);
    page.wait_for("#map-tip", "square 3,3: 1 n1, 2 n2, 12 n12");
    page.click_at(at);
    page.wait_until("document.querySelectorAll('#map-stack button').length === 3");
    page.wait_until("document.activeElement.dataset.product === '1'");
    page.click("#map-stack [data-product=\"12\"]");
    page.wait_until("sent.some((line) => / order \\d+ 12$/.test(line))");
    page.wait_until("document.querySelector('#map-stack').hidden");
    // A click elsewhere leaves it, and orders nothing.
    page.value("sent.length = 0");
    page.click_at(at);
    page.wait_until("!document.querySelector('#map-stack').hidden");
    page.click_at((at.0 + 200.0, at.1));
    page.wait_until("document.querySelector('#map-stack').hidden");
    assert_eq!(
        page.value("sent.some((line) => line.includes(' order '))"),
        false
    );

    // It looks as what is in it: one is ordered, two are not in their place.
    robot.says(&[STATE, "queue 1 8 12", "gone 2 1 2"]);
    page.wait_until(
        "document.querySelector('#map [data-product=\"1 2 12\"].queued:not(.gone)') !== null",
    );
    assert_eq!(number(&mut page, "1 2 12"), "×1");
    robot.says(&[STATE, "queue 0", "gone 3 1 2 12"]);
    page.wait_until(
        "document.querySelector('#map [data-product=\"1 2 12\"].gone:not(.queued)') !== null",
    );

    // From near by each has its number, but those that stand at one side.
    for _ in 0..6 {
        page.click("#zoom-in");
    }
    page.wait_until("document.querySelectorAll('#map .good').length === 5");
    for id in ["1", "2", "12"] {
        assert_eq!(number(&mut page, id), id);
    }
    assert_eq!(number(&mut page, "4 5"), "×2");
    assert_eq!(page.value(small), json!([]));
    drop((page, robot));
    stage.end();
}

#[test]
fn what_stands_over_the_map_covers_no_label_of_a_robot_that_is_nowhere() {
    let stage = Stage::new(Some(&floor()));
    let robot = stage.robot("r1", &[STATE]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    // Of the moment the station knows a state that is a minute old and has no place.
    page.value(
        "globalThis.fetch = async (url) => { \
           const at = Number(String(url).match(/moment.*at=(\\d+)/)?.[1]); \
           return new Response(at ? JSON.stringify({ at_ms: at - 60000, line: 'state phase=driving mode=autonomous' }) : ''); \
         }",
    );
    page.click("#tab-log");
    page.wait_until("!document.querySelector('#time').hidden");
    page.value(
        "document.querySelector('#time-line').dispatchEvent(new KeyboardEvent('keydown', { key: 'Home' }))",
    );
    page.wait_for("#map g.chip:not([hidden]) text", "place unknown");
    page.wait_for("#moment:not([hidden])", "the moment");
    for (width, height) in [(1280, 720), (390, 844)] {
        page.dress("light", width, height, width < 900);
        // In the next picture it stands where it belongs.
        page.wait_until(
            "(() => { const [chip, moment] = ['#map g.chip', '#moment'].map((one) => document.querySelector(one).getBoundingClientRect()); \
             return chip.width > 50 && (chip.top >= moment.bottom || chip.left >= moment.right); })()",
        );
    }
    drop((page, robot));
    stage.end();
}
