//! Whose word counts: the judgement of orders.
//!
//! Apart from the arbiter's other side, the wire: nothing here knows how a command gets to a
//! board, only who may give it, what it replaces, and that it ends with its origin.

use core::time::Duration;

use lager_topics::{Finish, Mode, OrderKind, Origin, SteeringOrder};
use lager_wire::{ArmCommand, Command, WheelCommand};

use super::{Arbiter, Ended, Grant, Ignored, Lease, OrderKey, Refused, STANDBY, Verdict, moves};

impl Arbiter {
    /// Takes one order that its origin gave at `received` (robot time, at most the present).
    ///
    /// Hand in everything that has arrived before asking [`Arbiter::poll`] for what to write:
    /// then a stop anywhere in the batch wins, and of several setpoints only the last is written.
    pub fn order(&mut self, received: Duration, order: &SteeringOrder) -> Verdict {
        self.advance(received);
        let (Some(origin), Some(kind)) = (order.origin.get(), order.kind.get()) else {
            self.count_refused();
            return Verdict::Refused(Refused::Undefined);
        };
        if kind == OrderKind::Stop {
            self.stop();
            return Verdict::Stopped;
        }
        let key = OrderKey {
            origin,
            id: order.id,
        };
        if self.parked {
            return Verdict::Ignored(Ignored::ShuttingDown);
        }
        if let Some(verdict) = self.renew(received, key, order) {
            return verdict;
        }
        if let Some(ended) = self.ledger.find(key) {
            self.tell(ended);
            return Verdict::Ended(ended.finish);
        }
        let Some(command) = Command::from_code(order.code) else {
            return self.refuse(key, Refused::Undefined);
        };
        self.judge(received, key, command, order.arm_granted != 0)
    }

    /// Renews the order in force or the grant below it; `None` if `key` is neither.
    fn renew(
        &mut self,
        received: Duration,
        key: OrderKey,
        order: &SteeringOrder,
    ) -> Option<Verdict> {
        if let Some(running) = self.running.as_mut().filter(|running| running.key == key) {
            if running.command.code() != order.code {
                self.count_refused();
                return Some(Verdict::Refused(Refused::CodeChanged));
            }
            running.arm_granted = order.arm_granted != 0;
            let claimed = matches!(running.lease, Lease::Unclaimed(_));
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

    /// Decides on an order that is not in force and has not ended.
    fn judge(
        &mut self,
        received: Duration,
        key: OrderKey,
        command: Command,
        arm_granted: bool,
    ) -> Verdict {
        let logic_only = matches!(
            command,
            Command::Wheel(WheelCommand::LeftPerp | WheelCommand::RightPerp)
                | Command::Arm(ArmCommand::Drop)
        );
        if logic_only && key.origin == Origin::Operator {
            return self.refuse(key, Refused::LogicOnly);
        }
        let is_arm = matches!(command, Command::Arm(_));
        let as_guest = match (self.mode, key.origin) {
            (Mode::Manual, Origin::Operator) | (Mode::Autonomous, Origin::Logic) => false,
            (Mode::Autonomous, Origin::Operator) if is_arm && self.arm_is_granted() => true,
            _ => return self.ignore(key, Ignored::NotInCharge),
        };
        if self.stopped {
            return self.ignore(key, Ignored::StopLatched);
        }
        if is_arm && self.running.is_some_and(|running| moves(running.command)) {
            return self.refuse(key, Refused::ArmLocked);
        }
        self.make_way(as_guest);
        self.begin(received, key, command, arm_granted);
        Verdict::Executes
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

    /// Ends what runs for the sake of a newer order, or lays logic's standby below a guest.
    fn make_way(&mut self, for_guest: bool) {
        if for_guest && self.grant.is_none() {
            if let Some(base) = self.running.take() {
                self.idle_seq = base.seq;
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
            if old.command == STANDBY {
                self.idle_seq = old.seq;
            }
        }
    }

    /// Tells again how an order ended, for an origin that goes on renewing it.
    fn tell(&mut self, ended: Ended) {
        if ended.finish != Finish::None && self.last != Some(ended) {
            self.last = Some(ended);
            self.revision = self.revision.wrapping_add(1);
        }
    }

    fn refuse(&mut self, key: OrderKey, why: Refused) -> Verdict {
        self.count_refused();
        let ended = Ended {
            key,
            finish: Finish::Refused,
        };
        self.ledger.enter(ended);
        self.tell(ended);
        Verdict::Refused(why)
    }

    fn ignore(&mut self, key: OrderKey, why: Ignored) -> Verdict {
        let slot = &mut self.ignored[usize::from(key.origin == Origin::Operator)];
        if *slot != Some(key) {
            *slot = Some(key);
            self.count_refused();
        }
        Verdict::Ignored(why)
    }

    fn count_refused(&mut self) {
        self.orders_refused = self.orders_refused.wrapping_add(1);
        self.revision = self.revision.wrapping_add(1);
    }
}
