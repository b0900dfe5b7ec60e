//! Tests of the map: what it shows is to scale, can be read and covers no robot, and a pointer or
//! the keys alone order goods, say where the robot stands and put obstacles.

use lager_tests::wait_for;
use serde_json::{Value, json};

use crate::Scene;
use crate::browser::Page;
use crate::played::Stage;

const FLOOR: &str = "size = [3, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n\
    [[product]]\nid = 1\nname = \"matches\"\nsquare = [0, 1]\nside = \"left\"\n\
    [[product]]\nid = 2\nname = \"nails\"\nsquare = [1, 0]\nside = \"down\"\n\
    [[product]]\nid = 3\nname = \"a name that is too long for its square\"\nsquare = [2, 1]\nside = \"up\"\n";

/// A state of a robot that waits; `more` says where it is, and what else is known.
fn state(more: &str) -> String {
    format!(
        "state time_ms=64000 hold=none mode=autonomous pick=auto stopped=0 battery_dv=114 \
         sensor_up=1 steering_up=1 {more}"
    )
}

const WAITS: &str =
    "phase=waiting_for_order x_mm=500 y_mm=500 heading_deg=0 node=1,1 looks=up unsure_mm=20";
/// Of a simulated robot, so obstacles can be put.
const TRUTH: &str = "truth 510 500 3 -";

/// The middle of a parcel in pixels.
fn parcel(page: &mut Page, id: u32) -> (f64, f64) {
    page.middle(&format!("#map [data-product=\"{id}\"] rect"))
}

/// Moves the pointer over a parcel.
fn point_at(page: &mut Page, id: u32) {
    let at = parcel(page, id);
    page.mouse("mouseMoved", at);
}

/// How often the page has ordered this.
fn orders(page: &mut Page, id: u32) -> Value {
    page.value(&format!(
        "sent.filter((line) => / order \\d+ {id}$/.test(line)).length"
    ))
}

/// Moves the keys' focus to the map, as a person with a keyboard does.
fn focus(page: &mut Page) {
    page.value("document.activeElement.blur(); document.querySelector('#robot').focus()");
    wait_for("the map to have the focus", || {
        page.tab();
        (page.value("document.activeElement.id") == "map").then_some(())
    });
}

fn press(page: &mut Page, key: &str) {
    page.key_down(key);
    page.key_up(key);
}

#[test]
fn a_click_on_goods_fetches_them_once_and_a_moved_hand_fetches_nothing() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[&state(WAITS), TRUTH]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    page.listen_in();
    // A hand that moves the map, or presses beside everything, orders nothing.
    let at = parcel(&mut page, 2);
    page.mouse("mouseMoved", at);
    page.wait_for("#map-tip", "2 nails, square 1,0");
    page.wait_for("#map-tip", "click: fetch it");
    page.mouse("mousePressed", at);
    page.mouse("mouseMoved", (at.0 + 30.0, at.1));
    page.mouse("mouseReleased", (at.0 + 30.0, at.1));
    page.click("#fit");
    let beside = page.middle("#map");
    page.click_at((beside.0, 110.0));
    page.wait_for("#map-said", "there is no way; click on goods");
    assert_eq!(orders(&mut page, 2), 0);

    // Two clicks of one hand are one order, and what waits is not ordered again.
    let at = parcel(&mut page, 2);
    page.click_at(at);
    page.click_at(at);
    page.wait_until("sent.some((line) => / order \\d+ 2$/.test(line))");
    page.pause();
    assert_eq!(orders(&mut page, 2), 1);
    robot.says(&[&state(WAITS), TRUTH, "queue 2 8 1 9 2"]);
    page.wait_until("document.querySelectorAll('#map .good.queued').length === 2");
    assert_eq!(page.text("#map [data-product=\"2\"] .turn text"), "2");
    std::thread::sleep(std::time::Duration::from_millis(600));
    page.click_at(at);
    page.wait_for("#map-tip", "ordered, as number 2");
    assert_eq!(orders(&mut page, 2), 1);
    point_at(&mut page, 3);
    page.wait_for("#map-tip", "click: fetch it, as number 3");
    drop((page, robot));
    stage.end();
}

