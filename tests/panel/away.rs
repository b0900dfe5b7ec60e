//! Tests of pages that are away for a while: hidden behind another tab, closed while a key is held,
//! only looking on, or cut off from what they show.

use std::time::Duration;

use lager_tests::wait_for;
use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;
use crate::pressed::SAID;

/// Keeps each place at which the map draws the robot in `drawn`, in mm.
const WATCH_ROBOT: &str = "window.drawn = []; (() => { \
    const robot = document.querySelector('#map > .robot'); \
    const place = () => robot.getAttribute('transform').match(/-?[\\d.]+/g).slice(0, 2).map(Number); \
    drawn.push(place()); \
    new MutationObserver(() => drawn.push(place())).observe(robot, { attributeFilter: ['transform'] }); })()";
/// How far the robot is driven while a page is away, in mm.
const WAY_MM: f64 = 300.0;

type Place = (f64, f64);

/// Where the robot is in truth, as the map draws it: y downwards.
fn truth(scene: &mut Scene) -> Place {
    wait_for("the world", || {
        let truth = scene.truth.latest().expect("readable")?;
        Some((truth.x_mm, -truth.y_mm))
    })
}

fn apart((x, y): Place, (other_x, other_y): Place) -> f64 {
    (x - other_x).hypot(y - other_y)
}

/// A place of `drawn`, if it is there.
fn drawn(page: &mut Page, which: &str) -> Option<Place> {
    let at = page.value(&format!("drawn.{which} ?? null"));
    Some((at[0].as_f64()?, at[1].as_f64()?))
}

/// Waits until the robot has driven on, while a page is away that has shown it here.
fn wait_to_be_elsewhere(scene: &mut Scene, page: &mut Page) -> Place {
    let before = drawn(page, "at(-1)").expect("a robot on the map");
    wait_for("the robot to be elsewhere", || {
        (apart(truth(scene), before) > WAY_MM).then_some(())
    });
    page.value("drawn.splice(0)");
    before
}

/// The first that the page draws is where the robot is, and none of the places between.
fn draws_the_newest_first(scene: &mut Scene, page: &mut Page, before: Place) {
    let first = wait_for("a new picture", || drawn(page, "at(0)"));
    let now = truth(scene);
    assert!(
        apart(first, now) < apart(before, now) / 3.0,
        "{first:?} is drawn first, the robot was at {before:?} and is at {now:?}"
    );
}

pub(crate) fn a_hidden_page_lets_go_sends_nothing_on_its_return_and_shows_what_is_now(
    scene: &mut Scene,
    page: &mut Page,
) {
    let mut other = scene.browser.page("about:blank");
    // From here on it is in front only if it is.
    page.call(
        "Emulation.setFocusEmulationEnabled",
        &json!({ "enabled": false }),
    );
    let mut bring = |page: &mut Page, is_front: bool| {
        let front = if is_front { &mut *page } else { &mut other };
        front.call("Page.bringToFront", &json!({}));
        page.wait_until(&format!("document.hidden !== {is_front}"));
    };
    bring(page, true);
    scene.wait_to_move();
    page.value(WATCH_ROBOT);
    bring(page, false);
    let before = wait_to_be_elsewhere(scene, page);
    bring(page, true);
    draws_the_newest_first(scene, page, before);

    page.wait_until("!document.body.classList.contains('stale')");
    scene.arm(page);
    page.listen_in();
    // A hold that was held up has ended by itself, and then a person presses again.
    let said = wait_for("a hold until it is hidden", || {
        scene.hold(page, "ArrowLeft");
        page.value("sent.splice(0)");
        bring(page, false);
        scene.wait_to_stand();
        let mut said = page.moves();
        said.retain(|line| line != "drive 6");
        if page.text("#drive-said").is_empty() {
            return Some(said);
        }
        page.key_up("ArrowLeft");
        bring(page, true);
        None
    });
    assert_eq!(said, ["drive 1"]);
    // After ten seconds a browser runs a hidden page's timers once a second.
    std::thread::sleep(Duration::from_secs(11));
    assert_eq!(page.value(SAID), json!([]));
    bring(page, true);
    // A key that is still down repeats, and is no new press.
    let repeats = json!({
        "type": "rawKeyDown", "key": "ArrowLeft", "code": "ArrowLeft", "autoRepeat": true,
    });
    for _ in 0..10 {
        page.call("Input.dispatchKeyEvent", &repeats);
        page.pause();
    }
    assert_eq!(page.value(SAID), json!([]));
    scene.assert_stands();
    page.key_up("ArrowLeft");
    other.close();
}

