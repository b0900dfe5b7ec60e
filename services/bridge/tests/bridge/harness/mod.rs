//! A robot for tests: an isolated bus, two pseudo terminals with scripted boards behind them, and
//! the bridge in a thread of this process.
//!
//! Every robot has its own bus and folder, and removes both when it is dropped. Nothing
//! here waits without an end: [`wait_until`] panics after [`PATIENCE`].
#![allow(
    dead_code,
    unused_imports,
    reason = "each test program uses a part of it"
)]

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_bridge::BridgeError;
use lager_bridge::{BridgeConfig, Ports, buttons};
use lager_home::Clock;
use lager_orders::Mode;
use lager_ports::{Bus, BusConfig, Cause, Client, Publisher, Subscriber};
use lager_rig::Domain;
use lager_sample::Topic;
use lager_stop::{Stop, StopPage, StopTold, StopWord};
use lager_topics::{
    Ask, AskKind, BridgeAnswer, BridgeRequest, DistanceFrame, Finish, Health, LineFrame,
    LinkHealth, Origin, Role, SensorDistance, SensorLine, SteeringCommand, SteeringOrder,
    SteeringReport, SteeringState, StopCause,
};
use lager_wake::Shutdown;
use lager_wire::{ArmCommand, Command, WheelCommand};

pub(crate) use lager_rig::boards::{
    OriginalSensor, OriginalSteering, Peer, Plugged, Pty, SensorBoard, SteeringBoard,
};

/// How fast the robot's clock runs: slower than real, so that a busy machine does not keep a
/// lease of 120 ms from being renewed.
pub(crate) const SPEED: f64 = 0.3;

/// How long anything may take before a test fails.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until `condition` holds.
pub(crate) fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The bus in `folder`, at the speed of these tests.
pub(crate) fn bus_config(folder: &Path) -> BusConfig {
    BusConfig {
        speed: SPEED,
        ..lager_rig::bus_at(folder)
    }
}

/// An isolated bus.
pub(crate) struct Isolation {
    pub(crate) config: BusConfig,
    domain: Domain,
}

impl Isolation {
    pub(crate) fn new() -> Self {
        let domain = Domain::new("lager-bridge").unwrap();
        Self {
            config: bus_config(domain.folder()),
            domain,
        }
    }

    /// The bus's folder, by which another process joins with [`bus_config`].
    pub(crate) fn bus_folder(&self) -> &Path {
        self.domain.folder()
    }

    /// Where the ports are.
    pub(crate) fn folder(&self) -> &Path {
        self.domain.files()
    }

    pub(crate) fn open(&self, role: Role) -> Bus {
        Bus::open(&self.config, role).unwrap()
    }
}

/// The bridge in a thread.
pub(crate) struct Bridge {
    shutdown: Shutdown,
    thread: Option<JoinHandle<Result<(), BridgeError>>>,
}

impl Bridge {
    pub(crate) fn start(isolation: &Isolation, config: BridgeConfig) -> Self {
        Self::start_with(isolation, config, Box::new(buttons::Chips))
    }

    /// Where `gpio` has the lines of its buttons.
    pub(crate) fn start_with(
        isolation: &Isolation,
        config: BridgeConfig,
        gpio: Box<dyn buttons::Gpio + Send>,
    ) -> Self {
        let bus = isolation.open(Role::Bridge);
        let shutdown = Shutdown::new();
        let wish = shutdown.clone();
        let thread = std::thread::Builder::new()
            .name("bridge".to_owned())
            .spawn(move || lager_bridge::run_with(&bus, &config, &*gpio, &wish))
            .unwrap();
        Self {
            shutdown,
            thread: Some(thread),
        }
    }

    /// A clean stop.
    pub(crate) fn stop(mut self) {
        self.end();
    }

    fn end(&mut self) {
        let Some(thread) = self.thread.take() else {
            return;
        };
        self.shutdown.request();
        let start = Instant::now();
        while !thread.is_finished() && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(1));
        }
        if std::thread::panicking() {
            return;
        }
        assert!(thread.is_finished(), "the bridge does not end");
        thread.join().unwrap().unwrap();
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.end();
    }
}

/// What a person and the navigator have on the bus.
pub(crate) struct Hands {
    orders: Publisher<SteeringCommand>,
    requests: Client<BridgeRequest>,
    pub(crate) stop_word: PathBuf,
    pub(crate) line: Seen<SensorLine>,
    pub(crate) distance: Seen<SensorDistance>,
    pub(crate) state: Seen<SteeringState>,
    pub(crate) health: Seen<LinkHealth>,
}

