//! A mission: what a robot is to fetch, how far it has come, and whether it has ended. A pure state
//! machine over what a person at the robot would see.
//!
//! ```text
//!   the robot has a station of its own     the station's queue has the products from the start, and
//!                                          tells the robot one of them whenever it asks
//!   it has none, or somebody else's,       they are given to the robot's own queue, one after the
//!   and in virtual time                    other, as `lager queue add` does
//! ```
//! Either way it is watched here. A product counts as delivered when logic says so. The robot is put
//! into autonomous mode at the beginning, unless somebody has set its mode before; from then on that
//! is a person's.
//!
//! A process that takes a mission over from a killed one starts from its [`Mission`]: an order that
//! logic has not shown yet is given again under its number, which logic takes for a repeat.

use core::time::Duration;
use std::collections::VecDeque;

use lager_topics::{
    Ask, AskKind, Failure, FailureKind, Health, Mode, NavigatorStatus, Order, OrderQueue, Phase,
    Remedy, Tag,
};
use serde::{Deserialize, Serialize};

/// How often a wish that shows no effect is repeated.
const REPEAT: Duration = Duration::from_millis(500);
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

/// What is seen: the last of each, nothing before the first.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The links and who steers.
    pub health: Option<Health>,
    /// What logic is doing.
    pub status: Option<NavigatorStatus>,
    /// The orders that it has.
    pub queue: Option<OrderQueue>,
    /// The order that logic refused last: its number, its product, and why.
    pub refused: Option<(u32, i32, Failure)>,
}

/// One thing that is done for a mission.
#[derive(Clone, Copy, Debug)]
pub enum Act {
    /// Asks the bridge.
    Ask(Ask),
    /// Orders a product.
    Order(Order),
}

