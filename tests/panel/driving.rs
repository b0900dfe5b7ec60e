//! Tests of driving from the page: who may drive, what a key does, what runs once, what is too old.

use lager_tests::{pid, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::Scene;
use crate::browser::Page;
use crate::manners::TABS;

/// Presses keys in one step, so that nothing can come between them.
fn press(page: &mut Page, keys: &[&str]) {
    for key in keys {
        assert!(!key.contains('\''));
    }
    let keys = serde_json::to_string(keys).expect("JSON");
    page.value(&format!(
        "for (const key of {keys}) dispatchEvent(new KeyboardEvent('keydown', {{ key }}))"
    ));
}

pub(crate) fn what_runs_once_is_not_cut_short_but_by_the_command_to_stand(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    page.moves();

    // While the arm makes a step, an arrow key is refused with a sentence.
    press(page, &["s", "ArrowUp"]);
    page.wait_for("#drive-said", "one at a time");
    assert_eq!(page.moves(), ["arm F6"]);
    // If the order was held up, or a step had not ended, a person presses again.
    let until_it_moves = |scene: &mut Scene, page: &mut Page, key: &str| {
        wait_for("the robot to be driven", || {
            press(page, &[key]);
            for _ in 0..50 {
                if scene.moves() == Some(true) {
                    return Some(());
                }
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            None
        });
        page.moves();
    };

    // The command to stand also works during a turn.
    until_it_moves(scene, page, "PageUp");
    page.value("document.querySelector('#pad-stand').click()");
    assert_eq!(page.moves(), ["drive 1"]);
    scene.wait_to_stand();
    scene.assert_stands();

    // A hold ends before a turn, so neither the hold nor the release of a key cuts the turn off.
    let heading = |scene: &mut Scene| {
        wait_for("the world", || {
            let truth = scene.truth.latest().expect("readable")?;
            Some(truth.heading_rad)
        })
    };
    wait_for("a whole turn", || {
        until_it_moves(scene, page, "ArrowDown");
        let before = heading(scene);
        press(page, &["PageDown"]);
        page.value(
            "for (const key of ['ArrowDown', 'PageDown']) \
             dispatchEvent(new KeyboardEvent('keyup', { key }))",
        );
        let mut said = page.moves();
        said.retain(|line| line != "drive 4");
        // If not, the robot had refused the hold before, on a machine that is held up. A turn that
        // was held up shows its reason there, too.
        let is_held = said == ["drive 1", "drive 9"];
        for _ in 0..60 {
            let turned = (heading(scene) - before).abs().to_degrees() % 360.0;
            if turned.min(360.0 - turned) > 25.0 && page.text("#drive-said").is_empty() {
                return is_held.then_some(());
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        None
    });
    scene.wait_to_stand();
}

/// The keys of the document (G7, G8), each with its message to the panel.
const KEYS: &[(&str, &str)] = &[
    ("ArrowUp", "drive 2"),
    ("ArrowDown", "drive 4"),
    ("ArrowLeft", "drive 6"),
    ("ArrowRight", "drive 7"),
    ("PageUp", "drive 8"),
    ("PageDown", "drive 9"),
    ("1", "arm F1"),
    ("2", "arm F2"),
    ("q", "arm F3"),
    ("w", "arm F4"),
    ("a", "arm F5"),
    ("s", "arm F6"),
    ("z", "arm F7"),
    ("x", "arm F8"),
    (",", "arm F9"),
    (".", "arm FA"),
    ("\u{f7}", "arm FA"),
    ("Q", "arm F3"),
];

pub(crate) fn each_key_says_what_the_document_says_once_and_nothing_in_text_fields(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    page.moves();
    for (key, line) in KEYS {
        // A key that repeats was pressed before.
        page.value(&format!(
            "dispatchEvent(new KeyboardEvent('keydown', {{ key: {}, repeat: true }}))",
            json!(key)
        ));
        assert_eq!(page.moves(), [""; 0], "{key}");
        // The step before may still be running.
        let said = wait_for(line, || {
            press(page, &[key]);
            let said = page.moves();
            (!said.is_empty()).then_some(said)
        });
        assert_eq!(said[0], *line, "{key}");
        page.value(&format!(
            "dispatchEvent(new KeyboardEvent('keyup', {{ key: {} }}))",
            json!(key)
        ));
        page.moves();
    }
    // To a browser the keypad's division sign is a slash. The slash of the other keys does nothing.
    page.value("dispatchEvent(new KeyboardEvent('keydown', { key: '/', code: 'Slash' }))");
    page.pause();
    assert_eq!(page.moves(), [""; 0]);
    wait_for("the keypad's division sign", || {
        page.value(
            "dispatchEvent(new KeyboardEvent('keydown', { key: '/', code: 'NumpadDivide' }))",
        );
        (page.moves() == ["arm FA"]).then_some(())
    });
    // While a key is held, its command repeats; a step of the arm does not.
    page.wait_until("document.querySelector('#drive-said').textContent === ''");
    let mut said = 0;
    wait_for("a hold", || {
        press(page, &["ArrowUp"]);
        said += page.moves().len();
        (said > 2).then_some(())
    });
    page.value("dispatchEvent(new KeyboardEvent('keyup', { key: 'ArrowUp' }))");
    scene.wait_to_stand();

    page.pause();
    page.moves();
    // In a text field keys write, and in a list or a choice arrow keys choose.
    for field in ["#filter", "#robot", "#robot option", "#where [type=radio]"] {
        for (key, _) in KEYS {
            page.value(&format!(
                "document.querySelector('{field}').dispatchEvent(new KeyboardEvent('keydown', \
                 {{ key: {}, bubbles: true }}))",
                json!(key)
            ));
        }
        assert_eq!(page.moves(), [""; 0], "{field}");
    }
}

pub(crate) fn what_is_old_is_grey_with_its_time_and_drives_nothing(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    scene.hold(page, "ArrowLeft");
    let frozen = scene.freeze("comm");
    page.wait_for("#state", "r1 is not heard");
    page.wait_until("document.body.classList.contains('stale')");
    let grey = "['.robot path', '.good rect', '.ghost path', '.unsure'].every((part) => { \
                const style = getComputedStyle(document.querySelector(`#map ${part}`)); \
                const quiet = getComputedStyle(document.querySelector('#history')).color; \
                return [style.fill, style.stroke].includes(quiet); })";
    page.wait_until(grey);
    scene.wait_to_stand();
    page.key_up("ArrowLeft");
    page.listen_in();
    page.key_down("ArrowLeft");
    page.wait_for("#drive-said", "what is shown is old");
    assert_eq!(page.moves(), [""; 0]);
    page.key_up("ArrowLeft");
    drop(frozen);
    page.wait_for("#link", " ms");
    page.wait_until("!document.body.classList.contains('stale')");
    scene.assert_stands();

    // Without the station the page says since when, on the screen and to a screen reader.
    page.value("window.WebSocket = class { close() {} }; tapped.close()");
    page.wait_for("#state", "ast heard ");
    page.wait_for("#told[role=alert]", "no connection to the station");
    page.wait_until("document.body.classList.contains('stale')");
    page.wait_until("document.querySelector('#control').disabled");
}

/// The page has been told where the robot stands.
const IS_SAID: &str = "!document.querySelector('#where').open";

pub(crate) fn after_driving_by_hand_the_page_asks_where_the_robot_stands_and_stops_meanwhile(
    scene: &mut Scene,
    page: &mut Page,
) {
    // At first the robot knows its place.
    scene.take_over(page);
    page.click("#where-ask");
    page.value("document.querySelector('#where-form').elements.at.value = 'delivery'");
    page.click_until("#where [type=submit]", IS_SAID);
    page.wait_for("#map-text", "The robot is at (0, 0)");
    page.click("#armed");
    page.value("document.activeElement.blur()");
    // After a drive by hand the robot does not know its place any more.
    scene.hold_until(page, "ArrowLeft", |page| {
        page.text("#map-text").contains("not known where")
    });
    // The map shows the last known place, in a circle that grows with the driven distance.
    page.wait_for("#map .chip text", "place unknown");
    page.wait_until("!document.querySelector('#map .robot').hasAttribute('hidden')");
    let radius = "document.querySelector('#map .unsure').r.baseVal.value";
    let before = page.value(radius).as_f64().expect("a radius");
    scene.hold_until(page, "ArrowLeft", |page| {
        page.value(radius).as_f64().expect("a radius") > before + 20.0
    });
    page.key_up("ArrowLeft");
    scene.wait_to_stand();
    page.click("#autonomous");
    page.wait_until("document.querySelector('#where').open");
    assert_eq!(page.text("#mode"), "BY HAND");

    // STOP in all its forms, with the question open or not.
    let stops: [fn(&mut Page); 3] = [
        |page| page.key_down("Escape"),
        |page| page.click("#stop"),
        // With an open list.
        |page| {
            page.value("document.querySelector('#where [name=looks]').focus()");
            page.click("#where [name=looks]");
            page.pause();
            page.key_down("Escape");
        },
    ];
    for stop in stops {
        stop(page);
        page.wait_for("#stop-said", "both wheels stand");
        page.key_up("Escape");
        assert_eq!(page.value("document.querySelector('#where').open"), true);
        scene.resume();
        page.wait_until("document.querySelector('#resume').hidden");
    }

    // The page shows an error beside the field, in the reader's language.
    page.fill("#where [name=x]", "99");
    page.click("#where [type=submit]");
    page.wait_for("#where-said", "column: a number from 0 to 2");
    // The simulated robot is moved to the place that the person enters.
    page.value(
        "(() => { const { x, y, looks } = document.querySelector('#where-form').elements; \
         [x.value, y.value, looks.value] = ['1', '1', 'up']; \
         x.dispatchEvent(new Event('input', { bubbles: true })); })()",
    );
    page.click_until("#where [type=submit]", IS_SAID);
    page.wait_for("#map-text", "The robot is at (1, 1) and looks up");
    page.wait_for("#mode", "AUTONOMOUS");
    wait_for("it to have been carried", || {
        let truth = scene.truth.latest().expect("readable")?;
        ((truth.x_mm - 500.0).abs() < 400.0 && (truth.y_mm - 500.0).abs() < 400.0).then_some(())
    });

    // A field that is not used blocks nothing, whatever it contains.
    scene.by_hand(page);
    page.click("#where-ask");
    page.fill("#where [name=x]", "99");
    page.value("document.querySelector('#where-form').elements.at.value = 'delivery'");
    page.click_until("#where [type=submit]", IS_SAID);
}

pub(crate) fn by_hand_needs_the_wheel_and_asks_during_a_mission(
    scene: &mut Scene,
    page: &mut Page,
) {
    // The robot drives by itself again, and fetches a product.
    page.wait_until("document.querySelector('#map-text').textContent.includes('It goes to')");
    page.listen_in();
    page.click("#tab-drive");
    page.click("#manual");
    page.wait_for("#drive-said", "take the wheel first");
    page.click("#control");
    page.wait_for("#control", "You drive");
    page.click("#manual");
    page.wait_for("#hand-said", "The robot is fetching");
    page.click("#hand-leave");
    page.wait_until("document.querySelector('#hand').hidden");
    let said = "sent.filter((line) => line.includes(' mode manual')).length";
    assert_eq!(page.value(said), 0, "it is left to the robot");
    // Nobody answers.
    page.click("#manual");
    page.wait_for("#hand-said", "Without an answer it goes on");
    page.wait_until("document.querySelector('#hand').hidden");
    assert_eq!(page.value(said), 0, "it is left to the robot");
    page.click("#manual");
    page.click("#hand-now");
    page.wait_for("#mode", "BY HAND");
    assert_eq!(page.value(said), 1);
    scene.wait_to_stand();
}

/// The held keys in the order of their presses, newest last.
pub(crate) fn of_two_keys_the_newer_counts_and_then_the_older_again(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    let key = |page: &mut Page, kind: &str, key: &str| {
        page.value(&format!(
            "dispatchEvent(new KeyboardEvent('{kind}', {{ key: '{key}' }}))"
        ));
    };
    let said = |page: &mut Page| page.moves().pop().unwrap_or_default();
    // If a command was held up, it is refused and ends all holds; then a person begins again.
    wait_for("both keys to be heard", || {
        page.moves();
        let mut heard = Vec::new();
        for (kind, name) in [
            ("keydown", "ArrowUp"),
            ("keydown", "ArrowLeft"),
            ("keyup", "ArrowLeft"),
            ("keydown", "ArrowRight"),
            ("keyup", "ArrowUp"),
            ("keyup", "ArrowRight"),
        ] {
            key(page, kind, name);
            heard.push(said(page));
        }
        let right = ["drive 2", "drive 6", "drive 2", "drive 7", "", "drive 1"];
        // While a key is held, the page may repeat its command at any moment.
        let is_same = |(heard, right): (&String, &str)| {
            heard == right || (right.is_empty() && heard == "drive 7")
        };
        let all = heard.iter().zip(right).all(is_same);
        if !all {
            // The page has ended all holds; what is under way to it comes within a moment.
            std::thread::sleep(std::time::Duration::from_millis(200));
        }
        all.then_some(())
    });
    scene.wait_to_stand();
}

/// Gamepads as the browser gives them: name, index, and how far the stick is bent.
const PADS: &str = "window.pads = []; navigator.getGamepads = () => pads; \
    window.entry = (id, index, y) => ({ id, index, connected: true, mapping: 'standard', \
      timestamp: performance.now(), axes: [0, y], buttons: [] })";

pub(crate) fn a_gamepad_drives_only_while_its_entry_lives_and_once_it_was_centred(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    page.value(PADS);
    let rest = || std::thread::sleep(std::time::Duration::from_millis(800));
    // A gamepad that appears with a fully bent stick.
    page.value("pads = [entry('a', 0, -1)]");
    rest();
    assert_eq!(page.moves(), [""; 0], "it was never centred");
    let hold = |page: &mut Page| {
        wait_for("a hold", || {
            page.value("pads = [entry('a', 0, 0)]");
            std::thread::sleep(std::time::Duration::from_millis(800));
            page.moves();
            page.value("pads[0].axes[1] = -1; pads[0].timestamp = performance.now()");
            std::thread::sleep(std::time::Duration::from_millis(300));
            page.moves().contains(&"drive 2".to_owned()).then_some(())
        });
    };
    let ends: [(&str, &str); 4] = [
        ("it is gone", "pads = []"),
        ("it is not connected", "pads[0].connected = false"),
        (
            "it has come back beside itself",
            "pads[1] = entry('a', 1, 0)",
        ),
        (
            "it is frozen while another one tells",
            "pads[1] = entry('b', 1, 0); pads[1].timestamp += 1000",
        ),
    ];
    for (why, end) in ends {
        hold(page);
        page.value(end);
        // By the next picture the page has ended the command.
        page.pause();
        let said = page.moves();
        let is_over = said.last().is_none_or(|last| last == "drive 1");
        assert!(is_over, "{why}: {said:?}");
        rest();
        assert_eq!(page.moves(), [""; 0], "{why}");
    }
    page.value("pads = []");
}

pub(crate) fn a_stop_that_refuses_a_key_is_ended_by_the_button_beside_it(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    scene.domain.done(&["stop"]);
    page.wait_until("document.body.dataset.look === 'stopped'");
    wait_for("a refusal", || {
        press(page, &["ArrowLeft"]);
        page.pause();
        page.value("dispatchEvent(new KeyboardEvent('keyup', { key: 'ArrowLeft' }))");
        page.text("#drive-said")
            .contains("the robot is stopped")
            .then_some(())
    });
    assert!(
        !page.text("#drive-said").contains("lager"),
        "no command of a terminal"
    );
    page.wait_until("!document.querySelector('#drive-resume').hidden");
    let at = page.middle("#drive-resume");
    page.mouse("mousePressed", at);
    page.wait_until("document.body.dataset.look !== 'stopped'");
    page.mouse("mouseReleased", at);
    page.wait_until("document.querySelector('#drive-resume').hidden");
}

pub(crate) fn in_the_hand_map_and_pad_are_seen_together_and_a_finger_hits_what_it_wants(
    _scene: &mut Scene,
    page: &mut Page,
) {
    page.dress("light", 390, 844, true);
    page.click("#tab-drive");
    page.value("scrollTo(0, 0)");
    page.pause();
    let inside = "['#stop', '#map', '#pad'].map((part) => { \
        const box = document.querySelector(part).getBoundingClientRect(); \
        return box.top >= 0 && box.bottom <= innerHeight && box.height > 50; })";
    assert_eq!(page.value(inside), json!([true, true, true]));
    let free = "document.querySelector('#pad').getBoundingClientRect().bottom <= \
        document.querySelector('#stop-place').getBoundingClientRect().top";
    assert_eq!(page.value(free), true, "STOP covers the pad");
    for tab in TABS {
        page.open_view(tab);
        page.pause();
        let small = page.value(
            "[...document.querySelectorAll('button, select, input, label.button')].filter((part) => { \
               const box = (part.closest('label, figure') ?? part).getBoundingClientRect(); \
               return box.width > 1 && (box.height < 44 || box.width < 44); \
             }).map((part) => part.id || part.name || part.textContent)",
        );
        assert_eq!(small, json!([]), "{tab}");
        // STOP stays under the thumb, however far the page is scrolled, and covers nothing at its end.
        page.value("scrollTo(0, document.documentElement.scrollHeight)");
        page.pause();
        let foot = "(() => { const box = (part) => document.querySelector(part).getBoundingClientRect(); \
            return innerHeight - box('#stop').bottom < 24 && box('main').bottom <= box('#stop-place').top; })()";
        assert_eq!(page.value(foot), true, "{tab}");
    }
}

pub(crate) fn whoever_lets_go_whatever_way_the_robot_stands(scene: &mut Scene, page: &mut Page) {
    scene.take_over(page);

    // Until the box is ticked, an arrow key drives nothing.
    page.key_down("ArrowUp");
    scene.assert_stands();
    page.key_up("ArrowUp");
    page.click("#armed");
    page.value("document.activeElement.blur()");

    scene.hold(page, "ArrowUp");
    page.key_up("ArrowUp");
    scene.wait_to_stand();
    scene.assert_stands();

    // By a finger.
    page.touch("touchStart", "#pad-forward");
    scene.wait_to_move();
    page.touch("touchEnd", "#pad-forward");
    scene.wait_to_stand();
    page.touch("touchStart", "#pad-forward");
    scene.wait_to_move();
    page.touch("touchCancel", "#pad-forward");
    scene.wait_to_stand();
    scene.assert_stands();

    // Each press moves the arm a step, but not while the robot drives; a release does nothing.
    let shoulder = "document.querySelectorAll('#arm-drawing text')[3].textContent";
    page.wait_until(&format!("Number({shoulder}) > 0"));
    let before = page.value(shoulder);
    scene.hold(page, "ArrowUp");
    page.key_down("s");
    page.wait_for("#drive-said", "The robot drives");
    page.key_up("s");
    page.key_up("ArrowUp");
    scene.wait_to_stand();
    assert_eq!(page.value(shoulder), before);
    page.key_down("s");
    page.key_up("s");
    wait_for("the shoulder to move", || {
        (page.value(shoulder) != before).then_some(())
    });

    // The station is killed while a key is held, and the page connects to its successor.
    scene.hold(page, "ArrowUp");
    let station = scene.up.service("station").expect("it runs");
    kill_process(pid(station), Signal::KILL).expect("it runs");
    scene.wait_to_stand();
    page.wait_for("#link", " ms");
    scene.assert_stands();
    page.key_up("ArrowUp");

    // A reloaded page has ended its hold and given back the wheel.
    page.wait_for("#control", "Nobody drives");
    scene.take_over(page);
    scene.hold(page, "ArrowDown");
    page.call("Page.reload", &serde_json::json!({}));
    scene.wait_to_stand();
    page.wait_for("#control", "Nobody drives");
    scene.assert_stands();
}

pub(crate) fn two_people_do_not_drive_at_once_and_either_may_stop(
    scene: &mut Scene,
    page: &mut Page,
) {
    let (anna, mut bo) = (page, scene.page());
    scene.take_over(anna);
    bo.click("#tab-drive");
    bo.wait_for("#control", "drives");
    // Bo asks for the wheel, and Anna keeps it.
    bo.click("#control");
    bo.wait_for("#drive-said", "has been asked for the wheel");
    anna.wait_for("#asked", "guest 2 asks for the wheel");
    anna.click("#keep");
    bo.wait_for("#drive-said", "keeps the wheel");
    anna.wait_until("document.querySelector('#asked').hidden");
    bo.click("#armed");
    bo.value("document.activeElement.blur()");
    bo.key_down("ArrowUp");
    bo.wait_for("#drive-said", "take the wheel first");
    bo.key_up("ArrowUp");

    anna.click("#armed");
    anna.value("document.activeElement.blur()");
    scene.hold(anna, "ArrowUp");
    bo.click("#stop");
    bo.wait_for("#stop-said", "both wheels stand");
    // All pages show who stopped the robot, by a name that this person may choose.
    anna.wait_for("#more", "By guest 2; both wheels stand");
    scene.assert_stands();
    anna.key_up("ArrowUp");
    scene.resume();
    bo.fill("#name", "Bo");
    wait_for("his name", || {
        bo.click("#stop");
        bo.pause();
        anna.text("#more").contains("By Bo;").then_some(())
    });
    scene.resume();

    // Bo asks again, and Anna gives him the wheel.
    bo.click("#control");
    anna.wait_for("#asked", "asks for the wheel");
    anna.click("#hand-over");
    bo.wait_for("#control", "You drive");
    anna.wait_for("#control", "drives");

    // After Bo gives back the wheel, anybody may take it.
    bo.click("#control");
    anna.wait_for("#control", "Nobody drives");
    anna.click("#control");
    anna.wait_for("#control", "You drive");
    bo.close();
}
