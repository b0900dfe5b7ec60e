//! The navigator's shell on the bus: it carries samples in and out and decides nothing.
//!
//! One turn: wait, drain the topics that were rung for, hand each sample to the navigator, and send
//! at once what changed. Events go out first, then the blocked ways, the queue and the status, then
//! the order; what no service acts upon goes last. If the process is killed between any two of the
//! first five, its successor knows at least as much as the bridge: an event may come twice, but is
//! never lost. Only a setpoint that replaces a setpoint goes out before the status, because giving
//! it twice has the effect of giving it once. The successor may not know its number, so it leaves
//! one number out when it takes up a status. An unchanged order is renewed every 40 ms of robot
//! time, with the frame before that moment if there is one.
//!
//! A turn takes one decision for each sample and, only if there was none, one for the time that has
//! passed. What follows from a sample carries that sample's stamps on (`lager_ports::Cause`), and a
//! renewal those of the newest frame since its order was given. How long frames took is counted
//! when the turn's orders are out ([`FrameMeter`]).
//!
//! Last of all the journal is told (`nav/inputs`): the input, its time, and a proof of what became
//! of it.
//!
//! **Safe state**: silence. When this process ends, for whatever reason, the order in force is no
//! longer renewed, and the bridge stops the robot when the lease is over, 120 ms later.

mod journal;

use core::time::Duration;

use lager_ports::{
    Bus, Cause, Clock, PortError, Publisher, ReceiveError, Sample, SendError, Shutdown, Subscriber,
    Waiter, urgency,
};
use lager_topics::{
    InputKind, LatencyPath, LinkHealth, LogThought, MissionEvent, MissionOrder, MissionQueue, Mode,
    NavBlocks, NavMap, NavRoute, NavStatus, NavigatorStatus, OperatorInput, Pick, SensorDistance,
    SensorLine, Sent, Stamp, SteeringCommand, SteeringOrder, SteeringState, ToldKind, Topic,
};
use lager_wire::Command;

use crate::config::LogicConfig;
use crate::latency::FrameMeter;
use crate::navigator::{Input, Navigator};
use crate::node::Node;
use crate::told::{Beginning, Kept, goods_of};
use crate::traced::Traced;
use journal::{Journal, Places};

/// How often the order in force is renewed, in robot time; its lease is three times as long.
const RENEWAL: Duration = Duration::from_millis(40);

/// How often `nav/status` is published when nothing changes, in robot time.
const STATUS_PERIOD: Duration = Duration::from_millis(50);

/// How often the sensor board sees the line, in robot time. What falls due before the next frame is
/// done with this one: no timer has to wake logic for it, least of all in the middle of a frame's
/// way.
const FRAME_PERIOD: Duration = Duration::from_millis(5);

/// Longest wait for anything, in real time: a wake can be missed, and the shutdown flag is looked
/// at that often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// How late a press may come that lets the robot move, in ns of real time: this process may have
/// been held up.
const LATEST_NS: u64 = 200_000_000;

/// How long a predecessor's status is waited for, in real time.
const RESUME_WAIT: Duration = Duration::from_millis(500);

/// Runs the logic unit until `shutdown` is requested.
///
/// # Errors
/// Logic's place on the bus cannot be had; the sentence says what to do.
pub fn run(bus: &Bus, config: &LogicConfig, shutdown: &Shutdown) -> Result<(), PortError> {
    let kept = match config.resume {
        true => {
            let (status, blocks, queue) = (
                kept::<NavStatus>(bus),
                kept::<NavBlocks>(bus),
                kept::<MissionQueue>(bus),
            );
            status.map(|status| Kept {
                status,
                blocks: blocks.unwrap_or_default(),
                queue: queue.unwrap_or_default(),
            })
        }
        false => None,
    };
    // The bridge's main loop is farther along the path.
    urgency::step_back(1, config.waiting);
    let mut shell = Shell::new(bus, config, &Beginning::new(config, kept))?;
    shutdown.wake(shell.waiter.ringer()?);
    shell.publish_blocks(Cause::OWN);
    shell.publish_queue(Cause::OWN);
    shell.repeat_status(shell.clock.now());
    while !shutdown.is_requested() {
        shell.turn();
    }
    let ended = shell.journal.end();
    shell.check(ended);
    Ok(())
}

