//! The person at the page: hands, eyes and a mouse.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use lager_commission::{Joint, sentences};
use lager_floor::Heading;
use lager_ports::{Client, Subscriber};
use lager_tests::{WATCHDOG, wait_for};
use lager_topics::{Outcome, Truth, TruthPose, WorldAsk, WorldAskKind, WorldRequest};
use lager_wire::{ArmPose, ArmProfile, SERVO_MAX};

use crate::browser::Page;
use crate::scene::Scene;

/// How far the line sensors are moved to either side, in mm.
const SWAY: i16 = 60;
/// The length of the measured drive, in mm.
const DRIVE: f64 = 600.0;

/// Where shoulder and elbow are at goods, as drawn.
const REACH: [u16; 2] = [312, 488];
/// As far as this from the ends of what a servo measures a joint may go, if nothing stops it before.
const LEAST: u16 = 64;
/// The ways in which the positions of [`Joint::ALL`] grow, as they are shown.
const GROWS: [&str; 6] = [
    "to the left",
    "up",
    "out",
    "tilting up",
    "counter-clockwise, seen from the claw",
    "opening",
];
/// The shortest press of a button, and how long something stands that has ended its movement.
const PRESS: Duration = Duration::from_millis(1_200);
const STANDS: Duration = Duration::from_millis(800);

/// A person at the page, who takes the robot into his hands.
pub(super) struct Person {
    pub(super) page: Page,
    pub(super) truth: Subscriber<TruthPose>,
    pub(super) hands: Client<WorldRequest>,
    seen: Truth,
    /// Which way the wheels turned last: 'f', 'b' or '0'.
    ways: [char; 2],
    /// The number of what was answered last.
    pub(super) answered: String,
    /// The joint that is asked for, and whether its position grows in the way that is named.
    joint: Option<(Joint, bool)>,
}

impl Person {
    /// Opens the view from the start of the page.
    pub(super) fn new(scene: &Scene) -> Self {
        let mut page = scene.page();
        open(&mut page);
        Self {
            page,
            truth: scene.bus.subscriber().expect("a topic"),
            hands: scene.bus.client().expect("a request"),
            seen: Truth::default(),
            ways: ['0'; 2],
            answered: String::new(),
            joint: None,
        }
    }

    /// Takes the wheel, begins, and makes the robot manual.
    pub(super) fn begin(&mut self) {
        does(&mut self.page, "begin");
        self.page
            .wait_until("document.querySelector('#commission').dataset.question === 'ask_boards'");
        wait_for("the mode to be the hand's", || {
            self.page
                .value("document.querySelector('#commission [data-does=manual]')?.click()");
            self.page.pause();
            self.page.text("#mode").contains("BY HAND").then_some(())
        });
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
    }

    /// Where the servos of the arm are.
    pub(super) fn servos(&mut self) -> [u16; 8] {
        self.look();
        self.seen.servo_position
    }

    /// Once what was given before has had its time, the arm stands for half a second.
    pub(super) fn assert_arm_stands(&mut self) {
        self.pause();
        let before = self.servos();
        std::thread::sleep(Duration::from_millis(500));
        assert_eq!(self.servos(), before);
    }

    /// What is asked, once something else is asked than was answered last and can be answered.
    fn question(&mut self) -> Option<String> {
        let now = self.page.value(
            "(() => { const view = document.querySelector('#commission'); \
             const is = view.querySelector('.answers :is(button, input):not(:disabled)') !== null; \
             return is ? [view.dataset.asked, view.dataset.question] : ['', '']; })()",
        );
        let [asked, question] =
            [0, 1].map(|part| now[part].as_str().unwrap_or_default().to_owned());
        (!question.is_empty() && asked != self.answered).then_some(question)
    }

    /// Waits until something is asked.
    pub(super) fn asked(&mut self) -> String {
        let question = wait_for("a question", || {
            self.look();
            self.question()
        });
        let text = self.page.text("#commission .question").to_lowercase();
        self.joint = Joint::ALL
            .into_iter()
            .zip(GROWS)
            .find_map(|(joint, grows)| {
                let name = format!("joint_{joint:?}").to_lowercase();
                let name = sentences().find(|sentence| sentence.name == name)?.english;
                let (way, _) = text
                    .strip_prefix(name)?
                    .strip_prefix(", ")?
                    .split_once(':')?;
                Some((joint, way == grows))
            });
        question
    }

