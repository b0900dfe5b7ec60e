//! What a person wants of a robot that speaks the extension, and what such robots say.

use std::time::Duration;

use lager_lines::command::Wheels;
use lager_lines::extension::Action;
use lager_lines::{LATEST_MOVE, Name};
use lager_wire::OperatorArm;

use super::{Station, WishRefused};
use crate::given::Given;
use crate::robot::{ActRefused, Robot};
use crate::shown::Told;
use crate::wheel::Key;

/// What a robot has just said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct News {
    /// Which.
    pub robot: Name,
    /// When, by the station's clock.
    pub at: Duration,
    /// What.
    pub told: Told,
}

/// What people want. Numbers are those of the answers, see [`Told::Replied`].
impl Station {
    /// Gives a robot an action.
    ///
    /// # Errors
    ///
    /// When it takes none, or it is its driver's to do that; see [`Robot::act`].
    pub fn act(
        &mut self,
        name: &Name,
        action: impl Into<Given<Action>>,
    ) -> Result<u32, WishRefused> {
        let (number, line) = self.known(name)?.act(action)?;
        self.say(name, Some(line));
        Ok(number)
    }

    /// Stops a robot, whoever drives it. One that speaks only the document's language confirms
    /// nothing, so its stop has no number.
    ///
    /// # Errors
    ///
    /// When it speaks only that and does not ask for commands.
    pub fn stop(&mut self, name: &Name) -> Result<Option<u32>, WishRefused> {
        let (number, line) = self.known(name)?.stop()?;
        self.say(name, line);
        Ok(number)
    }

    /// Lets `who` drive a robot, and nobody else: what a GaG has told it ends.
    ///
    /// # Errors
    ///
    /// When somebody else drives it.
    pub fn take_wheel(&mut self, name: &Name, who: &str) -> Result<Key, WishRefused> {
        let robot = self.known(name)?;
        let key = robot.take_wheel(who)?;
        let waited = robot.commands().next().is_some();
        let line = robot.end_commands();
        self.say(name, line);
        if waited {
            let by = who.to_owned();
            self.tell_gag_of(name, &ActRefused::Driven { by }.to_string());
        }
        Ok(key)
    }

    /// Its driver turns the wheels, for 150 ms unless he does so again.
    ///
    /// # Errors
    ///
    /// When he drives it no more, or the robot takes no action.
    pub fn drive(
        &mut self,
        name: &Name,
        key: Key,
        wheels: impl Into<Given<Wheels>>,
    ) -> Result<u32, WishRefused> {
        let (number, line) = self.known(name)?.drive(key, wheels)?;
        self.say(name, Some(line));
        Ok(number)
    }

    /// Its driver moves the arm by a step.
    ///
    /// # Errors
    ///
    /// As with [`Station::drive`].
    pub fn arm(
        &mut self,
        name: &Name,
        key: Key,
        step: impl Into<Given<OperatorArm>>,
    ) -> Result<u32, WishRefused> {
        let (number, line) = self.known(name)?.arm(key, step)?;
        self.say(name, Some(line));
        Ok(number)
    }

    /// Its driver is still there, though he drives nowhere.
    ///
    /// # Errors
    ///
    /// When he drives it no more.
    pub fn stay(&mut self, name: &Name, key: Key) -> Result<(), WishRefused> {
        Ok(self.known(name)?.stay(key)?)
    }

    /// Its driver leaves.
    pub fn leave_wheel(&mut self, name: &Name, key: Key) {
        if let Some(robot) = self.robots.get_mut(name) {
            let line = robot.leave_wheel(key);
            self.say(name, line);
        }
    }

    fn known(&mut self, name: &Name) -> Result<&mut Robot, WishRefused> {
        let robot = self.robots.get_mut(name);
        robot.ok_or_else(|| WishRefused::NoRobot(name.clone()))
    }
}

/// Time, and what robots say.
impl Station {
    /// Time has passed. To be called before anything else that happens at this moment, and at least
    /// every 100 ms; it counts from any origin. Commands that have waited while the station was held
    /// up are dropped.
    pub fn turn(&mut self, now: Duration) {
        let pause = now.saturating_sub(self.now);
        self.now = now;
        if pause > LATEST_MOVE {
            self.forget_commands(pause);
        }
        self.watch_gag();
        let mut said = Vec::new();
        for (name, robot) in &mut self.robots {
            if let Some(line) = robot.turn(now) {
                said.push((name.clone(), line));
            }
        }
        for (name, line) in said {
            self.say(&name, Some(line));
        }
        self.give_up_silent();
    }

    /// The moment of the last turn.
    pub const fn now(&self) -> Duration {
        self.now
    }

    /// What robots have said since this was asked last.
    pub fn news(&mut self) -> Vec<News> {
        let mut news = Vec::new();
        let at = self.now;
        for (name, robot) in &mut self.robots {
            news.extend(robot.news().into_iter().map(|told| News {
                robot: name.clone(),
                at,
                told,
            }));
        }
        news
    }
}