pub(crate) fn after_a_silence_the_first_pose_that_is_drawn_is_the_newest(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.wait_to_move();
    page.value(WATCH_ROBOT);
    let frozen = scene.freeze("station");
    page.wait_until("document.body.classList.contains('stale')");
    let before = wait_to_be_elsewhere(scene, page);
    drop(frozen);
    draws_the_newest_first(scene, page, before);
}

/// A person who looks on with the view to drive open, while somebody else drives whose tab is closed.
pub(crate) fn a_page_that_looks_on_only_says_that_it_is_there_and_a_closed_tab_ends_its_hold(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.click("#tab-drive");
    page.listen_in();
    let mut other = scene.page();
    scene.arm(&mut other);
    scene.hold(&mut other, "ArrowLeft");
    page.wait_for("#control", " drives");
    scene.hold(&mut other, "ArrowLeft");
    other.close();
    scene.wait_to_stand();
    scene.assert_stands();
    page.wait_for("#control", "Nobody drives");
    page.wait_until("sent.length > 5");
    assert_eq!(page.value(SAID), json!([]));
}

const FLOOR: &str = "size = [3, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 1\nsquare = [0, 1]\nside = \"left\"\n\
    [[product]]\nid = 2\nsquare = [1, 0]\nside = \"down\"\n";
const WAITS: &str = "state hold=none mode=autonomous pick=auto stopped=0 phase=waiting_for_order \
    x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up sensor_up=1 steering_up=1 battery_dv=114";

/// Whether the battery, the strips and the row of each robot say that they are old.
const MARKED: &str = "(() => { const at = (part) => document.querySelector(part); \
    const style = (part) => getComputedStyle(part); \
    const rows = [...document.querySelectorAll('#fleet-list li > :first-child')]; \
    return [style(at('#battery')).color === style(at('#cells dt')).color, \
      style(at('#strips')).filter.startsWith('grayscale'), \
      rows.length === 2 && rows.every((row) => row.dataset.look === 'unheard' && \
        style(row).backgroundColor !== 'rgba(0, 0, 0, 0)' && / \\d+ s/.test(row.textContent))].join(); })()";

#[test]
fn all_that_is_old_is_marked_and_a_press_is_refused_at_once_and_never_done() {
    let stage = Stage::new(Some(FLOOR));
    let first = stage.robot("r1", &[WAITS]);
    let url = stage.url.replacen("/?", "/?r1&", 1);
    let mut page = stage.page(&url);
    let second = stage.robot("r2", &[WAITS]);
    page.wait_until("!document.querySelector('#tab-fleet').hidden");
    page.listen_in();
    let cuts = [
        // The socket is open, and nothing comes through it.
        (
            "window.hears = tapped.onmessage; tapped.onmessage = null",
            "tapped.onmessage = hears",
        ),
        // It is closed, and so is each one that is opened anew.
        (
            "window.Real = WebSocket; \
             window.WebSocket = class { constructor() { setTimeout(() => this.onclose({}), 100); } close() {} }; \
             tapped.close()",
            "window.WebSocket = Real",
        ),
    ];
    for (cut, mend) in cuts {
        page.click("#tab-fleet");
        page.wait_until(&format!("{MARKED} === 'false,false,false'"));
        page.value(cut);
        page.wait_until(&format!("{MARKED} === 'true,true,true'"));
        page.click("#tab-missions");
        page.value("sent.splice(0)");
        let presses = [
            (
                "a tile",
                "document.querySelector('#tiles [data-product=\"1\"]').click()",
            ),
            (
                "the field",
                "document.querySelector('#goods').value = '2'; \
                 document.querySelector('#fetch [type=submit]').click()",
            ),
        ];
        for (what, press) in presses {
            // In one step, so that no picture and no answer comes between.
            let said = page.value(&format!(
                "(() => {{ const said = document.querySelector('#missions-said'); said.textContent = ''; \
                 {press}; return said.textContent; }})()"
            ));
            let said = said.as_str().expect("words");
            assert!(said.contains("what is shown is old"), "{what}: {said:?}");
        }
        assert_eq!(page.value(SAID), json!([]));
        page.value(mend);
        page.wait_until("!document.body.classList.contains('stale')");
        // Longer than an order may be under way.
        std::thread::sleep(Duration::from_secs(3));
        let orders = "sent.filter((line) => line.includes(' order ')).length";
        assert_eq!(page.value(orders), 0, "it was kept");
    }
    drop((page, first, second));
    stage.end();
}
