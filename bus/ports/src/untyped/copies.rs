//! [`Copies`]: sends a topic's samples to observers, after the actors have been served and rung.
//!
//! The writer first copies the bytes of a sample into memory of its own, then hands the sample to
//! the actors. When it has rung them, it loans a sample of the public service and sends the copy
//! there. It does not loan that sample earlier, because for each loan iceoryx2 first takes back the
//! samples that every observer has returned, and the actors would wait for that.
//!
//! A writer can keep a copy back while its thread does something more urgent
//! ([`crate::Loan::send_ahead`]). Every other way of sending sends the copy at once, because
//! observers rely on the order in which a process does things: they see an event before the status
//! that follows from it, and a keeper gets a state before its writer acts on it.
//!
//! **Invariant:** readers of the public service count losses as exactly as the actors do. A copy
//! has the sample's stamp, and copies go out in the order of the samples. The writer leaves out a
//! copy only when nobody could miss it: there is no reader, and the topic is not a state, whose
//! last sample later readers must get. A reader that comes between this check and the sample has
//! come after the sample's publish time, so a stream does not owe it that sample.

use core::cell::Cell;
use core::ptr::NonNull;

use lager_sample::Stamp;

use super::anyone::Readers;
use super::outlet::Outlet;
use crate::bus::Bus;
use crate::error::{PortError, SendError};
use crate::here::{Here, ends_here};
use crate::kind::{Kind, Side};

ends_here!(Readers);

/// The public service, where everybody but the actors reads.
pub(crate) struct Copies {
    outlet: Outlet,
    /// The readers of that service.
    readers: Here<Readers>,
    /// The topic is a state: readers that come later must get the last sample.
    is_state: bool,
    /// There was a reader when the last sample was sent.
    watched: Cell<bool>,
    /// The stamp of the sample taken last; `owed` says whether that must still be published.
    stamp: Cell<Stamp>,
    payload: Box<[Cell<u8>]>,
    owed: Cell<bool>,
}

impl Copies {
    pub(crate) fn new(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let outlet = Outlet::new(bus, kind, Side::Public)?;
        let size = outlet.payload_size();
        Ok(Self {
            readers: Here::new(outlet.readers()),
            outlet,
            is_state: kind.qos.history > 0,
            watched: Cell::new(false),
            stamp: Cell::default(),
            payload: (0..size).map(|_| Cell::new(0)).collect(),
            owed: Cell::new(false),
        })
    }

    /// Copies a sample whose payload is at `payload`, if anybody could miss it. The caller has
    /// published the sample taken before.
    #[inline]
    pub(crate) fn take(&self, stamp: &Stamp, payload: NonNull<u8>) {
        if !self.are_due() {
            return;
        }
        self.stamp.set(*stamp);
        let to = NonNull::from(&*self.payload).cast::<u8>();
        // SAFETY: `payload` comes from the caller and is as large as the service's payload; so is
        // `to`, whose bytes are in cells, so that they may be written behind a shared reference.
        unsafe { to.copy_from_nonoverlapping(payload, self.payload.len()) };
        self.owed.set(true);
    }

    /// Whether the next sample needs a copy.
    #[inline]
    fn are_due(&self) -> bool {
        let watched = self.readers.is_there();
        if self.watched.replace(watched) && !watched {
            // Frees what the last reader had.
            self.tick();
        }
        watched || self.is_state
    }

    /// Publishes the copy of the sample taken last, unless that was already done.
    #[inline]
    pub(crate) fn publish(&self) -> Result<(), SendError> {
        if !self.owed.replace(false) {
            return Ok(());
        }
        let lent = self.outlet.lend()?;
        let from = NonNull::from(&*self.payload).cast::<u8>();
        // SAFETY: nobody else has the loan, and it has room for a payload of the service's size.
        unsafe {
            lent.payload()
                .copy_from_nonoverlapping(from, self.payload.len());
        }
        lent.send(self.stamp.get())
    }

    /// Connects to new readers and sends them their history.
    pub(crate) fn tick(&self) {
        self.outlet.tick();
    }
}
