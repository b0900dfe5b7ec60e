//! The state of a running arm command. `program` and `squeeze` both carry it out; it stands in its
//! own file so that neither imports the other.

use lager_ax12::ErrorBits;

/// Errors after which a servo switches its torque off by itself.
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
    /// Servos whose goal is not written yet, as bits.
    pub(super) write: u8,
    /// Servos that have not arrived yet, as bits.
    pub(super) wait: u8,
    /// Servos that rested at the last look, as bits.
    pub(super) resting: u8,
    pub(super) last_looked: usize,
    pub(super) speed: u16,
    pub(super) tolerance: u16,
    pub(super) timeout_us: u32,
    pub(super) deadline_us: u32,
    pub(super) look_due_us: u32,
    pub(super) then: Then,
}

/// What follows when a Move has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Then {
    Nothing,
    Open,
    Raise,
}

/// Stops moving servos where they are.
#[derive(Debug, Clone)]
pub(super) struct Freeze {
    pub(super) left: u8,
    /// Whether the first of them has answered a look; its position is then its goal.
    pub(super) looked: bool,
}

/// The gripper while it closes.
#[derive(Debug, Clone)]
pub(super) struct Squeeze {
    /// Whether the next question writes a step; otherwise it is a look.
    pub(super) stepping: bool,
    pub(super) look_due_us: u32,
    pub(super) last_position: u16,
    pub(super) still: u8,
}
