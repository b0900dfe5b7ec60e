//! A mission: what a robot is to fetch, how far it has come, and whether it has ended. A pure state
//! machine over what a person at the robot would see.
//!
//! ```text
//!   the robot has a station of its own     the station's queue has the products from the start, and
//!                                          tells the robot one of them whenever it asks
//!   it has none, or somebody else's,       they are given to the robot's own queue, one after the
//!   and in virtual time                    other, as `lager queue add` does
//! ```
//! Either way it is watched here. A product counts as delivered when logic says so. The robot is
//! put into autonomous mode at the beginning, unless somebody has set its mode before; from then on
//! that is a person's. A robot that is started again begins anew, and the mission of before is given up.
//!
//! A process that takes a mission over from a killed one starts from its [`Mission`]: an order that
//! logic has not shown yet is given again under its number, which logic takes for a repeat.

use core::time::Duration;
use std::collections::VecDeque;

use lager_operator::{Act, Ids, Seen, Wanted};
use lager_orders::{Mode, Moment, Pick};
use lager_sample::Tag;
use lager_topics::{
    Ask, AskKind, Failure, FailureKind, Health, Hold, NavigatorStatus, Order, OrderQueue, Phase,
    Remedy,
};
use serde::{Deserialize, Serialize};

/// How long logic may wait for a person before the mission is given up.
const STUCK: Duration = Duration::from_secs(10);
/// The same where it waits for a way, which may open by itself.
const NO_WAY: Duration = Duration::from_secs(300);
/// How often logic may have tried all blocked ways again.
const TRIES: i32 = 5;
/// How long a robot that may drive can be without an order: a station that was killed is up again
/// by then.
const IDLE: Duration = Duration::from_secs(60);
/// Orders that wait in the robot at a time, at most; the others are given later.
const MOST_WAITING: usize = 16;

/// Who helps a robot whose battery is low or whose arm is in its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Helper {
    /// A person, some time.
    Person,
    /// Nobody: the robot is simulated.
    Nobody,
}

/// A mission and its progress: all that a process needs which takes it over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// The products that are not delivered yet, in the order given.
    open: Vec<i32>,
    /// Those that are, in the order in which they were, and those that others have ordered.
    delivered: Vec<i32>,
    /// The orders that logic has not shown yet; none where a station gives them.
    unseen: VecDeque<(u32, i32)>,
    /// The robot was in autonomous mode, or somebody has set its mode.
    begun: bool,
    /// What logic had counted as delivered when it was looked at last.
    counted: Option<u32>,
    /// Why it has been given up.
    failure: Option<String>,
    /// What logic calls that, where it is logic that gives up.
    failure_kind: Option<Tag<FailureKind>>,
    /// What logic calls it where it would go on by itself.
    hold: Option<Tag<Hold>>,
}

impl Mission {
    /// A mission whose orders a station gives.
    pub fn of_station(products: &[i32]) -> Self {
        Self {
            open: products.to_vec(),
            ..Self::default()
        }
    }

    /// A mission whose orders are given here, under numbers from `first_id` on.
    pub fn of_robot(products: &[i32], first_id: u32) -> Self {
        let ids = (0..).map(|place: u32| first_id.wrapping_add(place).max(1));
        Self {
            unseen: ids.zip(products.iter().copied()).collect(),
            ..Self::of_station(products)
        }
    }

    /// The same, where somebody else orders these products.
    pub fn leave(&mut self, ordered: impl Fn(i32) -> bool) {
        self.unseen.retain(|(_, product)| !ordered(*product));
    }

    /// No mission, only a look at what the robot delivers for whoever orders it.
    pub fn of_others() -> Self {
        Self {
            begun: true,
            ..Self::default()
        }
    }

    /// The products delivered so far, in order, also those that others have ordered.
    pub fn delivered(&self) -> &[i32] {
        &self.delivered
    }

    /// `Some` once the mission has ended: delivered, or failed with the reason.
    pub fn outcome(&self) -> Option<Result<(), &str>> {
        match &self.failure {
            Some(why) => Some(Err(why)),
            None => (self.begun && self.open.is_empty()).then_some(Ok(())),
        }
    }

