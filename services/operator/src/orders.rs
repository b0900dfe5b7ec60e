//! [`Orders`]: orders that wait until the robot shows that they are done: orders for products,
//! presses and requests. [`Driving`](crate::Driving) steers.
//!
//! ```text
//!            give                         the robot shows the effect: done
//!   nothing ───────> given, repeated ───────────────────────────────────────────> ended
//!                    every 250 ms if that   refused, or not shown in time: refused
//!                    does no harm
//! ```
//!
//! Nothing is assumed to be done. An order is done when `mission/queue` contains it, a press when
//! `nav/status` or the queue shows its effect, a request when it is answered.

use lager_floor::ProductId;
use lager_orders::{Action, Code, LeaseMs, Moment, Reason};
use lager_topics::{
    Ask, BridgeAnswer, Event, EventKind, Health, Input, NavigatorStatus, Order, OrderQueue,
    Outcome, Phase, WorldAnswer, WorldAsk, WorldRefusal,
};
use lager_wire::{Callsign, OperatorCommand};

use crate::ids::Ids;
use crate::seen::Seen;

mod giving;

/// After this time, in ns of real time, an order or a press is repeated if logic does not show it.
pub(crate) const REPEAT: u64 = 250_000_000;
/// How long logic may take to show an order, and the bridge to answer a request, in ns of real
/// time.
const PATIENCE: u64 = 2_500_000_000;
/// How long a calibration may take, in ms of robot time. The board watches its sensors for 5 s.
const CALIBRATION_MS: u128 = 8_000;
/// How long a board may take to be up again, in ms of robot time. It waits half a second in its
/// bootloader.
const RESTART_MS: u128 = 5_000;

/// Something that the caller must do on the bus.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// Publish an order for a product.
    Order(Order),
    /// Publish a press of a button.
    Press(Input),
    /// Send a request to the bridge.
    Ask {
        /// The number to return with the answer.
        id: u32,
        /// The request.
        ask: Ask,
    },
    /// Send a request to the simulated world.
    AskWorld {
        /// The number to return with the answer.
        id: u32,
        /// The request.
        ask: WorldAsk,
    },
}

/// The state of an action after it was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begun {
    /// It is done already.
    Done,
    /// It has been given, and its end comes later.
    Waits,
    /// It moves the robot, so the caller must give it to [`Driving`](crate::Driving).
    Steers(OperatorCommand, Option<LeaseMs>),
}

/// The end of an action for which `K` had asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended<K> {
    /// Who had asked.
    pub whose: K,
    /// Done, or why not.
    pub result: Result<(), Reason>,
}

/// The event that ends the wait for an order.
#[derive(Clone, Copy, Debug)]
enum Await {
    /// Logic shows its effect.
    Effect,
    /// The bridge answers.
    Answer,
    /// One more calibration has ended.
    Calibration { ended_before: u8 },
    /// This board has started once more, and is up.
    Restart { board: Callsign, before: usize },
    /// The simulated world answers; then logic must hear where the robot stands.
    World,
}

#[derive(Clone, Copy, Debug)]
struct Waiting<K> {
    whose: K,
    action: Action,
    awaits: Await,
    /// How many orders were before the one to be moved up, when the move was last given; how often
    /// the board that is to restart had started.
    before: usize,
    /// The press, if there is one; requests use only its id.
    input: Input,
    since: Moment,
    given_ns: u64,
}

/// All waiting orders. `K` is who has asked.
#[derive(Clone, Debug)]
pub struct Orders<K> {
    list: Vec<Waiting<K>>,
    acts: Vec<Act>,
    ended: Vec<Ended<K>>,
    ids: Ids,
}

impl<K> Default for Orders<K> {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            acts: Vec::new(),
            ended: Vec::new(),
            ids: Ids::default(),
        }
    }
}

/// The results.
impl<K: Copy> Orders<K> {
    /// Takes the list of things to do.
    pub fn acts(&mut self) -> Vec<Act> {
        core::mem::take(&mut self.acts)
    }

    /// Takes the list of actions that have ended.
    pub fn ended(&mut self) -> Vec<Ended<K>> {
        core::mem::take(&mut self.ended)
    }

