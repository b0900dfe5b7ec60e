//! Tests of the shell on a real bus: what it publishes and in which order, and its successor.

use std::time::{Duration, Instant};

use lager_logic::{LogicConfig, run};
use lager_orders::Mode;
use lager_ports::{Bus, Cause, Publisher, Subscriber};
use lager_rig::{Domain, one_square};
use lager_sample::{Stamp, Topic};
use lager_topics::{
    DistanceFrame, EventKind, Health, Input, InputKind, LineFrame, LinkHealth, LogThought,
    MissionEvent, MissionOrder, NavMap, NavRoute, NavStatus, NavigatorStatus, OperatorInput, Order,
    Phase, Role, SensorDistance, SensorLine, SteeringCommand, SteeringOrder, SteeringReport,
    SteeringState, ThoughtKind,
};
use lager_wake::Shutdown;
use lager_wire::LineState;

/// A bus that only one test uses.
fn domain() -> Domain {
    Domain::new("lager-logic").unwrap()
}

/// The report of a steering board that stands.
fn report() -> SteeringReport {
    SteeringReport {
        age_ms: 0,
        ..SteeringReport::default()
    }
}

/// Everything around logic.
struct World {
    map: Publisher<NavMap>,
    health: Publisher<LinkHealth>,
    orders: Publisher<MissionOrder>,
    line: Publisher<SensorLine>,
    state: Publisher<SteeringState>,
    commands: Subscriber<SteeringCommand>,
    status: Subscriber<NavStatus>,
    events: Subscriber<MissionEvent>,
    thoughts: Subscriber<LogThought>,
    route: Subscriber<NavRoute>,
    seen: Option<NavigatorStatus>,
    given: Vec<SteeringOrder>,
    /// The stamps of the given orders.
    stamps: Vec<Stamp>,
}

impl World {
    fn new(bus: &Bus) -> Self {
        Self {
            map: bus.publisher().unwrap(),
            health: bus.publisher().unwrap(),
            orders: bus.publisher().unwrap(),
            line: bus.publisher().unwrap(),
            state: bus.publisher().unwrap(),
            commands: bus.subscriber().unwrap(),
            status: bus.subscriber().unwrap(),
            events: bus.subscriber().unwrap(),
            thoughts: bus.subscriber().unwrap(),
            route: bus.subscriber().unwrap(),
            seen: None,
            given: Vec::new(),
            stamps: Vec::new(),
        }
    }

    /// Publishes the retained topics, and lets the boards report a robot that stands on the line.
    fn tell(&self, mode: Mode, stopped: bool) {
        self.map.send(Cause::OWN, one_square()).unwrap();
        let health = Health {
            mode: mode.into(),
            stopped: stopped.into(),
            ..Health::default()
        };
        self.health.send(Cause::OWN, health).unwrap();
        self.state.send(Cause::OWN, report()).unwrap();
        let frame = LineFrame {
            state: LineState::OnLine.into(),
            ..LineFrame::default()
        };
        self.line.send(Cause::OWN, frame).unwrap();
    }

    /// Reads what logic has sent. It reads orders before the status, so a status that logic sent
    /// before its order is always there.
    fn look(&mut self) {
        while let Some(order) = self.commands.receive().unwrap() {
            self.given.push(*order);
            self.stamps.push(*order.stamp());
        }
        if let Some(status) = self.status.latest().unwrap() {
            self.seen = Some(*status);
        }
        if let (Some(order), Some(status)) = (self.given.last(), &self.seen) {
            assert!(status.command_id >= order.id, "{order:?} before its status");
        }
    }

    /// Publishes and reads until `done`; the watchdog ends a test that hangs.
    #[track_caller]
    fn until(&mut self, what: &str, stopped: bool, mut done: impl FnMut(&Self) -> bool) {
        let start = Instant::now();
        while !done(self) {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "gave up waiting until {what}"
            );
            self.tell(Mode::Autonomous, stopped);
            std::thread::sleep(Duration::from_millis(5));
            self.look();
        }
    }

    /// Sends samples faster than logic reads them, until the status counts some as missed.
    #[track_caller]
    fn miss(&mut self, topic: &str, send: impl Fn(&Self)) {
        let frames_lost = |world: &Self| world.seen.map_or(0, |status| status.frames_lost);
        let start = Instant::now();
        // By then the status has counted the samples missed before this.
        let settled = Instant::now() + Duration::from_millis(150);
        while Instant::now() < settled {
            std::thread::sleep(Duration::from_millis(5));
            self.look();
        }
        let before = frames_lost(self);
        while frames_lost(self) == before {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "gave up waiting until {topic} is missed"
            );
            for _ in 0..2_000 {
                send(self);
            }
            std::thread::sleep(Duration::from_millis(5));
            self.look();
        }
    }

    fn phase(&self) -> Option<Phase> {
        self.seen.and_then(|status| status.phase.get())
    }
}

