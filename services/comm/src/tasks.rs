//! What has been asked for and waits until the robot shows that it is done: orders, presses and
//! requests. Steering is [`Driving`](crate::driving::Driving)'s.
//!
//! ```text
//!            begin                        the robot shows it: done
//!   nothing ───────> given, repeated ───────────────────────────────────────────> ended
//!                    every 250 ms where     refused, or not shown in time: refused
//!                    that does no harm
//! ```
//!
//! Nothing is assumed to be done: an order is done when `mission/queue` has it, a press when
//! `nav/status` or the queue has its effect, a request when it is answered.

use lager_lines::extension::Edge;
use lager_topics::{
    Answer, Ask, AskKind, Event, EventKind, Health, Input, InputKind, NavigatorStatus, Order,
    OrderQueue, Outcome, Phase, Pick, WorldAnswer, WorldAsk, WorldRefusal,
};

use crate::action::Action;
use crate::ids::Ids;
use crate::known::Known;
use crate::map::heading;
use crate::moment::Moment;

/// In ns of real time: when an order or a press is repeated that logic does not show.
const REPEAT: u64 = 250_000_000;
/// How long logic may take to show what was given to it, and a request to be answered.
const PATIENCE: u64 = 2_500_000_000;
/// How long a calibration may take, in ms of robot time: the board watches its sensors for five
/// seconds.
const CALIBRATION_MS: u128 = 8_000;

/// Who has asked for something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asker {
    /// The answer to a question of the document, which is not replied to.
    Question,
    /// An action with this number.
    Action(u32),
}

/// How something has ended that was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Ended {
    pub(crate) asker: Asker,
    /// Done, or why not.
    pub(crate) result: Result<(), String>,
}

/// What is waited for.
#[derive(Clone, Copy, Debug)]
enum Task {
    /// Logic has the order.
    Order(Order),
    /// Logic has the order no more.
    Cancel,
    /// It is the next one; `before` were before it when this was last asked for.
    First { before: usize },
    /// Fewer than these are before it.
    Up { before: usize },
    /// No order waits.
    Clear,
    /// Logic has left the goods.
    Picked,
    /// Logic has it that this one picks the goods up.
    Pick(Pick),
    /// Logic takes it that it stands on the delivery node.
    Reset,
    /// The simulated world has put the robot on the crossing of its press.
    PutDown,
    /// Logic takes it that it stands there.
    Placed,
    /// The bridge has answered this.
    Ask(Ask),
    /// A calibration has ended besides those that had ended before.
    Calibration { ended_before: u8 },
    /// The simulated world has answered.
    World,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    asker: Asker,
    task: Task,
    /// What was pressed, if anything; requests have only its id.
    input: Input,
    since: Moment,
    given_ns: u64,
}

/// All of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tasks {
    list: Vec<Waiting>,
    actions: Vec<Action>,
    ended: Vec<Ended>,
}

/// What is begun. Each says how its effect is known.
impl Tasks {
    /// Most that is waited for at a time.
    pub(crate) const MOST: usize = 16;

    /// Whether something more may be asked for.
    pub(crate) fn has_room(&self) -> bool {
        self.list.len() < Self::MOST
    }

    pub(crate) fn order(&mut self, now: Moment, asker: Asker, order: Order) {
        self.actions.push(Action::Order(order));
        self.wait(now, asker, Task::Order(order), Input::default());
    }

    pub(crate) fn cancel(&mut self, now: Moment, asker: Asker, id: u32, order: u32) {
        let input = press(InputKind::OrderCancelled, id, order);
        self.press(now, asker, Task::Cancel, input);
    }

    /// `before` wait before it.
    pub(crate) fn first(&mut self, now: Moment, asker: Asker, id: u32, order: u32, before: usize) {
        let input = press(InputKind::OrderMovedUp, id, order);
        self.press(now, asker, Task::First { before }, input);
    }

