//! Brings the arm back to its carry pose, before the robot leaves goods that it has not picked up.
//!
//! ```text
//!   shoulder up -> elbow in -> base back -> all joints where they are carried: Ready
//!          | a step given in vain too often, or too many of them
//!          +-------------------------> stand, until a person's hand has brought the arm there
//! ```
//!
//! The claw stays as it is. A successor looks where the joints are, and goes on from there.

use lager_floor::Heading;
use lager_topics::{Finish, NavigatorStatus};
use lager_wire::Command;

use super::behaviour::Behaviour;
use super::helm::{Helm, Senses};
use super::steps::{BASE_JOINT, ELBOW_JOINT, SHOULDER_JOINT, Steps};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// If all joints together take more steps than this, something is wrong with the arm. It is twice
/// the arm's whole way.
const MOST_STEPS: u16 = 800;

/// The arm on its way back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fold {
    steps: Steps,
    /// How many steps it has taken.
    count: u16,
    /// It has done its own part: a person must do the rest.
    is_over: bool,
}

impl Fold {
    /// One that begins when the robot has come to rest.
    pub(crate) const NEW: Self = Self {
        steps: Steps::NEW,
        count: 0,
        is_over: false,
    };
}

impl Behaviour for Fold {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        self.steps.wanted()
    }

    fn ended(&mut self, finish: Finish, _: &mut Helm<'_>) -> Option<Ending> {
        self.steps.ended(finish);
        None
    }

    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let (carry, arm) = (helm.config.arm.carry, helm.senses.arm);
        if self.is_over {
            let off = arm.joint_off(carry, helm.config.carry_tolerance);
            return off.is_none().then_some(Ending::Ready);
        }
        match self.steps.may_go_on(helm) {
            Ok(false) => return None,
            Ok(true) if self.count < MOST_STEPS => {}
            _ => {
                self.steps.interrupt();
                self.is_over = true;
                return None;
            }
        }
        let next = [
            (&SHOULDER_JOINT, carry.shoulder),
            (&ELBOW_JOINT, carry.elbow),
            (&BASE_JOINT, carry.base),
        ]
        .into_iter()
        .find_map(|(joint, to)| joint.step_towards(to, &arm));
        match next {
            Some(step) => {
                self.count += 1;
                self.steps.give(step, helm);
            }
            None => self.is_over = true,
        }
        None
    }

    fn turns_wheels(&self) -> bool {
        false
    }

    fn interrupt(&mut self) {
        self.steps.interrupt();
    }

    fn restore(&mut self, status: &NavigatorStatus, ordered: Command) {
        self.steps.restore(status.tries, ordered);
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.tries = self.steps.tries;
    }
}
