//! One thread per serial port: reads, decodes, publishes what the sensor board sees, and hands
//! the rest to the main loop.
//!
//! It is apart so that a sensor packet goes from the port to the bus without a second thread: one
//! `read`, the decoder, one loaned sample. It never writes to the port; what has to be answered
//! it asks the main loop to send. After start-up of a link it does not allocate, and it holds no
//! lock.
//!
//! ```text
//!          open                  gone (unplugged, hung up)
//!   away ---------> listening ----------------------------> away
//!    | ^
//!    +-+ cannot be opened: again after 20, 40, ... 250 ms, said once
//! ```

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use heapless::spsc::Producer;
use lager_ports::{Bus, Cause, Clock, PortError, Publisher, Ringer};
use lager_topics::{DistanceFrame, SensorDistance, SensorLine};
use lager_wire::link::{HostEvent, HostLink, Up};
use lager_wire::{
    ArmData, BoardStatus, Callsign, Packet, Payload, SettingReply, SteerData, Version,
};

use crate::boards;
use crate::frames::LineAssembler;
use crate::serial::{OpenPortError, PortGone, SerialPort};

/// What a reader tells the main loop.
#[derive(Debug)]
pub(crate) enum PortEvent {
    /// The port is open; writing is the main loop's business.
    Opened(Arc<SerialPort>),
    /// The port has gone.
    Lost,
    /// The board must be asked who it is.
    SendSyn,
    /// The board's SYN must be answered.
    SendAck {
        version: Version,
        up: Option<BoardUp>,
    },
    /// An original board was found running.
    Adopt(BoardUp),
    /// The board has fallen silent.
    Silent,
    /// A report of the steering board, read at `at_ns` of `CLOCK_MONOTONIC`.
    Steer { data: SteerData, at_ns: u64 },
    /// A servo's state.
    Arm(ArmData),
    /// A board's own counters.
    Status(BoardStatus),
    /// A board's answer to a setting.
    Setting(SettingReply),
}

/// A board that has come up, in the bridge's own count of epochs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoardUp {
    pub(crate) up: Up,
    pub(crate) link_epoch: u32,
}

/// Counters of one port's link, written by its reader and read by the main loop.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    pub(crate) packets: AtomicU32,
    pub(crate) lost: AtomicU32,
    pub(crate) refused: AtomicU32,
    pub(crate) skipped_bytes: AtomicU32,
}

/// What both readers share.
#[derive(Debug, Default)]
pub(crate) struct Shared {
    /// One per port.
    pub(crate) meters: [Meter; 2],
    /// The present link epoch of each board: sensor, steering. Grows over the bridge's lives.
    pub(crate) epochs: [AtomicU32; 2],
    /// Packets each board's links have missed: sensor, steering. Grows over the bridge's lives,
    /// unlike a meter's count, which begins at 0 with each epoch.
    pub(crate) lost: [AtomicU32; 2],
    /// Board data dropped because the main loop was behind.
    pub(crate) dropped: AtomicU32,
    /// Set when the readers are to end.
    pub(crate) stop: AtomicBool,
}

/// How many events may wait for the main loop; a report comes every 5 ms.
pub(crate) const QUEUE: usize = 64;

/// Longest wait for bytes in real time: the reader looks for the stop flag that often.
const LOOK: Duration = Duration::from_millis(100);

/// Pauses between attempts to open a port, in real time.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
const LONGEST_PAUSE: Duration = Duration::from_millis(250);

/// Pause between attempts to make the sensor topics' publishers, in ns.
const PUBLISHER_PAUSE_NS: u64 = 200_000_000;

/// The reader of one port; lives in its thread.
pub(crate) struct Reader<'a> {
    place: usize,
    path: &'a Path,
    baud: u32,
    bus: &'a Bus,
    clock: Clock,
    events: Producer<'a, PortEvent>,
    ringer: Ringer,
    shared: &'a Shared,
    sensor: Option<SensorOut>,
    /// How much of the present epoch's loss has been added to the board's total.
    lost_told: u32,
}

/// The sensor board's way to the bus.
struct SensorOut {
    link_epoch: u32,
    lines: LineAssembler,
    ports: Option<SensorPorts>,
    next_attempt_ns: u64,
    complained: bool,
}