/// A subscriber with the last value.
pub(crate) struct Seen<T: Topic> {
    subscriber: Subscriber<T>,
    pub(crate) last: Option<T::Payload>,
    pub(crate) count: usize,
    /// How many samples the writer had sent with the last one seen.
    pub(crate) sent: u64,
}

impl<T: Topic> Seen<T> {
    pub(crate) fn new(bus: &Bus) -> Self {
        Self {
            subscriber: bus.subscriber().unwrap(),
            last: None,
            count: 0,
            sent: 0,
        }
    }

    /// Takes what has come; the last value so far.
    pub(crate) fn look(&mut self) -> Option<T::Payload> {
        for payload in self.drain() {
            self.last = Some(payload);
        }
        self.last
    }

    /// Everything that has come since the last look.
    pub(crate) fn drain(&mut self) -> Vec<T::Payload> {
        let mut all = Vec::new();
        while let Some(sample) = self.subscriber.receive().unwrap() {
            self.count += 1;
            self.sent = sample.stamp().sequence + 1;
            all.push(*sample);
        }
        all
    }

    pub(crate) fn lost(&self) -> u64 {
        self.subscriber.lost()
    }
}

impl Hands {
    pub(crate) fn new(bus: &Bus) -> Self {
        Self {
            orders: bus.publisher().unwrap(),
            requests: bus.client().unwrap(),
            stop_word: bus.home().unit(bus.unit()).join(StopPage::FILE),
            line: Seen::new(bus),
            distance: Seen::new(bus),
            state: Seen::new(bus),
            health: Seen::new(bus),
        }
    }

    pub(crate) fn give(&self, order: SteeringOrder) {
        self.orders.send(Cause::OWN, order).unwrap();
    }

