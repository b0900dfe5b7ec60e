//! Tests every way to let go of a held control: the robot stands in time, by one zero, and then the
//! page is silent.

use lager_home::Clock;
use lager_ports::Subscriber;
use lager_tests::wait_for;
use lager_topics::SteeringState;
use serde_json::json;

use crate::Scene;
use crate::browser::Page;

/// The longest time that a robot may drive on after a release, in ms of its clock. At this speed
/// that is also the clock of the stamps.
const RELEASE_MS: f64 = 200.0;
/// The greatest age of a value that a page shows as current, in ms.
const STALE_MS: f64 = 500.0;
/// How many times a way is tried, because this machine may be held up in one try. A way that does
/// not end a hold fails in each try.
const TRIES: usize = 3;

/// How to press or release: an expression of the page, or a step of the browser itself.
enum By {
    Script(&'static str),
    Browser(fn(&mut Page)),
}

impl By {
    fn go(&self, page: &mut Page) {
        match self {
            Self::Script(script) => drop(page.value(script)),
            Self::Browser(go) => go(page),
        }
    }
}

/// A point of the page without a control, in pixels.
const AWAY: (f64, f64) = (3.0, 3.0);
const KEY: By = By::Browser(|page| page.key_down("ArrowLeft"));
const ENTER: By = By::Browser(|page| {
    page.value("document.querySelector('#pad-left').focus()");
    let params = json!({ "type": "rawKeyDown", "key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13 });
    page.call("Input.dispatchKeyEvent", &params);
});
const KEYPAD: By = By::Browser(|page| keypad(page, "keyDown", "ArrowLeft"));
const POINTER: By = By::Browser(|page| {
    let at = page.middle("#pad-left");
    page.mouse("mousePressed", at);
});
const STICK: By = By::Script("pad.axes = [-1, 0]");

/// The name of each way, how the test holds, and how it lets go.
const WAYS: &[(&str, By, By)] = &[
    ("key up", KEY, By::Browser(|page| page.key_up("ArrowLeft"))),
    (
        "another window",
        KEY,
        By::Script("dispatchEvent(new Event('blur'))"),
    ),
    (
        "page hidden for good",
        KEY,
        By::Script("dispatchEvent(new Event('pagehide'))"),
    ),
    (
        "another tab",
        KEY,
        By::Script(
            "Object.defineProperty(document, 'hidden', { value: true, configurable: true }); \
             document.dispatchEvent(new Event('visibilitychange')); delete document.hidden",
        ),
    ),
    (
        "a menu of the browser's",
        KEY,
        By::Script(
            "document.body.dispatchEvent(new MouseEvent('contextmenu', { bubbles: true, cancelable: true }))",
        ),
    ),
    (
        "a list that had the focus before",
        KEY,
        By::Script(
            "document.querySelector('#robot').dispatchEvent(new PointerEvent('pointerdown', { bubbles: true }))",
        ),
    ),
    (
        "a choice in a dialog",
        KEY,
        By::Script(
            "document.querySelector('#where [type=radio]').dispatchEvent(new FocusEvent('focusin', { bubbles: true }))",
        ),
    ),
    (
        "Num Lock, then key up",
        KEYPAD,
        By::Browser(|page| keypad(page, "keyUp", "4")),
    ),
    (
        "the box that arms",
        KEY,
        By::Script("document.querySelector('#armed').click()"),
    ),
    (
        "a text field",
        KEY,
        By::Script(
            "document.querySelector('#filter').dispatchEvent(new FocusEvent('focusin', { bubbles: true }))",
        ),
    ),
    (
        "a key of the window",
        KEY,
        By::Script("dispatchEvent(new KeyboardEvent('keydown', { key: 'Tab', altKey: true }))"),
    ),
    (
        "another view",
        KEY,
        By::Script("document.querySelector('#tab-drive').click()"),
    ),
    (
        "a button's key up",
        ENTER,
        By::Browser(|page| page.key_up("Enter")),
    ),
    ("the focus leaves the button", ENTER, By::Browser(Page::tab)),
    (
        "the key comes up elsewhere",
        ENTER,
        By::Script(
            "document.querySelector('#tab-log').dispatchEvent(new KeyboardEvent('keyup', \
             { key: 'Enter', bubbles: true }))",
        ),
    ),
    (
        "pointer up",
        POINTER,
        By::Browser(|page| page.mouse("mouseReleased", AWAY)),
    ),
    (
        "pointer lost",
        POINTER,
        By::Script(
            "document.querySelector('#pad-left').dispatchEvent(new PointerEvent('pointercancel'))",
        ),
    ),
    ("stick back", STICK, By::Script("pad.axes = [0, 0]")),
    ("gamepad gone", STICK, By::Script("window.pad = null")),
];

/// The keypad's 4, by its name with Num Lock.
fn keypad(page: &mut Page, kind: &str, key: &str) {
    let params = json!({ "type": kind, "key": key, "code": "Numpad4", "location": 3 });
    page.call("Input.dispatchKeyEvent", &params);
}

/// The time from `from_ns` until the board's first report that the motors stand, in ms.
fn stands(reports: &mut Subscriber<SteeringState>, from_ns: u64) -> f64 {
    wait_for("the motors to stand", || {
        let report = reports.receive().expect("readable")?;
        let at = report.stamp().publish_time_ns;
        let stand = (report.left_duty, report.right_duty) == (0, 0);
        (at > from_ns && stand).then(|| (at - from_ns) as f64 / 1e6)
    })
}

/// Releases all controls.
fn let_all_go(page: &mut Page) {
    for key in ["ArrowLeft", "Enter"] {
        page.key_up(key);
    }
    page.mouse("mouseReleased", AWAY);
    page.value(
        "window.pad = { mapping: 'standard', axes: [0, 0], buttons: [] }; \
         navigator.getGamepads = () => [window.pad]; document.activeElement.blur(); \
         document.querySelector('#armed').checked || document.querySelector('#armed').click()",
    );
    page.pause();
}

/// Holds until the robot moves by it; if the order is refused, takes hold again.
fn take_hold(scene: &mut Scene, page: &mut Page, hold: &By) {
    wait_for("the robot to be driven", || {
        page.moves();
        hold.go(page);
        for _ in 0..100 {
            if scene.moves() == Some(true) && page.text("#drive-said").is_empty() {
                return Some(());
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let_all_go(page);
        None
    });
}

/// The page ignores gamepads until the box is ticked; a stick bent at that time must first be
/// released.
fn a_stick_held_before_drives_nothing(page: &mut Page) {
    page.value(
        "document.querySelector('#armed').click(); pad.axes = [-1, 0]; window.looks = 0; \
         navigator.getGamepads = () => { window.looks += 1; return [window.pad]; }",
    );
    page.pause();
    assert_eq!(page.value("looks"), 0);
    page.moves();
    page.value("document.querySelector('#armed').click()");
    std::thread::sleep(std::time::Duration::from_secs(1));
    assert_ne!(page.value("looks"), 0);
    assert_eq!(page.moves(), [""; 0]);
    let_all_go(page);
}

pub(crate) fn each_way_to_let_go_ends_it_in_time_by_one_zero_and_then_silence(
    scene: &mut Scene,
    page: &mut Page,
) {
    scene.arm(page);
    page.listen_in();
    let mut reports = scene.bus.subscriber::<SteeringState>().expect("a topic");
    let_all_go(page);
    a_stick_held_before_drives_nothing(page);
    for (name, hold, release) in WAYS {
        let mut times = Vec::new();
        while times.len() < TRIES && times.iter().all(|ms| *ms > RELEASE_MS) {
            take_hold(scene, page, hold);
            while reports.receive().expect("readable").is_some() {}
            assert!(!page.moves().is_empty(), "{name}");
            let from = Clock::monotonic_ns();
            release.go(page);
            let ms = stands(&mut reports, from);
            page.pause();
            // A command from before the release may come first.
            let mut said = page.moves();
            said.retain(|line| line != "drive 6");
            // If its machine is held up, the robot refuses, which also ends a hold.
            if page.text("#drive-said").is_empty() {
                assert_eq!(said, ["drive 1"], "{name}");
                times.push(ms);
            }
            page.pause();
            assert_eq!(page.moves(), [""; 0], "{name}: silence");
            let_all_go(page);
        }
        let quickest = times.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(quickest <= RELEASE_MS, "{name}: {times:.0?} ms");
        scene.assert_stands();
    }

    // The shown state grows old, though the page's messages still reach the robot.
    let times = until_quick(STALE_MS + RELEASE_MS, || {
        take_hold(scene, page, &KEY);
        while reports.receive().expect("readable").is_some() {}
        let from = Clock::monotonic_ns();
        page.value("window.hears = tapped.onmessage; tapped.onmessage = null; window.sent = []");
        let ms = stands(&mut reports, from);
        assert!(ms > STALE_MS - 100.0, "it was not old yet: {ms:.0} ms");
        page.pause();
        let mut said = page.moves();
        said.retain(|line| line != "drive 6");
        assert_eq!(said, ["drive 1"]);
        page.value("tapped.onmessage = hears");
        page.wait_until("!document.body.classList.contains('stale')");
        let_all_go(page);
        ms
    });
    assert!(times.is_ok(), "a state that is old: {times:.0?} ms");

    // The socket is gone, so the page cannot send a zero.
    let times = until_quick(RELEASE_MS, || {
        take_hold(scene, page, &KEY);
        while reports.receive().expect("readable").is_some() {}
        let from = Clock::monotonic_ns();
        page.value("window.sent = []; tapped.close()");
        let ms = stands(&mut reports, from);
        page.wait_for("#control", "Nobody drives");
        page.wait_until("!document.querySelector('#control').disabled");
        assert_eq!(page.moves(), [""; 0]);
        let_all_go(page);
        scene.assert_stands();
        page.click("#control");
        page.wait_for("#control", "You drive");
        page.value("document.activeElement.blur()");
        ms
    });
    assert!(times.is_ok(), "a socket that is gone: {times:.0?} ms");
}

/// Tries until it takes at most `most_ms`; `Err` has the times of all tries.
fn until_quick(most_ms: f64, mut go: impl FnMut() -> f64) -> Result<(), Vec<f64>> {
    let mut times = Vec::new();
    while times.len() < TRIES {
        times.push(go());
        if times.last() <= Some(&most_ms) {
            return Ok(());
        }
    }
    Err(times)
}
