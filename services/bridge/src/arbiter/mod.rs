//! Who may steer: the one place where orders of several origins become one stream of commands.
//!
//! It is apart from the shell so that it can be proven: it is pure, owns no port and no clock, and
//! takes robot time as an argument. So all of it is tested in virtual time, and the simulation in
//! one process runs the same code. It does not decide what the robot should do. It decides whose
//! order is obeyed, and ends an order when its origin is gone.
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
//! * **Identity**: `(origin, id)`. The same id renews an order, a new id is executed. An id that
//!   has ended is never executed again; the arbiter only reports its end again.
//! * **Lease**: [`LEASE`] from the moment given with the order. Only the order's own renewals
//!   extend it.
//! * **Setpoints and one-shots**: a setpoint (drive, standby) is a level. A one-shot (turn, arm
//!   step) is an event: however it ended, its id is used up.
//! * **Nothing comes back by itself.** An order that has ended for any reason (lease, stop, mode, a
//!   board that was reset or away, a pause of this process, the death of the one before) has its id
//!   used up, and a renewal moves nothing, whoever gave it. Its origin hears the end, looks, and
//!   gives a new one.
//! * **Nothing comes late.** An order begins within [`STALE`] of the moment when its person gave it
//!   or logic sent it last, or never. A person's order that is not allowed at once is used up, too;
//!   logic's may begin once it is allowed.
//! * **No motion unseen**: unless the steering board has reported within [`REPORT_DEADLINE`], every
//!   order that moves something ends, and no origin may move anything. An original board does not
//!   report and has no limit on a command's age. So it gets only standby, unless the configuration
//!   accepts the risk ([`Arbiter::drive_original_boards`]).
//! * **The newest order takes over**, as the board's command register has it (T2). A one-shot
//!   that is replaced while it runs is reported as aborted; queueing is the external computer's
//!   task (C5).
//! * **Stop** latches until [`Arbiter::resume_from_stop`]; standby is repeated meanwhile, to an
//!   original board as well.
//! * **Mode**: in manual mode the operator drives and logic is ignored; in autonomous mode logic
//!   drives and the operator may stop, and may move the arm while logic's order in force is a
//!   standby with `arm_granted` (L10). Quarter turns and the drop are logic's alone (AMB-2,
//!   AMB-27). An arm order while a wheel command moves the robot is refused (AMB-28).
//! * **The arm waits for its profile**: an arm order is held until the steering board has accepted
//!   its limits, and refused where the board does not take them.
//! * **Following may end**: the board gives it up by itself when it has lost its line. That ends
//!   the order; only a new id follows again.
//! * **Sequence bytes** are 1..=255; a one-shot never gets the one the board last reported as
//!   finished. The board tells the same sequence byte from a new one, so a re-sent command renews
//!   and does not repeat.

mod driven;
mod ending;
mod kept;
mod lease;
mod ledger;
mod orders;
mod silence;
#[cfg(test)]
mod tests;
mod verdict;
mod wire;

use core::time::Duration;

use lager_topics::{Mode, Refusal};
use lager_wire::{Command, SteerCommand, Version, WheelCommand};

use driven::Driven;
pub use lease::LEASE;
use lease::Lease;
use ledger::Ledger;
pub use ledger::{Ended, OrderKey};
pub use verdict::Verdict;

/// How long the steering board may be silent before no origin may move anything, in robot time.
pub const REPORT_DEADLINE: Duration = Duration::from_millis(200);

/// The time within which what moves the robot, or lets it move, must be read after it was given, in
/// real time; later it is refused. A process that was held up for longer must not move the robot
/// when it goes on.
pub const STALE: Duration = Duration::from_millis(200);

/// When the command in force is written again to a version-1 board at the latest, so that its age
/// stays below the board's limit of 150 ms.
pub const RESEND: Duration = Duration::from_millis(40);