/// What an earlier navigator has left. If it cannot be read, for whatever reason, the robot may be
/// anywhere.
fn kept<T: Topic>(bus: &Bus) -> Option<T::Payload> {
    let kept = bus.kept::<T>(RESUME_WAIT).unwrap_or_else(|error| {
        tracing::warn!("the earlier navigator's {} is lost: {error}", T::NAME);
        None
    });
    kept.map(|(value, _)| value)
}

struct Shell {
    clock: Clock,
    waiter: Waiter,
    navigator: Navigator,

    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    steering: Subscriber<SteeringState>,
    health: Subscriber<LinkHealth>,
    map: Subscriber<NavMap>,
    orders: Subscriber<MissionOrder>,
    inputs: Subscriber<OperatorInput>,

    commands: Publisher<SteeringCommand>,
    status: Publisher<NavStatus>,
    blocks: Publisher<NavBlocks>,
    queue: Publisher<MissionQueue>,
    route: Publisher<NavRoute>,
    events: Publisher<MissionEvent>,
    thoughts: Publisher<LogThought>,
    latency: Publisher<LatencyPath>,
    journal: Journal,

    meter: FrameMeter,
    /// Inputs the navigator was given.
    decisions: u64,
    /// Who may drive and whether a stop is latched, as the navigator was told last.
    told_mode: Option<(Mode, bool)>,
    /// What was driven by hand, as the navigator was told last.
    told_by_hand: Option<u64>,
    sent_status: NavigatorStatus,
    status_due: Duration,
    sent_order: Option<SteeringOrder>,
    /// What the order in force rests on: the newest frame since it was given, or what it was given
    /// for.
    rests_on: Cause,
    renewal_due: Duration,
    lost_before: u64,
    complaints: u32,
    traced: Traced,
}

impl Shell {
    fn new(bus: &Bus, config: &LogicConfig, beginning: &Beginning) -> Result<Self, PortError> {
        let kept = beginning.kept.as_ref().map(|kept| &kept.status);
        match kept {
            Some(status) => tracing::info!(
                phase = ?status.phase,
                order = status.order_id,
                "the state of an earlier navigator is taken up"
            ),
            None if config.resume => tracing::warn!(
                "there is no state of an earlier navigator: where the robot is has to be told by a reset"
            ),
            None => {}
        }
        let navigator = beginning.navigator();
        let (commands, status, events) = (bus.publisher()?, bus.publisher()?, bus.publisher()?);
        let places = places(&commands, &status, &events);
        Ok(Self {
            clock: bus.clock(),
            // Before the subscribers: what they miss while they are made is drained anyway.
            waiter: bus.waiter(config.waiting)?,
            line: bus.subscriber()?,
            distance: bus.subscriber()?,
            steering: bus.subscriber()?,
            health: bus.subscriber()?,
            map: bus.subscriber()?,
            orders: bus.subscriber()?,
            inputs: bus.subscriber()?,
            journal: Journal::begin(bus, beginning, places)?,
            commands,
            status,
            events,
            blocks: bus.publisher()?,
            queue: bus.publisher()?,
            route: bus.publisher()?,
            thoughts: bus.publisher()?,
            latency: bus.publisher()?,
            meter: FrameMeter::default(),
            decisions: 0,
            told_mode: None,
            told_by_hand: None,
            sent_status: navigator.status(),
            navigator,
            status_due: Duration::ZERO,
            sent_order: None,
            rests_on: Cause::OWN,
            renewal_due: Duration::ZERO,
            lost_before: kept.map_or(0, |status| status.frames_lost),
            complaints: 0,
            traced: Traced::default(),
        })
    }

