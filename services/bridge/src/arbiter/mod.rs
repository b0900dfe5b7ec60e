//! Who may steer: only here orders of several origins become one stream of commands.
//!
//! The arbiter stands apart from the shell so that it can be proven: it is pure, owns no port and
//! no clock, and takes robot time as an argument. So tests run all of it in virtual time, and the
//! simulation in one process runs the same code. It does not decide what the robot should do. It
//! decides whose order the bridge obeys, and ends an order when its origin is gone.
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
//! * **Identity**: `(origin, id)`. The same id renews an order, a new id is executed. The arbiter
//!   never executes an id again that has ended; it only reports its end again.
//! * **Lease**: [`SETPOINT`](lager_orders::lease::SETPOINT), from the moment that comes with the
//!   order. Only renewals of the same order extend it.
//! * **Setpoints and one-shots**: a setpoint (drive, standby) is a level. A one-shot (turn, arm
//!   step) is an event: however it ended, its id is used up.
//! * **Nothing comes back by itself.** Whatever ended an order (lease, stop, mode, a board that was
//!   reset or away, a pause of this process, the death of the bridge before), its id is used up,
//!   and a renewal moves nothing. Its origin hears the end, looks, and gives a new order.
//! * **Nothing comes late.** An order begins within
//!   [`LATEST_MOVE`](lager_orders::lease::LATEST_MOVE) of the moment when a person gave it or logic
//!   sent it last, or never. If a person's order is not allowed at once, its id is used up, too;
//!   logic's order may begin once it is allowed.
//! * **No motion unseen**: if the steering board has not reported within
//!   [`UNHEARD`](lager_orders::lease::UNHEARD), every order that moves something ends, and no
//!   origin may move anything. An original board does not report and has no limit on a command's
//!   age. So it gets only standby, unless the configuration accepts the risk
//!   ([`Arbiter::drive_original_boards`]), and then no order slower than full speed: it does not know
//!   those codes, and a person who asks for less speed must not get more.
//! * **The newest order takes over**, as in the board's command register (T2). A one-shot that is
//!   replaced while it runs counts as aborted. The external computer queues commands (C5), not the
//!   bridge.
//! * **Stop** lasts until [`Arbiter::resume_from_stop`]. Meanwhile the arbiter repeats standby, to
//!   an original board as well.
//! * **Mode**: in manual mode the operator drives and logic is ignored. In autonomous mode logic
//!   drives and the operator may stop the robot, and may move the arm while logic's order in force
//!   is a standby with `arm_granted` (L10). Only logic may give quarter turns and the drop (AMB-2,
//!   AMB-27). An arm order while a wheel command moves the robot is refused (AMB-28).
//! * **Nothing moves a robot that its boards do not know**: until the boards have accepted how motors
//!   and sensors are built, no new order moves the wheels, and a setpoint in force is a standby on
//!   the wire. If a board does not take it, nothing moves.
//! * **The arm waits for its profile**: the arbiter holds an arm order until the steering board has
//!   accepted its limits, and refuses it if the board does not take them.
//! * **Following may end**: the board gives it up by itself when it has lost its line. That ends
//!   the order; only a new id follows again.
//! * **Sequence bytes** are 1..=255. A one-shot never gets the one that the board last reported as
//!   finished. For the board the same sequence byte is the same command, so a command that is sent
//!   again is a renewal and not a repetition.

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

use lager_orders::Mode;
use lager_topics::Refusal;
use lager_wire::{Command, Speed, SteerCommand, Version, WheelCommand};

use driven::Driven;
use lease::Lease;
use ledger::Ledger;
pub use ledger::{Ended, OrderKey};
pub use verdict::Verdict;

/// Whether wheels or arm may move, by what the boards know of their robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    /// They may.
    Open,
    /// Not yet: the bridge is telling a board.
    Held,
    /// No: a board does not take it.
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
    /// Until then standby is written, so that the board has unlocked its arm.
    held_until: Option<Duration>,
    /// When it was first written.
    written: Option<Duration>,
    /// Set while the arbiter looks in the board's reports for a one-shot that was written before
    /// the link came up.
    search: Option<Search>,
}

/// The search for a one-shot on a board that was away.
#[derive(Clone, Copy, Debug)]
struct Search {
    deadline: Duration,
    misses: u8,
}