    /// Renews `order` every 40 ms until `condition` holds.
    pub(crate) fn give_until(
        &mut self,
        order: SteeringOrder,
        what: &str,
        mut condition: impl FnMut(&mut Self) -> bool,
    ) {
        let start = Instant::now();
        let mut renewed = None::<Instant>;
        while !condition(self) {
            assert!(start.elapsed() < PATIENCE, "waited in vain until {what}");
            if renewed.is_none_or(|at| at.elapsed() >= Duration::from_millis(40)) {
                renewed = Some(Instant::now());
                self.give(order);
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Renews `order` until its one-shot command is carried out, and returns the report that says
    /// so, which has its number. Where this machine was held up for longer than an order lasts, the
    /// command was cut short or came too late; it is ordered anew under the next number.
    pub(crate) fn carry_out(&mut self, mut order: SteeringOrder) -> SteeringReport {
        loop {
            let mut ended = None;
            self.give_until(order, "the command has ended", |hands| {
                let mut reports = hands.state.drain().into_iter();
                ended = reports.find(|state| {
                    (state.finished_id, state.finished_origin) == (order.id, order.origin)
                });
                let health = hands.health.look().unwrap_or_default();
                ended.is_some() || health.refused_id == order.id
            });
            if let Some(done) = ended.filter(|state| state.finish == Finish::Done) {
                return done;
            }
            order.id += 1;
            if order.given_ns != 0 {
                order.given_ns = Clock::monotonic_ns();
            }
        }
    }

    pub(crate) fn ask(&self, ask: Ask) -> BridgeAnswer {
        self.requests.call(ask, PATIENCE).unwrap()
    }

    pub(crate) fn set_mode(&self, mode: Mode) -> BridgeAnswer {
        self.ask(Ask {
            kind: AskKind::SetMode.into(),
            mode: mode.into(),
            ..Ask::default()
        })
    }

    pub(crate) fn resume(&self) -> BridgeAnswer {
        self.ask(Ask {
            kind: AskKind::Resume.into(),
            stop_word: self.stop_told().stop().map_or(0, Stop::word),
            ..Ask::default()
        })
    }

    pub(crate) fn stop(&self) -> Stop {
        StopWord::set(&self.stop_word, Role::Operator, StopCause::Ordered).unwrap()
    }

    /// What the file of the stop word tells.
    pub(crate) fn stop_told(&self) -> StopTold {
        StopWord::read(&self.stop_word).unwrap().expect("a file")
    }

    pub(crate) fn wait_for_health(
        &mut self,
        what: &str,
        condition: impl Fn(&Health) -> bool,
    ) -> Health {
        let start = Instant::now();
        loop {
            match self.health.look() {
                Some(health) if condition(&health) => return health,
                last => assert!(
                    start.elapsed() < PATIENCE,
                    "waited in vain until {what}: {last:?}"
                ),
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub(crate) fn wait_for_state(
        &mut self,
        what: &str,
        condition: impl Fn(&SteeringReport) -> bool,
    ) {
        wait_until(what, || {
            self.state.look().is_some_and(|state| condition(&state))
        });
    }

    pub(crate) fn wait_for_line(&mut self, what: &str, condition: impl Fn(&LineFrame) -> bool) {
        wait_until(what, || {
            self.line.look().is_some_and(|line| condition(&line))
        });
    }

    pub(crate) fn wait_for_distance(
        &mut self,
        what: &str,
        condition: impl Fn(&DistanceFrame) -> bool,
    ) {
        wait_until(what, || {
            self.distance
                .look()
                .is_some_and(|distance| condition(&distance))
        });
    }
}

/// Isolation, boards, bridge and hands. Fields drop from top to bottom: the bridge ends first.
pub(crate) struct Robot<A: Peer = SensorBoard, B: Peer = SteeringBoard> {
    pub(crate) bridge: Option<Bridge>,
    pub(crate) hands: Hands,
    pub(crate) sensor: Plugged<A>,
    pub(crate) steering: Plugged<B>,
    pub(crate) bridge_config: BridgeConfig,
    pub(crate) isolation: Isolation,
}

impl Robot {
    /// Two version-1 boards and a bridge, all up: the bridge says so, and the boards have read it.
    pub(crate) fn up() -> Self {
        let mut robot = Self::with(SensorBoard::new(), SteeringBoard::new());
        robot.start();
        robot.wait_until_up();
        wait_until("the boards have read so", || {
            robot.sensor.with(|board| board.link.is_up())
                && robot.steering.with(|board| board.link.is_up())
        });
        robot
    }

    /// As [`Robot::up`], in autonomous mode.
    pub(crate) fn autonomous() -> Self {
        let robot = Self::up();
        robot.hands.set_mode(Mode::Autonomous);
        robot
    }
}

impl<A: Peer, B: Peer> Robot<A, B> {
    /// Boards that run, and no bridge yet.
    pub(crate) fn with(sensor: A, steering: B) -> Self {
        let isolation = Isolation::new();
        let sensor = Plugged::new(sensor, isolation.folder().join("sensor"), SPEED);
        let steering = Plugged::new(steering, isolation.folder().join("steering"), SPEED);
        let bridge_config = BridgeConfig {
            ports: Ports::Named([sensor.path().to_owned(), steering.path().to_owned()]),
            ..BridgeConfig::default()
        };
        let hands = Hands::new(&isolation.open(Role::Operator));
        Self {
            bridge: None,
            hands,
            sensor,
            steering,
            bridge_config,
            isolation,
        }
    }

    pub(crate) fn start(&mut self) {
        self.bridge = Some(Bridge::start(&self.isolation, self.bridge_config.clone()));
    }

    pub(crate) fn wait_until_up(&mut self) -> Health {
        self.hands
            .wait_for_health("both boards are ready", Health::boards_are_ready)
    }
}

/// An order of the operator.
pub(crate) fn operator(id: u32, command: Command) -> SteeringOrder {
    SteeringOrder {
        given_ns: Clock::monotonic_ns(),
        id,
        origin: Origin::Operator.into(),
        code: command.code(),
        ..SteeringOrder::default()
    }
}

/// An order of the navigator.
pub(crate) fn logic(id: u32, command: Command) -> SteeringOrder {
    SteeringOrder {
        origin: Origin::Logic.into(),
        ..operator(id, command)
    }
}

pub(crate) const STANDBY: Command = Command::Wheel(WheelCommand::Standby);
pub(crate) const FORWARD: Command = Command::Wheel(WheelCommand::ManualForward);
pub(crate) const FOLLOW: Command = Command::Wheel(WheelCommand::ActiveForward);
pub(crate) const ARM_UP: Command = Command::Arm(ArmCommand::Up);
pub(crate) const LEFT_PERP: Command = Command::Wheel(WheelCommand::LeftPerp);
