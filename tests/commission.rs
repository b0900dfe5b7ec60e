//! A robot that nobody has described is commissioned by `lager commission`, with a person's hands in
//! the simulated world, and delivers after a restart.

use std::f64::consts::TAU;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use lager_commission::Question;
use lager_floor::Heading;
use lager_orders::Language;
use lager_plant::{ArmBuild, Build, Ranger};
use lager_ports::{Bus, Client, Subscriber};
use lager_tests::{Domain, Running, WATCHDOG, wait_for};
use lager_topics::{Outcome, Role, Truth, TruthPose, WorldAsk, WorldAskKind, WorldRequest};
use rustix::process::Signal;

/// How far the line sensors are moved to either side, in mm.
const SWAY: i16 = 60;
/// The length of the measured drive, in mm.
const DRIVE: f64 = 600.0;

/// A robot that differs in everything; its battery is not measured.
fn other() -> (u64, Build) {
    let builds = (1..).map(|seed| (seed, Build::drawn(seed)));
    let mut other = builds.filter(|(_, build)| {
        let parts = [build.swapped, build.dark_is_low, !build.divider];
        parts == [true; 3] && build.reversed == [true, false] && build.ranger == Ranger::Gp2y0a02
    });
    other.next().expect("one in a hundred")
}

/// A person with a terminal, who sees the robot and takes it into his hands.
struct Person {
    child: Child,
    typing: ChildStdin,
    lines: Receiver<String>,
    /// Everything that was printed.
    printed: Vec<String>,
    truth: Subscriber<TruthPose>,
    hands: Client<WorldRequest>,
    seen: Truth,
    /// Which way the wheels turned last: 'f', 'b' or '0'.
    ways: [char; 2],
}

impl Person {
    fn new(domain: &Domain, bus: &Bus, config: &str) -> Self {
        let mut command = domain.lager(&["commission", "--config", config]);
        command.env("LC_ALL", "C");
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let (says, lines) = channel();
        let output = BufReader::new(child.stdout.take().expect("its output"));
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let _ = says.send(line);
            }
        });
        Self {
            typing: child.stdin.take().expect("its input"),
            child,
            lines,
            printed: Vec::new(),
            truth: bus.subscriber().expect("a topic"),
            hands: bus.client().expect("a request"),
            seen: Truth::default(),
            ways: ['0'; 2],
        }
    }

    /// Looks at the robot.
    fn look(&mut self) {
        while let Some(truth) = self.truth.receive().expect("readable") {
            self.seen = *truth;
            let speeds = [truth.left_mm_per_s, truth.right_mm_per_s];
            for (way, speed) in self.ways.iter_mut().zip(speeds) {
                match speed {
                    20.0.. => *way = 'f',
                    ..-20.0 => *way = 'b',
                    _ => {}
                }
            }
        }
        self.printed.extend(self.lines.try_iter());
    }

    /// Waits until the robot is as it should be.
    fn until(&mut self, what: &str, mut is_so: impl FnMut(&Self) -> bool) {
        wait_for(what, || {
            self.look();
            assert!(
                self.child.try_wait().expect("a child").is_none(),
                "{what}: {:#?}",
                self.printed
            );
            is_so(self).then_some(())
        });
    }

    /// What was asked since the last answer, if its values are shown, too.
    fn question(&self) -> Option<Question> {
        let all = Question::ALL.map(|question| (question, question.text(Language::English)));
        let lines = self.printed.iter().rev().skip(1);
        let mut asked = lines.filter_map(|line| all.iter().find(|(_, text)| text == line));
        asked.next().map(|(question, _)| *question)
    }

    /// Waits until something is asked.
    fn asked(&mut self) -> Question {
        self.until("a question", |person| person.question().is_some());
        let question = self.question().expect("as waited for");
        self.printed.clear();
        question
    }

    /// Takes the time that a sensor needs to see what has been done.
    fn pause(&self) {
        std::thread::sleep(Duration::from_millis(800));
    }

    fn say(&mut self, answer: &str) {
        writeln!(self.typing, "{answer}").expect("it listens");
    }

    /// Does something with the hands.
    fn act(&mut self, kind: WorldAskKind, x: u8, y: u8, heading: Heading) {
        let ask = WorldAsk {
            kind: kind.into(),
            x,
            y,
            heading: heading.into(),
            ..WorldAsk::default()
        };
        let answer = wait_for("the world", || self.hands.call(ask, WATCHDOG / 100).ok());
        assert_eq!(answer.outcome, Outcome::Done, "{kind:?}: {answer:?}");
    }

    /// Puts it down so far to the left of where it stands, in mm.
    fn shift(&mut self, left: i16) {
        let x = u8::try_from(left + 128).expect("a small step");
        self.act(WorldAskKind::Shift, x, 0, Heading::Right);
    }

    fn place(&mut self, x: u8, y: u8) {
        self.act(WorldAskKind::Place, x, y, Heading::Right);
    }

    /// Moves the line sensors over tape and floor until something else is asked.
    fn sway(&mut self) {
        for step in (0..).map(|step: i16| step % 24) {
            if step == 0 {
                self.place(0, 0);
                self.shift(-SWAY);
            }
            self.shift(if step < 12 { 10 } else { -10 });
            self.look();
            if self.question().is_some() {
                return;
            }
            std::thread::sleep(Duration::from_millis(60));
        }
    }

    /// Answers yes when the robot is there, unless it stands and is to begin anew.
    fn watch(&mut self, is_there: impl Fn(&Truth) -> bool) {
        self.until("the end of a movement", |person| {
            is_there(&person.seen) || person.question().is_some()
        });
        if self.question().is_none() {
            self.say("yes");
        }
    }

    /// Answers what is asked, from what is seen. Returns whether it was the last question.
    fn answer(&mut self, question: Question) -> bool {
        let begun = self.seen;
        match question {
            Question::Boards | Question::Finish => self.say("yes"),
            Question::LineSway => {
                self.say("yes");
                self.sway();
            }
            Question::LineFloor | Question::LineTape => {
                self.place(0, 0);
                if question == Question::LineFloor {
                    self.shift(100);
                }
                self.pause();
                self.say("yes");
            }
            Question::RangeFar | Question::RangeNear => {
                let cm = if question == Question::RangeFar {
                    30
                } else {
                    20
                };
                self.act(WorldAskKind::Hold, cm, 0, Heading::Right);
                self.pause();
                self.say(&cm.to_string());
            }
            Question::WheelsAhead | Question::WheelsLeft => {
                self.act(WorldAskKind::Lift, 0, 0, Heading::Right);
                self.pause();
                self.look();
                self.ways = ['0'; 2];
                self.say("yes");
            }
            Question::SawAhead | Question::SawLeft => {
                let ways: String = self.ways.iter().collect();
                self.say(&ways);
            }
            Question::Battery => self.say("no"),
            Question::Turn => {
                self.place(1, 1);
                self.pause();
                self.say("yes");
            }
            Question::TurnRound => {
                self.watch(|truth| truth.heading_rad - begun.heading_rad >= TAU);
            }
            Question::Speed => {
                self.place(0, 0);
                self.pause();
                self.say(&format!("{:.0}", DRIVE / 10.0));
            }
            Question::SpeedThere => self.watch(|truth| truth.x_mm - begun.x_mm >= DRIVE),
        }
        question == Question::Finish
    }

    /// Answers every question.
    fn commission(&mut self) {
        loop {
            let question = self.asked();
            if self.answer(question) {
                break;
            }
        }
        let ended = wait_for("its end", || self.child.try_wait().expect("a child"));
        self.look();
        assert!(ended.success(), "{:#?}", self.printed);
    }
}

