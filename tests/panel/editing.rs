//! Tests of setting up the warehouse on the map: what a drag, a click and a key change, what can be
//! undone, who may, and what a simulated robot does with what was saved.

use lager_tests::wait_for;
use lager_topics::{LinkHealth, NavStatus, Phase};
use serde_json::{Value, json};

use crate::browser::Page;
use crate::played::Stage;
use crate::scene::Scene;

const HALL: &str = "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 2\nname = \"nails\"\nsquare = [0, 0]\nside = \"up\"\n\
    [[product]]\nid = 7\nsquare = [1, 1]\nside = \"right\"\n";

/// The rows of the table: number, name, column, row and side, each.
fn rows(page: &mut Page) -> String {
    let rows = page.value(
        "[...document.querySelectorAll('#products tr')].map((row) => \
         [...row.querySelectorAll('input, select')].map(({ value }) => value).join()).join(' ')",
    );
    rows.as_str().expect("rows").to_owned()
}

fn wait_for_rows(page: &mut Page, wanted: &str) {
    wait_for(&format!("the rows {wanted}"), || {
        (rows(page) == wanted).then_some(())
    });
}

/// The size that the form shows.
fn size(page: &mut Page) -> Value {
    page.value(
        "['width', 'height'].map((name) => document.querySelector(`#warehouse [name=${name}]`).value).join()",
    )
}

/// The warehouse that the station keeps, as a page that is opened now draws it.
fn kept(stage: &Stage) -> String {
    let mut page = stage.page(&stage.url);
    page.open_view("setup");
    page.wait_until("document.querySelectorAll('#products tr').length > 0");
    let told = format!(
        "{} {}",
        size(&mut page).as_str().expect("a size"),
        rows(&mut page)
    );
    page.close();
    told
}

/// Drags from one point of the floor in mm to another one, and lets `meanwhile` look before the end.
fn drag(page: &mut Page, from: (f64, f64), to: (f64, f64), meanwhile: impl FnOnce(&mut Page)) {
    let start = page.settled(|page| page.place_of_mm(from.0, from.1));
    let end = page.place_of_mm(to.0, to.1);
    page.mouse("mouseMoved", start);
    page.mouse("mousePressed", start);
    for part in [0.3, 0.6, 1.0] {
        let at = (
            start.0 + (end.0 - start.0) * part,
            start.1 + (end.1 - start.1) * part,
        );
        page.mouse("mouseMoved", at);
    }
    meanwhile(page);
    page.mouse("mouseReleased", end);
}

/// The middle of goods on the map, in mm of the floor.
fn goods_at(page: &mut Page, id: u32) -> (f64, f64) {
    let at = page.value(&format!(
        "(() => {{ const box = document.querySelector('#map [data-product=\"{id}\"] rect').getBoundingClientRect(); \
         const at = new DOMPoint(box.x + box.width / 2, box.y + box.height / 2)\
           .matrixTransform(document.querySelector('#map').getScreenCTM().inverse()); \
         return [at.x, -at.y]; }})()"
    ));
    (at[0].as_f64().expect("x"), at[1].as_f64().expect("y"))
}

fn press(page: &mut Page, key: &str, more: &str) {
    page.value(&format!(
        "document.activeElement.dispatchEvent(new KeyboardEvent('keydown', \
         {{ key: '{key}', bubbles: true, cancelable: true, {more} }}))"
    ));
}

fn type_and_enter(page: &mut Page, text: &str) {
    page.call("Input.insertText", &json!({ "text": text }));
    let enter = json!({ "type": "keyDown", "key": "Enter", "code": "Enter", "text": "\r", "windowsVirtualKeyCode": 13 });
    page.call("Input.dispatchKeyEvent", &enter);
    page.key_up("Enter");
}