    /// Who has asked for the orders of products that logic does not show yet.
    pub fn ordering(&self) -> impl Iterator<Item = K> {
        let is_it = |one: &&Waiting<K>| matches!(one.action, Action::Add { .. });
        self.list.iter().filter(is_it).map(|one| one.whose)
    }

    /// Whether somebody has said that the goods are held, and logic has not left yet.
    pub fn has_picked(&self) -> bool {
        let mut actions = self.list.iter().map(|one| one.action);
        actions.any(|action| matches!(action, Action::Picked { .. }))
    }

    /// Forgets all askers but those that are kept. Orders that were given stay given.
    pub fn keep(&mut self, mut is_kept: impl FnMut(K) -> bool) {
        self.list.retain(|one| is_kept(one.whose));
    }
}

/// What the robot shows.
impl<K: Copy> Orders<K> {
    /// To be called as time passes. Repeats orders that logic does not show yet, and ends them
    /// after a time; an order of a product only if `ends` says so for its asker.
    pub fn turn(&mut self, now: Moment, ends: impl Fn(K) -> bool) {
        let mut acts = Vec::new();
        self.end(|one| {
            match one.awaits {
                Await::Effect => {}
                Await::Calibration { .. } => {
                    let since = now.robot.saturating_sub(one.since.robot);
                    let is_over = since.as_millis() >= CALIBRATION_MS;
                    return is_over.then(|| Err(Code::CalibrationSilent.into()));
                }
                Await::Restart { .. } => {
                    let since = now.robot.saturating_sub(one.since.robot);
                    let is_over = since.as_millis() >= RESTART_MS;
                    return is_over.then(|| Err(Outcome::NoBoard.into()));
                }
                // The caller limits the time of these.
                Await::Answer | Await::World => return None,
            }
            let is_over = now.ns.saturating_sub(one.since.ns) >= PATIENCE;
            let why = match one.action {
                Action::Add { .. } => Some(Code::OrderUntaken).filter(|_| ends(one.whose)),
                Action::Cancel { .. } => Some(Code::CancelUnheard),
                _ => Some(Code::LogicSilent),
            };
            if let Some(why) = why.filter(|_| is_over) {
                return Some(Err(why.into()));
            }
            if now.ns.saturating_sub(one.given_ns) >= REPEAT {
                one.given_ns = now.ns;
                match one.action {
                    Action::Add { order, product } => acts.push(ordered(order, product)),
                    // Logic takes the same press twice as one.
                    Action::Pick(_) => acts.push(Act::Press(one.input)),
                    // A repetition would count twice, or would let the robot move late.
                    _ => {}
                }
            }
            None
        });
        self.acts.append(&mut acts);
    }

    /// To be called with the list of orders that logic has.
    pub fn queue(&mut self, now: Moment, queue: &OrderQueue) {
        let mut ids = self.ids;
        let mut acts = Vec::new();
        self.end(|one| {
            let is_done = match one.action {
                Action::Add { order, .. } => queue.has(order),
                Action::Cancel { order } => !queue.has(order),
                // It is under way by now, or further up.
                Action::Up { order } => queue.before(order).map_or(true, |left| left < one.before),
                Action::Clear => queue.orders().is_empty(),
                Action::Back { product } => !queue.is_gone(product),
                Action::First { order } => match queue.before(order) {
                    // It is under way by now.
                    Ok(0) | Err(_) => true,
                    Ok(left) if left < one.before => {
                        one.before = left;
                        one.input.id = ids.fresh(now.ns);
                        one.since = now;
                        acts.push(Act::Press(one.input));
                        false
                    }
                    Ok(_) => false,
                },
                _ => false,
            };
            is_done.then_some(Ok(()))
        });
        self.ids = ids;
        self.acts.append(&mut acts);
    }

    /// To be called with logic's status, and when it was published.
    pub fn status(&mut self, status: &NavigatorStatus, published_ns: u64) {
        self.end(|one| {
            let is_later = published_ns > one.since.ns;
            let is_done = match one.action {
                Action::Add { order, .. } => status.order_id == order,
                Action::Picked { .. } => status.phase != Phase::Picking,
                Action::Pick(pick) => status.pick == pick,
                Action::Reset => {
                    let phase = status.phase.get();
                    let waits = [Phase::WaitingForOrder, Phase::WaitingForMap];
                    is_later && phase.is_some_and(|phase| waits.contains(&phase))
                }
                Action::Place(on) if matches!(one.awaits, Await::Effect) => {
                    is_later
                        && status.phase == Phase::WaitingForOrder
                        && (status.x, status.y) == (on.node.x.into(), on.node.y.into())
                        && status.heading == on.heading
                }
                _ => false,
            };
            is_done.then_some(Ok(()))
        });
    }

