//! The time line and the log: a past moment is shown as what it is, and comes from the station.

use lager_tests::wait_for;
use serde_json::{Value, json};

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

/// Where the map draws the robot that it is about, in mm.
const PLACE: &str = "document.querySelector('#map > .robot:not([hidden])')?.getAttribute('transform')\
    .match(/-?[\\d.]+/g).slice(0, 2).map(Number)";
/// Where the map draws the live robot beside the past one.
const NOW: &str = "document.querySelector('#map .other:not([hidden]) .robot:not([hidden])')\
    ?.getAttribute('transform').match(/-?[\\d.]+/g).slice(0, 2).map(Number)";
/// The page shows a past moment, and has drawn it.
const IS_PAST: &str = "document.body?.classList.contains('past') === true && \
    document.querySelector('#moment').hidden === false && document.querySelector('#moment strong').textContent !== ''";

/// Makes the browser's clock wrong by so many minutes, in pages that are opened from now on. Keeps how
/// many lines of its history the station has told for each address in `told`, and what is written on
/// canvases in `written`.
fn wrong_clock(page: &mut Page, minutes: i32) {
    let source = format!(
        "const Right = Date; const off = {minutes} * 60000; \
         Date = class extends Right {{ \
           constructor(...all) {{ if (all.length) super(...all); else super(Right.now() + off); }} \
           static now() {{ return Right.now() + off; }} \
         }}; \
         window.told = {{}}; const ask = fetch; \
         window.fetch = async (...all) => {{ \
           const answer = await ask(...all); \
           const lines = (await answer.clone().text()).split('\\n').length - 1; \
           told[String(all[0]).replace(/.*history/, '')] = lines; return answer; \
         }}; \
         window.written = []; const drawn = CanvasRenderingContext2D.prototype; const write = drawn.fillText; \
         drawn.fillText = function (text, ...at) {{ written.push(text); return write.call(this, text, ...at); }};"
    );
    let source = json!({ "source": source });
    page.call("Page.addScriptToEvaluateOnNewDocument", &source);
}

/// Waits for the place of a robot on the map.
fn place(page: &mut Page, of: &str) -> [f64; 2] {
    wait_for("the robot on the map", || {
        let place = page.value(of);
        Some([place[0].as_f64()?, place[1].as_f64()?])
    })
}

