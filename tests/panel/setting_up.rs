//! Tests of setting up and ordering from the page: the warehouse by form, file and strings, the
//! gains of the line control, the calibration, the queue, goods that cannot be reached, and the
//! controls of the map.

use lager_tests::wait_for;
use serde_json::{Value, json};

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// The texts of all elements that match, with commas between them.
fn texts(page: &mut Page, selector: &str) -> String {
    let all = page.value(&format!(
        "[...document.querySelectorAll({})].map(({{ textContent }}) => textContent).join()",
        json!(selector)
    ));
    all.as_str().expect("texts").to_owned()
}

#[test]
fn a_warehouse_is_described_by_form_by_file_and_by_strings() {
    // The robot waits, so another warehouse disturbs no drive.
    let scene = Scene::new(1.0, &["--mission", "3"]);
    let mut page = scene.page();
    let folder = scene.domain.folder().to_owned();
    page.save_into(&folder);
    page.open_view("setup");
    assert_eq!(
        page.value("document.querySelector('#undo').disabled"),
        true,
        "nothing is to be undone yet"
    );
    page.click("#save-file");
    let before = wait_for("the file", || {
        let text = std::fs::read_to_string(folder.join("warehouse.json")).ok()?;
        serde_json::from_str::<Value>(&text).ok()
    });
    assert_eq!(before["size"], json!([2, 2]));

    // Size, corner and side by the form; the map shows what would be saved.
    page.fill("#warehouse [name=width]", "4");
    page.fill("#warehouse [name=height]", "5");
    page.fill("#warehouse [name=side]", "60");
    page.fill("#warehouse [name=delivery]", "4,5");
    page.click("#save");
    page.wait_for("#setup-said", "saved in");
    page.wait_for("#map-text", "A warehouse of 4 by 5 squares");
    // Five columns and six rows of tape, each ten mm longer than the warehouse at both ends, the way
    // out and its bar.
    page.wait_until("document.querySelectorAll('#map .tape').length === 13");
    page.wait_until(
        "document.querySelector('#map .tape').x2.baseVal.value === 0 && \
                     Math.abs(document.querySelector('#map .tape').y2.baseVal.value) === 3010",
    );

    // The strings of the document (M1, M3).
    page.fill("#map-string", "3,2,0,2");
    page.wait_for("#map-text", "A warehouse of 3 by 2 squares");
    page.fill("#goods-string", "7,1,0,3;8,2,1,0");
    page.wait_for("#map-text", "Goods: 7 (1, 0) down; 8 (2, 1) left.");
    // The page takes a string that is pasted and ended by Enter, not the form's old values.
    page.value("document.querySelector('#map-string').focus(); document.querySelector('#map-string').select()");
    page.call("Input.insertText", &json!({ "text": "3,4,0,4" }));
    let enter = json!({ "type": "keyDown", "key": "Enter", "code": "Enter", "text": "\r", "windowsVirtualKeyCode": 13 });
    page.call("Input.dispatchKeyEvent", &enter);
    page.key_up("Enter");
    page.wait_for("#map-text", "A warehouse of 3 by 4 squares");
    page.pause();
    assert!(page.text("#map-text").contains("3 by 4 squares"));
    page.wait_until("document.querySelector('#warehouse [name=height]').value === '4'");
    page.click("#undo");
    page.wait_for("#map-text", "A warehouse of 3 by 2 squares");
    page.fill("#map-string", "3,2,1,1");
    page.wait_until("document.querySelector('#setup-said').textContent.length > 5");
    assert!(page.text("#map-text").contains("3 by 2 squares"));

    // The saved file restores the warehouse.
    let document = page.call("DOM.getDocument", &json!({}));
    let query = json!({ "nodeId": document["root"]["nodeId"], "selector": "#load-file" });
    let node = page.call("DOM.querySelector", &query)["nodeId"].clone();
    let file = folder.join("warehouse.json");
    // Loads the same file again after the change was undone.
    for is_last in [false, true] {
        page.call(
            "DOM.setFileInputFiles",
            &json!({ "files": [file], "nodeId": node }),
        );
        page.wait_for("#map-text", "A warehouse of 2 by 2 squares");
        page.wait_until("document.querySelectorAll('#map .good').length === 3");
        page.wait_until("document.querySelector('#load-file').files.length === 0");
        if !is_last {
            page.click("#undo");
            page.wait_for("#map-text", "A warehouse of 3 by 2 squares");
        }
    }
    // An empty number field does not count as 0.
    page.fill("#products [name=id]", "");
    assert_eq!(
        page.value("document.querySelector('#warehouse').checkValidity()"),
        false
    );
    std::fs::remove_file(file).expect("it is there");
    drop(page);
    scene.end();
}

