//! One thread for each serial port: reads, decodes, publishes the sensor board's frames, and passes
//! everything else to the main loop.
//!
//! It stands apart so that a sensor packet gets from the port to the bus without a second thread:
//! one `read`, the decoder, one loaned sample. It never writes to the port; it asks the main loop
//! to send an answer. Once a link is up it allocates nothing and holds no lock.
//!
//! ```text
//!          open                  gone (unplugged, hung up)
//!   away ---------> listening ----------------------------> away
//!    | ^
//!    +-+ cannot be opened: again after 20, 40, ... 250 ms, said once; or lent
//! ```
//!
//! A port that nobody has named is looked for ([`Source`]), and looked for again when its board has
//! been silent for 5 s, because its cable may be at another adapter by now.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use heapless::spsc::Producer;
use lager_home::Clock;
use lager_orders::Moment;
use lager_ports::{Bus, Cause, PortError, Publisher};
use lager_topics::{DistanceFrame, LineFrame, SensorDistance, SensorLine};
use lager_wake::Ringer;
use lager_wire::Callsign;

use crate::counts::Counts;
use crate::events::PortEvent;
use crate::listener::{Heard, Listener};
use crate::loan::Loan;
use crate::serial::{PortGone, SerialPort};
use crate::source::{NoPort, Source};

/// A reader's message to the main loop: an event, and with [`PortEvent::Opened`] the port, because
/// only the main loop writes.
pub(crate) type Handed = (PortEvent, Option<Arc<SerialPort>>);

/// How many events may wait for the main loop; a report comes every 5 ms.
pub(crate) const QUEUE: usize = 64;

/// Longest wait for bytes in real time. The reader checks the stop flag that often.
const LOOK: Duration = Duration::from_millis(100);

/// The first pause between attempts to open a port, in real time.
const FIRST_PAUSE: Duration = Duration::from_millis(20);

/// Pause between attempts to make the sensor topics' publishers, in ns.
const PUBLISHER_PAUSE_NS: u64 = 200_000_000;

/// The reader of one port; lives in its thread.
pub(crate) struct Reader<'a> {
    place: usize,
    source: Source<'a>,
    baud: u32,
    bus: &'a Bus,
    clock: Clock,
    events: Producer<'a, Handed>,
    ringer: Ringer,
    counts: &'a Counts,
    /// Set when the readers are to end.
    end: &'a AtomicBool,
    loan: &'a Loan<'a>,
    sensor: SensorOut,
}

/// Publishes the sensor board's frames. Its publishers stay when the board restarts, so that
/// observers keep their counts.
#[derive(Default)]
struct SensorOut {
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
        (source, baud): (Source<'a>, u32),
        bus: &'a Bus,
        events: Producer<'a, Handed>,
        ringer: Ringer,
        (counts, end, loan): (&'a Counts, &'a AtomicBool, &'a Loan<'a>),
    ) -> Self {
        Self {
            place,
            source,
            baud,
            bus,
            clock: bus.clock(),
            events,
            ringer,
            counts,
            end,
            loan,
            sensor: SensorOut::default(),
        }
    }

    /// Opens the port, listens, and opens it again, until the stop flag is set.
    pub(crate) fn run(mut self) {
        let mut pause = FIRST_PAUSE;
        let mut complaint = None;
        while !self.stopped() {
            if self.loan.is_lent() {
                pause = FIRST_PAUSE;
                self.sleep(pause);
                continue;
            }
            let goes_on = || !self.stopped() && !self.loan.is_lent();
            match self.source.open(self.baud, &self.clock, goes_on) {
                // Somebody wants the port, or the bridge ends.
                _ if !goes_on() => continue,
                Ok(port) => {
                    // The span lasts as long as the port is there. No frame is traced.
                    let link = tracing::info_span!("link", port = %port.path().display());
                    let _link = link.entered();
                    tracing::info!(
                        port = %port.path().display(),
                        baud = self.baud,
                        low_latency = port.is_low_latency(),
                        "serial port opened"
                    );
                    complaint = None;
                    pause = FIRST_PAUSE;
                    let port = Arc::new(port);
                    self.hand((PortEvent::Opened, Some(Arc::clone(&port))));
                    self.ringer.ring();
                    if let Err(gone) = self.listen(&port) {
                        tracing::warn!("the serial port {}: {gone}", port.path().display());
                    }
                    self.sensor = SensorOut::default();
                    self.hand((PortEvent::Lost, None));
                    self.ringer.ring();
                }
                Err(error) => self.complain(&mut complaint, error),
            }
            self.sleep(pause);
            pause = (pause * 2).min(self.source.longest_pause());
        }
    }

    /// Logs once why the port cannot be opened, and again when the reason changes.
    fn complain(&self, complaint: &mut Option<NoPort>, error: NoPort) {
        if complaint.as_ref() != Some(&error) {
            tracing::warn!("{error}");
            *complaint = Some(error);
        }
    }