#[test]
fn the_map_is_the_form_and_what_was_saved_can_be_undone_and_saved_again() {
    let stage = Stage::new(Some(HALL));
    let robot = stage.robot("r1", &["state x_mm=0 y_mm=0 heading_deg=90 node=0,0 looks=right hold=none mode=autonomous phase=waiting_for_order"]);
    let mut page = stage.page(&stage.url);
    page.open_view("setup");
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right");

    // An edge is dragged: the new size is shown meanwhile, and counts at the end. No drag leaves the
    // limits of the robot.
    let shown = "document.querySelector('#map .new-size').hasAttribute('hidden')";
    assert_eq!(page.value(shown), true);
    drag(&mut page, (1_130.0, 500.0), (1_640.0, 500.0), |page| {
        page.wait_until(&format!("!{shown}"));
        assert_eq!(page.text("#map .set-up > .size"), "3 × 2");
        assert_eq!(size(page), "2,2", "it is still dragged");
    });
    page.wait_for("#undo-what", "undoes: size 3 × 2");
    assert_eq!(page.value(shown), true);
    assert_eq!(size(&mut page), "3,2");
    drag(&mut page, (750.0, 1_130.0), (750.0, 300.0), |_| {});
    page.wait_for("#undo-what", "undoes: size 3 × 1");
    // Goods outside have the reason in their row, and Save waits.
    page.wait_for("#products .bad .wrong", "goods 7 stand outside");
    page.click("#save");
    page.wait_for("#setup-said", "goods 7 stand outside");
    page.click("#undo");
    page.wait_until("document.querySelector('#products .bad') === null");

    // A click on the side of a square puts goods there, with the next number; a drag moves them.
    page.click_at_mm(1_250.0, 450.0);
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right 8,,2,0,up");
    let from = goods_at(&mut page, 8);
    drag(&mut page, from, (1_050.0, 750.0), |_| {});
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right 8,,2,1,left");
    // They are renamed in place.
    let (x, y) = goods_at(&mut page, 8);
    page.click_at_mm(x, y);
    page.wait_until("document.activeElement.id === 'rename-name'");
    type_and_enter(&mut page, "belts");
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right 8,belts,2,1,left");
    // A corner is the delivery.
    page.click_at_mm(1_500.0, 1_000.0);
    page.wait_until("document.querySelector('#warehouse [name=delivery]').value === '3,2'");
    page.wait_for("#unsaved", "5 changes not saved");
    // None of this has ordered anything or changed what the station keeps.
    assert_eq!(page.text("#queue-said"), "Nothing waits.");
    assert_eq!(kept(&stage), "2,2 2,nails,0,0,up 7,,1,1,right");

    // Save; undo after it is a change again, and a second Save saves it.
    page.click("#undo");
    press(&mut page, "s", "ctrlKey: true");
    page.wait_for("#setup-said", "saved in");
    page.wait_until("document.querySelector('#unsaved').textContent === ''");
    let named = "3,2 2,nails,0,0,up 7,,1,1,right 8,belts,2,1,left";
    assert_eq!(kept(&stage), named);
    page.click("#undo");
    page.wait_for("#unsaved", "1 change not saved");
    page.click("#redo");
    page.wait_until("document.querySelector('#unsaved').textContent === ''");
    press(&mut page, "z", "ctrlKey: true");
    page.wait_for("#unsaved", "1 change not saved");
    page.click("#save");
    page.wait_until("document.querySelector('#unsaved').textContent === ''");
    assert_eq!(kept(&stage), "3,2 2,nails,0,0,up 7,,1,1,right 8,,2,1,left");
    // What was left cannot be done again once there is another change, and is still not saved twice.
    page.click("#undo");
    page.click_at_mm(250.0, 950.0);
    page.wait_for("#unsaved", "2 changes not saved");
    page.wait_until("document.querySelector('#redo').disabled");
    page.click("#discard");
    page.wait_until("document.querySelector('#unsaved').textContent === ''");
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right 8,,2,1,left");

    // STOP works meanwhile, also from the field for a name.
    let (x, y) = goods_at(&mut page, 8);
    page.click_at_mm(x, y);
    page.wait_until("document.activeElement.id === 'rename-name'");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_until("document.querySelector('#stop-said').textContent.length > 5");
    drop((page, robot));
    stage.end();
}

