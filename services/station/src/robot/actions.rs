//! Numbered actions, and the driver. Only robots that speak the extension have them.

use std::time::Duration;

use lager_lines::conversation::StationLine;
use lager_lines::extension::Order;
use lager_orders::lease::{COMMAND, TooLate};
use lager_orders::{Action, Commission, LeaseMs, Wheels};
use lager_wire::{OperatorArm, OperatorCommand};

use super::{ActRefused, Robot};
use crate::given::Given;
use crate::shown::{Reply, Saying};
use crate::wheel::{Key, Wheel};

/// [`COMMAND`] as a line says it.
const COMMAND_LEASE: LeaseMs = LeaseMs::new(COMMAND.as_millis() as u16).expect("a time in ms");

impl Robot {
    /// Gives the robot an action and returns its number. Only the driver may drive the robot or
    /// move its arm.
    ///
    /// # Errors
    ///
    /// The robot does not speak the extension, too many actions wait for answers, only the driver
    /// may give this one, or it comes too late.
    pub fn act(
        &mut self,
        action: impl Into<Given<Action>>,
    ) -> Result<(u32, StationLine), ActRefused> {
        let Given { what, late } = action.into();
        match what {
            Action::Drive { .. } | Action::Arm(_) => Err(ActRefused::NotDriver),
            // It moves the robot, too, and whoever asks for this knows by whom.
            Action::Commission(_) if self.wheel.driver().is_none() => Err(ActRefused::NotDriver),
            action => self.order(action, late),
        }
    }

    /// Lets only `who` drive the robot, until this person leaves or says nothing for 3 s.
    ///
    /// # Errors
    ///
    /// Somebody else drives it.
    pub fn take_wheel(&mut self, who: &str) -> Result<Key, ActRefused> {
        let taken = self.wheel.take(who, self.now);
        taken.map_err(|by| ActRefused::Driven { by })
    }

    /// The driver turns the wheels for 150 ms; to drive on, the driver repeats the command.
    ///
    /// # Errors
    ///
    /// This person drives it no more, or as with [`Robot::act`].
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
            lease: COMMAND_LEASE,
        };
        self.order(action, late)
    }

    /// The driver moves the arm by a step.
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

    /// The driver says that he is still there.
    ///
    /// # Errors
    ///
    /// This person drives it no more.
    pub fn stay(&mut self, key: Key) -> Result<(), ActRefused> {
        self.word(key, None)
    }

    /// The driver leaves. The robot stands if the driver's last command still turns its wheels.
    pub fn leave_wheel(&mut self, key: Key) -> Option<StationLine> {
        self.without_driver(|wheel| wheel.leave(key))
    }

    /// Time has passed. A silent driver loses the wheel, and the robot has lost the actions that it
    /// did not answer in time.
    pub fn turn(&mut self, now: Duration) -> Option<StationLine> {
        self.now = now;
        let lost = self.asked.lost(now, false);
        self.lose(lost);
        self.without_driver(|wheel| wheel.lapse(now))
    }

    /// Takes what the robot has said since the last call.
    pub fn news(&mut self) -> Vec<Saying> {
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

    /// Makes the robot stand if its driver goes. `leaves` returns whether the driver's last command
    /// may still turn the wheels.
    fn without_driver(&mut self, leaves: impl FnOnce(&mut Wheel) -> bool) -> Option<StationLine> {
        let had_driver = self.wheel.driver().is_some();
        let drives = leaves(&mut self.wheel);
        let has_left = had_driver && self.wheel.driver().is_none();
        let commissioned = has_left.then(|| self.stand_commissioned()).flatten();
        commissioned.or_else(|| drives.then(|| self.stand())?)
    }

    /// Makes the robot stand because its driver has gone. Nobody waits for the answer.
    fn stand(&mut self) -> Option<StationLine> {
        let wheels = Wheels::new(OperatorCommand::Stop)?;
        let lease = COMMAND_LEASE;
        self.unanswered(Action::Drive { wheels, lease })
    }

    /// The same where it moves by a commissioning.
    fn stand_commissioned(&mut self) -> Option<StationLine> {
        let how = self.shown.commission.as_ref()?;
        let moves = how.value.moves == Some(true);
        moves.then(|| self.unanswered(Action::Commission(Commission::Stand)))?
    }

    fn unanswered(&mut self, action: Action) -> Option<StationLine> {
        self.hello.as_ref()?;
        let number = self.asked.number();
        let late_ms = 0;
        Some(StationLine::Order(Order::Do {
            number,
            late_ms,
            action,
        }))
    }

    pub(super) fn lose(&mut self, numbers: impl IntoIterator<Item = u32>) {
        let lost = numbers.into_iter().map(|number| Saying::Replied {
            number,
            reply: Reply::Lost,
        });
        self.told_news.extend(lost);
    }
}
