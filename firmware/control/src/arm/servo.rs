//! What the board knows about one servo of the arm.

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
    Limp,
}

/// A servo that comes back keeps a goal this near to its position, and steps start from it. A goal
/// farther off is not where the servo is going.
pub(super) const NEAR_GOAL: u16 = 30;

/// One servo.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Servo {
    pub(super) setup: Setup,
    /// The position that the board sent it to.
    pub(super) goal: u16,
    /// Its last answer to a look.
    pub(super) look: Look,
    pub(super) errors: ErrorBits,
    /// It stopped short of its goal.
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

    /// The servo answered with its state. If it was missing before, it is set up again without
    /// being moved.
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

    /// Where a step starts. From the goal, so that the arm's load does not make it sag step by
    /// step; from the position if the goal is far from it.
    pub(super) fn base(&self) -> u16 {
        if self.is_near_goal() {
            self.goal
        } else {
            self.look.position
        }
    }
}
