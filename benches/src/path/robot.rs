//! The measured chain: the real bridge and the real logic, each in a process of its own, between
//! two boards that this file plays.
//!
//! Every frame makes one new order, because logic trusts a line frame for less than 1 ms:
//!
//! ```text
//!   sensor board sends        logic decides              steering board gets
//!   Line(OnLine)       -->    I see: follow the line --> command 3, new seq
//!   Distance(255)      -->    I see nothing: stand   --> command 1, new seq
//! ```
//!
//! The two kinds of frame take turns. A command answers a frame if it is the command in this table
//! and its seq is new; repetitions of the command in force have the old seq. If the machine keeps
//! logic from its core for half a millisecond, logic may stop trusting the line right after it saw
//! it; then the bridge writes only the later of both orders. Such a frame counts with the time
//! until that command was read, and has a row of its own (`path-overtaken`). The steering board
//! reports that its wheels stand, so the robot drives towards its goods for as long as it is
//! measured.

use core::time::Duration;
use std::time::Instant;

use lager_home::Clock;
use lager_ports::Bus;
use lager_rig::schedule::{Placement, RealTime};
use lager_rig::{Board, Domain, Outset, Process, SPEAK_EVERY_NS, interrupted, wheels_in_the_air};
use lager_sample::Topic as _;
use lager_topics::{Role, SensorLine};
use lager_wire::{Callsign, Centimetres, Command, LineState, Payload, WheelCommand};

use super::processes::{ANSWER_WITHIN, Processes};
use super::services::{BRIDGE, LOGIC, Setup, processes_of};
use super::turn::{Chain, next_due, sleep_until};
use super::{ALONE_IN_REAL_TIME as ALONE, Beside};
use crate::error::{BenchError, no_bus};
use crate::report::Mode;
use crate::slow;

/// The longest time until the robot drives, at the start and after each pause.
const UP_WITHIN: Duration = Duration::from_secs(10);

/// The number of frames in a row with an answer, after which a robot counts as awake.
const IN_A_ROW: usize = 5;

/// The steps of a frame's way beside which the slow-down is put, with a call for each observer. So
/// many that the time of a frame is a multiple, also on a machine whose times double now and then.
const STEPS: usize = 40;

const FOLLOW: u8 = Command::Wheel(WheelCommand::ActiveForward).code();

/// The reaction to a frame.
enum Reaction {
    /// The expected command was read: when the frame was written, and when this was, in ns.
    After([u64; 2]),
    /// Another command was read instead; both times, too.
    Overtaken([u64; 2]),
    /// No new command came in time.
    None,
}

/// The measured robot.
pub(super) struct Robot {
    /// The real time of the boards while frames count, if they have it. The first field: before the
    /// robot is torn down, the rest of the machine may run again.
    urgent: Option<RealTime>,
    boards_priority: Option<u8>,
    name: &'static str,
    // The processes end first, and the bus's files are removed last.
    processes: Processes,
    sensor: Board,
    steering: Board,
    /// Code and seq of the last command to the steering board.
    last: (u8, u8),
    frames: u64,
    /// Whether frames count now.
    counts: bool,
    /// The times of the counted frames whose command was overtaken, in ns.
    overtaken: Vec<u64>,
    operator: Outset,
    bus: Bus,
    _domain: Domain,
}

/// The cores and priorities of a robot's processes, and its boards' SCHED_FIFO priority. The boards
/// have it while frames count, so that no observer keeps them from reading the clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub(super) bridge: Placement,
    pub(super) logic: Placement,
    pub(super) boards: Option<u8>,
}

impl Robot {
    /// Starts bridge, logic and those `beside` them, and lets the robot drive. Each observer or listener
    /// is a process of its own, as `lager topic echo` would be.
    pub(super) fn start(
        name: &'static str,
        mode: Mode,
        places: Places,
        beside: Beside,
    ) -> Result<Self, BenchError> {
        // Fails if the boards may not have that priority.
        drop(places.boards.map(RealTime::begin).transpose()?);
        let domain = Domain::new(crate::FAMILY)?;
        let [sensor, steering] = [
            Board::new(Callsign::Sensor)?,
            Board::new(Callsign::Steering)?,
        ];
        let setup = Setup {
            place: Placement::default(),
            folder: domain.folder().to_owned(),
            mode,
            ports: [sensor.cable.path().clone(), steering.cable.path().clone()],
            socket: domain.files().join("zenoh"),
        };
        let bus = setup.open(Role::Operator)?;
        let at = |place| Setup {
            place,
            ..setup.clone()
        };
        let services = [(LOGIC, at(places.logic)), (BRIDGE, at(places.bridge))];
        let mut robot = Self {
            urgent: None,
            boards_priority: places.boards,
            name,
            processes: Processes::start(services)?,
            sensor,
            steering,
            last: (0, 0),
            frames: 0,
            counts: false,
            overtaken: Vec::new(),
            operator: Outset::new(&bus).map_err(no_bus)?,
            bus,
            _domain: domain,
        };
        robot.set_out()?;
        let start = |name| {
            let mut process = Process::start(name)?;
            process.tell(&setup);
            Ok::<Process, BenchError>(process)
        };
        // Listeners call the gateway; the others start together. The last one waits until the others
        // have had their processor time.
        let mut observers = Vec::new();
        for together in processes_of(beside) {
            let started = together.into_iter().map(start);
            let mut started = started.collect::<Result<Vec<_>, _>>()?;
            for process in &mut started {
                let () = process.hear_within(2 * UP_WITHIN)?;
            }
            observers.append(&mut started);
        }
        robot.processes.add(observers);
        Ok(robot)
    }

