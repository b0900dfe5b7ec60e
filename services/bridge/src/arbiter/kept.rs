//! The state that a successor of the arbiter needs, as `link/health` carries it, and the part of
//! `steering/state` about orders.
//!
//! This file stands apart because it decides nothing: it writes the state and reads it again.

use core::time::Duration;

use lager_orders::Mode;
use lager_orders::lease::SETPOINT;
use lager_topics::{Finish, Health, Origin, Refusal, SteeringReport};
use lager_wire::Command;

use super::driven::Driven;
use super::lease::Lease;
use super::ledger::{Ended, OrderKey};
use super::{Arbiter, Grant, Running, moves};

impl Arbiter {
    /// Goes on from the state of an earlier bridge: mode, stop, counters, and which order has which
    /// sequence byte.
    ///
    /// The state was published at `published` (robot time). The arbiter writes nothing for the
    /// order in force until its origin renews it while the board is up. If that has not happened
    /// [`SETPOINT`] after `published`, the order ends as any order whose lease is over, and its id
    /// is used up: a robot that has stood meanwhile does not move again. The arbiter only looks for
    /// a one-shot in the board's reports, so a one-shot gets [`SETPOINT`] from now on. Until then
    /// the board's own limit of 150 ms protects.
    pub fn resume(kept: &Health, published: Duration) -> Self {
        let mut arbiter = Self {
            mode: kept.mode.get().unwrap_or(Mode::Manual),
            mode_is_chosen: kept.mode_chosen != 0,
            stopped: kept.stopped != 0,
            orders_refused: kept.orders_refused,
            leases_expired: kept.leases_expired,
            acquainted: kept.wire_seq != 0,
            wire_seq: kept.wire_seq,
            ..Self::new()
        };
        if let (Some(origin), Some(refusal)) = (kept.refused_origin.get(), kept.refusal.get())
            && refusal != Refusal::None
        {
            let id = kept.refused_id;
            arbiter.refused = Some((OrderKey { origin, id }, refusal));
        }
        // The earlier bridge may have written one more setpoint than it published: leave out its
        // sequence byte.
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
        let was_driven =
            arbiter.mode == Mode::Manual && current.is_some_and(|(command, _)| moves(command));
        arbiter.driven = Driven::resume(kept.driven_by_hand, was_driven);
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
                lease: Lease::Unclaimed((!command.is_one_shot()).then_some(published + SETPOINT)),
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

    /// Writes the arbiter's part of `link/health`: all that [`Arbiter::resume`] needs.
    pub fn fill(&self, now: Duration, health: &mut Health) {
        health.mode = self.mode.into();
        health.mode_chosen = self.mode_is_chosen.into();
        health.stopped = self.stopped.into();
        health.orders_refused = self.orders_refused;
        health.leases_expired = self.leases_expired;
        health.wire_seq = self.wire_seq;
        health.blocked = self.blocked().into();
        health.driven_by_hand = self.driven.sum();
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
        let (refused, refusal) = self.refused.unwrap_or((none, Refusal::None));
        health.refused_id = refused.id;
        health.refused_origin = refused.origin.into();
        health.refusal = refusal.into();
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
}
