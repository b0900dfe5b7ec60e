//! Tests of the page with people who read, listen, use only keys or a small screen, or may not
//! drive.

use lager_tests::{Domain, wait_for};
use lager_topics::LinkHealth;
use serde_json::{Value, json};

use crate::Scene;
use crate::browser::{Browser, Page};
use crate::commissioning::AT_WORK;
use crate::played::Stage;

/// Whether headline, chip, banner and the robot's colour and shape show that it is stopped.
const LOOKS_STOPPED: &str = "(() => { const at = (part) => document.querySelector(part); \
    const red = getComputedStyle(at('#stop')).backgroundColor; \
    const style = (part) => getComputedStyle(at(part)); \
    return at('#doing').textContent === 'STOPPED' && at('#mode').textContent === 'STOPPED' && \
      /^By (you|somebody at the panel).*both wheels stand/.test(at('#more').textContent + at('#stop-said').textContent) && \
      style('#bar').backgroundColor === red && at('#bar').getBoundingClientRect().width === innerWidth && \
      at('#map .chip text').textContent === 'stands, stopped' && style('#map .chip rect').fill === red && \
      style('#map .robot path').fill === red && style('#map .robot .hatch').visibility === 'visible'; })()";

pub(crate) const TABS: [&str; 7] = [
    "missions", "drive", "signals", "log", "setup", "line", "health",
];

/// Where STOP is nearer than 16 px to another control or to the screen's edge, so that a person
/// might miss it. At the foot of a phone its row covers whatever is scrolled below it.
const NEAR_STOP: &str = "(() => { \
    const stop = document.querySelector('#stop').getBoundingClientRect(); \
    const place = document.querySelector('#stop-place'); \
    const foot = getComputedStyle(place).position === 'fixed' ? place.getBoundingClientRect().top : Infinity; \
    const near = [...document.querySelectorAll('button, select, input, a, [tabindex]')].filter((other) => { \
      const box = other.getBoundingClientRect(); \
      if (other.id === 'stop' || box.width === 0) return false; \
      const ends = place.contains(other) ? Infinity : foot; \
      if (box.top >= ends) return false; \
      const across = Math.max(box.left - stop.right, stop.left - box.right); \
      const down = Math.max(box.top - stop.bottom, stop.top - Math.min(box.bottom, ends)); \
      return Math.max(across, down) < 16; \
    }).map((other) => other.id || other.outerHTML.slice(0, 60)); \
    const edges = [stop.left, stop.top, innerWidth - stop.right, innerHeight - stop.bottom]; \
    if (edges.some((edge) => edge < 16)) near.push(`edge ${edges}`); \
    return near; })()";

pub(crate) fn stop_is_apart_from_all_else_and_nothing_scrolls_on_a_laptop(
    scene: &mut Scene,
    page: &mut Page,
) {
    // With the controls that appear beside it while the robot is stopped.
    page.click("#stop");
    page.wait_for("#stop-said", "both wheels stand");
    page.wait_until("!document.querySelector('#resume').hidden");
    for (width, height) in [(1280, 720), (3840, 2160), (901, 700), (360, 740)] {
        page.dress("light", width, height, width < 900);
        for tab in TABS {
            page.open_view(tab);
            page.value("scrollTo(0, 0)");
            page.pause();
            assert_eq!(
                page.value(NEAR_STOP),
                json!([]),
                "{width} x {height}, {tab}"
            );
            let wide = page.value("document.documentElement.scrollWidth <= innerWidth");
            assert_eq!(wide, true, "{width} x {height}, {tab} is too wide");
        }
        // Also while a question is open.
        page.click("#tab-drive");
        page.click("#where-ask");
        page.value("scrollTo(0, 0)");
        page.pause();
        assert_eq!(
            page.value(NEAR_STOP),
            json!([]),
            "{width} x {height}, a question"
        );
        page.click("#where-later");
    }
    scene.resume();
    page.wait_until("document.querySelector('#resume').hidden");
    for (width, height) in [(1280, 720), (1366, 768)] {
        page.dress("light", width, height, false);
        // How long the list of services is, the robot says.
        for tab in TABS.into_iter().filter(|tab| *tab != "health") {
            page.open_view(tab);
            page.pause();
            let fits = format!(
                "document.documentElement.scrollHeight <= innerHeight && (() => {{ \
                 const side = document.querySelector('#{tab}'); \
                 return side.scrollHeight <= side.clientHeight && side.scrollWidth <= side.clientWidth; }})()"
            );
            assert_eq!(page.value(&fits), true, "{width} x {height}, {tab} scrolls");
        }
    }
}

