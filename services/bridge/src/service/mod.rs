//! The main loop: everything that is written to a port is written here, and everything that is
//! decided is decided by the [`Arbiter`], which this loop feeds.
//!
//! One turn: wait, take what the readers have brought, answer requests, drain all orders, let the
//! arbiter decide, publish its state, write, tell the rest. The order matters: a resume is answered
//! before the orders are drained, so that a stop that came with it wins; the arbiter's state
//! (`link/health`) is published before the bytes are written, so that no successor can take a
//! carried-out order for a new one.
//!
//! Nobody is woken in vain: `link/health` rings only when it says something new to logic, the mode
//! or the stop; `steering/state` tells the order in force with the board's next report, and rings
//! for reports and for the end of an order.
//!
//! **Safe state**: standby. It is written when nobody holds a lease, when a stop is latched, and
//! several times at shutdown. If this process is killed, the steering board halts by itself
//! within 150 ms.

mod links;
mod publish;
mod requests;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use heapless::spsc::{Consumer, Queue};
use lager_ports::{
    Bus, Cause, Clock, PortError, Publisher, ReceiveError, Sample, Server, Shutdown, Subscriber,
    Waiter,
};
use lager_topics::{
    BridgeRequest, Health, InputKind, LatencyPath, LinkHealth, Mode, OperatorInput,
    SteeringCommand, SteeringState, Topic,
};
use lager_wire::link::HostTransmitter;
use lager_wire::{Callsign, PACKET_LENGTH, Payload, SettingKey, SteerCommand, SteerData};

use crate::arbiter::{Arbiter, Ended, Verdict};
use crate::boards::Boards;
use crate::config::BridgeConfig;
use crate::frames::ServoTable;
use crate::path::PathMeter;
use crate::reader::{PortEvent, QUEUE, Reader, Shared};
use crate::serial::{PacketWriter, Sent, SerialPort};
use crate::settings::Settings;

/// How often `link/health` is published when nothing changes, in robot time.
const HEALTH_PERIOD: Duration = Duration::from_millis(100);

/// Longest wait for anything, in real time: a wake can be missed, and the shutdown flag is looked
/// at that often.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// How long an earlier bridge's state is waited for, in real time.
const RESUME_WAIT: Duration = Duration::from_millis(500);

/// How long a shutdown waits for the wheels to stand, in robot time.
const PARKING: Duration = Duration::from_millis(200);

/// How often a shutdown writes standby at least, if there is a board.
const PARKING_WRITES: u32 = 3;

/// Runs the bridge until `shutdown` is requested.
///
/// Ports that cannot be opened are no reason to end: they are tried again for ever, and
/// `link/health` and the log say so.
///
/// # Errors
/// The bridge's place on the bus cannot be had; the sentence says what to do.
pub fn run(bus: &Bus, config: &BridgeConfig, shutdown: &Shutdown) -> Result<(), PortError> {
    let kept = if config.resume {
        bus.kept::<LinkHealth>(RESUME_WAIT)?
    } else {
        None
    };
    let shared = Shared::default();
    let mut queues: [Queue<PortEvent, QUEUE>; 2] = [Queue::new(), Queue::new()];
    let [first, second] = &mut queues;
    let (first_in, first_out) = first.split();
    let (second_in, second_out) = second.split();

    let server = bus.server::<BridgeRequest>()?;
    let mut core = Core::new(bus, config, &shared, kept.as_ref(), [first_out, second_out])?;
    let ringer = core.waiter.ringer()?;
    shutdown.wake(ringer.clone());
    let clock = bus.clock();
    std::thread::scope(|scope| {
        for (place, events) in [first_in, second_in].into_iter().enumerate() {
            let port = (config.ports[place].as_path(), config.baud);
            let (ringer, shared) = (ringer.clone(), &shared);
            std::thread::Builder::new()
                .name(["sensor-port", "steering-port"][place].to_owned())
                .spawn_scoped(scope, move || {
                    Reader::new(place, port, bus, events, ringer, shared).run();
                })
                .map_err(|error| PortError::Transport {
                    topic: "link/health".to_owned(),
                    detail: format!("no thread for a serial port: {error}"),
                })
                .inspect_err(|_| shared.stop.store(true, Ordering::Release))?;
        }
        core.publish_health(clock.now());
        while !shutdown.is_requested() {
            core.turn(&server);
        }
        core.park(&server);
        shared.stop.store(true, Ordering::Release);
        Ok(())
    })
}

/// One serial port as the main loop sees it.
struct Port<'a> {
    events: Consumer<'a, PortEvent>,
    device: Option<Arc<SerialPort>>,
    writer: PacketWriter,
    transmitter: HostTransmitter,
}

