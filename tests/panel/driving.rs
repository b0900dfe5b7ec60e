//! Driving from the page: who may, what runs once, which key is which command, and what is old.

use lager_tests::{pid, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::Scene;
use crate::browser::Page;

/// Presses keys one right after the other, so that nothing can come between them.
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

    // An arrow while the arm makes a step is refused, in words.
    press(page, &["s", "ArrowUp"]);
    page.wait_for("#drive-said", "one at a time");
    assert_eq!(page.moves(), ["arm F6"]);
    // A person whose order was held up on the way, or before a step had ended, presses anew.
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

    // The command to stand comes through while a turn runs.
    until_it_moves(scene, page, "PageUp");
    page.value("document.querySelector('#pad-stand').click()");
    assert_eq!(page.moves(), ["drive 1 1000"]);
    scene.wait_to_stand();
    scene.assert_stands();

    // What is held ends before a turn, which is then not cut by it nor by letting go of either key.
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
        said.retain(|line| line != "drive 4 200");
        // Otherwise the hold had been refused before, on a machine that is held up; a turn that was
        // held up has its reason there, too.
        let is_held = said == ["drive 1 200", "drive 9 1000"];
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

/// The keys of the document (G7, G8), and what each says.
const KEYS: &[(&str, &str)] = &[
    ("ArrowUp", "drive 2 200"),
    ("ArrowDown", "drive 4 200"),
    ("ArrowLeft", "drive 6 200"),
    ("ArrowRight", "drive 7 200"),
    ("PageUp", "drive 8 1000"),
    ("PageDown", "drive 9 1000"),
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
        // One that repeats has been pressed before.
        page.value(&format!(
            "dispatchEvent(new KeyboardEvent('keydown', {{ key: {}, repeat: true }}))",
            json!(key)
        ));
        assert_eq!(page.moves(), [""; 0], "{key}");
        // A step before it may be under way still.
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
    // The keypad's division sign is a slash to a browser; the slash of the other keys is nothing.
    page.value("dispatchEvent(new KeyboardEvent('keydown', { key: '/', code: 'Slash' }))");
    page.pause();
    assert_eq!(page.moves(), [""; 0]);
    wait_for("the keypad's division sign", || {
        page.value(
            "dispatchEvent(new KeyboardEvent('keydown', { key: '/', code: 'NumpadDivide' }))",
        );
        (page.moves() == ["arm FA"]).then_some(())
    });
    // Held, each is given again and again; a step is not.
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
    // In a field keys write, and in a list or a choice arrows choose.
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
    let comm = pid(scene.up.service("comm").expect("it runs"));
    kill_process(comm, Signal::STOP).expect("it runs");
    page.wait_for("#link", "nothing new for");
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
    kill_process(comm, Signal::CONT).expect("it runs");
    page.wait_for("#link", "link ");
    page.wait_until("!document.body.classList.contains('stale')");
    scene.assert_stands();

    // Without the station it says since when, in sight and to a screen reader.
    page.value("window.WebSocket = class { close() {} }; tapped.close()");
    page.wait_for("#link", "no connection to the station, last heard ");
    page.wait_for("#link-said[role=status]", "no connection to the station");
    page.wait_until("document.body.classList.contains('stale')");
    page.wait_until("document.querySelector('#control').disabled");
}

pub(crate) fn after_driving_by_hand_the_page_asks_where_the_robot_stands_and_stops_meanwhile(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    // A nudge is no drive.
    scene.hold(page, "ArrowLeft");
    page.wait_for("#map-text", "not known where");
    page.key_up("ArrowLeft");
    scene.wait_to_stand();
    page.click("#autonomous");
    page.wait_until("document.querySelector('#where').open");
    assert_eq!(page.text("#mode"), "BY HAND");

    // STOP in all its forms, in front of the question or not.
    let stops: [fn(&mut Page); 3] = [
        |page| page.key_down("Escape"),
        |page| page.click("#stop"),
        // With a list that is open.
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

    // A simulated robot is put where it is said to be.
    page.value(
        "(() => { const { x, y, looks } = document.querySelector('#where-form').elements; \
         [x.value, y.value, looks.value] = ['1', '1', 'up']; \
         x.dispatchEvent(new Event('input', { bubbles: true })); })()",
    );
    page.click("#where [type=submit]");
    page.wait_until("!document.querySelector('#where').open");
    page.wait_for("#map-text", "The robot is at (1, 1) and looks up");
    page.wait_for("#mode", "AUTONOMOUS");
    wait_for("it to have been carried", || {
        let truth = scene.truth.latest().expect("readable")?;
        ((truth.x_mm - 500.0).abs() < 400.0 && (truth.y_mm - 500.0).abs() < 400.0).then_some(())
    });
}

pub(crate) fn whoever_lets_go_whatever_way_the_robot_stands(scene: &mut Scene, page: &mut Page) {
    scene.take_over(page);

    // Not armed, a key is no more than a key.
    page.key_down("ArrowUp");
    scene.assert_stands();
    page.key_up("ArrowUp");
    page.click("#armed");
    page.value("document.activeElement.blur()");

    scene.hold(page, "ArrowUp");
    page.key_up("ArrowUp");
    scene.wait_to_stand();
    scene.assert_stands();

    // A finger.
    page.touch("touchStart", "#pad-forward");
    scene.wait_to_move();
    page.touch("touchEnd", "#pad-forward");
    scene.wait_to_stand();
    page.touch("touchStart", "#pad-forward");
    scene.wait_to_move();
    page.touch("touchCancel", "#pad-forward");
    scene.wait_to_stand();
    scene.assert_stands();

    // The arm moves a step for each press, not while the robot drives, and letting go leaves it be.
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

    // The whole station is gone while a key is held, and the page comes back to its successor.
    scene.hold(page, "ArrowUp");
    let station = scene.up.service("station").expect("it runs");
    kill_process(pid(station), Signal::KILL).expect("it runs");
    scene.wait_to_stand();
    page.wait_for("#link", "link ");
    scene.assert_stands();
    page.key_up("ArrowUp");

    // A page that is loaded anew has let go, and has left the wheel.
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
    // Bo asks, and Anna keeps it.
    bo.click("#control");
    bo.wait_for("#drive-said", "has been asked for the wheel");
    anna.wait_for("#asked", "asks for the wheel");
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
    scene.assert_stands();
    anna.key_up("ArrowUp");
    scene.resume();

    // He asks again, and she hands it over.
    bo.click("#control");
    anna.wait_for("#asked", "asks for the wheel");
    anna.click("#hand-over");
    bo.wait_for("#control", "You drive");
    anna.wait_for("#control", "drives");

    // Whoever leaves it leaves it to anybody.
    bo.click("#control");
    anna.wait_for("#control", "Nobody drives");
    anna.click("#control");
    anna.wait_for("#control", "You drive");
    bo.close();
}
