//! What is said to the external computer: answers to actions, thoughts, and what cannot be done.

use lager_lines::conversation::RobotLine;
use lager_lines::extension::Report;

use super::{AGAIN, Conversation};
use crate::action::Action;
use crate::moment::Moment;
use crate::speech;
use crate::tasks::Asker;

impl Conversation {
    /// Does what tasks want done, and says how they and commands have ended.
    pub(super) fn settle(&mut self) {
        self.actions.append(&mut self.tasks.actions());
        for ended in self.tasks.ended() {
            match (ended.asker, ended.result) {
                (Asker::Action(number), result) => self.reply(number, result),
                (Asker::Question, Err(why)) => self.think(&why),
                (Asker::Question, Ok(())) => {}
            }
        }
        for ended in self.driving.ended() {
            match &ended.result {
                Err(why) if ended.numbers.is_empty() => {
                    self.think(why);
                    if self.held.get().is_none() {
                        self.ask_from_ns = self.turned_ns + AGAIN;
                    }
                }
                result => {
                    for number in &ended.numbers {
                        self.reply(*number, result.clone());
                    }
                }
            }
        }
    }

    /// Whether it is time to tell a station that speaks the extension what the robot does.
    pub fn is_to_tell(&self, now: Moment) -> bool {
        self.is_up && self.is_extended && self.telling.is_due(now)
    }

    /// Tells it, as far as it is known now.
    pub fn tell(&mut self, now: Moment) {
        if self.is_to_tell(now) {
            let reports = self.telling.reports(now, &mut self.known);
            self.actions.extend(reports.into_iter().map(Action::Show));
        }
    }

    /// Answers an action.
    pub(super) fn reply(&mut self, number: u32, result: Result<(), String>) {
        let report = match result {
            Ok(()) => Report::Done { number },
            Err(why) => Report::Refused {
                number,
                reason: speech::reason(&why),
            },
        };
        self.say_if_up(Some(RobotLine::Report(report)));
    }

    /// Tells what cannot be done; whatever is wanted then is asked a little later.
    pub(super) fn correct(&mut self, now: Moment, why: &str) {
        self.think(why);
        self.held.clear();
        self.ask_from_ns = now.ns + AGAIN;
    }

    pub(super) fn think(&mut self, sentence: &str) {
        self.say_if_up(Some(speech::thought(sentence)));
    }

    pub(super) fn say_if_up(&mut self, line: Option<RobotLine>) {
        if let Some(line) = line.filter(|_| self.is_up) {
            self.say(line);
        }
    }

    pub(super) fn say(&mut self, line: RobotLine) {
        self.actions.push(Action::Say(line));
    }
}