/// Whether the arm may be moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmGate {
    /// It may.
    Open,
    /// Not yet: the board is being told its limits.
    Held,
    /// No: the board does not take them.
    Shut,
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
    /// Somebody has set the mode since the robot was switched on.
    mode_is_chosen: bool,
    stopped: bool,
    parked: bool,
    running: Option<Running>,
    grant: Option<Grant>,
    last: Option<Ended>,
    ledger: Ledger,
    /// Logic's order that was ignored last, and why, so that it is counted once.
    ignored: Option<(OrderKey, Refusal)>,
    orders_refused: u32,
    /// The order refused or ignored last, and why.
    refused: Option<(OrderKey, Refusal)>,
    leases_expired: u32,
    driven: Driven,
    revision: u32,

    original_boards: bool,
    board: Option<Version>,
    /// A board has been up in this life of the arbiter.
    has_met_board: bool,
    /// When the board last came up or reported.
    reported: Option<Duration>,
    /// The board is up and has not reported in time.
    silent: bool,
    /// Why the board lets no origin move anything, when it was last looked at.
    objection: Refusal,
    arm: ArmGate,
    /// An earlier life of this link is known, so the board knows our last sequence byte.
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
    /// How long a packet takes on the wire.
    packet_time: Duration,
    /// When what was written has left for the board.
    wire_free: Duration,
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
            mode_is_chosen: false,
            stopped: false,
            parked: false,
            running: None,
            grant: None,
            last: None,
            ledger: Ledger::default(),
            ignored: None,
            orders_refused: 0,
            refused: None,
            leases_expired: 0,
            driven: Driven::default(),
            revision: 0,
            original_boards: false,
            board: None,
            has_met_board: false,
            reported: None,
            silent: false,
            objection: Refusal::NoBoard,
            arm: ArmGate::Open,
            acquainted: false,
            prelude: None,
            wire_seq: 0,
            idle_seq: 0,
            written: None,
            halted_at: None,
            next_send: Duration::ZERO,
            retry_at: None,
            packet_time: Duration::ZERO,
            wire_free: Duration::ZERO,
            board_finished: None,
        }
    }

    /// A packet takes so long on the wire, in robot time: orders that come faster are not all
    /// written.
    pub fn pace(&mut self, packet_time: Duration) {
        self.packet_time = packet_time;
    }

    /// Lets an original steering board be driven, which has no limit on a command's age: if this
    /// process dies, such a board goes on with what it was told last.
    pub fn drive_original_boards(&mut self, accepted: bool) {
        self.original_boards = accepted;
    }

    /// The command in force is due now if it would be within `ahead`.
    pub fn resend_early(&mut self, now: Duration, ahead: Duration) {
        if self.next_send <= now + ahead {
            self.next_send = self.next_send.min(now);
        }
    }

    /// Latches the stop: whatever runs is aborted, and nothing drives until
    /// [`Arbiter::resume_from_stop`].
    ///
    /// Standby is due at once, also where a stop is latched already or the driver took nothing.
    pub fn stop(&mut self) {
        self.retry_at = None;
        self.next_send = Duration::ZERO;
        self.wire_free = Duration::ZERO;
        if !self.stopped {
            self.stopped = true;
            self.quiet();
        }
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
        if !self.mode_is_chosen {
            self.mode_is_chosen = true;
            self.revision = self.revision.wrapping_add(1);
        }
        if self.mode != mode {
            self.mode = mode;
            self.quiet();
        }
    }

    /// Lets time pass, once in each turn, after all that has come was handed in and before
    /// [`Arbiter::poll`]: leases and the report's deadline end, and what the board's side waits
    /// for.
    pub fn advance(&mut self, now: Duration) {
        self.count_driven(now);
        self.watch_board(now);
        if let Some(running) = &mut self.running {
            running.lease.start(now);
        }
        if let Some(grant) = &mut self.grant {
            grant.lease.start(now);
        }
        self.expire(now);
        self.advance_board(now);
    }

    /// Counts what a person has driven until `now`.
    fn count_driven(&mut self, now: Duration) {
        self.driven.advance(now, self.mode == Mode::Manual);
    }

    /// This process was held up for [`LEASE`] or longer until `now`: ends what was in force before,
    /// whatever renewals have come meanwhile. To be called before they are handed in.
    pub fn wake(&mut self, now: Duration) {
        self.expire(now);
    }

    /// Says whether the arm may be moved, from the next order on.
    pub fn set_arm_gate(&mut self, arm: ArmGate) {
        self.arm = arm;
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

    /// Whether somebody has set the mode since the robot was switched on.
    pub fn is_mode_chosen(&self) -> bool {
        self.mode_is_chosen
    }

    /// Whether a stop is latched.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Why no origin may move anything now; of the board as of the last [`Arbiter::advance`].
    pub fn blocked(&self) -> Refusal {
        if self.parked {
            Refusal::ShuttingDown
        } else if self.stopped {
            Refusal::StopLatched
        } else {
            self.objection
        }
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

    /// Grows whenever something has changed that [`Arbiter::fill`] writes, except for the lease.
    ///
    /// Publish before writing to the wire when it has grown: then the successor of a bridge that is
    /// killed between the two learns from the board whether the order was carried out. Only where a
    /// setpoint has replaced a setpoint and nothing else has changed, one write may come before.
    pub fn revision(&self) -> u32 {
        self.revision
    }
}

/// The command that moves nothing.
const STANDBY: Command = Command::Wheel(WheelCommand::Standby);

/// Whether a command turns the wheels.
fn moves(command: Command) -> bool {
    matches!(command, Command::Wheel(wheel) if wheel != WheelCommand::Standby)
}
