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
use lager_plant::{Build, Ranger};
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

    /// Waits until this is asked, and its values are shown.
    fn asked(&mut self, question: Question) {
        let text = question.text(Language::English);
        self.until(&text, |person| {
            let place = person.printed.iter().position(|line| *line == text);
            place.is_some_and(|place| person.printed.len() > place + 1)
        });
        self.printed.clear();
        // A person looks before he answers, and a sensor needs its time.
        std::thread::sleep(Duration::from_millis(800));
        self.look();
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

    fn lift_and_look(&mut self, asked: Question, saw: Question) {
        self.asked(asked);
        self.act(WorldAskKind::Lift, 0, 0, Heading::Right);
        self.ways = ['0'; 2];
        self.say("yes");
        self.asked(saw);
        let ways: String = self.ways.iter().collect();
        self.say(&ways);
    }

    /// Answers every question from what he sees.
    fn commission(&mut self) {
        self.asked(Question::Boards);
        self.say("yes");

        self.asked(Question::LineSway);
        self.place(0, 0);
        self.say("yes");
        let text = Question::LineFloor.text(Language::English);
        for step in (0..).map(|step: i16| step % 24) {
            let left = if step < 12 { 10 } else { -10 };
            if step == 0 {
                self.place(0, 0);
                self.shift(-SWAY);
            }
            self.shift(left);
            self.look();
            if self.printed.contains(&text) {
                break;
            }
            std::thread::sleep(Duration::from_millis(60));
        }
        self.asked(Question::LineFloor);
        self.place(0, 0);
        self.shift(100);
        std::thread::sleep(Duration::from_millis(800));
        self.say("yes");
        self.asked(Question::LineTape);
        self.place(0, 0);
        std::thread::sleep(Duration::from_millis(800));
        self.say("yes");

        for (question, cm) in [(Question::RangeFar, 30), (Question::RangeNear, 20)] {
            self.asked(question);
            self.act(WorldAskKind::Hold, cm, 0, Heading::Right);
            std::thread::sleep(Duration::from_millis(800));
            self.say(&cm.to_string());
        }

        self.lift_and_look(Question::WheelsAhead, Question::SawAhead);
        self.lift_and_look(Question::WheelsLeft, Question::SawLeft);

        self.asked(Question::Battery);
        self.say("no");

        self.asked(Question::Turn);
        self.place(1, 1);
        self.until("it stands in the middle", |person| person.seen.y_mm > 400.0);
        let begun = self.seen.heading_rad;
        self.say("yes");
        self.until("a full turn", |person| person.seen.heading_rad - begun >= TAU);
        self.say("yes");

        self.asked(Question::Speed);
        self.place(0, 0);
        self.until("it stands at the start", |person| person.seen.y_mm < 100.0);
        let begun = self.seen.x_mm;
        self.say(&format!("{:.0}", DRIVE / 10.0));
        self.until("the length", |person| person.seen.x_mm - begun >= DRIVE);
        self.say("yes");

        self.asked(Question::Finish);
        self.say("yes");
        let ended = wait_for("its end", || self.child.try_wait().expect("a child"));
        self.look();
        assert!(ended.success(), "{:#?}", self.printed);
    }
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

    let (built, _) = other();
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
        person.asked(Question::Boards);
        person.say("yes");
        person.asked(Question::LineSway);
        person.say("skip");
        person.asked(Question::RangeFar);
        described("a trial", &|now| now != before);
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
