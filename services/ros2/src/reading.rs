//! The loop that reads the bus, sends what came of it into ROS, and serves requests.
//!
//! It is an observer: nobody wakes it, it costs each writer one place of a queue, and it opens no
//! publisher. What it is too late for is lost to it alone, and counted.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_battery::Battery;
use lager_home::{Clock, LockError};
use lager_journal::drawn;
use lager_journal::shapes::{SceneUpdate, Time};
use lager_ports::{Bus, OpenError, PortError, ReceiveError, Source as _, Subscriber, Watcher};
use lager_sample::{Part, Topic};
use lager_stop::StopPage;
use lager_topics::{
    BlockedWay, BlockedWays, Health, LinkHealth, LogThought, NavBlocks, NavMap, NavRoute,
    NavStatus, NavigatorStatus, Role, Route, SensorDistance, SensorLine, SteeringState, Truth,
    TruthPose, WarehouseMap,
};
use lager_wake::{Pace, Shutdown, Watchdog};

use crate::health::{Gateway, Last, Passed, diagnostics};
use crate::messages::{
    BatteryState, DiagnosticArray, JointState, Log, MarkerArray, OccupancyGrid, Odometry, Path,
    PoseStamped, Range, TFMessage, UInt8, UInt16,
};
use crate::motion::{self, Motion};
use crate::node::{Node, NodeError, Quality, Writer};
use crate::place::Place;
use crate::services::{Services, ServicesError};
use crate::told::{Calendar, Frames, Measures};
use crate::{floor, parts};

/// How often the gateway looks at the calendar and tells how the robot is.
const SECOND: Duration = Duration::from_secs(1);
/// At most so often the joints are told, ...
const JOINTS: Duration = Duration::from_millis(50);
/// ... and a world in which goods move is drawn.
const WORLD: Duration = Duration::from_millis(500);
/// Samples of one topic that are read before the next topic has its turn.
const TURN: usize = 1_024;
/// It looks as often as if no queue had more places. A listener with ROS's quality for sensor data
/// keeps five messages, so at 1000 samples a second no more than three may come at once.
const PLACES: usize = 12;

/// The lock by which one robot has one node: no other part of a robot has this number.
const PART: Part = Part::new(15, "ros2").observing();

/// How to be a node.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The node's name.
    pub name: String,
    /// Where it is found.
    pub place: Place,
    /// What the configuration says of the robot.
    pub measures: Measures,
    /// For an operator: the command that is `lager` for this robot, with its flags.
    pub lager: Option<Vec<std::ffi::OsString>>,
}

/// Why there is no node, or none any more.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The bus cannot be joined.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Another process is this robot's node.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// A topic cannot be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A topic cannot be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// DDS refuses.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// A service cannot be offered.
    #[error(transparent)]
    Services(#[from] ServicesError),
    /// The bus is another one now, so no sample will come any more.
    #[error("the bus was damaged and replaced since the gateway joined it; start it again")]
    Cleared,
}

/// A topic of the bus, with what was sent of its samples.
struct Feed<T: Topic> {
    subscriber: Subscriber<T>,
}

impl<T: Topic> Feed<T> {
    fn open(bus: &Bus, watcher: &mut Watcher) -> Result<Self, PortError> {
        let subscriber = bus.subscriber()?;
        subscriber.wakes(watcher);
        Ok(Self { subscriber })
    }

    /// Gives each new sample, with when it happened, to `take`.
    fn drain(
        &mut self,
        pace: &mut Pace,
        mut take: impl FnMut(&T::Payload, u64),
    ) -> Result<(), ReceiveError> {
        let mut found = 0;
        while found < TURN
            && let Some(sample) = self.subscriber.receive()?
        {
            found += 1;
            let stamp = sample.stamp();
            let happened = match stamp.source_time_ns {
                0 => stamp.publish_time_ns,
                source => source,
            };
            take(&sample, happened);
        }
        pace.found(found as u64, self.subscriber.queue().min(PLACES));
        Ok(())
    }

    /// What came of it, in messages of these counts.
    fn passed(&self, counts: &[(u64, u64)]) -> Passed {
        Passed {
            topic: T::NAME,
            read: self.subscriber.received(),
            lost: self.subscriber.lost(),
            sent: counts.iter().map(|(sent, _)| sent).sum(),
            refused: counts.iter().map(|(_, refused)| refused).sum(),
        }
    }
}

/// All topics of the bus that become messages.
struct Feeds {
    distance: Feed<SensorDistance>,
    line: Feed<SensorLine>,
    steering: Feed<SteeringState>,
    health: Feed<LinkHealth>,
    status: Feed<NavStatus>,
    map: Feed<NavMap>,
    route: Feed<NavRoute>,
    blocks: Feed<NavBlocks>,
    thoughts: Feed<LogThought>,
    truth: Feed<TruthPose>,
}