    /// `before` wait before it.
    pub(crate) fn up(&mut self, now: Moment, asker: Asker, id: u32, order: u32, before: usize) {
        let input = press(InputKind::OrderMovedUp, id, order);
        self.press(now, asker, Task::Up { before }, input);
    }

    pub(crate) fn clear(&mut self, now: Moment, asker: Asker, id: u32) {
        let input = press(InputKind::QueueCleared, id, 0);
        self.press(now, asker, Task::Clear, input);
    }

    /// `force`: whether or not the claw feels the goods of `order`.
    pub(crate) fn picked(&mut self, now: Moment, asker: Asker, id: u32, order: u32, force: bool) {
        let kind = match force {
            true => InputKind::PickupForced,
            false => InputKind::PickupDone,
        };
        self.press(now, asker, Task::Picked, press(kind, id, order));
    }

    /// Who picks the goods up from now on.
    pub(crate) fn pick(&mut self, now: Moment, asker: Asker, id: u32, pick: Pick) {
        let kind = match pick {
            Pick::Manual => InputKind::PickByHand,
            Pick::Auto => InputKind::PickByItself,
        };
        self.press(now, asker, Task::Pick(pick), press(kind, id, 0));
    }

    pub(crate) fn reset(&mut self, now: Moment, asker: Asker, id: u32) {
        let input = press(InputKind::ResetPressed, id, 0);
        self.press(now, asker, Task::Reset, input);
    }

    /// It stands on this node and looks this way; `world` is asked to put it there first.
    pub(crate) fn place(
        &mut self,
        now: Moment,
        asker: Asker,
        id: u32,
        on: Edge,
        world: Option<WorldAsk>,
    ) {
        let input = Input {
            x: on.node.x,
            y: on.node.y,
            heading: heading(on.way).into(),
            ..press(InputKind::Placed, id, 0)
        };
        let Some(ask) = world else {
            return self.press(now, asker, Task::Placed, input);
        };
        self.actions.push(Action::AskWorld { id, ask });
        self.wait(now, asker, Task::PutDown, input);
    }

    pub(crate) fn ask(&mut self, now: Moment, asker: Asker, id: u32, ask: Ask) {
        self.actions.push(Action::Ask { id, ask });
        self.wait(now, asker, Task::Ask(ask), request(id));
    }

    pub(crate) fn ask_world(&mut self, now: Moment, asker: Asker, id: u32, ask: WorldAsk) {
        self.actions.push(Action::AskWorld { id, ask });
        self.wait(now, asker, Task::World, request(id));
    }

    fn press(&mut self, now: Moment, asker: Asker, task: Task, input: Input) {
        self.actions.push(Action::Press(input));
        self.wait(now, asker, task, input);
    }

    fn wait(&mut self, now: Moment, asker: Asker, task: Task, input: Input) {
        self.list.push(Waiting {
            asker,
            task,
            input,
            since: now,
            given_ns: now.ns,
        });
    }
}

/// What is known of it.
impl Tasks {
    /// What is to be done; it is then no longer here.
    pub(crate) fn actions(&mut self) -> Vec<Action> {
        core::mem::take(&mut self.actions)
    }

    /// What has ended; it is then no longer here.
    pub(crate) fn ended(&mut self) -> Vec<Ended> {
        core::mem::take(&mut self.ended)
    }

    /// Whether an order waits to be shown that answered a question.
    pub(crate) fn has_order(&self) -> bool {
        let is_it = |one: &Waiting| matches!(one.task, Task::Order(_));
        self.list
            .iter()
            .any(|one| one.asker == Asker::Question && is_it(one))
    }

    /// Whether somebody has said that the goods are held, and logic has not left yet.
    pub(crate) fn has_picked(&self) -> bool {
        self.list.iter().any(|one| matches!(one.task, Task::Picked))
    }

