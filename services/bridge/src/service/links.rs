//! The links' side of the main loop: what the readers bring, and boards that come and go.

use lager_ports::Cause;
use lager_wire::link::HostTransmitter;
use lager_wire::{Callsign, SettingKey, SettingReply, SettingStatus, SteerData, Version};

use super::Core;
use crate::frames::ServoTable;
use crate::reader::{BoardUp, PortEvent};
use crate::serial::PacketWriter;

impl Core<'_> {
    /// Takes what the readers have brought.
    pub(super) fn take_events(&mut self) {
        for place in 0..self.ports.len() {
            while let Some(event) = self.ports[place].events.dequeue() {
                self.take(place, event);
            }
        }
    }

    fn take(&mut self, place: usize, event: PortEvent) {
        match event {
            PortEvent::Opened(device) => {
                let port = &mut self.ports[place];
                port.device = Some(device);
                port.writer = PacketWriter::default();
                port.transmitter = HostTransmitter::new();
            }
            PortEvent::Lost => {
                self.board_down(place);
                self.boards.gone(place);
                self.ports[place].device = None;
                self.publish_health(self.clock.now());
            }
            PortEvent::SendSyn => {
                let syn = self.ports[place].transmitter.syn();
                self.write(place, &syn);
            }
            PortEvent::SendAck { version, up } => {
                let ack = self.ports[place].transmitter.ack(version);
                self.write(place, &ack);
                if let Some(up) = up {
                    self.board_up(place, &up);
                }
            }
            PortEvent::Adopt(up) => {
                self.ports[place].transmitter.adopt(up.up.version);
                self.board_up(place, &up);
            }
            PortEvent::Silent => {
                // What still waits in the driver would be old when it is sent.
                if let Some(device) = &self.ports[place].device {
                    device.discard_output();
                }
                self.ports[place].writer = PacketWriter::default();
                tracing::warn!(
                    "the board on {} has fallen silent",
                    self.config.ports[place].display()
                );
                self.board_down(place);
                self.publish_health(self.clock.now());
            }
            PortEvent::Steer { data, at_ns } => self.take_report(place, data, at_ns),
            PortEvent::Arm(data) => self.servos.hear(&data),
            PortEvent::Status(status) => self.boards.status(place, &status),
            PortEvent::Setting(reply) => {
                if self.settings.answer(&reply) {
                    // Before the request is answered: a gain in force outlives this bridge.
                    self.publish_health(self.clock.now());
                } else if reply.key == SettingKey::Calibrate {
                    calibrated(&reply);
                }
            }
        }
    }

    fn board_up(&mut self, place: usize, board: &BoardUp) {
        let now = self.clock.now();
        let up = board.up;
        // A steering board that was on this port is not there any more.
        if up.callsign != Callsign::Steering {
            self.board_down(place);
        }
        self.boards.up(place, self.config.baud, board);
        self.settings.board_up(now, up.callsign);
        if up.callsign == Callsign::Steering {
            self.report = None;
            self.servos = ServoTable::default();
            self.arbiter.board_up(now, up.version, up.rebooted);
        }
        tracing::info!(
            port = %self.config.ports[place].display(),
            version = ?up.version,
            epoch = board.link_epoch,
            reset = ?up.reset,
            "the {} board {}",
            if up.callsign == Callsign::Steering { "steering" } else { "sensor" },
            if up.rebooted { "has restarted" } else { "is up" },
        );
        self.publish_health(now);
    }

    fn board_down(&mut self, place: usize) {
        if self.boards.down(place) == Some(Callsign::Steering) {
            self.arbiter.board_down();
            self.report = None;
        }
    }

    fn take_report(&mut self, place: usize, data: SteerData, at_ns: u64) {
        if self.boards.place(Callsign::Steering) != Some(place) {
            return;
        }
        if self.boards.version(Callsign::Steering) == Some(Version::One) {
            self.arbiter.observe(self.clock.now(), &data);
            self.report = Some(data);
            let at_rest = data.left_duty == 0 && data.right_duty == 0;
            if let Some((writes @ 1.., rest)) = &mut self.parking {
                *rest = at_rest && *writes > 0;
            }
        }
        self.publish_state(Cause::event(at_ns));
    }
}

/// Says how a calibration has ended: the sensor board answers once when it begins, with the value
/// 1, and once when it ends, with the number of sensors that have seen both floor and tape.
fn calibrated(reply: &SettingReply) {
    match (reply.status, reply.value) {
        (SettingStatus::Accepted, 1) => (),
        (SettingStatus::Accepted, _) => tracing::info!("the line sensors are calibrated"),
        (_, sensors) => tracing::warn!(
            "only {sensors} of the line sensors have seen both floor and tape; the others keep \
             their thresholds: calibrate again and move the robot over the tape meanwhile"
        ),
    }
}
