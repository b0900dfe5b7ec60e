//! The public end of a topic whose actors are served first.
//!
//! The writer takes the bytes of a sample here before it hands the sample to the actors, and puts
//! the copy on the public service after it has rung them. To loan the copy's sample before the ring
//! would not do, because a loan takes back what every observer has returned.
//!
//! A copy can wait until its thread has done what is more urgent ([`crate::Loan::send_ahead`]).
//! Only the bridge's readers let it wait, until the other frames of the same read are out.
//! Everywhere else a copy goes out at once, for two reasons. On a frame's way nothing follows that
//! it would hold up: after the order logic's turn is over, and the bridge writes its packet before
//! it publishes, or publishes first what must be kept first. And observers rely on the order of
//! what a service does: a request is answered when `link/health` shows its effect, an event is out
//! before the status that follows from it, and a keeper has a state before it is acted upon.
//!
//! **Invariant:** readers of the public service count losses as exactly as the actors do. A copy
//! has the sample's stamp, copies go out in the order of the samples, and one is left out only when
//! nobody could miss it: no reader is there, and none that comes later is owed the last sample. A
//! reader that comes between the look and the sample has come after its publish time, so it is not
//! owed a stream's sample.

use core::cell::Cell;
use core::ptr::NonNull;

use lager_topics::Stamp;

use super::anyone::Readers;
use super::outlet::Outlet;
use crate::bus::Bus;
use crate::error::{PortError, SendError};
use crate::here::{Here, ends_here};
use crate::kind::{Kind, Side};

ends_here!(Readers);

/// Where everybody but the actors reads.
pub(crate) struct Copies {
    outlet: Outlet,
    /// Who reads there.
    readers: Here<Readers>,
    /// Readers that come later are owed the last sample.
    is_state: bool,
    /// At the last sample there was a reader.
    watched: Cell<bool>,
    /// The sample taken last, and whether it is still to be published.
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

    /// Takes a sample whose payload is at `payload`, if somebody could miss it. The one taken
    /// before has been published.
    #[inline]
    pub(crate) fn take(&self, stamp: &Stamp, payload: NonNull<u8>) {
        if !self.are_due() {
            return;
        }
        self.stamp.set(*stamp);
        let to = NonNull::from(&*self.payload).cast::<u8>();
        // SAFETY: `payload` is the caller's and of the service's size, as is what lies at `to`,
        // which is in cells, so it may be written behind a shared reference.
        unsafe { to.copy_from_nonoverlapping(payload, self.payload.len()) };
        self.owed.set(true);
    }

    /// Whether a copy of the next sample has to be made.
    #[inline]
    fn are_due(&self) -> bool {
        let watched = self.readers.is_there();
        if self.watched.replace(watched) && !watched {
            // Lets go of what the last reader had.
            self.tick();
        }
        watched || self.is_state
    }

    /// Publishes the copy of the sample taken last, if that is still to be done.
    #[inline]
    pub(crate) fn publish(&self) -> Result<(), SendError> {
        if !self.owed.replace(false) {
            return Ok(());
        }
        let lent = self.outlet.lend()?;
        let from = NonNull::from(&*self.payload).cast::<u8>();
        // SAFETY: the loan is ours and has room for a payload of the service's size.
        unsafe {
            lent.payload()
                .copy_from_nonoverlapping(from, self.payload.len());
        }
        lent.send(self.stamp.get())
    }

    /// Connects to readers that have come, and gives them their history.
    pub(crate) fn tick(&self) {
        self.outlet.tick();
    }
}
