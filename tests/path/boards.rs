//! Both boards at the other ends of two pseudo terminals, stepped by the test's own thread: they
//! send only when the test tells them, and nothing else wakes the services.

use std::path::PathBuf;
use std::time::Duration;

use lager_home::Clock;
use lager_rig::{Board, wheels_in_the_air};
use lager_wire::{BoardStatus, Callsign, Payload, ResetCause, SteerCommand};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// A sensor board and a steering board that stands still.
pub(crate) struct Boards {
    sensor: Board,
    steering: Board,
    pub(crate) ports: [PathBuf; 2],
    /// Every command without its repetitions; the last one is in force.
    pub(crate) commands: Vec<SteerCommand>,
    /// The number of packets that the bridge has written to the steering board.
    pub(crate) written: u64,
    /// The number of reports that the steering board has sent.
    pub(crate) reports: u64,
    /// The number of packets without a frame that the sensor board has sent, after silences.
    pub(crate) statuses: u64,
}

impl Boards {
    pub(crate) fn new() -> Self {
        let [sensor, steering] = [Callsign::Sensor, Callsign::Steering]
            .map(|sign| Board::new(sign).expect("a pseudo terminal"));
        Self {
            ports: [&sensor, &steering].map(|board| board.cable.path().clone()),
            sensor,
            steering,
            commands: Vec::new(),
            written: 0,
            reports: 0,
            statuses: 0,
        }
    }

    /// Sends a frame of the sensor board.
    pub(crate) fn send(&mut self, payload: Payload) {
        assert!(self.sensor.link.is_up(), "the sensor board is up");
        say(&mut self.sensor, payload);
        self.sensor.spoke_ns = Clock::monotonic_ns();
    }

    /// Waits at most `timeout` for bytes from the bridge, reads them, and sends what is due.
    pub(crate) fn step(&mut self, timeout: Duration) {
        let timeout = Timespec::try_from(timeout).expect("a short time");
        let mut fds =
            [&self.sensor, &self.steering].map(|board| PollFd::new(&board.cable, PollFlags::IN));
        let _ = poll(&mut fds, Some(&timeout));
        let _ = self.sensor.answer(|_| ());
        let (commands, written) = (&mut self.commands, &mut self.written);
        let _ = self.steering.answer(|payload| {
            *written += 1;
            if let Payload::SteerCommand(command) = payload
                && commands.last() != Some(&command)
            {
                commands.push(command);
            }
        });
        // Not a frame: nothing of it is published on the bus.
        let told = self.sensor.speak(STATUS);
        self.statuses += u64::from(told.unwrap_or(false));
        let code = self.commands.last().map_or(0, |command| command.code);
        let reported = self.steering.speak(wheels_in_the_air(code));
        self.reports += u64::from(reported.unwrap_or(false));
    }
}

/// Sends a packet, if the link is up. If nobody has opened the line, the packet is lost.
fn say(board: &mut Board, payload: Payload) {
    let _ = board.send(payload);
}

/// The counters of a board without errors.
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
