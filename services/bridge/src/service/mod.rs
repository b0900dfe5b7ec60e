//! The bridge as a process: ports, bus, stop word and waiting. It decides nothing and carries out
//! the actions of [`BridgeCore`].
//!
//! One turn: wait, obey the stop word, take the readers' events, answer requests, drain
//! all orders, let the core decide, and carry out its actions in its order. The stop word is read
//! before each action and after the last one, so before each packet, with one load each. So nothing
//! that was decided before a stop is written after it, even if this process was frozen meanwhile.
//!
//! Nobody is woken in vain. `link/health` rings only when it changes who may move the robot,
//! because logic must know that. The order in force appears on `steering/state` with the board's
//! next report; that topic rings for reports and for the end of an order. The thread sleeps in the
//! read of a port (`VTIME`). So a frame costs `read` and `futex` in the reader, a sleep and a ring
//! in logic, a sleep and a `write` in the main loop, and nothing else: `tests/path` counts them
//! with `strace`.
//!
//! **Safe state**: standby. The bridge writes it when nobody holds a lease, when a stop is in
//! force, and several times at shutdown. If this process is killed, the steering board halts by
//! itself within 150 ms.

mod doing;
mod saying;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use heapless::spsc::{Consumer, Queue};
use lager_home::Clock;
use lager_orders::Moment;
use lager_ports::{
    Bus, Cause, KEPT_WAIT, PortError, Publisher, ReceiveError, Sample, Server, Subscriber,
};
use lager_sample::Topic;
use lager_stop::{StopError, StopPage};
use lager_topics::{
    Ask, BridgeAnswer, BridgeRequest, Health, Input, LatencyCommand, LinkHealth, LogThought,
    NavStatus, NavigatorStatus, OperatorInput, Origin, SteeringCommand, SteeringState, StopCause,
};
use lager_wake::{Shutdown, Waiter, urgency};

use crate::buttons::{self, Chips, Gpio, Listening, Touch};
use crate::config::BridgeConfig;
use crate::counts::Counts;
use crate::events::PortEvent;
use crate::latency::CommandMeter;
use crate::loan::{Loan, Looking};
use crate::machine::{BridgeCore, CoreOptions};
use crate::reader::{Handed, QUEUE, Reader};
use crate::serial::{PacketWriter, SerialPort};
use crate::source::Source;

/// Longest wait for anything, in real time: a wake may be missed, and the shutdown flag is checked
/// that often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// How many presses of buttons can wait for the main loop.
const TOUCHES: usize = 16;

/// Logic that has published nothing for longer than this is silent, in ns. It publishes its state
/// every 50 ms of robot time.
const LOGIC_SILENT: u64 = 1_000_000_000;

/// How long a shutdown waits for the wheels to stand, in robot time.
const PARKING: Duration = Duration::from_millis(200);

/// Why the bridge could not begin.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BridgeError {
    /// One of its ports on the bus could not be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// It cannot use its stop word.
    #[error(transparent)]
    Stop(#[from] StopError),
}

/// Runs the bridge until `shutdown` is requested.
///
/// If a serial port cannot be opened, the bridge goes on and tries again for ever; `link/health`
/// and the log say so.
///
/// # Errors
/// The bridge's ports on the bus, or its stop word, cannot be opened; the sentence says what to do.
pub fn run(bus: &Bus, config: &BridgeConfig, shutdown: &Shutdown) -> Result<(), BridgeError> {
    run_with(bus, config, &Chips, shutdown)
}

