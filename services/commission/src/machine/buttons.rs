//! The robot's own buttons: at which lines they are, what springs back and what stays, and where a
//! closed contact pulls its line.
//!
//! ```text
//!   nobody touches them     what all lines show is noted
//!   reset, pressed          the line that has changed, and shows again what it showed
//!   mode, moved or pressed  the line that has changed: it is back, so a button; or not, so a switch
//!   switch                  which of its two levels is autonomous
//! ```
//! The bridge tells the levels, and the buttons do nothing as long as it is asked for them. It is
//! asked only in this step, so they count again some seconds after it.

use core::time::Duration;

use lager_orders::{Buttons, Contact, Level, Levels, Moment, SwitchKind, lines};
use lager_topics::{BridgeAnswer, ButtonLines, Outcome};

use super::{Commissioning, Effect, State};
use crate::answer::Answer;
use crate::step::{Question, Step};
use crate::words::Said;

/// How often the bridge is asked for the levels.
const ASK: Duration = Duration::from_millis(30);
/// Levels that are older say nothing of the buttons now.
const SILENT: Duration = Duration::from_secs(1);
/// The bridge has read no lines after this time.
const UNREAD: Duration = Duration::from_secs(4);

/// What this step has heard and found so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work {
    /// When the bridge is asked next; `None` while it has not answered.
    due: Option<Duration>,
    is_asked: bool,
    since: Option<Duration>,
    /// What the lines show, and when that was heard.
    now: Option<(Duration, Levels)>,
    /// What they show while nobody touches a button.
    rest: Option<Levels>,
    /// A bit for each line that has shown something else since the question was asked, and what.
    moved: u32,
    other: Levels,
    found: Buttons,
}

impl Commissioning {
    /// Asks for the levels when that is due.
    pub(super) fn listen(&mut self, now: Moment) {
        let is_here = self.step == Step::Buttons && self.state == State::Asks;
        let work = &mut self.buttons;
        if !is_here || work.is_asked || work.due.is_some_and(|due| due > now.robot) {
            return;
        }
        work.since.get_or_insert(now.robot);
        work.is_asked = true;
        self.effects.push(Effect::Listen);
    }

    /// To be called with the bridge's answer to [`Effect::Listen`]; `None` if there was none.
    pub fn lines(&mut self, now: Moment, answer: Option<&BridgeAnswer>) {
        let work = &mut self.buttons;
        work.is_asked = false;
        work.due = Some(now.robot + ASK);
        if self.step != Step::Buttons || self.state != State::Asks {
            return;
        }
        let Some(answer) = answer else { return };
        match (answer.outcome.get(), answer.button_lines.get()) {
            (Some(Outcome::Done), Some(ButtonLines::Read)) => {
                let levels = answer.levels();
                work.now = Some((now.robot, levels));
                work.found.chip = answer.button_chip;
                let rest = work.rest.unwrap_or(levels);
                for line in lines(rest.differ(&levels)) {
                    work.moved |= 1 << line;
                    work.other.set(line, levels.of(line));
                }
            }
            (Some(Outcome::Done), Some(ButtonLines::Absent)) => self.without(now, "found_no_lines"),
            (Some(Outcome::Done), _)
                if work.since.is_some_and(|since| now.robot >= since + UNREAD) =>
            {
                self.without(now, "found_no_lines");
            }
            // Somebody lets logic drive, and then the buttons must count.
            (Some(Outcome::UnderWay), _) => self.fall_back(now, "not_by_hand"),
            _ => {}
        }
    }