    /// What logic calls it that the mission was given up.
    pub fn failure_kind(&self) -> Option<Tag<FailureKind>> {
        self.failure_kind
    }

    /// What logic stands for, where the mission was given up for that.
    pub fn hold(&self) -> Option<Tag<Hold>> {
        self.hold
    }

    /// Gives the mission up, unless it has ended already.
    pub fn give_up(&mut self, why: &str) {
        if self.outcome().is_none() {
            self.failure = Some(why.to_owned());
        }
    }

    /// The robot starts again, and nothing has begun. Gives the mission of before up.
    pub fn begin_again(&mut self, why: &str) {
        self.give_up(why);
        self.begun = false;
    }

    /// Takes down what logic has delivered.
    fn count(&mut self, status: &NavigatorStatus) {
        let before = self.counted.replace(status.delivered);
        if before.is_some_and(|before| status.delivered > before) {
            let product = status.product;
            self.delivered.push(product);
            if let Some(place) = self.open.iter().position(|open| *open == product) {
                self.open.remove(place);
            }
        }
    }

    /// Forgets the orders that logic shows.
    fn see(&mut self, status: &NavigatorStatus, queue: &OrderQueue) {
        while let Some((id, _)) = self.unseen.front()
            && (status.order_id == *id || queue.has(*id))
        {
            self.unseen.pop_front();
        }
    }
}

/// Who sees to a mission.
#[derive(Debug)]
pub struct Watch {
    mission: Mission,
    helper: Helper,
    wanted: Wanted,
    ids: Ids,
    stuck_since: Option<Duration>,
    unhelped_since: Option<Duration>,
    idle_since: Option<Duration>,
    /// The number of the refused order that has been judged.
    judged: Option<u32>,
}

/// Why a mission will not be delivered, and what logic calls that.
#[derive(Debug, Default)]
struct Hopeless {
    why: String,
    kind: Option<Tag<FailureKind>>,
    hold: Option<Tag<Hold>>,
}

impl Hopeless {
    fn new(why: String) -> Self {
        Self {
            why,
            ..Self::default()
        }
    }

    fn of_logic(why: &str, failure: &Failure) -> Self {
        Self {
            kind: Some(failure.kind),
            ..Self::new(format!("{why}: {failure}"))
        }
    }
}

impl Watch {
    /// Sees to what is left of `mission`.
    pub fn new(mission: Mission, helper: Helper) -> Self {
        Self {
            mission,
            helper,
            wanted: Wanted::default(),
            ids: Ids::default(),
            stuck_since: None,
            unhelped_since: None,
            idle_since: None,
            judged: None,
        }
    }

    /// How far it has come.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Looks, and does at most one thing.
    pub fn step(&mut self, now: Moment, seen: &Seen) -> Option<Act> {
        let (health, status) = (seen.health?, seen.status?);
        let queue = seen.queue.unwrap_or_default();
        self.mission.count(&status);
        self.mission.see(&status, &queue);
        let is_over = self.mission.outcome().is_some();
        if is_over && self.mission.begun {
            return None;
        }
        if !is_over && let Some(hopeless) = self.hopeless(now.robot, &health, &status, &queue, seen)
        {
            self.mission.give_up(&hopeless.why);
            self.mission.failure_kind = hopeless.kind;
            self.mission.hold = hopeless.hold;
            return None;
        }
        self.mission.begun |= is_whole(&health) && health.mode_chosen != 0;
        let act = self.act(&status, &queue);
        self.wanted.turn(now.ns, &mut self.ids, act)
    }

    /// What is wanted now.
    fn act(&self, status: &NavigatorStatus, queue: &OrderQueue) -> Option<Act> {
        if !self.mission.begun {
            let ask = Ask {
                kind: AskKind::Begin.into(),
                ..Ask::default()
            };
            return Some(Act::Ask { id: 0, ask });
        }
        if self.mission.outcome().is_some() {
            return None;
        }
        let (id, product) = *self.mission.unseen.front()?;
        let has_room = queue.orders().len() < MOST_WAITING;
        let knows_goods = status.phase != Phase::WaitingForMap;
        (has_room && knows_goods).then_some(Act::Order(Order { id, product }))
    }

