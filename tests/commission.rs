//! A robot that nobody has described is commissioned by `lager commission`, with a person's hands in
//! the simulated world, and delivers after a restart.

#[path = "commission/person.rs"]
mod person;

use std::fs;
use std::process::{ChildStdin, Stdio};

use lager_commission::Question;
use lager_orders::{Level, Mode, SwitchKind};
use lager_plant::{Build, ButtonsBuild, ContactBuild, Ranger};
use lager_ports::{Bus, Client};
use lager_tests::{Domain, Running, WATCHDOG, wait_for};
use lager_topics::{LinkHealth, Role, WorldAsk, WorldAskKind, WorldRequest};
use person::{Person, let_logic_drive};
use rustix::process::Signal;

/// A robot that differs in everything; its battery is not measured, and its shoulder has one servo.
fn other() -> (u64, Build) {
    let builds = (1..).map(|seed| (seed, Build::drawn(seed)));
    let mut other = builds.filter(|(_, build)| {
        let parts = [build.swapped, build.dark_is_low, !build.divider];
        let arm = &build.arm;
        let joints = [
            arm.ids[2].is_none(),
            arm.ids[4].is_some(),
            arm.ids[0] != Some(1),
        ];
        parts == [true; 3]
            && build.reversed == [true, false]
            && build.ranger == Ranger::Gp2y0a02
            && joints == [true; 3]
            && build.buttons.reset.is_some()
            && is_high_button(&build.buttons)
            && arm.reversed[0] != arm.reversed[5]
    });
    other.next().expect("one in many thousands")
}

/// Whether the mode is a button that pulls its line high.
fn is_high_button(buttons: &ButtonsBuild) -> bool {
    buttons
        .mode
        .is_some_and(|(mode, kind)| kind == SwitchKind::Press && mode.contact.closed == Level::High)
}

/// A domain with a robot that is built otherwise, and its configuration.
fn unknown(built: u64) -> (Domain, String) {
    let domain = Domain::new();
    let [config, robot] = ["lager.toml", "robot.toml"].map(|name| domain.folder().join(name));
    fs::write(&robot, "").expect("a file");
    let text = format!(
        "robot = {:?}\n[simulator]\nbuilt = {built}\n",
        robot.display().to_string()
    );
    fs::write(&config, text).expect("a file");
    (domain, config.display().to_string())
}

/// The robot, by hand.
fn up(domain: &Domain, config: &str) -> Running {
    let up = domain.start(&["up", "--config", config, "--headless"]);
    wait_for("the manual mode", || {
        let done = domain.run(&["mode", "manual"]).status.success();
        done.then_some(())
    });
    up
}

#[test]
fn a_robot_that_nobody_described_is_commissioned_and_delivers_after_a_restart() {
    let (built, build) = other();
    let (domain, config) = unknown(built);
    let mut robot = up(&domain, &config);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Operator).expect("the bus opens");
    let log = domain.start(&["topic", "echo", "log/thought", "--json"]);
    let mut person = Person::new(&domain, &bus, &config, &build);
    person.commission();
    // The log names who has set it up.
    wait_for("the thought", || {
        let who = format!("\"seen\":{}", rustix::process::getuid().as_raw());
        let output = log.output();
        let mut lines = output.lines();
        lines
            .find(|line| line.contains("SetUpInTerminal") && line.contains(&who))
            .map(drop)
    });
    drop((person, log, bus));
    robot.signal(Signal::INT);
    // Whether it had a mission that failed is of no interest.
    robot.wait().expect("it ends");

    let said = domain.run(&["config", "--robot", "--config", &config]);
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    for line in [
        "swapped = true",
        "left_reversed = true",
        "right_reversed = false",
        "dark_is_high = false",
        "model = \"gp2y0a02\"",
        "divider = false",
        &format!("\nwrist = {}\n", build.arm.ids[5].expect("a wrist")),
        &format!("\nshoulder = {}\n", build.arm.ids[1].expect("a shoulder")),
        &format!("\nbase = {}\n", build.arm.reversed[0]),
        "chip = \"/dev/gpiochip0\"",
        &format!("\nreset = {}\n", line(build.buttons.reset)),
        &format!(
            "\nswitch = {}\n",
            line(build.buttons.mode.map(|(mode, _)| mode))
        ),
        "switch_kind = \"press\"",
        "switch_closed = \"high\"",
    ] {
        assert!(text.contains(line), "{line}: {build:?}\n{text}");
    }
    let mut robot = domain.start(&[
        "up",
        "--config",
        &config,
        "--headless",
        "--mission",
        "1",
        "--exit-when-done",
        "--json",
    ]);
    let bus = wait_for("the bus", || {
        Bus::open(&domain.bus("r1", 1.0), Role::Operator).ok()
    });
    let_logic_drive(&bus, build.buttons);
    drop(bus);
    assert_eq!(robot.wait(), Some(0), "{}\n{text}", robot.log());
    assert_eq!(robot.json()["delivered"], serde_json::json!([1]));
    its_mode_button_toggles_the_mode(&domain, &config);
    domain.assert_clean();
}

fn line(contact: Option<ContactBuild>) -> u8 {
    contact.expect("it has one").contact.line
}