pub(crate) fn gains_are_set_and_put_back_and_a_calibration_goes_step_by_step(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.wait_until("document.querySelector('#sensors .on') !== null");
    scene.take_over(page);
    page.open_view("line");
    let are = |p: &str, d: &str| {
        format!("document.querySelector('#gains-now').textContent === 'now {p} and {d}'")
    };
    for (p, d) in [("3", "4"), ("5", "6")] {
        page.fill("#gains [name=p]", p);
        page.fill("#gains [name=d]", d);
        page.click_until("#gains [type=submit]", &are(p, d));
    }
    // Who sets the same again, as after an answer that was long in coming, can put back what was before.
    page.value("document.querySelector('#board-said').textContent = ''");
    page.click_until(
        "#gains [type=submit]",
        "document.querySelector('#board-said').textContent === 'saved'",
    );
    page.wait_for("#gains-back", "Put back 3 and 4");
    page.click_until("#gains-back", &are("3", "4"));

    // It stands still on its tape, so no sensor sees both, and the board says so for each sensor.
    page.click_until(
        "#calibrate",
        "document.querySelector('#calibration [aria-current]').textContent.includes('move it slowly') && \
         document.querySelector('#calibration-said').textContent.startsWith('Calibrating')",
    );
    page.click_until(
        "#calibrate",
        "document.querySelector('#calibration-said').textContent.includes('of 11')",
    );
    page.wait_until("document.querySelectorAll('#calibration-sensors .on').length > 0");
    // Meanwhile the board has reported each sensor's reading: higher over tape than over floor.
    page.wait_until(
        "(() => { const read = (select) => [...document.querySelectorAll(`#calibration-sensors ${select}`)] \
           .map(({ textContent }) => Number(textContent)); \
         return read('.value').every((value) => value > 0) && \
           Math.min(...read('.on .value')) > Math.max(...read('.sensor:not(.on) .value')); })()",
    );
    page.wait_until("!document.querySelector('#calibrate').disabled");
}

pub(crate) fn the_queue_is_reordered_and_what_is_taken_out_can_be_put_back(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.wait_to_move();
    // The robot stays in its place, with product 1 as its order.
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    // Without its buttons, a waiting order's text is only its number.
    let waiting = "[...document.querySelectorAll('#queue .waiting')].map((line) => \
                   line.firstChild.textContent).join()";
    for (product, queue) in [("2", "2"), ("3", "2,3")] {
        page.order(product, &format!("{waiting} === '{queue}'"));
    }
    // A product that already has an order cannot get a second; the page shows the reason there.
    for (product, why) in [("1", "the robot fetches it"), ("3", "ordered, as number 2")] {
        let said = "document.querySelector('#missions-said').textContent";
        page.order(product, &format!("{said}.includes('{why}')"));
    }
    page.wait_until(&format!("{waiting} === '2,3'"));
    let button = |line: usize, which: usize| {
        format!(
            "#queue .waiting:nth-of-type({}) button:nth-of-type({which})",
            line + 1
        )
    };
    let click = |page: &mut Page, selector: &str, queue: &str| {
        page.click_until(selector, &format!("{waiting} === '{queue}'"));
    };
    click(page, &button(1, 1), "3,2");
    click(page, &button(0, 2), "2,3");
    click(page, &button(0, 3), "3");
    click(page, "#queue-undo", "2,3");
    click(page, "#clear", "");
    click(page, "#queue-undo", "2,3");
    assert_eq!(
        page.value("document.querySelector('#queue-undo').hidden"),
        true
    );
    scene.resume();
}

