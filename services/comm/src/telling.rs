//! Tells a station that speaks the extension how the robot is: its state twenty times a second,
//! lists when they have changed, measurements when there are new ones.
//!
//! Each kind of report replaces an earlier one that the station has not taken, so a slow station
//! does not make a queue grow.

use lager_battery::Battery;
use lager_floor::{Node, Place, ProductId};
use lager_lines::extension::{
    Block, Degrees, Event, Happened, Latency, Listed, Loads, Queued, Report, Servos, State, Thinks,
    TruePose,
};
use lager_lines::{Name, Text};
use lager_orders::{EventKind, Moment};
use lager_sample::{Coded, Tag};
use lager_topics::{
    BlockedWays, BoardHealth, CalibratedSensor, Calibration, Durations, Failure, Health, LineFrame,
    OrderQueue, Remedy, Route, Thought, Truth,
};
use lager_wire::{Binary, LineBits, LineReading};

use crate::known::{Known, Senses, Stood};
use crate::{health, pose};

/// How often the state is told, in ns of real time.
const PERIOD: u64 = 50_000_000;
/// How often it is told how machine, services and boards are.
const HEALTH_PERIOD: u64 = 1_000_000_000;

/// Reports of the steering board that are older than this are left out, in ms of robot time.
const LATEST_REPORT_MS: u16 = 500;

/// What was told and when, and what to tell next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Telling {
    next_ns: u64,
    next_health_ns: u64,
    route: Option<Report>,
    blocked: Option<Report>,
    queue: Option<Report>,
    obstacles: Option<Report>,
    gone: Option<Report>,
    sensors: Option<Report>,
    commission: Option<Report>,
    found: Option<Report>,
    /// The lines of the saved description that were told.
    kept: usize,
    /// The counts at the last report of the latency.
    latency: Durations,
}

impl Telling {
    /// A station has announced itself, and has been told nothing yet.
    pub(crate) fn begin(&mut self) {
        *self = Self::default();
    }

    /// Whether it is time for the state again.
    pub(crate) const fn is_due(&self, now: Moment) -> bool {
        now.ns >= self.next_ns
    }

    /// Whether it is time for the health again.
    pub(crate) const fn is_health_due(&self, now: Moment) -> bool {
        now.ns >= self.next_health_ns
    }

    /// The reports of this moment. Takes measurements out of `known`.
    pub(crate) fn reports(
        &mut self,
        now: Moment,
        known: &mut Known,
        battery: &Battery,
    ) -> Vec<Report> {
        // A late turn does not delay the turns after it.
        self.next_ns += PERIOD;
        if self.next_ns <= now.ns {
            self.next_ns = now.ns + PERIOD;
        }
        let mut reports = vec![Report::State(Box::new(state(now, known, battery)))];
        if self.is_health_due(now) {
            self.next_health_ns = now.ns + HEALTH_PERIOD;
            reports.push(health::report(now, known));
        }
        let Senses {
            truth,
            latency,
            blocks,
            ..
        } = &mut known.senses;
        let truth = truth.take();
        reports.extend(truth.as_deref().map(self::truth));
        if let Some(latency) = latency.take() {
            reports.push(self::latency(&latency.since(&self.latency)));
            self.latency = *latency;
        }
        let lists = [
            (&mut self.route, known.route.as_deref().map(route)),
            (&mut self.blocked, blocks.as_deref().map(blocked)),
            (&mut self.queue, known.queue.as_ref().map(queue)),
            (&mut self.obstacles, truth.as_deref().map(obstacles)),
            (&mut self.gone, known.queue.as_ref().map(gone)),
            (&mut self.sensors, known.health.as_ref().and_then(sensors)),
        ];
        let commission = &known.commission;
        let found = Report::Found(commission.found.clone());
        let lists = lists.into_iter().chain([
            (
                &mut self.commission,
                Some(Report::Commission(commission.how.clone())),
            ),
            (&mut self.found, Some(found)),
        ]);
        for (told, list) in lists {
            if list.is_some() && *told != list {
                told.clone_from(&list);
                reports.extend(list);
            }
        }
        // A further description begins with a first line again.
        self.kept = self.kept.min(commission.kept.len());
        let untold = commission.kept.iter().skip(self.kept);
        reports.extend(untold.cloned().map(Report::Kept));
        self.kept = commission.kept.len();
        reports
    }
}

