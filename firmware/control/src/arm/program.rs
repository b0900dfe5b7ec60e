//! Carries out the commands of the arm, question by question (K, A6).
//!
//! ```text
//!   step, Release   Move
//!   Drop            Move to the drop pose --> Move: open --> Move to the neutral pose
//!   Squeeze         write a step closer --> pause, look --> load, no movement, closed: over
//!                        ^----------------------'
//!
//!   Move:    write every goal --> look at the servos not yet there, one after the other
//!            A servo leaves the list when it has arrived, rests, is overloaded, does not answer,
//!            or the time is up.
//!
//!   abort:   Move --> Freeze: look where each moving servo is, make that its goal
//! ```
//!
//! Every state ends: each question has a time-out, each Move has a deadline, and a squeeze makes no
//! more steps than the gripper can go.

use lager_ax12::table;
use lager_wire::servo::{BASE, ELBOW, GRIPPER, ROTATION, SHOULDER, WRIST};
use lager_wire::{ArmCommand, ArmPose};

use super::servo::NEAR_GOAL;
use super::task::{Freeze, GIVES_UP, Move, Program, Then};
use super::{Arm, Job, SERVOS, bit};
use crate::time::reached;

/// How a command of the arm ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmEnd {
    /// It was carried out.
    Done,
    /// It was broken off, or a servo that it needs failed.
    Aborted,
}

impl Arm {
    /// Begins the command. `false`: it would move a joint out of its limits and does not run.
    pub(super) fn begin(&mut self, command: ArmCommand, now_us: u32) -> bool {
        match command {
            ArmCommand::Left => return self.step(BASE, true, now_us),
            ArmCommand::Right => return self.step(BASE, false, now_us),
            ArmCommand::Up => return self.step(SHOULDER, true, now_us),
            ArmCommand::Down => return self.step(SHOULDER, false, now_us),
            ArmCommand::Out => return self.step(ELBOW, true, now_us),
            ArmCommand::In => return self.step(ELBOW, false, now_us),
            ArmCommand::CounterClockwise => return self.step(ROTATION, true, now_us),
            ArmCommand::Clockwise => return self.step(ROTATION, false, now_us),
            ArmCommand::Squeeze => self.squeeze(now_us),
            ArmCommand::Release => self.open(Then::Nothing, now_us),
            ArmCommand::Drop => self.take_pose(self.profile().drop_pose(), Then::Open, now_us),
        }
        true
    }

    /// Ends the command. `being_written` is the servo whose new goal is on the wire, as a bit.
    pub(super) fn break_off(&mut self, being_written: u8) {
        let moving = match &self.program {
            Program::Idle | Program::Freeze(_) => return,
            Program::Move(movement) => movement.wait & (!movement.write | being_written),
            // The gripper stops within one small step, and must keep what it holds.
            Program::Squeeze(_) => 0,
        };
        self.failed = true;
        self.program = Program::Freeze(Freeze {
            left: moving,
            looked: false,
        });
        if moving == 0 {
            self.finish();
        }
    }

    pub(super) fn program_job(&mut self, now_us: u32) -> Option<Job> {
        match &mut self.program {
            Program::Idle => None,
            Program::Move(movement) => {
                if let Some(index) = lowest(movement.write) {
                    return Some(Job::Goal {
                        index,
                        speed: movement.speed,
                    });
                }
                if !reached(now_us, movement.look_due_us) {
                    return None;
                }
                let after = movement.last_looked + 1;
                let index = (after..after + SERVOS)
                    .map(|index| index % SERVOS)
                    .find(|index| movement.wait & bit(*index) != 0)?;
                movement.last_looked = index;
                Some(Job::Look(index))
            }
            Program::Squeeze(squeeze) if squeeze.stepping => Some(Job::Goal {
                index: GRIPPER,
                speed: self.config.step_speed,
            }),
            Program::Squeeze(squeeze) => {
                reached(now_us, squeeze.look_due_us).then_some(Job::Look(GRIPPER))
            }
            Program::Freeze(freeze) => {
                let index = lowest(freeze.left)?;
                Some(if freeze.looked {
                    Job::Goal {
                        index,
                        speed: self.config.sequence_speed,
                    }
                } else {
                    Job::Look(index)
                })
            }
        }
    }

