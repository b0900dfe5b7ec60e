//! The arm: up to eight AX-12 servos for six joints, moved in small steps and one sequence (A1-A6,
//! AMB-29..32).
//!
//! ```text
//!   number   1 base   2+3 shoulder   4+5 elbow   6 wrist   7 wrist rotation   8 gripper
//!
//!   position grows:  1 to the left   2 up   4 out   6 tilting the gripper up
//!                    7 counter-clockwise   8 opening
//!   3 and 5 face their partners: their position is 1023 minus the partner's
//! ```
//!
//! The profile says which id each number has, whether 3 and 5 exist, and which joints count the other
//! way. Only `ask` and `note` know ids, and turn positions and loads round. When the profile names
//! other servos, the command under way ends and all of them are brought into service, which makes
//! them hold where they are.
//!
//! Both directions share one wire. The module uses it for these tasks, most urgent first: the
//! command under way (`program`), bringing a servo into service, a look at the next servo (a
//! question for its state). Bringing into service moves no servo, so a restarted board drops
//! nothing:
//!
//! ```text
//!              answers             goal = position         torque on
//!   unseen ---------------> seen -----------------> held ------------> ready
//!      |                     '-- the arm is limp: torque off --> limp    |
//!   missing <----------- no answer, twice, wherever it happens ---------'
//!      '-- answers ------^
//! ```
//!
//! A limp arm has no torque, so that a person can move it; its commands fail. When it is not limp any
//! more, all servos are brought into service where they are then.
//!
//! A missing servo never delays the others: the board flags it, leaves it out and asks it again in
//! its turn.
//!
//! No command moves a joint out of the limits of the profile. A profile counts only if its poses lie
//! inside; a step ends at a limit or is refused there. A joint can be outside if somebody moved it by
//! hand or the limits came later. The board does not move it back by itself: only steps towards the
//! limits are allowed.

mod config;
mod program;
mod servo;
mod squeeze;
mod task;

use lager_ax12::{ErrorBits, table};
use lager_wire::servo::{ELBOW, SHOULDER};
use lager_wire::{ArmCommand, ArmData, ArmValues};

pub use config::ArmConfig;
pub use program::ArmEnd;
use servo::{Servo, Setup};
use task::Program;

use crate::SteeringBoard;
use crate::servo_bus::{ServoAnswer, ServoBus};
use crate::time::{first, reached};

/// How many servos the arm has at most; number n at index n - 1.
pub const SERVOS: usize = ArmData::SERVOS as usize;

const fn bit(index: usize) -> u8 {
    1 << index
}

/// What [`Arm::start`] did with a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// The command runs.
    Begun,
    /// A command is under way or a servo is being brought into service; ask again.
    NotYet,
    /// The command would move a joint out of its limits; nothing has happened.
    Outside,
}

/// One question to a servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Job {
    Look(usize),
    Goal { index: usize, speed: u16 },
    Switch(usize),
}

impl Job {
    const fn index(self) -> usize {
        match self {
            Self::Look(index) | Self::Goal { index, .. } | Self::Switch(index) => index,
        }
    }
}

/// The arm's servos and what they are doing.
#[derive(Debug, Clone)]
pub struct Arm {
    config: ArmConfig,
    bus: ServoBus,
    servos: [Servo; SERVOS],
    program: Program,
    /// The question under way and whether the program asked it.
    asked: Option<(Job, bool)>,
    /// Servos that the program has moved or tried to move.
    touched: u8,
    /// Whether servos in service still have to get a new torque limit.
    torque_untold: bool,
    /// Whether a servo that the program needs has failed.
    failed: bool,
    finished: Option<ArmEnd>,
    /// Servos whose state the Pi has not heard yet.
    untold: u8,
    next_round: usize,
    round_due_us: u32,
}

impl Arm {
    /// An arm whose servos the board has not asked yet.
    #[must_use]
    pub fn new(config: ArmConfig, now_us: u32) -> Self {
        Self {
            bus: ServoBus::new(config.reply_timeout_us),
            config,
            servos: [Servo::default(); SERVOS],
            program: Program::Idle,
            asked: None,
            touched: 0,
            torque_untold: false,
            failed: false,
            finished: None,
            untold: 0,
            next_round: 0,
            round_due_us: now_us,
        }
    }

