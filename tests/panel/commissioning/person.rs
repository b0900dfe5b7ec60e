//! The person at the page: hands, eyes and a mouse.

#[path = "../../commission/hands.rs"]
mod hands;

use std::f64::consts::TAU;
use std::time::Duration;

use lager_commission::{Joint, Question, sentences};
use lager_plant::ButtonsBuild;
use lager_tests::wait_for;
use lager_topics::Truth;

use crate::browser::Page;
use crate::scene::Scene;
pub(super) use hands::let_logic_drive;
use hands::{DRIVE, GROWS, Hands, cm};

/// A person at the page, who takes the robot into his hands.
pub(super) struct Person {
    pub(super) page: Page,
    pub(super) hands: Hands,
    /// The number of what was answered last.
    pub(super) answered: String,
    /// The joint that is asked for, and whether its position grows in the way that is named.
    joint: Option<(Joint, bool)>,
}

impl Person {
    /// Opens the view from the start of the page of a robot with these buttons.
    pub(super) fn new(scene: &Scene, buttons: ButtonsBuild) -> Self {
        let mut page = scene.page();
        open(&mut page);
        Self {
            page,
            hands: Hands::new(&scene.bus, buttons),
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

    /// Where the servos of the arm are.
    pub(super) fn servos(&mut self) -> [u16; 8] {
        self.hands.look();
        self.hands.seen.servo_position
    }

    /// Once what was given before has had its time, the arm stands for half a second.
    pub(super) fn assert_arm_stands(&mut self) {
        self.hands.pause();
        let before = self.servos();
        std::thread::sleep(Duration::from_millis(500));
        assert_eq!(self.servos(), before);
    }

    /// What is asked, once something else is asked than was answered last and can be answered.
    fn question(&mut self) -> Option<String> {
        question_on(&mut self.page, &self.answered)
    }

    /// Waits until something is asked.
    pub(super) fn asked(&mut self) -> String {
        let question = wait_for("a question", || {
            self.hands.look();
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

    fn no(&mut self) {
        self.answering();
        self.page.click("#commission .answers [data-does=no]");
    }

    fn number(&mut self, number: &str) {
        self.answering();
        self.page.fill("#commission .answers input", number);
        self.page.click("#commission .answers [data-does=set]");
    }

    /// Holds the button until what moves stands, and lets it go.
    fn hold(&mut self) {
        let button = "#commission .answers [data-does=hold]:not(:disabled)";
        let page = &mut self.page;
        let at = page.settled(|page| page.middle(button));
        page.mouse("mousePressed", at);
        self.hands.hold(|| (), || page.mouse("mouseReleased", at));
    }

    /// Answers at the moment when the robot is there, unless it stands and is to begin anew.
    fn watch(&mut self, question: &str, is_there: impl Fn(&Truth) -> bool) {
        let goes_on = wait_for("the end of a movement", || {
            self.hands.look();
            let asked = self
                .page
                .value("document.querySelector('#commission').dataset.question");
            match asked == question {
                true => is_there(&self.hands.seen).then_some(true),
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
    pub(super) fn answer(&mut self, asked: &str) -> bool {
        let mut all = Question::ALL.into_iter();
        let question = all.find(|question| question.name() == asked);
        let question = question.expect("a question of the table");
        self.hands.look();
        let begun = self.hands.seen;
        self.hands.prepare(question, self.joint);
        match question {
            _ if self.hands.lacks(question) => self.no(),
            // Nothing measures it.
            Question::Battery => self.no(),
            Question::LineSway => {
                self.yes();
                let (page, answered) = (&mut self.page, &self.answered);
                self.hands.sway(|| question_on(page, answered).is_some());
            }
            Question::RangeFar | Question::RangeNear => self.number(&cm(question).to_string()),
            Question::SawAhead | Question::SawLeft => {
                self.answering();
                for (side, way) in ["left", "right"].into_iter().zip(self.hands.ways()) {
                    let choice = format!("#commission input[name={side}][value='{way}']");
                    self.page.click(&choice);
                }
                self.page.click("#commission .answers [data-does=set]");
            }
            Question::TurnRound => {
                self.watch(asked, |truth| truth.heading_rad - begun.heading_rad >= TAU);
            }
            Question::Speed => self.number(&format!("{:.0}", DRIVE / 10.0)),
            Question::SpeedThere => self.watch(asked, |truth| truth.x_mm - begun.x_mm >= DRIVE),
            Question::JointMoves => {
                let (joint, grows) = self.joint.expect("it is named");
                let before = self.servos()[joint.servo()];
                self.hold();
                let after = self.servos()[joint.servo()];
                assert_ne!(before, after, "{joint:?}");
                assert_eq!(grows, after > before, "{joint:?} was shown by hand");
                self.yes();
            }
            Question::ClawEmpty | Question::ClawFull => {
                self.hold();
                if question == Question::ClawFull {
                    self.hands.fill();
                }
                self.hold();
                self.yes();
            }
            _ => self.yes(),
        }
        question == Question::Finish
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

/// What a page asks, once something else is asked than was answered last and can be answered.
fn question_on(page: &mut Page, answered: &str) -> Option<String> {
    let now = page.value(
        "(() => { const view = document.querySelector('#commission'); \
         const is = view.querySelector('.answers :is(button, input):not(:disabled)') !== null; \
         return is ? [view.dataset.asked, view.dataset.question] : ['', '']; })()",
    );
    let [asked, question] = [0, 1].map(|part| now[part].as_str().unwrap_or_default().to_owned());
    (!question.is_empty() && asked != answered).then_some(question)
}
