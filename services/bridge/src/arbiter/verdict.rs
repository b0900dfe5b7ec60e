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
    /// It does not count now, but its renewals may later. Only logic is told so.
    Ignored(Refusal),
    /// It will never be carried out.
    Refused(Refusal),
}