    /// The bus, as an operator sees it.
    pub(super) fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Plays both boards until the robot is on its way; at first both are silent.
    fn set_out(&mut self) -> Result<(), BenchError> {
        let start = Instant::now();
        while !self.operator.goes_on().map_err(no_bus)? {
            self.check(start)?;
            self.play_boards()?;
            self.sensor.send(Payload::Line(LineState::OnLine))?;
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(())
    }

    /// Fails if the user wants to stop, or if the time since `start` is over.
    fn check(&mut self, start: Instant) -> Result<(), BenchError> {
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        if start.elapsed() > UP_WITHIN {
            return Err(self.processes.fault(self.name, self.frames));
        }
        Ok(())
    }

    /// Does everything that the boards do besides sending frames.
    fn play_boards(&mut self) -> Result<(), BenchError> {
        self.sensor.answer(|_| ())?;
        let last = &mut self.last;
        self.steering.answer(|payload| {
            note(last, payload);
        })?;
        self.report()
    }

    /// Reports if a report is due: the wheels stand, and the board is one of this project.
    fn report(&mut self) -> Result<(), BenchError> {
        self.steering.speak(wheels_in_the_air(self.last.0))?;
        Ok(())
    }

    /// Reads commands that no frame has caused.
    fn drain_commands(&mut self) -> Result<(), BenchError> {
        let last = &mut self.last;
        self.steering.take(|payload| {
            note(last, payload);
        })?;
        Ok(())
    }

    /// Sends one frame at `at`, in ns, and waits at most `limit` for its answer.
    fn exchange(&mut self, at: u64, limit: Duration) -> Result<Reaction, BenchError> {
        sleep_until(at);
        self.drain_commands()?;
        self.frames += 1;
        let follows = self.last.0 == FOLLOW;
        let payload = if follows {
            Payload::Distance(Centimetres(255))
        } else {
            Payload::Line(LineState::OnLine)
        };
        let Some(packet) = self.sensor.link.encode(payload) else {
            return Ok(Reaction::None);
        };
        let start = Clock::monotonic_ns();
        if self.name != ALONE {
            slow::work(STEPS * SensorLine::QOS.observers);
        }
        self.sensor.cable.write(&packet)?;
        let give_up = start + limit.as_nanos() as u64;
        let mut buffer = [0; 256];
        loop {
            let look = give_up.min(Clock::monotonic_ns() + SPEAK_EVERY_NS);
            let count = self.steering.cable.read_until(look, &mut buffer)?;
            let end = Clock::monotonic_ns();
            if count == 0 && end >= give_up {
                return Ok(Reaction::None);
            }
            if count == 0 {
                // After the machine was held up, a report is late, and the robot stands until one
                // comes. So the board reports while it waits, too.
                self.report()?;
                continue;
            }
            let (last, mut new) = (&mut self.last, None);
            self.steering.hear(&buffer[..count], |payload| {
                new = note(last, payload).or(new);
            })?;
            if let Some(code) = new {
                return Ok(if (code == FOLLOW) == follows {
                    Reaction::Overtaken([start, end])
                } else {
                    Reaction::After([start, end])
                });
            }
        }
    }
}

/// Keeps a command to the steering board in `last`; returns its code if its seq is new.
fn note(last: &mut (u8, u8), payload: Payload) -> Option<u8> {
    let Payload::SteerCommand(command) = payload else {
        return None;
    };
    let is_new = command.seq != last.1;
    *last = (command.code, command.seq);
    is_new.then_some(command.code)
}

impl Chain for Robot {
    fn processes(&mut self) -> &mut Processes {
        &mut self.processes
    }

    fn begin(&mut self) -> Result<(), BenchError> {
        let start = Instant::now();
        let mut in_a_row = 0;
        // If it was stopped for longer than leases and links hold, it comes up again by itself. If
        // it was stopped for almost as long, the next report must come at once.
        self.steering.spoke_ns = 0;
        while in_a_row < IN_A_ROW {
            self.check(start)?;
            self.play_boards()?;
            let due = next_due(Clock::monotonic_ns());
            in_a_row = match self.exchange(due, Duration::from_millis(20))? {
                Reaction::After(_) => in_a_row + 1,
                Reaction::Overtaken(_) | Reaction::None => 0,
            };
        }
        Ok(())
    }

    fn frame(&mut self, at: u64) -> Result<[u64; 2], BenchError> {
        let times = match self.exchange(at, ANSWER_WITHIN)? {
            Reaction::After(times) => times,
            Reaction::Overtaken(times) => {
                if self.counts {
                    self.overtaken.push(times[1] - times[0]);
                }
                times
            }
            Reaction::None => return Err(self.processes.fault(self.name, self.frames)),
        };
        // Only while the robot stands: logic gets the report too, and then looks for the line.
        if self.last.0 != FOLLOW {
            self.report()?;
        }
        Ok(times)
    }

    fn counts(&mut self, counts: bool) -> Result<(), BenchError> {
        self.counts = counts;
        let priority = self.boards_priority.filter(|_| counts);
        self.urgent = priority.map(RealTime::begin).transpose()?;
        Ok(())
    }

    fn overtaken(&self) -> Option<&[u64]> {
        Some(&self.overtaken)
    }
}