fn far(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

pub(crate) fn a_past_moment_is_marked_orders_nothing_and_is_the_same_on_another_page(
    scene: &mut Scene,
    page: &mut Page,
) {
    // A row of the log shows its moment.
    let start = place(page, PLACE);
    page.click("#tab-log");
    page.wait_for("#entries", "stands at goods 1");
    let row = "[...document.querySelectorAll('.entry')].find((row) => row.textContent.includes('goes to (1, 0)'))";
    page.value(&format!("{row}.click()"));
    page.wait_until(IS_PAST);
    page.wait_for("#moment", "the moment ");
    page.wait_until(&format!("{row}.ariaCurrent === 'true'"));
    let past = place(page, PLACE);
    assert!(far(past, start) > 100.0, "{past:?}, {start:?}");
    let now = place(page, NOW);
    assert!(far(past, now) > 100.0, "{past:?}, {now:?}");
    page.wait_until("location.hash.startsWith('#at=') && location.hash.endsWith('Z')");
    let hash = page.value("location.hash");
    let hash = hash.as_str().expect("an address").to_owned();
    let told = "document.querySelector('#moment strong').textContent.split(',')[0]";
    let moment = page.value(told);
    let entries = "document.querySelectorAll('.entry').length";
    let known = page.value(entries).as_u64();

    // It comes from the station, so it is the same after a reload, and for a browser elsewhere whose
    // clock is wrong. A page shows each time in its browser's zone, and its address has the moment in
    // UTC. Nobody chooses a time of the clock or goes a day back, so no part of a page can show or
    // choose another zone's.
    page.call("Page.reload", &json!({}));
    page.wait_until(IS_PAST);
    wait_for("the same place after a reload", || {
        (far(past, place(page, PLACE)) < 1.0).then_some(())
    });
    assert_eq!(page.value(told), moment);
    let mut samples = None;
    for minutes in [0, -6 * 60, 5, 24 * 60] {
        let mut other = scene.browser.page(&scene.url);
        other.wait_for("#link", " ms");
        let zone = json!({ "timezoneId": "Asia/Kolkata" });
        other.call("Emulation.setTimezoneOverride", &zone);
        wrong_clock(&mut other, minutes);
        other.value(&format!("location.hash = {}", json!(hash)));
        other.call("Page.reload", &json!({}));
        other.wait_until(IS_PAST);
        wait_for("the same place in another browser", || {
            (far(past, place(&mut other, PLACE)) < 1.0).then_some(())
        });
        // Its own zone, the same moment, and no age that its clock has made.
        let clock = "new Date(decodeURIComponent(location.hash.slice(4))).toLocaleTimeString('en', \
             { hourCycle: 'h23', hour: '2-digit', minute: '2-digit', second: '2-digit' })";
        let here = other.value(clock);
        other.wait_for("#moment strong", here.as_str().expect("a time"));
        assert_ne!(other.value(told), moment);
        let age = other.text("#moment strong");
        assert!(!age.contains('-') && !age.contains(" h ago"), "{age}");
        // The minute before it has as many samples as for who has the right time.
        let count = wait_for("the samples of the minute before", || {
            let count = other.value(
                "told[Object.keys(told).find((asked) => asked.startsWith('/lines?'))] ?? null",
            );
            count.as_u64()
        });
        assert!(count > 10, "{count}");
        assert_eq!(*samples.get_or_insert(count), count, "{minutes} min");
        other.click("#tab-log");
        wait_for("all that has happened", || {
            (other.value(entries).as_u64() >= known).then_some(())
        });
        // The newest stands at the line's right end.
        other.wait_until(
            "[...document.querySelector('#time-line .ticks').getAttribute('d').matchAll(/M([0-9]+).5/g)].some(\
             ([, x]) => x > document.querySelector('#time-line').clientWidth * 0.7)",
        );
        if minutes == 0 {
            // The time below the signals is of the same zone.
            other.click("#time-now");
            other.click("#tab-signals");
            let late = "(() => { const text = written.findLast((text) => /^[0-9]+:[0-9]+:[0-9]+$/.test(text)); \
                 if (!text) return null; \
                 const [hour, minute] = text.split(':').map(Number); const now = new Date(); \
                 return (now.getHours() * 60 + now.getMinutes() - hour * 60 - minute + 1440) % 1440; })()";
            let late = wait_for("the newest time of the axis", || other.value(late).as_u64());
            assert!(late <= 15, "{late} min before now");
            assert_eq!(other.value("new Date().getTimezoneOffset()"), -330);
        }
        other.close();
    }

    // The strips show the figures of that moment, not those of now.
    let figures = "(async () => { \
         const at = Date.parse(decodeURIComponent(location.hash.slice(4))); \
         const answer = await fetch(`history/moment?robot=r1&at=${at}`); \
         const state = (await answer.text()).split('\\n').map((line) => line && JSON.parse(line).line) \
           .find((line) => line.startsWith('state ')); \
         const figure = (key) => Number(state.match(` ${key}=([0-9-]+)`)[1]); \
         const duty = (side) => Math.round(figure(`${side}_duty`) / 2.55); \
         window.figures = [` ${duty('left')} / ${duty('right')} %`, \
           ` ${(figure('battery_dv') / 10).toFixed(1)} V`, String(duty('left') + duty('right') > 0)]; \
         })()";
    page.value(figures);
    page.wait_until("window.figures !== undefined");
    assert_eq!(page.value("figures[2]"), "true", "it drove then");
    for (at, strip) in ["duty", "battery"].into_iter().enumerate() {
        let told = page.text(&format!("#strips [data-lane={strip}]"));
        let figure = page.value(&format!("figures[{at}]"));
        let figure = figure.as_str().expect("words");
        assert!(told.ends_with(figure), "{told}, {figure}");
    }

    // The map that shows the past orders nothing; STOP is of now.
    page.listen_in();
    let goods = page.middle("#map [data-product='3'] rect");
    page.click_at(goods);
    page.wait_for("#map-said", "this is the past");
    let orders = "sent.filter((line) => line.startsWith('do ')).length";
    assert_eq!(page.value(orders), 0);
    page.click("#stop");
    scene.wait_to_stand();
    page.wait_for("#doing", "STOPPED");
    assert_eq!(page.value(IS_PAST), true);
    assert!(far(past, place(page, PLACE)) < 1.0);
    page.click("#time-now");
    page.wait_until("!document.body.classList.contains('past') && location.hash === ''");
    page.click_at(goods);
    page.wait_until(&format!("{orders} > 0"));
    scene.resume();

    // The line is a slider; K goes to what happened before, and the right end is now.
    page.value("document.querySelector('#time-line').focus()");
    page.key_down("k");
    page.key_up("k");
    page.wait_until(IS_PAST);
    let slider = "document.querySelector('#time-line')";
    page.wait_until(&format!(
        "{slider}.role === 'slider' && {slider}.ariaValueText.startsWith('the moment ')"
    ));
    let before = page.value("location.hash");
    page.key_down("ArrowLeft");
    page.key_up("ArrowLeft");
    wait_for("another moment", || {
        (page.value("location.hash") != before).then_some(())
    });
    let end = page.value(&format!(
        "(() => {{ const box = {slider}.getBoundingClientRect(); return [box.right - 2, box.y + box.height / 2]; }})()"
    ));
    page.click_at((end[0].as_f64().expect("x"), end[1].as_f64().expect("y")));
    page.wait_until(&format!(
        "!document.body.classList.contains('past') && {slider}.ariaValueText === 'Now'"
    ));
    // Who drives by hand sees what is now.
    scene.arm(page);
    page.key_down("k");
    page.key_up("k");
    page.pause();
    assert_eq!(
        page.value("document.body.classList.contains('past')"),
        false
    );
}

pub(crate) fn a_clock_that_is_five_minutes_fast_makes_nothing_old_and_no_hold_longer(
    scene: &mut Scene,
    page: &mut Page,
) {
    wrong_clock(page, 5);
    page.call("Page.reload", &json!({}));
    page.wait_for("#link", " ms");
    let is_old = "document.body.classList.contains('stale')";
    assert_eq!(page.value(is_old), false);
    // Nobody is in the future, or five minutes ago.
    let ages = page.text("#told") + &page.text("#state") + &page.text("#link");
    assert!(!ages.contains('-') && !ages.contains("5 min"), "{ages}");
    scene.arm(page);
    let mut right = scene.page();
    right.click("#tab-drive");
    right.wait_for("#control", "drives");
    scene.hold(page, "ArrowLeft");
    page.key_up("ArrowLeft");
    scene.wait_to_stand();
    // What it was told last grows old as for anybody, and the robot stands when nobody renews.
    scene.hold(page, "ArrowLeft");
    let frozen = scene.freeze("comm");
    page.wait_until(is_old);
    scene.wait_to_stand();
    page.key_up("ArrowLeft");
    drop(frozen);
    page.wait_until(&format!("!{is_old}"));
    scene.assert_stands();
    // Who leaves the wheel leaves it at once.
    page.click("#tab-drive");
    page.click("#control");
    right.wait_for("#control", "Nobody drives");
    right.close();
}

#[test]
fn the_log_is_filtered_by_kinds_and_goes_further_back_than_the_page_holds() {
    let stage = Stage::new(Some(
        "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n",
    ));
    let state =
        "state hold=none mode=autonomous stopped=0 battery_dv=114 sensor_up=1 x_mm=0 y_mm=0";
    let says = |event: &'static str| -> Vec<&'static str> {
        std::iter::once(state)
            .chain(std::iter::repeat_n(event, 4))
            .collect()
    };
    let robot = stage.robot("r1", &says("event next_node 1 0 - -"));
    let mut page = stage.page(&stage.url);
    page.click("#tab-log");
    let count =
        |at: usize| format!("Number(document.querySelectorAll('#log-kinds b')[{at}].textContent)");
    page.wait_until(&format!("{} === 1000", count(0)));
    robot.says(&says("event item_delivered 1 0 4 7"));
    page.wait_until(&format!("{} >= 40", count(3)));
    robot.says(&[state]);
    // Only deliveries, each with its place.
    let goods = "document.querySelectorAll('#log-kinds button')[3]";
    page.value(&format!("{goods}.click()"));
    page.wait_until(&format!(
        "{goods}.ariaPressed === 'true' && [...document.querySelectorAll('.entry')].every(\
         (row) => row.dataset.kind === 'goods' && row.textContent.includes('DELIVERED goods 7') && row.textContent.includes('1,0'))"
    ));
    page.fill("#filter", "no such words");
    page.wait_for("#entries", "Nothing that fits");
    page.fill("#filter", "");
    page.value("document.querySelector('#log-kinds button').click()");
    // The station keeps what the page does not hold.
    wait_for("more than the page holds", || {
        page.click("#log-earlier");
        page.pause();
        let all = page.value(&count(0));
        (all.as_u64() > Some(1_000) && all != Value::Null).then_some(())
    });
    drop((page, robot));
    stage.end();
}