    /// To be called with an event of a mission.
    pub fn event(&mut self, event: &Event) {
        let kind = event.kind.get();
        self.end(|one| {
            let is_refused = match one.action {
                Action::Add { order, .. } => {
                    kind == Some(EventKind::Refused) && event.order_id == order
                }
                Action::Picked { .. } => kind == Some(EventKind::PickupRefused),
                _ => false,
            };
            is_refused.then(|| Err(event.failure.into()))
        });
    }

    /// To be called with the health, which shows how a calibration stands.
    pub fn health(&mut self, health: &Health) {
        self.end(|one| match one.awaits {
            Await::Calibration { ended_before } if health.calibrations_ended != ended_before => {
                Some(health.calibration_failure().map_or(Ok(()), Err))
            }
            Await::Restart { board, before } => {
                let shown = health.of(board);
                (shown.up != 0 && shown.reboots as usize != before).then_some(Ok(()))
            }
            _ => None,
        });
    }

    /// To be called when the bridge has answered, or has not answered in time.
    pub fn answered(&mut self, id: u32, answer: Result<BridgeAnswer, Reason>, seen: &Seen) {
        let calibrated = seen.health.map_or(0, |health| health.calibrations_ended);
        self.end(|one| {
            if !matches!(one.awaits, Await::Answer) || one.input.id != id {
                return None;
            }
            let outcome = match &answer {
                Ok(answer) => answer.outcome.get(),
                Err(why) => return Some(Err(why.clone())),
            };
            match (outcome, one.action) {
                // The end is still to come.
                (Some(Outcome::Done), Action::Calibrate) => {
                    one.awaits = Await::Calibration {
                        ended_before: calibrated,
                    };
                    None
                }
                (Some(Outcome::Done), Action::Restart(board)) => {
                    one.awaits = Await::Restart {
                        board,
                        before: one.before,
                    };
                    None
                }
                (Some(Outcome::Done), _) => Some(Ok(())),
                (Some(Outcome::Refused), Action::Resume { stop }) => {
                    Some(Err(seen.newer_stop(stop)))
                }
                (Some(outcome), _) => Some(Err(outcome.into())),
                (None, _) => Some(Err(Code::BridgeUnknown.into())),
            }
        });
    }

    /// To be called when the simulated world has answered, or has not answered in time.
    pub fn world_answered(&mut self, now: Moment, id: u32, answer: &Result<WorldAnswer, Reason>) {
        let mut acts = Vec::new();
        self.end(|one| {
            if !matches!(one.awaits, Await::World) || one.input.id != id {
                return None;
            }
            let answer = match answer {
                Ok(answer) => answer,
                Err(why) => return Some(Err(why.clone())),
            };
            Some(match (answer.outcome.get(), answer.refusal.get()) {
                // Logic must still hear of it.
                (Some(Outcome::Done), _) if matches!(one.action, Action::Place(_)) => {
                    one.awaits = Await::Effect;
                    (one.since, one.given_ns) = (now, now.ns);
                    acts.push(Act::Press(one.input));
                    return None;
                }
                (Some(Outcome::Done), _) => Ok(()),
                (_, Some(why)) if why != WorldRefusal::None => Err(why.into()),
                _ => Err(Code::WorldSilent.into()),
            })
        });
        self.acts.append(&mut acts);
    }

    /// Ends all waiting orders for which `how` returns a result.
    fn end(&mut self, mut how: impl FnMut(&mut Waiting<K>) -> Option<Result<(), Reason>>) {
        let ended = &mut self.ended;
        self.list.retain_mut(|one| match how(one) {
            Some(result) => {
                let whose = one.whose;
                ended.push(Ended { whose, result });
                false
            }
            None => true,
        });
    }
}

fn ordered(id: u32, product: ProductId) -> Act {
    let product = product.get();
    Act::Order(Order { id, product })
}