    pub(super) fn buttons_answered(&mut self, now: Moment, answer: Answer) -> Result<(), Said> {
        match (self.question, answer) {
            (Question::ButtonsFree, Answer::No) => self.without(now, "found_no_buttons"),
            (Question::ButtonsFree, Answer::Yes) => {
                self.buttons.rest = Some(self.levels(now.robot)?);
                self.ask_of_buttons(Question::ResetButton);
            }
            (Question::ResetButton, Answer::No) => self.ask_of_buttons(Question::ModeSwitch),
            (Question::ResetButton, Answer::Yes) => {
                let (line, is_back) = self.moved(now.robot, None)?;
                if !is_back {
                    return Err(Said::new("reset_stays", &[("line", &line)]));
                }
                let reset = self.contact(line, self.buttons.other.of(line))?;
                self.buttons.found.reset = Some(reset);
                self.ask_of_buttons(Question::ModeSwitch);
            }
            (Question::ModeSwitch, Answer::No) => self.found_buttons(now),
            (Question::ModeSwitch, Answer::Yes) => {
                let reset = self.buttons.found.reset.map(|reset| reset.line);
                let (line, is_back) = self.moved(now.robot, reset)?;
                if !is_back {
                    self.question = Question::SwitchAutonomous;
                    return Ok(());
                }
                let mode = self.contact(line, self.buttons.other.of(line))?;
                self.buttons.found.mode = Some((mode, SwitchKind::Press));
                self.found_buttons(now);
            }
            (Question::SwitchAutonomous, Answer::Yes | Answer::No) => {
                let reset = self.buttons.found.reset.map(|reset| reset.line);
                let (line, is_back) = self.moved(now.robot, reset)?;
                let rest = self.buttons.rest.unwrap_or_default();
                // Where it stands now, or where it stood before.
                let autonomous = match (answer == Answer::Yes) ^ is_back {
                    true => self.buttons.other.of(line),
                    false => rest.of(line),
                };
                let mode = self.contact(line, autonomous)?;
                self.buttons.found.mode = Some((mode, SwitchKind::Position));
                self.found_buttons(now);
            }
            _ => {}
        }
        Ok(())
    }

    /// The levels that differ from those at rest.
    pub(super) fn buttons_shown(&self) -> Option<Said> {
        let (_, levels) = self.buttons.now?;
        let rest = self.buttons.rest.unwrap_or_default();
        let moved: Vec<String> = lines(rest.differ(&levels))
            .map(|line| line.to_string())
            .collect();
        Some(match (self.buttons.rest, moved.is_empty()) {
            (None, _) => "live_buttons".into(),
            (Some(_), true) => "live_untouched".into(),
            (Some(_), false) => Said::new("live_touched", &[("lines", &moved.join(", "))]),
        })
    }

    fn ask_of_buttons(&mut self, question: Question) {
        self.buttons.moved = 0;
        self.question = question;
    }

    /// The step's result is that the robot has no buttons.
    fn without(&mut self, now: Moment, why: &'static str) {
        self.built.buttons = Buttons::default();
        self.done(now, why);
    }

    fn found_buttons(&mut self, now: Moment) {
        let Buttons { reset, mode, .. } = self.buttons.found;
        if reset.is_none() && mode.is_none() {
            return self.without(now, "found_no_buttons");
        }
        self.built.buttons = self.buttons.found;
        let none = || Said::from("button_none");
        let at = |name, contact: Contact| {
            let Contact { line, closed } = contact;
            let level = match closed {
                Level::Low => "level_low",
                Level::High => "level_high",
            };
            let line = Said::Plain(line.to_string());
            Said::of(name, [("line", line), ("level", level.into())])
        };
        let reset = reset.map_or_else(none, |reset| at("button_at", reset));
        let mode = mode.map_or_else(none, |(mode, kind)| match kind {
            SwitchKind::Press => at("button_at", mode),
            SwitchKind::Position => at("switch_at", mode),
        });
        let found = Said::of("found_buttons", [("reset", reset), ("mode", mode)]);
        self.done(now, found);
    }

    /// What the lines show now.
    fn levels(&self, now: Duration) -> Result<Levels, Said> {
        let heard = self.buttons.now.filter(|(at, _)| *at + SILENT >= now);
        heard.map(|(_, levels)| levels).ok_or("no_values".into())
    }

    /// The one line that has moved since the question was asked, and whether it shows again what it
    /// showed at rest.
    fn moved(&self, now: Duration, but: Option<u8>) -> Result<(u8, bool), Said> {
        let levels = self.levels(now)?;
        let all: Vec<u8> = lines(self.buttons.moved)
            .filter(|line| Some(*line) != but)
            .collect();
        let rest = self.buttons.rest.unwrap_or_default();
        match all[..] {
            [] => Err("no_line_moved".into()),
            [line] => Ok((line, rest.of(line) == levels.of(line))),
            _ => {
                let all: Vec<String> = all.iter().map(u8::to_string).collect();
                Err(Said::new("lines_moved", &[("lines", &all.join(", "))]))
            }
        }
    }

    /// The contact that is closed at this level; an open line cannot be told from a broken cable.
    fn contact(&self, line: u8, closed: Option<Level>) -> Result<Contact, Said> {
        let closed = closed.ok_or_else(|| Said::new("contact_opens", &[("line", &line)]))?;
        Ok(Contact { line, closed })
    }
}
