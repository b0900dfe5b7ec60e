//! The reading end of a topic.

use core::fmt;
use core::ops::Deref;

use iceoryx2::port::ReceiveError as IpcReceiveError;
use iceoryx2::port::subscriber::{Subscriber as IpcSubscriber, SubscriberCreateError};
use iceoryx2::prelude::{CallbackProgression, PortFactory};
use iceoryx2::sample::Sample as IpcSample;
use lager_topics::{OBSERVERS, Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::error::{PortError, ReceiveError};
use crate::name;
use crate::service::{self, Fault, MAX_HELD, TopicService, patiently};
use crate::streams::Streams;
use crate::transport::Ipc;

/// The reading end of a topic; stays in the thread that made it.
pub struct Subscriber<T: Topic> {
    inner: IpcSubscriber<Ipc, T::Payload, Stamp>,
    streams: Streams,
    newest_ns: u64,
}

impl<T: Topic> Subscriber<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        let service = service::topic::<T>(bus)?;
        let inner = patiently(bus, T::NAME, || {
            let subscriber = service
                .subscriber_builder()
                .name(bus.port_name())
                .buffer_size(T::QOS.buffer)
                .create()
                .map_err(|error| match error {
                    SubscriberCreateError::ExceedsMaxSupportedSubscribers => {
                        Fault::Full(no_place::<T>(bus))
                    }
                    other => service::no_resources(T::NAME, other),
                })?;
            // Counted with the new one in place, so that two that come at once cannot both slip
            // through.
            if bus.role().is_observer() && observers::<T>(&service) > OBSERVERS {
                return Err(Fault::Full(no_place::<T>(bus)));
            }
            Ok(subscriber)
        })?;
        Ok(Self {
            inner,
            // After the port exists: a publisher that is younger has seen it from the start.
            streams: Streams::new(Clock::monotonic_ns()),
            newest_ns: 0,
        })
    }

    /// The next sample, oldest first; `None` when there is nothing more.
    ///
    /// # Errors
    /// Too many samples are held, or the transport failed.
    pub fn receive(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        match self.inner.receive() {
            Ok(Some(inner)) => {
                self.streams.note(inner.user_header());
                Ok(Some(Sample { inner }))
            }
            Ok(None) => Ok(None),
            Err(IpcReceiveError::ExceedsMaxBorrows) => {
                Err(ReceiveError::TooManyHeld { limit: MAX_HELD })
            }
            Err(other) => Err(ReceiveError::Transport(format!("{other:?}"))),
        }
    }

    /// Drains the topic and returns what was published last; `None` if there is nothing newer
    /// than what this returned before. For topics that carry a state.
    ///
    /// # Errors
    /// As [`Subscriber::receive`]; at most two samples may be held meanwhile.
    pub fn latest(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        let mut latest = None;
        while let Some(sample) = self.receive()? {
            // Several writers' samples come in no order; a keeper's may be older than one seen.
            if sample.stamp().publish_time_ns >= self.newest_ns {
                self.newest_ns = sample.stamp().publish_time_ns;
                latest = Some(sample);
            }
        }
        Ok(latest)
    }

    /// Samples missed, exactly, over all writers: every number that was skipped, and for a writer
    /// younger than this subscriber also what came before the first sample received. Known up to
    /// the last sample received. A restarted writer is no loss.
    ///
    /// A writer that came and went while nothing was received is not known.
    pub fn lost(&self) -> u64 {
        self.streams.lost()
    }

    /// Samples received.
    pub fn received(&self) -> u64 {
        self.streams.received()
    }

    /// Writers heard so far, a restarted one counting again.
    pub fn writers_heard(&self) -> usize {
        self.streams.heard()
    }
}

impl<T: Topic> fmt::Debug for Subscriber<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Subscriber")
            .field("topic", &T::NAME)
            .field("received", &self.received())
            .field("lost", &self.lost())
            .finish_non_exhaustive()
    }
}

/// A received sample, read where the writer wrote it. At most four may be held at a time.
pub struct Sample<T: Topic> {
    inner: IpcSample<Ipc, T::Payload, Stamp>,
}

impl<T: Topic> Sample<T> {
    /// When, why, by whom and as which one it was published.
    pub fn stamp(&self) -> &Stamp {
        self.inner.user_header()
    }

    /// This sample as the reason for others, received now: call it right after receiving. It
    /// reads the clock, so whoever only looks at samples should not ask for it.
    pub fn cause(&self) -> Cause {
        Cause::sample::<T>(self.stamp(), Clock::monotonic_ns())
    }
}

impl<T: Topic> Deref for Sample<T> {
    type Target = T::Payload;

    fn deref(&self) -> &T::Payload {
        self.inner.payload()
    }
}

impl<T: Topic> fmt::Debug for Sample<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Sample")
            .field("stamp", self.stamp())
            .field("payload", &**self)
            .finish()
    }
}

fn observers<T: Topic>(service: &TopicService<T>) -> usize {
    let mut observers = 0;
    service.dynamic_config().list_subscribers(|details| {
        if name::parse_port(details.subscriber_name.as_str())
            .is_some_and(|(role, _)| role.is_observer())
        {
            observers += 1;
        }
        CallbackProgression::Continue
    });
    observers
}

fn no_place<T: Topic>(bus: &Bus) -> PortError {
    let topic = T::NAME.to_owned();
    if bus.role().is_observer() {
        PortError::TooManyObservers {
            topic,
            limit: OBSERVERS,
        }
    } else {
        PortError::TooManyReaders {
            topic,
            limit: T::QOS.max_subscribers(),
        }
    }
}