#[test]
fn a_person_picks_and_insists_where_the_claw_feels_nothing() {
    let scene = Scene::new(4.0, &["--mission", "3"]);
    let mut page = scene.page();
    page.click("#picks");
    page.wait_until("!document.querySelector('#picks').checked");
    // "Picked" from a person is refused while the claw is empty, unless the person insists.
    page.wait_for("#state", "stands at the goods");
    page.click("#picked");
    page.wait_until("document.querySelector('#missions-said').textContent.length > 5");
    page.click("#picked-force");
    wait_for("it to leave", || {
        (!page.text("#state").contains("stands at the goods")).then_some(())
    });
    page.wait_for("#history li", " in ");
    assert!(texts(&mut page, "#history li").contains('3'));

    // An order can be cancelled as long as its goods are not in the claw.
    page.order("2", &Page::fetches("2"));
    page.click_until("#order-cancel", "document.querySelector('#order').hidden");
    page.click_until("#queue-undo", &Page::fetches("2"));
    drop(page);
    scene.end();
}

const SMALL: &str = "size = [2, 3]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 2\nname = \"nails\"\nsquare = [0, 2]\nside = \"right\"\n";

#[test]
fn what_is_wrong_stands_where_it_is_and_in_the_readers_language() {
    let stage = Stage::new(Some(SMALL));
    let robot = stage.robot("r1", &["state sensor_up=1 steering_up=1"]);
    let mut page = stage.page(&stage.url);
    let now = |more: &str| {
        robot.says(&[&format!(
            "state x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up hold=none mode=autonomous \
             order=4 product=2 {more}"
        )]);
    };
    now("phase=waiting_for_order failure=no_way failure_expected=0 failure_seen=0 remedy=way");
    page.wait_for("#map .good.out-of-reach .why", "no way there");
    page.wait_for(
        "#state",
        "There is no way from (1, 1) to where the robot must go",
    );
    page.wait_for("#order-name", "nails");
    now("phase=driving sensor_up=0 steering_up=1");
    page.wait_for("#state", "he sensor board is not heard");
    page.change_language();
    page.wait_for("#state", "ensorkortet hörs inte");
    page.wait_until("document.querySelector('#map .out-of-reach') === null");

    // During the calibration the page marks each sensor that has seen tape and floor.
    page.change_language();
    page.open_view("line");
    page.click("#calibrate");
    let seen = |page: &mut Page, words: &str| {
        page.wait_until(&format!(
            "(document.querySelector('#calibration-sensors').ariaLabel ?? '').includes('{words}')"
        ));
    };
    now("sensor_up=1 line_bits=00001110000");
    seen(&mut page, "line sensors 00001110000");
    let others = " 30 20 40 0".repeat(9);
    robot.says(&[
        "state sensor_up=1 line_bits=00001110000",
        &format!("sensors 210 20 220 1{others} 60 20 61 1"),
    ]);
    seen(
        &mut page,
        "210 30 30 30 30 30 30 30 30 30 60; 2 of them have seen",
    );
    page.wait_until("document.querySelectorAll('#calibration-sensors .both').length === 2");
    let height = "document.querySelector('#calibration-sensors .stretch').style.height";
    assert_eq!(page.value(height), "78.4%", "of 255");

    // A robot that disappears before it answers may be stopped or not.
    page.click("#tab-missions");
    page.click("#stop");
    page.wait_for("#stop-said", "not confirmed");
    drop(robot);
    page.wait_for("#state", "r1 is not heard");
    page.pause();
    assert!(page.text("#stop-said").contains("not confirmed"));
    drop(page);
    stage.end();
}