/// The same; `gpio` has the buttons' lines, for machines without a chip.
///
/// # Errors
/// As with [`run`].
pub fn run_with(
    bus: &Bus,
    config: &BridgeConfig,
    gpio: &dyn Gpio,
    shutdown: &Shutdown,
) -> Result<(), BridgeError> {
    let kept = if config.resume {
        bus.kept::<LinkHealth>(KEPT_WAIT).unwrap_or_else(|error| {
            // A state that cannot be read counts as lost, and the robot then starts stopped.
            tracing::error!("{error}");
            None
        })
    } else {
        None
    };
    let clock = bus.clock();
    let kept = kept.map(|(health, stamp)| (health, clock.at(stamp.publish_time_ns)));
    let counts = Counts::new(kept.as_ref().map(|(health, _)| health));
    let end = AtomicBool::new(false);
    let mut queues: [Queue<Handed, QUEUE>; 2] = [Queue::new(), Queue::new()];
    let [first, second] = &mut queues;
    let (first_in, first_out) = first.split();
    let (second_in, second_out) = second.split();
    let mut touches: Queue<(Touch, u64), TOUCHES> = Queue::new();
    let (mut touched, touches) = touches.split();

    let listening = Listening::default();
    let server = bus.server::<BridgeRequest>()?;
    let events = [first_out, second_out];
    let loan = Loan::new(bus.home(), bus.unit());
    let mut service = Service::new(
        bus,
        config,
        (&counts, &loan, &listening),
        kept,
        events,
        touches,
    )?;
    let ringer = service.waiter.ringer();
    shutdown.wake(ringer.clone());
    // The word decides whether the robot is stopped. If the state says stopped and the word is
    // clear, the earlier bridge ended during a release, or somebody has wiped the word.
    let is_lost = match kept {
        None => true,
        Some((kept, _)) => kept.stopped != 0 && service.page.news().is_none(),
    };
    if config.resume && is_lost {
        service.page.stop(StopCause::StateLost);
    }
    if loan.is_lent() {
        service.core.lend(true);
    }
    // Do this before any thread can bring a board, so that nothing is written that a stop forbids.
    service.act();
    let turn = Mutex::new(());
    std::thread::scope(|scope| {
        for (place, events) in [first_in, second_in].into_iter().enumerate() {
            let port = (Source::new(&config.ports, place, &turn), config.baud);
            let (ringer, counts) = (ringer.clone(), (&counts, &end, &loan));
            std::thread::Builder::new()
                .name(["sensor-port", "steering-port"][place].to_owned())
                .spawn_scoped(scope, move || {
                    // Logic and the main loop come later on the path.
                    urgency::step_back(2, config.waiting);
                    Reader::new(place, port, bus, events, ringer, counts).run();
                })
                .map_err(|error| PortError::Thread {
                    what: "a serial port",
                    fault: error.into(),
                })
                .inspect_err(|_| end.store(true, Ordering::Release))?;
        }
        let whether = (&end, &listening);
        let (of_robot, resume) = (config.buttons.as_ref(), kept.is_some());
        let mut watch = Some(move || {
            buttons::watch(of_robot, gpio, resume, whether, |touch, at_ns| {
                // A main loop with so many events waiting hangs, and the supervisor will replace
                // it.
                let _ = touched.enqueue((touch, at_ns));
                ringer.ring();
            });
        });
        while !shutdown.is_requested() {
            // A robot without buttons needs no thread for them until somebody looks for some.
            if (config.buttons.is_some() || listening.is_wanted())
                && let Some(watch) = watch.take()
            {
                std::thread::Builder::new()
                    .name("buttons".to_owned())
                    .spawn_scoped(scope, watch)
                    .map_err(|error| PortError::Thread {
                        what: "the buttons",
                        fault: error.into(),
                    })
                    .inspect_err(|_| end.store(true, Ordering::Release))?;
            }
            service.turn(&server);
        }
        service.park(&server);
        end.store(true, Ordering::Release);
        Ok(())
    })
}

/// One serial port as the main loop sees it.
struct Port<'a> {
    events: Consumer<'a, Handed>,
    device: Option<Arc<SerialPort>>,
    writer: PacketWriter,
}

/// What the main loop needs for the robot's buttons.
struct Buttons {
    /// Where presses are published.
    inputs: Publisher<OperatorInput>,
    /// Where people read what has come of them.
    thoughts: Publisher<LogThought>,
    /// Where logic says whether the robot stands on the delivery node.
    status: Subscriber<NavStatus>,
}

/// The main loop: everything that the core does not have.
struct Service<'a> {
    clock: Clock,
    config: &'a BridgeConfig,
    counts: &'a Counts,
    loan: &'a Loan<'a>,
    listening: &'a Listening,
    looking: Looking,
    waiter: Waiter,
    orders: Subscriber<SteeringCommand>,
    touches: Consumer<'a, (Touch, u64)>,
    /// What only a robot with buttons has on the bus.
    buttons: Option<Buttons>,
    state: Publisher<SteeringState>,
    health: Publisher<LinkHealth>,
    latency: Publisher<LatencyCommand>,
    ports: [Port<'a>; 2],
    page: StopPage,
    core: BridgeCore,
    meter: CommandMeter,
    lost_before: u64,
    bus_complaints: u32,
}

