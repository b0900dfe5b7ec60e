//! What the arbiter says about an order.
//!
//! Apart from the arbiter so that the reasons stand in one place; they hold no logic.

use lager_topics::Finish;

/// What became of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is in force from now on.
    Executes,
    /// It was in force already; its lease is renewed.
    Renewed,
    /// It ended earlier; it is not carried out again.
    Ended(Finish),
    /// It does not count now, but its renewals may later.
    Ignored(Ignored),
    /// It will never be carried out.
    Refused(Refused),
    /// The stop is latched.
    Stopped,
}

/// Why an order does not count at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ignored {
    /// The mode gives the wheel to the other origin.
    NotInCharge,
    /// A stop is latched.
    StopLatched,
    /// The bridge is shutting down.
    ShuttingDown,
}

/// Why an order can never be carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// Origin, kind or command code have no meaning (AMB-52).
    Undefined,
    /// Only logic may give this command (AMB-2, AMB-27).
    LogicOnly,
    /// The arm is locked while the wheels move (T4, AMB-28).
    ArmLocked,
    /// The id in force came again with another code.
    CodeChanged,
}