    /// Notes what is answered now.
    fn answering(&mut self) {
        let asked = self
            .page
            .value("document.querySelector('#commission').dataset.asked");
        self.answered = asked.as_str().unwrap_or_default().to_owned();
    }

    pub(super) fn yes(&mut self) {
        self.answering();
        self.page.click("#commission .answers [data-does=yes]");
    }

    fn number(&mut self, number: &str) {
        self.answering();
        self.page.fill("#commission .answers input", number);
        self.page.click("#commission .answers [data-does=set]");
    }

    /// Takes the time that a sensor needs to see what has been done.
    fn pause(&self) {
        std::thread::sleep(Duration::from_millis(800));
    }

    /// Does something with the hands.
    fn act(&mut self, kind: WorldAskKind, x: u8, y: u8) {
        let ask = WorldAsk {
            kind: kind.into(),
            x,
            y,
            heading: Heading::Right.into(),
            ..WorldAsk::default()
        };
        let answer = wait_for("the world", || self.hands.call(ask, WATCHDOG / 100).ok());
        assert_eq!(answer.outcome, Outcome::Done, "{kind:?}: {answer:?}");
    }

    /// Puts it down so far to the left of where it stands, in mm.
    fn shift(&mut self, left: i16) {
        let x = u8::try_from(left + 128).expect("a small step");
        self.act(WorldAskKind::Shift, x, 0);
    }

    fn place(&mut self, x: u8, y: u8) {
        self.act(WorldAskKind::Place, x, y);
    }

    /// Brings a joint of the arm to a position as drawn, and holds it.
    fn bring(&mut self, joint: Joint, position: u16) {
        let servo = u8::try_from(joint.servo()).expect("a servo");
        let quarter = u8::try_from(position / 4).expect("a position");
        self.act(WorldAskKind::Bring, servo, quarter);
    }

    /// Brings the arm to a pose.
    fn pose(&mut self, pose: ArmPose) {
        self.bring(Joint::Base, pose.base);
        self.bring(Joint::Shoulder, pose.shoulder);
        self.bring(Joint::Elbow, pose.elbow);
        self.bring(Joint::Wrist, pose.wrist);
        self.pause();
    }

    /// Holds the button until what moves stands, and lets it go.
    fn hold(&mut self) {
        let button = "#commission .answers [data-does=hold]:not(:disabled)";
        let at = self.page.settled(|page| page.middle(button));
        self.page.mouse("mousePressed", at);
        let (begun, mut last) = (Instant::now(), (self.servos(), Instant::now()));
        while begun.elapsed() < PRESS || last.1.elapsed() < STANDS {
            std::thread::sleep(Duration::from_millis(20));
            let now = self.servos();
            if now != last.0 {
                last = (now, Instant::now());
            }
        }
        self.page.mouse("mouseReleased", at);
        std::thread::sleep(PRESS);
    }

    /// Moves the line sensors over tape and floor until something else is asked.
    fn sway(&mut self) {
        for step in (0..).map(|step: i16| step % 24) {
            if step == 0 {
                self.place(0, 0);
                self.shift(-SWAY);
            }
            self.shift(if step < 12 { 10 } else { -10 });
            if self.question().is_some() {
                return;
            }
            std::thread::sleep(Duration::from_millis(60));
        }
    }

    /// Answers at the moment when the robot is there, unless it stands and is to begin anew.
    fn watch(&mut self, question: &str, is_there: impl Fn(&Truth) -> bool) {
        let goes_on = wait_for("the end of a movement", || {
            self.look();
            let asked = self
                .page
                .value("document.querySelector('#commission').dataset.question");
            match asked == question {
                true => is_there(&self.seen).then_some(true),
                false => Some(false),
            }
        });
        if goes_on {
            self.answering();
            self.page
                .value("document.querySelector('#commission [data-does=now]')?.click()");
        }
    }

