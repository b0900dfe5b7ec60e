//! Tests of the page with several robots of one station, which it shows together.

use lager_tests::wait_for;
use serde_json::json;

use crate::played::Stage;

#[test]
fn robots_stand_on_one_map_and_whoever_needs_a_person_comes_first() {
    let stage = Stage::new(Some(
        "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n",
    ));
    let state = "state hold=none mode=autonomous stopped=0 battery_dv=114 sensor_up=1";
    let at = |x_mm| format!("phase=waiting_for_order x_mm={x_mm} y_mm=500 heading_deg=0 node=1,1");
    let first = stage.robot("r1", &[&format!("{state} {} steering_up=1", at(500))]);
    let url = stage.url.replacen("/?", "/?r1&", 1);
    let mut page = stage.page(&url);
    page.wait_until("document.querySelector('#tab-fleet').hidden");
    let second = stage.robot("r2", &[&format!("{state} {} steering_up=0", at(1_000))]);
    page.wait_until("!document.querySelector('#tab-fleet').hidden");
    page.click("#tab-fleet");
    let names =
        "[...document.querySelectorAll('#fleet-list strong')].map((name) => name.textContent)";
    let rows = |page: &mut crate::browser::Page, wanted: &str| {
        let wanted = json!(wanted.split(' ').collect::<Vec<_>>());
        wait_for(&format!("the rows {wanted}"), || {
            (page.value(names) == wanted).then_some(())
        });
    };
    rows(&mut page, "r2 r1");
    page.wait_for("#fleet-list", "steering board");
    page.wait_for("#fleet-list", "11.4 V");
    // The other one is on the map with its name, and a click shows it.
    let others = "[...document.querySelectorAll('#map .label.name-of:not([hidden]) text')].map((name) => name.textContent).join()";
    page.wait_until(&format!("{others} === 'r2'"));
    page.click("#fleet-list li:first-child button");
    page.wait_until("document.querySelector('#stop-whom').textContent === 'r2'");
    page.wait_until(&format!("{others} === 'r1'"));
    assert_eq!(page.value("location.search"), "?r2");
    // The order follows what happens.
    first.says(&[&format!("{state} {} steering_up=1", at(500)).replace("stopped=0", "stopped=1")]);
    rows(&mut page, "r1 r2");
    page.wait_until("document.querySelector('#map .other.stopped') !== null");
    // What helps stands beside each, and is done for that robot.
    let lost = "failure=line_lost failure_expected=0 failure_seen=0 remedy=reset";
    let stuck = at(500).replace("waiting_for_order", "stuck");
    first.says(&[&format!("{state} {stuck} steering_up=1 {lost}")]);
    rows(&mut page, "r2 r1");
    page.wait_for("#fleet-list li:nth-child(2)", "Say where it stands");
    page.click("#fleet-list li:nth-child(2) button:not([aria-pressed])");
    page.wait_until("document.querySelector('#where').open");
    assert_eq!(page.value("location.search"), "?r1");
    drop((page, first, second));
    stage.end();
}
