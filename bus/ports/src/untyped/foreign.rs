//! [`Foreign`]: writes to a topic of which only the name is known. The payload is bytes in the
//! layout that the topic's creator states.

use core::cell::{Cell, OnceCell};

use iceoryx2::prelude::PortFactory;
use lager_sample::{Description, Stamp, id};
use lager_wake::{AllRinger, WatchRinger};

use super::outlet::Outlet;
use super::writer::new_epoch;
use crate::bus::Bus;
use crate::cause::Cause;
use crate::error::{PortError, SendError};
use crate::kind::Side;
use crate::service;

/// A writer of a topic that is not in this process's table. It does not know who acts on the topic,
/// so it rings every waiter; a waiter that does not act on it goes back to sleep at once.
pub(crate) struct Foreign {
    bus: Bus,
    name: String,
    outlet: Outlet,
    /// The actors' service, once another process has opened it.
    actors: OnceCell<Outlet>,
    size: usize,
    /// Whether the topic keeps its last sample for readers that come later.
    pub(crate) holds: bool,
    ringer: AllRinger,
    watchers: WatchRinger,
    next_sequence: Cell<u64>,
    epoch: u64,
}

impl Foreign {
    /// `None` if no process has the topic open.
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<(Self, Description)>, PortError> {
        let Some((service, description)) = service::found(bus, bus.unit(), name, Side::Public)?
        else {
            return Ok(None);
        };
        let writer = Self {
            bus: bus.clone(),
            name: name.to_owned(),
            holds: service.static_config().history_size() > 0,
            outlet: Outlet::on(bus, name, service)?,
            actors: OnceCell::new(),
            size: description.size(),
            ringer: AllRinger::to(bus.board(), id(name))
                .map_err(|fault| PortError::of_bell(bus.part(), fault))?,
            watchers: WatchRinger::to(bus.board(), id(name))
                .map_err(|fault| PortError::of_bell(bus.part(), fault))?,
            next_sequence: Cell::new(0),
            // Taken after the port exists, as a typed writer does.
            epoch: new_epoch(),
        };
        writer.look_for_actors()?;
        Ok(Some((writer, description)))
    }

    /// Opens the actors' service, if the topic has one by now and it is not open yet. The topic's
    /// description does not say whether it will ever have one.
    fn look_for_actors(&self) -> Result<(), PortError> {
        if self.actors.get().is_none()
            && let Some((service, description)) =
                service::found(&self.bus, self.bus.unit(), &self.name, Side::Actors)?
            && description.size() == self.size
        {
            let _ = self.actors.set(Outlet::on(&self.bus, &self.name, service)?);
        }
        Ok(())
    }

    /// Sends a payload, published at that time, with this process as the cause.
    ///
    /// # Panics
    /// As [`Foreign::deliver`].
    pub(crate) fn send(&self, payload: &[u8], publish_time_ns: u64) -> Result<(), SendError> {
        let sequence = self.next_sequence.get();
        self.next_sequence.set(sequence + 1);
        let stamp = Cause::OWN.stamp(Stamp {
            sequence,
            publish_time_ns,
            epoch: self.epoch,
            writer: std::process::id(),
            ..Stamp::default()
        });
        self.deliver(payload, stamp)
    }

    /// Sends a payload with that stamp: first to the actors and their bells, then to everybody
    /// else.
    ///
    /// # Panics
    /// If `payload` has not as many bytes as the topic's payload.
    #[inline(never)]
    pub(crate) fn deliver(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        assert_eq!(payload.len(), self.size, "a payload's bytes");
        let acting = self.actors.get();
        let acted = acting.map_or(Ok(()), |outlet| put(outlet, payload, stamp));
        if acting.is_some() {
            self.ringer.ring();
        }
        let sent = put(&self.outlet, payload, stamp);
        if acting.is_none() {
            self.ringer.ring();
        }
        self.watchers.ring();
        acted.and(sent)
    }

    /// Connects to new readers and sends them their history. If actors have come, samples go to
    /// them first from now on.
    pub(crate) fn tick(&self) {
        // A service that cannot be opened now is tried again at the next tick.
        let _ = self.look_for_actors();
        self.outlet.tick();
        if let Some(actors) = self.actors.get() {
            actors.tick();
        }
    }
}

fn put(outlet: &Outlet, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
    let lent = outlet.lend()?;
    // `service::found` has checked that a payload is as large as this.
    lent.fill(payload);
    lent.send(stamp)
}