struct SensorPorts {
    line: Publisher<SensorLine>,
    distance: Publisher<SensorDistance>,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(
        place: usize,
        (path, baud): (&'a Path, u32),
        bus: &'a Bus,
        events: Producer<'a, PortEvent>,
        ringer: Ringer,
        shared: &'a Shared,
    ) -> Self {
        Self {
            place,
            path,
            baud,
            bus,
            clock: bus.clock(),
            events,
            ringer,
            shared,
            sensor: None,
            lost_told: 0,
        }
    }

    /// Opens, listens, and opens again, until the stop flag is set.
    pub(crate) fn run(mut self) {
        let mut pause = FIRST_PAUSE;
        let mut complaint = None;
        while !self.stopped() {
            match SerialPort::open(self.path, self.baud) {
                Ok(port) => {
                    tracing::info!(
                        port = %self.path.display(),
                        baud = self.baud,
                        low_latency = port.is_low_latency(),
                        "serial port opened"
                    );
                    complaint = None;
                    pause = FIRST_PAUSE;
                    let port = Arc::new(port);
                    self.hand(PortEvent::Opened(Arc::clone(&port)));
                    self.ringer.ring();
                    if let Err(gone) = self.listen(&port) {
                        tracing::warn!("the serial port {}: {gone}", self.path.display());
                    }
                    self.sensor = None;
                    self.hand(PortEvent::Lost);
                    self.ringer.ring();
                }
                Err(error) => self.complain(&mut complaint, error),
            }
            self.sleep(pause);
            pause = (pause * 2).min(LONGEST_PAUSE);
        }
    }

    /// Says once what keeps the port from being opened, and again when it is something else.
    fn complain(&self, complaint: &mut Option<OpenPortError>, error: OpenPortError) {
        if complaint.as_ref() != Some(&error) {
            tracing::warn!("{error}");
            *complaint = Some(error);
        }
    }

    /// Reads until the port has gone or the bridge stops.
    fn listen(&mut self, port: &SerialPort) -> Result<(), PortGone> {
        let mut link = HostLink::new();
        self.lost_told = 0;
        let mut buffer = [0; 512];
        // When all that had come by then was read: only as of such a moment a board is silent. A
        // reader that was kept from running finds the bytes first and then the time.
        let mut heard = self.clock.now();
        while !self.stopped() {
            let mut ring = false;
            while let Some(event) = link.poll(heard) {
                ring |= self.take(&link, event, 0);
            }
            if ring {
                self.ringer.ring();
            }
            let now = self.clock.now();
            let due = self.clock.real(link.next_due().saturating_sub(now));
            let count = port.read(&mut buffer, due.min(LOOK))?;
            let at_ns = Clock::monotonic_ns();
            if count < buffer.len() {
                heard = now;
            }
            if count == 0 {
                continue;
            }
            let now = self.clock.at(at_ns);
            let mut ring = false;
            for byte in &buffer[..count] {
                if let Some(event) = link.push(*byte, now) {
                    ring |= self.take(&link, event, at_ns);
                }
            }
            self.measure(&link);
            if ring {
                self.ringer.ring();
            }
        }
        Ok(())
    }

    /// Deals with one event of the link; whether the main loop has something to do now.
    fn take(&mut self, link: &HostLink, event: HostEvent, at_ns: u64) -> bool {
        match event {
            HostEvent::SendSyn => self.hand(PortEvent::SendSyn),
            HostEvent::SendAck { up } => {
                let up = up.map(|up| self.come_up(up));
                let version = link.version().unwrap_or(Version::One);
                self.hand(PortEvent::SendAck { version, up });
            }
            HostEvent::Up(up) => {
                let up = self.come_up(up);
                self.hand(PortEvent::Adopt(up));
            }
            HostEvent::Silent => {
                self.sensor = None;
                self.hand(PortEvent::Silent);
            }
            HostEvent::Packet(packet) => {
                self.add_loss(link);
                return self.take_packet(link, &packet, at_ns);
            }
        }
        true
    }

    /// Counts a new epoch of a board, over all lives of the bridge.
    fn come_up(&mut self, up: Up) -> BoardUp {
        // The link counts from 0 again.
        self.lost_told = 0;
        let epoch = &self.shared.epochs[usize::from(up.callsign == Callsign::Steering)];
        let link_epoch = epoch.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        // The publishers stay through a reboot of the board, so that observers keep their count.
        let earlier = self.sensor.take().and_then(|sensor| sensor.ports);
        if up.callsign == Callsign::Sensor {
            self.sensor = Some(SensorOut {
                link_epoch,
                lines: LineAssembler::default(),
                ports: earlier,
                next_attempt_ns: 0,
                complained: false,
            });
        }
        BoardUp { up, link_epoch }
    }

    fn take_packet(&mut self, link: &HostLink, packet: &Packet, at_ns: u64) -> bool {
        let event = match (link.callsign(), packet.payload) {
            (
                Some(Callsign::Sensor),
                Payload::RawLine(_) | Payload::Line(_) | Payload::Distance(_),
            ) => {
                if let Some(sensor) = &mut self.sensor {
                    sensor.take(self.bus, packet, at_ns);
                }
                return false;
            }
            (Some(Callsign::Steering), Payload::SteerData(data)) => {
                PortEvent::Steer { data, at_ns }
            }
            (Some(Callsign::Steering), Payload::ArmData(data)) => PortEvent::Arm(data),
            (Some(_), Payload::BoardStatus(status)) => PortEvent::Status(status),
            (Some(_), Payload::SettingReply(reply)) => PortEvent::Setting(reply),
            // A board does not send what is the Pi's to send.
            _ => return false,
        };
        offer(&mut self.events, event, &self.shared.dropped);
        true
    }

    /// Adds to the board's total what its link has found missing. A link finds that out with a
    /// packet, so nothing is forgotten when it begins a new epoch.
    fn add_loss(&mut self, link: &HostLink) {
        let Some(board) = link.callsign().and_then(boards::index) else {
            return;
        };
        let lost = link.health().lost;
        let more = lost.wrapping_sub(self.lost_told);
        if more != 0 {
            self.shared.lost[board].fetch_add(more, Ordering::Relaxed);
            self.lost_told = lost;
        }
    }

    /// Hands over what must not be lost; waits while the main loop is behind.
    fn hand(&mut self, event: PortEvent) {
        let mut event = event;
        while let Err(refused) = self.events.enqueue(event) {
            if self.stopped() {
                return;
            }
            event = refused;
            self.ringer.ring();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn measure(&self, link: &HostLink) {
        let health = link.health();
        let meter = &self.shared.meters[self.place];
        meter.packets.store(health.packets, Ordering::Relaxed);
        meter.lost.store(health.lost, Ordering::Relaxed);
        let refused = health.bad_crc.wrapping_add(health.bad_content);
        meter.refused.store(refused, Ordering::Relaxed);
        meter
            .skipped_bytes
            .store(health.skipped_bytes, Ordering::Relaxed);
    }

    fn stopped(&self) -> bool {
        self.shared.stop.load(Ordering::Acquire)
    }

    /// Sleeps, but not past the stop flag.
    fn sleep(&self, pause: Duration) {
        let mut left = pause;
        while !left.is_zero() && !self.stopped() {
            let step = left.min(LOOK);
            std::thread::sleep(step);
            left -= step;
        }
    }
}

/// Hands over data that may be dropped when the main loop is stuck, since the next report repeats
/// it; what is dropped is counted.
fn offer(events: &mut Producer<'_, PortEvent>, event: PortEvent, dropped: &AtomicU32) {
    if events.enqueue(event).is_err() {
        dropped.fetch_add(1, Ordering::Relaxed);
    }
}

impl SensorOut {
    /// Publishes one packet of the sensor board.
    fn take(&mut self, bus: &Bus, packet: &Packet, at_ns: u64) {
        if let Payload::RawLine(bits) = packet.payload {
            self.lines.raw(packet.id, bits);
            return;
        }
        self.make_ports(bus, at_ns);
        let Some(ports) = &self.ports else {
            return;
        };
        let sent = match packet.payload {
            Payload::Line(state) => ports.line.loan().and_then(|mut loan| {
                *loan = self.lines.line(packet.id, state, self.link_epoch);
                loan.cause(Cause::event(at_ns));
                loan.send()
            }),
            Payload::Distance(distance) => ports.distance.loan().and_then(|mut loan| {
                *loan = DistanceFrame {
                    link_epoch: self.link_epoch,
                    distance_cm: distance.0,
                    packet_id: packet.id.get(),
                    ..DistanceFrame::default()
                };
                loan.cause(Cause::event(at_ns));
                loan.send()
            }),
            _ => return,
        };
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    /// Makes the publishers when they are first needed.
    fn make_ports(&mut self, bus: &Bus, at_ns: u64) {
        if self.ports.is_some() || at_ns < self.next_attempt_ns {
            return;
        }
        match SensorPorts::new(bus) {
            Ok(ports) => self.ports = Some(ports),
            Err(error) => {
                self.next_attempt_ns = at_ns + PUBLISHER_PAUSE_NS;
                self.complain(&error);
            }
        }
    }

    fn complain(&mut self, error: &dyn std::error::Error) {
        if !self.complained {
            self.complained = true;
            tracing::error!("what the sensor board sends cannot be published: {error}");
        }
    }
}

impl SensorPorts {
    fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            line: bus.publisher()?,
            distance: bus.publisher()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use heapless::spsc::Queue;

    use super::*;

    #[test]
    fn data_for_a_main_loop_that_is_behind_is_dropped_and_counted() {
        let mut queue: Queue<PortEvent, QUEUE> = Queue::new();
        let (mut events, mut taken) = queue.split();
        let dropped = AtomicU32::new(0);
        // The queue holds one less than its size.
        for _ in 0..QUEUE + 2 {
            offer(&mut events, PortEvent::Silent, &dropped);
        }
        assert_eq!(dropped.load(Ordering::Relaxed), 3);
        assert!(taken.dequeue().is_some());
        offer(&mut events, PortEvent::Silent, &dropped);
        assert_eq!(dropped.load(Ordering::Relaxed), 3);
    }
}
