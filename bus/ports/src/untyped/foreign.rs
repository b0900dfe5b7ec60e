//! The writing end of a topic that is only known by its name: bytes in, laid out as its creator says.

use core::cell::Cell;

use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory};
use lager_topics::{Description, Role, Stamp, id};

use super::writer::{Port, new_epoch};
use super::{Here, behind};
use crate::bus::Bus;
use crate::doorbell::Rope;
use crate::error::{PortError, SendError};
use crate::service::{self, Fault, MAX_LOANS, patiently};

/// A writer of somebody else's topic. The processes that act on such a topic are guests, so it
/// rings guests.
pub(crate) struct Foreign {
    port: Here<Port>,
    size: usize,
    align: usize,
    rope: Rope,
    pub(crate) next_sequence: Cell<u64>,
    pub(crate) epoch: u64,
}

impl Foreign {
    /// `None` if no process has the topic open.
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<(Self, Description)>, PortError> {
        let Some((service, description)) = service::found(bus, bus.robot(), name)? else {
            return Ok(None);
        };
        let limit = service.static_config().max_publishers();
        let port = patiently(bus, name, || {
            service
                .publisher_builder()
                .name(bus.port_name())
                .max_loaned_samples(MAX_LOANS)
                // As a writer of the table's topics: it never waits.
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    PublisherCreateError::ExceedsMaxSupportedPublishers => {
                        let topic = name.to_owned();
                        Fault::Full(PortError::TooManyWriters { topic, limit })
                    }
                    other => service::no_resources(name, other),
                })
        })?;
        let details = service.static_config().message_type_details();
        let writer = Self {
            port: Here::new(port),
            size: description.size(),
            align: details.payload.alignment(),
            rope: Rope::to(bus, Role::Guest, id(name))?,
            next_sequence: Cell::new(0),
            // Taken after the port exists, as a typed writer does.
            epoch: new_epoch(),
        };
        Ok(Some((writer, description)))
    }

    /// Sends a payload with that stamp, and rings those who act on it.
    ///
    /// # Panics
    /// When there are not as many bytes as a payload has.
    #[inline(never)]
    pub(crate) fn deliver(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        assert_eq!(payload.len(), self.size, "a payload's bytes");
        // SAFETY: a payload of a fixed size is one element, and the transport counts it.
        let sample = unsafe { self.port.loan_custom_payload(1) };
        let sample = sample.map_err(|error| match error {
            LoanError::ExceedsMaxLoans => SendError::TooManyLoans { limit: MAX_LOANS },
            other => SendError::Transport(other.into()),
        })?;
        // SAFETY: memory that others have written is initialised, and bytes are all that it is
        // taken for here.
        let mut sample = unsafe { sample.assume_init() };
        let header = core::ptr::NonNull::from(sample.user_header_mut());
        let at = behind(header, size_of::<Stamp>(), self.align);
        // SAFETY: `service::found` has made sure that header and payload are so large. The loan is
        // ours, and `payload` is our own memory.
        unsafe {
            header.cast::<Stamp>().write(stamp);
            at.as_ptr()
                .copy_from_nonoverlapping(payload.as_ptr(), payload.len());
        }
        let sent = sample.send();
        self.rope.ring();
        match sent {
            Ok(_) => Ok(()),
            Err(error) => Err(SendError::Transport(error.into())),
        }
    }

    /// Connects to readers that have come, and gives them their history.
    pub(crate) fn tick(&self) {
        // A reader that cannot be connected now is tried again with the next change.
        let _ = self.port.update_connections();
    }
}