    /// One turn of the loop.
    fn turn(&mut self) {
        self.wait();
        // First who may drive and in what world, then what people want, then what the robot senses.
        // The line comes last, so that its decision knows all the rest.
        let decisions = self.decisions;
        self.take_states();
        self.take_wishes();
        self.take_senses();
        let is_idle = self.decisions == decisions;
        if is_idle {
            self.tell(Input::Tick, Cause::OWN, self.clock.now());
        }
        let now_ns = Clock::monotonic_ns();
        let ahead = if is_idle {
            Duration::ZERO
        } else {
            FRAME_PERIOD
        };
        self.keep_time(self.clock.at(now_ns), ahead);
        self.tell_latency(now_ns);
        let kept = self.journal.keep_time();
        self.check(kept);
    }

    fn wait(&self) {
        let due = self.status_due.min(self.renewal_due);
        let left = due.saturating_sub(self.clock.now());
        self.waiter.wait(self.clock.real(left).min(LONGEST_WAIT));
    }

    fn take_states(&mut self) {
        if self.waiter.has::<LinkHealth>() {
            self.take_health();
        }
        if self.waiter.has::<NavMap>()
            && let Some((map, cause)) = self.next(|shell| shell.map.latest())
        {
            self.decide(Input::Map(&map), cause);
        }
    }

    fn take_health(&mut self) {
        if let Some((health, cause)) = self.next(|shell| shell.health.latest())
            && let Some(mode) = health.mode.get()
        {
            if self.told_by_hand != Some(health.driven_by_hand) {
                self.told_by_hand = Some(health.driven_by_hand);
                self.decide(Input::DrivenByHand(health.driven_by_hand), cause);
            }
            let stopped = health.stopped != 0;
            // The bridge repeats it ten times a second, and with every order it has taken.
            if self.told_mode != Some((mode, stopped)) {
                self.told_mode = Some((mode, stopped));
                self.decide(Input::Mode { mode, stopped }, cause);
            }
        }
    }

    fn take_wishes(&mut self) {
        if self.waiter.has::<MissionOrder>() {
            while let Some((order, cause)) = self.next(|shell| shell.orders.receive()) {
                self.decide(Input::Order(&order), cause);
            }
        }
        if self.waiter.has::<OperatorInput>() {
            while let Some((input, cause)) = self.next(|shell| shell.inputs.receive()) {
                let age_ns = Clock::monotonic_ns().saturating_sub(input.stamp().publish_time_ns);
                if age_ns > LATEST_NS && input.kind.get().is_some_and(lets_it_move) {
                    let late_ms = age_ns / 1_000_000;
                    tracing::warn!("{} came {late_ms} ms late and is not taken", input.kind);
                    continue;
                }
                match input.kind.get() {
                    Some(kind @ (InputKind::PickupDone | InputKind::PickupForced)) => {
                        let order_id = input.order_id;
                        let forced = kind == InputKind::PickupForced;
                        self.decide(Input::PickupDone { order_id, forced }, cause);
                    }
                    Some(InputKind::Placed) => {
                        if let Some(heading) = input.heading.get() {
                            let node = Node::new(input.x, input.y);
                            self.decide(Input::Placed { node, heading }, cause);
                        }
                    }
                    Some(InputKind::OrderCancelled) => {
                        self.decide(Input::Cancel(input.order_id), cause);
                    }
                    Some(InputKind::OrderMovedUp) => {
                        self.decide(Input::MoveUp(input.order_id), cause);
                    }
                    Some(InputKind::QueueCleared) => self.decide(Input::ClearQueue, cause),
                    Some(InputKind::GoodsGone) => {
                        if let Some(product) = goods_of(input.order_id) {
                            self.decide(Input::GoodsGone(product), cause);
                        }
                    }
                    Some(InputKind::GoodsBack) => {
                        self.decide(Input::GoodsBack(goods_of(input.order_id)), cause);
                    }
                    Some(kind @ (InputKind::LinkLost | InputKind::LinkBack)) => {
                        let lost = kind == InputKind::LinkLost;
                        self.decide(Input::Link { lost }, cause);
                    }
                    Some(InputKind::PickByHand) => self.decide(Input::Pick(Pick::Manual), cause),
                    Some(InputKind::PickByItself) => self.decide(Input::Pick(Pick::Auto), cause),
                    Some(InputKind::ResetPressed) => self.decide(Input::Reset, cause),
                    // The switch is the bridge's (E14): the mode comes back with its health.
                    Some(
                        InputKind::SwitchPressed
                        | InputKind::SwitchedToManual
                        | InputKind::SwitchedToAutonomous,
                    )
                    | None => {}
                }
            }
        }
    }

