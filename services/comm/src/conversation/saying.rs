//! The lines to the external computer: answers to actions, thoughts, and refusals.

use lager_lines::conversation::RobotLine;
use lager_lines::extension::Report;
use lager_operator::Ended;
use lager_orders::{Moment, Reason};

use super::{AGAIN, Asker, Conversation};
use crate::effect::Effect;
use crate::speech;

impl Conversation {
    /// Does what the orders want, and says how they and commands have ended.
    pub(super) fn settle(&mut self) {
        self.effects
            .extend(self.orders.acts().into_iter().map(Effect::Do));
        let ended = self.orders.ended();
        self.tell_ended(ended);
        for ended in self.driving.ended() {
            match &ended.result {
                Err(why) if ended.numbers.is_empty() => {
                    self.think(why.clone());
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

    /// Says how orders have ended.
    pub(super) fn tell_ended(&mut self, ended: Vec<Ended<Asker>>) {
        for ended in ended {
            match (ended.whose, ended.result) {
                (Asker::Action(number), result) => self.reply(number, result),
                (Asker::Question, Err(why)) => self.think(why),
                (Asker::Question, Ok(())) => {}
            }
        }
    }

    /// Whether the state must be told again to a station that speaks the extension.
    pub fn is_to_tell(&self, now: Moment) -> bool {
        self.is_up && self.is_extended && self.telling.is_due(now)
    }

    /// Whether that station will be told how the machine is.
    pub fn is_to_tell_health(&self, now: Moment) -> bool {
        self.is_to_tell(now) && self.telling.is_health_due(now)
    }

    /// Tells the state as it is known now.
    pub fn tell(&mut self, now: Moment) {
        if self.is_to_tell(now) {
            let reports = self.telling.reports(now, &mut self.known, &self.battery);
            self.effects.extend(reports.into_iter().map(Effect::Show));
        }
    }

    /// Answers an action.
    pub(super) fn reply(&mut self, number: u32, result: Result<(), Reason>) {
        let report = match result {
            Ok(()) => Report::Done { number },
            Err(why) => Report::Refused {
                number,
                reason: speech::reason(&why),
            },
        };
        self.say_if_up(Some(RobotLine::Report(report)));
    }

    /// Says that something is impossible. The robot asks again a little later.
    pub(super) fn correct(&mut self, now: Moment, why: impl Into<Reason>) {
        self.think(why);
        self.held.clear();
        self.ask_from_ns = now.ns + AGAIN;
    }

    /// Says why something is not done. A station that speaks the extension gets the code first.
    pub(super) fn think(&mut self, why: impl Into<Reason>) {
        let why = why.into();
        let because = RobotLine::Report(Report::Because(speech::reason(&why)));
        self.say_if_up(self.is_extended.then_some(because));
        self.say_if_up(Some(speech::thought(&why.to_string())));
    }

    pub(super) fn say_if_up(&mut self, line: Option<RobotLine>) {
        if let Some(line) = line.filter(|_| self.is_up) {
            self.say(line);
        }
    }

    pub(super) fn say(&mut self, line: RobotLine) {
        self.effects.push(Effect::Say(line));
    }
}
