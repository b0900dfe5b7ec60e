//! A robot whose bridge and logic are processes of their own. The test drives it frame by frame,
//! and an observer counts its samples on the bus.

use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_ports::{Bus, Subscriber};
use lager_rig::Outset;
use lager_sample::Stamp;
use lager_tests::{Domain, WATCHDOG};
use lager_topics::{
    CommandLatency, LatencyCommand, LatencyPath, LinkHealth, PathLatency, Role, SensorDistance,
    SensorLine, SteeringCommand, SteeringState,
};
use lager_wire::{Centimetres, Command, LineState, Payload, SteerCommand, WheelCommand};

use crate::boards::Boards;
use crate::strace::Part;
use crate::{BRIDGE, LOGIC, PartSetup};

/// The pause from a command to the next frame, in which all threads fall asleep again.
const PAUSE: Duration = Duration::from_millis(3);

/// If no command has come after this time, the frame has changed nothing.
const UNANSWERED: Duration = Duration::from_secs(1);

/// A robot that drives towards its product on the first edge, with its wheels in the air.
pub(crate) struct Robot {
    // The services end before their boards, and the bus is dropped last.
    pub(crate) bridge: Part,
    pub(crate) logic: Part,
    pub(crate) boards: Boards,
    pub(crate) seen: Seen,
    operator: Outset,
    _bus: Bus,
    /// For each answered frame, the times before it was sent and after its command was read, in ns.
    pub(crate) spans: Vec<[u64; 2]>,
}

/// What an observer has seen on the bus.
pub(crate) struct Seen {
    commands: Subscriber<SteeringCommand>,
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    state: Subscriber<SteeringState>,
    path: Subscriber<LatencyPath>,
    command: Subscriber<LatencyCommand>,
    health: Subscriber<LinkHealth>,
    /// The number of orders that ended because the busy machine did not renew them in time.
    lapsed: u32,
    /// The stamp of each order with a new number, in turn.
    pub(crate) orders: Vec<Stamp>,
    last_id: u32,
    /// The number of samples on `steering/command`, with renewals.
    pub(crate) sent: u64,
    /// The last samples of `latency/path` and `latency/command`.
    pub(crate) last_path: PathLatency,
    pub(crate) last_command: CommandLatency,
}

/// The numbers of published samples.
#[derive(Clone, Copy)]
pub(crate) struct Samples {
    /// On `sensor/line` and `sensor/distance`.
    pub(crate) frames: u64,
    /// On `steering/command`, with renewals.
    pub(crate) orders: u64,
    /// On `steering/state`.
    pub(crate) states: u64,
    /// The number of orders that nobody renewed in time; `steering/state` reports the end of each.
    pub(crate) lapsed: u64,
}

impl Seen {
    fn new(bus: &Bus) -> Self {
        Self {
            commands: bus.subscriber().expect("a topic"),
            line: bus.subscriber().expect("a topic"),
            distance: bus.subscriber().expect("a topic"),
            state: bus.subscriber().expect("a topic"),
            path: bus.subscriber().expect("a topic"),
            command: bus.subscriber().expect("a topic"),
            health: bus.subscriber().expect("a topic"),
            lapsed: 0,
            orders: Vec::new(),
            last_id: 0,
            sent: 0,
            last_path: PathLatency::default(),
            last_command: CommandLatency::default(),
        }
    }

    fn look(&mut self) {
        while let Some(order) = self.commands.receive().expect("readable") {
            self.sent += 1;
            if order.id != self.last_id {
                self.last_id = order.id;
                self.orders.push(*order.stamp());
            }
        }
        self.line.latest().expect("readable");
        self.distance.latest().expect("readable");
        self.state.latest().expect("readable");
        if let Some(health) = self.health.latest().expect("readable") {
            self.lapsed = health.leases_expired;
        }
        if let Some(path) = self.path.latest().expect("readable") {
            self.last_path = *path;
        }
        if let Some(command) = self.command.latest().expect("readable") {
            self.last_command = *command;
        }
    }

