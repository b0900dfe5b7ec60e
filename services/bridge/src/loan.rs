//! The loan of the boards' ports: `lager board` gets them while the robot is up.
//!
//! ```text
//!              the stop of `lager board` is obeyed, and its lock is held
//!   at work  -------------------------------------------------------------->  lent
//!            <--------------------------------------------------------------
//!              the lock is free: the command has ended, or was killed
//! ```
//!
//! * The kernel frees the lock however the command ends, so no loan outlives it, and nothing has to
//!   be taken back. A bridge that starts meanwhile looks at the lock before it opens a port.
//! * A loan begins only while the robot is stopped, 200 ms after the bridge has obeyed. By then the
//!   board has its standby, and a board that did not hear it has stopped by itself.
//! * While the ports are lent nobody can release the stop, because nobody would see that the robot
//!   goes on when its boards come back.
//! * After the loan the boards do their handshakes, and the stop stays until somebody resumes.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};

use lager_home::{Home, UnitName};
use lager_sample::Part;

/// The part of a process that has borrowed the boards of a robot.
pub const BORROWER: Part = Part::new(15, "boards");

/// How often the lock is looked at, in ns.
const LOOK_NS: u64 = 50_000_000;

/// What main loop and readers know of it.
pub(crate) struct Loan<'a> {
    home: &'a Home,
    unit: &'a UnitName,
    is_lent: AtomicBool,
}

impl<'a> Loan<'a> {
    /// How long after a stop it begins, in robot time. A steering board of ours stops by itself
    /// within 150 ms.
    pub(crate) const AFTER: Duration = Duration::from_millis(200);

    /// The loan of this unit's ports, as it is now.
    pub(crate) fn new(home: &'a Home, unit: &'a UnitName) -> Self {
        Self {
            home,
            unit,
            is_lent: AtomicBool::new(home.is_held(unit, BORROWER)),
        }
    }

    /// Whether the ports are lent.
    pub(crate) fn is_lent(&self) -> bool {
        self.is_lent.load(Ordering::Acquire)
    }
}

/// When the main loop looks.
#[derive(Debug, Default)]
pub(crate) struct Looking {
    next_ns: u64,
}

impl Looking {
    /// Looks at the lock, if it is time. Returns whether the ports are lent from now on, if that has
    /// changed.
    pub(crate) fn look(&mut self, now_ns: u64, loan: &Loan<'_>) -> Option<bool> {
        if now_ns < self.next_ns {
            return None;
        }
        self.next_ns = now_ns + LOOK_NS;
        let is_held = loan.home.is_held(loan.unit, BORROWER);
        let was_lent = loan.is_lent.swap(is_held, Ordering::AcqRel);
        (was_lent != is_held).then_some(is_held)
    }
}
