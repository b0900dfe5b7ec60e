//! A Pi for tests that speaks to both boards in packets: it answers handshakes, renews its command,
//! and keeps what the boards report.

use core::time::Duration;

use lager_plant::{Make, Pose, Warehouse};
use lager_simulator::{Robot, RobotOptions, Wire};
use lager_wire::link::{HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{
    ArmCommand, ArmData, BoardStatus, Command, LineState, Packet, Payload, SteerCommand, SteerData,
    SteerFlags, WheelCommand,
};

/// The time between two repetitions of the command in force.
const RENEW: Duration = Duration::from_millis(40);

pub(crate) fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

struct Line {
    wire: Wire,
    link: HostLink,
    transmitter: HostTransmitter,
}

/// The boards' reports: the latest of each kind, and a history where tests need one.
#[derive(Default)]
pub(crate) struct Heard {
    pub(crate) ups: Vec<(Wire, Up)>,
    /// Line states without repetitions, each with the time of its first packet.
    pub(crate) states: Vec<(Duration, LineState)>,
    pub(crate) distance: Option<u8>,
    pub(crate) steer: Option<SteerData>,
    pub(crate) servos: [Option<ArmData>; 8],
    pub(crate) statuses: Vec<(Wire, BoardStatus)>,
    pub(crate) bytes: Vec<u8>,
    pub(crate) packets: u32,
}

pub(crate) struct Pi {
    pub(crate) robot: Robot,
    pub(crate) heard: Heard,
    lines: [Line; 2],
    command: Option<SteerCommand>,
    renew_at: Duration,
    seq: u8,
}

impl Pi {
    pub(crate) fn new(warehouse: &Warehouse, mut options: RobotOptions) -> Self {
        // The robot's owner has told its board of the divider before.
        options.steering.robot.divider = true;
        Self::around(Robot::new(warehouse, options).expect("the warehouse is valid"))
    }

    pub(crate) fn around(robot: Robot) -> Self {
        let line = |wire| Line {
            wire,
            link: HostLink::new(),
            transmitter: HostTransmitter::new(),
        };
        Self {
            robot,
            heard: Heard::default(),
            lines: [line(Wire::Sensor), line(Wire::Steering)],
            command: None,
            renew_at: Duration::ZERO,
            seq: 0,
        }
    }

    /// A robot as drawn ([`Make::Nominal`]), in a built-in warehouse, with both links up.
    pub(crate) fn in_builtin(name: &str) -> Self {
        Self::started(&Warehouse::builtin(name).unwrap(), 1)
    }

    pub(crate) fn started(warehouse: &Warehouse, seed: u64) -> Self {
        let options = RobotOptions {
            seed,
            make: Make::Nominal,
            ..RobotOptions::default()
        };
        let mut pi = Self::new(warehouse, options);
        pi.until(ms(1_000), Pi::is_up);
        pi
    }

    pub(crate) fn is_up(&self) -> bool {
        self.lines.iter().all(|line| line.link.is_up())
    }

    pub(crate) fn lost(&self) -> u32 {
        self.lines.iter().map(|line| line.link.health().lost).sum()
    }

    pub(crate) fn pose(&self) -> Pose {
        self.robot.world().pose()
    }

    pub(crate) fn place(&mut self, x: f64, y: f64, heading: f64) {
        self.robot.place(Pose { x, y, heading });
    }

    /// Gives a new command, and renews it from now on.
    pub(crate) fn command(&mut self, command: Command) -> u8 {
        self.seq = self.seq.wrapping_add(1);
        self.command = Some(SteerCommand {
            code: command.code(),
            seq: self.seq,
        });
        self.renew_at = self.robot.now();
        self.seq
    }

    pub(crate) fn wheels(&mut self, command: WheelCommand) -> u8 {
        self.command(Command::Wheel(command))
    }

    /// Gives a one-shot command and waits for its end; returns the flags with which it ended.
    pub(crate) fn carry_out(&mut self, command: Command, limit: Duration) -> SteerFlags {
        let seq = self.command(command);
        self.until(limit, |pi| {
            pi.heard
                .steer
                .is_some_and(|steer| steer.finished_seq == seq)
        });
        self.heard.steer.expect("it was reported").flags
    }

    pub(crate) fn arm(&mut self, command: ArmCommand, times: usize) {
        for _ in 0..times {
            let flags = self.carry_out(Command::Arm(command), ms(20_000));
            assert!(
                !flags.contains(SteerFlags::REFUSED) && !flags.contains(SteerFlags::ABORTED),
                "{command:?}: {flags:?}"
            );
        }
    }

    pub(crate) fn run(&mut self, time: Duration) {
        self.watch(time, |_| {});
    }

    /// Runs for `time`, and calls `see` after every received packet.
    pub(crate) fn watch(&mut self, time: Duration, mut see: impl FnMut(&mut Pi)) {
        let end = self.robot.now() + time;
        while self.robot.now() < end {
            self.step(end);
            see(self);
        }
    }

    /// Runs until `done`; fails after `limit` of robot time.
    pub(crate) fn until(&mut self, limit: Duration, mut done: impl FnMut(&Pi) -> bool) {
        let end = self.robot.now() + limit;
        while !done(self) {
            assert!(self.robot.now() < end, "did not happen within {limit:?}");
            self.step(end);
        }
    }

    fn step(&mut self, end: Duration) {
        let now = self.robot.now();
        if let Some(command) = self.command
            && now >= self.renew_at
        {
            self.renew_at = now + RENEW;
            let steering = &mut self.lines[1];
            if let Some(bytes) = steering.transmitter.encode(Payload::SteerCommand(command)) {
                self.robot.write(Wire::Steering, &bytes);
            }
        }
        let next = self
            .lines
            .iter()
            .map(|line| line.link.next_due())
            .min()
            .unwrap_or(end);
        let next = next.max(now + ms(1)).min(end);
        let next = if self.command.is_some() {
            next.min(self.renew_at)
        } else {
            next
        };
        let now = self.robot.advance_to_output(next);
        let mut packets = Vec::new();
        for line in &mut self.lines {
            let mut bytes = Vec::new();
            self.robot.read(line.wire, &mut bytes);
            self.heard.bytes.extend(&bytes);
            let mut events: Vec<_> = bytes
                .iter()
                .filter_map(|byte| line.link.push(*byte, now))
                .collect();
            events.extend(line.link.poll(now));
            for event in events {
                match event {
                    HostEvent::SendSyn => self.robot.write(line.wire, &line.transmitter.syn()),
                    HostEvent::SendAck { up } => {
                        let version = line.link.version().expect("it has just been heard");
                        let ack = line.transmitter.ack(version);
                        self.robot.write(line.wire, &ack);
                        self.heard.ups.extend(up.map(|up| (line.wire, up)));
                    }
                    HostEvent::Packet(packet) => packets.push((line.wire, packet)),
                    HostEvent::Up(_) | HostEvent::Silent => {}
                }
            }
        }
        for (wire, packet) in packets {
            self.note(now, wire, packet);
        }
    }

    fn note(&mut self, now: Duration, wire: Wire, packet: Packet) {
        self.heard.packets += 1;
        match packet.payload {
            Payload::Line(state) => {
                let last = self.heard.states.last().map(|(_, last)| *last);
                if last != Some(state) {
                    self.heard.states.push((now, state));
                }
            }
            Payload::Distance(distance) => self.heard.distance = distance.get(),
            Payload::SteerData(steer) => self.heard.steer = Some(steer),
            Payload::ArmData(arm) => self.heard.servos[usize::from(arm.servo) - 1] = Some(arm),
            Payload::BoardStatus(status) => self.heard.statuses.push((wire, status)),
            _ => {}
        }
    }
}
