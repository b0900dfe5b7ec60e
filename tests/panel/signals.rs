//! Tests of the view of signals: its script comes when it is wanted, its lanes have data with units,
//! what is held stays, and the station's history fills in what the page has not seen.

use std::time::Duration;

use serde_json::json;

use crate::Scene;
use crate::browser::Page;

/// Opens the page anew, and runs this before its own scripts.
fn begin_anew(scene: &Scene, page: &mut Page, script: &str) {
    page.call(
        "Page.addScriptToEvaluateOnNewDocument",
        &json!({ "source": script }),
    );
    page.call("Page.navigate", &json!({ "url": scene.url }));
    page.wait_for("#link", " ms");
}

/// What a lane's legend says at the cursor.
fn told(page: &mut Page, lane: &str) -> String {
    page.text(&format!("[data-lane={lane}] dl"))
}

/// Waits until a lane's curve is drawn: pixels of its colour are on its canvas.
fn wait_for_curve(page: &mut Page, lane: &str) {
    page.wait_until(&format!(
        "(() => {{ const canvas = document.querySelector('.lane[data-lane={lane}] canvas'); \
         if (!canvas) return false; \
         const {{ data }} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height); \
         let inked = 0; \
         for (let at = 0; at < data.length; at += 4) {{ \
           if (data[at] < 60 && data[at + 2] > 140 && data[at + 3] > 200) inked += 1; \
         }} \
         return inked > 50; }})()"
    ));
}

pub(crate) fn the_view_of_signals_shows_the_station_s_last_minutes_and_holds_still(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.click("#strips [data-lane=battery]");
    // A strip leads to its lane.
    page.wait_until("document.activeElement.matches('.lane[data-lane=battery]')");
    assert_eq!(page.value("document.body.dataset.view"), "signals");
    for lane in ["line_error", "duty", "path", "battery", "losses"] {
        wait_for_curve(page, lane);
    }
    for (lane, units) in [
        ("line_error", &["sensors"] as &[_]),
        ("duty", &["left", "right", " %"]),
        ("distance", &["cm"]),
        ("path", &["p50 µs", "p99 µs"]),
        ("battery", &["V1"]),
        ("losses", &["in 1 s"]),
    ] {
        let told = told(page, lane);
        for unit in units {
            assert!(told.contains(unit), "{lane}: {told}");
        }
    }

    // What is held stays as it is while the robot goes on, and says how old it is.
    let picture = "document.querySelector('.lane canvas').toDataURL()";
    let behind = "Number(document.querySelector('#signals .tag').textContent.match(/paused, (\\d+) s behind/)?.[1])";
    page.key_down("p");
    page.key_up("p");
    page.wait_until(&format!("{behind} >= 0"));
    page.pause();
    page.value(&format!("window.held = {picture}"));
    page.wait_until(&format!("{behind} >= 3"));
    assert_eq!(page.value(&format!("{picture} === held")), true);
    page.click("#pause");
    page.wait_until("document.querySelector('#signals .tag').hidden");
    page.wait_until(&format!("{picture} !== held"));

    // A drag shows a part of the time, and a double click all of it again.
    let from = page.middle(".lane .u-over");
    page.mouse("mouseMoved", from);
    page.mouse("mousePressed", from);
    page.mouse("mouseMoved", (from.0 + 80.0, from.1));
    page.mouse("mouseReleased", (from.0 + 80.0, from.1));
    page.wait_until("!document.querySelector('#zoom-back').disabled");
    page.wait_until("!document.querySelector('#signals .tag').hidden");
    page.click("#zoom-back");
    page.wait_until("document.querySelector('#zoom-back').disabled");

    // After a reload, the station tells what was before; the browser's clock, which is 6 h slow now,
    // decides nothing.
    let before = page.value("Date.now()").as_f64().expect("ms");
    begin_anew(
        scene,
        page,
        "window.trueNow = Date.now; Date.now = () => trueNow() - 21_600_000",
    );
    page.open_view("signals");
    page.wait_until("document.querySelectorAll('.lane').length === 6");
    page.click("[data-ms='600000']");
    page.wait_until("document.querySelector('[data-ms=\"600000\"]').ariaPressed === 'true'");
    wait_for_curve(page, "battery");
    page.value("document.querySelector('#lanes').focus()");
    // The cursor goes back until it is at a moment before the reload.
    let at = "document.querySelector('#signals aside h3').textContent === 'At the cursor' \
              && Date.parse(document.querySelector('#signals time').dateTime)";
    lager_tests::wait_for("the cursor to be before the reload", || {
        page.key_down("ArrowLeft");
        page.key_up("ArrowLeft");
        std::thread::sleep(Duration::from_millis(20));
        page.value(at).as_f64().filter(|at| *at < before)
    });
    lager_tests::wait_for("what was known then", || {
        let told = told(page, "battery");
        told.contains("V1").then_some(())
    });
}

pub(crate) fn what_the_view_of_signals_cannot_fetch_is_said_and_the_histogram_has_all_frames(
    scene: &mut Scene,
    page: &mut Page,
) {
    // Keeps how many frames the page has been told of, after each line.
    begin_anew(
        scene,
        page,
        "window.totals = [0]; window.WebSocket = class extends WebSocket { \
           constructor(...words) { super(...words); this.addEventListener('message', ({ data }) => { \
             for (const line of data.split('\\n')) { \
               const [from, , what, , ...counted] = line.split(' '); \
               if (from !== 'from' || what !== 'latency') continue; \
               const frames = counted.reduce((sum, count, i) => (i % 2 ? sum + Number(count) : sum), 0); \
               totals.push(totals.at(-1) + frames); \
             } \
           }); } }",
    );
    // Its script does not come: the page says so, and tries again when somebody wants it to.
    page.call("Network.enable", &json!({}));
    let block = |page: &mut Page, urls: serde_json::Value| {
        page.call("Network.setBlockedURLs", &json!({ "urls": urls }));
    };
    block(page, json!(["*/signals/signals.js*"]));
    page.click("#tab-signals");
    page.wait_for("#coming-said", "could not be fetched");
    assert_eq!(page.value("document.querySelectorAll('.lane').length"), 0);
    page.click("#coming-again");
    page.wait_for("#coming-said", "could not be fetched");
    block(page, json!([]));
    page.click_until(
        "#coming-again",
        "document.querySelectorAll('.lane').length === 6",
    );
    page.wait_until("document.querySelector('#coming').hidden");

    page.wait_until(
        "((shown) => shown > 0 && totals.includes(shown))(\
         parseInt(document.querySelector('.histogram .quiet').textContent))",
    );
    assert!(page.text(".histogram .marks").contains("µs"));

    // While the keys drive the robot, P holds nothing.
    scene.arm(page);
    page.open_view("signals");
    let is_held = "!document.querySelector('#signals .tag').hidden";
    for _ in 0..3 {
        page.key_down("p");
        page.key_up("p");
        page.pause();
        assert_eq!(page.value(is_held), false);
    }
    page.click("#tab-drive");
    page.click("#armed");
    page.wait_until("!document.querySelector('#armed').checked");
    page.open_view("signals");
    page.key_down("p");
    page.key_up("p");
    page.wait_until(is_held);
}