    /// Reads until the port has gone, is lent or has to be looked for again, or the bridge stops.
    fn listen(&mut self, port: &SerialPort) -> Result<(), PortGone> {
        let mut listener = Listener::new(self.place);
        let mut buffer = [0; 512];
        // The moment up to which all bytes were read. A board counts as silent only up to such a
        // moment: a reader that could not run finds the bytes first and then the time.
        let mut heard = self.clock.now();
        let mut last_up = heard;
        while !self.stopped() && !self.loan.is_lent() {
            if listener.is_up() {
                last_up = heard;
            } else if self.source.gives_up(heard.saturating_sub(last_up)) {
                return Ok(());
            }
            let mut ring = false;
            while let Some(what) = listener.poll(heard, self.counts) {
                ring |= self.take(what, 0);
            }
            if ring {
                self.ringer.ring();
            }
            self.sensor.catch_up();
            let now = self.clock.now();
            let due = self.clock.real(listener.next_due().saturating_sub(now));
            let count = port.read(&mut buffer, due.min(LOOK))?;
            let ns = Clock::monotonic_ns();
            if count < buffer.len() {
                heard = now;
            }
            if count == 0 {
                continue;
            }
            let at = Moment {
                robot: self.clock.at(ns),
                ns,
            };
            let mut ring = false;
            for byte in &buffer[..count] {
                if let Some(what) = listener.push(*byte, at, self.counts) {
                    ring |= self.take(what, ns);
                }
            }
            listener.measure(self.counts);
            if ring {
                self.ringer.ring();
            }
        }
        Ok(())
    }

    /// Handles what was heard. Returns whether the main loop has something to do now.
    fn take(&mut self, heard: Heard, at_ns: u64) -> bool {
        match heard {
            Heard::Event(event) if event.is_repeated() => {
                offer(&mut self.events, event, &self.counts.dropped);
                true
            }
            Heard::Event(event) => {
                match event {
                    PortEvent::SendAck { up: Some(up), .. } | PortEvent::Adopt(up) => {
                        self.sensor.board_up(up.up.callsign);
                    }
                    PortEvent::Silent => self.sensor = SensorOut::default(),
                    _ => {}
                }
                self.hand((event, None));
                true
            }
            Heard::Line(frame) => {
                self.sensor.line(self.bus, frame, at_ns);
                false
            }
            Heard::Distance(frame) => {
                self.sensor.distance(self.bus, frame, at_ns);
                false
            }
        }
    }

    /// Passes on an event that must not be lost; waits while the main loop is behind.
    fn hand(&mut self, mut event: Handed) {
        while let Err(refused) = self.events.enqueue(event) {
            if self.stopped() {
                return;
            }
            event = refused;
            self.ringer.ring();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn stopped(&self) -> bool {
        self.end.load(Ordering::Acquire)
    }

    /// Sleeps, but wakes for the stop flag, and for devices that come or go if the port is one of them.
    fn sleep(&self, pause: Duration) {
        let devices = self.source.devices();
        let mut left = pause;
        while !left.is_zero() && !self.stopped() && devices == self.source.devices() {
            let step = left.min(LOOK);
            std::thread::sleep(step);
            left -= step;
        }
    }
}

/// Passes on data that may be lost if the main loop hangs, because the next report repeats it. Lost
/// data is counted.
fn offer(events: &mut Producer<'_, Handed>, event: PortEvent, dropped: &AtomicU32) {
    if events.enqueue((event, None)).is_err() {
        dropped.fetch_add(1, Ordering::Relaxed);
    }
}

impl SensorOut {
    /// A board has come up. The sensor board's publishers stay if it was here before.
    fn board_up(&mut self, board: Callsign) {
        let ports = self.ports.take();
        *self = Self {
            ports: ports.filter(|_| board == Callsign::Sensor),
            ..Self::default()
        };
    }

    fn line(&mut self, bus: &Bus, frame: LineFrame, at_ns: u64) {
        self.make_ports(bus, at_ns);
        let Some(ports) = &self.ports else {
            return;
        };
        let sent = ports.line.loan().and_then(|mut loan| {
            *loan = frame;
            loan.cause(Cause::event(at_ns));
            loan.send_ahead()
        });
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    fn distance(&mut self, bus: &Bus, frame: DistanceFrame, at_ns: u64) {
        self.make_ports(bus, at_ns);
        let Some(ports) = &self.ports else {
            return;
        };
        let sent = ports.distance.loan().and_then(|mut loan| {
            *loan = frame;
            loan.cause(Cause::event(at_ns));
            loan.send_ahead()
        });
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    /// Copies the frames of the last read to observers. Earlier, this would have delayed the frames
    /// after them.
    fn catch_up(&mut self) {
        let Some(ports) = &self.ports else {
            return;
        };
        let sent = ports.line.catch_up().and(ports.distance.catch_up());
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
            tracing::error!("the sensor board's frames cannot be published: {error}");
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
        let mut queue: Queue<Handed, QUEUE> = Queue::new();
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
