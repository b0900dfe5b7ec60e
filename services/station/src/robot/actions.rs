//! What only a robot does that speaks the extension: numbered actions, and a driver.

use std::time::Duration;

use lager_lines::TooLate;
use lager_lines::command::Wheels;
use lager_lines::conversation::StationLine;
use lager_lines::extension::{Action, Order};
use lager_wire::{OperatorArm, OperatorCommand};

use super::{ActRefused, Robot};
use crate::given::Given;
use crate::shown::{Reply, Told};
use crate::wheel::{Key, LEASE};

impl Robot {
    /// Gives it an action, whose number is returned. To drive it and to move its arm is its
    /// driver's.
    ///
    /// # Errors
    ///
    /// When it does not speak the extension, too many are unanswered, only its driver may, or it
    /// comes too late.
    pub fn act(
        &mut self,
        action: impl Into<Given<Action>>,
    ) -> Result<(u32, StationLine), ActRefused> {
        let Given { what, late } = action.into();
        match what {
            Action::Drive { .. } | Action::Arm(_) => Err(ActRefused::NotDriver),
            action => self.order(action, late),
        }
    }

    /// Lets `who` drive it, and nobody else until he leaves or is silent for 3 s.
    ///
    /// # Errors
    ///
    /// When somebody else drives it.
    pub fn take_wheel(&mut self, who: &str) -> Result<Key, ActRefused> {
        let taken = self.wheel.take(who, self.now);
        taken.map_err(|by| ActRefused::Driven { by })
    }

    /// Its driver turns the wheels: for 150 ms, unless he does so again.
    ///
    /// # Errors
    ///
    /// When he drives it no more, or as with [`Robot::act`].
    pub fn drive(
        &mut self,
        key: Key,
        wheels: impl Into<Given<Wheels>>,
    ) -> Result<(u32, StationLine), ActRefused> {
        let Given { what: wheels, late } = wheels.into();
        let drives = OperatorCommand::from(wheels) != OperatorCommand::Stop;
        self.word(key, Some(drives))?;
        let action = Action::Drive {
            wheels,
            lease: LEASE,
        };
        self.order(action, late)
    }

    /// Its driver moves the arm by a step.
    ///
    /// # Errors
    ///
    /// As with [`Robot::drive`].
    pub fn arm(
        &mut self,
        key: Key,
        step: impl Into<Given<OperatorArm>>,
    ) -> Result<(u32, StationLine), ActRefused> {
        let Given { what: step, late } = step.into();
        self.word(key, None)?;
        self.order(Action::Arm(step), late)
    }

    /// Its driver is still there.
    ///
    /// # Errors
    ///
    /// When he drives it no more.
    pub fn stay(&mut self, key: Key) -> Result<(), ActRefused> {
        self.word(key, None)
    }

    /// Its driver leaves; it stands if it still turns its wheels by his word.
    pub fn leave_wheel(&mut self, key: Key) -> Option<StationLine> {
        self.wheel.leave(key).then(|| self.stand())?
    }

    /// Time has passed: a driver who is silent loses the seat, and what was not answered is lost.
    pub fn turn(&mut self, now: Duration) -> Option<StationLine> {
        self.now = now;
        let lost = self.asked.lost(now, false);
        self.lose(lost);
        self.wheel.lapse(now).then(|| self.stand())?
    }

    /// What it has said since this was asked last.
    pub fn news(&mut self) -> Vec<Told> {
        core::mem::take(&mut self.told_news)
    }

    fn word(&mut self, key: Key, drives: Option<bool>) -> Result<(), ActRefused> {
        if self.wheel.word(key, self.now, drives) {
            return Ok(());
        }
        Err(match self.wheel.driver() {
            Some(by) => ActRefused::Driven { by: by.to_owned() },
            None => ActRefused::NotDriver,
        })
    }

    fn order(&mut self, action: Action, late: Duration) -> Result<(u32, StationLine), ActRefused> {
        if self.hello.is_none() {
            return Err(ActRefused::Plain);
        }
        TooLate::check(late, action.latest())?;
        let number = self.asked.open(self.now).ok_or(ActRefused::Full)?;
        let order = Order::Do {
            number,
            late_ms: u32::try_from(late.as_millis()).unwrap_or(u32::MAX),
            action,
        };
        Ok((number, StationLine::Order(order)))
    }

    /// Makes it stand whose driver is gone. Nobody waits for the answer.
    fn stand(&mut self) -> Option<StationLine> {
        self.hello.as_ref()?;
        let action = Action::Drive {
            wheels: Wheels::new(OperatorCommand::Stop)?,
            lease: LEASE,
        };
        let number = self.asked.number();
        let late_ms = 0;
        Some(StationLine::Order(Order::Do {
            number,
            late_ms,
            action,
        }))
    }

    pub(super) fn lose(&mut self, numbers: impl IntoIterator<Item = u32>) {
        let lost = numbers.into_iter().map(|number| Told::Replied {
            number,
            reply: Reply::Lost,
        });
        self.told_news.extend(lost);
    }
}
