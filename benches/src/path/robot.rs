//! The chain under test: the real bridge and the real logic, each in a process of its own, between
//! two boards that this file plays.
//!
//! Every frame makes one new order. Logic is told to trust a line frame for no time at all, so
//!
//! ```text
//!   sensor board sends        logic decides              steering board gets
//!   Line(OnLine)       -->    I see: follow the line --> command 3, new seq
//!   Distance(255)      -->    I see nothing: stand   --> command 1, new seq
//! ```
//!
//! by turns. A command answers a frame if it is the one that frame asks for and its seq is new;
//! repetitions of the command in force carry the old one. On a machine that keeps logic from
//! running for half a millisecond, logic may go blind right after it saw, and the bridge then
//! writes the later of both orders alone. Such a frame counts with the time until that command was
//! read, and how many they are is a row of its own (`path-overtaken`). The steering board reports
//! that its wheels stand, so the robot drives towards its goods for as long as it is measured.

mod chain;

use core::time::Duration;
use std::time::Instant;

use lager_ports::{Bus, Cause, Client, Publisher, Subscriber};
use lager_rig::{
    Board, Domain, Process, ProcessError, board_us, interrupted, one_square, wheels_in_the_air,
};
use lager_topics::{
    Ask, AskKind, BridgeRequest, LatencyCommand, LatencyPath, LinkHealth, MissionOrder,
    Mode as Driver, NavMap, NavStatus, Order, Phase, Role,
};
use lager_wire::link::BoardEvent;
use lager_wire::{Callsign, Centimetres, Command, LineState, Payload, WheelCommand};

use super::pace::{now_ns, sleep_until_due};
use super::processes::Processes;
use super::services::{BRIDGE, LOGIC, OBSERVER, Place, RealTime, Setup, bus_error};
use crate::error::BenchError;
use crate::report::Mode;
use crate::slow;

/// How long the robot may take to come up, and to come back after it stood still.
const UP_WITHIN: Duration = Duration::from_secs(10);

/// Reports come this often, in ns: often enough for the link (1 s) and for the order in force.
const REPORT_EVERY: u64 = 100_000_000;

/// Frames that must be answered one after the other before a robot counts as awake.
const IN_A_ROW: usize = 5;

/// Who asks and orders here, in the sentences of errors.
const OPERATOR: &str = "the operator of the measurement";

const FOLLOW: u8 = Command::Wheel(WheelCommand::ActiveForward).code();

/// What became of a frame.
enum Answer {
    /// The command it asks for was read so many ns after it was written.
    After(u64),
    /// Another command came in its place, so many ns after it was written.
    Overtaken(u64),
    /// Nothing new came in time.
    None,
}

/// The robot under test.
pub(super) struct Robot {
    /// While frames are counted, if the boards are to come before everything else. The first to
    /// go: nobody tears down a robot before the rest of the machine may run.
    urgent: Option<RealTime>,
    boards_priority: Option<i32>,
    name: String,
    // The processes end first and the bus's files go last.
    processes: Processes,
    sensor: Board,
    steering: Board,
    /// Code and seq of the last command that the steering board got.
    last: (u8, u8),
    reported_ns: u64,
    frames: u64,
    /// Frames count.
    counts: bool,
    /// The times of those that count and whose command was overtaken, in ns.
    overtaken: Vec<u64>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    path_latency: Subscriber<LatencyPath>,
    command_latency: Subscriber<LatencyCommand>,
    map: Publisher<NavMap>,
    orders: Publisher<MissionOrder>,
    requests: Client<BridgeRequest>,
    bus: Bus,
    setup: Setup,
    domain: Domain,
}