/// The kinds of reports that replace an earlier one of their kind.
pub(crate) const KINDS: usize = 12;

/// The kind of a report, the first to be sent first; `None` for reports that all count.
pub(crate) const fn kind(report: &Report) -> Option<usize> {
    match report {
        Report::State(_) => Some(0),
        Report::Truth(_) => Some(1),
        Report::Route(_) => Some(2),
        Report::Blocked(_) => Some(3),
        Report::Queue(_) => Some(4),
        Report::Latency(_) => Some(5),
        Report::Sensors(_) => Some(6),
        Report::Obstacles(_) => Some(7),
        Report::Gone(_) => Some(8),
        Report::Health(_) => Some(9),
        Report::Commission(_) => Some(10),
        Report::Found(_) => Some(11),
        Report::Stopped { .. }
        | Report::Done { .. }
        | Report::Refused { .. }
        | Report::Event(_)
        | Report::Past { .. }
        | Report::Thinks(_)
        | Report::Because(_)
        | Report::Kept(_) => None,
    }
}

/// An event, if the language has a word for it.
pub(crate) fn event(event: &lager_topics::Event, known: &Known) -> Option<Report> {
    let kind = event.kind.get()?;
    let passed = Node {
        x: event.x,
        y: event.y,
    };
    let node = match kind {
        EventKind::NextNode => known.route.as_deref().and_then(next).unwrap_or(passed),
        _ => passed,
    };
    let has_order = event.order_id != 0;
    let text = match kind {
        EventKind::WayBlocked => event.heading.get()?.as_str().to_owned(),
        _ if event.failure.is_none() => String::new(),
        _ => event.failure.to_string(),
    };
    Some(Report::Event(Event {
        kind: Happened::Mission(kind),
        node,
        order: has_order.then_some(event.order_id),
        product: ProductId::new(event.product).filter(|_| has_order),
        text: Text::new(text).unwrap_or_default(),
    }))
}

/// An event of the robot itself, at no place; `text` is the event's text.
pub(crate) fn happened(kind: Happened, text: &str, known: &Known) -> Report {
    let passed = known.status.and_then(|status| {
        let (x, y) = (status.x.try_into().ok()?, status.y.try_into().ok()?);
        Some(Node { x, y })
    });
    Report::Event(Event {
        kind,
        node: passed.unwrap_or(Node { x: 0, y: 0 }),
        order: None,
        product: None,
        text: Text::new(text.to_owned()).unwrap_or_default(),
    })
}

/// The text of a stop's event: its cause, and who has set it.
pub(crate) fn stop_words(health: &Health) -> String {
    let words = [word(health.stop_cause), word(health.stop_origin)];
    let words = words.map(|word| word.map_or_else(|| "-".to_owned(), |word| word.to_string()));
    words.join(" ")
}

/// A thought in values. Values that its kind does not use mean nothing.
pub(crate) fn thinks(thought: &Thought) -> Report {
    let failure = Some(thought.failure).filter(|failure| !failure.is_none());
    Report::Thinks(Box::new(Thinks {
        kind: word(thought.kind),
        node: Some(Node {
            x: thought.x,
            y: thought.y,
        }),
        looks: thought.heading.get(),
        joint: word(thought.joint),
        sides: Some(thought.sides),
        product: ProductId::new(thought.product),
        expected: Some(thought.expected),
        seen: Some(thought.seen),
        failure: failure.and_then(|failure| word(failure.kind)),
        failure_node: failure.map(|Failure { x, y, .. }| Node { x, y }),
        failure_expected: failure.map(|failure| failure.expected),
        failure_seen: failure.map(|failure| failure.seen),
        remedy: failure.and_then(|failure| word(failure.remedy)),
    }))
}

