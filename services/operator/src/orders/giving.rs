//! Which actions the robot allows, and how each one begins.
//!
//! It is apart because it knows the actions; its parent only knows how to wait for an effect.

use core::time::Duration;

use lager_floor::ProductId;
use lager_orders::lease::{LATEST_MOVE, LATEST_MOVE_MS};
use lager_orders::{Action, Code, Moment, Reason};
use lager_topics::{Ask, Input, Phase, WorldAsk};
use lager_wire::OperatorCommand;

use super::{Act, Await, Begun, Orders, Waiting, ordered};
use crate::ids::Ids;
use crate::seen::Seen;

/// Begins actions and says how the effect of each is known.
impl<K: Copy> Orders<K> {
    /// The most orders that may wait at a time.
    pub const MOST: usize = 16;

    /// Gives an action that comes so `late`, if the state `seen` of the robot allows it.
    ///
    /// # Errors
    ///
    /// Why the action is not possible now.
    pub fn give(
        &mut self,
        now: Moment,
        late: Duration,
        whose: K,
        action: Action,
        seen: &Seen,
    ) -> Result<Begun, Reason> {
        if self.list.len() >= Self::MOST {
            return Err(Reason::new(Code::TasksFull, &[&Self::MOST]));
        }
        let queue = seen.queue.unwrap_or_default();
        let status = seen.status.unwrap_or_default();
        let mut before = 0;
        match action {
            Action::Drive { wheels, lease } => {
                return Ok(Begun::Steers(wheels.into(), Some(lease)));
            }
            // It is for a process of its own.
            Action::Commission(_) => return Err(Reason::new(Code::NotRunning, &[&"commission"])),
            Action::Arm(step) => return Ok(Begun::Steers(OperatorCommand::Arm(step), None)),
            Action::Add { order: 0, .. } => return Err(Code::OrderZero.into()),
            Action::Add { order, .. } if queue.has(order) => {
                return Err(Reason::new(Code::OrderThere, &[&order]));
            }
            Action::Add { order, product } => {
                self.order(now, whose, order, product);
                return Ok(Begun::Waits);
            }
            Action::Cancel { order } => seen.may_cancel(order)?,
            Action::First { order } | Action::Up { order } => {
                before = queue.before(order)?;
                if before == 0 {
                    return Ok(Begun::Done);
                }
            }
            Action::Clear if queue.orders().is_empty() => return Ok(Begun::Done),
            Action::Back { product } if !queue.is_gone(product) => return Ok(Begun::Done),
            Action::Picked { .. } if status.phase != Phase::Picking => {
                return Err(Code::NotPicking.into());
            }
            Action::Place(_) => seen.may_be_put_down()?,
            Action::Resume { stop } if seen.is_stopped() && seen.stop_word() != stop => {
                return Err(seen.newer_stop(stop));
            }
            Action::Calibrate => seen.may_be_calibrated()?,
            Action::Restart(board) => {
                let health = seen.health.unwrap_or_default();
                before = health.of(board).reboots as usize;
            }
            _ => {}
        }
        let id = self.ids.fresh(now.ns);
        let press = Input::of(action, status.order_id);
        let input = Input {
            id,
            ..press.unwrap_or_default()
        };
        // A simulated robot is put down first: nobody carries it. A real world takes no requests.
        let is_done_by_hand = matches!(action, Action::Place(_)) && !seen.is_simulated;
        let (act, awaits) = if let Some(ask) = Ask::of(action) {
            let ask = dated(ask, now, late, action);
            (Act::Ask { id, ask }, Await::Answer)
        } else if let Some(ask) = WorldAsk::of(action).filter(|_| !is_done_by_hand) {
            (Act::AskWorld { id, ask }, Await::World)
        } else {
            (Act::Press(input), Await::Effect)
        };
        self.acts.push(act);
        if !action.is_shown() {
            return Ok(Begun::Done);
        }
        self.list.push(Waiting {
            whose,
            action,
            awaits,
            before,
            input,
            since: now,
            given_ns: now.ns,
        });
        Ok(Begun::Waits)
    }

    /// Orders a product under the number `order`.
    pub fn order(&mut self, now: Moment, whose: K, order: u32, product: ProductId) {
        self.acts.push(ordered(order, product));
        self.list.push(Waiting {
            whose,
            action: Action::Add { order, product },
            awaits: Await::Effect,
            before: 0,
            input: Input::default(),
            since: now,
            given_ns: now.ns,
        });
    }

    /// The source of numbers; it repeats none within an hour.
    pub fn ids(&mut self) -> &mut Ids {
        &mut self.ids
    }
}

/// A request that lets the robot move expires as early as any other such order.
fn dated(ask: Ask, now: Moment, late: Duration, action: Action) -> Ask {
    match action.latest() == LATEST_MOVE {
        true => Ask {
            issued_ns: now.given_ns(late),
            lifetime_ms: LATEST_MOVE_MS,
            ..ask
        },
        false => ask,
    }
}
