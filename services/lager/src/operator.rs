//! The scripted operator: what a person would do at the panel, as a pure state machine.
//!
//! It sees only what a person sees (link health and what logic is doing) and acts only through what
//! a person has (the mode and orders). The robot picks by itself. It is apart from `up` because
//! `simulate` plays the same script in virtual time.
//!
//! ```text
//!  TakeOver --mode is autonomous--> Ordering --logic took the order--> Underway
//!                                      ^                                  |
//!                                      +------------ delivered -----------+
//! ```
//! A process that takes the script over from a killed one starts from its [`Script`]. It finds its
//! place by what logic says of the order (`Joining`).
//!
//! `up` plays the script on a simulated or emulated robot. Real boards move by it only where both
//! `--script` and `--mission` are given. `--headless` means "no panel", and there is none yet.

use core::time::Duration;

use lager_topics::{
    Ask, AskKind, Failure, FailureKind, Health, Mode, NavigatorStatus, Order, Phase, Remedy,
};
use serde::{Deserialize, Serialize};

/// How often a wish that shows no effect is repeated.
const REPEAT: Duration = Duration::from_millis(500);
/// How long logic may wait for a person before the operator gives the mission up.
const STUCK: Duration = Duration::from_secs(10);
/// The same where it waits for a way, which may open by itself.
const NO_WAY: Duration = Duration::from_secs(300);
/// How often logic may have tried all blocked ways again.
const TRIES: i32 = 5;

/// What the operator sees: the last of each, nothing before the first.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The links and who steers.
    pub health: Option<Health>,
    /// What logic is doing.
    pub status: Option<NavigatorStatus>,
    /// The order that logic refused last, and why.
    pub refused: Option<(u32, Failure)>,
}

/// One thing the operator does.
#[derive(Clone, Copy, Debug)]
pub enum Act {
    /// Asks the bridge.
    Ask(Ask),
    /// Orders a product.
    Order(Order),
}

/// A mission and its progress: all that a process needs which takes the script over.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Script {
    /// The products to fetch, in this order.
    pub mission: Vec<i32>,
    /// Those that have been delivered, the first of the mission.
    pub delivered: Vec<i32>,
    /// The order for the next one, once it has been given.
    pub order: Option<Given>,
    /// Why it has been given up.
    pub failure: Option<String>,
}

impl Script {
    /// A mission that has not been begun.
    pub fn new(mission: Vec<i32>) -> Self {
        Self {
            mission,
            ..Self::default()
        }
    }

    /// `Some` once the mission has ended: delivered, or failed with the reason.
    pub fn outcome(&self) -> Option<Result<(), &str>> {
        match &self.failure {
            Some(why) => Some(Err(why)),
            None => (self.delivered.len() == self.mission.len()).then_some(Ok(())),
        }
    }

    /// Whether logic has delivered what it was ordered.
    fn has_come(&self, order: u32, status: &NavigatorStatus) -> bool {
        let before = self.order.map(|given| given.delivered_before);
        before != Some(status.delivered) && status.order_id == order
    }

    /// Gives the mission up, unless it has ended already.
    pub fn give_up(&mut self, why: &str) {
        if self.outcome().is_none() {
            self.failure = Some(why.to_owned());
        }
    }
}

/// An order of the script that has not come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// Its number.
    pub id: u32,
    /// What logic had counted as delivered before it.
    pub delivered_before: u32,
}

/// The script and where it stands.
#[derive(Debug)]
pub struct ScriptedOperator {
    script: Script,
    step: Step,
    acted: Option<Duration>,
    stuck_since: Option<Duration>,
    next_id: u32,
}

#[derive(Debug)]
enum Step {
    TakeOver,
    Joining { order: u32 },
    Ordering { order: u32 },
    Underway { order: u32 },
    Finished,
    Failed(String),
}

impl ScriptedOperator {
    /// A script that fetches the rest of its mission. Ids start at `first_id`, which is beyond
    /// those of the process that had the script before.
    pub fn new(script: Script, first_id: u32) -> Self {
        let step = match (script.outcome(), script.order) {
            (Some(Ok(())), _) => Step::Finished,
            (Some(Err(why)), _) => Step::Failed(why.to_owned()),
            (None, Some(given)) => Step::Joining { order: given.id },
            (None, None) => Step::TakeOver,
        };
        Self {
            script,
            step,
            acted: None,
            stuck_since: None,
            next_id: first_id,
        }
    }

