//! A person who has only the browser finds out how a robot is built: *Set up a robot*. The robot is a
//! simulated one that differs in everything, and the test is the person's hands and eyes.

mod person;

use std::fs;

use lager_commission::sentences;
use lager_plant::{ArmBuild, Build, Ranger};
use lager_ports::Bus;
use lager_tests::{Domain, children, pid, wait_for};
use lager_topics::{EventKind, LinkHealth, MissionEvent, Role};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::keyboard::press;
use crate::played::Stage;
use crate::scene::Scene;
use person::{Person, does, let_logic_drive, open};

/// A robot that differs in everything; its battery is not measured.
fn other() -> (u64, Build) {
    let builds = (1..).map(|seed| (seed, Build::drawn(seed)));
    let mut other = builds.filter(|(_, build)| {
        let parts = [build.swapped, build.dark_is_low, !build.divider];
        parts == [true; 3] && build.reversed == [true, false] && build.ranger == Ranger::Gp2y0a02
    });
    other.next().expect("one in a hundred")
}

/// A robot that is built otherwise and that nobody has described, with its panel, and the words of
/// its configuration for a command. Which servos its arm has stands there, and no more of them.
fn unknown() -> (Scene, String) {
    let (built, build) = other();
    let domain = Domain::new();
    let [config, robot] = ["lager.toml", "robot.toml"].map(|name| domain.folder().join(name));
    fs::write(&robot, arm(&build.arm)).expect("a file");
    let text = format!(
        "robot = {:?}\n[simulator]\nbuilt = {built}\n",
        robot.display().to_string()
    );
    fs::write(&config, text).expect("a file");
    let config = config.display().to_string();
    (Scene::on(domain, 1.0, &["--config", &config]), config)
}

/// What a person who knows the servos of the arm has written of them.
fn arm(build: &ArmBuild) -> String {
    let names = [
        "base", "shoulder", "", "elbow", "", "wrist", "rotation", "gripper",
    ];
    let (mut servos, mut reversed) = (String::new(), String::new());
    for (index, name) in names
        .iter()
        .enumerate()
        .filter(|(_, name)| !name.is_empty())
    {
        let id = |index: usize| build.ids.get(index).copied().flatten();
        let first = id(index).expect("every joint has a first servo");
        let second = id(index + 1).filter(|_| ["shoulder", "elbow"].contains(name));
        servos += &match second {
            Some(second) => format!("{name} = [{first}, {second}]\n"),
            None => format!("{name} = {first}\n"),
        };
        reversed += &format!("{name} = {}\n", build.reversed[index]);
    }
    format!("[arm.servos]\n{servos}[arm.reversed]\n{reversed}")
}

/// A sentence of the robot's table in Swedish.
fn swedish(name: &str) -> &'static str {
    let mut all = sentences().filter(|sentence| sentence.name == name);
    all.next().expect("it is there").swedish
}