/// Everything of the main loop but the answering of requests, which must be able to turn the loop
/// while a board's answer is waited for.
struct Core<'a> {
    clock: Clock,
    config: &'a BridgeConfig,
    shared: &'a Shared,
    waiter: Waiter,
    orders: Subscriber<SteeringCommand>,
    inputs: Subscriber<OperatorInput>,
    state: Publisher<SteeringState>,
    health: Publisher<LinkHealth>,
    latency: Publisher<LatencyPath>,
    ports: [Port<'a>; 2],
    boards: Boards,
    arbiter: Arbiter,
    settings: Settings,
    servos: ServoTable,
    /// The last report of a version-1 steering board in this life of its link.
    report: Option<SteerData>,
    /// Standbys written, and whether a report after the first shows the wheels at rest.
    parking: Option<(u32, bool)>,
    /// The arbiter's revisions that `link/health` and `steering/state` last showed.
    health_revision: u32,
    state_revision: u32,
    /// The order that ended last, as `steering/state` last told it.
    told_end: Option<Ended>,
    /// Who may drive and whether a stop is latched, as `link/health` last told it.
    told_mode: Option<(Mode, bool)>,
    /// The order in force that `link/health` last told was a setpoint.
    told_setpoint: bool,
    path: PathMeter,
    health_due: Duration,
    lost_before: u64,
    bus_complaints: u32,
}

impl<'a> Core<'a> {
    fn new(
        bus: &Bus,
        config: &'a BridgeConfig,
        shared: &'a Shared,
        kept: Option<&Health>,
        events: [Consumer<'a, PortEvent>; 2],
    ) -> Result<Self, PortError> {
        let port = |events| Port {
            events,
            device: None,
            writer: PacketWriter::default(),
            transmitter: HostTransmitter::new(),
        };
        let arbiter = kept.map_or_else(Arbiter::new, Arbiter::resume);
        let mut settings = Settings::default();
        if config.raw_line {
            settings.keep(SettingKey::RawLine, 1);
        }
        if let Some(kept) = kept {
            settings.resume(kept);
            tracing::info!(
                mode = ?arbiter.mode(),
                stopped = arbiter.is_stopped(),
                order = kept.current_id,
                "the state of an earlier bridge is taken up"
            );
        }
        Ok(Self {
            clock: bus.clock(),
            config,
            shared,
            waiter: bus.waiter(config.waiting)?,
            orders: bus.subscriber()?,
            inputs: bus.subscriber()?,
            state: bus.publisher()?,
            health: bus.publisher()?,
            latency: bus.publisher()?,
            ports: events.map(port),
            boards: Boards::new(kept, shared),
            health_revision: arbiter.revision(),
            state_revision: arbiter.revision(),
            told_end: arbiter.last_ended(),
            told_mode: None,
            told_setpoint: false,
            path: PathMeter::new(Clock::monotonic_ns()),
            arbiter,
            settings,
            servos: ServoTable::default(),
            report: None,
            parking: None,
            health_due: Duration::ZERO,
            lost_before: kept.map_or(0, |kept| kept.bus_lost),
            bus_complaints: 0,
        })
    }

    /// One turn of the loop.
    fn turn(&mut self, server: &Server<BridgeRequest>) {
        self.wait();
        self.take_events();
        if self.waiter.has_request::<BridgeRequest>()
            && let Err(error) = server.serve(|ask| self.answer(ask))
        {
            self.complain(&error);
        }
        self.take_orders();
        self.flush();
    }

    /// Waits for something to do.
    fn wait(&self) {
        let due = [self.arbiter.next_due(), self.settings_due()]
            .into_iter()
            .flatten()
            .fold(self.health_due, Duration::min);
        let left = due.saturating_sub(self.clock.now());
        self.waiter.wait(self.clock.real(left).min(LONGEST_WAIT));
    }

    /// When a setting is due to a board that could take it.
    fn settings_due(&self) -> Option<Duration> {
        [Callsign::Sensor, Callsign::Steering]
            .into_iter()
            .filter(|board| self.boards.place(*board).is_some())
            .filter_map(|board| self.settings.next_due(board))
            .min()
    }

    /// Drains orders and buttons completely.
    fn take_orders(&mut self) {
        if self.waiter.has::<SteeringCommand>() {
            while let Some(order) = self.next(|core| core.orders.receive()) {
                self.take_order(&order);
            }
        }
        if self.waiter.has::<OperatorInput>() {
            while let Some(input) = self.next(|core| core.inputs.receive()) {
                // The other inputs are logic's.
                if input.kind.get() == Some(InputKind::SwitchPressed) {
                    let mode = match self.arbiter.mode() {
                        Mode::Manual => Mode::Autonomous,
                        Mode::Autonomous => Mode::Manual,
                    };
                    tracing::info!(?mode, "the switch was pressed");
                    self.arbiter.set_mode(mode);
                }
            }
        }
    }

    /// The sample that `receive` has brought.
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
        // A lease counts from its origin's word, not from when it is read here.
        let given_ns = order.stamp().publish_time_ns.min(received_ns);
        let was_stopped = self.arbiter.is_stopped();
        let verdict = self.arbiter.order(self.clock.at(given_ns), order);
        if verdict == Verdict::Executes
            && let Some((key, _)) = self.arbiter.current()
        {
            self.path.begin(key, order.stamp(), received_ns);
        }
        if self.arbiter.is_stopped() && !was_stopped {
            tracing::warn!("stopped; a resume releases it");
        }
    }

