//! Tests of the missions' view: orders are moved by a pointer and by keys and stand where the robot
//! says, goods are found and ordered once, what was delivered outlives the page, and the battery
//! that is nearly empty is told.

use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// The goods that wait, as the page shows them.
const WAITING: &str = "[...document.querySelectorAll('#queue .waiting .parcel')].map(({ textContent }) => textContent).join()";

fn waits_for(page: &mut Page, goods: &str) {
    page.wait_until(&format!("{WAITING} === '{goods}'"));
}

/// Presses a key, held with these modifiers (1 is Alt).
fn press(page: &mut Page, key: &str, modifiers: u8) {
    let code = if key == "Enter" { 13 } else { 0 };
    let text = if key == "Enter" { "\r" } else { "" };
    for kind in ["keyDown", "keyUp"] {
        let text = if kind == "keyDown" { text } else { "" };
        let params = json!({
            "type": kind, "key": key, "code": key, "text": text, "modifiers": modifiers,
            "windowsVirtualKeyCode": code,
        });
        page.call("Input.dispatchKeyEvent", &params);
    }
}

/// How often the page has ordered these goods.
fn orders(page: &mut Page, goods: &str) -> u64 {
    let sent = page.value(&format!(
        "sent.filter((line) => / order \\d+ {goods}$/.test(line)).length"
    ));
    sent.as_u64().expect("a number")
}

pub(crate) fn orders_are_moved_by_a_pointer_and_by_keys_as_the_robot_says(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.dress("light", 1280, 720, false);
    scene.wait_to_move();
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.listen_in();
    // A double click on a tile is one order.
    let tile = page.middle("#tiles [data-product=\"2\"]");
    page.click_at(tile);
    page.click_at(tile);
    waits_for(page, "2");
    page.click("#tiles [data-product=\"3\"]");
    waits_for(page, "2,3");
    assert_eq!(orders(page, "2"), 1);
    page.wait_for("#queue-said", "2 of 3 goods");
    // What is ordered is not ordered again; the tile says why.
    page.click("#tiles [data-product=\"3\"]");
    page.wait_for("#missions-said", "ordered, as number 2");
    assert_eq!(orders(page, "3"), 1);

    let robot_says = |goods: [&str; 2]| {
        let told = scene.domain.run(&["queue"]).stdout;
        let told = String::from_utf8(told).expect("a text");
        let [one, other] = goods.map(|id| told.find(&format!("goods {id}")).expect("it waits"));
        assert!(one < other, "{told}");
    };
    let (from, to) = (
        page.middle("#queue li:nth-child(2) .name"),
        page.middle("#queue li:nth-child(1) .name"),
    );
    page.mouse("mouseMoved", from);
    page.mouse("mousePressed", from);
    page.mouse("mouseMoved", (from.0, from.1 - 20.0));
    page.mouse("mouseMoved", (to.0, to.1 - 10.0));
    page.mouse("mouseReleased", (to.0, to.1 - 10.0));
    waits_for(page, "3,2");
    robot_says(["3", "2"]);
    // The row keeps the focus wherever it goes.
    page.value("document.querySelector('#queue li:nth-child(1)').focus()");
    press(page, "ArrowDown", 1);
    waits_for(page, "2,3");
    robot_says(["2", "3"]);
    press(page, "ArrowUp", 1);
    waits_for(page, "3,2");
    press(page, "Delete", 0);
    waits_for(page, "2");
    page.click("#queue-undo");
    waits_for(page, "3,2");
    // All of it has room.
    page.wait_until(
        "[...document.querySelectorAll('#missions-now > :not([hidden])')].every((part) => \
           part.getBoundingClientRect().bottom <= document.querySelector('#side').getBoundingClientRect().bottom) \
         && document.querySelector('#missions').scrollHeight <= document.querySelector('#missions').clientHeight",
    );
    scene.resume();
}

const FLOOR: &str = "size = [3, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 1\nname = \"Cable ties\"\nsquare = [0, 1]\nside = \"left\"\n\
    [[product]]\nid = 2\nname = \"Cable clips\"\nsquare = [1, 0]\nside = \"down\"\n\
    [[product]]\nid = 21\nname = \"Nails\"\nsquare = [2, 1]\nside = \"up\"\n";

const WAITS: &str = "state hold=none mode=autonomous pick=auto stopped=0 phase=waiting_for_order \
    x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up sensor_up=1 steering_up=1 battery_dv=114";

#[test]
fn goods_are_found_by_number_or_name_and_a_battery_that_is_nearly_empty_is_told() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[WAITS]);
    let mut page = stage.page(&stage.url);
    page.wait_until("document.querySelectorAll('#tiles button').length === 3");
    page.listen_in();
    let find = |page: &mut Page, text: &str| {
        page.value("document.activeElement.blur()");
        press(page, "/", 0);
        page.wait_until("document.activeElement.id === 'goods'");
        page.fill("#goods", text);
        press(page, "Enter", 0);
    };
    find(&mut page, "cable");
    page.wait_for("#missions-said", "1 Cable ties, 2 Cable clips");
    find(&mut page, "bolts");
    page.wait_for("#missions-said", "no goods are called so");
    assert_eq!(
        page.value("sent.filter((line) => line.includes(' order ')).length"),
        0
    );
    // A whole number counts before numbers that begin so, and a part of a name is enough.
    find(&mut page, "2");
    find(&mut page, "TIES");
    page.wait_until("sent.filter((line) => line.includes(' order ')).length === 2");
    assert_eq!((orders(&mut page, "2"), orders(&mut page, "1")), (1, 1));

    // A robot that tells only a voltage has no percentage.
    assert_eq!(page.text("#battery"), "11.4 V");
    robot.says(&[&format!("{WAITS} battery_percent=62 battery_left_s=2400")]);
    page.wait_for("#battery", "62 %, ≈ 40 min");
    assert_eq!(page.value("document.title"), "Lagerrobot");
    robot.says(&[&format!("{WAITS} battery_percent=12")]);
    page.wait_for("#battery", "12 %, low");
    page.wait_until("document.title.includes('r1: The battery is nearly empty: 12 %')");
    drop((page, robot));
    stage.end();
}

#[test]
fn what_was_delivered_outlives_the_page_and_teaches_how_long_the_next_one_takes() {
    let scene = Scene::new(4.0, &["--mission", "1"]);
    let mut page = scene.page();
    page.wait_for("#order-number", "1");
    page.wait_for("#past-open", "1 delivered today");
    let shown = |page: &mut Page| {
        page.wait_for("#past-open", "1 delivered today");
        page.click("#past-open");
        page.wait_for("#past-totals", "1 today, 1 in the last 24 hours");
        page.text("#history")
    };
    let told = shown(&mut page);
    assert!(told.contains("1 in "), "{told}");
    page.fill("#past-goods", "2");
    page.wait_for("#history", "Nothing yet.");
    page.call("Page.reload", &json!({}));
    page.wait_for("#link", " ms");
    assert_eq!(shown(&mut page), told);
    let mut other = scene.page();
    assert_eq!(shown(&mut other), told);
    // It has driven to goods 1 before, and not to goods 2.
    other.click("#past-open");
    other.click("#tiles [data-product=\"1\"]");
    other.click("#goods-back-yes");
    other.wait_for("#order-where", "≈");
    drop((page, other));
    scene.end();
}