pub(crate) fn somebody_else_s_stop_is_told_and_motion_is_left_out_for_who_wants_none(
    scene: &mut Scene,
    page: &mut Page,
) {
    let media = |page: &mut Page, wish: &str| {
        let features = json!({ "features": [{ "name": "prefers-reduced-motion", "value": wish }] });
        page.call("Emulation.setEmulatedMedia", &features);
    };
    media(page, "reduce");
    scene.wait_to_move();
    scene.domain.done(&["stop"]);
    // An alert: a screen reader reads it at once.
    page.wait_for("#told[role=alert]", "STOPPED: it was ordered");
    page.wait_for("#more", "y a command in a terminal; both wheels stand");
    let blinks = "getComputedStyle(document.querySelector('#resume')).animationName";
    assert_eq!(page.value(blinks), "none");
    media(page, "no-preference");
    assert_eq!(page.value(blinks), "latched");
    scene.resume();
    page.wait_until("document.querySelector('#resume').hidden");
    page.wait_until("document.querySelector('#stop-said').textContent === ''");

    // With reduced motion, drawings jump from pose to pose; otherwise they glide.
    let places = "(() => { window.places = new Set(); const robot = document.querySelector('#map .robot'); \
                  new MutationObserver(() => places.add(robot.getAttribute('transform'))) \
                    .observe(robot, { attributes: true }); })()";
    media(page, "reduce");
    scene.wait_to_move();
    page.value(places);
    page.wait_until("window.places.size > 20");
    let told = "(() => { const numbers = [...places].map((place) => place.match(/-?[\\d.]+/)[0]); \
                return numbers.every((x) => x.endsWith('.0')); })()";
    assert_eq!(page.value(told), true, "poses are told in whole mm");
    media(page, "no-preference");
    page.value("places.clear()");
    page.wait_until(&format!("window.places.size > 20 && !{told}"));
}

pub(crate) fn the_words_are_swedish_for_who_reads_swedish(_scene: &mut Scene, page: &mut Page) {
    page.open_view("setup");
    page.change_language();
    page.wait_for("#stop-word", "STOPP");
    // What the page showed before changes its language, too.
    let shown = "['#products option', '#map .robot title', '#map .ghost title'].map((part) => \
                 document.querySelector(part).textContent).join()";
    assert_eq!(page.value(shown), "vänster,robot,där den verkligen är");
    page.wait_until("/^[0-9]+ %/.test(document.querySelector('#battery').textContent)");
    page.wait_until("/^[0-9]+,[0-9] V$/.test(document.querySelector('#battery').title)");
    page.wait_for("#link", " ms");
    assert_eq!(page.value("document.documentElement.lang"), "sv");
    page.wait_for("#map-text", "Ett lager med 2 gånger 2 rutor");
    page.call("Page.reload", &json!({}));
    page.wait_for("#link", " ms");
    assert_eq!(page.text("#tab-missions"), "Uppdrag");
    // The browser keeps the language for later pages.
    page.change_language();
}

pub(crate) fn the_display_on_the_robot_stops_it(scene: &mut Scene, page: &mut Page) {
    let url = scene.screen();
    page.call("Page.navigate", &json!({ "url": url }));
    scene.wait_to_move();
    page.wait_until("document.querySelector('.screen #figures')?.textContent.length > 0");
    assert_eq!(page.value(NEAR_STOP), json!([]));
    // STOP covers none of the words, on whatever display they are.
    let covered = "(() => { const stop = document.querySelector('#stop').getBoundingClientRect(); \
                   return [...document.querySelectorAll('.screen :is(h1, #state, #figures)')].filter((part) => { \
                     const words = document.createRange(); words.selectNodeContents(part); \
                     return [...words.getClientRects()].some(({ top, bottom, left, right }) => \
                       bottom > stop.top && top < stop.bottom && right > stop.left && left < stop.right); \
                   }).map(({ id }) => id); })()";
    for (width, height) in [(1280, 720), (800, 480), (390, 844), (320, 480)] {
        page.dress("light", width, height, width < 800);
        page.wait_until(&format!("innerWidth === {width}"));
        assert_eq!(page.value(covered), json!([]), "{width}x{height}");
    }
    page.dress("light", 1280, 720, false);
    page.key_down(" ");
    page.key_up(" ");
    page.wait_until(
        "/both wheels stand after|båda hjulen står efter/.test(document.querySelector('#stop-said').textContent)",
    );
    scene.assert_stands();
    scene.resume();
    scene.wait_to_move();
    page.click("#stop");
    scene.wait_to_stand();
    scene.assert_stands();
    scene.resume();
}

