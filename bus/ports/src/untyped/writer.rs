//! The writing end of a topic.

use core::cell::{Cell, RefCell};
use core::ptr::NonNull;
use std::rc::{Rc, Weak};
use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory};
use iceoryx2::sample_mut::SampleMut;
use lager_topics::Stamp;

use super::{Bytes, Header, Here, Kind, behind, ends_here};
use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::doorbell::{Rope, StandardListeners};
use crate::error::{PortError, SendError};
use crate::service::{self, Fault, MAX_LOANS, patiently};
use crate::transport::Ipc;

/// [`crate::Publisher`] without the payload's type.
pub(crate) struct Writer {
    port: Rc<Here<Port>>,
    payload_align: usize,
    standard: Here<StandardListeners>,
    ropes: Box<[Rope]>,
    next_sequence: Cell<u64>,
    epoch: u64,
    writer: u32,
}

pub(super) type Port = Publisher<Ipc, Bytes, Header>;
type Loaned = SampleMut<Ipc, Bytes, Header>;

ends_here!(Port, Loaned, StandardListeners);

thread_local! {
    /// The ports of this thread that write states.
    static STATES: RefCell<Vec<Weak<Here<Port>>>> = const { RefCell::new(Vec::new()) };
}

/// Gives readers that have come since to the states of this thread their history.
pub(crate) fn republish_states() {
    // A thread that is ending has no states any more.
    let _ = STATES.try_with(|states| {
        for port in states.borrow().iter().filter_map(Weak::upgrade) {
            // As in `tick`.
            let _ = port.update_connections();
        }
    });
}

/// A sample on loan; dropped unsent it leaves no trace.
pub(crate) struct Lent {
    sample: Here<Loaned>,
    payload: NonNull<u8>,
}

/// Which processes are rung for a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ring {
    Actors,
    Nobody,
}

impl Writer {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let ropes = kind
            .qos
            .actors
            .iter()
            .map(|actor| Rope::to(bus, *actor, kind.id))
            .collect::<Result<_, _>>()?;
        let standard = StandardListeners::of(bus, kind)?;
        let service = service::topic(bus, kind)?;
        let port = patiently(bus, kind.name, || {
            service
                .publisher_builder()
                .name(bus.port_name())
                .max_loaned_samples(MAX_LOANS)
                // With overflow there is always room; whatever else happens, never wait.
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    PublisherCreateError::ExceedsMaxSupportedPublishers => {
                        Fault::Full(PortError::TooManyWriters {
                            topic: kind.name.to_owned(),
                            limit: kind.qos.max_publishers(),
                        })
                    }
                    other => service::no_resources(kind.name, other),
                })
        })?;
        let details = service.static_config().message_type_details();
        let port = Rc::new(Here::new(port));
        if kind.qos.republish {
            STATES.with_borrow_mut(|states| {
                states.retain(|state| state.strong_count() > 0);
                states.push(Rc::downgrade(&port));
            });
        }
        Ok(Self {
            port,
            payload_align: details.payload.alignment(),
            standard: Here::new(standard),
            ropes,
            next_sequence: Cell::new(0),
            // Taken after the port exists: a subscriber that is older than the epoch was there for
            // every sample, and may count its losses from 0 on.
            epoch: new_epoch(),
            writer: std::process::id(),
        })
    }

    /// Takes a sample. Its payload is whatever was there before.
    #[inline(never)]
    pub(crate) fn lend(&self) -> Result<Lent, SendError> {
        // SAFETY: a payload of a fixed size is one element, and the transport counts it.
        let sample = unsafe { self.port.loan_custom_payload(1) }.map_err(refused)?;
        // SAFETY: memory that others have written is initialised, and bytes are all that it is
        // taken for here.
        let mut sample = unsafe { sample.assume_init() };
        let header = NonNull::from(sample.user_header_mut());
        Ok(Lent {
            payload: behind(header, size_of::<Stamp>(), self.payload_align),
            sample: Here::new(sample),
        })
    }

    /// Sends a sample that follows from `cause`, as published at that time.
    #[inline(never)]
    pub(crate) fn deliver(
        &self,
        lent: Lent,
        cause: Cause,
        publish_time_ns: u64,
        ring: Ring,
    ) -> Result<(), SendError> {
        let sequence = self.next_sequence.get();
        self.next_sequence.set(sequence + 1);
        let stamp = cause.stamp(Stamp {
            sequence,
            publish_time_ns,
            epoch: self.epoch,
            writer: self.writer,
            ..Stamp::default()
        });
        self.hand_over(lent, stamp, ring)
    }

    /// Sends a sample with that stamp.
    #[inline(never)]
    pub(crate) fn deliver_stamped(
        &self,
        lent: Lent,
        stamp: Stamp,
        ring: Ring,
    ) -> Result<(), SendError> {
        self.hand_over(lent, stamp, ring)
    }

    #[inline(always)]
    fn hand_over(&self, mut lent: Lent, stamp: Stamp, ring: Ring) -> Result<(), SendError> {
        let header = NonNull::from(lent.sample.user_header_mut()).cast::<Stamp>();
        // SAFETY: the service's header is a `Stamp` (`Kind::header`), and the loan is ours.
        unsafe { header.write(stamp) };
        let sent = lent.sample.take().send();
        if ring == Ring::Actors {
            for rope in &self.ropes {
                rope.ring();
            }
        }
        self.standard.notify();
        match sent {
            Ok(_) => Ok(()),
            Err(error) => Err(SendError::Transport(error.into())),
        }
    }

    /// Connects to readers that have come, and gives them their history.
    #[inline(never)]
    pub(crate) fn tick(&self) {
        // A reader that cannot be connected now is tried again with the next change.
        let _ = self.port.update_connections();
    }

    /// Start of this writer's life.
    pub(crate) fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Samples sent so far.
    pub(crate) fn sent(&self) -> u64 {
        self.next_sequence.get()
    }
}

impl Lent {
    /// Where the payload is, aligned and large enough for one; valid as long as this is.
    pub(crate) fn payload(&self) -> NonNull<u8> {
        self.payload
    }
}

fn refused(error: LoanError) -> SendError {
    match error {
        LoanError::ExceedsMaxLoans => SendError::TooManyLoans { limit: MAX_LOANS },
        other => SendError::Transport(other.into()),
    }
}

/// The current time, made unique within the process.
pub(super) fn new_epoch() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    let now = Clock::monotonic_ns();
    let last = LAST
        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |last| {
            Some(now.max(last + 1))
        })
        .unwrap_or_default();
    now.max(last + 1)
}