    /// Why the mission will not be delivered, if that is so.
    fn hopeless(
        &mut self,
        now: Duration,
        health: &Health,
        status: &NavigatorStatus,
        queue: &OrderQueue,
        seen: &Seen,
    ) -> Option<Hopeless> {
        if self.is_stuck(now, status) {
            let why = "logic waits for a person";
            return Some(Hopeless::of_logic(why, &status.failure));
        }
        if let Some(hold) = self.unhelped(now, status) {
            let (x, y, remedy) = (status.x, status.y, hold.remedy());
            let what = match hold {
                Hold::Arm => "the arm is not where it is carried",
                _ => "the battery is low",
            };
            return Some(Hopeless {
                hold: Some(status.hold),
                ..Hopeless::new(format!(
                    "{what}, and the robot stands at crossing ({x}, {y}): {remedy}"
                ))
            });
        }
        let phase = status.phase.get()?;
        let is_idle = matches!(phase, Phase::WaitingForMap | Phase::WaitingForOrder)
            && queue.under_way == 0
            && queue.orders().is_empty();
        if let Some((id, product, why)) = seen.refused
            && self.judged.replace(id) != Some(id)
            && is_idle
            && self.is_own(id, product)
        {
            return Some(Hopeless::of_logic("logic has given the order up", &why));
        }
        let is_forgotten = is_idle && self.mission.begun && takes_orders(health);
        if !is_forgotten || health.stopped != 0 {
            self.idle_since = None;
            return None;
        }
        let since = *self.idle_since.get_or_insert(now);
        let open = &self.mission.open;
        (now - since >= IDLE).then(|| match phase {
            Phase::WaitingForMap => Hopeless::new("nobody tells the robot its warehouse".into()),
            _ => Hopeless::new(format!("nobody orders {open:?} any more")),
        })
    }

    /// Whether the refused order is one of the mission's. A station's orders have numbers that are
    /// not known here.
    fn is_own(&self, id: u32, product: i32) -> bool {
        match self.mission.unseen.front() {
            Some((own, _)) => *own == id,
            None => self.mission.open.contains(&product),
        }
    }

    /// Whether logic has waited for a person for too long.
    fn is_stuck(&mut self, now: Duration, status: &NavigatorStatus) -> bool {
        let failure = &status.failure;
        if failure.is_none() {
            self.stuck_since = None;
            return false;
        }
        let patience = match failure.remedy.get() {
            Some(Remedy::Way) => NO_WAY,
            _ => STUCK,
        };
        if failure.kind == FailureKind::Unreachable && failure.seen >= TRIES {
            return true;
        }
        now - *self.stuck_since.get_or_insert(now) >= patience
    }

    /// For what the robot has stood too long, where nobody ends it. Who picks by hand moves the
    /// arm.
    fn unhelped(&mut self, now: Duration, status: &NavigatorStatus) -> Option<Hold> {
        let hold = status.hold.get().filter(|hold| match hold {
            Hold::Battery => self.helper == Helper::Nobody,
            Hold::Arm => self.helper == Helper::Nobody && status.pick == Pick::Auto,
            Hold::None | Hold::Blind | Hold::Unheard | Hold::Link | Hold::Undescribed => false,
        });
        if hold.is_none() {
            self.unhelped_since = None;
        }
        hold.filter(|_| now - *self.unhelped_since.get_or_insert(now) >= STUCK)
    }
}

/// Whether logic steers and both boards are there.
fn takes_orders(health: &Health) -> bool {
    is_whole(health) && health.mode.get() == Some(Mode::Autonomous)
}

/// Whether both boards are there.
fn is_whole(health: &Health) -> bool {
    health.sensor.up != 0 && health.steering.up != 0
}

#[cfg(test)]
mod tests;
