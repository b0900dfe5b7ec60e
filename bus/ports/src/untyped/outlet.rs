//! [`Outlet`]: a writer's port on one of a topic's services. [`Lent`]: a sample on loan from it.

use core::cell::RefCell;
use core::ptr::NonNull;
use std::rc::{Rc, Weak};

use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory};
use iceoryx2::sample_mut::SampleMut;
use lager_sample::Stamp;

use super::anyone::Readers;
use super::behind;
use crate::bus::Bus;
use crate::error::{PortError, SendError};
use crate::here::{Here, ends_here};
use crate::kind::{Bytes, Header, Kind, Side};
use crate::patience::{Fault, patiently};
use crate::service::{self, MAX_LOANS, TopicService};
use crate::transport::Ipc;

/// The port, with the service that it is on.
pub(crate) struct Outlet {
    port: Rc<Here<Port>>,
    service: Here<TopicService>,
    payload_align: usize,
}

type Port = Publisher<Ipc, Bytes, Header>;
type Loaned = SampleMut<Ipc, Bytes, Header>;

ends_here!(Port, Loaned);

thread_local! {
    /// The ports of this thread that write states.
    static STATES: RefCell<Vec<Weak<Here<Port>>>> = const { RefCell::new(Vec::new()) };
}

/// Sends history to readers that have come to a state that this thread writes.
pub(crate) fn republish_states() {
    // A thread that is ending has no states any more.
    let _ = STATES.try_with(|states| {
        for port in states.borrow().iter().filter_map(Weak::upgrade) {
            // As in `tick`.
            let _ = port.update_connections();
        }
    });
}

/// A sample on loan. If it is dropped unsent, nobody notices.
pub(crate) struct Lent {
    sample: Here<Loaned>,
    payload: NonNull<u8>,
}

impl Outlet {
    /// Makes a port on a service of a topic in the table.
    pub(crate) fn new(bus: &Bus, kind: &Kind, side: Side) -> Result<Self, PortError> {
        let outlet = Self::on(bus, kind.name, service::topic(bus, kind, side)?)?;
        if kind.qos.republish {
            STATES.with_borrow_mut(|states| {
                states.retain(|state| state.strong_count() > 0);
                states.push(Rc::downgrade(&outlet.port));
            });
        }
        Ok(outlet)
    }

    /// Makes a port on `service`, which belongs to the topic called `name`.
    pub(crate) fn on(bus: &Bus, name: &str, service: TopicService) -> Result<Self, PortError> {
        let limits = service.static_config();
        let port = patiently(bus, name, || {
            service
                .publisher_builder()
                .name(bus.port_name())
                .max_loaned_samples(MAX_LOANS)
                // With overflow there is always room. Whatever else happens, never wait.
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    PublisherCreateError::ExceedsMaxSupportedPublishers => {
                        Fault::Full(PortError::TooManyWriters {
                            topic: name.to_owned(),
                            limit: limits.max_publishers(),
                        })
                    }
                    other => service::no_resources(name, other),
                })
        })?;
        Ok(Self {
            port: Rc::new(Here::new(port)),
            payload_align: limits.message_type_details().payload.alignment(),
            service: Here::new(service),
        })
    }

    /// Takes a sample. Its payload is whatever was there before.
    #[inline(always)]
    pub(crate) fn lend(&self) -> Result<Lent, SendError> {
        // SAFETY: a payload of a fixed size is one element, and that is how the transport counts.
        let sample = unsafe { self.port.loan_custom_payload(1) }.map_err(refused)?;
        // SAFETY: memory that others have written is initialised, and it is read as bytes only.
        let mut sample = unsafe { sample.assume_init() };
        let header = NonNull::from(sample.user_header_mut());
        Ok(Lent {
            payload: behind(header, size_of::<Stamp>(), self.payload_align),
            sample: Here::new(sample),
        })
    }

    /// The readers of the service. Do not ask the result when this outlet is gone.
    pub(super) fn readers(&self) -> Readers {
        Readers::of(&self.service)
    }

    /// The size of a payload in bytes.
    pub(crate) fn payload_size(&self) -> usize {
        let details = self.service.static_config().message_type_details();
        details.payload.size()
    }

    /// Connects to new readers, sends them their history, and disconnects from readers that have
    /// left.
    pub(crate) fn tick(&self) {
        // A reader that cannot be connected now is tried again at the next change.
        let _ = self.port.update_connections();
    }
}

impl Lent {
    /// The payload's address, aligned and large enough for one; valid while this loan is.
    pub(crate) fn payload(&self) -> NonNull<u8> {
        self.payload
    }

    /// Writes all bytes of the payload.
    pub(crate) fn fill(&self, payload: &[u8]) {
        let from = NonNull::from(payload).cast();
        // SAFETY: the caller passes as many bytes as a payload has. Nobody else has the loan, and
        // `payload` is memory of this process.
        unsafe { self.payload.copy_from_nonoverlapping(from, payload.len()) };
    }

    /// Sends it with that stamp.
    #[inline(always)]
    pub(crate) fn send(mut self, stamp: Stamp) -> Result<(), SendError> {
        let header = NonNull::from(self.sample.user_header_mut()).cast::<Stamp>();
        // SAFETY: the service's header is a `Stamp` (`Kind::header`), and nobody else has the loan.
        unsafe { header.write(stamp) };
        sent(self.sample.take())
    }
}

/// The only place that sends, so that the compiler inlines iceoryx2's loop over the places of
/// subscribers here. When several places sent, the loop stayed a function and kept its counter in
/// memory: 21 instead of 14 instructions for each place that is not taken. For the 74 places of a
/// topic without actors, a publish took 4 760 instead of 4 290 instructions, and 1.2 to 1.3 times
/// as long as bare iceoryx2 instead of 1.05 to 1.1 (one process, 64 bytes, one reader).
/// `publish/to-1` in `benches/limits.toml` shows if a compiler does it otherwise.
#[inline(never)]
fn sent(sample: Loaned) -> Result<(), SendError> {
    match sample.send() {
        Ok(_) => Ok(()),
        Err(error) => Err(SendError::Transport(error.into())),
    }
}

fn refused(error: LoanError) -> SendError {
    match error {
        LoanError::ExceedsMaxLoans => SendError::TooManyLoans { limit: MAX_LOANS },
        other => SendError::Transport(other.into()),
    }
}