impl Robot {
    /// Starts bridge and logic and lets them drive.
    pub(super) fn start(
        name: &str,
        mode: Mode,
        bridge: Place,
        logic: Place,
    ) -> Result<Self, BenchError> {
        let domain = Domain::new(crate::FAMILY)?;
        let [sensor, steering] = [
            Board::new(Callsign::Sensor)?,
            Board::new(Callsign::Steering)?,
        ];
        let setup = Setup {
            place: Place::default(),
            folder: domain.folder().to_owned(),
            mode,
            ports: [sensor.cable.path().clone(), steering.cable.path().clone()],
        };
        let bus = setup.open(Role::Operator)?;
        let at = |place| Setup {
            place,
            ..setup.clone()
        };
        let processes = Processes::start([(LOGIC, at(logic)), (BRIDGE, at(bridge))])?;
        let mut robot = Self {
            urgent: None,
            boards_priority: None,
            name: name.to_owned(),
            processes,
            sensor,
            steering,
            last: (0, 0),
            reported_ns: 0,
            frames: 0,
            counts: false,
            overtaken: Vec::new(),
            health: bus.subscriber().map_err(bus_error(OPERATOR))?,
            status: bus.subscriber().map_err(bus_error(OPERATOR))?,
            path_latency: bus.subscriber().map_err(bus_error(OPERATOR))?,
            command_latency: bus.subscriber().map_err(bus_error(OPERATOR))?,
            map: bus.publisher().map_err(bus_error(OPERATOR))?,
            orders: bus.publisher().map_err(bus_error(OPERATOR))?,
            requests: bus.client().map_err(bus_error(OPERATOR))?,
            bus,
            setup,
            domain,
        };
        robot.set_out()?;
        Ok(robot)
    }

    /// From now on the thread that plays the boards has that SCHED_FIFO priority while frames are
    /// counted, so that nobody who only looks on keeps it from reading the clock.
    pub(super) fn with_boards_at(&mut self, priority: i32) -> Result<(), BenchError> {
        drop(RealTime::begin(priority)?);
        self.boards_priority = Some(priority);
        Ok(())
    }

    /// Attaches `count` observers, each a process of its own as `lager topic echo` would be.
    pub(super) fn observed_by(&mut self, count: usize) -> Result<(), BenchError> {
        let mut observers = Vec::new();
        for _ in 0..count {
            let mut observer = Process::start(OBSERVER)?;
            observer.tell(&self.setup);
            observers.push(observer);
        }
        // They start together; the last of them waits for the others' processor time.
        for observer in &mut observers {
            let () = observer.hear_within(2 * UP_WITHIN)?;
        }
        self.processes.add(observers);
        Ok(())
    }

    /// From two silent boards to a robot on its way.
    fn set_out(&mut self) -> Result<(), BenchError> {
        self.map
            .send(Cause::OWN, one_square())
            .map_err(bus_error(OPERATOR))?;
        self.until("both boards are up", |robot| {
            let health = robot.health.latest();
            let health = health.map_err(bus_error("reading health"))?;
            Ok(health.is_some_and(|health| health.sensor.up != 0 && health.steering.up != 0))
        })?;
        let ask = Ask {
            kind: AskKind::SetMode.into(),
            mode: Driver::Autonomous.into(),
            ..Ask::default()
        };
        self.requests
            .call(ask, UP_WITHIN)
            .map_err(bus_error("asking for the autonomous mode"))?;
        let order = Order { id: 1, product: 1 };
        let mut ordered = Instant::now();
        self.orders
            .send(Cause::OWN, order)
            .map_err(bus_error(OPERATOR))?;
        self.until("the robot is on its way", |robot| {
            let status = robot.status.latest();
            let status = status.map_err(bus_error("reading nav/status"))?;
            // An order that came before logic had its place on the topic is given again.
            if ordered.elapsed() > Duration::from_millis(500) {
                ordered = Instant::now();
                robot
                    .orders
                    .send(Cause::OWN, order)
                    .map_err(bus_error(OPERATOR))?;
            }
            Ok(status.is_some_and(|status| status.phase.get() == Some(Phase::Approaching)))
        })
    }

