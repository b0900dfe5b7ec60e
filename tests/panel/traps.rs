//! Tests of what users of other panels met: a panel that is silent for a while, a page of another
//! version than the panel, and a map whose picture and meaning differ by the browser's zoom.

use std::time::Duration;

use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// Orders that wait in the robot's queue, as the page shows them.
const WAITING: &str = "document.querySelectorAll('#queue li').length";

/// The socket stays open, and no byte comes through it. A page that believes such a link sends what a
/// person presses, and all of it arrives when the panel goes on.
pub(crate) fn what_is_pressed_while_the_panel_is_silent_is_refused_and_never_done(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.wait_until("document.querySelectorAll('#tiles button').length > 2");
    let waiting = page.value(WAITING);
    page.value("window.closes = 0; window.answers = []");
    page.listen_in();
    page.value("tapped.addEventListener('close', () => closes++)");
    let frozen = scene.freeze("station");
    page.wait_until("document.body.classList.contains('stale')");
    assert_eq!(page.value("closes"), 0, "nothing has closed the socket");
    for _ in 0..10 {
        page.key_down("ArrowUp");
        page.key_up("ArrowUp");
    }
    assert_eq!(page.moves(), [""; 0]);
    page.wait_for("#drive-said", "what is shown is old");
    for goods in ["2", "3"] {
        page.value(&format!(
            "document.querySelector('#missions-said').textContent = ''; \
             document.querySelector('#goods').value = '{goods}'; \
             document.querySelector('#fetch [type=submit]').click()"
        ));
        page.wait_for("#missions-said", "what is shown is old");
    }
    // Longer than an order may wait anywhere.
    std::thread::sleep(Duration::from_secs(3));
    drop(frozen);
    // The first that the page draws is the newest.
    page.wait_until("!document.body.classList.contains('stale')");
    scene.assert_stands();
    assert_eq!(page.value(WAITING), waiting);
}

#[test]
fn a_page_of_another_version_says_so_drives_nothing_and_still_stops() {
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    page.listen_in();
    // As if the panel's program had been replaced under it.
    page.value("document.documentElement.dataset.edition = 'older'; tapped.close()");
    page.wait_for("#state", "of different versions");
    page.wait_until("!document.querySelector('#remedy').hidden");
    assert_eq!(page.text("#remedy"), "Load the page anew");
    page.value("sent.splice(0)");
    page.value("document.querySelector('#goods').value = '2'; document.querySelector('#fetch [type=submit]').click()");
    page.wait_until("document.querySelector('#missions-said').textContent.length > 0");
    assert_eq!(page.value("sent.length"), 0);
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand after");
    page.click("#remedy");
    page.wait_until("document.documentElement.dataset.edition !== 'older'");
    page.wait_for("#link", " ms");
    page.wait_for("#state", "STOPPED");
    scene.resume();
    drop(page);
    scene.end();
}

const FLOOR: &str = "size = [4, 4]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 1\nsquare = [0, 3]\nside = \"left\"\n\
    [[product]]\nid = 2\nsquare = [3, 0]\nside = \"down\"\n";
const WAITS: &str = "state time_ms=64000 hold=none mode=autonomous pick=auto stopped=0 sensor_up=1 \
    steering_up=1 phase=waiting_for_order x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up unsure_mm=20";

#[test]
fn a_point_of_the_map_means_the_same_whatever_the_zoom_of_browser_and_screen() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[WAITS]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    page.listen_in();
    let mut ordered = 0;
    for density in [1.0, 1.5, 2.0] {
        for zoom in [0.5, 1.0, 2.0] {
            // A browser that zooms has fewer pixels, and denser ones.
            let size = json!({
                "width": (1400.0 / zoom) as u32, "height": (1000.0 / zoom) as u32,
                "deviceScaleFactor": density * zoom, "mobile": false,
            });
            page.call("Emulation.setDeviceMetricsOverride", &size);
            page.pause();
            page.value("document.querySelector('#fit').click()");
            page.pause();
            for goods in [1, 2] {
                page.click(&format!("#map [data-product=\"{goods}\"] rect"));
                ordered += 1;
                page.wait_until(&format!(
                    "sent.filter((line) => / order \\d+ \\d+$/.test(line)).length === {ordered}"
                ));
                let last =
                    page.value("sent.findLast((line) => / order /.test(line)).split(' ').at(-1)");
                assert_eq!(last, goods.to_string(), "density {density}, zoom {zoom}");
                // A second click within half a second is the same press.
                std::thread::sleep(Duration::from_millis(600));
            }
        }
    }
    drop((page, robot));
    stage.end();
}
