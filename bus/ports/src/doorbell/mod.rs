//! How one thread wakes another, in its own process or not: a board of bells in shared memory.
//!
//! It takes the place of iceoryx2's events. Each waiter has a seat on the board of its robot: one
//! futex word in shared memory, on which it sleeps for all its topics at once. A publisher adds to
//! the words of the roles that act on its topic, and makes a system call only where a word says
//! that its owner sleeps. Observers have no seat and cost a ringer nothing. There is nothing to
//! connect: a waiter that starts late, restarts or replaces a killed one is rung by the next
//! sample.
//!
//! | file | what it is |
//! |---|---|
//! | `word` | the ring and sleep protocol; `model` runs it under all interleavings of three threads with at most three preemptions |
//! | `futex` | the word as a futex |
//! | `board` | the shared memory: who is rung for what, who may spin |
//! | `segment`, `locks` | its file: joining, leaving, seats, what killed processes leave |
//! | `pace` | when looking without pause is worth it |
//!
//! **Invariant:** a ring is a hint, and so are its reasons (the topics it was for). A waiter has a
//! time-out and looks at everything now and then. Ringing and waiting do not allocate.

mod board;
mod futex;
mod locks;
#[cfg(test)]
mod model;
mod pace;
mod segment;
mod word;

use core::time::Duration;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use lager_topics::Role;

pub(crate) use pace::{Pace, Plan};
use segment::{Fault, Segment};
use word::Sleeper;

use crate::error::PortError;
use crate::fault::{Difference, TransportFault};
use crate::name::RobotName;
use crate::place::Place;

/// The reason of a ring by a thread of the waiter's own process.
pub(crate) const INSIDE: usize = 0;

/// The reason of a ring for the topic or request with the number `id`, the same in every process
/// and build. Two topics may share a reason; then a ring for one makes the waiter look at both.
pub(crate) const fn reason(id: u32) -> usize {
    1 + id as usize % (board::REASONS - 1)
}

/// A robot's board, opened when the first port of this process needs it and left with the last.
pub(crate) struct Board {
    place: Place,
    robot: RobotName,
    segment: Mutex<Weak<Segment>>,
}

impl Board {
    /// The board of `robot`, which is not opened yet.
    pub(crate) fn of(place: &Place, robot: &RobotName) -> Self {
        Self {
            place: place.clone(),
            robot: robot.clone(),
            segment: Mutex::default(),
        }
    }

    fn open(&self, role: Role) -> Result<Arc<Segment>, PortError> {
        let mut known = self.segment.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(segment) = known.upgrade() {
            return Ok(segment);
        }
        // Its folder is made if it is missing.
        self.place.robot(&self.robot);
        let path = self.place.bells(&self.robot);
        let segment = Segment::join(&path).map_err(|fault| error(role, fault))?;
        let segment = Arc::new(segment);
        *known = Arc::downgrade(&segment);
        Ok(segment)
    }
}

/// Clears the seats of killed processes on one robot's board, or removes it if it is unused.
pub(crate) fn sweep(place: &Place, robot: &RobotName) {
    sweep_at(&place.bells(robot));
}

/// The same for every robot of the bus.
pub(crate) fn sweep_all(place: &Place) {
    for robot in place.robots() {
        sweep(place, &robot);
    }
}

fn sweep_at(path: &std::path::Path) {
    // A board that cannot be swept now, because a process is just joining, is swept the next time.
    // The last process to leave removes the file.
    if let Ok(Some(segment)) = Segment::existing(path) {
        let _ = segment.sweep();
    }
}

/// The living processes whose waiters are rung for `role`; a process may wait more than once.
pub(crate) fn woken(place: &Place, robot: &RobotName, role: Role) -> Vec<u32> {
    match Segment::existing(&place.bells(robot)) {
        Ok(Some(segment)) => segment.woken(role),
        _ => Vec::new(),
    }
}

/// The actor's end: one seat.
pub(crate) struct Bell {
    segment: Arc<Segment>,
    seat: usize,
    sleeper: Sleeper,
}

