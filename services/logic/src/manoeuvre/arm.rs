//! The arm's manoeuvres: picking goods up and letting them go. Each of their steps is a one-shot
//! order.
//!
//! ```text
//!   pick:  aim, open -> reach, close -> lift, hold -> to the carry pose -> something there? -> Done
//!              ^                              | nothing                      | nothing
//!              +-- aim elsewhere, five times -+------------------------------+-------> Failed
//! ```
//!
//! Goods in a bad grip slip out after seconds. So the arm holds them over their stand until they
//! would have slipped: there they fall back onto it, and the robot can grip them better.
//!
//! The robot stands while the arm works. Its progress is published, so that a successor goes on
//! with the same attempt. It repeats a move that may already have been made.
//!
//! When the steering board or the bridge has restarted, nobody knows where the arm is: without
//! torque it sags. Then the attempt is repeated and does not count. It is repeated from its
//! beginning, or from the closing of the claw if the claw would drop the goods otherwise.
//!
//! While a servo does not answer, nothing moves: half of an arm does not bring the goods to the claw.

use core::time::Duration;

use lager_floor::Heading;
use lager_topics::{FailureKind, Finish, NavigatorStatus};
use lager_wire::{ArmCommand, Command};

use super::behaviour::Behaviour;
use super::helm::{Helm, Senses};
use super::steps::{BASE_JOINT, ELBOW_JOINT, Joint, SHOULDER_JOINT, Steps};
use crate::arm::ArmSeen;
use crate::config::LogicConfig;
use crate::ending::Ending;

/// If one joint takes more steps than this, something is wrong with the arm.
const MOST_STEPS: u16 = 400;
/// Where to aim at each attempt: straight ahead first, then 20 and 40 mm to either side.
const AIMS: [i16; 5] = [0, 21, -21, 42, -42];
/// Moves of one attempt.
const MOVES: u8 = 9;
/// The number of the move that closes the claw.
const SQUEEZE: u8 = 4;

/// One move of an attempt.
enum Move {
    /// Give a command once.
    Once(ArmCommand),
    /// Step a joint until it reaches a position.
    Bring(&'static Joint, u16),
    /// Hold the goods, and see whether they stay.
    Hold,
}

/// What the arm has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// Take the goods in front of the robot, to the carry pose.
    Pick,
    /// Let them go.
    Drop,
}

/// A routine of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ArmSequence {
    task: Task,
    /// How many attempts are over, and how many moves of this one.
    attempt: u8,
    moves: u8,
    /// How many steps the present move has taken.
    count: u16,
    steps: Steps,
    /// When the claw was closed.
    gripped_at: Option<Duration>,
    /// The life of the link in which its moves were made.
    life: Option<u32>,
}

impl ArmSequence {
    /// A routine that begins when the robot has come to rest.
    pub(crate) const fn new(task: Task) -> Self {
        Self {
            task,
            attempt: 0,
            moves: 0,
            count: 0,
            steps: Steps::NEW,
            gripped_at: None,
            life: None,
        }
    }

    /// Whether the board or the bridge has restarted since the last move. A successor of the
    /// navigator, who did not see it, concludes it from servos that have not reported.
    fn is_of_another_life(&mut self, arm: &ArmSeen) -> bool {
        let Some(life) = arm.life() else {
            return false;
        };
        match self.life.replace(life) {
            Some(before) => before != life,
            None => self.moves > 0 && arm.is_unheard(),
        }
    }