#[test]
fn a_robot_that_nobody_described_is_set_up_by_clicks_and_delivers() {
    let (mut scene, _) = unknown();
    let log = scene
        .domain
        .start(&["topic", "echo", "log/thought", "--json"]);
    let mut person = Person::new(&scene, other().1.buttons);
    person.begin();
    let (mut was_reloaded, mut was_stopped) = (false, false);
    loop {
        let question = person.asked();
        match question.as_str() {
            // The page goes away in the middle, and the person comes back and goes on.
            "ask_range_far" if !was_reloaded => {
                was_reloaded = true;
                let text = person.page.text("#commission .question");
                assert!(text.starts_with("Distance sensor: hold"), "{text}");
                person.page.change_language();
                person
                    .page
                    .wait_for("#commission .question", swedish("ask_range_far"));
                person
                    .page
                    .wait_for("#commission [data-does=skip]", swedish("page_skip"));
                person.page.change_language();
                person.page.wait_for(
                    "#commission .found, #commission .steps",
                    "read low over dark tape",
                );
                person.page.call("Page.reload", &json!({}));
                person.page.wait_for("#link", " ms");
                open(&mut person.page);
                // Nobody answers who has not the wheel.
                person
                    .page
                    .wait_until("document.querySelector('#commission [data-does=take]') !== null");
                does(&mut person.page, "take");
                person.answered.clear();
            }
            // A stop ends the movement and its step, and nothing goes on by itself.
            "ask_turn_round" if !was_stopped => {
                was_stopped = true;
                scene.wait_to_move();
                press(&mut person.page, "Escape");
                person.page.wait_for("#stop-said", "both wheels stand");
                scene.assert_stands();
                person.page.wait_for(
                    "#commission .why",
                    "The step begins anew, and the robot stands",
                );
                assert_eq!(person.asked(), "ask_turn");
                person.yes();
                person.page.wait_for("#commission .why", "stop");
                scene.assert_stands();
                scene.resume();
                person
                    .page
                    .wait_until("!document.body.classList.contains('stopped')");
            }
            question => {
                if person.answer(question) {
                    break;
                }
            }
        }
    }
    assert!(was_reloaded && was_stopped);
    let page = &mut person.page;
    page.wait_for("#commission .question", "robot.toml has it");
    wait_for("the log to name who has set it up", || {
        log.output().contains("SetUpAtPage").then_some(())
    });
    drop(log);
    page.wait_for("#commission .steps", "A full turn takes");
    page.wait_for("#commission .steps", "Nothing measures the battery");
    // The file can be carried to another machine.
    let folder = scene.domain.folder().join("carried");
    fs::create_dir(&folder).expect("a folder");
    page.save_into(&folder);
    does(page, "save");
    let kept = folder.join("robot.toml");
    let saved = wait_for("the file", || {
        let text = fs::read_to_string(&kept).ok()?;
        text.ends_with('\n').then_some(text)
    });
    let written = fs::read_to_string(scene.domain.folder().join("robot.toml"));
    assert_eq!(saved.trim_end(), written.expect("the file").trim_end());
    for line in [
        "swapped = true",
        "left_reversed = true",
        "right_reversed = false",
        "dark_is_high = false",
        "model = \"gp2y0a02\"",
        "divider = false",
    ] {
        assert!(saved.contains(line), "{line}\n{saved}");
    }
    // A button starts it again: it stands stopped on the delivery node, and logic uses what was saved.
    let Person {
        mut page, hands, ..
    } = person;
    drop(hands);
    let before = scene.up.service("bridge").expect("it runs");
    does(&mut page, "restart");
    page.wait_until("document.body.dataset.look === 'stopped'");
    let bus = wait_for("the robot to start again", || {
        let bridge = scene
            .up
            .service("bridge")
            .filter(|bridge| *bridge != before);
        bridge.and_then(|_| Bus::open(&scene.domain.bus("r1", 1.0), Role::Operator).ok())
    });
    scene.truth = bus.subscriber().expect("a topic");
    scene.bus = bus;
    scene.assert_stands();
    let_logic_drive(&scene.bus, other().1.buttons);
    let mut events = scene.bus.subscriber::<MissionEvent>().expect("a topic");
    scene.resume();
    scene.domain.done(&["mode", "autonomous"]);
    // Its order has outlived the new start.
    wait_for("goods 1 to be delivered", || {
        let event = events.receive().expect("readable")?;
        (event.kind == EventKind::ItemDelivered && event.product == 1).then_some(())
    });
    page.close();
    drop(events);
    scene.end();
}

#[test]
fn whoever_dies_in_the_middle_the_robot_stands_and_its_boards_are_as_they_were() {
    let (scene, config) = unknown();
    let mut health = scene.bus.subscriber::<LinkHealth>().expect("a topic");
    let mut described = |what: &str, is_it: &dyn Fn(u32) -> bool| {
        wait_for(what, || {
            let described = health.latest().expect("readable")?.description;
            (described != 0 && is_it(described)).then_some(described)
        })
    };
    let before = described("the boards", &|_| true);
    let mut person = Person::new(&scene, other().1.buttons);
    // The process that commissions is killed, and then comm, whose child it is.
    for whose in ["commissioning", "comm"] {
        person.begin();
        person.answered.clear();
        person.until("ask_range_far");
        described("a trial", &|now| now != before);
        let comm = scene.up.service("comm").expect("it runs");
        let works = wait_for("its process", || children(comm).first().copied());
        // Another one is refused meanwhile.
        let second = scene.domain.run(&["commission", "--config", &config]);
        let said = String::from_utf8_lossy(&second.stderr).into_owned();
        assert!(
            !second.status.success() && said.contains(&format!("process {works}")),
            "{said}"
        );
        let killed = if whose == "comm" { comm } else { works };
        kill_process(pid(killed), Signal::KILL).expect("it runs");
        described("what was before", &|now| now == before);
        person
            .page
            .wait_until("document.querySelector('#commission [data-does=begin]') !== null");
    }
    // The page is closed: the robot is given back.
    person.begin();
    person.answered.clear();
    person.until("ask_range_far");
    described("a trial", &|now| now != before);
    let Person { page, hands, .. } = person;
    page.close();
    described("what was before", &|now| now == before);
    let kept = fs::read_to_string(scene.domain.folder().join("robot.toml"));
    assert_eq!(
        kept.expect("the file"),
        arm(&other().1.arm),
        "nothing is written"
    );
    drop((hands, health));
    scene.end();
}

/// What a robot tells that is in the middle of it.
pub(crate) const AT_WORK: [&str; 3] = [
    "state time_ms=64000 hold=undescribed remedy=describe mode=manual pick=auto stopped=0 \
     phase=waiting_for_order line_bits=00001110000 sensor_up=1 steering_up=1 left_duty=0 right_duty=0",
    "commission asked=5 step=line place=2 steps=8 question=ask_line_tape takes=yes moves=0 \
     shows=live_line%20----###---- why=ended%20line_mixed%201,%202",
    "found 1 boards found_polarity_low",
];