/// A mission and its progress: all that a process needs which takes it over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// The products that are not delivered yet, in the order given.
    open: Vec<i32>,
    /// Those that are, in the order in which they were.
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

    /// The products delivered so far, in order.
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

    /// Gives the mission up, unless it has ended already.
    pub fn give_up(&mut self, why: &str) {
        if self.outcome().is_none() {
            self.failure = Some(why.to_owned());
        }
    }

    /// Takes down what logic has delivered.
    fn count(&mut self, status: &NavigatorStatus) {
        let before = self.counted.replace(status.delivered);
        if before.is_some_and(|before| status.delivered > before)
            && let Some(place) = self.open.iter().position(|open| *open == status.product)
        {
            self.delivered.push(self.open.remove(place));
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
    acted: Option<Duration>,
    stuck_since: Option<Duration>,
    idle_since: Option<Duration>,
    /// The number of the refused order that has been judged.
    judged: Option<u32>,
}

impl Watch {
    /// Sees to what is left of `mission`.
    pub fn new(mission: Mission) -> Self {
        Self {
            mission,
            acted: None,
            stuck_since: None,
            idle_since: None,
            judged: None,
        }
    }

    /// How far it has come.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Looks, and does at most one thing.
    pub fn step(&mut self, now: Duration, seen: &Seen) -> Option<Act> {
        let (health, status) = (seen.health?, seen.status?);
        let queue = seen.queue.unwrap_or_default();
        self.mission.count(&status);
        let to_give = self.mission.unseen.len();
        self.mission.see(&status, &queue);
        if self.mission.unseen.len() < to_give {
            self.acted = None;
        }
        if self.mission.outcome().is_some() {
            return None;
        }
        if let Some(why) = self.hopeless(now, &health, &status, &queue, seen) {
            let (why, kind) = why;
            self.mission.give_up(&why);
            self.mission.failure_kind = kind;
            return None;
        }
        if !self.mission.begun && is_whole(&health) && health.mode_chosen != 0 {
            self.mission.begun = true;
            self.acted = None;
        }
        if self.acted.is_some_and(|acted| now < acted + REPEAT) {
            return None;
        }
        let act = self.act(&status, &queue)?;
        self.acted = Some(now);
        Some(act)
    }

    /// What is wanted now.
    fn act(&self, status: &NavigatorStatus, queue: &OrderQueue) -> Option<Act> {
        if !self.mission.begun {
            return Some(Act::Ask(Ask {
                kind: AskKind::Begin.into(),
                ..Ask::default()
            }));
        }
        let (id, product) = *self.mission.unseen.front()?;
        let has_room = queue.orders().len() < MOST_WAITING;
        let knows_goods = status.phase != Phase::WaitingForMap;
        (has_room && knows_goods).then_some(Act::Order(Order { id, product }))
    }

    /// Why the mission will not be delivered, if that is so, and what logic calls it.
    fn hopeless(
        &mut self,
        now: Duration,
        health: &Health,
        status: &NavigatorStatus,
        queue: &OrderQueue,
        seen: &Seen,
    ) -> Option<(String, Option<Tag<FailureKind>>)> {
        if self.is_stuck(now, status) {
            let why = &status.failure;
            return Some((format!("logic waits for a person: {why}"), Some(why.kind)));
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
            return Some((
                format!("logic has given the order up: {why}"),
                Some(why.kind),
            ));
        }
        let is_forgotten = is_idle && self.mission.begun && takes_orders(health);
        if !is_forgotten || health.stopped != 0 {
            self.idle_since = None;
            return None;
        }
        let since = *self.idle_since.get_or_insert(now);
        let open = &self.mission.open;
        (now - since >= IDLE).then(|| match phase {
            Phase::WaitingForMap => ("nobody tells the robot its warehouse".into(), None),
            _ => (format!("nobody orders {open:?} any more"), None),
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
mod tests {
    use super::*;

    /// A robot that is ready and does this.
    fn seen(phase: Phase, status: NavigatorStatus) -> Seen {
        let mut health = Health {
            mode: Mode::Autonomous.into(),
            mode_chosen: 1,
            ..Health::default()
        };
        (health.sensor.up, health.steering.up) = (1, 1);
        Seen {
            health: Some(health),
            status: Some(NavigatorStatus {
                phase: phase.into(),
                ..status
            }),
            queue: Some(OrderQueue::default()),
            refused: None,
        }
    }

    fn delivered(count: u32, product: i32) -> NavigatorStatus {
        NavigatorStatus {
            delivered: count,
            product,
            ..NavigatorStatus::default()
        }
    }

    fn seconds(count: u64) -> Duration {
        Duration::from_secs(count)
    }

    #[test]
    fn what_a_station_orders_is_counted_in_any_order_and_what_others_order_is_not() {
        let mut watch = Watch::new(Mission::of_station(&[3, 1, 3]));
        for (count, product) in [(0, 0), (1, 1), (2, 7), (3, 3)] {
            let seen = seen(Phase::BackingOff, delivered(count, product));
            assert!(watch.step(seconds(1), &seen).is_none());
        }
        assert_eq!(watch.mission().delivered(), [1, 3]);
        // A successor goes on from there; one more look at the same is no delivery.
        let mut heir = Watch::new(watch.mission().clone());
        heir.step(seconds(2), &seen(Phase::BackingOff, delivered(3, 3)));
        assert_eq!(heir.mission().outcome(), None);
        heir.step(seconds(3), &seen(Phase::BackingOff, delivered(4, 3)));
        assert_eq!(heir.mission().outcome(), Some(Ok(())));
        assert_eq!(heir.mission().delivered(), [1, 3, 3]);
    }

    #[test]
    fn a_person_who_has_set_the_mode_before_the_mission_began_keeps_it() {
        let mut ready = seen(Phase::WaitingForOrder, delivered(0, 0));
        let health = ready.health.as_mut().expect("health");
        (health.mode, health.mode_chosen) = (Mode::Manual.into(), 0);
        let mut watch = Watch::new(Mission::of_robot(&[5], 40));
        let begins = |act: Option<Act>| match act {
            Some(Act::Ask(ask)) => ask.kind == AskKind::Begin,
            _ => false,
        };
        assert!(begins(watch.step(seconds(1), &ready)));
        ready.health.as_mut().expect("health").mode_chosen = 1;
        for second in 2..100 {
            assert!(!begins(watch.step(seconds(second), &ready)));
        }
        assert_eq!(watch.mission().outcome(), None);
    }

    #[test]
    fn an_order_of_the_robots_own_is_repeated_under_its_number_until_it_is_seen() {
        let mut watch = Watch::new(Mission::of_robot(&[5, 6], 40));
        let idle = seen(Phase::WaitingForOrder, delivered(0, 0));
        let ordered = |act| match act {
            Some(Act::Order(order)) => (order.id, order.product),
            other => panic!("{other:?}"),
        };
        assert_eq!(ordered(watch.step(seconds(1), &idle)), (40, 5));
        assert!(watch.step(seconds(1), &idle).is_none());
        assert_eq!(ordered(watch.step(seconds(2), &idle)), (40, 5));
        let mut heir = Watch::new(watch.mission().clone());
        assert_eq!(ordered(heir.step(seconds(2), &idle)), (40, 5));
        let mut taken = seen(Phase::Driving, delivered(0, 5));
        taken.status = taken.status.map(|status| NavigatorStatus {
            order_id: 40,
            ..status
        });
        assert_eq!(ordered(heir.step(seconds(2), &taken)), (41, 6));
    }

    #[test]
    fn a_refusal_ends_the_mission_and_only_its_own_does() {
        let why = Failure::new(FailureKind::UnknownProduct, (0, 0), 0, 0);
        let refused = |product| Seen {
            refused: Some((9, product, why)),
            ..seen(Phase::WaitingForOrder, delivered(0, 0))
        };
        let mut watch = Watch::new(Mission::of_station(&[5]));
        watch.step(seconds(1), &refused(4));
        assert_eq!(watch.mission().outcome(), None);
        // What was refused while it was at work was another one's.
        let busy = Seen {
            refused: Some((10, 5, why)),
            ..seen(Phase::Driving, delivered(0, 5))
        };
        watch.step(seconds(2), &busy);
        assert_eq!(watch.mission().outcome(), None);
        let mut watch = Watch::new(Mission::of_station(&[5]));
        watch.step(seconds(1), &refused(5));
        let outcome = watch.mission().outcome();
        assert!(outcome.is_some_and(|outcome| outcome.is_err()));
    }

    #[test]
    fn a_mission_that_nobody_orders_any_more_has_failed_but_one_that_is_stopped_waits() {
        let idle = seen(Phase::WaitingForOrder, delivered(0, 0));
        let stopped = Seen {
            health: idle.health.map(|health| Health {
                stopped: 1,
                ..health
            }),
            ..idle.clone()
        };
        let mut watch = Watch::new(Mission::of_station(&[5]));
        watch.step(seconds(1), &idle);
        watch.step(seconds(50), &stopped);
        watch.step(seconds(51), &idle);
        watch.step(seconds(110), &idle);
        assert_eq!(watch.mission().outcome(), None);
        watch.step(seconds(111), &idle);
        let told = watch.mission().outcome();
        assert_eq!(told, Some(Err("nobody orders [5] any more")));
    }
}