impl Bell {
    /// Hangs a bell of that role.
    pub(crate) fn hang(board: &Board, role: Role) -> Result<Self, PortError> {
        let segment = board.open(role)?;
        let seat = segment
            .take_seat(role)
            .map_err(|fault| error(role, fault))?;
        let sleeper = Sleeper::new(segment.seat(seat));
        Ok(Self {
            segment,
            seat,
            sleeper,
        })
    }

    /// Whether it has rung since it was last asked. No system call.
    #[inline]
    pub(crate) fn rung(&self) -> bool {
        self.sleeper.rung(self.segment.seat(self.seat))
    }

    /// Whether it has rung for `reason` since this was last asked. Call it after a ring was
    /// noticed.
    #[inline]
    pub(crate) fn rung_for(&self, reason: usize) -> bool {
        word::rung_for(self.segment.seat(self.seat), reason)
    }

    /// Sleeps until a ring, at most `timeout`; true if it was one, or a signal. If it has rung
    /// since it was last asked it does not sleep.
    pub(crate) fn sleep(&self, timeout: Duration) -> bool {
        self.sleeper.sleep(self.segment.seat(self.seat), timeout)
    }

    /// Asks for the right to look without pause, which at most `limit` waiters have at a time.
    pub(crate) fn may_spin(&self, limit: usize) -> bool {
        self.segment.may_spin(self.seat, limit)
    }

    /// Gives that right back.
    pub(crate) fn stop_spinning(&self) {
        self.segment.stop_spinning(self.seat);
    }

    /// A ringer for the threads of this process.
    pub(crate) fn seat_ringer(&self) -> SeatRinger {
        SeatRinger {
            segment: Arc::clone(&self.segment),
            seat: self.seat,
        }
    }
}

impl Drop for Bell {
    fn drop(&mut self) {
        self.segment.leave_seat(self.seat);
    }
}

/// The end of whoever rings the waiters of a role.
pub(crate) struct RoleRinger {
    segment: Arc<Segment>,
    role: Role,
    reason: usize,
}

impl RoleRinger {
    /// A ringer of the bells of `role`, present and future, for samples of the topic or request
    /// with the number `id`.
    pub(crate) fn to(board: &Board, role: Role, id: u32) -> Result<Self, PortError> {
        Ok(Self {
            segment: board.open(role)?,
            role,
            reason: reason(id),
        })
    }

    /// Rings every waiter of the role. A system call for each that sleeps, and none otherwise.
    #[inline]
    pub(crate) fn ring(&self) {
        self.segment.ring(self.role, self.reason);
    }

    /// Has every waiter of the role look when it is next awake. No system call.
    #[inline]
    pub(crate) fn leave(&self) {
        self.segment.leave(self.role, self.reason);
    }
}

/// A ringer of one bell, for the threads of its own process; clones ring the same bell. After the
/// bell is gone, a ring may wake the next owner of its seat in vain.
#[derive(Clone)]
pub(crate) struct SeatRinger {
    segment: Arc<Segment>,
    seat: usize,
}

impl SeatRinger {
    /// Rings.
    pub(crate) fn ring(&self) {
        word::ring(self.segment.seat(self.seat), INSIDE);
    }
}

fn error(role: Role, fault: Fault) -> PortError {
    let topic = format!("bell of {role}");
    match fault {
        Fault::OtherLayout => PortError::OtherLayout {
            topic,
            difference: Difference::Board,
        },
        Fault::Busy => PortError::Busy {
            topic,
            fault: TransportFault::InMotion,
        },
        Fault::NoSeat => PortError::TooManyWaiters {
            role,
            limit: board::SEATS_PER_ROLE,
        },
        Fault::File(error) if error.kind() == std::io::ErrorKind::PermissionDenied => {
            PortError::Permission { topic }
        }
        Fault::File(error) => PortError::Transport {
            topic,
            fault: error.into(),
        },
    }
}