pub(crate) fn a_stop_is_confirmed_stays_and_is_resumed_by_a_held_button(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.wait_to_move();
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    scene.assert_stands();
    // All of the page shows it: headline, chip, banner and the robot on the map.
    page.wait_until(LOOKS_STOPPED);
    // A click is too short to resume, and the page says so.
    page.click("#resume");
    page.wait_for("#resume-said", "hold it for a second");
    scene.assert_stands();
    let at = page.middle("#resume");
    page.mouse("mousePressed", at);
    page.wait_until("document.querySelector('#resume').hidden");
    page.mouse("mouseReleased", at);
    scene.wait_to_move();

    // A stop in the middle of the hold wins, though the person still holds the button.
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_until(
        "!document.querySelector('#resume').hidden && document.querySelector('#resume').ariaDisabled === 'false'",
    );
    let at = page.middle("#resume");
    page.mouse("mousePressed", at);
    page.wait_until("document.querySelector('#resume').classList.contains('held')");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_until("!document.querySelector('#resume').classList.contains('held')");
    page.wait_for("#stop-said", "both wheels stand");
    std::thread::sleep(std::time::Duration::from_millis(1_200));
    assert_eq!(
        page.value("document.querySelector('#resume').hidden"),
        false,
        "it is stopped still"
    );
    scene.assert_stands();
    page.mouse("mouseReleased", at);
    scene.resume();
    scene.wait_to_move();

    // The space bar stops in a list and on a checkbox, too; Enter ticks a checkbox.
    for part in ["#save-span", "#picks", "#load-file"] {
        page.click("#tab-missions");
        page.value(&format!(
            "(() => {{ const part = document.querySelector('{part}'); \
             document.querySelector(`#tab-${{part.closest('[role=tabpanel]').id}}`).click(); part.focus(); }})()"
        ));
        page.key_down(" ");
        page.key_up(" ");
        page.wait_for("#stop-said", "both wheels stand");
        page.wait_until("!document.querySelector('#resume').hidden");
        scene.resume();
        page.wait_until("document.querySelector('#stop-said').textContent === ''");
    }
    page.value("document.querySelector('#armed').focus()");
    let ticked = "document.querySelector('#armed').checked";
    for is_ticked in [true, false] {
        page.click("#tab-drive");
        page.value("document.querySelector('#armed').focus()");
        page.key_down("Enter");
        page.key_up("Enter");
        assert_eq!(page.value(ticked), is_ticked);
    }

    // From a text field, too, and in manual mode.
    page.open_view("setup");
    page.value("document.querySelector('#warehouse input').focus()");
    page.key_down("Escape");
    page.wait_for("#stop-said", "both wheels stand");
    scene.assert_stands();
    page.key_up("Escape");
    scene.resume();
}

/// The first of the addresses behind these words.
fn address(told: &str, before: &str) -> Option<String> {
    let (_, all) = told.split_once(before)?;
    let own = all.split(' ').find(|it| it.starts_with("http://"))?;
    Some(own.to_owned())
}

#[test]
fn the_tokens_that_a_station_prints_let_a_driver_drive_and_a_viewer_look_and_stop() {
    let domain = Domain::new();
    let station = domain.start(&["station", "--listen", "127.0.0.1:0", "--panel", "0.0.0.0:0"]);
    let (listens, driver, viewer) = wait_for("its addresses", || {
        let told = station.output();
        let (_, rest) = told.split_once("robots connect to ")?;
        let listens = rest.split(',').next()?.to_owned();
        let driver = address(&told, "the panel is at ")?;
        let viewer = address(&told, "for who drives, and at ")?;
        told.contains("looks and stops")
            .then_some((listens, driver, viewer))
    });
    let up = domain.start(&["up", "--headless", "--station", &listens]);
    let browser = Browser::new();
    let stranger = driver.split('?').next().expect("an address");
    let mut page = browser.page(stranger);
    page.wait_until("document.body.textContent.includes('with its token')");

    let open = |url: &str| {
        let mut page = browser.page(url);
        page.wait_for("#link", " ms");
        page
    };
    let mut looks = open(&viewer);
    looks.wait_for("#driver", "you may look and stop");
    looks.click("#tab-drive");
    looks.click("#control");
    looks.wait_for("#drive-said", "this page may look and stop");
    looks.change_language();
    looks.click("#control");
    looks.wait_for("#drive-said", "den här sidan får titta och stoppa");
    looks.change_language();
    // What would order goods is off.
    looks.click("#tab-missions");
    looks.wait_until(
        "['clear', 'do-horn', 'picks'].every((id) => document.getElementById(id).disabled)",
    );
    // The log shows the refused action.
    looks.click("#tab-log");
    looks.wait_for("#entries", "not done: this page may look and stop");
    looks.click("#stop");
    looks.wait_for("#stop-said", "both wheels stand");
    looks.wait_until("document.querySelector('#resume').ariaDisabled === 'true'");
    // A viewer who holds the button is told why nothing happens.
    let at = looks.middle("#resume");
    looks.mouse("mousePressed", at);
    looks.wait_for("#resume-said", "you may look and stop");
    looks.mouse("mouseReleased", at);

    // The cookie belongs to the browser, so all its pages may drive after one driver's address.
    let mut drives = open(&driver);
    drives.wait_until("document.querySelector('#resume').ariaDisabled === 'false'");
    let at = drives.middle("#resume");
    drives.mouse("mousePressed", at);
    drives.wait_until("document.querySelector('#resume').hidden");
    drives.mouse("mouseReleased", at);
    let bus = domain.observe("r1", 1.0);
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    wait_for("the stop to be over", || {
        let health = health.latest().expect("readable")?;
        (health.stopped == 0).then_some(())
    });
    drop((page, looks, drives, health, bus, browser, up, station));
    domain.assert_clean();
}

