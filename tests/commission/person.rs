//! A person with a terminal in front of a simulated or emulated robot: answers what `lager commission`
//! asks, from what he sees, and takes the robot and its arm into his hands.

mod hands;

use std::f64::consts::TAU;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};

use lager_commission::{Joint, Question, sentences};
use lager_orders::Language;
use lager_plant::Build;
use lager_ports::Bus;
use lager_tests::{Domain, wait_for};
use lager_topics::Truth;

pub(crate) use hands::let_logic_drive;
use hands::{DRIVE, GROWS, Hands, cm};

/// A person with a terminal, who sees the robot and takes it into his hands.
pub(crate) struct Person {
    pub(crate) child: Child,
    pub(crate) typing: ChildStdin,
    lines: Receiver<String>,
    /// Everything that was printed.
    pub(crate) printed: Vec<String>,
    hands: Hands,
    /// The joint that is asked for, and whether its position grows in the way that is named.
    joint: Option<(Joint, bool)>,
    /// Whether the steering board measures the battery.
    has_divider: bool,
}

impl Person {
    /// Someone who commissions a robot that is built so.
    pub(crate) fn new(domain: &Domain, bus: &Bus, config: &str, build: &Build) -> Self {
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
            hands: Hands::new(bus, build.buttons),
            joint: None,
            has_divider: build.divider,
        }
    }

    /// Looks at the robot and at the terminal.
    pub(crate) fn look(&mut self) {
        self.hands.look();
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
        question_in(&self.printed)
    }

    /// Waits until something is asked.
    pub(crate) fn asked(&mut self) -> Question {
        self.until("a question", |person| person.question().is_some());
        let question = self.question().expect("as waited for");
        let named = |line: &String| {
            let (name, way) = line.strip_suffix(':')?.split_once(", ")?;
            let mut joints = Joint::ALL.into_iter().zip(GROWS);
            let (joint, grows) = joints.find(|(joint, _)| joint_name(*joint) == Some(name))?;
            Some((joint, grows == way))
        };
        self.joint = self.printed.iter().rev().find_map(named);
        self.printed.clear();
        question
    }

    pub(crate) fn say(&mut self, answer: &str) {
        writeln!(self.typing, "{answer}").expect("it listens");
    }

    /// Holds the enter key until what moves stands, and lets it go.
    fn press(&mut self) {
        let typing = &mut self.typing;
        let enter = || writeln!(typing).expect("it listens");
        self.hands.hold(enter, || ());
        self.look();
    }

    /// Answers yes when the robot is there, unless it stands and is to begin anew.
    fn watch(&mut self, is_there: impl Fn(&Truth) -> bool) {
        self.until("the end of a movement", |person| {
            is_there(&person.hands.seen) || person.question().is_some()
        });
        if self.question().is_none() {
            self.say("yes");
        }
    }

    /// Answers what is asked, from what is seen. Returns whether it was the last question.
    pub(crate) fn answer(&mut self, question: Question) -> bool {
        let begun = self.hands.seen;
        self.hands.prepare(question, self.joint);
        match question {
            _ if self.hands.lacks(question) => self.say("no"),
            Question::LineSway => {
                self.say("yes");
                let (lines, printed) = (&self.lines, &mut self.printed);
                self.hands.sway(|| {
                    printed.extend(lines.try_iter());
                    question_in(printed).is_some()
                });
            }
            Question::RangeFar | Question::RangeNear => self.say(&cm(question).to_string()),
            Question::SawAhead | Question::SawLeft => {
                let ways: String = self.hands.ways().iter().collect();
                self.say(&ways);
            }
            Question::Battery if self.has_divider => {
                // What a meter shows at three cells with this charge, within half a volt.
                let volts = 10.7 + 1.7 * self.hands.seen.battery_charge;
                self.say(&format!("{volts:.1}"));
            }
            Question::Battery => self.say("no"),
            Question::JointMoves => {
                let (joint, grows) = self.joint.expect("it is named");
                let before = self.hands.seen.servo_position[joint.servo()];
                // Whoever sees nothing move presses again.
                let after = wait_for("the joint to move, or its step to begin anew", || {
                    self.press();
                    let after = self.hands.seen.servo_position[joint.servo()];
                    let is_asked_anew = self.question().is_some();
                    (is_asked_anew || after != before).then(|| (!is_asked_anew).then_some(after))
                });
                let Some(after) = after else {
                    // A busy machine was late with an order.
                    return false;
                };
                self.say(if grows == (after > before) {
                    "yes"
                } else {
                    "no"
                });
            }
            Question::ClawEmpty | Question::ClawFull => {
                self.press();
                if question == Question::ClawFull {
                    self.hands.fill();
                }
                self.press();
                if self.question().is_some() {
                    return false;
                }
                self.say("yes");
            }
            Question::TurnRound => {
                self.watch(|truth| truth.heading_rad - begun.heading_rad >= TAU);
            }
            Question::Speed => self.say(&format!("{:.0}", DRIVE / 10.0)),
            Question::SpeedThere => self.watch(|truth| truth.x_mm - begun.x_mm >= DRIVE),
            _ => self.say("yes"),
        }
        question == Question::Finish
    }

    /// Answers every question.
    pub(crate) fn commission(&mut self) {
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

/// What these lines ask, if the values that belong to it are shown, too.
fn question_in(printed: &[String]) -> Option<Question> {
    let all = Question::ALL.map(|question| (question, question.text(Language::English)));
    let lines = printed.iter().rev().skip(1);
    let mut asked = lines.filter_map(|line| all.iter().find(|(_, text)| text == line));
    asked.next().map(|(question, _)| *question)
}

/// The name of a joint, as it is printed.
fn joint_name(joint: Joint) -> Option<&'static str> {
    let name = format!("joint_{joint:?}").to_lowercase();
    let mut all = sentences().filter(|sentence| sentence.name == name);
    all.next().map(|sentence| sentence.english)
}
