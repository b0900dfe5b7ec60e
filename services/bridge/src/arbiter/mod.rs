//! Who may steer: the one place where orders of several origins become one stream of commands.
//!
//! It is apart from the shell because it must be provable: it is pure, owns no port and no clock,
//! and takes robot time as an argument, so the whole of it is tested in virtual time and the
//! simulation in one process runs the same code. It never decides what the robot should do; it
//! decides whose word counts, and that the word dies with the one who gave it.
//!
//! ```text
//!                 new id, allowed                     lease over, mode changed, stop
//!   +--------+ -------------------> +-----------+ ----------------------------------> +--------+
//!   |  idle  |                      |  running  |                                     |  idle  |
//!   +--------+ <------------------- +-----------+ <--+ same id: lease renewed         +--------+
//!     writes      one-shot finished      |      |----+                                  Standby
//!     Standby                            | newer id: takes over (T2)
//!                                        +-----------------> running
//! ```
//!
//! * **Identity**: `(origin, id)`. The same id renews, a new id executes; an id that has ended is
//!   never carried out again, its end is told again.
//! * **Lease**: [`LEASE`] from the moment given with the order. Only the order's own renewals
//!   extend it.
//! * **Setpoints and one-shots**: a setpoint (drive, standby) is a level. When it lapses, is
//!   stopped or loses its mode, a later renewal of the same id is taken up again once it is
//!   allowed. A one-shot (turn, arm step) is an event: however it ended, its id is used up.
//! * **The newest order takes over**, as the board's command register has it (T2). A one-shot
//!   that is replaced while it runs is reported as aborted; queueing is the external computer's
//!   task (C5).
//! * **Stop** latches, whoever sent it, until [`Arbiter::resume_from_stop`].
//! * **Mode**: in manual mode the operator drives and logic is ignored; in autonomous mode logic
//!   drives and the operator may stop, and may move the arm while logic's order in force is a
//!   standby with `arm_granted` (L10). Quarter turns and the drop are logic's alone (AMB-2,
//!   AMB-27). An arm order while a wheel command moves the robot is refused (AMB-28).
//! * **Sequence bytes** are 1..=255; a one-shot never gets the one the board last reported as
//!   finished. The board tells the same sequence byte from a new one, so a re-sent command renews
//!   and does not repeat.

mod ledger;
mod orders;
#[cfg(test)]
mod tests;
mod verdict;
mod wire;

use core::time::Duration;

use lager_topics::{Finish, Health, Mode, Origin, SteeringReport};
use lager_wire::{Command, SteerCommand, Version, WheelCommand};

use ledger::Ledger;
pub use ledger::{Ended, OrderKey};
pub use verdict::{Ignored, Refused, Verdict};

/// How long an order holds after its origin's last word, in robot time.
pub const LEASE: Duration = Duration::from_millis(120);

/// How often the command in force is written again to a version-1 board, so that its age stays
/// below the board's limit of 150 ms.
pub const RESEND: Duration = Duration::from_millis(40);

/// How long an order in force still holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lease {
    /// Until this moment.
    Until(Duration),
    /// Taken up from an earlier life of the bridge: nothing is written for it until its origin
    /// renews it, and it lapses at this moment (known after the first `advance`).
    Unclaimed(Option<Duration>),
}

impl Lease {
    fn is_over(self, now: Duration) -> bool {
        self.end().is_some_and(|end| end <= now)
    }

    fn end(self) -> Option<Duration> {
        match self {
            Self::Until(end) => Some(end),
            Self::Unclaimed(end) => end,
        }
    }

    fn renew(&mut self, received: Duration) {
        let end = received + LEASE;
        *self = match *self {
            Self::Until(earlier) => Self::Until(earlier.max(end)),
            Self::Unclaimed(_) => Self::Until(end),
        };
    }

    /// Gives an unclaimed lease its end, counted from the first moment the arbiter is told.
    fn start(&mut self, now: Duration) {
        if *self == Self::Unclaimed(None) {
            *self = Self::Unclaimed(Some(now + LEASE));
        }
    }
}

/// The order in force.
#[derive(Clone, Copy, Debug)]
struct Running {
    key: OrderKey,
    command: Command,
    seq: u8,
    arm_granted: bool,
    lease: Lease,
    /// Standby is written until then, so that the board has unlocked its arm.
    held_until: Option<Duration>,
    /// When it was first written.
    written: Option<Duration>,
    /// Set while a one-shot that was written before the link came up has to be found again in
    /// the board's reports.
    search: Option<Search>,
}