    /// How many times both latencies were published.
    pub(crate) fn told(&self) -> u64 {
        self.path.received().min(self.command.received())
    }

    /// The number of orders that came and went between two looks.
    pub(crate) fn missed(&self) -> u64 {
        self.commands.lost()
    }

    /// The numbers of samples so far.
    pub(crate) fn samples(&self) -> Samples {
        Samples {
            frames: self.line.received()
                + self.line.lost()
                + self.distance.received()
                + self.distance.lost(),
            orders: self.sent + self.commands.lost(),
            states: self.state.received() + self.state.lost(),
            lapsed: self.lapsed.into(),
        }
    }
}

impl Robot {
    pub(crate) fn start(domain: &Domain, traced: bool) -> Self {
        let boards = Boards::new();
        let bus = domain.bus("r1", 1.0);
        let told: PartSetup = (domain.bus_folder().to_owned(), boards.ports.clone());
        let part = |name: &str| {
            let log = traced.then(|| domain.folder().join(format!("{name}.strace")));
            Part::start(log, name, &told)
        };
        let bus = Bus::open(&bus, Role::Operator).expect("the bus opens");
        let mut robot = Self {
            bridge: part(BRIDGE),
            logic: part(LOGIC),
            boards,
            seen: Seen::new(&domain.observe("r1", 1.0)),
            operator: Outset::new(&bus).expect("topics"),
            _bus: bus,
            spans: Vec::new(),
        };
        robot.set_out();
        robot
    }

    /// Brings both boards up, and waits until logic drives towards the product.
    fn set_out(&mut self) {
        self.step_until("the robot is on its way", |robot| {
            robot.operator.goes_on().expect("an operator")
        });
        // Until the board has reported, the bridge publishes its own last command instead.
        self.step_until("the board has reported", |robot| {
            robot.seen.state.received() > 1
        });
        // By its first sample a publisher and the observer find each other.
        self.settle();
    }

    /// Waits until everything counted so far was published.
    pub(crate) fn settle(&mut self) {
        let told = self.seen.told();
        self.step_until("both latencies are told twice", |robot| {
            robot.seen.told() >= told + 2
        });
    }

    pub(crate) fn step_until(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) {
        let give_up = Instant::now() + WATCHDOG;
        while !done(self) {
            assert!(Instant::now() < give_up, "waited in vain until {what}");
            self.boards.step(Duration::from_millis(5));
            self.seen.look();
        }
    }

    /// Sends a frame that changes logic's decision; returns whether the command came.
    fn frame(&mut self) -> bool {
        let follows = |command: &SteerCommand| {
            command.code == Command::Wheel(WheelCommand::ActiveForward).code()
        };
        // A moment without frames, or a report, halts the robot as well.
        let given = self.boards.commands.len();
        let is_following = self.boards.commands.last().is_some_and(follows);
        let sent_ns = Clock::monotonic_ns();
        self.boards.send(if is_following {
            Payload::Distance(Centimetres(200))
        } else {
            Payload::Line(LineState::OnLine)
        });
        let sent = Instant::now();
        let mut answered = false;
        while !answered && sent.elapsed() < UNANSWERED {
            self.boards.step(Duration::from_millis(1));
            self.seen.look();
            let mut new = self.boards.commands[given..].iter();
            answered = new.any(|command| follows(command) != is_following);
        }
        self.spans.push([sent_ns, Clock::monotonic_ns()]);
        self.seen.look();
        std::thread::sleep(PAUSE);
        answered
    }

    /// Sends frames until `commands` commands have come.
    pub(crate) fn frames(&mut self, commands: u64) {
        let give_up = Instant::now() + WATCHDOG;
        let mut seen = 0;
        while seen < commands {
            assert!(Instant::now() < give_up, "only {seen} commands came");
            seen += u64::from(self.frame());
        }
    }

    pub(crate) fn end(self) {
        let Self { bridge, logic, .. } = self;
        bridge.end();
        logic.end();
    }
}