pub(crate) fn how_unsure_the_place_is_grows_until_the_next_mark(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.wait_to_move();
    page.value(
        "window.radii = []; new MutationObserver(([{ target }]) => \
         radii.push(Number(target.getAttribute('r')))) \
         .observe(document.querySelector('#map .unsure'), { attributes: true, attributeFilter: ['r'] })",
    );
    page.wait_until("document.querySelector('#map .trail polyline').points.numberOfItems > 1");
    // The circle grows step by step, and a mark makes it small at once.
    page.wait_until(
        "radii.some((radius, index) => index > 3 && radius < radii[index - 1] - 3 && \
         radii[index - 1] > radii[index - 2] && radii[index - 2] > radii[index - 3])",
    );
}

pub(crate) fn the_map_is_moved_and_zoomed_by_hand_and_keys_and_obstacles_are_put_by_keys(
    scene: &mut Scene,
    page: &mut Page,
) {
    let view = |page: &mut Page| -> Vec<f64> {
        let view = page
            .value("document.querySelector('#map').getAttribute('viewBox').split(' ').map(Number)");
        let view = view.as_array().expect("a view").iter();
        view.map(|number| number.as_f64().expect("a number"))
            .collect()
    };
    page.click("#fit");
    let fitted = view(page);
    page.click("#zoom-in");
    let near = view(page);
    assert!(near[2] < fitted[2]);
    page.click("#zoom-out");
    assert!(view(page)[2] > near[2]);
    page.click("#fit");
    assert_eq!(view(page), fitted);

    let press = |page: &mut Page, key: &str, shift: bool| {
        page.value(&format!(
            "document.querySelector('#map').dispatchEvent(new KeyboardEvent('keydown', \
             {{ key: '{key}', shiftKey: {shift}, bubbles: true, cancelable: true }}))"
        ));
    };
    press(page, "ArrowRight", true);
    let right = view(page);
    assert!(right[0] > fitted[0] && (right[1] - fitted[1]).abs() < 0.01);
    press(page, "+", false);
    assert!(view(page)[2] < right[2]);
    page.click("#fit");

    // Two fingers that move apart.
    let (x, y) = page.middle("#map");
    let fingers = |page: &mut Page, kind: &str, apart: f64| {
        let points = match kind {
            "touchEnd" => json!([]),
            _ => json!([{ "x": x - apart, "y": y, "id": 1 }, { "x": x + apart, "y": y, "id": 2 }]),
        };
        page.call(
            "Input.dispatchTouchEvent",
            &json!({ "type": kind, "touchPoints": points }),
        );
    };
    fingers(page, "touchStart", 40.0);
    for apart in [60.0, 80.0, 100.0] {
        fingers(page, "touchMove", apart);
    }
    fingers(page, "touchEnd", 0.0);
    let zoomed = view(page);
    assert!(zoomed[2] < fitted[2] * 0.7, "{zoomed:?} {fitted:?}");
    assert_eq!(page.text("#map-said"), "", "nothing was put by it");

    // The map follows the robot until a person moves the map.
    scene.wait_to_move();
    page.click("#follow");
    let before = view(page);
    wait_for("it to follow", || (view(page) != before).then_some(()));
    press(page, "ArrowLeft", true);
    assert_eq!(
        page.value("document.querySelector('#follow').getAttribute('aria-pressed')"),
        "false"
    );

    // Beside the ways a thing cannot be put, and the page says so. Arrows alone choose the things of
    // the map, and Enter puts an obstacle on the way that is chosen.
    page.click("#fit");
    page.click_at_mm(250.0, 250.0);
    page.wait_for("#map-said", "there is no way");
    page.value(
        "(() => { const map = document.querySelector('#map'); \
         const at = new DOMPoint(500, -750).matrixTransform(map.getScreenCTM()); \
         map.dispatchEvent(new WheelEvent('wheel', { deltaY: -1, clientX: at.x, clientY: at.y, cancelable: true })); })()",
    );
    page.click("#fit");
    for key in ["ArrowLeft", "ArrowUp"] {
        for _ in 0..10 {
            press(page, key, false);
        }
    }
    // From the upper left corner: one way to the right.
    press(page, "ArrowRight", false);
    press(page, "Enter", false);
    page.wait_for("#map-said", "obstacle put");
    press(page, "Enter", false);
    page.wait_for("#map-said", "obstacle taken away");
}