#[test]
#[ignore = "axe-core's file is needed, in LAGER_AXE: tests/run"]
fn an_accessibility_checker_finds_nothing() {
    let axe = std::env::var_os("LAGER_AXE").expect("LAGER_AXE");
    let axe = std::fs::read_to_string(axe).expect("a file");
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    let mut found = Vec::new();
    let mut check = |page: &mut Page, view: &str| {
        for theme in ["light", "dark"] {
            page.dress(theme, 1280, 720, false);
            page.pause();
            let call = "axe.run({ runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', \
                        'best-practice'] }).then(({ violations, passes }) => JSON.stringify({ \
                        passes: passes.length, violations: violations.map(({ id, impact, nodes }) => \
                        ({ id, impact, where: nodes.map(({ target }) => String(target)) })) }))";
            let params = json!({ "expression": call, "awaitPromise": true, "returnByValue": true });
            let said = page.call("Runtime.evaluate", &params);
            let told = said["result"]["value"].as_str().expect("a result");
            let told: Value = serde_json::from_str(told).expect("JSON");
            assert!(told["passes"].as_u64() > Some(20), "{told}");
            for violation in told["violations"].as_array().expect("a list") {
                found.push(format!("{view}, {theme}: {violation}"));
            }
        }
    };
    page.value(&axe);
    for tab in TABS {
        page.open_view(tab);
        page.wait_until(
            "(() => { const heads = [...document.querySelectorAll('[role=tabpanel]:not([hidden]) h3')]; \
             return heads.every(({ textContent }) => textContent) && \
               (document.body.dataset.view !== 'signals' || heads.length > 0); })()",
        );
        check(&mut page, tab);
    }
    page.click("#tab-setup");
    page.click_until(
        "#commission-open",
        "document.querySelector('#commission [data-does]') !== null",
    );
    check(&mut page, "setting up a robot");
    page.click("#help-open");
    check(&mut page, "help");
    page.click("#help-close");
    page.click("#tab-drive");
    page.click("#where-ask");
    check(&mut page, "where it stands");
    page.click("#where-later");
    page.click("#stop");
    page.wait_for("#stop-said", "both wheels stand");
    check(&mut page, "stopped");
    scene.resume();
    let frozen = scene.freeze("comm");
    page.wait_for("#state", "r1 is not heard");
    for tab in TABS {
        page.open_view(tab);
        check(&mut page, &format!("{tab}, when it is old"));
    }
    drop(frozen);
    page.wait_for("#link", " ms");
    let url = scene.screen();
    page.call("Page.navigate", &json!({ "url": url }));
    page.wait_until("document.querySelector('.screen #doing')?.textContent.length > 0");
    page.value(&axe);
    check(&mut page, "screen");
    drop(page);
    // It and the next one each have the machine to themselves.
    scene.end();
    let stage = Stage::new(None);
    let robot = stage.robot("r1", &AT_WORK);
    let mut at_work = stage.page(&stage.url);
    at_work.click("#tab-setup");
    at_work.click_until(
        "#commission-open",
        "document.querySelector('#commission h2')?.textContent === 'Line sensors'",
    );
    at_work.value(&axe);
    check(&mut at_work, "setting up, at work");
    let ways = AT_WORK[1].replace("takes=yes", "takes=ways");
    robot.says(&[AT_WORK[0], &ways, AT_WORK[2]]);
    at_work.wait_until("document.querySelector('#commission fieldset') !== null");
    check(&mut at_work, "setting up, ways");
    drop((at_work, robot));
    stage.end();
    assert!(found.is_empty(), "{found:#?}");
}