#[test]
fn goods_that_were_delivered_are_fetched_again_only_when_a_person_says_that_they_are_back() {
    let scene = Scene::new(4.0, &["--mission", "1"]);
    let mut page = scene.page();
    page.wait_for("#history li", " in ");
    page.wait_until("document.querySelector('#map [data-product=\"1\"].gone') !== null");
    page.wait_for("#map [data-product=\"1\"] .why", "delivered");
    page.listen_in();
    // The question stands where the hand was: on the map, or at the form.
    let at = parcel(&mut page, 1);
    page.click_at(at);
    page.wait_for("#goods-back-said", "1 was delivered at");
    page.wait_until("document.querySelector('#map-words #goods-back') !== null");
    page.click("#goods-back-no");
    page.wait_until("document.querySelector('#goods-back').hidden");
    let asks = "document.querySelector('#missions #goods-back:not([hidden])') !== null";
    page.order("1", asks);
    assert_eq!(orders(&mut page, 1), 0);
    page.click("#goods-back-yes");
    page.wait_for("#order-number", "1");
    page.wait_until("document.querySelector('#map [data-product=\"1\"].gone') === null");
    assert_eq!(orders(&mut page, 1), 1);
    drop(page);
    scene.end();
}

#[test]
fn a_click_on_a_crossing_says_where_the_robot_stands_if_that_is_to_be_said() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[&state(WAITS)]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    page.click_at_mm(1_000.0, 500.0);
    page.wait_for("#map-tip", "crossing (2, 1)");
    page.wait_for("#map-said", "after \u{201c}Say where it stands\u{201d}");
    assert_eq!(page.value("document.querySelector('#where').open"), false);
    robot.says(&[&state("phase=lost")]);
    page.wait_for("#map .chip text", "place unknown");
    page.wait_for("#map-tip", "click: say that the robot stands here");
    page.click_at_mm(1_000.0, 500.0);
    page.wait_until("document.querySelector('#where').open");
    let said = "(() => { const { at, x, y, looks } = document.querySelector('#where-form').elements; \
                return [at, x, y, looks].map(({ value }) => value).join(); })()";
    // It looks as it looked when it was seen last, until the person says otherwise.
    page.wait_until(&format!("{said} === 'crossing,2,1,up'"));
    page.listen_in();
    page.click("#where [type=submit]");
    page.wait_until("sent.some((line) => line.endsWith(' place 2 1 up'))");
    drop((page, robot));
    stage.end();
}