fn state(now: Moment, known: &Known, battery: &Battery) -> State {
    let mut state = State {
        time_ms: u64::try_from(now.robot.as_millis()).ok(),
        next: known.route.as_deref().and_then(next),
        mode: known.mode(),
        ..State::default()
    };
    put_health(&mut state, known);
    put_stop(&mut state, now, known);
    put_place(&mut state, known);
    put_mission(&mut state, known);
    put_boards(&mut state, known);
    if state.battery_dv.is_some() {
        state.battery_percent = battery.percent();
        let left = battery.left();
        state.battery_left_s = left.map(|left| u16::try_from(left.as_secs()).unwrap_or(u16::MAX));
    }
    state
}

fn put_health(state: &mut State, known: &Known) {
    let Some(health) = &known.health else { return };
    state.stopped = Some(health.stopped != 0);
    state.sensor_up = Some(is_up(&health.sensor));
    state.steering_up = Some(is_up(&health.steering));
    state.sensor_lost = Some(health.sensor.lost_total);
    state.steering_lost = Some(health.steering.lost_total);
    let missed = known.status.map_or(0, |status| status.frames_lost);
    state.bus_lost = Some(health.bus_lost.saturating_add(missed));
    // Gains that nobody has ever set are not known.
    state.gain_p = u8::try_from(health.gain_p).ok();
    state.gain_d = u8::try_from(health.gain_d).ok();
}

fn put_stop(state: &mut State, now: Moment, known: &Known) {
    let Some(health) = known.health.as_ref().filter(|health| health.stopped != 0) else {
        return;
    };
    state.stop = Some(health.stop_word);
    state.stop_cause = word(health.stop_cause);
    state.stop_by = word(health.stop_origin);
    let at = Some(health.stopped_at_ns).filter(|at| *at != 0);
    state.stop_age_ms = at.map(|at| now.ns.saturating_sub(at) / 1_000_000);
    if let Stood::After(time) = known.stood {
        state.stood_ms = u64::try_from(time.as_millis()).ok();
    }
}

fn put_place(state: &mut State, known: &Known) {
    let Some(status) = &known.status else { return };
    state.phase = word(status.phase);
    state.hold = word(status.hold);
    state.pick = status.pick.get();
    let remedy = Some(status.remedy).filter(|remedy| *remedy != Remedy::None);
    state.remedy = remedy.and_then(word);
    if !status.failure.is_none() {
        state.failure = word(status.failure.kind);
        state.failure_expected = Some(status.failure.expected);
        state.failure_seen = Some(status.failure.seen);
    }
    let by_hand = known.health.map_or(0, |health| health.driven_by_hand);
    if !pose::is_known(status, by_hand) {
        return;
    }
    if let (Ok(x), Ok(y)) = (u8::try_from(status.x), u8::try_from(status.y)) {
        state.node = Some(Node { x, y });
    }
    state.looks = status.heading.get();
    let map = known.map.as_deref().filter(|map| map.side_length_cm > 0);
    if let Some(pose) = map.and_then(|map| pose::pose(status, map)) {
        state.x_mm = Some(pose.x_mm);
        state.y_mm = Some(pose.y_mm);
        state.heading_deg = Some(pose.heading);
        state.unsure_mm = Some(pose.unsure_mm);
    }
}

fn put_mission(state: &mut State, known: &Known) {
    state.delivered = known.status.map(|status| status.delivered);
    if let Some(queue) = known.queue.filter(|queue| queue.under_way != 0) {
        state.order = Some(queue.order_id);
        state.product = ProductId::new(queue.product);
    }
}

/// What the boards see and do, as far as they report.
fn put_boards(state: &mut State, known: &Known) {
    let is_heard = |up: Option<bool>| up == Some(true);
    if is_heard(state.sensor_up) {
        let bits = known.senses.line.map(|line| line.bits);
        let bits = bits.filter(|bits| *bits != LineFrame::NO_BITS);
        state.line_bits = bits.map(LineBits);
        let distance = known.senses.distance.map(|frame| frame.distance_cm);
        state.distance_cm = distance.filter(|distance_cm| *distance_cm != u8::MAX);
    }
    let report = known.report.filter(|report| {
        let is_new = report.age_ms <= LATEST_REPORT_MS;
        is_heard(state.steering_up) && is_new
    });
    if let Some(report) = report {
        state.line_error = Some(report.line_error);
        state.left_duty = Some(report.left_duty);
        state.right_duty = Some(report.right_duty);
        state.code = Some(Binary(report.code));
        state.servos = Some(Servos::new(report.servo_position.map(Some)));
        state.loads = Some(Loads::new(report.servo_load));
        state.servo_errors = Some(Binary(report.servo_errors));
        let battery = Some(report.battery_decivolts);
        state.battery_dv = battery.filter(|decivolts| *decivolts != 0);
    }
}

