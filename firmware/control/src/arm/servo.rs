//! What is known about one servo.

use lager_ax12::ErrorBits;

use crate::servo_bus::Look;

/// How far a servo has been brought into service; drawn in the parent module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Setup {
    #[default]
    Unseen,
    Missing,
    Seen,
    Held,
    Ready,
}

/// A goal this near to the position is kept when a servo comes back and stepped from; one farther
/// off is not where the servo is going.
pub(super) const NEAR_GOAL: u16 = 30;

/// One servo.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Servo {
    pub(super) setup: Setup,
    /// Where it is told to be.
    pub(super) goal: u16,
    /// What it said last.
    pub(super) look: Look,
    pub(super) errors: ErrorBits,
    /// It did not get where it was told to.
    pub(super) stuck: bool,
}

impl Servo {
    /// Whether it has ever answered and still does.
    pub(super) fn is_seen(&self) -> bool {
        !matches!(self.setup, Setup::Unseen | Setup::Missing)
    }

    pub(super) fn is_ready(&self) -> bool {
        self.setup == Setup::Ready
    }

    pub(super) fn is_in_trouble(&self) -> bool {
        self.setup == Setup::Missing || self.stuck || !self.errors.is_empty()
    }

    /// It answered with its state. One that was away is brought into service again without moving
    /// it.
    pub(super) fn seen(&mut self, look: Look) {
        let away = !self.is_seen();
        let first = self.setup == Setup::Unseen;
        self.look = look;
        if away {
            self.setup = Setup::Seen;
            if first || !self.is_near_goal() {
                self.goal = look.position;
            }
        }
    }

    pub(super) fn distance(&self) -> u16 {
        self.goal.abs_diff(self.look.position)
    }

    pub(super) fn is_near_goal(&self) -> bool {
        self.distance() <= NEAR_GOAL
    }

    /// Where a relative movement starts from: the goal, so that what hangs on the arm does not make
    /// it sag step by step; the position, when the goal is not where the servo is.
    pub(super) fn base(&self) -> u16 {
        if self.is_near_goal() {
            self.goal
        } else {
            self.look.position
        }
    }
}