/// Runs logic on `domain` while `work` is done.
fn with_logic(domain: &Domain, resume: bool, work: impl FnOnce()) {
    let shutdown = Shutdown::new();
    let bus = domain.open(Role::Logic);
    let config = LogicConfig {
        resume,
        ..LogicConfig::default()
    };
    std::thread::scope(|scope| {
        let logic = scope.spawn(|| run(&bus, &config, &shutdown));
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
        shutdown.request();
        logic.join().unwrap().unwrap();
        if let Err(panic) = result {
            std::panic::resume_unwind(panic);
        }
    });
}

#[test]
fn an_order_leads_to_a_renewed_steering_order_and_is_announced() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    with_logic(&domain, false, || {
        world.until("logic has its map", false, |world| {
            world.phase() == Some(Phase::WaitingForOrder)
        });
        world
            .orders
            .send(Cause::OWN, Order { id: 5, product: 1 })
            .unwrap();
        world.until("the line is followed", false, |world| {
            let follow = |order: &&SteeringOrder| order.code == 3;
            world.given.iter().filter(follow).count() >= 4
        });
        let last = *world.given.last().unwrap();
        let same = world
            .given
            .iter()
            .filter(|order| order.id == last.id)
            .count();
        assert!(same >= 4, "renewed under the same id: {:?}", world.given);
        assert_eq!(world.phase(), Some(Phase::Approaching));

        let event = world.events.receive().unwrap().expect("an event");
        assert_eq!(
            (event.kind.get(), event.order_id),
            (Some(EventKind::GettingItem), 5)
        );
        let thought = world.thoughts.receive().unwrap().expect("a thought");
        assert_eq!(thought.from.get(), Some(Role::Logic));
        // The robot stands at the near end of the edge, so no node is left to pass.
        let route = world.route.latest().unwrap();
        assert!(route.is_none_or(|route| route.length == 0));
    });
}

#[test]
fn a_renewal_carries_the_newest_frame() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    with_logic(&domain, false, || {
        world.until("logic stands ready", false, |world| {
            world.phase() == Some(Phase::WaitingForOrder)
        });
        let of_a_frame = |stamp: &&Stamp| stamp.cause_topic == SensorLine::ID;
        world.until("the order is renewed for frames", false, |world| {
            world.stamps.iter().filter(of_a_frame).count() >= 4
        });
        let renewals: Vec<_> = world.stamps.iter().filter(of_a_frame).collect();
        // A frame comes every 5 ms, a renewal every 40 ms.
        let read = renewals.iter().map(|stamp| stamp.source_time_ns);
        assert!(read.is_sorted(), "{renewals:?}");
        let [first, .., last] = renewals[..] else {
            panic!("at least four renewals");
        };
        assert!(first.source_time_ns < last.source_time_ns, "{renewals:?}");
        for stamp in renewals {
            let way = [
                stamp.source_time_ns,
                stamp.cause_publish_time_ns,
                stamp.cause_receive_time_ns,
                stamp.publish_time_ns,
            ];
            assert!(way.is_sorted(), "{stamp:?}");
        }
    });
}

#[test]
fn a_renewal_does_not_wait_for_its_own_time_when_a_frame_comes_shortly_before() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    with_logic(&domain, false, || {
        // Without a frame the renewal comes after 40 ms, and not a moment sooner.
        let is_early = |pair: &[(SteeringOrder, Stamp)]| {
            let [(before, first), (order, second)] = pair else {
                return false;
            };
            let apart = second.publish_time_ns - first.publish_time_ns;
            order.id == before.id && (30_000_000..39_000_000).contains(&apart)
        };
        world.until("a frame takes a renewal along", false, |world| {
            let given = world.given.iter().copied().zip(world.stamps.clone());
            given.collect::<Vec<_>>().windows(2).any(is_early)
        });
    });
}

#[test]
fn a_latched_stop_silences_logic_until_the_resume() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    with_logic(&domain, false, || {
        world.until("logic stands ready", false, |world| !world.given.is_empty());
        world.until("logic knows of the stop", true, |world| {
            world.seen.is_some_and(|status| status.stopped == 1)
        });
        world.look();
        world.given.clear();
        for _ in 0..40 {
            world.tell(Mode::Autonomous, true);
            std::thread::sleep(Duration::from_millis(5));
            world.look();
        }
        assert_eq!(world.given, []);
        world.until("logic speaks again", false, |world| !world.given.is_empty());
    });
}

