//! Tests of what is pressed, by a hand that is in a hurry: STOP in whatever state the page is and
//! while the station is away, Resume again and again, keys that are held or belong to a field, and
//! controls that must do nothing now.

use std::time::Duration;

use lager_tests::{pid, wait_for};
use lager_topics::LinkHealth;
use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::Scene;
use crate::browser::Page;
use crate::keyboard::{hold_down, press, stroke};
use crate::played::Stage;

/// What the page has sent, but that it is there.
pub(crate) const SAID: &str = "sent.filter((line) => !line.startsWith('here '))";

/// Whether nothing covers the middle of STOP.
fn is_on_top(page: &mut Page) -> bool {
    let (x, y) = page.middle("#stop");
    page.value(&format!(
        "document.elementFromPoint({x}, {y})?.closest('#stop')?.id === 'stop'"
    )) == true
}

/// Keeps in `offs` how often STOP was off, and in `told` all that was told of stops.
const WATCH_STOP: &str = "window.offs = 0; window.told = []; (() => { \
    const [stop, said] = ['#stop', '#stop-said'].map((part) => document.querySelector(part)); \
    new MutationObserver(() => { if (stop.disabled || stop.hidden) offs += 1; }) \
      .observe(stop, { attributes: true }); \
    new MutationObserver(() => told.push(said.textContent)).observe(said, { childList: true }); })()";