fn is_up(board: &BoardHealth) -> bool {
    board.up != 0
}

/// Turns `WaitingForOrder` into `waiting_for_order`.
fn word<T: Coded>(tag: Tag<T>) -> Option<Name> {
    Name::new(lager_topics::word(tag)?).ok()
}

/// The node it goes to.
fn next(route: &Route) -> Option<Node> {
    let node = route.nodes().first()?;
    Some(Node {
        x: node.x,
        y: node.y,
    })
}

fn route(route: &Route) -> Report {
    let nodes = route.nodes().iter();
    let nodes: Vec<Node> = nodes
        .map(|node| Node {
            x: node.x,
            y: node.y,
        })
        .collect();
    Report::Route(Listed::<Node>::new(&nodes))
}

fn blocked(blocks: &BlockedWays) -> Report {
    let block = |way: &lager_topics::BlockedWay| {
        Some(Block {
            way: Place::new(Node::new(way.x, way.y), way.heading.get()?),
            since_s: u32::try_from(way.since_ns / 1_000_000_000).unwrap_or(u32::MAX),
        })
    };
    let ways: Vec<Block> = blocks.ways().iter().filter_map(block).collect();
    Report::Blocked(Listed::<Block>::new(&ways))
}

fn queue(queue: &OrderQueue) -> Report {
    let orders: Vec<Queued> = queue
        .orders()
        .iter()
        .filter_map(|order| {
            Some(Queued {
                order: order.id,
                product: ProductId::new(order.product)?,
            })
        })
        .collect();
    Report::Queue(Listed::<Queued>::new(&orders))
}

fn gone(queue: &OrderQueue) -> Report {
    let products = queue.gone().iter();
    let products: Vec<_> = products
        .filter_map(|gone| ProductId::new(gone.product))
        .collect();
    Report::Gone(Listed::<ProductId>::new(&products))
}

/// What the line sensors read during a calibration, once all of them have been reported.
fn sensors(health: &Health) -> Option<Report> {
    let is_running = health.calibration == Calibration::Running;
    let read = Some(health.calibrated).filter(|_| is_running)?;
    let is_heard = read.iter().all(CalibratedSensor::is_heard);
    let mut sensor = 0..;
    is_heard.then(|| {
        Report::Sensors(read.map(|read| LineReading {
            sensor: sensor.next().unwrap_or(LineBits::SENSORS),
            reading: read.reading,
            lowest: read.lowest,
            highest: read.highest,
            tells_apart: read.tells_apart != 0,
        }))
    })
}

fn latency(counted: &Durations) -> Report {
    let most =
        |count: u64| u32::try_from(count).map_or(Latency::MOST, |count| count.min(Latency::MOST));
    Report::Latency(Box::new(Latency {
        max_us: u32::try_from(counted.max_ns.div_ceil(1_000)).unwrap_or(u32::MAX),
        buckets: counted.buckets.map(most),
    }))
}

/// The things that stand on ways.
fn obstacles(truth: &Truth) -> Report {
    let stands = truth.obstacles().iter().filter_map(|stands| {
        let node = Node::new(stands.x, stands.y);
        Some(Place::new(node, stands.heading.get()?))
    });
    Report::Obstacles(Listed::<Place>::new(&stands.collect::<Vec<_>>()))
}

fn truth(truth: &Truth) -> Report {
    Report::Truth(TruePose {
        x_mm: truth.x_mm.round() as i32,
        y_mm: truth.y_mm.round() as i32,
        // The world counts counter-clockwise, from the right.
        heading: Degrees::new(90 - truth.heading_rad.to_degrees().round() as i32),
        carrying: ProductId::new(truth.carrying),
    })
}
