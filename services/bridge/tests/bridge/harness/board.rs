//! A board in a thread: a peer that takes and gives bytes, behind a pseudo terminal that can be
//! pulled out and put in again.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use lager_rig::{GAP_US, answer_to};
use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    BoardStatus, Callsign, Centimetres, LineBits, LineReading, LineState, Packet, Payload,
    ResetCause, SettingKey, SettingReply, SettingStatus,
};

use super::pty::Pty;

/// What stands at the other end of a line.
pub(crate) trait Peer: Send + 'static {
    /// Takes one byte from the Pi.
    fn take(&mut self, byte: u8, now_us: u32);
    /// Does what is due and appends what it sends.
    fn step(&mut self, now_us: u32, out: &mut Vec<u8>);
}

struct Inner<P> {
    peer: P,
    pty: Option<Pty>,
    /// Bytes on their way to the Pi.
    out: Vec<u8>,
    /// The peer is stopped as if its processor stood still.
    frozen: bool,
    stop: bool,
}

/// A peer in a thread.
pub(crate) struct Board<P: Peer> {
    inner: Arc<Mutex<Inner<P>>>,
    thread: Option<JoinHandle<()>>,
    link: PathBuf,
}

impl<P: Peer> Board<P> {
    /// Starts a peer whose port is at `link`.
    pub(crate) fn plugged(peer: P, link: PathBuf) -> Self {
        let inner = Arc::new(Mutex::new(Inner {
            peer,
            pty: Some(Pty::new(&link)),
            out: Vec::with_capacity(1 << 12),
            frozen: false,
            stop: false,
        }));
        let shared = Arc::clone(&inner);
        let thread = std::thread::Builder::new()
            .name("board".to_owned())
            .spawn(move || run(&shared))
            .unwrap();
        Self {
            inner,
            thread: Some(thread),
            link,
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.link
    }

    /// Looks at the peer or changes it.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut P) -> R) -> R {
        work(&mut self.lock().peer)
    }

    /// Pulls the cable: the port is gone.
    pub(crate) fn unplug(&self) {
        let mut inner = self.lock();
        inner.pty = None;
        inner.out.clear();
    }

    /// Puts the cable in again: another port under the same path.
    pub(crate) fn plug(&self) {
        self.plug_at(&self.link);
    }

    /// Puts the cable in where it gets another path.
    pub(crate) fn plug_at(&self, link: &Path) {
        self.lock().pty = Some(Pty::new(link));
    }

    pub(crate) fn freeze(&self, frozen: bool) {
        self.lock().frozen = frozen;
    }

    /// Sends bytes that are no packets, all of them before this returns.
    pub(crate) fn send_noise(&self, mut next: impl FnMut() -> u8, count: usize) {
        let mut left = count;
        super::wait_until("the noise is sent", || {
            let mut inner = self.lock();
            let inner = &mut *inner;
            let pty = inner.pty.as_ref().expect("a plugged board");
            while left > 0 {
                if inner.out.is_empty() {
                    inner.out.extend((0..left.min(512)).map(|_| next()));
                    left -= inner.out.len();
                }
                let sent = pty.write(&inner.out);
                inner.out.drain(..sent);
                if sent == 0 {
                    return false;
                }
            }
            true
        });
    }

