//! The receiving end of one port: takes bytes, gives frames for the bus and events for the main
//! loop.
//!
//! It is pure and stands apart from the reading thread, so that the simulation in one process uses
//! the same rules: which board may send what, which epoch a frame belongs to, and what counts as
//! lost over all lives of the bridge. It never sends; it asks the main loop to send an answer.

use core::time::Duration;
use std::sync::atomic::Ordering;

use lager_orders::Moment;
use lager_topics::{DistanceFrame, LineFrame};
use lager_wire::link::{HostEvent, HostLink, LinkCounters, Up};
use lager_wire::{Callsign, Packet, Payload, Version};

use crate::counts::{self, Counts};
use crate::events::{BoardUp, PortEvent};
use crate::frames::LineAssembler;

/// Something that came from a port.
#[derive(Clone, Copy, Debug)]
pub enum Heard {
    /// For the main loop.
    Event(PortEvent),
    /// For `sensor/line`.
    Line(LineFrame),
    /// For `sensor/distance`.
    Distance(DistanceFrame),
}

/// The receiving end of one port.
#[derive(Debug)]
pub struct Listener {
    /// The port, 0 or 1.
    place: usize,
    link: HostLink,
    /// The sensor board's frames, while it is up.
    frames: Option<Frames>,
    /// How much of the present epoch's loss is already in the board's total.
    lost_told: u32,
}

/// Makes frames of the sensor board's packets.
#[derive(Debug)]
struct Frames {
    link_epoch: u32,
    lines: LineAssembler,
}

impl Listener {
    /// The end of the port at `place`, 0 or 1, before any byte.
    pub fn new(place: usize) -> Self {
        Self {
            place,
            link: HostLink::new(),
            frames: None,
            lost_told: 0,
        }
    }

    /// Takes a byte that was read at `at`.
    #[inline]
    pub fn push(&mut self, byte: u8, at: Moment, counts: &Counts) -> Option<Heard> {
        let event = self.link.push(byte, at.robot)?;
        self.take(event, at, counts)
    }

    /// Events that need no byte. Push all bytes that had come by `now` first, and call this until it
    /// returns nothing.
    pub fn poll(&mut self, now: Duration, counts: &Counts) -> Option<Heard> {
        let event = self.link.poll(now)?;
        // A packet never comes without a byte.
        self.take(event, Moment::default(), counts)
    }

    /// When [`Listener::poll`] next returns something, if no byte comes.
    pub fn next_due(&self) -> Duration {
        self.link.next_due()
    }

    /// Whether a board is up.
    pub const fn is_up(&self) -> bool {
        self.link.is_up()
    }

    /// The link's counters in its present epoch.
    pub fn health(&self) -> LinkCounters {
        self.link.health()
    }

    /// Adds the link's counters to `counts`.
    pub fn measure(&self, counts: &Counts) {
        let health = self.link.health();
        let meter = &counts.meters[self.place];
        meter.packets.store(health.packets, Ordering::Relaxed);
        meter.lost.store(health.lost, Ordering::Relaxed);
        let refused = health.bad_crc.wrapping_add(health.bad_content);
        meter.refused.store(refused, Ordering::Relaxed);
        meter
            .skipped_bytes
            .store(health.skipped_bytes, Ordering::Relaxed);
    }

    fn take(&mut self, event: HostEvent, at: Moment, counts: &Counts) -> Option<Heard> {
        Some(Heard::Event(match event {
            HostEvent::SendSyn => PortEvent::SendSyn,
            HostEvent::SendAck { up } => {
                let up = up.map(|up| self.come_up(up, counts));
                let version = self.link.version().unwrap_or(Version::One);
                PortEvent::SendAck { version, up }
            }
            HostEvent::Up(up) => PortEvent::Adopt(self.come_up(up, counts)),
            HostEvent::Silent => {
                self.frames = None;
                PortEvent::Silent
            }
            HostEvent::Packet(packet) => {
                self.add_loss(counts);
                return self.take_packet(&packet, at);
            }
        }))
    }

    /// Counts a new epoch of a board, over all lives of the bridge.
    fn come_up(&mut self, up: Up, counts: &Counts) -> BoardUp {
        // The link counts from 0 again.
        self.lost_told = 0;
        let epoch = &counts.epochs[usize::from(up.callsign == Callsign::Steering)];
        let before = epoch.fetch_add(1, Ordering::Relaxed);
        let link_epoch = before.wrapping_add(1);
        // A port that was opened again, or an earlier bridge, has seen it up before.
        let rebooted = up.rebooted || (up.fresh && before != 0);
        self.frames = (up.callsign == Callsign::Sensor).then(|| Frames {
            link_epoch,
            lines: LineAssembler::default(),
        });
        let up = Up { rebooted, ..up };
        BoardUp { up, link_epoch }
    }

    fn take_packet(&mut self, packet: &Packet, at: Moment) -> Option<Heard> {
        let event = match (self.link.callsign()?, packet.payload) {
            (Callsign::Sensor, Payload::RawLine(bits)) => {
                self.frames.as_mut()?.lines.raw(packet.id, bits);
                return None;
            }
            (Callsign::Sensor, Payload::Line(state)) => {
                let Frames { link_epoch, lines } = self.frames.as_mut()?;
                return Some(Heard::Line(lines.line(packet.id, state, *link_epoch)));
            }
            (Callsign::Sensor, Payload::Distance(distance)) => {
                return Some(Heard::Distance(DistanceFrame {
                    link_epoch: self.frames.as_ref()?.link_epoch,
                    distance_cm: distance.0,
                    packet_id: packet.id.get(),
                    ..DistanceFrame::default()
                }));
            }
            (Callsign::Sensor, Payload::LineReading(reading)) => PortEvent::Reading(reading),
            (Callsign::Steering, Payload::SteerData(data)) => PortEvent::Steer { data, at },
            (Callsign::Steering, Payload::ArmData(data)) => PortEvent::Arm(data),
            (_, Payload::BoardStatus(status)) => PortEvent::Status(status),
            (_, Payload::SettingReply(reply)) => PortEvent::Setting(reply),
            // Only the Pi sends these packets.
            _ => return None,
        };
        Some(Heard::Event(event))
    }

    /// Adds the losses that the link has found to the board's total. A link finds a loss when a
    /// packet comes, so no loss is forgotten when a new epoch begins.
    fn add_loss(&mut self, counts: &Counts) {
        let Some(board) = self.link.callsign().and_then(counts::index) else {
            return;
        };
        let lost = self.link.health().lost;
        let more = lost.wrapping_sub(self.lost_told);
        if more != 0 {
            counts.lost[board].fetch_add(more, Ordering::Relaxed);
            self.lost_told = lost;
        }
    }
}