    /// Nobody is left who wants to hear of actions. What was given stays given.
    pub(crate) fn forget_actions(&mut self) {
        self.list.retain(|one| one.asker == Asker::Question);
    }
}

/// What the robot shows.
impl Tasks {
    /// Time has passed: what logic does not show yet is given again, and given up in the end.
    pub(crate) fn turn(&mut self, now: Moment) {
        let mut actions = Vec::new();
        self.end(|one| {
            let is_over = now.ns.saturating_sub(one.since.ns) >= PATIENCE;
            match one.task {
                // The document knows no end of an order that was given.
                Task::Order(_) if is_over && one.asker != Asker::Question => {
                    return Some(Err("logic does not take the order".into()));
                }
                Task::Calibration { .. } => {
                    let since = now.robot.saturating_sub(one.since.robot);
                    let is_over = since.as_millis() >= CALIBRATION_MS;
                    let why = "the sensor board does not say how the calibration went; try again";
                    return is_over.then(|| Err(why.into()));
                }
                // They have a time of their own.
                Task::Ask(_) | Task::World | Task::PutDown => return None,
                Task::Order(_) => {}
                _ if is_over => {
                    let why = match (one.asker, one.task) {
                        (Asker::Question, Task::Picked) => "logic does not react to pickup_done",
                        (_, Task::Cancel) => {
                            "logic does not react: the goods may be in the claw by now"
                        }
                        _ => "logic does not react",
                    };
                    return Some(Err(why.into()));
                }
                _ => {}
            }
            if now.ns.saturating_sub(one.given_ns) >= REPEAT {
                one.given_ns = now.ns;
                match one.task {
                    Task::Order(order) => actions.push(Action::Order(order)),
                    // The same press twice is one.
                    Task::Pick(_) => actions.push(Action::Press(one.input)),
                    // Two of these would be two, or would let the robot move late.
                    _ => {}
                }
            }
            None
        });
        self.actions.append(&mut actions);
    }

    /// Logic has told what it will fetch.
    pub(crate) fn queue(&mut self, now: Moment, queue: &OrderQueue, ids: &mut Ids) {
        let mut actions = Vec::new();
        self.end(|one| {
            let order = one.input.order_id;
            let is_done = match &mut one.task {
                Task::Order(order) => queue.has(order.id),
                Task::Cancel => !queue.has(order),
                // It is under way by now, or further up.
                Task::Up { before } => queue.before(order).map_or(true, |left| left < *before),
                Task::Clear => queue.orders().is_empty(),
                Task::First { before } => match queue.before(order) {
                    // It is under way by now.
                    Ok(0) | Err(_) => true,
                    Ok(left) if left < *before => {
                        *before = left;
                        one.input.id = ids.fresh(now);
                        one.since = now;
                        actions.push(Action::Press(one.input));
                        false
                    }
                    Ok(_) => false,
                },
                _ => false,
            };
            is_done.then_some(Ok(()))
        });
        self.actions.append(&mut actions);
    }

    /// Logic has told what it does, in a sample of this moment.
    pub(crate) fn status(&mut self, status: &NavigatorStatus, published_ns: u64) {
        self.end(|one| {
            let is_done = match one.task {
                Task::Order(order) => status.order_id == order.id,
                Task::Picked => status.phase != Phase::Picking,
                Task::Pick(pick) => status.pick == pick,
                Task::Reset => {
                    let phase = status.phase.get();
                    let waits = [Phase::WaitingForOrder, Phase::WaitingForMap];
                    published_ns > one.since.ns && phase.is_some_and(|phase| waits.contains(&phase))
                }
                Task::Placed => {
                    let Input { x, y, heading, .. } = one.input;
                    published_ns > one.since.ns
                        && status.phase == Phase::WaitingForOrder
                        && (status.x, status.y) == (x.into(), y.into())
                        && status.heading == heading
                }
                _ => false,
            };
            is_done.then_some(Ok(()))
        });
    }

