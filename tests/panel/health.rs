//! How the robot is, help, the theme, and what a driver sees of keys and of other people.

use lager_tests::{pid, wait_for};
use lager_topics::LinkHealth;
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::browser::Page;
use crate::keyboard::press;
use crate::played::Stage;
use crate::scene::Scene;

/// The mark and the words of a row of the Health view.
fn row(page: &mut Page, id: &str) -> (String, String) {
    let row = format!("document.querySelector('#health [data-row=\"{id}\"]')");
    let mut told = |what: &str| {
        let told = page.value(&format!("{row}?.{what} ?? ''"));
        told.as_str().expect("words").to_owned()
    };
    (told("dataset.mark"), told("textContent"))
}

pub(crate) fn a_killed_service_shows_as_died_and_back_with_its_count(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.open_view("health");
    wait_for("the service to run", || {
        let (mark, told) = row(page, "logic");
        (mark == "good" && told.contains("runs for") && !told.contains("again")).then_some(())
    });
    assert_eq!(row(page, "robot").0, "good");
    assert_eq!(row(page, "sensor").0, "good");
    assert!(
        row(page, "release-station")
            .1
            .contains(env!("CARGO_PKG_VERSION"))
    );
    // One that dies soon after its start waits ever longer for the next one.
    wait_for("the page to say that it has died", || {
        if let Some(logic) = scene.up.service("logic") {
            let _ = kill_process(pid(logic), Signal::KILL);
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
        let (mark, told) = row(page, "logic");
        (mark == "bad" && told.contains("ended") && told.contains("started again by itself"))
            .then_some(())
    });
    wait_for("it to run again", || {
        let told = row(page, "logic").1;
        (told.contains("runs for") && told.contains("started again: ")).then_some(())
    });
    assert!(
        !row(page, "bridge").1.contains("again"),
        "the others went on"
    );
}

pub(crate) fn a_board_is_restarted_while_the_robot_stands_and_not_on_its_way(
    scene: &mut Scene,
    page: &mut Page,
) {
    let mut health = scene.bus.subscriber::<LinkHealth>().expect("a topic");
    let mut reboots = || {
        wait_for("its health", || {
            let health = health.latest().expect("readable")?;
            (health.steering.up != 0).then_some((health.sensor.reboots, health.steering.reboots))
        })
    };
    let before = reboots();
    scene.wait_to_move();
    page.open_view("health");
    let button = |board: &str| format!("#health [data-row=lost-{board}] button");
    page.wait_until(&format!(
        "document.querySelector('{}') !== null",
        button("steering")
    ));
    page.click(&button("steering"));
    let refused = row_says("lost-steering", "on its way by itself");
    page.wait_until(&refused);
    assert_eq!(reboots(), before);

    press(page, "Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.click_until(
        &button("steering"),
        &row_says("lost-steering", "restarted 1"),
    );
    assert!(!page.value(&refused).as_bool().expect("yes or no"));
    wait_for("only that board to have restarted", || {
        (reboots() == (before.0, before.1 + 1)).then_some(())
    });
    page.click("#tab-log");
    page.wait_for("#entries", "restarts the steering board");
    scene.resume();
}

/// Whether a row of the Health view has these words, as an expression of the page.
fn row_says(id: &str, words: &str) -> String {
    format!(
        "Boolean(document.querySelector('#health [data-row={id}]')?.textContent.includes('{words}'))"
    )
}

#[test]
fn a_silent_board_is_cut_in_the_chain_and_each_fault_has_its_remedy() {
    let stage = Stage::new(None);
    let state = "state time_ms=81250 mode=autonomous stopped=0 phase=waiting_for_order \
                 sensor_up=0 steering_up=1 sensor_lost=7 steering_lost=0 bus_lost=0";
    let health = "health release=9.9.9 load_percent=310 cores=4 sensor_age_ms=70000 \
                  sensor_version=1 sensor_build=1 steering_version=1 steering_build=3 \
                  program_build=2 services=bridge:up:812:0 found=shared_memory:12,unheard_of:1";
    let robot = stage.robot("r1", &[state, health]);
    let mut page = stage.page(&stage.url);
    page.open_view("health");
    wait_for("the board to be missed", || {
        (row(&mut page, "sensor").0 == "bad").then_some(())
    });
    let told = row(&mut page, "sensor").1;
    assert!(
        told.contains("1 min") && told.contains("look at the sensor board"),
        "{told}"
    );
    for heard in ["page", "station", "robot", "steering"] {
        assert_eq!(row(&mut page, heard).0, "good", "{heard}");
    }
    let (mark, told) = row(&mut page, "shared_memory");
    assert!(mark == "bad" && told.contains("only 12 MiB"), "{told}");
    assert!(row(&mut page, "unheard_of").1.contains("unheard_of"));
    let (mark, told) = row(&mut page, "release-robot");
    assert!(
        mark == "bad" && told.contains("9.9.9") && told.contains("update"),
        "{told}"
    );
    for (board, helps) in [
        ("sensor", "update the boards on the robot's computer"),
        ("steering", "newer program"),
    ] {
        let (mark, told) = row(&mut page, &format!("release-{board}"));
        assert!(mark == "bad" && told.contains(helps), "{told}");
    }
    // A robot that is gone takes what is known of its boards with it.
    drop(robot);
    wait_for("the robot to be missed", || {
        (row(&mut page, "robot").0 == "bad").then_some(())
    });
    assert!(row(&mut page, "robot").1.contains("switched on"));
    assert_eq!(row(&mut page, "steering").0, "unknown");
    drop(page);
    stage.end();
}

pub(crate) fn help_opens_by_key_and_stop_works_over_it(scene: &mut Scene, page: &mut Page) {
    let is_open = "document.querySelector('#help').open";
    let ask = "dispatchEvent(new KeyboardEvent('keydown', { key: '?', bubbles: true }))";
    // Where a person writes, it is a letter.
    page.click("#tab-drive");
    page.value(&format!("document.querySelector('#name').{ask}"));
    assert_eq!(page.value(is_open), false);
    page.value(&format!("document.body.{ask}"));
    assert_eq!(page.value(is_open), true);
    let shapes =
        "[...document.querySelectorAll('#help .state path')].map((path) => path.getAttribute('d'))";
    let shown = page.value("document.querySelector('#shape').getAttribute('d')");
    assert!(
        page.value(shapes)
            .as_array()
            .expect("shapes")
            .contains(&shown)
    );
    let keys = page.text("#help-body");
    for word in ["Esc", "forward", "squeeze", "where it may be", "goods"] {
        assert!(keys.contains(word), "{word}: {keys}");
    }
    // Nothing covers STOP, and its key is not the dialog's.
    let (x, y) = page.middle("#stop");
    let top = page.value(&format!(
        "document.elementFromPoint({x}, {y}).closest('#stop') !== null"
    ));
    assert_eq!(top, true);
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    assert_eq!(page.value(is_open), true);
    page.value(&format!("document.body.{ask}"));
    assert_eq!(page.value(is_open), false);
    scene.resume();
}

pub(crate) fn the_theme_survives_a_reload_and_is_the_display_s_too(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.dress("light", 1280, 720, false);
    let ground = "getComputedStyle(document.body).backgroundColor";
    let light = page.value(ground);
    page.click("#theme");
    assert_eq!(page.text("#theme"), "Light");
    page.click("#theme");
    assert_eq!(page.text("#theme"), "Dark");
    let dark = page.value(ground);
    assert_ne!(light, dark);
    page.call("Page.reload", &json!({}));
    page.wait_until("document.querySelector('#theme')?.textContent === 'Dark'");
    assert_eq!(page.value(ground), dark);
    // Its script knows nothing of themes: what runs before the first paint has done it.
    page.call("Page.navigate", &json!({ "url": scene.screen() }));
    page.wait_until("document.querySelector('.screen') !== null");
    assert_eq!(page.value(ground), dark);
}

pub(crate) fn what_drives_is_shown_as_pressed(scene: &mut Scene, page: &mut Page) {
    scene.arm(page);
    let down =
        "[...document.querySelectorAll('#pad .down')].map((button) => button.dataset.word).join()";
    let key = |page: &mut Page, kind: &str, key: &str| {
        page.value(&format!(
            "dispatchEvent(new KeyboardEvent('{kind}', {{ key: '{key}' }}))"
        ));
    };
    // A command that was held up is refused, and ends the hold.
    wait_for("both keys to be shown", || {
        key(page, "keydown", "ArrowUp");
        key(page, "keydown", "ArrowLeft");
        let both = page.value(down);
        key(page, "keyup", "ArrowLeft");
        let one = page.value(down);
        key(page, "keyup", "ArrowUp");
        (both == "forward,left" && one == "forward").then_some(())
    });
    assert_eq!(page.value(down), "");
    scene.wait_to_stand();
    // Sticks are seen as the page sees them, before they drive, too.
    page.value(
        "navigator.getGamepads = () => [{ id: 'a', index: 0, connected: true, mapping: 'standard', \
           timestamp: performance.now(), axes: [0.5, -0.25, 0, 0], buttons: [] }]",
    );
    page.wait_until(
        "document.querySelector('#sticks .stick').getAttribute('transform') === 'translate(4.0 -2.0)'",
    );
    page.click("#armed");
    page.wait_until("document.querySelector('#sticks').hasAttribute('hidden')");
}

pub(crate) fn a_person_s_name_is_at_the_wheel_and_at_the_stop(scene: &mut Scene, page: &mut Page) {
    let mut other = scene.page();
    page.click("#tab-drive");
    page.fill("#name", "Anna");
    page.wait_for("#link", " ms");
    wait_for("Anna to have the wheel", || {
        page.click("#control");
        std::thread::sleep(std::time::Duration::from_millis(300));
        other.text("#driver").contains("Anna").then_some(())
    });
    page.click("#stop");
    other.wait_until("document.body.dataset.look === 'stopped'");
    other.wait_for("#more", "Anna");
    other.click("#tab-log");
    other.wait_for("#entries", "Anna");
    assert!(!other.text("#entries").contains("panel-"));
    other.close();
    scene.resume();
}