    /// Gives the next step of the attempt, or judges it.
    fn pick(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let (profile, arm) = (&helm.config.arm, helm.senses.arm);
        if self.is_of_another_life(&arm) {
            self.moves = if self.moves > SQUEEZE { SQUEEZE } else { 0 };
            (self.count, self.gripped_at) = (0, None);
        }
        let is_empty = arm
            .claw_is_empty(profile, helm.config.held_margin)
            .is_some();
        let before = self.moves;
        while self.moves < MOVES {
            match next_move(self.moves, AIMS[usize::from(self.attempt)], helm.config) {
                Move::Once(command) => {
                    self.steps.give(command, helm);
                    return None;
                }
                Move::Hold if is_empty => break,
                Move::Hold => {
                    let gripped_at = *self.gripped_at.get_or_insert(helm.now);
                    if helm.now.saturating_sub(gripped_at) < helm.config.grip_proof {
                        helm.out.status_changed |= self.moves != before;
                        return None;
                    }
                }
                Move::Bring(joint, to) => {
                    if let Some(step) = joint.step_towards(to, &arm) {
                        self.count += 1;
                        if self.count > MOST_STEPS {
                            let seen = arm.position(joint.servo).map_or(0.0, f32::from);
                            let jammed = FailureKind::ArmJammed;
                            return Some(Ending::Failed(jammed, f32::from(to), seen));
                        }
                        self.steps.give(step, helm);
                        return None;
                    }
                }
            }
            self.moves += 1;
            self.count = 0;
        }
        if !is_empty {
            return Some(Ending::Done);
        }
        let attempts = AIMS.len() as u8;
        if self.attempt + 1 == attempts {
            let attempts = f32::from(attempts);
            let nothing = FailureKind::GoodsMissing;
            return Some(Ending::Failed(nothing, attempts, attempts));
        }
        (self.attempt, self.moves) = (self.attempt + 1, 0);
        self.pick(helm)
    }
}

impl Behaviour for ArmSequence {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        self.steps.wanted()
    }

    fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Ending> {
        if finish == Finish::Done && self.task == Task::Drop {
            return Some(Ending::Done);
        }
        let step = self.steps.ended(finish)?;
        if step == ArmCommand::Squeeze {
            self.gripped_at = Some(helm.now);
        }
        self.moves += u8::from(matches!(step, ArmCommand::Release | ArmCommand::Squeeze));
        None
    }

    /// Gives the next step when the one before has ended.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let silent = helm.senses.arm.silent(&helm.config.arm);
        match (self.steps.may_go_on(helm), silent) {
            (Err(_), Some((id, count))) => {
                let (count, id) = (f32::from(count), f32::from(id));
                return Some(Ending::Failed(FailureKind::ServoSilent, count, id));
            }
            (Err(failed), None) => return Some(failed),
            (Ok(false), _) => {}
            // The board may just be bringing it into service.
            (Ok(true), Some(_)) => self.steps.interrupt(),
            (Ok(true), None) if self.task == Task::Pick => return self.pick(helm),
            (Ok(true), None) => self.steps.give(ArmCommand::Drop, helm),
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
        self.attempt = status.arm_attempt.min(AIMS.len() as u8 - 1);
        self.moves = status.arm_moves.min(MOVES);
        self.steps.restore(status.tries, ordered);
    }

    fn fill(&self, status: &mut NavigatorStatus) {
        status.tries = self.steps.tries;
        (status.arm_attempt, status.arm_moves) = (self.attempt, self.moves);
    }
}

/// The moves of an attempt in their order: to the goods, and to the carry pose.
fn next_move(done: u8, aim: i16, config: &LogicConfig) -> Move {
    let carry = &config.arm.carry;
    match done {
        0 => Move::Bring(&BASE_JOINT, carry.base.saturating_add_signed(aim)),
        1 => Move::Once(ArmCommand::Release),
        2 => Move::Bring(&ELBOW_JOINT, config.reach_elbow),
        3 => Move::Bring(&SHOULDER_JOINT, config.reach_shoulder),
        SQUEEZE => Move::Once(ArmCommand::Squeeze),
        5 => Move::Bring(&SHOULDER_JOINT, carry.shoulder),
        6 => Move::Hold,
        7 => Move::Bring(&ELBOW_JOINT, carry.elbow),
        _ => Move::Bring(&BASE_JOINT, carry.base),
    }
}