#[test]
fn a_successor_takes_up_the_kept_state() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    let mut keeper = bus.keeper::<NavStatus>().unwrap();
    with_logic(&domain, false, || {
        world.until("logic has its map", false, |world| {
            world.phase() == Some(Phase::WaitingForOrder)
        });
        world
            .orders
            .send(Cause::OWN, Order { id: 5, product: 1 })
            .unwrap();
        world.until("it is on its way", false, |world| {
            world.phase() == Some(Phase::Approaching)
        });
        keeper.remember().unwrap();
    });
    let before = world.seen.expect("a status");
    world.seen = None;
    world.given.clear();
    keeper.remember().unwrap();
    keeper.hand_over().unwrap();
    with_logic(&domain, true, || {
        world.until("the successor drives", false, |world| {
            // The supervisor does this until another process publishes the topic.
            keeper.remember().unwrap();
            world.given.iter().any(|order| order.code == 3)
        });
        let status = world.seen.expect("a status");
        assert_eq!(status.order_id, 5);
        assert_eq!(status.phase.get(), Some(Phase::Approaching));
        assert!(status.frames > before.frames);
        assert!(world.given.iter().all(|order| order.id > before.command_id));
    });
}

#[test]
fn what_is_missed_is_counted_on_every_topic_where_each_sample_counts() {
    let domain = domain();
    let bus = domain.open(Role::Supervisor);
    let mut world = World::new(&bus);
    let distance = bus.publisher::<SensorDistance>().unwrap();
    let inputs = bus.publisher::<OperatorInput>().unwrap();
    with_logic(&domain, false, || {
        world.until("logic has its map", false, |world| {
            world.phase() == Some(Phase::WaitingForOrder)
        });
        // Bursts on one topic at a time, with many more samples than a subscriber's queue holds.
        world.miss("sensor/line", |world| {
            world.line.send(Cause::OWN, LineFrame::default()).unwrap();
        });
        world.miss("sensor/distance", |_| {
            distance.send(Cause::OWN, DistanceFrame::default()).unwrap();
        });
        world.miss("steering/state", |world| {
            world.state.send(Cause::OWN, report()).unwrap();
        });
        world.miss("mission/order", |world| {
            world
                .orders
                .send(Cause::OWN, Order { id: 7, product: 9 })
                .unwrap();
        });
        world.miss("operator/input", |_| {
            inputs.send(Cause::OWN, Input::default()).unwrap();
        });
    });
}

#[test]
fn a_successor_that_finds_nothing_kept_knows_no_place_until_a_reset() {
    let domain = domain();
    let shutdown = Shutdown::new();
    let bus = domain.open(Role::Logic);
    let logic = {
        let shutdown = shutdown.clone();
        let config = LogicConfig {
            resume: true,
            ..LogicConfig::default()
        };
        std::thread::spawn(move || run(&bus, &config, &shutdown).unwrap())
    };
    let others = domain.open(Role::Supervisor);
    let inputs = others.publisher::<OperatorInput>().unwrap();
    let mut world = World::new(&others);
    let phase = |world: &World| world.seen.and_then(|status| status.phase.get());
    world.until("it says that it is lost", false, |world| {
        phase(world) == Some(Phase::Lost)
    });
    world.until("it refuses an order", false, |world| {
        let order = Order { id: 7, product: 1 };
        world.orders.send(Cause::OWN, order).unwrap();
        // It orders nothing but to stand.
        assert!(world.given.iter().all(|order| order.code == 1));
        world.given.len() > 20
    });
    let mut refused = false;
    while let Some(event) = world.events.receive().unwrap() {
        refused |= event.kind.get() == Some(EventKind::Refused);
    }
    assert!(refused);
    world.until("a reset tells it where it is", false, |world| {
        let input = Input {
            kind: InputKind::ResetPressed.into(),
            ..Input::default()
        };
        inputs.send(Cause::OWN, input).unwrap();
        phase(world) == Some(Phase::WaitingForOrder)
    });
    shutdown.request();
    logic.join().unwrap();
}

#[test]
fn the_horn_is_heard_as_a_thought() {
    let domain = domain();
    with_logic(&domain, false, || {
        let bus = domain.open(Role::Supervisor);
        let mut world = World::new(&bus);
        let presses = bus.publisher::<OperatorInput>().unwrap();
        world.until("logic is up", false, |world| world.seen.is_some());
        let horn = Input {
            kind: InputKind::Horn.into(),
            ..Input::default()
        };
        presses.send(Cause::OWN, horn).unwrap();
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < Duration::from_secs(60), "nobody honks");
            match world.thoughts.receive().unwrap() {
                Some(thought) if thought.kind == ThoughtKind::Honks => return,
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    });
}
