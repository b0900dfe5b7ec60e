//! The writing end of a topic that is only known by its name: bytes in, laid out as its creator
//! says.

use core::cell::{Cell, OnceCell};

use iceoryx2::prelude::PortFactory;
use lager_topics::{Description, Role, Stamp, id};

use super::outlet::Outlet;
use super::writer::new_epoch;
use crate::bus::Bus;
use crate::doorbell::RoleRinger;
use crate::error::{PortError, SendError};
use crate::kind::Side;
use crate::service;

/// A writer of somebody else's topic. The processes that act on such a topic are guests, so it
/// rings guests.
pub(crate) struct Foreign {
    bus: Bus,
    name: String,
    outlet: Outlet,
    /// The actors' service, since somebody has it open.
    actors: OnceCell<Outlet>,
    size: usize,
    /// Whether the topic holds its last sample for those who come later.
    pub(crate) holds: bool,
    ringer: RoleRinger,
    pub(crate) next_sequence: Cell<u64>,
    pub(crate) epoch: u64,
}

impl Foreign {
    /// `None` if no process has the topic open.
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<(Self, Description)>, PortError> {
        let Some((service, description)) = service::found(bus, bus.robot(), name, Side::Public)?
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
            ringer: RoleRinger::to(bus.board(), Role::Guest, id(name))?,
            next_sequence: Cell::new(0),
            // Taken after the port exists, as a typed writer does.
            epoch: new_epoch(),
        };
        writer.look_for_actors()?;
        Ok(Some((writer, description)))
    }

    /// Opens the actors' service, if the topic has one by now and it is not open yet. Nobody says
    /// whether it ever will.
    fn look_for_actors(&self) -> Result<(), PortError> {
        if self.actors.get().is_none()
            && let Some((service, description)) =
                service::found(&self.bus, self.bus.robot(), &self.name, Side::Actors)?
            && description.size() == self.size
        {
            let _ = self.actors.set(Outlet::on(&self.bus, &self.name, service)?);
        }
        Ok(())
    }

    /// Sends a payload with that stamp: to those who act on it, who are rung, and then to everybody
    /// else.
    ///
    /// # Panics
    /// When there are not as many bytes as a payload has.
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
        acted.and(sent)
    }

    /// Connects to readers that have come, and gives them their history. Samples reach actors that
    /// have come first from now on.
    pub(crate) fn tick(&self) {
        // What cannot be opened now is tried again at the next tick.
        let _ = self.look_for_actors();
        self.outlet.tick();
        if let Some(actors) = self.actors.get() {
            actors.tick();
        }
    }
}

fn put(outlet: &Outlet, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
    let lent = outlet.lend()?;
    // SAFETY: `service::found` has made sure that a payload is so large. The loan is ours, and
    // `payload` is our own memory.
    unsafe {
        let to = lent.payload().as_ptr();
        to.copy_from_nonoverlapping(payload.as_ptr(), payload.len());
    }
    lent.send(stamp)
}