/// All publishers. `README.md` has them as a table.
struct Writers {
    range: Writer<Range>,
    line: Writer<UInt16>,
    line_state: Writer<UInt8>,
    battery: Writer<BatteryState>,
    joints: Writer<JointState>,
    pose: Writer<PoseStamped>,
    odom: Writer<Odometry>,
    truth: Writer<Odometry>,
    path: Writer<Path>,
    grid: Writer<OccupancyGrid>,
    floor: Writer<MarkerArray>,
    blocked: Writer<MarkerArray>,
    world: Writer<MarkerArray>,
    bodies: Writer<MarkerArray>,
    tf: Writer<TFMessage>,
    tf_static: Writer<TFMessage>,
    diagnostics: Writer<DiagnosticArray>,
    rosout: Writer<Log>,
}

impl Writers {
    fn open(node: &mut Node) -> Result<Self, NodeError> {
        let state = Quality::Reliable(10);
        let lasting = Quality::Lasting(1);
        Ok(Self {
            range: node.writer("range", Quality::SensorData)?,
            line: node.writer("line", Quality::SensorData)?,
            line_state: node.writer("line_state", Quality::SensorData)?,
            battery: node.writer("battery_state", state)?,
            joints: node.writer("joint_states", state)?,
            pose: node.writer("pose", state)?,
            odom: node.writer("odom", state)?,
            truth: node.writer("ground_truth", state)?,
            path: node.writer("path", lasting)?,
            grid: node.writer("map", lasting)?,
            floor: node.writer("markers/floor", lasting)?,
            blocked: node.writer("markers/blocked", lasting)?,
            world: node.writer("markers/world", lasting)?,
            bodies: node.writer("markers/robot", lasting)?,
            tf: node.writer("/tf", Quality::Reliable(100))?,
            tf_static: node.writer("/tf_static", lasting)?,
            diagnostics: node.writer("/diagnostics", state)?,
            rosout: node.writer("/rosout", Quality::Lasting(1_000))?,
        })
    }
}

/// What is known of the robot.
#[derive(Default)]
struct Known {
    map: Option<Box<WarehouseMap>>,
    blocks: Option<Box<BlockedWays>>,
    route: Option<Box<Route>>,
    health: Last<Health>,
    status: Last<NavigatorStatus>,
    battery: Battery,
    motion: Motion,
    joints_at: u64,
    battery_at: u64,
    /// The world as it was drawn last, and one that waits to be drawn.
    drawn: Option<Box<Truth>>,
    changed: Option<(Box<Truth>, u64)>,
    drawn_at: u64,
}

/// Is the node `settings` of the robot of `bus` until `shutdown`. Calls `ready` with a sentence once
/// others can find it.
///
/// # Errors
/// The bus or DDS refuses.
pub fn run(
    bus: &Bus,
    settings: Settings,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
    ready: impl FnOnce(&str),
) -> Result<(), RunError> {
    let _one = bus.home().lock(bus.unit(), PART)?;
    let mut watcher = watchdog.over("asking to be woken", || bus.watcher())?;
    let mut feeds = watchdog.over("opening the topics", || Feeds::open(bus, &mut watcher))?;
    let mut node = Node::open(&settings.name, &settings.place)?;
    let mut writers = Writers::open(&mut node)?;
    let stop_word: PathBuf = bus.home().folder_of(bus.unit()).join(StopPage::FILE);
    let is_operator = settings.lager.is_some();
    let mut services = Services::open(&mut node, stop_word, settings.lager)?;
    node.announce();
    let mut calendar = Calendar::new(Clock::unix_offset_ns());
    let frames = Frames::of(&settings.name);
    let mut gateway = Gateway {
        place: settings.place.to_string(),
        is_operator,
        passed: Vec::new(),
    };
    let started = Clock::monotonic_ns();
    let fixed = motion::fixed(&settings.measures, (calendar, started), &frames);
    writers.tf_static.send(fixed);
    let bodies = drawn::bodies(Time::of_ns(calendar.unix_ns(started)));
    writers
        .bodies
        .send(floor::markers(&bodies, (calendar, started), &frames));
    ready(&format!(
        "the robot is the node /{} of ROS 2 in {}; stamps are CLOCK_MONOTONIC plus {} ns",
        settings.name,
        settings.place,
        calendar.offset_ns()
    ));
    let mut known = Known {
        battery: Battery::new(settings.measures.pack),
        ..Known::default()
    };
    let mut sender = Sender {
        writers: &mut writers,
        known: &mut known,
        measures: &settings.measures,
        frames: &frames,
        clock: bus.clock(),
    };
    let mut pace = Pace::keeping();
    let mut told: Option<Instant> = None;
    while !shutdown.is_requested() {
        if told.is_none_or(|told| told.elapsed() >= SECOND) {
            told = Some(Instant::now());
            if !bus.is_listed() {
                return Err(RunError::Cleared);
            }
            if calendar.look(Clock::unix_offset_ns()) {
                log::warn!("the machine's calendar was set; stamps follow it");
            }
            gateway.passed = sender.passed(&feeds);
            sender.diagnose(&gateway, calendar);
        }
        watchdog.enter("reading the topics");
        let has_map = feeds.drain(&mut sender, &mut pace, calendar)?;
        watchdog.leave();
        sender.draw(calendar);
        if let (true, Some(map)) = (has_map, &sender.known.map) {
            let left_out = services.map(&mut node, map)?;
            node.announce();
            if left_out > 0 {
                log::warn!(
                    "{left_out} products have no service, as there are too many; `lager fetch` fetches them"
                );
            }
        }
        for said in node.look() {
            log::warn!("{said}");
        }
        services.turn(&node);
        Watcher::pause(Some(&mut watcher), &mut pace);
    }
    Ok(())
}

