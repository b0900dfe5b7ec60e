//! The operator panel in a real browser, on a real simulated robot: whoever lets go, whatever way,
//! the robot stands; a stop is confirmed; goods are fetched; two people do not drive at once.

mod browser;
mod driving;
mod figures;
mod manners;
mod pictures;
mod played;
mod reasons;
mod scene;
mod setting_up;
mod watched;

use browser::Page;
use lager_tests::{pid, wait_for};
use lager_topics::{
    Coded, FailureKind, Hold, Joint, LinkHealth, NavStatus, Phase, Remedy, StopCause, ThoughtKind,
};
use rustix::process::{Signal, kill_process};
use scene::Scene;

/// What the robot may tell is what the page has sentences for.
#[test]
fn every_name_that_a_robot_tells_has_its_sentence() {
    let sentences = include_str!("../../services/panel/page/sentences.js");
    let (_, english) = sentences.split_once("  en: {").expect("a table");
    let (english, _) = english.split_once("  sv: {").expect("two");
    let mut missing = Vec::new();
    let mut look = |prefix: &str, variants: &mut dyn Iterator<Item = &str>| {
        for variant in variants {
            let key = format!("    {prefix}{}: \"", snake(variant));
            if !english.contains(&key) {
                missing.push(key);
            }
        }
    };
    look("thought", &mut names::<ThoughtKind>());
    look("failure", &mut names::<FailureKind>());
    look("remedy", &mut names::<Remedy>());
    look("phase", &mut names::<Phase>());
    look("hold", &mut names::<Hold>());
    look("stop_cause", &mut names::<StopCause>());
    look("joint", &mut names::<Joint>());
    assert!(missing.is_empty(), "{missing:#?}");
}

fn names<T: Coded>() -> impl Iterator<Item = &'static str> {
    T::VARIANTS.iter().map(|(_, name)| *name)
}

/// `LineLost` as `_line_lost`.
fn snake(name: &str) -> String {
    name.chars()
        .flat_map(|letter| {
            let capital = letter.is_ascii_uppercase();
            capital
                .then_some('_')
                .into_iter()
                .chain([letter.to_ascii_lowercase()])
        })
        .collect()
}

#[test]
fn whoever_lets_go_whatever_way_the_robot_stands() {
    let mut scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    scene.take_over(&mut page);

    // Not armed, a key is no more than a key.
    page.key_down("ArrowUp");
    scene.assert_stands();
    page.key_up("ArrowUp");
    page.click("#armed");
    page.value("document.activeElement.blur()");

    scene.hold(&mut page, "ArrowUp");
    page.key_up("ArrowUp");
    scene.wait_to_stand();
    scene.assert_stands();

    // The key-up never comes: another window has the keys, or another tab is in front.
    let ends = [
        "dispatchEvent(new Event('blur'))",
        "dispatchEvent(new Event('pagehide'))",
        "Object.defineProperty(document, 'hidden', { value: true, configurable: true }); \
         document.dispatchEvent(new Event('visibilitychange')); delete document.hidden",
        "document.querySelector('#filter').dispatchEvent(new FocusEvent('focusin', { bubbles: true }))",
        "document.querySelector('#armed').click()",
    ];
    for end in ends {
        scene.hold(&mut page, "ArrowLeft");
        page.value(end);
        scene.wait_to_stand();
        scene.assert_stands();
        page.key_up("ArrowLeft");
    }
    page.click("#armed");
    page.value("document.activeElement.blur()");

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
    scene.hold(&mut page, "ArrowUp");
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
    scene.hold(&mut page, "ArrowUp");
    let station = scene.up.service("station").expect("it runs");
    kill_process(pid(station), Signal::KILL).expect("it runs");
    scene.wait_to_stand();
    page.wait_for("#link", " ms");
    scene.assert_stands();
    page.key_up("ArrowUp");

    // A page that is loaded anew has let go, and has left the wheel.
    page.wait_for("#control", "Nobody drives");
    scene.take_over(&mut page);
    scene.hold(&mut page, "ArrowDown");
    page.call("Page.reload", &serde_json::json!({}));
    scene.wait_to_stand();
    page.wait_for("#control", "Nobody drives");
    scene.assert_stands();
    drop(page);
    scene.end();
}

#[test]
fn a_stop_is_confirmed_stays_and_is_resumed_by_a_held_button() {
    let mut scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    scene.wait_to_move();
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both boards stand");
    scene.assert_stands();
    // A click is too short for it.
    page.click("#resume");
    page.pause();
    scene.assert_stands();
    let at = page.middle("#resume");
    page.mouse("mousePressed", at);
    page.wait_until("document.querySelector('#resume').hidden");
    page.mouse("mouseReleased", at);
    scene.wait_to_move();

    // From a field, too; and by hand.
    page.click("#tab-setup");
    page.value("document.querySelector('#warehouse input').focus()");
    page.key_down("Escape");
    page.wait_for("#stop-said", "both boards stand");
    scene.assert_stands();
    page.key_up("Escape");
    scene.resume();
    drop(page);
    scene.end();
}

#[test]
fn two_people_do_not_drive_at_once_and_either_may_stop() {
    let mut scene = Scene::new(1.0, &[]);
    let (mut anna, mut bo) = (scene.page(), scene.page());
    scene.take_over(&mut anna);
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
    scene.hold(&mut anna, "ArrowUp");
    bo.click("#stop");
    bo.wait_for("#stop-said", "both boards stand");
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
    drop((anna, bo));
    scene.end();
}