/// The search for a one-shot on a board that was away.
#[derive(Clone, Copy, Debug)]
struct Search {
    deadline: Duration,
    misses: u8,
}

/// Logic's granted standby, while an operator's arm order runs on top of it.
#[derive(Clone, Copy, Debug)]
struct Grant {
    /// `None` after a restart of the bridge, until logic has renewed it.
    key: Option<OrderKey>,
    lease: Lease,
}

/// The arbiter. See the module's head for its rules.
#[derive(Clone, Debug)]
pub struct Arbiter {
    mode: Mode,
    stopped: bool,
    parked: bool,
    running: Option<Running>,
    grant: Option<Grant>,
    last: Option<Ended>,
    ledger: Ledger,
    /// The orders last ignored, by origin, so that each is counted once.
    ignored: [Option<OrderKey>; 2],
    orders_refused: u32,
    leases_expired: u32,
    revision: u32,

    board: Option<Version>,
    /// Some earlier life of this link is known, so the board knows our last sequence byte.
    acquainted: bool,
    /// A standby to be written before anything else.
    prelude: Option<SteerCommand>,
    /// The sequence byte given out last.
    wire_seq: u8,
    /// The sequence byte of the standby that is written while nothing runs.
    idle_seq: u8,
    /// What the board was last told in this life of the link.
    written: Option<SteerCommand>,
    /// When a standby or arm command followed a moving one on the wire.
    halted_at: Option<Duration>,
    next_send: Duration,
    /// When a command that could not be written is tried again.
    retry_at: Option<Duration>,
    board_finished: Option<u8>,
}

impl Default for Arbiter {
    fn default() -> Self {
        Self::new()
    }
}

impl Arbiter {
    /// A robot that has just been switched on: manual mode, no stop latched, nothing in force.
    pub fn new() -> Self {
        Self {
            mode: Mode::Manual,
            stopped: false,
            parked: false,
            running: None,
            grant: None,
            last: None,
            ledger: Ledger::default(),
            ignored: [None; 2],
            orders_refused: 0,
            leases_expired: 0,
            revision: 0,
            board: None,
            acquainted: false,
            prelude: None,
            wire_seq: 0,
            idle_seq: 0,
            written: None,
            halted_at: None,
            next_send: Duration::ZERO,
            retry_at: None,
            board_finished: None,
        }
    }

    /// Goes on where an earlier life of the bridge ended: mode, latch, counters, and which order
    /// belongs to which sequence byte.
    ///
    /// Nothing is written for the order in force until its origin renews it; if nobody does
    /// within [`LEASE`], it lapses. Until then the board's own limit of 150 ms protects.
    pub fn resume(kept: &Health) -> Self {
        let mut arbiter = Self {
            mode: kept.mode.get().unwrap_or(Mode::Manual),
            stopped: kept.stopped != 0,
            orders_refused: kept.orders_refused,
            leases_expired: kept.leases_expired,
            acquainted: kept.wire_seq != 0,
            wire_seq: kept.wire_seq,
            ..Self::new()
        };
        // One setpoint may have been written and not told: its sequence byte is not used again.
        arbiter.next_seq();
        arbiter.idle_seq = arbiter.wire_seq;
        let finish = kept.finish.get().unwrap_or(Finish::None);
        if let (Some(origin), false) = (kept.finished_origin.get(), finish == Finish::None) {
            let key = OrderKey {
                origin,
                id: kept.finished_id,
            };
            let ended = Ended { key, finish };
            arbiter.last = Some(ended);
            arbiter.ledger.enter(ended);
        }
        let current = Command::from_code(kept.current_code).zip(kept.current_origin.get());
        if let (Some((command, origin)), false) = (current, arbiter.stopped) {
            let key = OrderKey {
                origin,
                id: kept.current_id,
            };
            arbiter.running = Some(Running {
                key,
                command,
                seq: kept.wire_seq,
                arm_granted: false,
                lease: Lease::Unclaimed(None),
                held_until: None,
                written: Some(Duration::ZERO),
                search: None,
            });
            if arbiter.mode == Mode::Autonomous && origin == Origin::Operator {
                arbiter.grant = Some(Grant {
                    key: None,
                    lease: Lease::Unclaimed(None),
                });
            }
        }
        arbiter
    }

    /// Latches the stop: whatever runs is aborted, and nothing drives until
    /// [`Arbiter::resume_from_stop`].
    pub fn stop(&mut self) {
        if self.stopped {
            return;
        }
        self.stopped = true;
        self.quiet();
    }