/// A stop waits in the open socket of a silent station, ahead of all else. Over a closed link no stop
/// is ever kept: the page says so at once, and a person who still wants one presses again. One that
/// came a minute later would stop a robot that somebody else drives by then.
pub(crate) fn stop_is_never_off_and_claims_nothing_while_the_station_is_away(
    scene: &mut Scene,
    page: &mut Page,
) {
    let mut health = scene.bus.subscriber::<LinkHealth>().expect("a topic");
    let mut is_stopped = || {
        wait_for("its health", || {
            let health = health.latest().expect("readable")?;
            Some(health.stopped == 1)
        })
    };
    page.value(WATCH_STOP);
    page.listen_in();

    // It is gone, and nobody starts it again.
    scene.wait_to_move();
    let frozen = scene.freeze("station");
    let station = pid(scene.up.service("station").expect("it runs"));
    kill_process(station, Signal::KILL).expect("it runs");
    page.wait_for("#state", "no connection to the station");
    for is_key in [false, true] {
        page.value("told.splice(0)");
        match is_key {
            true => press_key(page, "Escape"),
            false => page.click("#stop"),
        }
        page.wait_until("told.at(-1) === 'NOT SENT: there is no connection to the station'");
    }
    drop(frozen);
    page.wait_for("#link", " ms");
    page.wait_until("!document.body.classList.contains('stale')");
    for _ in 0..20 {
        assert!(!is_stopped(), "a stop was kept over a closed link");
        std::thread::sleep(Duration::from_millis(50));
    }

    // It is silent.
    scene.arm(page);
    scene.hold(page, "ArrowLeft");
    page.value("told.splice(0)");
    let frozen = scene.freeze("station");
    press_key(page, "Escape");
    page.wait_for(
        "#stop-said",
        "sent, not confirmed: the robot may still be moving",
    );
    // By its lease: the key is still down.
    scene.wait_to_stand();
    scene.assert_stands();
    let claims = "told.filter((words) => words.includes('stand')).length";
    assert_eq!(page.value(claims), 0);
    drop(frozen);
    // A robot that was driven has ended its connection meanwhile. What the station gives to the old
    // one it gives to the next one, too. If it finds none, the page says that, and a person presses
    // again.
    wait_for("the stop", || {
        for _ in 0..100 {
            assert_ne!(scene.moves(), Some(true), "an older command came first");
            if is_stopped() {
                return Some(());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        page.wait_until(
            "/not confirmed|NOT SENT/.test(document.querySelector('#stop-said').textContent)",
        );
        press_key(page, "Escape");
        None
    });
    page.wait_until("document.body.dataset.look === 'stopped'");
    // Nothing of what was held waits behind the stop.
    scene.resume();
    page.wait_until("document.body.dataset.look !== 'stopped'");
    scene.assert_stands();
    page.key_up("ArrowLeft");
    assert_eq!(page.value("offs"), 0, "STOP was off");
}

fn press_key(page: &mut Page, key: &str) {
    page.key_down(key);
    page.key_up(key);
}

/// Something that may stand in front of a hand: its name, how it opens on this page, perhaps with
/// another person's, whether it is open, and how it is closed.
type Opener = (
    &'static str,
    fn(&mut Page, &mut Page),
    &'static str,
    &'static str,
);

const HAND: Opener = (
    "the question before it is driven by hand",
    |page, _| {
        page.click("#tab-drive");
        page.click("#manual");
    },
    "!document.querySelector('#hand').hidden",
    "document.querySelector('#hand-leave').click()",
);

const OPENERS: &[Opener] = &[
    (
        "somebody asks for the wheel",
        |_, other| {
            other.click("#tab-drive");
            other.click("#control");
        },
        "!document.querySelector('#asked').hidden",
        "document.querySelector('#keep').click()",
    ),
    (
        "whether the goods are back",
        |page, _| {
            page.click("#tab-missions");
            page.fill("#goods", "1");
            page.click("#fetch [type=submit]");
        },
        "!document.querySelector('#goods-back').hidden",
        "document.querySelector('#goods-back-no').click()",
    ),
    (
        "where it stands",
        |page, _| {
            page.click("#tab-drive");
            page.click("#where-ask");
        },
        "document.querySelector('#where').open",
        "document.querySelector('#where-later').click()",
    ),
    (
        "help",
        |page, _| page.click("#help-open"),
        "document.querySelector('#help').open",
        "document.querySelector('#help-close').click()",
    ),
    (
        "the legend",
        |page, _| page.click("#map-legend summary"),
        "document.querySelector('#map-legend').open",
        "document.querySelector('#map-legend').open = false",
    ),
    (
        "what was delivered",
        |page, _| {
            page.click("#tab-missions");
            page.click("#past-open");
        },
        "!document.querySelector('#past').hidden",
        "document.querySelector('#past-open').click()",
    ),
    (
        "a past moment",
        |page, _| press(page, "k"),
        "document.body.classList.contains('past')",
        "document.querySelector('#time-now').click()",
    ),
    (
        "a text field",
        |page, _| {
            page.click("#tab-missions");
            page.click("#goods");
        },
        "document.activeElement.id === 'goods'",
        "document.activeElement.blur()",
    ),
    (
        "the map's tip",
        |page, _| {
            page.click("#tab-missions");
            let at = page.middle("#map [data-product=\"3\"] rect");
            page.mouse("mouseMoved", at);
        },
        "!document.querySelector('#map-tip').hidden",
        "document.activeElement.blur()",
    ),
];

/// A way to press STOP, and its name.
type Press = (&'static str, fn(&mut Page));

const STOPS: [Press; 3] = [
    ("click", |page| {
        let at = page.middle("#stop");
        page.click_at(at);
    }),
    ("Esc", |page| press_key(page, "Escape")),
    ("Enter on STOP", |page| {
        page.value("document.querySelector('#stop').focus()");
        press(page, "Enter");
    }),
];

fn open(page: &mut Page, other: &mut Page, (name, go, is_open, _): &Opener) {
    wait_for(name, || {
        for _ in 0..60 {
            if page.value(is_open) == true {
                return Some(());
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        go(page, other);
        None
    });
}

/// Keeps the forms that a press has sent in `posts`. The form that follows a stop which nobody has
/// confirmed for a second is of the same press.
const WATCH_FORMS: &str = "window.posts = []; (() => { const { fetch } = window; \
    const isAgain = () => document.querySelector('#stop-said').textContent.startsWith('sent, not confirmed'); \
    window.fetch = (...what) => { \
      if (String(what[0]).endsWith('/stop') && !isAgain()) posts.push(what[0]); \
      return fetch(...what); \
    }; })()";
/// The stops since `sent` and `posts` were emptied.
const STOPPED: &str = "sent.filter((line) => line.startsWith('stop ')).length + posts.length";

/// Presses STOP, which is one stop.
fn press_once(page: &mut Page, (way, press): Press, name: &str) {
    page.value("sent.splice(0); posts.splice(0)");
    press(page);
    page.wait_until(&format!("{STOPPED} > 0"));
    page.wait_for("#stop-said", "both wheels stand");
    page.pause();
    assert_eq!(page.value(STOPPED), 1, "{name}: {way}");
}

#[test]
fn stop_is_one_press_and_on_top_whatever_else_is_open() {
    let scene = Scene::new(4.0, &["--mission", "1"]);
    let (mut page, mut other) = (scene.page(), scene.page());
    page.dress("light", 1280, 720, false);
    page.listen_in();
    page.value(WATCH_FORMS);
    page.wait_until("document.querySelector('#map [data-product=\"1\"].gone') !== null");
    page.click("#tab-drive");
    page.click("#control");
    page.wait_for("#control", "You drive");
    page.click("#tab-missions");
    for goods in [2, 3] {
        // What is shown may be old for a moment.
        wait_for("an order", || {
            page.click(&format!("#tiles [data-product=\"{goods}\"]"));
            let sent = format!("sent.some((line) => / order \\d+ {goods}$/.test(line))");
            (page.value(&sent) == true).then_some(())
        });
    }
    page.wait_for("#order-number", "2");
    // A robot that is stopped is taken by hand without a question.
    for stop in STOPS {
        open(&mut page, &mut other, &HAND);
        assert!(is_on_top(&mut page), "{}", HAND.0);
        press_once(&mut page, stop, HAND.0);
        page.value(HAND.3);
        scene.resume();
        page.wait_until("document.body.dataset.look !== 'stopped'");
    }
    for opener in OPENERS {
        let (name, _, _, close) = *opener;
        for stop in STOPS {
            open(&mut page, &mut other, opener);
            assert!(is_on_top(&mut page), "{name}");
            press_once(&mut page, stop, name);
        }
        // On a phone, too.
        open(&mut page, &mut other, opener);
        page.dress("light", 390, 844, true);
        page.pause();
        assert!(is_on_top(&mut page), "{name}, on a phone");
        page.dress("light", 1280, 720, false);
        page.value(close);
        page.mouse("mouseMoved", (3.0, 3.0));
    }
    scene.resume();
    drop((page, other));
    scene.end();
}

/// Whether the stop is over, or why not.
const IS_ANSWERED: &str = "document.body.dataset.look !== 'stopped' || \
    document.querySelector('#resume-said').textContent.length > 0";

pub(crate) fn resume_ends_the_stop_or_says_why_not_each_time_that_it_is_held(
    scene: &mut Scene,
    page: &mut Page,
) {
    let mut resumed = 0;
    let mut hold = |page: &mut Page, go: &dyn Fn(&mut Page)| {
        // While it drives, if it does.
        press_key(page, "Escape");
        page.wait_until("document.body.dataset.look === 'stopped'");
        page.wait_until("!document.querySelector('#resume').hidden");
        go(page);
        page.wait_until(IS_ANSWERED);
        let is_over = page.value("document.body.dataset.look") != "stopped";
        if !is_over {
            // A stop that nobody has confirmed for a second was given again.
            wait_for("the stop to be over", || {
                let _ = scene.domain.run(&["resume"]);
                page.pause();
                (page.value("document.body.dataset.look") != "stopped").then_some(())
            });
        }
        resumed += u32::from(is_over);
        is_over
    };
    for _ in 0..12 {
        hold(page, &|page| {
            let at = page.middle("#resume");
            page.mouse("mouseMoved", at);
            page.mouse("mousePressed", at);
            std::thread::sleep(Duration::from_millis(1_300));
            page.mouse("mouseReleased", at);
        });
    }
    // By the keyboard alone, until it is not held up.
    wait_for("a resume by Enter", || {
        hold(page, &|page| {
            page.value("document.querySelector('#resume').focus()");
            hold_down(page, "Enter");
        })
        .then_some(())
    });
    assert!(resumed > 1, "the pointer has ended no stop");
}

pub(crate) fn a_field_keeps_what_is_typed_and_a_clicked_button_is_not_pressed_by_driving(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    let type_into = |page: &mut Page, tab: &str, field: &str| {
        page.open_view(tab);
        page.value(&format!(
            "(() => {{ const field = document.querySelector('{field}'); field.value = ''; field.focus(); }})()"
        ));
        page.value("sent.splice(0)");
        for letter in "wasd wasd ".chars() {
            press(page, &letter.to_string());
        }
        let typed = page.value("document.activeElement.value");
        assert_eq!(typed, "wasd wasd ", "{field}");
        assert_eq!(page.value(SAID), json!([]), "{field}");
    };
    type_into(page, "missions", "#goods");
    type_into(page, "setup", "#products tr:first-child [name=name]");
    type_into(page, "log", "#filter");
    scene.assert_stands();

    // A page that can be scrolled, and a button that was clicked last.
    page.dress("light", 390, 844, true);
    page.click("#tab-drive");
    page.value(
        "window.clicks = 0; document.querySelector('#fit').addEventListener('click', () => (clicks += 1))",
    );
    page.click("#fit");
    page.value("document.querySelector('#fit').focus()");
    page.pause();
    let is_as_before = |page: &mut Page, scrolled: &Value| {
        assert_eq!(page.value("scrollY"), *scrolled);
        assert_eq!(page.value("clicks"), 1);
        assert_eq!(page.value("document.activeElement.id"), "fit");
    };
    assert_eq!(
        page.value("document.documentElement.scrollHeight > innerHeight"),
        true
    );
    let scrolled = page.value("scrollY");
    for key in ["ArrowDown", "ArrowUp"] {
        wait_for("the robot to be driven", || {
            stroke(page, "down", key, false);
            for _ in 0..100 {
                stroke(page, "down", key, true);
                if scene.moves() == Some(true) {
                    return Some(());
                }
                std::thread::sleep(Duration::from_millis(10));
            }
            stroke(page, "up", key, false);
            None
        });
        page.pause();
        is_as_before(page, &scrolled);
        stroke(page, "up", key, false);
        scene.wait_to_stand();
    }
    press(page, " ");
    page.wait_for("#stop-said", "both wheels stand");
    is_as_before(page, &scrolled);
    scene.resume();
    page.dress("light", 1280, 720, false);
    // Last, because a new name is told by a new connection.
    type_into(page, "drive", "#name");
    scene.assert_stands();
}

/// No number of an order is given twice by a page, so an answer that is lost orders nothing twice
/// either: the robot refuses a number that it has (tests/comm, `ordered` and `by_itself`).
pub(crate) fn enter_held_on_a_tile_and_in_the_field_orders_once(
    scene: &mut Scene,
    page: &mut Page,
) {
    // What is ordered waits.
    press_key(page, "Escape");
    page.wait_for("#stop-said", "both wheels stand");
    page.wait_until("document.querySelectorAll('#tiles button').length > 2");
    page.listen_in();
    let places = [
        (
            "2",
            "document.querySelector('#tiles [data-product=\"2\"]').focus()",
        ),
        (
            "3",
            "document.querySelector('#goods').value = '3'; document.querySelector('#goods').focus()",
        ),
    ];
    for (goods, focus) in places {
        // One that is refused, because what is shown is old, is held again.
        wait_for("an order", || {
            page.value(focus);
            hold_down(page, "Enter");
            let orders = page.value(&format!(
                "sent.filter((line) => / order \\d+ {goods}$/.test(line)).length"
            ));
            (orders != 0).then(|| assert_eq!(orders, 1, "goods {goods}"))
        });
    }
    let all = "sent.filter((line) => line.includes(' order ')).length";
    assert_eq!(page.value(all), 2);
    page.wait_until("document.querySelectorAll('#queue .waiting').length === 2");
    scene.resume();
}

pub(crate) fn a_robot_on_its_way_is_not_calibrated_and_the_page_says_why(
    scene: &mut Scene,
    page: &mut Page,
) {
    let mut health = scene.bus.subscriber::<LinkHealth>().expect("a topic");
    let mut calibrations = || {
        wait_for("its health", || {
            let health = health.latest().expect("readable")?;
            Some((health.calibration.get(), health.calibrations_ended))
        })
    };
    let before = calibrations();
    scene.wait_to_move();
    page.open_view("line");
    page.click("#calibrate");
    page.wait_for("#calibration-said", "the robot is on its way by itself");
    assert_eq!(
        page.value("document.querySelector('#calibrate').disabled"),
        false
    );
    for _ in 0..10 {
        assert_eq!(calibrations(), before);
        page.pause();
    }
    scene.wait_to_move();
}

pub(crate) fn a_page_without_its_script_or_of_another_version_drives_nothing_and_stops(
    scene: &mut Scene,
    page: &mut Page,
) {
    // The script does not come, and the panel that has it is gone: it answers as any other one does.
    for answer in [None, Some(404)] {
        scene.wait_to_move();
        let script = json!({ "patterns": [{ "urlPattern": "*/main.js*" }] });
        page.call("Fetch.enable", &script);
        page.call("Page.navigate", &json!({ "url": scene.url }));
        page.answer_next(answer);
        page.wait_until("document.querySelector('#stop') !== null");
        page.pause();
        press_key(page, "Escape");
        page.wait_until("/both wheels stand after/.test(document.body?.textContent)");
        scene.assert_stands();
        page.call("Fetch.disable", &json!({}));
        scene.resume();
    }
    page.call("Page.navigate", &json!({ "url": scene.url }));
    page.wait_for("#link", " ms");
    scene.arm(page);
    page.listen_in();
    page.value("document.documentElement.dataset.edition = 'older'; tapped.close()");
    page.wait_for("#state", "of different versions");
    page.moves();
    page.key_down("ArrowUp");
    page.wait_for("#drive-said", "no connection to the station");
    scene.assert_stands();
    page.key_up("ArrowUp");
    assert_eq!(page.moves(), [""; 0]);
    press_key(page, "Escape");
    page.wait_for("#stop-said", "both wheels stand after");
    scene.resume();
}

#[test]
fn a_press_on_a_map_without_a_warehouse_has_a_reason_and_orders_nothing() {
    let stage = Stage::new(None);
    let robot = stage.robot(
        "r1",
        &["state hold=none mode=autonomous pick=auto stopped=0 sensor_up=1 steering_up=1"],
    );
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    page.listen_in();
    let reason = "The station knows no warehouse yet";
    page.wait_for("#map-said", reason);
    let at = page.middle("#map");
    page.click_at(at);
    page.value("document.querySelector('#map').focus()");
    press(&mut page, "Enter");
    page.fill("#goods", "1");
    page.click("#fetch [type=submit]");
    page.wait_for("#missions-said", reason);
    page.pause();
    page.wait_for("#map-said", reason);
    let seen = "(() => { const { top, bottom, height } = document.querySelector('#map-said').getBoundingClientRect(); \
        return height > 0 && top >= 0 && bottom <= innerHeight; })()";
    assert_eq!(page.value(seen), true);
    assert_eq!(page.value(SAID), json!([]));
    drop((page, robot));
    stage.end();
}
