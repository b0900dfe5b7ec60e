//! The actions that people give to robots that speak the extension, and the news of such robots.

use std::time::Duration;

use lager_lines::Name;
use lager_orders::lease::LATEST_MOVE;
use lager_orders::{Action, Wheels};
use lager_wire::OperatorArm;

use super::{Station, WishRefused};
use crate::given::Given;
use crate::robot::{ActRefused, Robot};
use crate::shown::Saying;
use crate::wheel::Key;

/// What a robot has just said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotSaid {
    /// The robot.
    pub robot: Name,
    /// When, by the station's clock.
    pub at: Duration,
    /// Its news.
    pub told: Saying,
}

/// What people want. An answer has the number of its action, see [`Saying::Replied`].
impl Station {
    /// Gives a robot an action.
    ///
    /// # Errors
    ///
    /// The robot takes no actions, or only its driver may give this one; see [`Robot::act`].
    pub fn act(
        &mut self,
        name: &Name,
        action: impl Into<Given<Action>>,
    ) -> Result<u32, WishRefused> {
        let (number, line) = self.known(name)?.act(action)?;
        self.say(name, Some(line));
        Ok(number)
    }

    /// Stops a robot, whoever drives it. A robot that speaks only the document's language confirms
    /// nothing, so its stop has no number.
    ///
    /// # Errors
    ///
    /// The robot speaks only the document's language and does not ask for commands.
    pub fn stop(&mut self, name: &Name) -> Result<Option<u32>, WishRefused> {
        let (number, line) = self.known(name)?.stop()?;
        self.say(name, line);
        Ok(number)
    }

    /// Lets only `who` drive a robot. A command that a GaG gave it ends.
    ///
    /// # Errors
    ///
    /// Somebody else drives it.
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

    /// The driver turns the wheels for 150 ms; to drive on, the driver repeats the command.
    ///
    /// # Errors
    ///
    /// This person drives it no more, or the robot takes no action.
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

    /// The driver moves the arm by a step.
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

    /// The driver says that he is still there, and moves nothing.
    ///
    /// # Errors
    ///
    /// This person drives it no more.
    pub fn stay(&mut self, name: &Name, key: Key) -> Result<(), WishRefused> {
        Ok(self.known(name)?.stay(key)?)
    }

    /// The driver leaves.
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

/// Time, and the news of robots.
impl Station {
    /// Time has passed. Call this before everything else that happens at the same moment, and at
    /// least every 100 ms. Time counts from any origin. If the station was held up, the commands
    /// that waited are dropped.
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

    /// What robots have said since the last call.
    pub fn news(&mut self) -> Vec<RobotSaid> {
        let mut news = Vec::new();
        let at = self.now;
        for (name, robot) in &mut self.robots {
            news.extend(robot.news().into_iter().map(|told| RobotSaid {
                robot: name.clone(),
                at,
                told,
            }));
        }
        news
    }
}
