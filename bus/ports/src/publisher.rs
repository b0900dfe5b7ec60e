//! The writing end of a topic.

use core::cell::Cell;
use core::fmt;
use core::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::{Publisher as IpcPublisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::BackpressureStrategy;
use iceoryx2::sample_mut::SampleMut;
use lager_topics::{Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::doorbell::{Rope, StandardListeners};
use crate::error::{PortError, SendError};
use crate::service::{self, Fault, MAX_LOANS, patiently};
use crate::transport::Ipc;

/// The writing end of a topic; stays in the thread that made it.
///
/// Sending never waits for a reader and does not allocate, except when a reader has come or gone.
pub struct Publisher<T: Topic> {
    inner: IpcPublisher<Ipc, T::Payload, Stamp>,
    ropes: Box<[Rope]>,
    standard: StandardListeners,
    next_sequence: Cell<u64>,
    epoch: u64,
    writer: u32,
}

impl<T: Topic> Publisher<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Self::with_ropes_to(bus, T::QOS.actors.iter().copied())
    }

    fn with_ropes_to(
        bus: &Bus,
        actors: impl Iterator<Item = lager_topics::Role>,
    ) -> Result<Self, PortError> {
        let ropes = actors
            .map(|actor| Rope::to(bus, actor, T::ID))
            .collect::<Result<_, _>>()?;
        let standard = StandardListeners::of::<T>(bus)?;
        let service = service::topic::<T>(bus)?;
        let inner = patiently(bus, T::NAME, || {
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
                            topic: T::NAME.to_owned(),
                            limit: T::QOS.max_publishers(),
                        })
                    }
                    other => service::no_resources(T::NAME, other),
                })
        })?;
        Ok(Self {
            inner,
            ropes,
            standard,
            next_sequence: Cell::new(0),
            // After the port exists: a subscriber that is older than the epoch has been there
            // for every sample, and may count what it missed from 0 on.
            epoch: new_epoch(),
            writer: std::process::id(),
        })
    }

    /// Takes a sample to be filled in place; it starts as the payload's blank value.
    ///
    /// # Errors
    /// Too many samples are on loan, or the transport failed.
    pub fn loan(&self) -> Result<Loan<'_, T>, SendError> {
        Ok(self.lend(self.inner.loan().map_err(refused)?))
    }

    /// Sends a copy of `payload`, which follows from `cause`.
    ///
    /// # Errors
    /// As [`Publisher::loan`] and [`Loan::send`].
    pub fn send(&self, cause: Cause, payload: T::Payload) -> Result<(), SendError> {
        let mut loan = self.filled(payload)?;
        loan.cause(cause);
        loan.send()
    }

    /// Gives readers that have come since the last sample their history. Writers of states call
    /// it regularly; it costs next to nothing when nobody has come.
    pub fn tick(&self) {
        // A reader that cannot be connected now is tried again with the next change.
        let _ = self.inner.update_connections();
    }

    /// Start of this publisher's life; with the process it names its stream.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Samples sent so far.
    pub fn sent(&self) -> u64 {
        self.next_sequence.get()
    }

    /// Sends with the times of an earlier sample of another writer.
    pub(crate) fn resend(&self, payload: T::Payload, original: &Stamp) -> Result<(), SendError> {
        let mut loan = self.filled(payload)?;
        loan.cause(Cause::of(original));
        loan.deliver(original.publish_time_ns, Ring::Actors)
    }

    /// A sample with `payload` in it; unlike [`Publisher::loan`] it is written once only.
    fn filled(&self, payload: T::Payload) -> Result<Loan<'_, T>, SendError> {
        let sample = self.inner.loan_uninit().map_err(refused)?;
        Ok(self.lend(sample.write_payload(payload)))
    }

    fn lend(&self, sample: SampleMut<Ipc, T::Payload, Stamp>) -> Loan<'_, T> {
        Loan {
            sample,
            publisher: self,
            cause: Cause::OWN,
        }
    }
}

impl<T: Topic> fmt::Debug for Publisher<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Publisher")
            .field("topic", &T::NAME)
            .field("epoch", &self.epoch)
            .field("sent", &self.sent())
            .finish_non_exhaustive()
    }
}

/// A sample that is being written; dropped unsent it leaves no trace.
#[must_use = "a loan that is not sent reaches nobody"]
pub struct Loan<'publisher, T: Topic> {
    sample: SampleMut<Ipc, T::Payload, Stamp>,
    publisher: &'publisher Publisher<T>,
    cause: Cause,
}

/// Who is told of a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ring {
    Actors,
    Nobody,
}

impl<T: Topic> Loan<'_, T> {
    /// Says from what the sample follows; unsaid it is [`Cause::OWN`].
    pub fn cause(&mut self, cause: Cause) {
        self.cause = cause;
    }

    /// Sends the sample and rings the topic's actors.
    ///
    /// # Errors
    /// The transport failed; the sample's number is used up, so readers count it as lost.
    pub fn send(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), Ring::Actors)
    }

    /// Sends the sample and rings nobody: actors find it when they look the next time. For what
    /// no actor has to act upon at once, so that nobody is woken in vain.
    ///
    /// # Errors
    /// As [`Loan::send`].
    pub fn send_quietly(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), Ring::Nobody)
    }

    fn deliver(mut self, publish_time_ns: u64, ring: Ring) -> Result<(), SendError> {
        let publisher = self.publisher;
        let sequence = publisher.next_sequence.get();
        publisher.next_sequence.set(sequence + 1);
        *self.sample.user_header_mut() = self.cause.stamp(Stamp {
            sequence,
            publish_time_ns,
            epoch: publisher.epoch,
            writer: publisher.writer,
            ..Stamp::default()
        });
        let sent = self.sample.send();
        if ring == Ring::Actors {
            for rope in &publisher.ropes {
                rope.ring();
            }
        }
        publisher.standard.notify();
        match sent {
            Ok(_) => Ok(()),
            Err(error) => Err(SendError::Transport(format!("{error:?}"))),
        }
    }
}

impl<T: Topic> Deref for Loan<'_, T> {
    type Target = T::Payload;

    fn deref(&self) -> &T::Payload {
        self.sample.payload()
    }
}

impl<T: Topic> DerefMut for Loan<'_, T> {
    fn deref_mut(&mut self) -> &mut T::Payload {
        self.sample.payload_mut()
    }
}

fn refused(error: LoanError) -> SendError {
    match error {
        LoanError::ExceedsMaxLoans => SendError::TooManyLoans { limit: MAX_LOANS },
        other => SendError::Transport(format!("{other:?}")),
    }
}

/// The current time, made unique within the process.
fn new_epoch() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    let now = Clock::monotonic_ns();
    let last = LAST
        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |last| {
            Some(now.max(last + 1))
        })
        .unwrap_or_default();
    now.max(last + 1)
}
