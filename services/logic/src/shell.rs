//! The navigator's shell on the bus: it carries samples in and out. It decides two things only: in
//! which order it takes what has come, and that a press which lets the robot move came too late.
//! [`Outgoing`] says in which order the answers go out, and when the order in force goes out again.
//!
//! One turn: wait, drain the topics that have rung, hand each sample to the navigator, and send
//! at once what changed. What is due before the next frame is sent with the frame at hand.
//!
//! A turn makes one decision for each sample. Only if there was no sample, it makes one for the
//! time that has passed. The consequences of a sample carry that sample's stamps
//! (`lager_ports::Cause`), and a renewal carries those of the newest frame since its order was
//! given. The latency of frames is counted when the turn's orders have left ([`FrameMeter`]).
//!
//! Last of all the shell writes its journal (`nav/inputs`): the input, its time, and a proof of the
//! navigator's answer.
//!
//! **Safe state**: silence. When this process ends, nobody renews the order in force any more, and
//! the bridge stops the robot when the lease is over, 120 ms later.

mod journal;

use core::time::Duration;

use lager_home::Clock;
use lager_orders::lease::LATEST_MOVE_NS;
use lager_ports::{
    Bus, Cause, KEPT_WAIT, PortError, Publisher, ReceiveError, Sample, SendError, Subscriber,
};
use lager_sample::{Stamp, Topic};
use lager_topics::{
    InputKind, LatencyPath, LinkHealth, LogThought, MissionEvent, MissionOrder, MissionQueue,
    NavBlocks, NavMap, NavRoute, NavStatus, NavigatorInputKind, NavigatorStatus, OperatorInput,
    SensorDistance, SensorLine, Sent, SteeringCommand, SteeringState,
};
use lager_wake::{Shutdown, Waiter, urgency};

use crate::config::LogicConfig;
use crate::entry::{Beginning, Predecessor};
use crate::latency::FrameMeter;
use crate::navigator::{Input, Navigator};
use crate::outgoing::{KnownHealth, Outgoing, Part};
use crate::output::Output;
use crate::traced::Traced;
use journal::{Journal, Places};

/// How often the sensor board sees the line, in robot time. Work that is due before the next frame
/// is done with this one, so no timer has to wake logic for it, least of all in the middle of a
/// frame's way.
const FRAME_PERIOD: Duration = Duration::from_millis(5);