    /// Releases the latch. Nothing moves by that alone: an origin must renew or give an order.
    pub fn resume_from_stop(&mut self) {
        if self.stopped {
            self.stopped = false;
            self.revision = self.revision.wrapping_add(1);
        }
    }

    /// Changes who drives. The order in force ends.
    pub fn set_mode(&mut self, mode: Mode) {
        if self.mode != mode {
            self.mode = mode;
            self.quiet();
        }
    }

    /// Shuts down: whatever runs is aborted, and only standby is written from now on, at short
    /// intervals.
    pub fn park(&mut self) {
        if !self.parked {
            self.parked = true;
            self.quiet();
        }
    }

    /// Who drives.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Whether a stop is latched.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// The order in force and its command.
    pub fn current(&self) -> Option<(OrderKey, Command)> {
        self.running.map(|running| (running.key, running.command))
    }

    /// Whether the order in force is a setpoint: written once more it is the same.
    pub fn has_setpoint(&self) -> bool {
        self.running
            .is_some_and(|running| !running.command.is_one_shot())
    }

    /// The order that ended last, of those whose end is news.
    pub fn last_ended(&self) -> Option<Ended> {
        self.last
    }

    /// Grows whenever something has changed that [`Arbiter::fill`] writes, lease excepted.
    ///
    /// Publish before writing to the wire when it has: then a bridge that is killed between the
    /// two finds out from the board whether the order was carried out. Only where a setpoint has
    /// replaced a setpoint and nothing else has changed, one write may come before.
    pub fn revision(&self) -> u32 {
        self.revision
    }

    /// Writes the arbiter's part of `link/health`: all that [`Arbiter::resume`] needs.
    pub fn fill(&self, now: Duration, health: &mut Health) {
        health.mode = self.mode.into();
        health.stopped = self.stopped.into();
        health.orders_refused = self.orders_refused;
        health.leases_expired = self.leases_expired;
        health.wire_seq = self.wire_seq;
        let none = OrderKey {
            origin: Origin::Logic,
            id: 0,
        };
        let running = self.running;
        let current = running.map_or(none, |running| running.key);
        health.current_id = current.id;
        health.current_origin = current.origin.into();
        health.current_code = running.map_or(0, |running| running.command.code());
        health.next_lease_ms = running
            .and_then(|running| running.lease.end())
            .map_or(0, |end| {
                let left = end.saturating_sub(now).as_millis();
                u16::try_from(left).unwrap_or(u16::MAX)
            });
        let last = self.last.unwrap_or(Ended {
            key: none,
            finish: Finish::None,
        });
        health.finished_id = last.key.id;
        health.finished_origin = last.key.origin.into();
        health.finish = last.finish.into();
    }

    /// Writes the arbiter's part of `steering/state`: which order runs and which ended last.
    pub fn fill_report(&self, report: &mut SteeringReport) {
        let mut health = Health::default();
        self.fill(Duration::ZERO, &mut health);
        report.current_id = health.current_id;
        report.current_origin = health.current_origin;
        report.finished_id = health.finished_id;
        report.finished_origin = health.finished_origin;
        report.finish = health.finish;
    }

    /// Ends what runs, with nothing in its place.
    fn quiet(&mut self) {
        self.grant = None;
        if self.running.is_some() {
            self.finish_running(Finish::Aborted);
        }
        self.idle_seq = self.next_seq();
        self.revision = self.revision.wrapping_add(1);
    }

    /// Ends the order in force; logic's standby below it comes back if there is one.
    fn finish_running(&mut self, finish: Finish) {
        let Some(over) = self.running.take() else {
            return;
        };
        if over.command.is_one_shot() || finish == Finish::Refused {
            let key = over.key;
            self.ledger.enter(Ended { key, finish });
        }
        if over.command == STANDBY && finish != Finish::Refused {
            self.idle_seq = over.seq;
        } else {
            self.last = Some(Ended {
                key: over.key,
                finish,
            });
            self.idle_seq = self.next_seq();
        }
        if let Some(Grant {
            key: Some(key),
            lease,
        }) = self.grant.take()
        {
            self.running = Some(Running {
                key,
                command: STANDBY,
                seq: self.idle_seq,
                arm_granted: true,
                lease,
                held_until: None,
                written: None,
                search: None,
            });
        }
        self.revision = self.revision.wrapping_add(1);
    }
}

/// The command that moves nothing.
const STANDBY: Command = Command::Wheel(WheelCommand::Standby);

/// Whether a command turns the wheels.
fn moves(command: Command) -> bool {
    matches!(command, Command::Wheel(wheel) if wheel != WheelCommand::Standby)
}