/// The button of the simulated world goes the same way as one at a real line.
fn its_mode_button_toggles_the_mode(domain: &Domain, config: &str) {
    let mut robot = up(domain, config);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Operator).expect("the bus opens");
    let world: Client<WorldRequest> = bus.client().expect("a request");
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    for mode in [Mode::Autonomous, Mode::Manual] {
        for is_closed in [1, 0] {
            let press = WorldAsk {
                kind: WorldAskKind::Press.into(),
                x: 1,
                y: is_closed,
                ..WorldAsk::default()
            };
            wait_for("the world", || world.call(press, WATCHDOG / 100).ok());
            // As long as a finger takes; two presses are not one that bounces.
            std::thread::sleep(std::time::Duration::from_millis(300));
        }
        wait_for("the other mode", || {
            let health = health.latest().expect("readable")?;
            (health.mode == mode).then_some(())
        });
    }
    drop((world, health, bus));
    robot.signal(Signal::INT);
    // Whether it had a mission that failed is of no interest.
    robot.wait().expect("it ends");
}

#[test]
fn whoever_ends_it_early_leaves_the_file_and_the_boards_as_they_were() {
    let (built, build) = other();
    let (domain, config) = unknown(built);
    let mut robot = up(&domain, &config);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Operator).expect("the bus opens");
    let mut health = bus.subscriber::<LinkHealth>().expect("a topic");
    let mut described = |what: &str, is_it: &dyn Fn(u32) -> bool| {
        wait_for(what, || {
            let health = health.latest().expect("readable")?;
            let described = health.description;
            (described != 0 && is_it(described)).then_some(described)
        })
    };
    let before = described("the boards", &|_| true);
    let ends: [&dyn Fn(&mut Person); 3] = [
        &|person| person.say("quit"),
        &|person| {
            let process = lager_tests::pid(person.child.id());
            rustix::process::kill_process(process, Signal::INT).expect("it runs");
        },
        // Its terminal is gone.
        &|person| person.typing = closed(),
    ];
    for end in ends {
        let mut person = Person::new(&domain, &bus, &config, &build);
        loop {
            match person.asked() {
                Question::RangeFar => break,
                Question::LineSway => person.say("skip"),
                // The boards may not be ready yet, and the question comes again.
                _ => person.say("yes"),
            }
        }
        described("a trial", &|now| now != before);
        let second = domain.run(&["commission", "--config", &config]);
        let said = String::from_utf8_lossy(&second.stderr).into_owned();
        let first = format!("process {}", person.child.id());
        assert!(!second.status.success() && said.contains(&first), "{said}");
        end(&mut person);
        let _ = wait_for("its end", || person.child.try_wait().expect("a child"));
        described("what was before", &|now| now == before);
        person.look();
        let last = person.printed.last().map(String::as_str);
        assert_eq!(last, Some("nothing is written"));
    }
    let kept = fs::read_to_string(domain.folder().join("robot.toml"));
    assert_eq!(kept.expect("the file"), "");
    let undone = domain.run(&["commission", "--undo", "--config", &config]);
    assert_eq!(undone.status.code(), Some(1), "there is nothing to undo");
    drop((health, bus));
    robot.signal(Signal::INT);
    // Whether it had a mission that failed is of no interest.
    robot.wait().expect("it ends");
    domain.assert_clean();
}

/// The sensor board keeps its thresholds, whoever dies: the next one takes them back.
#[test]
fn a_calibration_of_a_killed_commissioning_is_taken_back_by_the_next_or_by_an_undo() {
    let (built, build) = other();
    let (domain, config) = unknown(built);
    let mut robot = up(&domain, &config);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Operator).expect("the bus opens");
    let note = domain.folder().join("robot.toml.calibrated");
    for is_undone in [true, false] {
        let mut person = Person::new(&domain, &bus, &config, &build);
        loop {
            match person.asked() {
                Question::RangeFar => break,
                question => person.answer(question),
            };
        }
        person.child.kill().expect("it runs");
        person.child.wait().expect("it ends");
        assert!(note.exists());
        if is_undone {
            let undone = domain.run(&["commission", "--undo", "--config", &config]);
            let said = String::from_utf8_lossy(&undone.stdout).into_owned();
            assert!(undone.status.success(), "{undone:?}");
            assert!(said.contains("is as it was before"), "{said}");
        } else {
            let mut person = Person::new(&domain, &bus, &config, &build);
            person.asked();
            person.say("quit");
            let _ = wait_for("its end", || person.child.try_wait().expect("a child"));
            person.look();
            let last = person.printed.last().map(String::as_str);
            assert_eq!(last, Some("nothing is written"));
        }
        assert!(!note.exists(), "they are back");
    }
    drop(bus);
    robot.signal(Signal::INT);
    // Whether it had a mission that failed is of no interest.
    robot.wait().expect("it ends");
    domain.assert_clean();
}

/// The input of a process that has ended.
fn closed() -> ChildStdin {
    let mut child = std::process::Command::new("true")
        .stdin(Stdio::piped())
        .spawn()
        .expect("it starts");
    let input = child.stdin.take().expect("its input");
    let _ = child.wait();
    input
}
