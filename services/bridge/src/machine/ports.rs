//! The events of the ports: boards that come, report, answer and go.
//!
//! They stand apart from the turn because each event has its effect at once, whatever else the turn
//! brings.

use lager_orders::Moment;
use lager_topics::{ProfileState, StopCause};
use lager_wire::link::HostTransmitter;
use lager_wire::{Callsign, SettingKey, SettingReply, SteerData, Version};

use super::effect::{Notice, ShownReport};
use super::{BridgeCore, Handshake, REPORT_PERIOD};
use crate::events::{BoardUp, PortEvent};
use crate::frames::ServoTable;
use crate::profile::States;

impl BridgeCore {
    /// Takes what has happened at the port at `place`, 0 or 1.
    pub fn port(&mut self, now: Moment, place: usize, event: PortEvent) {
        self.wake(now.robot);
        match event {
            PortEvent::Opened => self.transmitters[place] = HostTransmitter::new(),
            PortEvent::Lost => {
                self.board_down(place);
                self.boards.gone(place);
                self.due.health = true;
            }
            PortEvent::SendSyn => self.due.handshake[place] = Some(Handshake::Syn),
            PortEvent::SendAck { version, up } => {
                self.due.handshake[place] = Some(Handshake::Ack(version));
                if let Some(up) = up {
                    self.board_up(now, place, &up);
                }
            }
            PortEvent::Adopt(up) => {
                self.transmitters[place].adopt(up.up.version);
                self.board_up(now, place, &up);
            }
            PortEvent::Silent => {
                self.due.discard[place] = true;
                // `link/health` tells it to everybody.
                self.say(Notice::Silent { place });
                self.board_down(place);
                self.due.health = true;
            }
            PortEvent::Steer { data, at } => self.report(place, data, at),
            PortEvent::Arm(data) => self.servos.hear(&data),
            PortEvent::Status(status) => self.boards.status(place, &status),
            PortEvent::Setting(reply) => self.setting_answered(now, &reply),
            PortEvent::Reading(reading) => self.calibration.hear_reading(&reading),
        }
    }

    /// Keeps wheels and arm still unless the boards have accepted their profiles, and reports what
    /// the boards say.
    pub(super) fn heed_profiles(&mut self, before: States) {
        let profiles = &self.profiles;
        self.arbiter.set_gates(profiles.wheels(), profiles.arm());
        let states = profiles.states();
        let changed = states.into_iter().zip(before);
        for ((part, state), _) in changed.filter(|(now, before)| now != before) {
            if !matches!(state, ProfileState::NoBoard | ProfileState::Telling) {
                self.say(Notice::Profile(part, state));
                self.due.health = true;
            }
        }
    }

    fn board_up(&mut self, now: Moment, place: usize, board: &BoardUp) {
        let up = board.up;
        // If a steering board was on this port, it has gone.
        if up.callsign != Callsign::Steering {
            self.board_down(place);
        }
        self.boards.up(place, self.options.baud, board);
        self.settings.board_up(now.robot, up.callsign);
        let before = self.profiles.states();
        self.profiles.board_up(now.robot, &up);
        self.heed_profiles(before);
        if up.callsign == Callsign::Sensor && up.rebooted {
            self.calibration.break_off();
        }
        if up.callsign == Callsign::Steering {
            self.report = None;
            self.servos = ServoTable::default();
            self.arbiter.board_up(now.robot, up.version, up.rebooted);
            if up.version == Version::Original && !self.options.original_boards {
                self.say(Notice::OriginalBoard { place });
            }
        }
        if up.rebooted && self.resets.note(now.robot, up.callsign) {
            self.say(Notice::KeepsResetting(up.callsign));
            self.due.stop = Some(StopCause::BoardResets);
        }
        let board = *board;
        self.say(Notice::Up { place, board });
        self.due.health = true;
    }

    fn board_down(&mut self, place: usize) {
        let board = self.boards.down(place);
        if let Some(board) = board {
            let before = self.profiles.states();
            self.profiles.board_down(board);
            self.heed_profiles(before);
        }
        match board {
            Some(Callsign::Steering) => {
                self.arbiter.board_down();
                self.report = None;
            }
            Some(Callsign::Sensor) => self.calibration.break_off(),
            _ => {}
        }
    }

    fn report(&mut self, place: usize, data: SteerData, at: Moment) {
        if self.boards.place(Callsign::Steering) != Some(place) {
            return;
        }
        self.arbiter.observe(at.robot, &data);
        if self.boards.version(Callsign::Steering) == Some(Version::One) {
            self.report = Some((data, at));
            self.told.report = false;
            let duties = [data.left_duty, data.right_duty];
            self.due.shown = Some(ShownReport {
                at_ns: at.ns,
                duties,
                proves_rest: self.rest.report(&data, at.ns),
            });
            if let Some(parking) = &mut self.parking
                && parking.standbys > 0
            {
                parking.at_rest = duties == [0, 0];
            }
        }
        self.due.state = Some(at.ns);
        self.arbiter.resend_early(at.robot, REPORT_PERIOD);
        if self.health_due <= at.robot + REPORT_PERIOD {
            self.health_due = self.health_due.min(at.robot);
        }
    }

    fn setting_answered(&mut self, now: Moment, reply: &SettingReply) {
        let before = self.profiles.states();
        if self.profiles.answer(now.robot, reply) {
            self.heed_profiles(before);
        } else if self.settings.answer(reply) {
            // Publish before the answer: a gain in force outlives this bridge.
            self.due.health = true;
        } else if reply.key == SettingKey::Calibrate {
            self.calibration.hear(reply);
            self.due.health = true;
        }
    }
}