    /// Something has happened on a mission.
    pub(crate) fn event(&mut self, event: &Event) {
        let kind = event.kind.get();
        self.end(|one| {
            let is_refused = match one.task {
                Task::Order(order) => {
                    kind == Some(EventKind::Refused) && event.order_id == order.id
                }
                Task::Picked => kind == Some(EventKind::PickupRefused),
                _ => false,
            };
            is_refused.then(|| Err(event.failure.to_string()))
        });
        // Whoever answered a question hears logic say why, in a thought.
        self.ended.retain(|ended| ended.asker != Asker::Question);
    }

    /// The bridge has told how a calibration stands.
    pub(crate) fn health(&mut self, health: &Health) {
        self.end(|one| match one.task {
            Task::Calibration { ended_before } if health.calibrations_ended != ended_before => {
                Some(health.calibration_failure().map_or(Ok(()), Err))
            }
            _ => None,
        });
    }

    /// The bridge has answered, or has not in time.
    pub(crate) fn answered(&mut self, id: u32, answer: Result<Answer, String>, known: &Known) {
        let calibrated = known.health.map_or(0, |health| health.calibrations_ended);
        self.end(|one| {
            let Task::Ask(ask) = one.task else {
                return None;
            };
            if one.input.id != id {
                return None;
            }
            let outcome = match &answer {
                Ok(answer) => answer.outcome.get(),
                Err(why) => return Some(Err(why.clone())),
            };
            match (outcome, ask.kind.get()) {
                // The end is still to come.
                (Some(Outcome::Done), Some(AskKind::Calibrate)) => {
                    one.task = Task::Calibration {
                        ended_before: calibrated,
                    };
                    None
                }
                (Some(Outcome::Done), _) => Some(Ok(())),
                (Some(Outcome::Refused), Some(AskKind::Resume)) => {
                    Some(Err(known.newer_stop(ask.stop_word)))
                }
                (Some(outcome), _) => Some(Err(outcome.to_string())),
                (None, _) => Some(Err("the bridge answers what nobody here understands".into())),
            }
        });
    }

    /// The simulated world has answered, or has not in time.
    pub(crate) fn world_answered(
        &mut self,
        now: Moment,
        id: u32,
        answer: &Result<WorldAnswer, String>,
    ) {
        let mut actions = Vec::new();
        self.end(|one| {
            if !matches!(one.task, Task::World | Task::PutDown) || one.input.id != id {
                return None;
            }
            let answer = match answer {
                Ok(answer) => answer,
                Err(why) => return Some(Err(why.clone())),
            };
            Some(match (answer.outcome.get(), answer.refusal.get()) {
                // Logic is still to be told.
                (Some(Outcome::Done), _) if matches!(one.task, Task::PutDown) => {
                    one.task = Task::Placed;
                    (one.since, one.given_ns) = (now, now.ns);
                    actions.push(Action::Press(one.input));
                    return None;
                }
                (Some(Outcome::Done), _) => Ok(()),
                (_, Some(why)) if why != WorldRefusal::None => Err(why.to_string()),
                _ => Err("the simulated world does not answer in time; is it very slow?".into()),
            })
        });
        self.actions.append(&mut actions);
    }

    /// Ends what `how` tells the end of.
    fn end(&mut self, mut how: impl FnMut(&mut Waiting) -> Option<Result<(), String>>) {
        let ended = &mut self.ended;
        self.list.retain_mut(|one| match how(one) {
            Some(result) => {
                let asker = one.asker;
                ended.push(Ended { asker, result });
                false
            }
            None => true,
        });
    }
}

fn press(kind: InputKind, id: u32, order_id: u32) -> Input {
    Input {
        kind: kind.into(),
        order_id,
        id,
        ..Input::default()
    }
}

/// A request is no press; it is known by its number.
fn request(id: u32) -> Input {
    Input {
        id,
        ..Input::default()
    }
}