    /// Plays both boards, slowly, until `done`.
    fn until(
        &mut self,
        what: &str,
        mut done: impl FnMut(&mut Self) -> Result<bool, BenchError>,
    ) -> Result<(), BenchError> {
        let start = Instant::now();
        while !done(self)? {
            if interrupted() {
                return Err(BenchError::Interrupted);
            }
            if start.elapsed() > UP_WITHIN {
                return Err(match self.processes.fault(&self.name, 0) {
                    BenchError::NoSample { .. } => ProcessError::Silent {
                        process: format!("{}, until {what}", self.name),
                        limit: UP_WITHIN,
                    }
                    .into(),
                    said => said,
                });
            }
            self.play_boards()?;
            self.sensor.send(Payload::Line(LineState::OnLine))?;
            self.map.tick();
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }

    /// All that the boards do beside sending frames.
    fn play_boards(&mut self) -> Result<(), BenchError> {
        self.sensor.take(|_| ())?;
        self.sensor.shake_hands()?;
        self.drain_commands()?;
        self.steering.shake_hands()?;
        self.report()
    }

    /// Reports, if it is time: the wheels stand, and the board is one of ours.
    fn report(&mut self) -> Result<(), BenchError> {
        let now = now_ns();
        if now.saturating_sub(self.reported_ns) < REPORT_EVERY || !self.steering.link.is_up() {
            return Ok(());
        }
        self.reported_ns = now;
        Ok(self.steering.send(wheels_in_the_air(self.last.0))?)
    }

    /// Takes commands that nobody has asked for by a frame.
    fn drain_commands(&mut self) -> Result<(), BenchError> {
        let mut buffer = [0; 256];
        loop {
            let count = self.steering.cable.read(&mut buffer)?;
            if count == 0 {
                return Ok(());
            }
            self.take(&buffer[..count]);
        }
    }

    /// Takes bytes from the bridge; the last command among them, if it is a new one.
    fn take(&mut self, bytes: &[u8]) -> Option<u8> {
        let mut new = None;
        for byte in bytes {
            if let Some(BoardEvent::Packet(packet)) = self.steering.link.push(*byte, board_us())
                && let Payload::SteerCommand(command) = packet.payload
            {
                if command.seq != self.last.1 {
                    new = Some(command.code);
                }
                self.last = (command.code, command.seq);
            }
        }
        new
    }

    /// Sends one frame when it is due, and waits at most `limit` ns for its answer.
    fn exchange(&mut self, limit: u64) -> Result<Answer, BenchError> {
        sleep_until_due();
        self.drain_commands()?;
        self.frames += 1;
        let follows = self.last.0 == FOLLOW;
        let payload = if follows {
            Payload::Distance(Centimetres(255))
        } else {
            Payload::Line(LineState::OnLine)
        };
        let Some(packet) = self.sensor.link.encode(payload) else {
            return Ok(Answer::None);
        };
        let start = now_ns();
        self.sensor.cable.write(&packet)?;
        let give_up = start + limit;
        let mut buffer = [0; 256];
        loop {
            let look = give_up.min(now_ns() + REPORT_EVERY);
            let count = self.steering.cable.read_until(look, &mut buffer)?;
            if count > 0 {
                slow::answer();
            }
            let end = now_ns();
            if count == 0 && end >= give_up {
                return Ok(Answer::None);
            }
            if count == 0 {
                // When the machine stood still, a report is late, and the robot stands until one
                // comes. A board sends it whether it is answered or not.
                self.report()?;
                continue;
            }
            if let Some(code) = self.take(&buffer[..count]) {
                return Ok(if (code == FOLLOW) == follows {
                    Answer::Overtaken(end - start)
                } else {
                    Answer::After(end - start)
                });
            }
        }
    }
}

impl core::fmt::Debug for Robot {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("Robot")
            .field("name", &self.name)
            .field("bus", &self.bus)
            .field("domain", &self.domain)
            .finish_non_exhaustive()
    }
}
