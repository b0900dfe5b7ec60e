//! The arbiter's answers to an order.
//!
//! They stand apart from the arbiter so that all answers stand in one place, without logic.

use lager_topics::{Finish, Refusal};

/// The answer to an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is in force from now on.
    Executes,
    /// It was in force already; its lease is renewed.
    Renewed,
    /// It ended earlier, and is not carried out again.
    Ended(Finish),
    /// It is not executed now, but a renewal may be later. Only logic gets this answer.
    Ignored(Refusal),
    /// It will never be carried out.
    Refused(Refusal),
}
