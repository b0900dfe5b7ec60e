//! Judges orders: decides which of them the bridge obeys.
//!
//! This file stands apart from the arbiter's other side, the wire. It does not know how a command
//! gets to a board. It knows which origin may give it, what it replaces, and that it ends with its
//! origin.

use core::time::Duration;

use lager_orders::Mode;
use lager_orders::lease::LATEST_MOVE;
use lager_topics::{Finish, Origin, Refusal, SteeringOrder};
use lager_wire::{ArmCommand, Command, Version, WheelCommand};

use super::lease::Lease;
use super::ledger::{Ended, OrderKey};
use super::verdict::Verdict;
use super::{Arbiter, Gate, Grant, Running, STANDBY, is_slower, moves};

impl Arbiter {
    /// Takes one order that its origin sent at `sent` (robot time, at most the present). `age`
    /// (real time) is its age: since a person first gave it, or since logic sent it.
    ///
    /// Hand in everything that has arrived before you ask [`Arbiter::poll`] what to write. Then
    /// only the last of several setpoints is written.
    pub fn order(&mut self, sent: Duration, age: Duration, order: &SteeringOrder) -> Verdict {
        // Judge it against the order that was in force when it was sent.
        self.expire(sent);
        let Some(origin) = order.origin.get() else {
            self.count_refused();
            return Verdict::Refused(Refusal::Undefined);
        };
        let key = OrderKey {
            origin,
            id: order.id,
        };
        if self.parked {
            return Verdict::Ignored(Refusal::ShuttingDown);
        }
        if let Some(verdict) = self.renew(sent, key, order) {
            return verdict;
        }
        if let Some(ended) = self.ledger.find(key) {
            self.tell(ended);
            return Verdict::Ended(ended.finish);
        }
        let Some(command) = Command::from_code(order.code) else {
            return self.refuse(key, Refusal::Undefined);
        };
        if let Some(verdict) = self.objection(sent, age, key, command) {
            return verdict;
        }
        let as_guest = self.mode == Mode::Autonomous && origin == Origin::Operator;
        self.make_way(as_guest);
        self.begin(sent, key, command, order.arm_granted != 0);
        Verdict::Executes
    }

    /// Renews the order in force or the standby below it; `None` if `key` is neither.
    fn renew(
        &mut self,
        received: Duration,
        key: OrderKey,
        order: &SteeringOrder,
    ) -> Option<Verdict> {
        if let Some(running) = self.running.as_mut().filter(|running| running.key == key) {
            if running.command.code() != order.code {
                self.note_refusal(key, Refusal::CodeChanged);
                return Some(Verdict::Refused(Refusal::CodeChanged));
            }
            running.arm_granted = order.arm_granted != 0;
            let claimed = matches!(running.lease, Lease::Unclaimed(_));
            if claimed && self.board.is_none() && !running.command.is_one_shot() {
                // Nothing can be written for it yet, and it must not wait for the board.
                return Some(Verdict::Renewed);
            }
            running.lease.renew(received);
            if claimed {
                self.claim(received);
            }
            return Some(Verdict::Renewed);
        }
        let grant = self.grant.as_mut()?;
        let granted = order.arm_granted != 0 && order.code == STANDBY.code();
        let mine = match grant.key {
            Some(known) => known == key,
            None => key.origin == Origin::Logic && granted,
        };
        if !mine {
            return None;
        }
        grant.key = Some(key);
        grant.lease.renew(received);
        if !granted {
            self.finish_running(Finish::Aborted);
            if let Some(base) = self.running.as_mut() {
                base.arm_granted = false;
            }
        }
        Some(Verdict::Renewed)
    }