#[test]
fn goods_are_queued_shown_and_delivered_round_an_obstacle() {
    let mut scene = Scene::new(4.0, &[]);
    let mut page = scene.page();
    let mut status = scene.bus.subscriber::<NavStatus>().expect("a topic");
    // A person is to pick, and changes his mind when the robot stands at the goods.
    page.click("#picks");
    page.wait_until("!document.querySelector('#picks').checked");
    // On the short way to product 2, while the robot fetches product 1.
    page.click_at_mm(0.0, 750.0);
    page.wait_for("#map-said", "obstacle put");
    page.value("document.querySelector('#goods').value = '2'");
    page.click("#fetch button");
    wait_for("it to wait or to be under way", || {
        page.text("#queue").contains('2').then_some(())
    });
    // Where it is drawn moves with where it is.
    let place = "document.querySelector('#map .robot').getAttribute('transform')";
    let before = page.value(place);
    wait_for("the picture to move", || {
        (page.value(place) != before).then_some(())
    });
    page.wait_for("#doing", "stands at the goods");
    page.click("#picks");
    page.wait_until("document.querySelector('#picks').checked");
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");

    // A page that is loaded anew in the middle of a mission knows as much.
    page.call("Page.reload", &serde_json::json!({}));
    page.wait_for("#link", " ms");
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");
    wait_for("both to be delivered", || {
        let status = status.latest().expect("readable")?;
        (status.delivered == 2).then_some(())
    });
    page.wait_until("document.querySelectorAll('#history li').length === 2");
    // The second had to go round what was put there; the station knows it for whoever comes later.
    let history = page.text("#history");
    assert!(
        history.contains("round what was blocked: (0, "),
        "{history}"
    );
    page.call("Page.reload", &serde_json::json!({}));
    page.wait_until("document.querySelectorAll('#history li').length === 2");
    scene.saves(&mut page);
    drop((page, status));
    scene.wait_to_stand();
    scene.end();
}

#[test]
fn two_robots_are_shown_one_at_a_time_and_each_is_stopped_by_itself() {
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    let station = scene.up.output();
    let (_, rest) = station
        .split_once("listens at ")
        .expect("the station's address");
    let address = rest.split_whitespace().next().expect("an address");
    let second = scene
        .domain
        .start(&["--name", "r2", "up", "--headless", "--station", address]);
    page.wait_until("document.querySelectorAll('#robot option').length === 2");
    page.value(
        "(() => { const list = document.querySelector('#robot'); list.value = 'r2'; \
         list.dispatchEvent(new Event('change')); })()",
    );
    page.wait_for("#link", " ms");
    page.click("#stop");
    page.wait_for("#stop-said", "both boards stand");
    let stopped = |name: &str| {
        let mut health = scene
            .domain
            .observe(name, 1.0)
            .subscriber::<LinkHealth>()
            .expect("a topic");
        wait_for("its health", || {
            health
                .latest()
                .expect("readable")
                .map(|health| health.stopped)
        })
    };
    assert_eq!((stopped("r1"), stopped("r2")), (0, 1));
    scene.domain.done(&["--name", "r2", "resume"]);
    drop((page, second));
    scene.end();
}

#[test]
fn goods_and_obstacles_are_put_by_a_click_and_taken_back() {
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    let goods = "[...document.querySelectorAll('#goods option')].map(({ value }) => value).join()";
    page.wait_until(&format!("{goods} === '1,2,3'"));

    // While the warehouse is set up, a click in a square places goods at its nearest side.
    page.click("#tab-setup");
    page.click_at_mm(250.0, 420.0);
    page.wait_until(&format!("{goods} === '1,2,3,4'"));
    let placed = "(() => { const line = [...document.querySelectorAll('#products tr')].at(-1); \
                  return [...line.querySelectorAll('input, select')].map(({ value }) => value).join(); })()";
    page.wait_until(&format!("{placed} === '4,,0,0,up'"));
    page.click("#undo");
    page.wait_until(&format!("{goods} === '1,2,3'"));

    // What cannot be is said beside it, and nothing is changed.
    page.value(
        "(() => { const field = document.querySelector('#goods-string'); field.value = '7,1,0,4'; \
         field.dispatchEvent(new Event('change')); })()",
    );
    page.wait_for("#setup-said", "7,1,0,4");
    assert_eq!(page.value(goods), "1,2,3");

    // Goods are described, too, and what is wrong is said as one types.
    page.click("#add-product");
    let type_in = |page: &mut Page, field: &str, value: &str| {
        page.value(&format!(
            "(() => {{ const field = [...document.querySelectorAll('#products [name={field}]')].at(-1); \
             field.value = '{value}'; field.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()"
        ));
    };
    type_in(&mut page, "id", "3");
    page.wait_for("#setup-said", "two goods have the number 3");
    type_in(&mut page, "id", "12");
    type_in(&mut page, "x", "2");
    page.wait_for("#setup-said", "goods 12 stand outside");
    type_in(&mut page, "x", "1");
    type_in(&mut page, "name", "nails");
    page.click("#warehouse [type=submit]");
    page.wait_until(&format!("{goods} === '1,2,3,12'"));
    page.wait_until(
        "document.querySelector('#map [data-product=\"12\"] title').textContent === '12 nails'",
    );

    // Otherwise a click on a way puts something there.
    page.click("#tab-missions");
    page.click_at_mm(750.0, 1_000.0);
    page.wait_for("#map-said", "obstacle put");
    page.click("#map-undo");
    page.wait_for("#map-said", "obstacle taken away");
    drop(page);
    scene.end();
}
