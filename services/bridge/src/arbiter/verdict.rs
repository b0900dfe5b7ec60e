//! What the arbiter says about an order.
//!
//! It is apart from the arbiter so that the answers stand in one place; it holds no logic.

use lager_topics::{Finish, Refusal};

/// What became of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is in force from now on.
    Executes,
    /// It was in force already; its lease is renewed.
    Renewed,
    /// It ended earlier; it is not carried out again.
    Ended(Finish),
    /// It is not executed now, but its renewals may be later. Only logic gets this answer.
    Ignored(Refusal),
    /// It will never be carried out.
    Refused(Refusal),
}
