//! Carries out the core's actions: writes, publishes, and sets or clears the stop word.
//!
//! It stands apart from the turn because everything here has an effect outside this process.

use lager_home::Clock;
use lager_orders::Moment;
use lager_ports::Cause;
use lager_stop::{Release, Stop};
use lager_wire::{Callsign, PACKET_LENGTH, Version};

use super::Service;
use crate::machine::{Effect, Write};
use crate::serial::{PacketWriter, Sent};

impl Service<'_> {
    /// Does what there is to do, one effect after the other, and looks at the stop word before each
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
                Some(effect) => self.carry_out(effect, now),
                None => return,
            }
        }
    }

    /// Shows a `lager stop` that waits that this loop turns, and which boards it has.
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

    fn carry_out(&mut self, effect: Effect, now: Moment) {
        match effect {
            Effect::Discard { place } => self.discard(place),
            Effect::Write(write) => self.write(&write),
            Effect::PublishHealth { rings } => self.publish_health(now, rings),
            Effect::PublishState { report_ns } => self.publish_state(now, report_ns),
            Effect::ShowReport(shown) => {
                self.page.report(shown.at_ns, shown.duties);
                if shown.proves_rest {
                    self.page.rest(shown.at_ns);
                }
            }
            // The next look at the word finds it.
            Effect::Stop(cause) => self.page.stop(cause),
            Effect::Release(stop) => self.release(stop),
            Effect::Say(news) => self.say(&news),
        }
    }

    /// Passes a stop to the core before anything else.
    #[cold]
    fn obey(&mut self, stop: Stop) {
        self.page.heed(stop, Clock::monotonic_ns());
        self.core.stop(stop);
        // `up` tells people of every stop that it sees on the bus.
        tracing::info!("stopped {stop}; a resume releases it");
    }

    /// Releases this stop. A newer stop stays in force.
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

    /// Throws away the bytes that wait in the driver.
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

    /// Writes one packet. Returns whether the driver has taken it.
    fn put(&mut self, place: usize, packet: &[u8; PACKET_LENGTH]) -> bool {
        let port = &mut self.ports[place];
        let Some(device) = &port.device else {
            return false;
        };
        // The reader finds out if a port has gone.
        matches!(
            port.writer.write(device, packet),
            Ok(Sent::Whole | Sent::Partly)
        )
    }

    fn publish_health(&mut self, now: Moment, rings: bool) {
        let dropped = u64::from(self.counts.dropped());
        let lost = self.lost_before + self.orders.lost() + dropped;
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
