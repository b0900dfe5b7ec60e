//! The arm's manoeuvres: picking goods up and letting them go. Each of their steps is an order that
//! runs once.
//!
//! ```text
//!   pick:  aim, open -> reach, close -> lift, hold -> to the carry pose -> something there? -> Done
//!              ^                              | nothing                      | nothing
//!              +-- aim elsewhere, five times -+------------------------------+-------> Failed
//! ```
//!
//! What was gripped badly slips out after seconds. So the goods are held over their stand until they
//! would have slipped: there they fall back onto it, and can be gripped better.
//!
//! The robot stands while the arm works. Its progress is published, so that a successor goes on
//! with the same attempt; it repeats a move that may already have been made.
//!
//! When the steering board or the bridge has restarted, nobody knows where the arm is: without
//! torque it sags. Then the attempt is made again and not counted: from its begin, or, so that the
//! goods are not let go in the air, from the closing of the claw.

use core::time::Duration;

use lager_topics::{FailureKind, Finish};
use lager_wire::{ArmCommand, Command};

use super::helm::{Helm, Pause, STANDBY};
use super::outcome::Outcome;
use crate::arm::{ArmSeen, BASE, ELBOW, SHOULDER};
use crate::config::LogicConfig;

/// A joint is where it should be when no further step would bring it nearer.
const NEAR: i32 = 2;
/// Steps for one joint after which something must be wrong with the arm.
const MOST_STEPS: u16 = 400;
/// Where to aim at each attempt, from straight ahead: there first, then 20 and 40 mm to either
/// side.
const AIMS: [i16; 5] = [0, 21, -21, 42, -42];
/// Moves of one attempt.
const MOVES: u8 = 9;
/// The one that closes the claw.
const SQUEEZE: u8 = 4;

/// One move of an attempt.
enum Move {
    /// Give a command once.
    Once(ArmCommand),
    /// Step a joint until it stands at a position.
    Bring(&'static Joint, u16),
    /// Hold what was gripped, and see whether it stays.
    Hold,
}

/// One joint, and the commands that step it.
struct Joint {
    servo: usize,
    raise: ArmCommand,
    lower: ArmCommand,
}

static BASE_JOINT: Joint = Joint {
    servo: BASE,
    raise: ArmCommand::Left,
    lower: ArmCommand::Right,
};
static SHOULDER_JOINT: Joint = Joint {
    servo: SHOULDER,
    raise: ArmCommand::Up,
    lower: ArmCommand::Down,
};
static ELBOW_JOINT: Joint = Joint {
    servo: ELBOW,
    raise: ArmCommand::Out,
    lower: ArmCommand::In,
};

impl Joint {
    /// The command that brings it nearer, `None` when it is there. A servo that has not reported
    /// yet is not waited for: the first step makes it report.
    fn step_towards(&self, to: u16, arm: &ArmSeen) -> Option<ArmCommand> {
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

/// What the arm is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// Bring the goods in front of the robot to where they are carried.
    Pick,
    /// Let them go.
    Drop,
}

/// A routine of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ArmSequence {
    task: Task,
    /// Attempts and moves of this one that are done.
    pub(crate) attempt: u8,
    pub(crate) moves: u8,
    /// Steps given for the move at hand.
    steps: u16,
    /// The step at work.
    step: Option<ArmCommand>,
    /// When the claw was closed.
    gripped_at: Option<Duration>,
    /// The life of the link in which its moves were made.
    life: Option<u32>,
    /// How often the step at hand has been begun anew.
    pub(crate) tries: u8,
    pub(crate) pause: Pause,
}

impl ArmSequence {
    /// One that begins when the robot has come to rest.
    pub(crate) const fn new(task: Task) -> Self {
        Self {
            task,
            attempt: 0,
            moves: 0,
            steps: 0,
            step: None,
            gripped_at: None,
            life: None,
            tries: 0,
            pause: Pause::Wanted,
        }
    }