#[test]
fn keys_alone_reach_everything_on_the_map_and_each_tip_says_what_enter_does() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[&state(WAITS), TRUTH]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    page.listen_in();
    focus(&mut page);
    page.wait_until("!document.querySelector('#map-tip').hidden");
    page.wait_until("!document.querySelector('#map .cross').hasAttribute('hidden')");
    // To the crossing in the lower left corner, and from there to goods that are reached from below.
    for key in ["ArrowLeft", "ArrowDown"] {
        for _ in 0..12 {
            press(&mut page, key);
        }
    }
    page.wait_for("#map-tip", "crossing (0, 0)");
    for _ in 0..3 {
        press(&mut page, "ArrowRight");
    }
    page.wait_for("#map-tip", "the way from (1, 0) to (2, 0)");
    page.wait_for("#map-tip", "Enter: put an obstacle here");
    press(&mut page, "ArrowUp");
    page.wait_for("#map-tip", "2 nails, square 1,0");
    page.wait_for("#map-tip", "Enter: fetch it");
    press(&mut page, "Enter");
    page.wait_until("sent.some((line) => / order \\d+ 2$/.test(line))");
    press(&mut page, "ArrowDown");
    press(&mut page, "Enter");
    page.wait_until("sent.some((line) => line.endsWith(' obstacle take 1 0 right'))");
    // What stands there is told by its look, and so is what the robot has found.
    robot.says(&[
        &state(WAITS),
        TRUTH,
        "obstacles 1 1 0 right",
        "blocked 1 2 1 left 40",
    ]);
    page.wait_for("#map-tip", "Enter: take the obstacle away");
    page.wait_until("document.querySelectorAll('#map .placed').length === 1");
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");
    page.wait_for("#map .label.shut text", "blocked 24 s");
    point_at(&mut page, 1);
    page.click_at_mm(750.0, 500.0);
    page.wait_for(
        "#map-tip",
        "the way from (1, 1) to (2, 1), found blocked 24 s ago",
    );
    // On a real floor a click puts nothing, and says why.
    drop(robot);
    let real = stage.robot("r2", &[&state(WAITS)]);
    let url = stage.url.replacen("/?", "/?r2&", 1);
    page.call("Page.navigate", &json!({ "url": url }));
    page.wait_until("document.querySelector('#stop-whom')?.textContent === 'r2'");
    page.wait_for("#link", " ms");
    page.click_at_mm(1_250.0, 0.0);
    page.wait_for("#map-said", "put obstacles on a real floor by hand");
    drop((page, real));
    stage.end();
}

/// Boxes of all elements that match, as left, top, right and bottom in pixels.
const BOXES: &str = "const boxes = (part) => [...document.querySelectorAll(`#map ${part}`)] \
      .filter((one) => one.getClientRects().length).map((one) => { \
        const { left, top, right, bottom } = one.getBoundingClientRect(); return [left, top, right, bottom]; }); \
    const meets = (a, b) => a[0] < b[2] - 1 && a[2] > b[0] + 1 && a[1] < b[3] - 1 && a[3] > b[1] + 1;";