pub(crate) fn goods_and_obstacles_are_put_by_a_click_and_taken_back(
    _scene: &mut Scene,
    page: &mut Page,
) {
    let goods = "[...document.querySelectorAll('#tiles button')].map(({ dataset }) => dataset.product).join()";
    page.wait_until(&format!("{goods} === '1,2,3'"));

    // In the set-up view, a click in a square places goods at the square's nearest side.
    page.open_view("setup");
    page.click_at_mm(250.0, 420.0);
    let placed = "(() => { const line = [...document.querySelectorAll('#products tr')].at(-1); \
                  return [...line.querySelectorAll('input, select')].map(({ value }) => value).join(); })()";
    page.wait_until(&format!("{placed} === '4,,0,0,up'"));
    // It counts once it is saved.
    assert_eq!(page.value(goods), "1,2,3");
    page.click("#save");
    page.wait_until(&format!("{goods} === '1,2,3,4'"));
    page.click("#undo");
    page.click("#save");
    page.wait_until(&format!("{goods} === '1,2,3'"));

    // The page shows why an entry is impossible beside it, and changes nothing.
    page.fill("#goods-string", "7,1,0,4");
    page.wait_for("#setup-said", "7,1,0,4");
    assert_eq!(page.value(goods), "1,2,3");

    // Goods are entered here too, and the page shows mistakes while a person types.
    page.click("#add-product");
    page.fill("#products [name=id]", "3");
    page.wait_for("#setup-said", "two goods have the number 3");
    page.fill("#products [name=id]", "12");
    page.fill("#products [name=x]", "2");
    page.wait_for("#setup-said", "goods 12 stand outside");
    page.fill("#products [name=x]", "1");
    page.fill("#products [name=y]", "1");
    page.fill("#products [name=name]", "nails");
    page.click("#save");
    page.wait_until(&format!("{goods} === '1,2,3,12'"));
    page.wait_until(
        "document.querySelector('#map [data-product=\"12\"] title').textContent === '12 nails'",
    );

    // In other views a click on a way puts a thing there.
    page.click("#tab-missions");
    page.click_at_mm(750.0, 1_000.0);
    page.wait_for("#map-said", "obstacle put");
    // The map shows it at once, and not like a way that the robot finds blocked.
    let placed = "document.querySelectorAll('#map .placed').length";
    page.wait_until(&format!("{placed} === 1"));
    page.wait_for("#map-text", "Obstacles stand at:");
    page.click("#map-undo");
    page.wait_for("#map-said", "obstacle taken away");
    page.wait_until(&format!("{placed} === 0"));

    // The page does not save a warehouse in which no robot can drive.
    page.open_view("setup");
    for (field, value, why, right) in [
        ("width", "255", "a number from 1 to 99", "2"),
        ("side", "1", "a number from 40 to 500", "50"),
    ] {
        let field = format!("#warehouse [name={field}]");
        page.fill(&field, value);
        page.click("#save");
        page.wait_for("#setup-said", why);
        page.fill(&field, right);
    }
    page.fill("#map-string", "100,2,0,2");
    page.wait_for(
        "#setup-said",
        "the robot knows up to 99 squares along a side; here are 100",
    );
    page.value("document.querySelector('#setup-said').textContent = ''");
}