/// Logic's standby that permits it, while an operator's arm order runs on top.
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
    /// Logic's last ignored order, and why, so that it counts once.
    ignored: Option<(OrderKey, Refusal)>,
    orders_refused: u32,
    /// The last order that was refused or ignored, and why.
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
    /// Why no origin may move anything, as the last check of the board showed.
    objection: Refusal,
    wheels: Gate,
    arm: Gate,
    /// An earlier life of this link is known, so the board knows our last sequence byte.
    acquainted: bool,
    /// A standby to write before anything else.
    prelude: Option<SteerCommand>,
    /// The last sequence byte that was used.
    wire_seq: u8,
    /// The sequence byte of the standby that is written while nothing runs.
    idle_seq: u8,
    /// The last command for the board in this life of the link.
    written: Option<SteerCommand>,
    /// When a standby or arm command followed a moving one on the wire.
    halted_at: Option<Duration>,
    next_send: Duration,
    /// When to try again to write a command.
    retry_at: Option<Duration>,
    /// How long a packet takes on the wire.
    packet_time: Duration,
    /// When the last bytes have left for the board.
    wire_free: Duration,
    board_finished: Option<u8>,
}

impl Default for Arbiter {
    fn default() -> Self {
        Self::new()
    }
}

impl Arbiter {
    /// A robot that has just been switched on: manual mode, no stop, no order in force.
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
            wheels: Gate::Open,
            arm: Gate::Open,
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

    /// Sets how long a packet takes on the wire, in robot time. If orders come faster, not all of
    /// them are written.
    pub fn pace(&mut self, packet_time: Duration) {
        self.packet_time = packet_time;
    }

    /// Allows an original steering board to be driven. It has no limit on a command's age: if this
    /// process dies, such a board goes on with its last command.
    pub fn drive_original_boards(&mut self, accepted: bool) {
        self.original_boards = accepted;
    }

    /// The command in force is due now if it would be due within `ahead`.
    pub fn resend_early(&mut self, now: Duration, ahead: Duration) {
        if self.next_send <= now + ahead {
            self.next_send = self.next_send.min(now);
        }
    }

    /// Sets the stop: whatever runs is aborted, and nothing drives until
    /// [`Arbiter::resume_from_stop`].
    ///
    /// Standby is due at once, also if a stop is in force already or the driver took nothing.
    pub fn stop(&mut self) {
        self.retry_at = None;
        self.next_send = Duration::ZERO;
        self.wire_free = Duration::ZERO;
        if !self.stopped {
            self.stopped = true;
            self.quiet();
        }
    }

    /// Releases the stop. That alone moves nothing: an origin must renew or give an order.
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

    /// Lets time pass, once in each turn, after everything that has come was handed in and before
    /// [`Arbiter::poll`]: ends leases and the deadline of the reports, and what waits on the
    /// board's side.
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

    /// Counts how far a person has driven until `now`.
    fn count_driven(&mut self, now: Duration) {
        self.driven.advance(now, self.mode == Mode::Manual);
    }

    /// This process was held up for [`SETPOINT`](lager_orders::lease::SETPOINT) or longer until
    /// `now`: ends the orders that were in force before, whatever renewals have come meanwhile.
    /// Call it before those are handed in.
    pub fn wake(&mut self, now: Duration) {
        self.expire(now);
    }

    /// Sets whether wheels and arm may move. What moves the wheels now stands from the next command
    /// on; it goes on only as a setpoint that its origin still renews.
    pub fn set_gates(&mut self, wheels: Gate, arm: Gate) {
        let closes = self.wheels == Gate::Open && wheels != Gate::Open;
        self.wheels = wheels;
        self.arm = arm;
        if closes {
            self.hold_wheels();
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

    /// Whether somebody has set the mode since the robot was switched on.
    pub fn is_mode_chosen(&self) -> bool {
        self.mode_is_chosen
    }

    /// Whether a stop is latched.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Why no origin may move anything now. The board's state is that of the last
    /// [`Arbiter::advance`].
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

    /// Whether the order in force is a setpoint, which may be written twice.
    pub fn has_setpoint(&self) -> bool {
        self.running
            .is_some_and(|running| !running.command.is_one_shot())
    }

    /// The last ended order whose end must be reported.
    pub fn last_ended(&self) -> Option<Ended> {
        self.last
    }

    /// Grows with every change of what [`Arbiter::fill`] writes, except for the lease.
    ///
    /// When it has grown, publish before you write to the wire. If the bridge is killed between the
    /// two, its successor learns from the board whether the order was carried out. Only if a
    /// setpoint has replaced a setpoint and nothing else has changed, one write may come before.
    pub fn revision(&self) -> u32 {
        self.revision
    }
}

/// The command that moves nothing.
const STANDBY: Command = Command::Wheel(WheelCommand::Standby);

/// Whether a command drives slower than an original board can.
fn is_slower(command: Command) -> bool {
    matches!(command, Command::Wheel(wheel) if wheel.speed() != Speed::Full)
}

/// Whether a command turns the wheels.
fn moves(command: Command) -> bool {
    matches!(command, Command::Wheel(wheel) if wheel != WheelCommand::Standby)
}
