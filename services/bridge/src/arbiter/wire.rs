//! The arbiter's other side: what it writes to the steering board, and what the board's reports
//! mean.
//!
//! This file stands apart from the judgement of orders because it knows the board (its version, its
//! flags, its sequence bytes) and nothing of origins and modes.

use core::time::Duration;

use lager_orders::lease::{RENEWAL, SETPOINT};
use lager_topics::Finish;
use lager_wire::{
    ArmCommand, COMMAND_AGE, Command, SteerCommand, SteerData, SteerFlags, Version, WheelCommand,
};

use super::lease::Lease;
use super::ledger::OrderKey;
use super::{Arbiter, Gate, Running, STANDBY, Search, is_slower, moves};

/// How long the wheels are in standby on the wire before an arm command follows. The board unlocks
/// its arm only in standby (T4), and one pass of its loop must have seen the standby.
const ARM_UNLOCK: Duration = Duration::from_millis(20);

/// How long a one-shot may be missing in the reports of a board that was away.
const SEARCH: Duration = Duration::from_millis(200);

/// After this many reports without the one-shot it is certainly gone.
const MISSES: u8 = 2;

/// After this time the bridge tries a command again that the driver did not take.
const RETRY: Duration = Duration::from_millis(5);

/// How often standby is written while the bridge shuts down.
const PARKED_RESEND: Duration = Duration::from_millis(20);

impl Arbiter {
    /// The steering board's link is up. `rebooted`: the board has forgotten its commands.
    ///
    /// Logic's setpoint goes on with a new sequence byte. A person's setpoint ends, unless it was
    /// taken over from an earlier bridge and the board was not reset. A one-shot that was written
    /// is not written again: the arbiter looks for it in the board's reports, and aborts it if it
    /// is not there.
    pub fn board_up(&mut self, now: Duration, version: Version, rebooted: bool) {
        let is_unknown =
            |running: Running| version == Version::Original && is_slower(running.command);
        let ends = self.ends_with_the_link(rebooted) || self.running.is_some_and(is_unknown);
        self.has_met_board = true;
        self.board = Some(version);
        self.reported = Some(now);
        self.board_finished = None;
        self.written = None;
        self.halted_at = None;
        self.next_send = now;
        if (!self.acquainted || rebooted) && version == Version::One {
            // The board may be executing any sequence byte of an earlier bridge. Of two different
            // ones at least one is new to it. A board that has just started keeps its arm locked
            // until it gets a standby (T4).
            self.acquainted = true;
            self.prelude = Some(standby(self.next_seq()));
        }
        let gone = rebooted || version == Version::Original;
        match self.running {
            Some(one_shot) if one_shot.command.is_one_shot() && one_shot.written.is_some() => {
                if gone {
                    self.finish_running(Finish::Aborted);
                } else if matches!(one_shot.lease, Lease::Until(_)) {
                    self.search(now);
                }
            }
            Some(_) if ends => self.finish_running(Finish::Aborted),
            Some(_) => {
                self.idle_seq = self.next_seq();
                self.reseat();
            }
            None => self.idle_seq = self.next_seq(),
        }
        self.watch_board(now);
        self.revision = self.revision.wrapping_add(1);
    }

    /// The steering board's link is down, so nothing can be written.
    pub fn board_down(&mut self) {
        self.board = None;
        self.prelude = None;
        self.retry_at = None;
    }

