//! Carrying out what the core wants: writing, publishing, and the stop word.
//!
//! It is apart from the turn because everything here has an effect outside this process.

use lager_ports::{Cause, Clock, Release, Stop};
use lager_wire::{Callsign, PACKET_LENGTH, Version};

use super::Service;
use crate::events::Moment;
use crate::machine::{Action, Write};
use crate::serial::{PacketWriter, Sent};

impl Service<'_> {
    /// Does what there is to do, one action after the other, and looks at the stop word before each
    /// and after the last.
    /// Each is decided upon at the moment of its own: what was decided before this process was
    /// frozen is not done after it.
    pub(super) fn act(&mut self) {
        loop {
            if let Some(stop) = self.page.news() {
                self.obey(stop);
            }
            let now = self.moment();
            match self.core.next(now) {
                Some(action) => self.carry_out(action, now),
                None => return,
            }
        }
    }

    /// Tells those who wait for a stop that this loop turns, and which boards it has.
    pub(super) fn answer_stoppers(&self, now_ns: u64) {
        let version = |board| match self.core.version(board) {
            Some(Version::Original) => Some(0),
            Some(Version::One) => Some(1),
            None => None,
        };
        let page = &self.page;
        page.boards(version(Callsign::Sensor), version(Callsign::Steering));
        page.turn(now_ns);
    }

    /// Publishes how long orders took to the wire.
    pub(super) fn publish_latency(&mut self) {
        let sent = self.latency.send(Cause::OWN, *self.meter.counted());
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    fn carry_out(&mut self, action: Action, now: Moment) {
        match action {
            Action::Discard { place } => self.discard(place),
            Action::Write(write) => self.write(&write),
            Action::PublishHealth { rings } => self.publish_health(now, rings),
            Action::PublishState { report_ns } => self.publish_state(now, report_ns),
            Action::ShowReport(shown) => {
                self.page.report(shown.at_ns, shown.duties);
                if shown.proves_rest {
                    self.page.rest(shown.at_ns);
                }
            }
            // Seen at the next look at the word.
            Action::Stop(cause) => self.page.stop(cause),
            Action::Release(stop) => self.release(stop),
            Action::Say(news) => self.say(&news),
        }
    }

    /// Hands a stop to the core before anything else is done.
    #[cold]
    fn obey(&mut self, stop: Stop) {
        self.page.heed(stop, Clock::monotonic_ns());
        self.core.stop(stop);
        tracing::warn!("stopped {stop}; a resume releases it");
    }

    /// Releases this stop; one that was set meanwhile holds.
    fn release(&mut self, stop: Stop) {
        match self.page.release(stop) {
            Release::NotStopped => self.core.released(true),
            Release::Done(stop) => {
                tracing::info!("resumed; it was stopped {stop}");
                self.core.released(true);
            }
            Release::Newer(stop) => {
                self.obey(stop);
                self.core.released(false);
            }
        }
    }

    /// Throws away what waits in the driver.
    fn discard(&mut self, place: usize) {
        let port = &mut self.ports[place];
        if let Some(device) = &port.device {
            device.discard_output();
        }
        port.writer = PacketWriter::default();
    }

    fn write(&mut self, write: &Write) {
        let is_taken = self.put(write.place, &write.packet);
        if write.command.is_none() {
            return;
        }
        let now = self.moment();
        self.core.wrote(write, is_taken, now);
        if is_taken
            && let Some(key) = write.order
            && self.meter.is_waiting_for(key)
        {
            self.meter.written(now.ns);
        }
    }

    /// Writes one packet; whether the driver has taken it.
    fn put(&mut self, place: usize, packet: &[u8; PACKET_LENGTH]) -> bool {
        let port = &mut self.ports[place];
        let Some(device) = &port.device else {
            return false;
        };
        // The reader finds out that a port has gone.
        matches!(
            port.writer.write(device, packet),
            Ok(Sent::Whole | Sent::Partly)
        )
    }

    fn publish_health(&mut self, now: Moment, rings: bool) {
        let dropped = u64::from(self.counts.dropped());
        let lost = self.lost_before + self.orders.lost() + self.inputs.lost() + dropped;
        let sent = self.health.loan().and_then(|mut loan| {
            self.core.fill_health(now.robot, self.counts, &mut loan);
            loan.bus_lost = lost;
            if rings {
                loan.send()
            } else {
                loan.send_quietly()
            }
        });
        match sent {
            Ok(()) => self.core.health_told(),
            Err(error) => self.complain(&error),
        }
    }

    fn publish_state(&mut self, now: Moment, report_ns: Option<u64>) {
        let sent = self.state.loan().and_then(|mut loan| {
            self.core.fill_state(now.robot, &mut loan);
            loan.cause(report_ns.map_or(Cause::OWN, Cause::event));
            let shown = *loan;
            if self.core.is_news(&shown) {
                loan.send()?;
            } else {
                loan.send_quietly()?;
            }
            Ok(shown)
        });
        match sent {
            Ok(shown) => self.core.state_told(&shown),
            Err(error) => self.complain(&error),
        }
    }
}