    fn take_senses(&mut self) {
        if self.waiter.has::<SteeringState>() {
            while let Some((report, cause)) = self.next(|shell| shell.steering.receive()) {
                self.decide(Input::Steering(&report), cause);
            }
        }
        if self.waiter.has::<SensorDistance>() {
            while let Some((frame, cause)) = self.next(|shell| shell.distance.receive()) {
                self.decide(Input::Distance(frame.distance_cm), cause);
                self.note(frame.stamp(), cause);
            }
        }
        if self.waiter.has::<SensorLine>() {
            while let Some((frame, cause)) = self.next(|shell| shell.line.receive()) {
                if let Some(state) = frame.state.get() {
                    self.decide(Input::Line(state), cause);
                    self.note(frame.stamp(), cause);
                }
            }
        }
    }

    /// A sample that `receive` has returned, and the cause for everything that follows from it.
    fn next<T: Topic>(
        &mut self,
        receive: impl FnOnce(&mut Self) -> Result<Option<Sample<T>>, ReceiveError>,
    ) -> Option<(Sample<T>, Cause)> {
        match receive(self) {
            Ok(sample) => sample.map(|sample| {
                let cause = sample.cause();
                (sample, cause)
            }),
            Err(error) => {
                self.complain(&error);
                None
            }
        }
    }

    /// A frame was decided upon, and what follows from it is sent.
    fn note(&mut self, stamp: &Stamp, cause: Cause) {
        self.rests_on = cause;
        self.meter.took(stamp, cause.receive_time_ns());
    }

    /// Lets the navigator decide on a sample.
    fn decide(&mut self, input: Input<'_>, cause: Cause) {
        let now = self.clock.at(cause.receive_time_ns());
        self.tell(input, cause, now);
    }

    /// Hands one input to the navigator and sends what changed because of it.
    fn tell(&mut self, input: Input<'_>, cause: Cause, now: Duration) {
        self.decisions = self.decisions.wrapping_add(1);
        let output = self.navigator.handle(now, input);
        for event in &output.events {
            let sent = self.events.send(cause, *event);
            self.check(sent);
        }
        let order = self.navigator.current_order();
        let is_new = order != self.sent_order;
        let goes_first = is_setpoint(order) && is_setpoint(self.sent_order);
        self.sent_order = order;
        if is_new {
            self.rests_on = cause;
        }
        if is_new && goes_first {
            self.give_order(now, cause);
        }
        if output.blocks_changed {
            self.publish_blocks(cause);
        }
        if output.queue_changed {
            self.publish_queue(cause);
        }
        if output.status_changed {
            self.publish_status(now);
        }
        if is_new && !goes_first {
            self.give_order(now, cause);
        }
        if output.route_changed {
            let sent = self.route.send(cause, *self.navigator.route());
            self.check(sent);
        }
        if let Some(thought) = output.thought {
            tracing::debug!("{thought}");
            let sent = self.thoughts.send(cause, thought);
            self.check(sent);
        }
        let places = places(&self.commands, &self.status, &self.events);
        let navigator = &self.navigator;
        let told = self.journal.told(now, &input, navigator, &output, places);
        self.check(told);
    }