    /// Lets the arbiter decide, publishes what has changed, and writes what is due.
    fn flush(&mut self) {
        let now_ns = Clock::monotonic_ns();
        let now = self.clock.at(now_ns);
        self.arbiter.advance(now);
        let tells = self.arbiter.revision() != self.health_revision || self.health_due <= now;
        let writes_first = self.told_setpoint
            && self.arbiter.has_setpoint()
            && self.told_mode == Some((self.arbiter.mode(), self.arbiter.is_stopped()));
        if tells && !writes_first {
            self.publish_health(now);
        }
        if let Some(place) = self.boards.place(Callsign::Steering) {
            while let Some(command) = self.arbiter.poll(now) {
                self.write_command(now, place, command);
            }
        }
        if tells && writes_first {
            self.publish_health(now);
        }
        self.path.give_up();
        self.write_settings(now);
        // A report tells the order in force soon enough, but not every board reports.
        let unreported = self.report.is_none() && self.arbiter.revision() != self.state_revision;
        if unreported || self.arbiter.last_ended() != self.told_end {
            self.publish_state(Cause::OWN);
        }
        if self.path.is_due(now_ns) {
            self.publish_latency(now_ns);
        }
    }

    /// Writes the settings that are due.
    fn write_settings(&mut self, now: Duration) {
        for board in [Callsign::Sensor, Callsign::Steering] {
            let Some(place) = self.boards.place(board) else {
                continue;
            };
            while let Some(setting) = self.settings.poll(now, board) {
                let transmitter = &mut self.ports[place].transmitter;
                if let Some(packet) = transmitter.encode(Payload::Setting(setting)) {
                    self.write(place, &packet);
                }
            }
        }
    }

    fn write_command(&mut self, now: Duration, place: usize, command: SteerCommand) {
        let transmitter = &mut self.ports[place].transmitter;
        let written = transmitter
            .encode(Payload::SteerCommand(command))
            .is_some_and(|packet| self.write(place, &packet));
        if !written {
            self.arbiter.not_written(now);
            return;
        }
        if let Some((key, in_force)) = self.arbiter.current()
            && in_force.code() == command.code
            && self.path.is_waiting_for(key)
        {
            self.path.written(Clock::monotonic_ns());
        }
        if let Some((writes, _)) = &mut self.parking {
            *writes += 1;
        }
    }

    /// Writes one packet; whether the driver has taken it.
    fn write(&mut self, place: usize, packet: &[u8; PACKET_LENGTH]) -> bool {
        let port = &mut self.ports[place];
        let Some(device) = &port.device else {
            return false;
        };
        // A port that has gone is found out by its reader.
        matches!(
            port.writer.write(device, packet),
            Ok(Sent::Whole | Sent::Partly)
        )
    }

    /// Brings the robot to rest before the bridge ends.
    fn park(&mut self, server: &Server<BridgeRequest>) {
        self.arbiter.park();
        self.parking = Some((0, false));
        let end = self.clock.now() + PARKING;
        self.flush();
        while self.clock.now() < end && self.boards.place(Callsign::Steering).is_some() {
            if let Some((PARKING_WRITES.., true)) = self.parking {
                break;
            }
            self.turn(server);
        }
        self.publish_health(self.clock.now());
    }

    /// Says what goes wrong on the bus, but not for ever.
    fn complain(&mut self, error: &dyn std::error::Error) {
        self.bus_complaints = self.bus_complaints.wrapping_add(1);
        if self.bus_complaints.is_power_of_two() {
            tracing::error!(times = self.bus_complaints, "{error}");
        }
    }
}