#[test]
fn keys_alone_set_a_warehouse_up_and_who_looks_changes_nothing() {
    let stage = Stage::new(Some(HALL));
    let mut page = stage.page(&stage.url);
    page.open_view("setup");
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right");
    // By keys alone: Tab leads to the map.
    wait_for("the map to have the focus", || {
        page.tab();
        (page.value("document.activeElement.id") == "map").then_some(())
    });
    let to_the_edge = |page: &mut Page, key: &str| {
        for _ in 0..12 {
            press(page, key, "");
        }
    };
    // Far right are the handle and the corners.
    to_the_edge(&mut page, "ArrowRight");
    page.wait_for("#map-tip", "right edge");
    press(&mut page, "Enter", "");
    page.wait_for("#undo-what", "undoes: size 3 × 2");
    press(&mut page, "z", "ctrlKey: true");
    page.wait_until("document.querySelector('#undo').disabled");
    press(&mut page, "z", "ctrlKey: true, shiftKey: true");
    page.wait_for("#undo-what", "undoes: size 3 × 2");
    // From the handle one step to the left: the side of a square.
    press(&mut page, "ArrowLeft", "");
    page.wait_for("#map-tip", "square");
    press(&mut page, "Enter", "");
    page.wait_until("document.querySelectorAll('#products tr').length === 3");
    page.wait_for("#undo-what", "goods 8 placed");
    // The table does all of it, too, and the hand stays in its field.
    page.value("document.querySelectorAll('#products [name=name]')[2].focus()");
    type_and_enter(&mut page, "belts");
    page.wait_for("#setup-said", "saved in");
    assert!(kept(&stage).contains("8,belts,"), "{}", kept(&stage));
    page.value(
        "document.querySelectorAll('#products button')[2].focus(); document.activeElement.click()",
    );
    wait_for_rows(&mut page, "2,nails,0,0,up 7,,1,1,right");
    page.wait_for("#undo-what", "goods 8 removed");
    page.close();

    // Whoever may only look sees the warehouse, and no drag, click or key changes it.
    let before = kept(&stage);
    let mut page = stage.page(&stage.viewer);
    page.open_view("setup");
    page.wait_until("document.querySelectorAll('#products tr').length === 3");
    let shown = rows(&mut page);
    drag(&mut page, (1_630.0, 500.0), (2_640.0, 500.0), |_| {});
    page.click("#fit");
    page.click_at_mm(250.0, 950.0);
    page.wait_for("#map-said", "you may look and stop");
    press(&mut page, "z", "ctrlKey: true");
    press(&mut page, "s", "ctrlKey: true");
    page.wait_until(
        "['#save', '#undo', '#redo', '#add-product'].every((id) => document.querySelector(id).matches(':disabled'))",
    );
    assert_eq!(rows(&mut page), shown);
    assert_eq!(page.text("#unsaved"), "");
    drop(page);
    assert_eq!(kept(&stage), before);
    stage.end();
}

#[test]
fn a_simulated_robot_is_put_into_the_saved_warehouse_after_a_question_and_stands() {
    let mut scene = Scene::new(1.0, &["--mission", "3"]);
    let mut page = scene.page();
    scene.wait_to_move();
    page.open_view("setup");
    page.wait_for("#kept-robots", "r1 uses it.");
    assert_eq!(
        page.value("document.querySelector('#renew').hidden"),
        true,
        "it is in this warehouse"
    );
    // Five by four squares, goods 9, and no goods 2 or 3 any more.
    page.fill("#map-string", "5,4,0,4");
    page.fill("#goods-string", "1,1,0,3;9,4,3,3");
    page.click("#save");
    page.wait_for("#setup-said", "saved in");
    page.wait_for(
        "#kept-robots",
        "r1 is simulated and still drives in the earlier warehouse",
    );
    let file = page.text("#kept-where");
    let file = file.split_whitespace().last().expect("a path");
    let file = std::path::Path::new(file.trim_end_matches('.'));
    assert!(
        std::fs::read_to_string(file)
            .expect("it is kept")
            .contains('9')
    );

    // The page asks, and says what is dropped. Until there is an answer nothing happens.
    page.click("#renew");
    page.wait_for(
        "#renew-question",
        "It is stopped and put on the delivery node",
    );
    page.wait_for(
        "#renew-question",
        "Orders that do not fit any more are dropped: goods 3.",
    );
    page.click("#renew-no");
    page.wait_until("document.querySelector('#renew-box').hidden");
    assert_eq!(page.text("#renew-said"), "");
    page.click("#renew");
    page.click("#renew-yes");
    page.wait_for("#kept-robots", "r1 uses it.");
    page.wait_until("document.querySelector('[data-look=stopped]') !== null");

    // It stands, stopped, on the delivery node of the new floor.
    let bus = scene.domain.observe("r1", 1.0);
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    let mut status = bus.subscriber::<NavStatus>().expect("a topic");
    wait_for("the stop", || {
        (health.latest().expect("readable")?.stopped == 1).then_some(())
    });
    wait_for("its place", || {
        let status = status.latest().expect("readable")?;
        let is_there = (status.x, status.y) == (0, 4);
        (is_there && status.phase == Phase::WaitingForOrder).then_some(())
    });
    wait_for("what is dropped to be told", || {
        let told = scene.up.output();
        let is_told = told.contains("the order for goods 3 is dropped");
        is_told.then_some(())
    });
    page.click("#tab-missions");
    page.wait_for("#queue-said", "Nothing waits.");
    // Goods 9 can be fetched, once a person has released the stop.
    scene.resume();
    page.order("9", &Page::fetches("9"));
    wait_for("it to fetch goods 9", || {
        (status.latest().expect("readable")?.product == 9).then_some(())
    });
    drop((page, status, health, bus));
    scene.end();
}