impl Feeds {
    fn open(bus: &Bus, watcher: &mut Watcher) -> Result<Self, PortError> {
        Ok(Self {
            distance: Feed::open(bus, watcher)?,
            line: Feed::open(bus, watcher)?,
            steering: Feed::open(bus, watcher)?,
            health: Feed::open(bus, watcher)?,
            status: Feed::open(bus, watcher)?,
            map: Feed::open(bus, watcher)?,
            route: Feed::open(bus, watcher)?,
            blocks: Feed::open(bus, watcher)?,
            thoughts: Feed::open(bus, watcher)?,
            truth: Feed::open(bus, watcher)?,
        })
    }

    /// Sends what is new. Returns whether there is another map.
    fn drain(
        &mut self,
        to: &mut Sender<'_>,
        pace: &mut Pace,
        calendar: Calendar,
    ) -> Result<bool, ReceiveError> {
        let mut has_map = false;
        // The map first: poses stand on it.
        self.map
            .drain(pace, |map, at| has_map |= to.map(map, (calendar, at)))?;
        self.blocks
            .drain(pace, |ways, at| to.blocks(ways, (calendar, at)))?;
        self.route
            .drain(pace, |route, at| to.route(route, (calendar, at)))?;
        self.distance.drain(pace, |frame, at| {
            let range = parts::range(frame, to.measures, (calendar, at), to.frames);
            to.writers.range.send(range);
        })?;
        self.line.drain(pace, |frame, _| {
            to.writers.line.send(parts::line(frame));
            to.writers.line_state.send(parts::line_state(frame));
        })?;
        self.steering
            .drain(pace, |report, at| to.steering(report, (calendar, at)))?;
        self.health
            .drain(pace, |health, at| to.health(health, (calendar, at)))?;
        self.status
            .drain(pace, |status, at| to.status(status, (calendar, at)))?;
        self.thoughts.drain(pace, |thought, at| {
            to.writers
                .rosout
                .send(floor::log(thought, (calendar, at), to.frames));
        })?;
        self.truth
            .drain(pace, |truth, at| to.truth(truth, (calendar, at)))?;
        Ok(has_map)
    }
}

/// Makes messages of samples and sends them.
struct Sender<'a> {
    writers: &'a mut Writers,
    known: &'a mut Known,
    measures: &'a Measures,
    frames: &'a Frames,
    clock: Clock,
}

/// When a sample happened, and the calendar.
type At = (Calendar, u64);

