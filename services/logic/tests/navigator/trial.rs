//! A trial: a navigator that drives the double, with the shell's work (renewal, status before
//! order) and an operator who picks; and the checks of a finished mission.

use std::time::Duration;

use lager_floor::{Heading, Node};
use lager_logic::map::Map;
use lager_logic::{Input, LogicConfig, Navigator, Output};
use lager_orders::{Mode, Pick};
use lager_topics::{
    BlockedWays, EventKind, InputKind, MapProduct, NavigatorStatus, Order, OrderQueue, Phase,
    WarehouseMap,
};
use proptest::test_runner::{Config as ProptestConfig, RngSeed};

use crate::double::{Body, STEP, Trouble};
use crate::floor::Exit;

const RENEWAL: Duration = Duration::from_millis(40);
const STATUS_PERIOD: Duration = Duration::from_millis(50);
const PICKING: Duration = Duration::from_millis(600);

/// How far the axle may be from the place where the robot should stand, in mm.
const PLACE_MM: f64 = 25.0;
/// The largest allowed error of the heading there, in degrees.
const LOOK_DEG: f64 = 15.0;

/// A warehouse with these products, numbered from 1.
pub(crate) fn warehouse(
    size: (u8, u8),
    delivery: (u8, u8),
    side_cm: u16,
    products: &[(u8, u8, Heading)],
) -> WarehouseMap {
    let mut map = WarehouseMap {
        width: size.0,
        height: size.1,
        delivery_x: delivery.0,
        delivery_y: delivery.1,
        side_length_cm: side_cm,
        product_count: products.len() as u16,
        ..WarehouseMap::default()
    };
    for (index, (x, y, side)) in products.iter().enumerate() {
        map.products[index] = MapProduct {
            id: index as i32 + 1,
            x: *x,
            y: *y,
            side: (*side).into(),
            ..MapProduct::default()
        };
    }
    map
}

/// The four sides.
pub(crate) const SIDES: [Heading; 4] = [Heading::Left, Heading::Up, Heading::Right, Heading::Down];

/// The corners at which the delivery can be.
pub(crate) fn corners(size: (u8, u8)) -> [(u8, u8); 4] {
    [(0, 0), (0, size.1), (size.0, 0), (size.0, size.1)]
}