impl<'a> Service<'a> {
    fn new(
        bus: &Bus,
        config: &'a BridgeConfig,
        (counts, loan, listening): (&'a Counts, &'a Loan<'a>, &'a Listening),
        kept: Option<(Health, Duration)>,
        events: [Consumer<'a, Handed>; 2],
        touches: Consumer<'a, (Touch, u64)>,
    ) -> Result<Self, BridgeError> {
        let port = |events| Port {
            events,
            device: None,
            writer: PacketWriter::default(),
        };
        let waiter = bus.waiter(config.waiting)?;
        let path = bus.home().unit(bus.unit()).join(StopPage::FILE);
        let ringer = waiter.ringer();
        let page = StopPage::open(&path, config.resume, move || ringer.ring())?;
        if let Some((kept, _)) = kept {
            tracing::info!(
                mode = ?kept.mode,
                stopped = kept.stopped != 0,
                order = kept.current_id,
                "goes on from the state of an earlier bridge"
            );
        }
        let options = CoreOptions {
            baud: config.baud,
            raw_line: config.raw_line,
            original_boards: config.original_boards,
            robot: config.robot,
        };
        Ok(Self {
            clock: bus.clock(),
            config,
            counts,
            loan,
            listening,
            looking: Looking::default(),
            waiter,
            orders: bus.subscriber()?,
            touches,
            buttons: match config.buttons {
                Some(_) => Some(Buttons {
                    inputs: bus.publisher()?,
                    thoughts: bus.publisher()?,
                    status: bus.subscriber()?,
                }),
                None => None,
            },
            state: bus.publisher()?,
            health: bus.publisher()?,
            latency: bus.publisher()?,
            ports: events.map(port),
            page,
            core: BridgeCore::new(options, kept.as_ref().map(|(kept, at)| (kept, *at))),
            meter: CommandMeter::default(),
            lost_before: kept.map_or(0, |(kept, _)| kept.bus_lost),
            bus_complaints: 0,
        })
    }

    /// One turn of the loop.
    fn turn(&mut self, server: &Server<BridgeRequest>) {
        self.wait();
        self.take_events();
        self.take_touches();
        if self.waiter.has_request::<BridgeRequest>()
            && let Err(error) = server.serve(|ask| self.answer(ask))
        {
            self.complain(&error);
        }
        self.take_orders();
        self.flush();
        self.look_at_the_loan();
    }

    /// Waits for something to do, and obeys a stop that has come meanwhile.
    fn wait(&mut self) {
        let left = self.core.next_due().saturating_sub(self.clock.now());
        self.waiter.wait(self.clock.real(left).min(LONGEST_WAIT));
        if self.page.news().is_some() {
            self.act();
        }
    }

    /// Takes what the readers have brought.
    fn take_events(&mut self) {
        for place in 0..self.ports.len() {
            while let Some((event, device)) = self.ports[place].events.dequeue() {
                if device.is_some() {
                    self.ports[place].device = device;
                    self.ports[place].writer = PacketWriter::default();
                }
                let now = self.moment();
                self.core.port(now, place, event);
                self.act();
                if matches!(event, PortEvent::Lost) {
                    self.ports[place].device = None;
                }
            }
        }
    }

    /// Takes what people have done with the buttons, and tells logic and observers. This process
    /// may have been frozen since a press.
    fn take_touches(&mut self) {
        while let Some((touch, at_ns)) = self.touches.dequeue() {
            let now = self.moment();
            let status = match touch {
                Touch::Reset => self.logic_status(now.ns),
                Touch::Switched(_) | Touch::Toggled => None,
            };
            let buttons = self.config.buttons.as_ref();
            let starts = buttons.is_some_and(|buttons| buttons.reset_starts);
            let told = (self.core).touch(now, (touch, at_ns), starts, status.as_ref());
            self.act();
            let Some(kind) = told else { continue };
            let input = Input {
                kind: kind.into(),
                ..Input::default()
            };
            let told = self.buttons.as_ref();
            let told = told.map(|buttons| buttons.inputs.send(Cause::OWN, input));
            if let Some(Err(error)) = told {
                self.complain(&error);
            }
        }
    }

    /// The state that logic has published last, unless logic is silent.
    fn logic_status(&mut self, now_ns: u64) -> Option<NavigatorStatus> {
        let latest = self.next(|service| match &mut service.buttons {
            Some(buttons) => buttons.status.latest(),
            None => Ok(None),
        })?;
        let age_ns = now_ns.abs_diff(latest.stamp().publish_time_ns);
        (age_ns <= LOGIC_SILENT).then_some(*latest)
    }

    /// Lends the ports, or takes them back. The lock is looked at only while that can be: its file is
    /// the business of whoever works on the boards.
    fn look_at_the_loan(&mut self) {
        // On the path nobody reads the clock for this.
        if !self.loan.is_lent() && !self.core.is_stopped() {
            return;
        }
        let now = self.moment();
        if !self.loan.is_lent() && !self.core.may_lend(now.robot) {
            return;
        }
        if let Some(is_lent) = self.looking.look(now.ns, self.loan) {
            self.core.lend(is_lent);
            self.act();
        }
    }

    /// Begins to answer one request. The loop turns until a board has answered.
    fn answer(&mut self, ask: &Ask) -> BridgeAnswer {
        let now = self.moment();
        self.core.hear_lines(self.listening.told());
        self.core.ask(now, ask);
        self.listening.want(self.core.is_listened_to());
        self.act();
        loop {
            // The answer goes out when its content is in force and published.
            self.flush();
            if let Some(answer) = self.core.answer() {
                return answer;
            }
            self.wait();
            self.take_events();
            self.take_orders();
        }
    }

    /// Takes all orders that wait.
    fn take_orders(&mut self) {
        if self.waiter.has::<SteeringCommand>() {
            while let Some(order) = self.next(|service| service.orders.receive()) {
                self.take_order(&order);
            }
        }
    }

    /// The sample that `receive` returns.
    fn next<T: Topic>(
        &mut self,
        receive: impl FnOnce(&mut Self) -> Result<Option<Sample<T>>, ReceiveError>,
    ) -> Option<Sample<T>> {
        receive(self).unwrap_or_else(|error| {
            self.complain(&error);
            None
        })
    }

    fn take_order(&mut self, order: &Sample<SteeringCommand>) {
        let received_ns = Clock::monotonic_ns();
        // A lease counts from the moment when its origin sent the order, not when the bridge reads
        // it.
        let sent_ns = order.stamp().publish_time_ns.min(received_ns);
        // An order from the future did not get its time from this machine's clock.
        let since_ns = match order.origin.get() {
            Some(Origin::Logic) => sent_ns,
            _ => order.given_ns,
        };
        let age_ns = received_ns.checked_sub(since_ns).unwrap_or(u64::MAX);
        let age = Duration::from_nanos(age_ns);
        let [now, sent] = [received_ns, sent_ns].map(|ns| self.clock.at(ns));
        let in_force = self.core.order(now, sent, age, order);
        self.meter.heard(in_force, order.stamp(), received_ns);
    }

    /// Lets the core decide, and carries out what it wants.
    fn flush(&mut self) {
        let now = self.moment();
        self.core.decide(now.robot);
        self.act();
        self.listening.want(self.core.is_listened_to());
        self.meter.turn_over();
        if self.meter.is_due(now.ns) {
            self.publish_latency();
        }
        self.answer_stoppers(now.ns);
    }

    /// Brings the robot to rest before the bridge ends.
    fn park(&mut self, server: &Server<BridgeRequest>) {
        self.core.park();
        let end = self.clock.now() + PARKING;
        self.flush();
        while self.clock.now() < end && !self.core.is_parked() {
            self.turn(server);
        }
        self.core.tell_health();
        self.act();
    }

    fn moment(&self) -> Moment {
        let ns = Clock::monotonic_ns();
        Moment {
            robot: self.clock.at(ns),
            ns,
        }
    }

    /// Logs faults of the bus, but not the same one for ever.
    fn complain(&mut self, error: &dyn std::error::Error) {
        self.bus_complaints = self.bus_complaints.wrapping_add(1);
        if self.bus_complaints.is_power_of_two() {
            tracing::error!(times = self.bus_complaints, "{error}");
        }
    }
}
