//! Tests of how fast a person drives: what each command says, and how fast the robot then is.

use std::time::Duration;

use lager_tests::wait_for;
use serde_json::json;

use crate::Scene;
use crate::browser::Page;

/// The word of the speed that is chosen.
const CHOSEN: &str = "document.querySelector('#speed [aria-pressed=true]').dataset.word";

/// The page's messages while something is held, without repetitions.
fn said(page: &mut Page) -> Vec<String> {
    std::thread::sleep(Duration::from_millis(200));
    let mut said = page.moves();
    said.dedup();
    said
}

pub(crate) fn each_command_says_the_speed_that_is_chosen_and_another_one_counts_at_once(
    scene: &mut Scene,
    page: &mut Page,
) {
    page.value("document.querySelector('#tab-drive').click()");
    assert_eq!(page.value(CHOSEN), "middle", "nothing was ever chosen");
    scene.take_over(page);
    page.click("#speed-middle");
    page.click("#armed");
    page.value("document.activeElement.blur()");
    page.listen_in();

    // If a command was held up, it is refused and ends the hold; then a person begins again.
    wait_for("one hold at three speeds", || {
        page.moves();
        page.key_down("ArrowUp");
        let mut heard = said(page);
        for choice in ["c", "#speed-full_speed"] {
            match choice.starts_with('#') {
                true => page.click(choice),
                false => page.key_down(choice),
            }
            heard.extend(said(page));
            page.key_up("c");
        }
        page.key_up("ArrowUp");
        heard.extend(said(page));
        heard.dedup();
        let lines = ["drive 2 middle", "drive 2 slow", "drive 2", "drive 1"];
        (heard == lines).then_some(())
    });

    // Following the line has a speed of its own.
    page.key_down("c");
    page.key_up("c");
    assert_eq!(page.value(CHOSEN), "slow");
    wait_for("the line to be followed", || {
        page.moves();
        page.value("document.querySelector('#pad-follow_forward').focus()");
        page.key_down("Enter");
        let heard = said(page);
        page.key_up("Enter");
        (heard.first()? == "drive 3").then_some(())
    });

    // The browser keeps the choice. Unarmed, the keys are the page's.
    page.call("Page.reload", &json!({}));
    page.wait_for("#link", " ms");
    page.value("document.querySelector('#tab-drive').click()");
    assert_eq!(page.value(CHOSEN), "slow");
    page.key_down("e");
    page.key_up("e");
    assert_eq!(page.value(CHOSEN), "slow");
    scene.wait_to_stand();
}

/// How far the robot drives in a second and a half of its own time while a key is held, in mm/s.
fn mm_per_s(scene: &mut Scene, page: &mut Page, key: &str) -> f64 {
    const SPAN_NS: u64 = 1_500_000_000;
    let speed = wait_for("a hold that nothing ends", || {
        scene.hold(page, key);
        let mut from: Option<(u64, f64, f64)> = None;
        let (ns, way) = wait_for("the way", || {
            let truth = scene.truth.latest().expect("readable")?;
            let (began, x, y) = *from.get_or_insert((truth.time_ns, truth.x_mm, truth.y_mm));
            let ns = truth.time_ns - began;
            let way = (truth.x_mm - x).hypot(truth.y_mm - y);
            (ns >= SPAN_NS).then_some((ns, way))
        });
        let is_held = page.text("#drive-said").is_empty();
        page.key_up(key);
        is_held.then_some(way / (ns as f64 / 1e9))
    });
    scene.wait_to_stand();
    speed
}

pub(crate) fn slow_is_slower_than_middle_and_middle_slower_than_full(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    let mut speeds = Vec::new();
    for (choice, key) in [("c", "ArrowUp"), ("d", "ArrowDown"), ("e", "ArrowUp")] {
        page.key_down(choice);
        page.key_up(choice);
        speeds.push(mm_per_s(scene, page, key));
    }
    let [slow, middle, full] = speeds[..] else {
        panic!("three speeds");
    };
    println!("slow {slow:.0}, middle {middle:.0}, full {full:.0} mm/s");
    assert!(slow > 5.0, "it moves: {slow:.0} mm/s");
    assert!(middle > 1.4 * slow && full > 1.4 * middle, "{speeds:.0?}");
}
