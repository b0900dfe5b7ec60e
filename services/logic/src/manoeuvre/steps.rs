//! Moves the arm step by step. Each step is a one-shot order, and the next one follows when it has
//! ended.
//!
//! ```text
//!   stand for a moment --> give a step --> Done: the next one
//!          ^                   |
//!          +-------------------+ Aborted, Refused, unheard: the same again, so many times
//! ```

use lager_topics::{FailureKind, Finish};
use lager_wire::servo::{BASE, ELBOW, SHOULDER};
use lager_wire::{ArmCommand, Command};

use super::helm::{Helm, Pause, STANDBY};
use crate::arm::ArmSeen;
use crate::ending::Ending;

/// A joint has arrived when no further step would bring it nearer.
const NEAR: i32 = 2;

/// One joint, and the commands that step it.
pub(super) struct Joint {
    pub(super) servo: usize,
    raise: ArmCommand,
    lower: ArmCommand,
}

pub(super) static BASE_JOINT: Joint = Joint {
    servo: BASE,
    raise: ArmCommand::Left,
    lower: ArmCommand::Right,
};
pub(super) static SHOULDER_JOINT: Joint = Joint {
    servo: SHOULDER,
    raise: ArmCommand::Up,
    lower: ArmCommand::Down,
};
pub(super) static ELBOW_JOINT: Joint = Joint {
    servo: ELBOW,
    raise: ArmCommand::Out,
    lower: ArmCommand::In,
};

impl Joint {
    /// The command that brings it nearer; `None` when it has arrived. It does not wait for a servo
    /// that has not reported yet: the first step makes it report.
    pub(super) fn step_towards(&self, to: u16, arm: &ArmSeen) -> Option<ArmCommand> {
        let Some(position) = arm.heard(self.servo) else {
            return Some(self.raise);
        };
        match i32::from(to) - i32::from(position) {
            missing if missing > NEAR => Some(self.raise),
            missing if missing < -NEAR => Some(self.lower),
            _ => None,
        }
    }
}

/// The present step, and its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    step: Option<ArmCommand>,
    /// How often the present step was begun again.
    pub(super) tries: u8,
    pause: Pause,
}

impl Steps {
    /// They begin when the robot has come to rest.
    pub(super) const NEW: Self = Self {
        step: None,
        tries: 0,
        pause: Pause::Wanted,
    };

    /// The steps as an earlier navigator left them, with `ordered` in force.
    pub(super) fn restore(&mut self, tries: u8, ordered: Command) {
        self.tries = tries;
        if let Command::Arm(step) = ordered {
            self.step = Some(step);
            self.pause = Pause::None;
        }
    }

    /// The order for the present step.
    pub(super) fn wanted(&self) -> Command {
        match self.pause {
            Pause::None => self.step.map_or(STANDBY, Command::Arm),
            Pause::Wanted | Pause::Until(_) => STANDBY,
        }
    }

    /// Makes the robot stand for a moment before the present step is given again.
    pub(super) fn interrupt(&mut self) {
        self.step = None;
        self.pause = Pause::Wanted;
    }

    /// The order for the step has ended. Returns the step if it succeeded.
    pub(super) fn ended(&mut self, finish: Finish) -> Option<ArmCommand> {
        match finish {
            Finish::None => None,
            Finish::Done => {
                self.tries = 0;
                self.step.take()
            }
            _ => {
                self.interrupt();
                None
            }
        }
    }

    /// Whether the next step may begin now.
    ///
    /// # Errors
    /// The failure, if the present step was given in vain too often.
    pub(super) fn may_go_on(&mut self, helm: &mut Helm<'_>) -> Result<bool, Ending> {
        if self.pause != Pause::None {
            let settle = helm.config.settle;
            if !self.pause.is_over(helm.now, settle, helm.active) {
                return Ok(false);
            }
            self.tries += 1;
            helm.out.status_changed = true;
            let (most, tries) = (helm.config.tries, self.tries);
            if tries > most {
                let (most, tries) = (f32::from(most), f32::from(tries));
                return Err(Ending::Failed(FailureKind::BoardRefuses, most, tries));
            }
        }
        Ok(self.step.is_none() && helm.active)
    }

    /// Gives a step.
    pub(super) fn give(&mut self, step: ArmCommand, helm: &mut Helm<'_>) {
        self.step = Some(step);
        helm.order.give_anew();
    }
}