    /// Why an order that is not in force and has not ended is refused or ignored, if so.
    fn objection(
        &mut self,
        sent: Duration,
        age: Duration,
        key: OrderKey,
        command: Command,
    ) -> Option<Verdict> {
        let logic_only = matches!(
            command,
            Command::Wheel(WheelCommand::LeftPerp | WheelCommand::RightPerp)
                | Command::Arm(ArmCommand::Drop)
        );
        let is_arm = matches!(command, Command::Arm(_));
        let by_person = key.origin == Origin::Operator;
        let in_charge = match self.mode {
            Mode::Manual => by_person,
            Mode::Autonomous => !by_person || (is_arm && self.arm_is_granted()),
        };
        let moves_it = command != STANDBY;
        let board = self.board_objection(sent).filter(|_| moves_it);
        // A person must give a refused order again; logic's renewals may count later.
        let why = if logic_only && by_person {
            Refusal::LogicOnly
        } else if !in_charge {
            Refusal::NotInCharge
        } else if self.stopped {
            Refusal::StopLatched
        } else if moves_it && age > LATEST_MOVE {
            Refusal::Stale
        } else if let Some(why) = board {
            why
        } else if moves(command) && self.wheels == Gate::Held {
            Refusal::Undescribed
        } else if self.board == Some(Version::Original) && is_slower(command) {
            Refusal::FullSpeedOnly
        } else if is_arm && self.running.is_some_and(|running| moves(running.command)) {
            return Some(self.refuse(key, Refusal::ArmLocked));
        } else if is_arm && self.arm == Gate::Shut {
            return Some(self.refuse(key, Refusal::ArmUnlimited));
        } else {
            return None;
        };
        Some(if by_person {
            self.refuse(key, why)
        } else {
            self.ignore(key, why)
        })
    }

    /// Whether the order in force ends when the steering board comes up again. A person's order
    /// does, unless it was taken over from an earlier bridge and the board was not reset.
    pub(super) fn ends_with_the_link(&self, rebooted: bool) -> bool {
        let by_person = |running: Running| running.key.origin == Origin::Operator;
        (rebooted || self.has_met_board) && self.running.is_some_and(by_person)
    }

    /// Whether logic stands and lets the operator move the arm.
    fn arm_is_granted(&self) -> bool {
        self.grant.is_some()
            || self.running.is_some_and(|running| {
                running.key.origin == Origin::Logic
                    && running.command == STANDBY
                    && running.arm_granted
            })
    }

    /// Ends the running order for a newer one, or keeps logic's standby below an operator's arm
    /// order.
    fn make_way(&mut self, for_guest: bool) {
        if for_guest && self.grant.is_none() {
            if let Some(base) = self.running.take() {
                self.stand_on(&base);
                self.grant = Some(Grant {
                    key: Some(base.key),
                    lease: base.lease,
                });
            }
            return;
        }
        if !for_guest && let Some(Grant { key: Some(key), .. }) = self.grant.take() {
            self.ledger.enter(Ended {
                key,
                finish: Finish::None,
            });
        }
        if let Some(old) = self.running.take() {
            let finish = if old.command.is_one_shot() {
                Finish::Aborted
            } else {
                Finish::None
            };
            self.ledger.enter(Ended {
                key: old.key,
                finish,
            });
            if finish != Finish::None {
                self.last = Some(Ended {
                    key: old.key,
                    finish,
                });
            }
            self.stand_on(&old);
        }
    }

    /// Reports again how an order ended, for an origin that goes on renewing it.
    fn tell(&mut self, ended: Ended) {
        if ended.finish != Finish::None && self.last != Some(ended) {
            self.last = Some(ended);
            self.revision = self.revision.wrapping_add(1);
        }
    }

    fn refuse(&mut self, key: OrderKey, why: Refusal) -> Verdict {
        self.note_refusal(key, why);
        let ended = Ended {
            key,
            finish: Finish::Refused,
        };
        self.ledger.enter(ended);
        self.tell(ended);
        Verdict::Refused(why)
    }

    /// Counts an ignored order once.
    fn ignore(&mut self, key: OrderKey, why: Refusal) -> Verdict {
        if self.ignored != Some((key, why)) {
            self.ignored = Some((key, why));
            self.note_refusal(key, why);
        }
        Verdict::Ignored(why)
    }

    fn note_refusal(&mut self, key: OrderKey, why: Refusal) {
        self.refused = Some((key, why));
        self.count_refused();
    }

    fn count_refused(&mut self) {
        self.orders_refused = self.orders_refused.wrapping_add(1);
        self.revision = self.revision.wrapping_add(1);
    }
}