/// A domain with a robot that is built otherwise, and its configuration.
fn unknown(built: u64) -> (Domain, String) {
    let domain = Domain::new();
    let [config, robot] = ["lager.toml", "robot.toml"].map(|name| domain.folder().join(name));
    fs::write(&robot, arm(&Build::drawn(built).arm)).expect("a file");
    let text = format!(
        "robot = {:?}\n[simulator]\nbuilt = {built}\n",
        robot.display().to_string()
    );
    fs::write(&config, text).expect("a file");
    (domain, config.display().to_string())
}

/// What a person who knows the servos of the arm has written of them.
fn arm(build: &ArmBuild) -> String {
    let names = [
        "base", "shoulder", "", "elbow", "", "wrist", "rotation", "gripper",
    ];
    let joints = names
        .iter()
        .enumerate()
        .filter(|(_, name)| !name.is_empty());
    let (mut servos, mut reversed) = (String::new(), String::new());
    for (index, name) in joints {
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
    let mut person = Person::new(&domain, &bus, &config);
    person.commission();
    drop((person, bus));
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
    assert_eq!(robot.wait(), Some(0), "{}\n{text}", robot.log());
    assert_eq!(robot.json()["delivered"], serde_json::json!([1]));
    domain.assert_clean();
}

#[test]
fn whoever_ends_it_early_leaves_the_file_and_the_boards_as_they_were() {
    use lager_topics::LinkHealth;

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
        let mut person = Person::new(&domain, &bus, &config);
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
    assert_eq!(kept.expect("the file"), arm(&build.arm));
    let undone = domain.run(&["commission", "--undo", "--config", &config]);
    assert_eq!(undone.status.code(), Some(1), "there is nothing to undo");
    drop((health, bus));
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