/// Longest wait for anything, in real time: a wake may be missed, and the shutdown flag is checked
/// that often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// Runs the logic unit until `shutdown` is requested.
///
/// # Errors
/// Logic's ports on the bus cannot be opened; the sentence says what to do.
pub fn run(bus: &Bus, config: &LogicConfig, shutdown: &Shutdown) -> Result<(), PortError> {
    let kept = match config.resume {
        true => {
            let (status, blocks, queue) = (
                kept::<NavStatus>(bus),
                kept::<NavBlocks>(bus),
                kept::<MissionQueue>(bus),
            );
            status.map(|status| Predecessor {
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
    shutdown.wake(shell.waiter.ringer());
    shell.publish_blocks(Cause::OWN);
    shell.publish_queue(Cause::OWN);
    shell.keep_time(shell.clock.now(), Duration::ZERO);
    while !shutdown.is_requested() {
        shell.turn();
    }
    let ended = shell.journal.end();
    shell.check(ended);
    Ok(())
}

/// The last sample of an earlier navigator. If it cannot be read, the robot may be anywhere.
fn kept<T: Topic>(bus: &Bus) -> Option<T::Payload> {
    let kept = bus.kept::<T>(KEPT_WAIT).unwrap_or_else(|error| {
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
    /// Inputs that the navigator has had.
    decisions: u64,
    known_health: KnownHealth,
    outgoing: Outgoing,
    /// The cause of the order in force: the newest frame since it was given, or else the sample for
    /// which it was given.
    rests_on: Cause,
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
                "goes on from the state of an earlier navigator"
            ),
            None if config.resume => tracing::warn!(
                "there is no state of an earlier navigator: a reset must say where the robot is"
            ),
            None => {}
        }
        let navigator = beginning.navigator();
        let (commands, status, events) = (bus.publisher()?, bus.publisher()?, bus.publisher()?);
        let places = places(&commands, &status, &events);
        Ok(Self {
            clock: bus.clock(),
            // Before the subscribers: what they miss while they are made is drained later anyway.
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
            known_health: KnownHealth::default(),
            navigator,
            outgoing: Outgoing::default(),
            rests_on: Cause::OWN,
            lost_before: kept.map_or(0, |status| status.frames_lost),
            complaints: 0,
            traced: Traced::default(),
        })
    }

    /// One turn of the loop.
    fn turn(&mut self) {
        self.wait();
        // First who may drive and in which world, then what people want, then what the robot
        // senses. The line comes last, so that its decision knows everything else.
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
        let left = self.outgoing.next_due().saturating_sub(self.clock.now());
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
        if let Some((health, cause)) = self.next(|shell| shell.health.latest()) {
            for input in self.known_health.news(&health) {
                self.decide(input, cause);
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
                if age_ns > LATEST_MOVE_NS && input.kind.get().is_some_and(lets_it_move) {
                    let late_ms = age_ns / 1_000_000;
                    tracing::warn!("{} came {late_ms} ms late and is not taken", input.kind);
                    continue;
                }
                self.decide(Input::Operator(&input), cause);
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

    /// A sample that `receive` has returned, as the cause of everything that follows from it.
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

    /// A frame was decided upon, and its consequences are sent.
    fn note(&mut self, stamp: &Stamp, cause: Cause) {
        self.rests_on = cause;
        self.meter.took(stamp, cause.receive_time_ns());
    }

    /// Lets the navigator decide on a sample.
    fn decide(&mut self, input: Input<'_>, cause: Cause) {
        let now = self.clock.at(cause.receive_time_ns());
        self.tell(input, cause, now);
    }

    /// Hands one input to the navigator and sends what changes.
    fn tell(&mut self, input: Input<'_>, cause: Cause, now: Duration) {
        self.decisions = self.decisions.wrapping_add(1);
        let output = self.navigator.handle(now, input);
        let order = self.navigator.current_order();
        if order != self.outgoing.order() {
            self.rests_on = cause;
        }
        for part in self.outgoing.after(now, order, &output) {
            self.send(part, &output, cause);
        }
        let places = places(&self.commands, &self.status, &self.events);
        let navigator = &self.navigator;
        let told = self.journal.told(now, &input, navigator, &output, places);
        self.check(told);
    }

    fn send(&mut self, part: Part, output: &Output, cause: Cause) {
        match part {
            Part::Events => {
                for event in &output.events {
                    let sent = self.events.send(cause, *event);
                    self.check(sent);
                }
            }
            Part::Blocks => self.publish_blocks(cause),
            Part::Queue => self.publish_queue(cause),
            Part::Status => self.publish_status(),
            Part::Order => self.give_order(cause),
            Part::Route => {
                let sent = self.route.send(cause, *self.navigator.route());
                self.check(sent);
            }
            Part::Thought => {
                if let Some(thought) = output.thought {
                    tracing::debug!("{thought}");
                    let sent = self.thoughts.send(cause, thought);
                    self.check(sent);
                }
            }
        }
    }

    /// Sends again the states that are due now, or before the next frame.
    fn keep_time(&mut self, now: Duration, ahead: Duration) {
        for part in self.outgoing.again(now, ahead) {
            let kind = match part {
                Part::Order => {
                    self.give_order(self.rests_on);
                    NavigatorInputKind::Renewed
                }
                _ => {
                    self.publish_status();
                    NavigatorInputKind::Repeated
                }
            };
            let places = places(&self.commands, &self.status, &self.events);
            let told = self.journal.again(now, kind, places);
            self.check(told);
        }
    }

    /// Counts the frames of this turn, whose orders have left, and publishes the counts once a
    /// second.
    fn tell_latency(&mut self, now_ns: u64) {
        self.meter.turn_over(now_ns);
        if let Some(latency) = self.meter.due(now_ns) {
            let sent = self.latency.send(Cause::OWN, *latency);
            self.check(sent);
        }
    }

    fn give_order(&mut self, cause: Cause) {
        if let Some(order) = self.outgoing.order() {
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

    fn publish_status(&mut self) {
        let status = NavigatorStatus {
            frames_lost: self.lost_before + self.lost(),
            ..self.navigator.status()
        };
        let sent = self.status.send(Cause::OWN, status);
        self.check(sent);
    }

    /// Samples missed on the topics on which each sample counts; on the others only the last one
    /// counts.
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

/// The numbers of the publishers whose samples are proved.
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

/// Whether the robot may drive off after this input.
const fn lets_it_move(kind: InputKind) -> bool {
    matches!(
        kind,
        InputKind::PickupDone
            | InputKind::PickupForced
            | InputKind::ResetPressed
            | InputKind::Placed
            | InputKind::WayOpened
    )
}