#[test]
fn the_reason_why_it_stands_leads_there_and_keys_alone_answer() {
    let stage = Stage::new(None);
    let robot = stage.robot("r1", &AT_WORK);
    let mut page = stage.page(&stage.url);
    page.wait_for("#state", "obody has said how this robot is built");
    assert_eq!(page.text("#remedy"), "Set up a robot");
    page.click("#remedy");
    page.wait_for("#commission h2", "Line sensors");
    page.wait_for("#commission .why", "counted from the left: 1, 2");
    page.wait_until("document.querySelectorAll('#commission .on').length === 3");
    assert_eq!(
        page.text("#commission .steps [aria-current] strong"),
        "Line sensors"
    );
    page.click("#commission [data-does=take]");
    page.wait_until(
        "document.querySelector('#commission .answers [data-does=yes]:not(:disabled)') !== null",
    );
    page.listen_in();
    // It is answered by Enter, once however long that is held, and Space stops the robot.
    page.value("document.querySelector('#commission [data-does=yes]').focus()");
    crate::keyboard::hold_down(&mut page, "Enter");
    let answers = "sent.filter((line) => line.includes('answer 5 yes')).length";
    page.wait_until(&format!("{answers} === 1"));
    page.pause();
    assert_eq!(page.value(answers), 1);
    // Whoever is there says so, and a hidden view does not.
    page.wait_until("sent.some((line) => line.endsWith('commission here'))");
    page.click("#tab-missions");
    page.value("sent.length = 0");
    page.pause();
    page.pause();
    assert_eq!(
        page.value("sent.some((line) => line.includes('commission'))"),
        false
    );
    // A number and the ways of the wheels are chosen, and a movement has its own button to stand.
    open(&mut page);
    let asks = |how: &str| {
        let how = format!("commission step=wheels place=4 steps=8 {how}");
        robot.says(&[AT_WORK[0], &how, AT_WORK[2]]);
    };
    asks("asked=6 question=ask_saw_ahead takes=ways moves=0");
    page.wait_for("#commission .question", "which way the right ones?");
    page.wait_until("document.querySelector('#commission [name=left]:not(:disabled)') !== null");
    page.click("#commission [name=left][value=f]");
    page.click("#commission [name=right][value='0']");
    page.click("#commission [data-does=set]");
    page.wait_until("sent.some((line) => line.endsWith('commission answer 6 f0'))");
    asks("asked=7 question=ask_turn_round takes=yes moves=1");
    page.wait_until("document.querySelector('#commission [data-does=stand]') !== null");
    page.click("#commission [data-does=stand]");
    page.wait_until("sent.some((line) => line.endsWith('commission stand'))");
    // What this page does not know yet is answered in a field.
    asks("asked=8 question=ask_something_new takes=joint moves=0");
    page.wait_for("#commission .question", "ask_something_new");
    page.wait_until("document.querySelector('#commission .answers input:not(:disabled)') !== null");
    page.fill("#commission .answers input", "3");
    page.click("#commission [data-does=set]");
    page.wait_until("sent.some((line) => line.endsWith('commission answer 8 3'))");
    drop((page, robot));
    stage.end();
}

/// The arm is described, and nothing of it is found out here: only its joints are tried.
#[test]
fn a_joint_moves_only_while_its_button_is_held_by_mouse_or_key_and_never_after_a_stop() {
    let (mut scene, _) = unknown();
    let mut person = Person::new(&scene, other().1.buttons);
    person.begin();
    person.answered.clear();
    person.until("ask_joint_moves");
    let about = person.page.text("#commission .question");
    assert!(about.starts_with("Base, to the "), "{about}");
    let button = "#commission .answers [data-does=hold]:not(:disabled)";
    let at = person.page.middle(button);
    for way in ["mouse", "key"] {
        let before = person.servos();
        match way {
            "mouse" => person.page.mouse("mousePressed", at),
            _ => {
                let focus = format!("document.querySelector('{button}').focus()");
                person.page.value(&focus);
                person.page.key_down("Enter");
            }
        }
        wait_for("the joint to move", || {
            (person.servos() != before).then_some(())
        });
        match way {
            "mouse" => person.page.mouse("mouseReleased", at),
            _ => person.page.key_up("Enter"),
        }
        person.assert_arm_stands();
    }
    // Somebody stops the robot while the button is down.
    let before = person.servos();
    person.page.mouse("mousePressed", at);
    wait_for("the joint to move", || {
        (person.servos() != before).then_some(())
    });
    press(&mut person.page, "Escape");
    person.page.wait_for("#stop-said", "both wheels stand");
    person.assert_arm_stands();
    person.page.mouse("mouseReleased", at);
    person.assert_arm_stands();
    scene.resume();
    scene.assert_stands();
    person.assert_arm_stands();
    drop(person);
    scene.end();
}