    /// Whether a command is under way, or has ended and nobody has fetched its end.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        !matches!(self.program, Program::Idle) || self.finished.is_some()
    }

    /// Begins a command if the arm is free and the command stays within the limits.
    pub fn start(&mut self, command: ArmCommand, now_us: u32) -> Start {
        if self.is_busy() || self.is_settling() {
            return Start::NotYet;
        }
        self.touched = 0;
        self.failed = false;
        if self.begin(command, now_us) {
            Start::Begun
        } else {
            Start::Outside
        }
    }

    /// The profile in force.
    #[must_use]
    pub fn profile(&self) -> &ArmValues {
        &self.config.profile
    }

    /// Puts another profile in force; the caller has validated it. A moving servo goes on to its
    /// old goal. Servos in service get the new torque limit without being moved. If the profile
    /// names other servos or directions, or makes the arm limp or ends that, the command under way is
    /// broken off, and every servo is brought into service where it is.
    pub fn set_profile(&mut self, profile: ArmValues) {
        let before = core::mem::replace(&mut self.config.profile, profile);
        self.torque_untold |= profile.torque_limit() != before.torque_limit();
        if profile.has_servos_of(&before) {
            return;
        }
        self.servos = [Servo::default(); SERVOS];
        // The answer to the question under way is of no servo that is known now.
        self.asked = None;
        self.tell_all();
        if !matches!(self.program, Program::Idle) {
            self.failed = true;
            self.finish();
        }
    }

    /// The servo that faces this one, if the joint has two.
    fn partner(&self, index: usize) -> Option<usize> {
        let has_two = matches!(index, SHOULDER | ELBOW) && self.profile().has(index + 1);
        has_two.then_some(index + 1)
    }

    /// Stops the moving servos where they are. [`Arm::poll`] returns the end when that is done.
    pub fn abort(&mut self) {
        let mut being_written = 0;
        if let Some((job, by_program)) = &mut self.asked
            && core::mem::take(by_program)
            && matches!(job, Job::Goal { .. })
        {
            being_written = bit(job.index());
        }
        self.break_off(being_written);
    }

    /// Takes in the servos' bytes and asks the next question. Returns the end of a command once.
    pub fn poll(&mut self, board: &mut impl SteeringBoard, now_us: u32) -> Option<ArmEnd> {
        if let Some(answer) = self.bus.poll(board, now_us)
            && let Some((job, by_program)) = self.asked.take()
        {
            let fine = self.note(job, answer);
            if by_program {
                self.proceed(job, fine, now_us);
            }
        }
        if self.bus.is_idle() {
            if core::mem::take(&mut self.torque_untold) {
                self.bring_in_again();
            }
            self.asked = self.choose(now_us);
            if let Some((job, _)) = self.asked {
                self.ask(job, board, now_us);
            }
        }
        self.finished.take()
    }

    /// The latest time at which the caller must call [`Arm::poll`] again.
    #[must_use]
    pub fn next_due_us(&self, now_us: u32) -> u32 {
        if let Some(due_us) = self.bus.next_due_us(now_us) {
            return due_us;
        }
        let round_due_us = if self.is_settling() {
            now_us
        } else {
            self.round_due_us
        };
        match self.program_due_us(now_us) {
            Some(due_us) => first(now_us, due_us, round_due_us),
            None => round_due_us,
        }
    }

    /// The next servo state that the Pi has not heard; it counts as reported from then on.
    pub fn take_report(&mut self) -> Option<ArmData> {
        let index = self.untold_index()?;
        self.untold &= !bit(index);
        let servo = &self.servos[index];
        Some(ArmData {
            servo: index as u8 + 1,
            errors: servo.errors.bits(),
            position: servo.look.position,
            load: servo.look.load,
            decivolts: servo.look.decivolts,
            celsius: servo.look.celsius,
        })
    }

    /// Whether [`Arm::take_report`] has something.
    #[must_use]
    pub fn has_report(&self) -> bool {
        self.untold_index().is_some()
    }

    /// Marks every servo's state as not reported, for a Pi that has just connected.
    pub fn tell_all(&mut self) {
        self.untold = u8::MAX;
    }

    /// Servos in trouble, number 1 in bit 0: missing, stuck, or reporting an error.
    #[must_use]
    pub fn errors(&self) -> u8 {
        let mut errors = 0;
        for (index, servo) in self.servos.iter().enumerate() {
            if servo.is_in_trouble() {
                errors |= bit(index);
            }
        }
        errors
    }

    /// Questions that no servo answered; stays at 255.
    #[must_use]
    pub fn timeouts(&self) -> u8 {
        self.bus.timeouts()
    }

    fn untold_index(&self) -> Option<usize> {
        (0..SERVOS).find(|index| self.untold & bit(*index) != 0 && self.servos[*index].is_seen())
    }

    /// Whether a servo is being brought into service, or will be next.
    fn is_settling(&self) -> bool {
        self.torque_untold || self.unfinished_setup().is_some()
    }

    /// Sets up all servos in service again, which gives them the new torque limit.
    fn bring_in_again(&mut self) {
        for servo in &mut self.servos {
            if matches!(servo.setup, Setup::Held | Setup::Ready) {
                servo.setup = Setup::Seen;
            }
        }
    }

    fn unfinished_setup(&self) -> Option<Job> {
        self.servos
            .iter()
            .enumerate()
            .find_map(|(index, servo)| match servo.setup {
                Setup::Unseen => self.profile().has(index).then_some(Job::Look(index)),
                Setup::Seen if !self.profile().is_limp() => Some(Job::Goal {
                    index,
                    speed: self.config.sequence_speed,
                }),
                Setup::Seen | Setup::Held => Some(Job::Switch(index)),
                Setup::Ready | Setup::Limp | Setup::Missing => None,
            })
    }

    fn choose(&mut self, now_us: u32) -> Option<(Job, bool)> {
        if let Some(job) = self.program_job(now_us) {
            return Some((job, true));
        }
        if let Some(job) = self.unfinished_setup() {
            return Some((job, false));
        }
        if !reached(now_us, self.round_due_us) {
            return None;
        }
        let mut index = self.next_round;
        // No two servos in a row are absent.
        if !self.profile().has(index) {
            index += 1;
        }
        self.next_round = (index + 1) % SERVOS;
        self.round_due_us = now_us.wrapping_add(self.config.round_period_us);
        self.untold |= bit(index);
        Some((Job::Look(index), false))
    }

    fn ask(&mut self, job: Job, board: &mut impl SteeringBoard, now_us: u32) {
        let profile = self.config.profile;
        let id = profile.id(job.index());
        match job {
            Job::Look(_) => self.bus.look(id, board, now_us),
            Job::Goal { index, speed } => {
                let mut goal = self.servos[index].goal;
                if profile.is_reversed(index) {
                    goal = table::MAX_POSITION - goal;
                }
                let values = (goal, speed, profile.torque_limit());
                self.bus.set_goal(id, values, board, now_us);
            }
            Job::Switch(_) => self.bus.switch(id, !profile.is_limp(), board, now_us),
        }
    }

    /// Stores an answer. Returns whether the servo did what the question asked.
    fn note(&mut self, job: Job, answer: ServoAnswer) -> bool {
        const NOT_DONE: ErrorBits = ErrorBits::CHECKSUM
            .union(ErrorBits::INSTRUCTION)
            .union(ErrorBits::RANGE);
        let is_reversed = self.profile().is_reversed(job.index());
        let is_limp = self.profile().is_limp();
        let servo = &mut self.servos[job.index()];
        let ServoAnswer::Status { errors, look } = answer else {
            servo.setup = Setup::Missing;
            return false;
        };
        servo.errors = errors;
        let done = !errors.intersects(NOT_DONE);
        match (job, look) {
            (Job::Look(_), Some(mut look)) => {
                if is_reversed {
                    look.position = table::MAX_POSITION - look.position;
                    look.load = -look.load;
                }
                servo.seen(look);
            }
            (Job::Look(_), None) => {
                servo.setup = Setup::Missing;
                return false;
            }
            (Job::Goal { .. }, _) if servo.setup == Setup::Seen => {
                servo.setup = if done { Setup::Held } else { Setup::Missing };
            }
            (Job::Switch(_), _) if is_limp && done => servo.setup = Setup::Limp,
            (Job::Switch(_), _) => {
                servo.setup = if done { Setup::Ready } else { Setup::Missing };
            }
            (Job::Goal { .. }, _) => {}
        }
        done
    }
}