impl Sender<'_> {
    /// Returns whether it is another map than before.
    fn map(&mut self, map: &WarehouseMap, at: At) -> bool {
        if self.known.map.as_deref() == Some(map) {
            return false;
        }
        self.known.map = Some(Box::new(*map));
        let scene = drawn::map(map, time(at));
        self.writers
            .floor
            .send(floor::markers(&scene, at, self.frames));
        self.draw_blocks(at);
        if let Some(route) = self.known.route.take() {
            self.route(&route, at);
        }
        true
    }

    fn blocks(&mut self, ways: &BlockedWays, at: At) {
        // How often the robot has tried them is not drawn.
        let shown = |way: &BlockedWay| (way.x, way.y, way.heading, way.source);
        let last = self.known.blocks.replace(Box::new(*ways));
        let last = last.iter().flat_map(|last| last.ways()).map(shown);
        if !last.eq(ways.ways().iter().map(shown)) {
            self.draw_blocks(at);
        }
    }

    /// The grid has them as well.
    fn draw_blocks(&mut self, at: At) {
        // Without a map nobody knows how far nodes are apart.
        let Some(map) = &self.known.map else {
            return;
        };
        let blocks = self.known.blocks.as_deref();
        if let Some(grid) = floor::grid(map, blocks, at, self.frames) {
            self.writers.grid.send(grid);
        }
        let none = BlockedWays::default();
        let scene = drawn::blocks(blocks.unwrap_or(&none), map, time(at));
        self.writers
            .blocked
            .send(floor::markers(&scene, at, self.frames));
    }

    fn route(&mut self, route: &Route, at: At) {
        if self.known.route.as_deref() == Some(route) {
            return;
        }
        if let Some(map) = &self.known.map {
            self.writers
                .path
                .send(motion::path(route, map, at, self.frames));
        }
        self.known.route = Some(Box::new(*route));
    }

    fn steering(&mut self, report: &lager_topics::SteeringReport, (calendar, at): At) {
        let is_due = |last: u64, every: Duration| at.abs_diff(last) >= every.as_nanos() as u64;
        if is_due(self.known.joints_at, JOINTS) {
            self.known.joints_at = at;
            let joints = parts::joints(report, (calendar, at), self.frames);
            self.writers.joints.send(joints);
        }
        if is_due(self.known.battery_at, SECOND) {
            self.known.battery_at = at;
            let when = (&self.clock, calendar, at);
            let battery = parts::battery(report, &mut self.known.battery, when, self.frames);
            self.writers.battery.send(battery);
        }
    }

    fn health(&mut self, health: &Health, (_, at): At) {
        self.known.health = Some((*health, at));
    }

    fn status(&mut self, status: &NavigatorStatus, at: At) {
        self.known.status = Some((*status, at.1));
        let Some(map) = &self.known.map else {
            return;
        };
        if let Some(moved) = self.known.motion.take(status, map, at, self.frames) {
            self.writers.pose.send(moved.pose);
            self.writers.odom.send(moved.odometry);
            self.writers.tf.send(moved.frames);
        }
    }

    fn truth(&mut self, truth: &Truth, at: At) {
        let (odometry, frames) = motion::truth(truth, at, self.frames);
        self.writers.truth.send(odometry);
        self.writers.tf.send(frames);
        let is_same = self.known.drawn.as_ref().is_some_and(|drawn| {
            drawn.goods() == truth.goods() && drawn.obstacles() == truth.obstacles()
        });
        self.known.changed = (!is_same).then(|| (Box::new(*truth), at.1));
    }

    /// Draws the world if it has changed and that is due.
    fn draw(&mut self, calendar: Calendar) {
        let now = Clock::monotonic_ns();
        if now - self.known.drawn_at < WORLD.as_nanos() as u64 {
            return;
        }
        let side = self.known.map.as_deref().map_or(0.0, drawn::side_m);
        // Things on ways stand where the map's nodes are.
        let may_be = |truth: &Truth| side > 0.0 || truth.obstacles().is_empty();
        if let Some((truth, at)) = self.known.changed.take_if(|(truth, _)| may_be(truth)) {
            let at = (calendar, at);
            let scene: SceneUpdate = drawn::world(&truth, side, time(at));
            self.writers
                .world
                .send(floor::markers(&scene, at, self.frames));
            self.known.drawn = Some(truth);
            self.known.drawn_at = now;
        }
    }

    fn diagnose(&mut self, gateway: &Gateway, calendar: Calendar) {
        let states = (&self.known.health, &self.known.status);
        let at = (calendar, Clock::monotonic_ns());
        let told = diagnostics(states, gateway, at, self.frames);
        self.writers.diagnostics.send(told);
    }

    fn passed(&self, feeds: &Feeds) -> Vec<Passed> {
        let Writers {
            range,
            line,
            line_state,
            battery,
            joints,
            pose,
            odom,
            truth,
            path,
            grid,
            floor,
            blocked,
            world,
            bodies: _,
            tf,
            tf_static: _,
            diagnostics: _,
            rosout,
        } = &*self.writers;
        vec![
            feeds.distance.passed(&[range.counts()]),
            feeds.line.passed(&[line.counts(), line_state.counts()]),
            feeds.steering.passed(&[joints.counts(), battery.counts()]),
            feeds.health.passed(&[]),
            feeds
                .status
                .passed(&[pose.counts(), odom.counts(), tf.counts()]),
            feeds.map.passed(&[floor.counts(), grid.counts()]),
            feeds.route.passed(&[path.counts()]),
            feeds.blocks.passed(&[blocked.counts()]),
            feeds.thoughts.passed(&[rosout.counts()]),
            feeds.truth.passed(&[truth.counts(), world.counts()]),
        ]
    }
}

fn time((calendar, at): At) -> Time {
    Time::of_ns(calendar.unix_ns(at))
}

/// The part as which the gateway joins the bus.
pub const ROLE: Role = Role::Gateway;
