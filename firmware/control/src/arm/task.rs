//! What a command of the arm remembers while it runs. Programs and squeezes carry it out; it stands
//! below both, so that neither needs the other.

use lager_ax12::ErrorBits;

/// Errors with which a servo switches its torque off.
pub(super) const GIVES_UP: ErrorBits = ErrorBits::OVERLOAD.union(ErrorBits::OVERHEATING);

/// What a command is doing.
#[derive(Debug, Clone)]
pub(super) enum Program {
    Idle,
    Move(Move),
    Squeeze(Squeeze),
    Freeze(Freeze),
}

/// Servos under way to their goals.
#[derive(Debug, Clone)]
pub(super) struct Move {
    /// Goals still to be written.
    pub(super) write: u8,
    /// Servos not yet there.
    pub(super) wait: u8,
    /// Servos that stood still when last looked at.
    pub(super) resting: u8,
    pub(super) last_looked: usize,
    pub(super) speed: u16,
    pub(super) tolerance: u16,
    pub(super) timeout_us: u32,
    pub(super) deadline_us: u32,
    pub(super) look_due_us: u32,
    pub(super) then: Then,
}

/// What follows a Move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Then {
    Nothing,
    Open,
    Raise,
}

/// Moving servos being stopped where they are.
#[derive(Debug, Clone)]
pub(super) struct Freeze {
    pub(super) left: u8,
    /// Whether the first of them was looked at and its goal set to where it is.
    pub(super) looked: bool,
}

/// The gripper closing.
#[derive(Debug, Clone)]
pub(super) struct Squeeze {
    /// Whether the next thing is to write a step.
    pub(super) stepping: bool,
    pub(super) look_due_us: u32,
    pub(super) last_position: u16,
    pub(super) still: u8,
}