    /// Does what is due by the clock, or so soon.
    fn keep_time(&mut self, now: Duration, ahead: Duration) {
        if now + ahead >= self.status_due {
            self.repeat_status(now);
        }
        if now + ahead >= self.renewal_due {
            self.give_order(now, self.rests_on);
            if self.sent_order.is_some() {
                self.tell_again(now, ToldKind::Renewed);
            }
        }
    }

    /// Counts the frames of this turn, whose orders are out, and tells it once a second.
    fn tell_latency(&mut self, now_ns: u64) {
        self.meter.turn_over(now_ns);
        if let Some(latency) = self.meter.due(now_ns) {
            let sent = self.latency.send(Cause::OWN, *latency);
            self.check(sent);
        }
    }

    fn repeat_status(&mut self, now: Duration) {
        self.publish_status(now);
        self.tell_again(now, ToldKind::Repeated);
    }

    fn tell_again(&mut self, now: Duration, kind: ToldKind) {
        let places = places(&self.commands, &self.status, &self.events);
        let told = self.journal.again(now, kind, places);
        self.check(told);
    }

    fn give_order(&mut self, now: Duration, cause: Cause) {
        self.renewal_due = now + RENEWAL;
        if let Some(order) = self.sent_order {
            let sent = self.commands.send(cause, order);
            self.check(sent);
        }
    }

    fn publish_blocks(&mut self, cause: Cause) {
        let sent = self.blocks.send(cause, self.navigator.blocks());
        self.check(sent);
    }

    fn publish_queue(&mut self, cause: Cause) {
        let queue = self.navigator.queue();
        self.traced.follow(&queue);
        let sent = self.queue.send(cause, queue);
        self.check(sent);
    }

    fn publish_status(&mut self, now: Duration) {
        self.status_due = now + STATUS_PERIOD;
        self.sent_status = self.navigator.status();
        let status = NavigatorStatus {
            frames_lost: self.lost_before + self.lost(),
            ..self.sent_status
        };
        let sent = self.status.send(Cause::OWN, status);
        self.check(sent);
    }

    /// Samples missed on the topics on which each sample counts; of the others only the last one
    /// does.
    fn lost(&self) -> u64 {
        self.line.lost()
            + self.distance.lost()
            + self.steering.lost()
            + self.orders.lost()
            + self.inputs.lost()
    }

    fn check(&mut self, sent: Result<(), SendError>) {
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    /// Logs faults of the bus, but not the same one for ever.
    fn complain(&mut self, error: &dyn std::error::Error) {
        self.complaints = self.complaints.wrapping_add(1);
        if self.complaints.is_power_of_two() {
            tracing::error!(times = self.complaints, "{error}");
        }
    }
}

/// How far the publishers have come whose samples are proved.
fn places(
    commands: &Publisher<SteeringCommand>,
    statuses: &Publisher<NavStatus>,
    events: &Publisher<MissionEvent>,
) -> Places {
    Places {
        commands: sent(commands),
        statuses: sent(statuses),
        events: sent(events),
    }
}

fn sent<T: Topic>(publisher: &Publisher<T>) -> Sent {
    Sent {
        epoch: publisher.epoch(),
        next: publisher.sent(),
    }
}

/// Whether an order holds until another one comes, rather than running once.
fn is_setpoint(order: Option<SteeringOrder>) -> bool {
    order
        .and_then(|order| Command::from_code(order.code))
        .is_some_and(|command| !command.is_one_shot())
}

/// Whether the robot may drive off when it has been told this.
const fn lets_it_move(kind: InputKind) -> bool {
    matches!(
        kind,
        InputKind::PickupDone
            | InputKind::PickupForced
            | InputKind::ResetPressed
            | InputKind::Placed
    )
}