    /// How far the mission has come.
    pub fn script(&self) -> &Script {
        &self.script
    }

    /// The products delivered so far, in order.
    pub fn delivered(&self) -> &[i32] {
        &self.script.delivered
    }

    /// `Some` once the mission has ended: delivered, or failed with the reason.
    pub fn outcome(&self) -> Option<Result<(), &str>> {
        self.script.outcome()
    }

    /// Looks, and does at most one thing.
    pub fn step(&mut self, now: Duration, seen: &Seen) -> Option<Act> {
        let (health, status) = (seen.health?, seen.status?);
        if self.is_stuck(now, &status) && self.outcome().is_none() {
            self.step = Step::Failed(format!("logic waits for a person: {}", status.failure));
        }
        if let Some(next) = self.advance(&health, &status, seen) {
            self.step = next;
            self.acted = None;
        }
        if let Step::Failed(why) = &self.step {
            self.script.give_up(why);
        }
        if self.acted.is_some_and(|acted| now < acted + REPEAT) {
            return None;
        }
        let act = self.act(&health)?;
        self.acted = Some(now);
        Some(act)
    }

    /// The step that what is seen leads to, if it is another one.
    fn advance(&mut self, health: &Health, status: &NavigatorStatus, seen: &Seen) -> Option<Step> {
        let phase = status.phase.get()?;
        match self.step {
            Step::TakeOver => {
                let ready = health.mode.get() == Some(Mode::Autonomous)
                    && health.sensor.up != 0
                    && health.steering.up != 0;
                ready.then(|| self.next_order(status))
            }
            // Logic may not have heard of it; it takes an order that it has for a repeat.
            Step::Joining { order } if status.order_id != order => Some(Step::Ordering { order }),
            Step::Joining { order } => Some(Step::Underway { order }),
            Step::Ordering { order } if status.order_id == order && accepted(phase) => {
                self.note(order, status);
                Some(Step::Underway { order })
            }
            Step::Underway { order } if self.script.has_come(order, status) => {
                Some(self.next_order_after_delivery(status))
            }
            Step::Underway { order } if !accepted(phase) => Some(given_up(order, seen)),
            _ => None,
        }
    }

    /// Whether logic has waited for a person for too long.
    fn is_stuck(&mut self, now: Duration, status: &NavigatorStatus) -> bool {
        if status.failure.is_none() {
            self.stuck_since = None;
            return false;
        }
        let failure = &status.failure;
        let patience = match failure.remedy.get() {
            Some(Remedy::Way) => NO_WAY,
            _ => STUCK,
        };
        if failure.kind == FailureKind::Unreachable && failure.seen >= TRIES {
            return true;
        }
        now - *self.stuck_since.get_or_insert(now) >= patience
    }

    /// Takes down what a successor would want to know of the order under way.
    fn note(&mut self, id: u32, status: &NavigatorStatus) {
        self.script.order = Some(Given {
            id,
            delivered_before: status.delivered,
        });
    }

    fn next_order_after_delivery(&mut self, status: &NavigatorStatus) -> Step {
        let product = self.script.mission[self.script.delivered.len()];
        self.script.delivered.push(product);
        self.next_order(status)
    }

    fn next_order(&mut self, status: &NavigatorStatus) -> Step {
        self.script.order = None;
        if self.script.outcome().is_some() {
            return Step::Finished;
        }
        self.next_id += 1;
        let order = self.next_id;
        self.note(order, status);
        Step::Ordering { order }
    }

    /// What the step wants done now.
    fn act(&self, health: &Health) -> Option<Act> {
        match self.step {
            Step::TakeOver if health.mode.get() != Some(Mode::Autonomous) => Some(Act::Ask(Ask {
                kind: AskKind::SetMode.into(),
                mode: Mode::Autonomous.into(),
                ..Ask::default()
            })),
            Step::Ordering { order } => Some(Act::Order(Order {
                id: order,
                product: self.script.mission[self.script.delivered.len()],
            })),
            _ => None,
        }
    }
}

/// Logic waits for an order and has not delivered this one.
fn given_up(order: u32, seen: &Seen) -> Step {
    let why = match seen.refused {
        Some((refused, failure)) if refused == order => failure.to_string(),
        _ => "it does not say why".into(),
    };
    Step::Failed(format!("logic has given the order up: {why}"))
}

/// Whether logic is at work on the order it shows.
fn accepted(phase: Phase) -> bool {
    !matches!(phase, Phase::WaitingForMap | Phase::WaitingForOrder)
}