    /// As a predecessor left it, with `ordered` in force.
    pub(crate) fn restore(&mut self, attempt: u8, moves: u8, tries: u8, ordered: Command) {
        self.attempt = attempt.min(AIMS.len() as u8 - 1);
        self.moves = moves.min(MOVES);
        self.tries = tries;
        if let Command::Arm(step) = ordered {
            self.step = Some(step);
            self.pause = Pause::None;
        }
    }

    /// The order for the step at work.
    pub(crate) fn wanted(&self) -> Command {
        match self.pause {
            Pause::None => self.step.map_or(STANDBY, Command::Arm),
            Pause::Wanted | Pause::Until(_) => STANDBY,
        }
    }

    /// Has it stand for a moment before the step at hand is given again.
    pub(crate) fn interrupt(&mut self) {
        self.step = None;
        self.pause = Pause::Wanted;
    }

    /// The order for the step has ended.
    pub(crate) fn ended(&mut self, finish: Finish, now: Duration) -> Option<Outcome> {
        match finish {
            Finish::None => None,
            Finish::Done if self.task == Task::Drop => Some(Outcome::Done),
            Finish::Done => {
                let step = self.step.take();
                self.tries = 0;
                if step == Some(ArmCommand::Squeeze) {
                    self.gripped_at = Some(now);
                }
                self.moves += u8::from(matches!(
                    step,
                    Some(ArmCommand::Release | ArmCommand::Squeeze)
                ));
                None
            }
            _ => {
                self.interrupt();
                None
            }
        }
    }

    /// Gives the next step when the one before has ended.
    pub(crate) fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        if self.pause != Pause::None {
            if !self
                .pause
                .is_over(helm.now, helm.config.settle, helm.active)
            {
                return None;
            }
            self.tries += 1;
            helm.out.status_changed = true;
            let (most, tries) = (helm.config.tries, self.tries);
            if tries > most {
                let (most, tries) = (f32::from(most), f32::from(tries));
                return Some(Outcome::Failed(FailureKind::BoardRefuses, most, tries));
            }
        }
        if self.step.is_some() || !helm.active {
            return None;
        }
        match self.task {
            Task::Drop => self.give(ArmCommand::Drop, helm),
            Task::Pick => return self.pick(helm),
        }
        None
    }

    fn give(&mut self, step: ArmCommand, helm: &mut Helm<'_>) {
        self.step = Some(step);
        helm.order.give_anew();
    }

    /// Gives the next step of the attempt, or judges it.
    fn pick(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        let (profile, arm) = (&helm.config.arm, helm.senses.arm);
        let life = core::mem::replace(&mut self.life, arm.life());
        if life.is_some() && life != self.life {
            self.moves = if self.moves > SQUEEZE { SQUEEZE } else { 0 };
            (self.steps, self.gripped_at) = (0, None);
        }
        let is_empty = arm
            .claw_is_empty(profile, helm.config.held_margin)
            .is_some();
        let before = self.moves;
        while self.moves < MOVES {
            match next_move(self.moves, AIMS[usize::from(self.attempt)], helm.config) {
                Move::Once(command) => {
                    self.give(command, helm);
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
                        self.steps += 1;
                        if self.steps > MOST_STEPS {
                            let seen = arm.position(joint.servo).map_or(0.0, f32::from);
                            let jammed = FailureKind::ArmJammed;
                            return Some(Outcome::Failed(jammed, f32::from(to), seen));
                        }
                        self.give(step, helm);
                        return None;
                    }
                }
            }
            self.moves += 1;
            self.steps = 0;
        }
        if !is_empty {
            return Some(Outcome::Done);
        }
        let attempts = AIMS.len() as u8;
        if self.attempt + 1 == attempts {
            let attempts = f32::from(attempts);
            let nothing = FailureKind::GoodsMissing;
            return Some(Outcome::Failed(nothing, attempts, attempts));
        }
        (self.attempt, self.moves) = (self.attempt + 1, 0);
        self.pick(helm)
    }
}

/// The moves of an attempt in their order: to the goods, and to where they are carried.
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
