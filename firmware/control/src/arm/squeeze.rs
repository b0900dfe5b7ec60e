//! Closes the gripper on a thing of unknown size, step by step (AMB-29).
//!
//! ```text
//!   one step closer --> pause --> look --> load reached, no movement, or closed: over
//!         ^                         |
//!         '----------- else --------'
//! ```
//!
//! At the end the goal stays a little inside the thing; that makes the grip. A squeeze makes no
//! more steps than the gripper can go, so it ends whatever the servo answers.

use lager_wire::servo::GRIPPER;

use super::task::{GIVES_UP, Program, Squeeze};
use super::{Arm, Job, bit};

/// After this many steps without movement the gripper holds something (AMB-29).
const STILL_STEPS: u8 = 4;

impl Arm {
    pub(super) fn squeeze(&mut self, now_us: u32) {
        self.touched |= bit(GRIPPER);
        if !self.servos[GRIPPER].is_ready() {
            self.failed = true;
            self.finish();
            return;
        }
        self.servos[GRIPPER].stuck = false;
        self.servos[GRIPPER].goal = self.closer(self.servos[GRIPPER].base());
        self.program = Program::Squeeze(Squeeze {
            stepping: true,
            look_due_us: now_us,
            last_position: self.servos[GRIPPER].look.position,
            still: 0,
        });
    }

    pub(super) fn proceed_squeeze(
        &mut self,
        mut squeeze: Squeeze,
        job: Job,
        fine: bool,
        now_us: u32,
    ) {
        if !fine {
            self.failed = true;
            self.finish();
            return;
        }
        if let Job::Goal { .. } = job {
            squeeze.stepping = false;
            squeeze.look_due_us = now_us.wrapping_add(self.config.squeeze_period_us);
            self.program = Program::Squeeze(squeeze);
            return;
        }
        let servo = &self.servos[GRIPPER];
        let position = servo.look.position;
        if position == squeeze.last_position {
            squeeze.still += 1;
        } else {
            squeeze.still = 0;
            squeeze.last_position = position;
        }
        let gave_up = servo.errors.intersects(GIVES_UP);
        let loaded = servo.look.load.unsigned_abs() >= self.profile().squeeze_load();
        let closed = servo.goal == self.closer(servo.goal) && servo.distance() <= self.config.step;
        if gave_up || loaded || closed || squeeze.still >= STILL_STEPS {
            self.failed |= gave_up;
            self.finish();
            return;
        }
        self.servos[GRIPPER].goal = self.closer(self.servos[GRIPPER].goal);
        squeeze.stepping = true;
        self.program = Program::Squeeze(squeeze);
    }

    /// One step towards the closed gripper and not beyond it.
    fn closer(&self, position: u16) -> u16 {
        let profile = self.profile();
        let (open, closed) = (profile.gripper_open(), profile.gripper_closed());
        let step = self.config.step;
        if closed < open {
            position.saturating_sub(step).max(closed)
        } else {
            position.saturating_add(step).min(closed)
        }
    }
}