    /// Answers what is asked, from what is seen. Returns whether it was the last question.
    pub(super) fn answer(&mut self, question: &str) -> bool {
        self.look();
        let begun = self.seen;
        match question {
            "ask_boards" => self.yes(),
            "ask_finish" => {
                self.act(WorldAskKind::Fill, 0, 0);
                self.yes();
            }
            "ask_line_sway" => {
                self.yes();
                self.sway();
            }
            "ask_line_floor" | "ask_line_tape" => {
                self.place(0, 0);
                if question == "ask_line_floor" {
                    self.shift(100);
                }
                self.pause();
                self.yes();
            }
            "ask_range_far" | "ask_range_near" => {
                let cm = if question == "ask_range_far" { 30 } else { 20 };
                self.act(WorldAskKind::Hold, cm, 0);
                self.pause();
                self.number(&cm.to_string());
            }
            "ask_wheels_ahead" | "ask_wheels_left" => {
                self.act(WorldAskKind::Lift, 0, 0);
                self.pause();
                self.look();
                self.ways = ['0'; 2];
                self.yes();
            }
            "ask_saw_ahead" | "ask_saw_left" => {
                self.answering();
                for (side, way) in ["left", "right"].into_iter().zip(self.ways) {
                    let choice = format!("#commission input[name={side}][value='{way}']");
                    self.page.click(&choice);
                }
                self.page.click("#commission .answers [data-does=set]");
            }
            "ask_battery" => {
                self.answering();
                self.page.click("#commission .answers [data-does=no]");
            }
            "ask_turn" => {
                self.place(1, 1);
                self.pause();
                self.yes();
            }
            "ask_turn_round" => {
                self.watch(question, |truth| {
                    truth.heading_rad - begun.heading_rad >= TAU
                });
            }
            "ask_speed" => {
                self.place(0, 0);
                self.pause();
                self.number(&format!("{:.0}", DRIVE / 10.0));
            }
            "ask_speed_there" => {
                self.watch(question, |truth| truth.x_mm - begun.x_mm >= DRIVE);
            }
            "ask_arm" | "ask_poses" => self.yes(),
            "ask_joint_end" => {
                let (joint, is_upper) = self.joint.expect("it is named");
                if (joint, is_upper) == (Joint::Base, false) {
                    self.bring(Joint::Shoulder, 300);
                    self.bring(Joint::Elbow, 300);
                }
                self.bring(
                    joint,
                    match (joint, is_upper) {
                        (Joint::Gripper, false) => 0,
                        (_, false) => LEAST,
                        (Joint::Gripper, true) => ArmProfile::default().gripper_open,
                        (_, true) => SERVO_MAX - LEAST,
                    },
                );
                self.yes();
            }
            "ask_pose_reach" | "ask_pose_carry" | "ask_pose_drop" | "ask_pose_neutral" => {
                let drawn = ArmProfile::default();
                self.pose(match question {
                    "ask_pose_reach" => ArmPose {
                        shoulder: REACH[0],
                        elbow: REACH[1],
                        ..drawn.carry
                    },
                    "ask_pose_drop" => drawn.drop,
                    _ => drawn.carry,
                });
                self.yes();
            }
            "ask_joint_moves" => {
                let (joint, grows) = self.joint.expect("it is named");
                let [before, after] = [false, true].map(|held| {
                    if held {
                        self.hold();
                    }
                    self.servos()[joint.servo()]
                });
                assert_ne!(before, after, "{joint:?}");
                assert_eq!(grows, after > before, "{joint:?} was shown by hand");
                self.yes();
            }
            "ask_claw_empty" | "ask_claw_full" => {
                self.hold();
                if question == "ask_claw_full" {
                    self.act(WorldAskKind::Fill, 1, 0);
                }
                self.hold();
                self.yes();
            }
            _ => panic!("nobody knows an answer to {question}"),
        }
        question == "ask_finish"
    }

    /// Goes on until this is asked.
    pub(super) fn until(&mut self, wanted: &str) {
        loop {
            let question = self.asked();
            if question == wanted {
                return;
            }
            match question.as_str() {
                "ask_boards" => self.yes(),
                _ => {
                    self.answering();
                    does(&mut self.page, "skip");
                }
            }
        }
    }
}

/// Opens the view as somebody who looks for it.
pub(super) fn open(page: &mut Page) {
    page.click("#tab-setup");
    page.click_until(
        "#commission-open",
        "document.querySelector('#commission:not([hidden]) [data-does]') !== null",
    );
}

pub(super) fn does(page: &mut Page, what: &str) {
    page.click(&format!("#commission [data-does={what}]:not(:disabled)"));
}