    pub(super) fn program_due_us(&self, now_us: u32) -> Option<u32> {
        match &self.program {
            Program::Idle => None,
            Program::Move(movement) if movement.write == 0 => Some(movement.look_due_us),
            Program::Squeeze(squeeze) if !squeeze.stepping => Some(squeeze.look_due_us),
            Program::Move(_) | Program::Squeeze(_) | Program::Freeze(_) => Some(now_us),
        }
    }

    /// Goes on after the program's question; `fine` says whether the servo did what it was asked.
    pub(super) fn proceed(&mut self, job: Job, fine: bool, now_us: u32) {
        match core::mem::replace(&mut self.program, Program::Idle) {
            Program::Idle => {}
            Program::Move(movement) => self.proceed_move(movement, job, fine, now_us),
            Program::Squeeze(squeeze) => self.proceed_squeeze(squeeze, job, fine, now_us),
            Program::Freeze(freeze) => self.proceed_freeze(freeze, job, fine),
        }
    }

    pub(super) fn finish(&mut self) {
        self.program = Program::Idle;
        self.untold |= self.touched;
        self.finished = Some(if self.failed {
            ArmEnd::Aborted
        } else {
            ArmEnd::Done
        });
    }

    /// One small step of a joint. `false`: the joint is at its limit already.
    fn step(&mut self, joint: usize, forward: bool, now_us: u32) -> bool {
        let base = match self.partner(joint) {
            Some(partner) if !self.servos[joint].is_ready() => {
                table::MAX_POSITION - self.servos[partner].base()
            }
            _ => self.servos[joint].base(),
        };
        let step = self.config.step;
        let limits = self.profile().limits(joint);
        let (way_left, goal) = if forward {
            let goal = base.saturating_add(step).min(limits.highest);
            (base < limits.highest, goal)
        } else {
            let goal = base.saturating_sub(step).max(limits.lowest);
            (base > limits.lowest, goal)
        };
        // The position of a servo that does not answer is unknown; `go` reports its failure.
        if !way_left && self.servos[joint].is_ready() {
            return false;
        }
        let mut goals = Goals::default();
        self.aim(&mut goals, joint, goal);
        let (speed, timeout_us) = (self.config.step_speed, self.config.step_timeout_us);
        self.go(
            &goals,
            Manner {
                speed,
                timeout_us,
                tolerance: 1,
                then: Then::Nothing,
            },
            now_us,
        );
        true
    }

    fn take_pose(&mut self, pose: ArmPose, then: Then, now_us: u32) {
        let mut goals = Goals::default();
        for (joint, position) in [
            (BASE, pose.base),
            (SHOULDER, pose.shoulder),
            (ELBOW, pose.elbow),
            (WRIST, pose.wrist),
        ] {
            self.aim(&mut goals, joint, position);
        }
        self.go_softly(&goals, then, now_us);
    }

    fn open(&mut self, then: Then, now_us: u32) {
        let mut goals = Goals::default();
        self.aim(&mut goals, GRIPPER, self.profile().gripper_open());
        self.go_softly(&goals, then, now_us);
    }

    /// Sets a joint's goal, and that of its mirrored servo.
    fn aim(&self, goals: &mut Goals, joint: usize, goal: u16) {
        goals[joint] = Some(goal);
        if let Some(partner) = self.partner(joint) {
            goals[partner] = Some(table::MAX_POSITION - goal);
        }
    }

    fn go_softly(&mut self, goals: &Goals, then: Then, now_us: u32) {
        let (speed, timeout_us) = (self.config.sequence_speed, self.config.sequence_timeout_us);
        self.go(
            goals,
            Manner {
                speed,
                timeout_us,
                tolerance: 6,
                then,
            },
            now_us,
        );
    }