    /// Takes a report of the steering board. Its last finished sequence byte becomes the end of an
    /// order. The reports of an original board only show that it is there; nobody has documented
    /// their content.
    pub fn observe(&mut self, now: Duration, report: &SteerData) {
        if self.board.is_none() {
            return;
        }
        // An order that had lapsed before the report came stays lapsed.
        self.watch_board(now);
        self.expire(now);
        self.reported = self.reported.max(Some(now));
        if self.board != Some(Version::One) {
            return;
        }
        self.count_driven(now);
        self.driven.report(now, report.left_duty, report.right_duty);
        self.board_finished = Some(report.finished_seq);
        let Some(running) = self.running else {
            return;
        };
        let refused = report.flags.contains(SteerFlags::REFUSED);
        let gave_up = SteerFlags::ABORTED.with(SteerFlags::FAILSAFE);
        let given_up = !running.command.is_one_shot() && report.flags.contains(gave_up);
        if report.finished_seq == running.seq
            && running.written.is_some()
            && (refused || given_up || running.command.is_one_shot())
        {
            let finish = if refused {
                Finish::Refused
            } else if given_up && report.flags.contains(SteerFlags::EXDE_OK) {
                Finish::NoTape
            } else if given_up {
                Finish::NoWord
            } else if report.flags.contains(SteerFlags::ABORTED) {
                Finish::Aborted
            } else {
                Finish::Done
            };
            self.finish_running(finish);
            return;
        }
        if running.search.is_some() {
            self.look_for(report);
            return;
        }
        let failsafe = report.flags.contains(SteerFlags::FAILSAFE) && moves(running.command);
        let old = |written| now.saturating_sub(written) >= COMMAND_AGE;
        if failsafe && !running.command.is_one_shot() && running.written.is_some_and(old) {
            // The board gave the command up because of its age, and stands. An order that was given
            // before does not start it again.
            self.finish_running(Finish::Aborted);
        }
    }

    /// Lets time pass on the board's side: held arm orders are released, an original board's
    /// one-shots count as done, and one-shots that were not found count as lost.
    pub(super) fn advance_board(&mut self, now: Duration) {
        let Some(running) = self.running.as_mut() else {
            return;
        };
        if running.held_until.is_some_and(|until| until <= now) {
            running.held_until = None;
        }
        let lost = running.search.is_some_and(|search| search.deadline <= now);
        let done = self.board == Some(Version::Original) && original_is_done(running, now);
        if done {
            self.finish_running(Finish::Done);
        } else if lost {
            self.finish_running(Finish::Aborted);
        }
    }

    /// What to write now. Ask again until it returns nothing. Call [`Arbiter::advance`] before.
    ///
    /// A version-1 board gets a change at once, and the command in force again after [`RENEWAL`],
    /// or a little sooner ([`Arbiter::resend_early`]). An original board would carry out a repeated
    /// command again, so it gets each command once. Only standby is repeated, because nothing else
    /// makes such a board stand.
    ///
    /// While a packet is on the wire, only a standby that ends a movement may be written. Otherwise
    /// an origin that gives orders faster than the wire carries them would fill the driver's
    /// buffer, and a standby would wait behind it: 4 KiB take 80 ms at 500 000 Bd, and 4 s at 9600.
    pub fn poll(&mut self, now: Duration) -> Option<SteerCommand> {
        let version = self.board?;
        if self.retry_at.is_some_and(|at| at > now) {
            return None;
        }
        let retry = self.retry_at.take().is_some();
        if let Some(prelude) = self.prelude.take() {
            self.wire_free = self.wire_free.max(now) + self.packet_time;
            return Some(prelude);
        }
        if !self.may_write() {
            return None;
        }
        let command = self.register();
        let repeat = self.repeats(command) && self.next_send <= now;
        if self.written == Some(command) && !repeat && !retry {
            return None;
        }
        if !retry && self.waits_for_wire(command) && self.wire_free > now {
            return None;
        }
        let moved = self.written.is_some_and(|written| code_moves(written.code));
        if moved && !code_moves(command.code) {
            self.halted_at = Some(now);
        }
        if version == Version::Original {
            self.driven.told(code_moves(command.code));
        }
        self.written = Some(command);
        self.wire_free = self.wire_free.max(now) + self.packet_time;
        self.next_send = now + if self.parked { PARKED_RESEND } else { RENEWAL };
        let held = self.is_held();
        if let Some(running) = self.running.as_mut()
            && !held
        {
            running.written.get_or_insert(now);
        }
        Some(command)
    }

