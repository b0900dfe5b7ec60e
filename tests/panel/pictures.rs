//! Pictures of the panel's views: each in both themes, on a laptop and in the hand.

use std::path::PathBuf;

use crate::Scene;
use crate::browser::Page;

/// Name, width and height in pixels, whether it is in the hand.
const SCREENS: [(&str, u32, u32, bool); 2] =
    [("laptop", 1280, 720, false), ("phone", 360, 740, true)];

/// Takes one view as it is now.
fn view(page: &mut Page, name: &str) {
    let folder = PathBuf::from(std::env::var_os("LAGER_PICTURES").expect("LAGER_PICTURES"));
    for (screen, width, height, in_hand) in SCREENS {
        for theme in ["light", "dark"] {
            page.dress(theme, width, height, in_hand);
            page.pause();
            let file = folder.join(format!("{name}-{screen}-{theme}.png"));
            std::fs::write(&file, page.picture()).expect("a folder that can be written to");
        }
    }
    page.dress("light", 1280, 720, false);
}

#[test]
#[ignore = "it makes pictures: tests/screenshots"]
fn of_every_view() {
    let mut scene = Scene::new(1.0, &["--warehouse", "small"]);
    let mut page = scene.page();
    scene.wait_to_move();
    page.click_at_mm(0.0, 750.0);
    page.wait_for("#map-said", "obstacle put");
    page.value("document.querySelector('#goods').value = '2'");
    page.click("#fetch button");
    view(&mut page, "under-way");
    for tab in ["setup", "log"] {
        page.click(&format!("#tab-{tab}"));
        view(&mut page, tab);
    }
    page.click("#tab-missions");
    page.wait_for("#doing", "stands at the goods");
    view(&mut page, "picking");
    page.key_down("Escape");
    page.key_up("Escape");
    page.wait_for("#stop-said", "both boards stand");
    view(&mut page, "stopped");
    scene.resume();
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");
    view(&mut page, "blocked");
    scene.take_over(&mut page);
    view(&mut page, "by-hand");
    let mut other = scene.page();
    other.click("#tab-drive");
    view(&mut other, "another-drives");
    page.value("location.href = '/screen'");
    page.wait_until("document.querySelector('.screen #doing')?.textContent.length > 0");
    view(&mut page, "screen");
    drop((page, other));
    scene.end();
}