    /// Sends servos to their goals, except servos out of service.
    fn go(&mut self, goals: &Goals, manner: Manner, now_us: u32) {
        let mut write = 0;
        for (index, goal) in goals.iter().enumerate() {
            let Some(goal) = *goal else { continue };
            self.touched |= bit(index);
            if self.servos[index].is_ready() {
                self.servos[index].goal = goal;
                self.servos[index].stuck = false;
                write |= bit(index);
            } else {
                self.failed = true;
            }
        }
        let movement = Move {
            write,
            wait: write,
            resting: 0,
            last_looked: 0,
            speed: manner.speed,
            tolerance: manner.tolerance,
            timeout_us: manner.timeout_us,
            deadline_us: now_us.wrapping_add(manner.timeout_us),
            look_due_us: now_us,
            then: manner.then,
        };
        self.go_on(movement, now_us);
    }

    fn proceed_move(&mut self, mut movement: Move, job: Job, fine: bool, now_us: u32) {
        let index = job.index();
        if !fine {
            movement.write &= !bit(index);
            movement.wait &= !bit(index);
            self.failed = true;
        } else if let Job::Goal { .. } = job {
            movement.write &= !bit(index);
            movement.deadline_us = now_us.wrapping_add(movement.timeout_us);
        } else {
            self.judge(&mut movement, index);
        }
        movement.look_due_us = now_us.wrapping_add(self.config.look_period_us);
        if movement.write == 0 && movement.wait != 0 && reached(now_us, movement.deadline_us) {
            self.give_up(&mut movement);
        }
        self.go_on(movement, now_us);
    }

    /// Decides whether the movement still waits for the servo that was just looked at.
    fn judge(&mut self, movement: &mut Move, index: usize) {
        let servo = &self.servos[index];
        let rests = !servo.look.moving;
        if servo.errors.intersects(GIVES_UP) {
            self.failed = true;
        } else if !rests || servo.distance() > movement.tolerance {
            // A servo also rests before it begins to move, so only the second time counts.
            let rested = movement.resting & bit(index) != 0;
            movement.resting &= !bit(index);
            if !rests {
                return;
            }
            movement.resting |= bit(index);
            if !rested {
                return;
            }
            self.note_stuck(index);
        }
        movement.wait &= !bit(index);
    }

    fn give_up(&mut self, movement: &mut Move) {
        for index in 0..SERVOS {
            if movement.wait & bit(index) != 0 {
                self.note_stuck(index);
            }
        }
        movement.wait = 0;
    }

    /// Notes a servo that stopped short. Any load bends a servo a little, so only a large distance
    /// is a failure.
    fn note_stuck(&mut self, index: usize) {
        if self.servos[index].distance() > NEAR_GOAL {
            self.servos[index].stuck = true;
            self.failed = true;
        }
    }

    fn go_on(&mut self, movement: Move, now_us: u32) {
        if movement.write != 0 || movement.wait != 0 {
            self.program = Program::Move(movement);
            return;
        }
        match movement.then {
            Then::Nothing => self.finish(),
            Then::Open => self.open(Then::Raise, now_us),
            Then::Raise => self.take_pose(self.profile().neutral(), Then::Nothing, now_us),
        }
    }

    fn proceed_freeze(&mut self, mut freeze: Freeze, job: Job, fine: bool) {
        let index = job.index();
        freeze.looked = matches!(job, Job::Look(_)) && fine;
        if freeze.looked {
            self.servos[index].goal = self.servos[index].look.position;
        } else {
            freeze.left &= !bit(index);
        }
        let left = freeze.left;
        self.program = Program::Freeze(freeze);
        if left == 0 {
            self.finish();
        }
    }
}

/// Goals for some of the servos.
type Goals = [Option<u16>; SERVOS];

/// How a Move goes.
struct Manner {
    speed: u16,
    timeout_us: u32,
    /// A resting servo this near to its goal has arrived.
    tolerance: u16,
    then: Then,
}

fn lowest(mask: u8) -> Option<usize> {
    (mask != 0).then_some(mask.trailing_zeros() as usize)
}
