//! Both boards at the far ends of two pseudo terminals, stepped by the test's own thread: what
//! they send is sent when the test says so, and nothing else wakes the services.

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    BoardStatus, Callsign, PACKET_LENGTH, Payload, ResetCause, SettingReply, SettingStatus,
    SteerCommand, SteerData, SteerFlags,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Longest silence within a packet. A pseudo terminal hands bytes over when the scheduler lets it.
const GAP_US: u32 = 50_000;

/// Boards speak at least this often: a link that is silent for a second is down, and nobody drives
/// a board that has not reported for 200 ms.
const SPEAK_EVERY: Duration = Duration::from_millis(100);

struct Line {
    master: OwnedFd,
    link: BoardLink,
}

/// A sensor board and a steering board that stands still.
pub(crate) struct Boards {
    sensor: Line,
    steering: Line,
    pub(crate) ports: [PathBuf; 2],
    start: Instant,
    /// When each board spoke last.
    spoke: [Instant; 2],
    /// Every command given, repetitions left out; the last one is in force.
    pub(crate) commands: Vec<SteerCommand>,
    /// Packets the bridge has written to the steering board.
    pub(crate) written: u64,
    /// Reports the steering board has sent.
    pub(crate) reports: u64,
}

impl Boards {
    /// Boards whose ports are linked in `folder`.
    pub(crate) fn new(folder: &Path) -> Self {
        let ports = [folder.join("sensor.tty"), folder.join("steering.tty")];
        Self {
            sensor: Line::new(Callsign::Sensor, &ports[0]),
            steering: Line::new(Callsign::Steering, &ports[1]),
            ports,
            start: Instant::now(),
            spoke: [Instant::now(); 2],
            commands: Vec::new(),
            written: 0,
            reports: 0,
        }
    }

    /// Sends a frame of the sensor board.
    pub(crate) fn send(&mut self, payload: Payload) {
        let packet = self
            .sensor
            .link
            .encode(payload)
            .expect("the sensor board is up");
        self.sensor.write(&packet);
        self.spoke[0] = Instant::now();
    }

    /// Waits at most `timeout` for bytes from the bridge and takes them; sends what is due.
    pub(crate) fn step(&mut self, timeout: Duration) {
        let timeout = Timespec::try_from(timeout).expect("a short time");
        let mut fds =
            [&self.sensor, &self.steering].map(|line| PollFd::new(&line.master, PollFlags::IN));
        let _ = poll(&mut fds, Some(&timeout));
        let now_us = u32::try_from(self.start.elapsed().as_micros()).expect("a short test");
        self.sensor.take(now_us, |_| ());
        let (commands, written) = (&mut self.commands, &mut self.written);
        let mut answers = Vec::new();
        self.steering.take(now_us, |payload| {
            *written += 1;
            if let Payload::Setting(setting) = payload {
                answers.push(Payload::SettingReply(SettingReply {
                    key: setting.key,
                    seq: setting.seq,
                    value: setting.value,
                    status: SettingStatus::Accepted,
                }));
            }
            if let Payload::SteerCommand(command) = payload
                && commands.last() != Some(&command)
            {
                commands.push(command);
            }
        });
        for answer in answers {
            if let Some(packet) = self.steering.link.encode(answer) {
                self.steering.write(&packet);
            }
        }
        let silent = self.spoke.map(|at| at.elapsed() >= SPEAK_EVERY);
        if silent[0] {
            self.spoke[0] = Instant::now();
            // No frame: nothing of it goes onto the bus.
            if let Some(packet) = self.sensor.link.encode(STATUS) {
                self.sensor.write(&packet);
            }
        }
        if silent[1] {
            self.spoke[1] = Instant::now();
            if let Some(packet) = self.steering.link.encode(report(self.commands.last())) {
                self.steering.write(&packet);
                self.reports += 1;
            }
        }
    }
}

/// A board's counters, all in order.
const STATUS: Payload = Payload::BoardStatus(BoardStatus {
    reset: ResetCause::PowerOn,
    bad_packets: 0,
    lost_packets: 0,
    refused: 0,
    exde_errors: 0,
    servo_timeouts: 0,
    load_percent: 0,
    longest_loop_100us: 0,
});

/// A board that does what it is told, but whose wheels are in the air: a flag besides the duties
/// of 0 says that they are meant.
fn report(command: Option<&SteerCommand>) -> Payload {
    Payload::SteerData(SteerData {
        code: command.map_or(0, |command| command.code),
        left_duty: 0,
        right_duty: 0,
        flags: SteerFlags::ARM_LOCKED,
        line_error: 0,
        finished_seq: 0,
        servo_errors: 0,
        battery_decivolts: 110,
    })
}

impl Line {
    fn new(sign: Callsign, path: &Path) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).expect("a pseudo terminal");
        grantpt(&master).expect("its other end");
        unlockpt(&master).expect("its other end");
        fcntl_setfl(&master, OFlags::NONBLOCK).expect("a mode");
        // A serial line has no echo, whether its port is open or not.
        let mut termios = tcgetattr(&master).expect("a terminal");
        termios.make_raw();
        tcsetattr(&master, OptionalActions::Now, &termios).expect("a terminal");
        let slave = ptsname(&master, Vec::new()).expect("its name");
        std::os::unix::fs::symlink(slave.to_str().expect("a path in UTF-8"), path).expect("a link");
        Self {
            master,
            link: BoardLink::new(sign, ResetCause::PowerOn, GAP_US),
        }
    }

    /// Takes what has come and sends the handshake if it is due.
    fn take(&mut self, now_us: u32, mut packet: impl FnMut(Payload)) {
        let mut buffer = [0; 512];
        // Without the bridge at the other end there is nothing to read.
        let count = rustix::io::read(&self.master, &mut buffer).unwrap_or(0);
        for byte in &buffer[..count] {
            if let Some(BoardEvent::Packet(taken)) = self.link.push(*byte, now_us) {
                packet(taken.payload);
            }
        }
        if let Some(syn) = self.link.poll(now_us) {
            self.write(&syn);
        }
    }

    fn write(&self, packet: &[u8; PACKET_LENGTH]) {
        // A line without a listener loses what is sent; its handshake is repeated.
        let _ = rustix::io::write(&self.master, packet);
    }
}