    fn lock(&self) -> MutexGuard<'_, Inner<P>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<P: Peer> Drop for Board<P> {
    fn drop(&mut self) {
        self.lock().stop = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run<P: Peer>(inner: &Mutex<Inner<P>>) {
    lager_rig::allocations::exempt_this_thread();
    let start = Instant::now();
    let mut buffer = [0; 512];
    loop {
        {
            let mut inner = inner.lock().unwrap_or_else(PoisonError::into_inner);
            if inner.stop {
                return;
            }
            if inner.frozen || inner.pty.is_none() {
                // An unplugged board still runs; it only is not heard.
                if !inner.frozen {
                    let mut lost = Vec::new();
                    inner.peer.step(micros(start), &mut lost);
                }
            } else {
                let Inner { peer, pty, out, .. } = &mut *inner;
                let pty = pty.as_ref().expect("it is plugged");
                let count = pty.read(&mut buffer);
                let now_us = micros(start);
                for byte in &buffer[..count] {
                    peer.take(*byte, now_us);
                }
                if out.is_empty() {
                    peer.step(now_us, out);
                } else {
                    // A line that is full loses what is sent now.
                    peer.step(now_us, &mut Vec::new());
                }
                let sent = pty.write(out);
                out.drain(..sent);
            }
        }
        std::thread::sleep(std::time::Duration::from_micros(500));
    }
}

/// The board's clock, at the robot's speed.
fn micros(start: Instant) -> u32 {
    start.elapsed().mul_f64(super::SPEED).as_micros() as u32
}

/// A sensor board: line and distance by turns, every 10 ms one of them.
pub(crate) struct SensorBoard {
    pub(crate) link: BoardLink,
    pub(crate) state: LineState,
    pub(crate) bits: u16,
    pub(crate) distance: u8,
    pub(crate) raw: bool,
    pub(crate) calibrations: usize,
    pub(crate) restarts: usize,
    /// How often the link came up.
    pub(crate) ups: usize,
    /// Leaves settings without an answer.
    pub(crate) deaf: bool,
    due_us: u32,
    flip_flop: bool,
    reset: ResetCause,
    answers: Vec<Payload>,
    /// Number of the last calibration: asked again with the same one, it is answered again.
    calibration: Option<u8>,
}

impl SensorBoard {
    pub(crate) fn new() -> Self {
        Self {
            link: BoardLink::new(Callsign::Sensor, ResetCause::PowerOn, GAP_US),
            state: LineState::OnLine,
            bits: 0b000_0111_0000,
            distance: 255,
            raw: false,
            calibrations: 0,
            restarts: 0,
            ups: 0,
            deaf: false,
            due_us: 0,
            flip_flop: false,
            reset: ResetCause::PowerOn,
            answers: Vec::new(),
            calibration: None,
        }
    }

    pub(crate) fn restart(&mut self, cause: ResetCause) {
        self.link = BoardLink::new(Callsign::Sensor, cause, GAP_US);
        self.reset = cause;
        self.raw = false;
        self.restarts += 1;
    }

    /// Tells what a line sensor reads.
    pub(crate) fn tell(&mut self, reading: LineReading) {
        self.answers.push(Payload::LineReading(reading));
    }

    /// Ends the calibration that runs, with so many sensors that have seen floor and tape.
    pub(crate) fn end_calibration(&mut self, sensors: i16, status: SettingStatus) {
        self.answers.push(Payload::SettingReply(SettingReply {
            key: SettingKey::Calibrate,
            seq: self.calibration.expect("a calibration was asked for"),
            value: sensors,
            status,
        }));
    }

    fn set(&mut self, packet: &Packet) {
        let Payload::Setting(setting) = packet.payload else {
            return;
        };
        if self.deaf {
            return;
        }
        let status = match setting.key {
            SettingKey::RawLine => {
                self.raw = setting.value == 1;
                SettingStatus::Accepted
            }
            SettingKey::Calibrate => {
                if self.calibration.replace(setting.seq) != Some(setting.seq) {
                    self.calibrations += 1;
                }
                SettingStatus::Accepted
            }
            _ => SettingStatus::NotHere,
        };
        self.answers.push(answer_to(&setting, status));
    }
}

impl Peer for SensorBoard {
    fn take(&mut self, byte: u8, now_us: u32) {
        match self.link.push(byte, now_us) {
            Some(BoardEvent::Up) => {
                self.ups += 1;
                self.answers.push(Payload::BoardStatus(BoardStatus {
                    reset: self.reset,
                    bad_packets: self.link.bad_packets(),
                    lost_packets: self.link.lost_packets(),
                    refused: 0,
                    exde_errors: 0,
                    servo_timeouts: 0,
                    load_percent: 42,
                    longest_loop_100us: 50,
                }));
            }
            Some(BoardEvent::Packet(packet)) => self.set(&packet),
            None => (),
        }
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        out.extend(self.link.poll(now_us).into_iter().flatten());
        while let Some(answer) = self.answers.pop() {
            out.extend(self.link.encode(answer).into_iter().flatten());
        }
        if now_us.wrapping_sub(self.due_us) > i32::MAX as u32 {
            return;
        }
        self.due_us = now_us + 10_000;
        self.flip_flop = !self.flip_flop;
        let packets = if self.flip_flop {
            let raw = Payload::RawLine(LineBits::new(self.bits));
            [self.raw.then_some(raw), Some(Payload::Line(self.state))]
        } else {
            [Some(Payload::Distance(Centimetres(self.distance))), None]
        };
        for payload in packets.into_iter().flatten() {
            out.extend(self.link.encode(payload).into_iter().flatten());
        }
    }
}
