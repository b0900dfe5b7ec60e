//! Tests that a robot which needs a person says so to one who looks elsewhere, by words and by a
//! sound, and that the remedy is a button beside the sentence that names it.

use serde_json::json;

use crate::browser::Page;
use crate::played::Stage;

const FLOOR: &str = "size = [2, 2]\nside_length_cm = 50\ndelivery = [0, 0]\n";
const WELL: &str = "state hold=none mode=autonomous stopped=0 sensor_up=1 steering_up=1 \
     phase=waiting_for_order x_mm=500 y_mm=500 heading_deg=0 node=1,1";
const STUCK: &str = "state hold=none mode=autonomous stopped=0 sensor_up=1 steering_up=1 \
     phase=stuck x_mm=500 y_mm=500 heading_deg=0 node=1,1 failure=line_lost failure_node=1,1 \
     failure_expected=0 failure_seen=80 remedy=reset";

/// Keeps the messages of the page in `messages`, as a browser shows them.
const MESSAGES: &str = "window.messages = []; window.Notification = class { \
     static permission = 'granted'; static requestPermission() {} \
     constructor(name, { body }) { window.messages.push(`${name}: ${body}`); } }; true";

#[test]
fn whoever_looks_elsewhere_is_told_by_title_and_message_and_a_button_does_the_remedy() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[WELL]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#doing", "waits for an order");
    assert_eq!(page.value("document.title"), "Lagerrobot");
    page.wait_until("document.querySelector('#remedy').hidden");
    page.value(MESSAGES);
    // Nobody has asked for messages yet: the title says it alone.
    robot.says(&[STUCK]);
    page.wait_until("document.title.startsWith('! r1: is stuck')");
    robot.says(&[WELL]);
    page.wait_until("document.title === 'Lagerrobot'");
    page.click("#tab-log");
    page.click("#notify");
    robot.says(&[STUCK]);
    page.wait_until("window.messages.length > 0");
    let told = page.value("window.messages.join()");
    let told = told.as_str().expect("words");
    assert!(
        told.starts_with("r1: is stuck and needs a person") && told.contains("The line is lost"),
        "{told}"
    );
    page.wait_for("#more", "say where it stands");
    page.wait_for("#remedy", "Say where it stands");
    page.click("#remedy");
    page.wait_until("document.querySelector('#where').open");
    // The wish outlives the page, and one need is told once.
    assert_eq!(page.value("window.messages.length"), 1);
    assert_eq!(page.value("localStorage.getItem('notify')"), "yes");
    drop(page);
    let mut viewer = stage.page(&stage.viewer);
    viewer.wait_until("!document.querySelector('#remedy').hidden");
    viewer.wait_until("document.querySelector('#remedy').disabled");
    drop((viewer, robot));
    stage.end();
}

/// Keeps each tone that would be heard in `tones`: its length in s. A page may sound only after a
/// person has pressed something on it.
const TONES: &str = "window.tones = []; \
     window.AudioContext = class { state = 'suspended'; currentTime = 7; destination = {}; \
       resume() { this.state = 'running'; } }; \
     window.OscillatorNode = class { \
       constructor(audio, { frequency }) { Object.assign(this, { audio, frequency }); } \
       connect(to) { this.isHeard = to === this.audio.destination; } \
       start() { this.isOn = this.audio.state === 'running' && this.frequency > 0; } \
       stop(at) { if (this.isOn && this.isHeard) tones.push(at - this.audio.currentTime); } }; true";

#[test]
fn a_need_sounds_once_and_only_for_who_wants_it() {
    let stage = Stage::new(Some(FLOOR));
    let robot = stage.robot("r1", &[WELL]);
    let mut page = stage.page(&stage.url);
    page.wait_for("#doing", "waits for an order");
    page.value(TONES);
    page.click("#tab-log");
    // Longer than a need that passes by itself, by the page's own time.
    let rest = |page: &mut Page| {
        let began = page.value("performance.now()");
        page.wait_until(&format!("performance.now() - {began} > 3000"));
    };
    let needs = |page: &mut Page| {
        robot.says(&[STUCK]);
        page.wait_until("document.title.startsWith('! r1: is stuck')");
        rest(page);
        robot.says(&[WELL]);
        page.wait_until("document.title === 'Lagerrobot'");
        page.value("window.tones.map((length) => length > 0.1 && length < 1)")
    };
    assert_eq!(needs(&mut page), json!([]), "nobody has asked for it");
    page.click("#notify");
    assert_eq!(needs(&mut page), json!([true]));
    assert_eq!(needs(&mut page), json!([true, true]));
    page.click("#notify");
    assert_eq!(needs(&mut page), json!([true, true]), "no more");
    drop((page, robot));
    stage.end();
}