/// The number of random missions: `cases`, or `LAGER_MISSIONS` if it is set. The missions are the
/// same each time; a longer run begins with those of a shorter one.
pub(crate) fn missions(cases: u32) -> ProptestConfig {
    let wanted = std::env::var("LAGER_MISSIONS").ok();
    ProptestConfig {
        cases: wanted.map_or(cases, |count| count.parse().expect("a number")),
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Whether the status must go out at once: more has changed than the values that always change.
fn is_news(before: &NavigatorStatus, after: &NavigatorStatus) -> bool {
    let steady = |status: &NavigatorStatus| NavigatorStatus {
        frames: 0,
        travelled_mm: 0,
        turned_deg: 0,
        distance_cm: 0,
        distance_age_ms: 0,
        // It follows from how far the robot has moved and what it sees.
        at_start: 0,
        ..*status
    };
    steady(before) != steady(after)
}

/// One robot with its navigator, and what has happened so far.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub(crate) config: LogicConfig,
    pub(crate) published: WarehouseMap,
    pub(crate) body: Body,
    pub(crate) navigator: Navigator,
    pub(crate) status: NavigatorStatus,
    /// The status after the last input.
    told: NavigatorStatus,
    status_at: Duration,
    sent: (u32, Duration),
    pub(crate) events: Vec<(EventKind, u32, Node)>,
    pub(crate) thoughts: Vec<String>,
    pub(crate) blocks: BlockedWays,
    /// The orders in their published form.
    pub(crate) queue: OrderQueue,
    picking_since: Option<Duration>,
    pub(crate) dead: bool,
}

impl Trial {
    pub(crate) fn new(published: WarehouseMap, exit: Exit, trouble: Trouble, seed: u64) -> Self {
        Self::with(LogicConfig::default(), published, exit, trouble, seed)
    }

    pub(crate) fn with(
        config: LogicConfig,
        published: WarehouseMap,
        exit: Exit,
        trouble: Trouble,
        seed: u64,
    ) -> Self {
        let body = Body::new(&published, exit, trouble, seed);
        let navigator = Navigator::new(config);
        let mut trial = Self {
            config,
            published,
            body,
            status: navigator.status(),
            told: navigator.status(),
            navigator,
            status_at: Duration::ZERO,
            sent: (0, Duration::ZERO),
            events: Vec::new(),
            thoughts: Vec::new(),
            blocks: BlockedWays::default(),
            queue: OrderQueue::default(),
            picking_since: None,
            dead: false,
        };
        trial.introduce();
        trial
    }

    /// Gives a new navigator its first inputs, those of the retained topics.
    fn introduce(&mut self) {
        let published = self.published;
        self.tell(Input::Map(&published));
        self.tell(Input::DrivenByHand(self.body.driven_by_hand));
        self.tell_mode();
    }

    pub(crate) fn tell_mode(&mut self) {
        let mode = if self.body.autonomous {
            Mode::Autonomous
        } else {
            Mode::Manual
        };
        let stopped = self.body.stopped;
        self.tell(Input::Mode { mode, stopped });
    }

    pub(crate) fn order(&mut self, id: u32, product: i32) {
        self.tell(Input::Order(&Order { id, product }));
    }

    /// A person presses a button for the order or the product `number`; 0 = for none.
    pub(crate) fn press(&mut self, kind: InputKind, number: u32) {
        self.tell(Input::Operator(&lager_topics::Input {
            kind: kind.into(),
            order_id: number,
            ..lager_topics::Input::default()
        }));
    }

    /// A person presses a button for a node and a heading.
    pub(crate) fn press_at(&mut self, kind: InputKind, (x, y): (u8, u8), heading: Heading) {
        self.tell(Input::Operator(&lager_topics::Input {
            kind: kind.into(),
            x,
            y,
            heading: heading.into(),
            ..lager_topics::Input::default()
        }));
    }

    /// Gives the navigator one input, and does what the shell does after it.
    pub(crate) fn tell(&mut self, input: Input<'_>) {
        let now = self.body.now;
        let Output {
            events,
            thought,
            status_changed,
            blocks_changed,
            queue_changed,
            ..
        } = self.navigator.handle(now, input);
        for event in &events {
            let kind = event.kind.get().unwrap();
            self.events
                .push((kind, event.order_id, Node::new(event.x, event.y)));
            self.check_event(kind);
        }
        self.thoughts
            .extend(thought.map(|thought| thought.to_string()));
        if blocks_changed {
            self.blocks = self.navigator.blocks();
        }
        if queue_changed {
            self.queue = self.navigator.queue();
        }
        assert_eq!(self.queue, self.navigator.queue(), "a change was not told");
        let status = self.navigator.status();
        assert!(
            status_changed || !is_news(&self.told, &status),
            "a change was not told: {:#?} {status:#?}",
            self.told
        );
        self.told = status;
        if status_changed || now >= self.status_at + STATUS_PERIOD {
            self.status = status;
            self.status_at = now;
        }
        if let Some(order) = self.navigator.current_order()
            && (order.id != self.sent.0 || now >= self.sent.1 + RENEWAL)
        {
            self.body.order(&order);
            self.sent = (order.id, now);
        }
    }

    /// Runs for one step, 5 ms of robot time.
    pub(crate) fn step(&mut self) {
        let frame = self.body.step();
        if self.dead {
            return;
        }
        if let Some(state) = frame {
            self.tell(Input::Line(state));
            if self.config.ranger_cm > 0
                && let Some(centimetres) = self.body.range_cm()
            {
                self.tell(Input::Distance(centimetres));
            }
        }
        self.tell(Input::DrivenByHand(self.body.driven_by_hand));
        if !self.body.silent {
            let report = self.body.report();
            self.tell(Input::Steering(&report));
        }
        self.pick();
    }

    /// Some time after the robot has come to the goods, the operator presses "picked" repeatedly.
    fn pick(&mut self) {
        if self.status.phase != Phase::Picking || self.config.pick == Pick::Auto {
            self.picking_since = None;
            return;
        }
        let since = *self.picking_since.get_or_insert(self.body.now);
        if self.body.now >= since + PICKING {
            let order_id = self.status.order_id;
            self.press(InputKind::PickupDone, order_id);
        }
    }

    /// Kills the navigator, lets the robot go on without it for `outage`, and starts the next one
    /// from the last status.
    pub(crate) fn kill(&mut self, outage: Duration) {
        self.kill_and_introduce_late(outage, Duration::ZERO);
    }

    /// The same, but the next navigator gets frames before map and mode.
    pub(crate) fn kill_and_introduce_late(&mut self, outage: Duration, late: Duration) {
        self.dead = true;
        self.run_for(outage);
        self.dead = false;
        self.navigator = Navigator::resume(self.config, &self.status, &self.blocks, &self.queue);
        self.told = self.navigator.status();
        self.run_for(late);
        self.introduce();
    }

    pub(crate) fn run_for(&mut self, span: Duration) {
        let end = self.body.now + span;
        while self.body.now < end {
            self.step();
        }
    }

    /// Runs until `done` or until `limit` has passed; returns whether it reached `done`.
    pub(crate) fn run_until(&mut self, limit: Duration, done: impl Fn(&Self) -> bool) -> bool {
        let end = self.body.now + limit;
        while self.body.now < end {
            if done(self) {
                return true;
            }
            self.step();
        }
        done(self)
    }

    pub(crate) fn phase(&self) -> Phase {
        self.navigator.status().phase.get().unwrap()
    }

    pub(crate) fn is_home(&self) -> bool {
        self.phase() == Phase::WaitingForOrder && self.navigator.status().waiting == 0
    }

    /// Runs until `count` products are delivered and the robot is back. Panics with its thoughts if
    /// that does not happen, or if the robot is not where it believes to be.
    pub(crate) fn deliver(&mut self, count: u32) {
        let limit = Duration::from_secs(400) * count.max(1);
        let done = self.run_until(limit, |trial| {
            (trial.status.delivered == count && trial.is_home()) || trial.phase() == Phase::Stuck
        });
        assert!(done && self.phase() != Phase::Stuck, "{}", self.story());
        self.run_for(STEP * 100);
        let map = self.map();
        self.assert_at(self.place(map.grid.delivery()));
        self.assert_looks(map.grid.exit(), 180.0);
    }

    /// Runs until `count` products are delivered and the robot is back, while `waiting` orders
    /// still wait for a way.
    pub(crate) fn deliver_but(&mut self, count: u32, waiting: u8) {
        let done = self.run_until(Duration::from_secs(400) * count, |trial| {
            let status = trial.navigator.status();
            (status.delivered, status.waiting) == (count, waiting)
                && trial.phase() == Phase::WaitingForOrder
        });
        assert!(done, "{}", self.story());
    }

    pub(crate) fn map(&self) -> Map {
        Map::new(&self.published).unwrap()
    }

    fn place(&self, node: Node) -> (f64, f64) {
        let side = f64::from(self.published.side_length_cm) * 10.0;
        (f64::from(node.x) * side, f64::from(node.y) * side)
    }

    fn check_event(&self, kind: EventKind) {
        match kind {
            EventKind::InPosition => {
                let map = self.map();
                let product = self.navigator.status().product;
                let station = map.station(product).unwrap();
                let [first, second] = station.edge.ends().map(|end| self.place(end));
                self.assert_at(((first.0 + second.0) / 2.0, (first.1 + second.1) / 2.0));
                self.assert_looks(station.into, 0.0);
            }
            EventKind::ItemDelivered => {
                let distance = self.body.distance_to(self.body.floor.bar);
                assert!(
                    (120.0..180.0).contains(&distance),
                    "{distance} {}",
                    self.story()
                );
            }
            _ => {}
        }
    }

    fn assert_at(&self, place: (f64, f64)) {
        let off = self.body.distance_to(place);
        assert!(
            off < PLACE_MM,
            "{off:.0} mm off {place:?}: {}",
            self.story()
        );
    }

    fn assert_looks(&self, heading: lager_floor::Heading, turned: f64) {
        let off = (self.body.degrees_off(heading) - turned).abs();
        assert!(
            off < LOOK_DEG,
            "{off:.0} degrees off {heading:?}: {}",
            self.story()
        );
    }

    /// The robot's thoughts, for the message of a failed test.
    pub(crate) fn story(&self) -> String {
        format!(
            "at {:?} ({:.0}, {:.0}) looking {:.0}: {:#?}\n{:#?}",
            self.body.now,
            self.body.x,
            self.body.y,
            self.body.angle,
            self.thoughts,
            self.navigator.status(),
        )
    }

    /// The number of events of one kind.
    pub(crate) fn count(&self, wanted: EventKind) -> usize {
        self.events
            .iter()
            .filter(|(kind, ..)| *kind == wanted)
            .count()
    }
}
