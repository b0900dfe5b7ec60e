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

use core::time::Duration;
use std::time::Instant;

use lager_ports::{Bus, Clock};
use lager_rig::schedule::{Place, RealTime};
use lager_rig::{Board, Domain, Outset, Process, SPEAK_EVERY_NS, interrupted, wheels_in_the_air};
use lager_topics::Role;
use lager_wire::{Callsign, Centimetres, Command, LineState, Payload, WheelCommand};

use super::processes::{ANSWER_WITHIN, Processes};
use super::services::{BRIDGE, LOGIC, OBSERVER, Setup};
use super::turn::{Chain, sleep_until_due};
use crate::error::{BenchError, no_bus};
use crate::report::Mode;
use crate::slow;

/// How long the robot may take to come up, and to come back after it stood still.
const UP_WITHIN: Duration = Duration::from_secs(10);

/// Frames that must be answered one after the other before a robot counts as awake.
const IN_A_ROW: usize = 5;

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
    boards_priority: Option<u8>,
    name: &'static str,
    // The processes end first and the bus's files go last.
    processes: Processes,
    sensor: Board,
    steering: Board,
    /// Code and seq of the last command that the steering board got.
    last: (u8, u8),
    frames: u64,
    /// Frames count.
    counts: bool,
    /// The times of those that count and whose command was overtaken, in ns.
    overtaken: Vec<u64>,
    operator: Outset,
    _bus: Bus,
    _domain: Domain,
}

/// Where the processes of a robot run, and how urgent its boards are (SCHED_FIFO, while frames are
/// counted: nobody who only looks on keeps them from reading the clock).
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub(super) bridge: Place,
    pub(super) logic: Place,
    pub(super) boards: Option<u8>,
}

impl Robot {
    /// Starts bridge and logic and lets them drive, watched by so many observers, each a process of
    /// its own as `lager topic echo` would be.
    pub(super) fn start(
        name: &'static str,
        mode: Mode,
        places: Places,
        observers: usize,
    ) -> Result<Self, BenchError> {
        // Whether the boards may be as urgent.
        drop(places.boards.map(RealTime::begin).transpose()?);
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
            _bus: bus,
            _domain: domain,
        };
        robot.set_out()?;
        let start = |_| {
            let mut observer = Process::start(OBSERVER)?;
            observer.tell(&setup);
            Ok::<Process, BenchError>(observer)
        };
        let mut observers = (0..observers).map(start).collect::<Result<Vec<_>, _>>()?;
        // They start together; the last of them waits for the others' processor time.
        for observer in &mut observers {
            let () = observer.hear_within(2 * UP_WITHIN)?;
        }
        robot.processes.add(observers);
        Ok(robot)
    }

    /// From two silent boards, which are played slowly, to a robot on its way.
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

    /// Whether nobody wants to stop, and there is time left of what was begun at `start`.
    fn check(&mut self, start: Instant) -> Result<(), BenchError> {
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        if start.elapsed() > UP_WITHIN {
            return Err(self.processes.fault(self.name, self.frames));
        }
        Ok(())
    }

    /// All that the boards do beside sending frames.
    fn play_boards(&mut self) -> Result<(), BenchError> {
        self.sensor.answer(|_| ())?;
        let last = &mut self.last;
        self.steering.answer(|payload| {
            note(last, payload);
        })?;
        self.report()
    }

    /// Reports, if it is time: the wheels stand, and the board is one of ours.
    fn report(&mut self) -> Result<(), BenchError> {
        self.steering.speak(wheels_in_the_air(self.last.0))?;
        Ok(())
    }

    /// Takes commands that nobody has asked for by a frame.
    fn drain_commands(&mut self) -> Result<(), BenchError> {
        let last = &mut self.last;
        self.steering.take(|payload| {
            note(last, payload);
        })?;
        Ok(())
    }

    /// Sends one frame when it is due, and waits at most `limit` for its answer.
    fn exchange(&mut self, limit: Duration) -> Result<Answer, BenchError> {
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
        let start = Clock::monotonic_ns();
        self.sensor.cable.write(&packet)?;
        let give_up = start + limit.as_nanos() as u64;
        let mut buffer = [0; 256];
        loop {
            let look = give_up.min(Clock::monotonic_ns() + SPEAK_EVERY_NS);
            let count = self.steering.cable.read_until(look, &mut buffer)?;
            if count > 0 {
                slow::answer();
            }
            let end = Clock::monotonic_ns();
            if count == 0 && end >= give_up {
                return Ok(Answer::None);
            }
            if count == 0 {
                // When the machine stood still, a report is late, and the robot stands until one
                // comes. A board sends it whether it is answered or not.
                self.report()?;
                continue;
            }
            let (last, mut new) = (&mut self.last, None);
            self.steering.hear(&buffer[..count], |payload| {
                new = note(last, payload).or(new);
            });
            if let Some(code) = new {
                return Ok(if (code == FOLLOW) == follows {
                    Answer::Overtaken(end - start)
                } else {
                    Answer::After(end - start)
                });
            }
        }
    }
}

/// Notes a command to the steering board; its code, if it is a new one.
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
        // It may have stood still for longer than leases and links hold, and finds its way back by
        // itself; or for nearly as long, and then the next report must not be late.
        self.steering.spoke_ns = 0;
        while in_a_row < IN_A_ROW {
            self.check(start)?;
            self.play_boards()?;
            in_a_row = match self.exchange(Duration::from_millis(20))? {
                Answer::After(_) => in_a_row + 1,
                Answer::Overtaken(_) | Answer::None => 0,
            };
        }
        Ok(())
    }

    fn frame(&mut self) -> Result<u64, BenchError> {
        let time = match self.exchange(ANSWER_WITHIN)? {
            Answer::After(time) => time,
            Answer::Overtaken(time) => {
                if self.counts {
                    self.overtaken.push(time);
                }
                time
            }
            Answer::None => return Err(self.processes.fault(self.name, self.frames)),
        };
        // While the robot stands: a report is news to logic too, which then looks for the line.
        if self.last.0 != FOLLOW {
            self.report()?;
        }
        Ok(time)
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