#[test]
fn nothing_covers_the_robot_and_the_robot_covers_no_goods() {
    let stage = Stage::new(Some(FLOOR));
    let next = "phase=driving next=1,1 order=8 product=2";
    let robot = stage.robot("r1", &[&state(WAITS), TRUTH]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#link", " ms");
    let covers = format!(
        "(() => {{ {BOXES} const robots = boxes('.robot .hull'); \
         return boxes(':is(.chip, .label) rect').filter((label) => robots.some((robot) => meets(label, robot))).length; }})()"
    );
    let crowded = "blocked 3 1 1 right 40 1 1 up 41 1 1 down 42";
    for (x, y, heading) in [
        (500, 400, 0),
        (500, 600, 180),
        (400, 500, 90),
        (600, 500, 270),
        (0, 1_000, 90),
        (1_500, 1_000, 0),
    ] {
        let pose = format!("x_mm={x} y_mm={y} heading_deg={heading} node=1,1 looks=up");
        let stopped = state(&format!("{pose} {next}")).replace("stopped=0", "stopped=1");
        robot.says(&[&stopped, crowded]);
        page.wait_for("#map .chip text", "stands, stopped");
        let shown = "document.querySelector('#map .robot').getAttribute('transform')";
        page.wait_until(&format!("{shown}.startsWith('translate({x}.0 {}.0)')", -y));
        page.wait_until("document.querySelectorAll('#map .label:not([hidden])').length === 4");
        page.wait_until(&format!("{covers} === 0"));
        // The tip yields, too.
        point_at(&mut page, 2);
        page.wait_until("!document.querySelector('#map-tip').hidden");
        page.wait_until(&format!(
            "(() => {{ {BOXES} const {{ left, top, right, bottom }} = document.querySelector('#map-tip').getBoundingClientRect(); \
             return boxes('.robot .hull').every((robot) => !meets(robot, [left, top, right, bottom])); }})()"
        ));
    }
    // It has turned in at its goods: hull and parcel stand side by side.
    let at_goods =
        "phase=picking x_mm=750 y_mm=0 heading_deg=0 node=1,0 looks=up order=8 product=2";
    robot.says(&[&state(at_goods), TRUTH]);
    page.wait_until("document.querySelector('#map .robot').getAttribute('transform').startsWith('translate(750.0 ')");
    let apart = format!(
        "(() => {{ {BOXES} return !boxes('.robot .hull').some((robot) => boxes('.good > rect').some((good) => meets(robot, good))); }})()"
    );
    page.wait_until(&apart);
    // What it has in the claw is on the claw, and a dashed parcel is left behind.
    robot.says(&[&state(at_goods), TRUTH, "gone 1 2"]);
    page.wait_for("#map .robot .held text", "2");
    page.wait_until("document.querySelector('#map [data-product=\"2\"].gone') !== null");
    drop((page, robot));
    stage.end();
}

/// What may be wrong with letters and things on the map, as sentences.
const UNREADABLE: &str = "(() => { \
    const wrong = []; \
    const px = document.querySelector('#map').getScreenCTM().a; \
    const letters = boxes(':is(.axis, .name)'); \
    letters.forEach((one, at) => letters.slice(at + 1).forEach((other) => meets(one, other) && wrong.push(`letters touch ${one} ${other}`))); \
    for (const name of boxes('.name')) for (const good of boxes('.good > rect')) if (meets(name, good)) wrong.push('a name is over goods'); \
    for (const text of document.querySelectorAll('#map .axis')) { \
      const size = parseFloat(getComputedStyle(text).fontSize) * px; \
      if (Math.abs(size - 12) > 0.5) wrong.push(`letters of ${size} px`); \
    } \
    const tape = parseFloat(getComputedStyle(document.querySelector('#map .tape')).strokeWidth) * px; \
    if (Math.abs(tape - Math.max(2, 19 * px)) > 0.1) wrong.push(`tape of ${tape} px`); \
    const [hull] = boxes('.robot .hull'); \
    const long = Math.max(hull[2] - hull[0], hull[3] - hull[1]); \
    if (long < 22 || (280 * px > 30 && Math.abs(long - 280 * px) > 4)) wrong.push(`a robot of ${long} px`); \
    return wrong; })()";

#[test]
fn the_map_is_to_scale_and_can_be_read_from_2_to_20_squares() {
    for (squares, in_hand) in [(2, false), (2, true), (5, false), (20, false), (20, true)] {
        let mut floor =
            format!("size = [{squares}, {squares}]\nside_length_cm = 50\ndelivery = [0, 0]\n");
        for (id, x, name) in [(1, 0, "nails"), (12, 1, "bolts")] {
            floor += &format!(
                "[[product]]\nid = {id}\nname = \"{name}\"\nsquare = [{x}, 1]\nside = \"left\"\n"
            );
        }
        let stage = Stage::new(Some(&floor));
        let robot = stage.robot("r1", &[&state(WAITS), TRUTH]);
        let mut page = stage.page(&stage.url);
        page.wait_for("#link", " ms");
        let (width, height) = if in_hand { (360, 740) } else { (1280, 720) };
        page.dress("light", width, height, in_hand);
        page.wait_until(&format!(
            "document.querySelectorAll('#map .tape').length === {}",
            2 * squares + 4
        ));
        page.pause();
        page.pause();
        let unreadable = format!("(() => {{ {BOXES} return {UNREADABLE}; }})()");
        wait_for(
            &format!("{squares} squares, in the hand: {in_hand}"),
            || {
                // What is drawn of another size is as large as it should be one picture later.
                (page.value(&unreadable) == json!([])).then_some(())
            },
        );
        // A large warehouse shows fewer numbers and no names, a small one all of them.
        let count = |page: &mut Page, part: &str| {
            page.value(&format!("document.querySelectorAll('#map {part}').length"))
        };
        let numbers = count(&mut page, ".axis").as_u64().expect("a number") - 1;
        let all = 2 * (squares + 1);
        assert_eq!(numbers < all, squares == 20, "{numbers} of {all}");
        assert_eq!(count(&mut page, ".name") == 2, squares == 2 && !in_hand);
        // The scale bar is as long as it says.
        let bar = page.value(
            "document.querySelector('#map-scale span').getBoundingClientRect().width / \
             document.querySelector('#map').getScreenCTM().a",
        );
        let told = page.text("#map-scale");
        let metres: f64 = told.trim().trim_end_matches(" m").parse().expect("metres");
        let bar = bar.as_f64().expect("mm");
        assert!(
            (bar / 1_000.0 - metres).abs() < 0.05 * metres,
            "{bar} mm, {told}"
        );
        drop((page, robot));
        stage.end();
    }
}

#[test]
fn what_is_old_is_grey_and_keeps_its_shape_and_the_legend_says_what_all_of_it_is() {
    let stage = Stage::new(Some(FLOOR));
    let drives = state(
        "phase=driving next=1,2 order=8 product=1 x_mm=500 y_mm=600 heading_deg=0 node=1,1 looks=up unsure_mm=20",
    );
    let lists = [
        TRUTH,
        "route 1 1 2",
        "queue 1 9 3",
        "gone 1 2",
        "obstacles 1 1 0 right",
        "blocked 1 2 1 left 40",
    ];
    let robot = stage.robot("r1", &[&[drives.as_str()], &lists[..]].concat());
    let mut page = stage.page(&stage.url);
    page.wait_for("#map .label.flag text", "next 1,2");
    page.wait_for("#map .label.shut text", "blocked");
    // A bar is where something was put, a cross where the robot found no way.
    let shapes = "['.placed', '.blocked path', '.route', '.next circle', '.good.wanted', '.good.queued', '.good.gone', '.ghost .hull', '.robot .hull', '.limbs path'] \
        .map((part) => document.querySelectorAll(`#map ${part}`).length).join()";
    let before = wait_for("all of it on the map", || {
        let counts = page.value(shapes);
        let is_all = !counts.as_str()?.split(',').any(|count| count == "0");
        is_all.then_some(counts)
    });
    // The legend is closed until a person opens it, and then it covers no robot.
    assert_eq!(
        page.value("document.querySelector('#map-legend').open"),
        false
    );
    page.click("#map-legend summary");
    page.wait_for("#map-legend[open]", "where it really is");
    page.wait_until(&format!(
        "(() => {{ {BOXES} const {{ left, top, right, bottom }} = document.querySelector('#map-legend').getBoundingClientRect(); \
         return boxes('.robot .hull').every((robot) => !meets(robot, [left, top, right, bottom])); }})()"
    ));
    let colours = "(() => { const quiet = getComputedStyle(document.querySelector('#history')).color; \
        return [['.placed', 'fill'], ['.blocked path:not(.back)', 'stroke'], ['.route', 'stroke'], ['.next circle', 'stroke'], \
          ['.good.wanted rect', 'fill'], ['.good.queued rect', 'stroke'], ['.good.gone rect', 'stroke'], ['.ghost .hull', 'stroke'], \
          ['.robot .hull', 'fill'], ['.limbs path', 'stroke'], ['.trail', 'stroke'], ['.label.flag rect', 'fill'], ['.unsure', 'stroke']] \
          .filter(([part, name]) => getComputedStyle(document.querySelector(`#map ${part}`))[name] !== quiet).map(([part]) => part).join(); })()";
    assert!(
        page.value(colours).as_str().expect("parts").len() > 50,
        "all of it has its colour"
    );
    drop(robot);
    page.wait_for("#state", "r1 is not heard");
    page.wait_until(&format!("{colours} === ''"));
    assert_eq!(page.value(shapes), before);
    drop(page);
    stage.end();
}