    /// The last result of [`Arbiter::poll`] could not be written: it comes again shortly.
    pub fn not_written(&mut self, now: Duration) {
        self.wire_free = self.wire_free.saturating_sub(self.packet_time);
        self.retry_at = Some(now + RETRY);
    }

    /// When [`Arbiter::poll`] next returns something, if no order or report comes before. A time in
    /// the past means now.
    pub fn next_due(&self) -> Option<Duration> {
        let running = self.running.as_ref();
        let writes = self.board.is_some() && self.may_write();
        let unwritten = writes && self.written != Some(self.register());
        let at_once = unwritten || (self.prelude.is_some() && self.board.is_some());
        let repeats = self.repeats(self.register());
        let waits = self.prelude.is_none() && self.waits_for_wire(self.register());
        let free = if waits {
            self.wire_free
        } else {
            Duration::ZERO
        };
        let write = if self.retry_at.is_some() {
            self.retry_at
        } else if at_once {
            Some(free)
        } else {
            (repeats && writes).then_some(self.next_send.max(free))
        };
        [
            running.and_then(|running| running.lease.end()),
            running.and_then(|running| running.held_until),
            running.and_then(|running| running.search.map(|search| search.deadline)),
            running.and_then(|running| {
                let done = running.written? + original_duration(running.command)?;
                (self.board == Some(Version::Original)).then_some(done)
            }),
            self.grant.and_then(|grant| grant.lease.end()),
            self.silence_due(),
            write,
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Puts an order in force.
    pub(super) fn begin(
        &mut self,
        received: Duration,
        key: OrderKey,
        command: Command,
        arm_granted: bool,
    ) {
        let mut held_until = None;
        if matches!(command, Command::Arm(_)) {
            if self.written.is_some_and(|written| code_moves(written.code)) {
                // The standby between them was replaced before it was written.
                self.idle_seq = self.next_seq();
                held_until = Some(received + ARM_UNLOCK);
            } else if let Some(halted_at) = self.halted_at {
                held_until = Some(halted_at + ARM_UNLOCK).filter(|until| received < *until);
            }
        }
        self.running = Some(Running {
            key,
            command,
            seq: self.next_seq(),
            arm_granted,
            lease: Lease::Until(received + SETPOINT),
            held_until,
            written: None,
            search: None,
        });
        self.revision = self.revision.wrapping_add(1);
    }

    /// Puts a standby of `key` in force that the board has, or is about to get.
    pub(super) fn stand_for(&mut self, key: OrderKey, lease: Lease) {
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

    /// Nothing runs any more: the board gets a standby that is new to it.
    pub(super) fn stand_anew(&mut self) {
        self.idle_seq = self.next_seq();
    }

    /// The board still gets the standby that has ended.
    pub(super) fn stand_on(&mut self, over: &Running) {
        if over.command == STANDBY {
            self.idle_seq = over.seq;
        }
    }

    /// The origin of an order that was taken over from an earlier bridge has renewed it.
    pub(super) fn claim(&mut self, received: Duration) {
        let Some(running) = self.running else {
            return;
        };
        if running.command.is_one_shot() {
            if self.board.is_some() {
                self.search(received);
            }
        } else {
            self.reseat();
        }
    }

    /// A sequence byte that is new to the board.
    pub(super) fn next_seq(&mut self) -> u8 {
        loop {
            self.wire_seq = self.wire_seq.wrapping_add(1);
            if self.wire_seq != 0 && Some(self.wire_seq) != self.board_finished {
                return self.wire_seq;
            }
        }
    }

    /// Gives the setpoint in force a new sequence byte, so that the board executes it as new.
    fn reseat(&mut self) {
        let seq = self.next_seq();
        if let Some(running) = self.running.as_mut() {
            running.seq = seq;
            running.written = None;
        }
        self.revision = self.revision.wrapping_add(1);
    }

    /// The wheels must stand. A one-shot that was begun is over.
    pub(super) fn hold_wheels(&mut self) {
        let Some(running) = self.running.filter(|running| moves(running.command)) else {
            return;
        };
        if !running.command.is_one_shot() {
            self.idle_seq = self.next_seq();
            self.reseat();
        } else if running.written.is_some() {
            self.finish_running(Finish::Aborted);
        }
    }

    /// Starts looking for the one-shot in force in the board's reports.
    fn search(&mut self, now: Duration) {
        if let Some(running) = self.running.as_mut() {
            running.search = Some(Search {
                deadline: now + SEARCH,
                misses: 0,
            });
        }
    }

    /// Compares a report with the wanted one-shot, which is not the last finished one.
    fn look_for(&mut self, report: &SteerData) {
        let Some(running) = self.running.as_mut() else {
            return;
        };
        let Some(search) = running.search.as_mut() else {
            return;
        };
        if report.flags.contains(SteerFlags::BUSY) && report.code == running.command.code() {
            running.search = None;
            return;
        }
        search.misses += 1;
        if search.misses >= MISSES {
            self.finish_running(Finish::Aborted);
        }
    }

    /// The command that belongs on the wire.
    fn register(&self) -> SteerCommand {
        match self.running {
            Some(Running { command, seq, .. }) if !self.is_held() => SteerCommand {
                code: command.code(),
                seq,
            },
            _ => standby(self.idle_seq),
        }
    }

    /// Whether a command waits until the wire is free. A command that ends a movement does not
    /// wait.
    fn waits_for_wire(&self, command: SteerCommand) -> bool {
        let is_standby = |command: SteerCommand| command.code == STANDBY.code();
        !is_standby(command) || self.written.is_some_and(is_standby)
    }

    /// Whether the board gets a command again and again.
    fn repeats(&self, command: SteerCommand) -> bool {
        match self.board {
            None => false,
            Some(Version::One) => true,
            Some(Version::Original) => command.code == STANDBY.code(),
        }
    }

    /// Whether a standby goes out while the order in force must wait.
    fn is_held(&self) -> bool {
        self.running.is_some_and(|running| {
            let is_arm = matches!(running.command, Command::Arm(_));
            running.held_until.is_some()
                || (is_arm && self.arm != Gate::Open)
                || (moves(running.command) && self.wheels != Gate::Open)
        })
    }

    /// Whether it is known which command belongs on the wire.
    fn may_write(&self) -> bool {
        self.running.is_none_or(|running| {
            matches!(running.lease, Lease::Until(_)) && running.search.is_none()
        })
    }
}

fn standby(seq: u8) -> SteerCommand {
    SteerCommand {
        code: STANDBY.code(),
        seq,
    }
}

fn code_moves(code: u8) -> bool {
    Command::from_code(code).is_some_and(moves)
}

/// Whether an original board must have finished a one-shot by now.
fn original_is_done(running: &Running, now: Duration) -> bool {
    match (running.written, original_duration(running.command)) {
        (Some(written), Some(duration)) => written + duration <= now,
        _ => false,
    }
}

/// How long an original board, which reports nothing, gets for a one-shot: the timed turns of W4 (a
/// full turn takes 12 s), and plenty of time for the arm.
fn original_duration(command: Command) -> Option<Duration> {
    let millis = match command {
        Command::Wheel(WheelCommand::LeftPerp | WheelCommand::RightPerp) => 3_250,
        Command::Wheel(WheelCommand::LeftDiag | WheelCommand::RightDiag) => 1_750,
        Command::Wheel(_) => return None,
        Command::Arm(ArmCommand::Drop) => 5_000,
        Command::Arm(_) => 500,
    };
    Some(Duration::from_millis(millis))
}
