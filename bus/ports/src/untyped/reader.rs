//! The reading end of a topic.

use core::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::{DegradationAction, ReceiveError as IpcReceiveError};
use iceoryx2::prelude::{CallbackProgression, PortFactory};
use iceoryx2::sample::Sample;
use lager_topics::{OBSERVERS, Stamp};

use super::behind;
use crate::bus::Bus;
use crate::clock::Clock;
use crate::error::{PortError, ReceiveError};
use crate::here::{Here, ends_here};
use crate::kind::{Bytes, Header, Kind, Side};
use crate::name;
use crate::patience::{Fault, patiently};
use crate::service::{self, MAX_HELD, TopicService};
use crate::streams::{Newest, Streams};
use crate::transport::Ipc;

/// [`crate::Subscriber`] without the payload's type.
pub(crate) struct Reader {
    port: Here<Port>,
    payload_align: usize,
    holds: bool,
    streams: Streams,
    newest: Newest,
    /// Writers that could not be connected to.
    unreached: Arc<AtomicU32>,
    /// The public service, which an actor does not read, but keeps for those who look for the
    /// topic.
    _public: Option<Here<TopicService>>,
}

type Port = Subscriber<Ipc, Bytes, Header>;
type Received = Sample<Ipc, Bytes, Header>;

ends_here!(Port, Received);

/// A received sample, which the reader holds until this is dropped.
pub(crate) struct Taken {
    _sample: Here<Received>,
    payload: NonNull<u8>,
    stamp: NonNull<Stamp>,
}

impl Reader {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let public = service::topic(bus, kind, Side::Public)?;
        match kind.side(bus.role()) {
            Side::Public => Self::of(bus, kind.name, &public),
            Side::Actors => Ok(Self {
                _public: Some(Here::new(public)),
                ..Self::of(bus, kind.name, &service::topic(bus, kind, Side::Actors)?)?
            }),
        }
    }

    /// A reader of the topic called `name`, of which this is a service.
    #[inline(never)]
    pub(crate) fn of(bus: &Bus, name: &str, service: &TopicService) -> Result<Self, PortError> {
        let limits = service.static_config();
        let no_place = || Fault::Full(no_place(bus, name, limits.max_subscribers()));
        let unreached = Arc::new(AtomicU32::new(0));
        let port = patiently(bus, name, || {
            unreached.store(0, Ordering::Relaxed);
            let missed = Arc::clone(&unreached);
            let subscriber = service
                .subscriber_builder()
                .name(bus.port_name())
                // The others are received all the same.
                .set_degradation_handler(move |_, _| {
                    missed.fetch_add(1, Ordering::Relaxed);
                    DegradationAction::Ignore
                })
                .buffer_size(limits.subscriber_max_buffer_size())
                .create()
                .map_err(|error| match error {
                    SubscriberCreateError::ExceedsMaxSupportedSubscribers => no_place(),
                    other => service::no_resources(name, other),
                })?;
            // This counts with the new reader in place, so that two readers that come at once
            // cannot both get the last place.
            if bus.role().is_observer() && observers(service) > OBSERVERS {
                return Err(no_place());
            }
            Ok(subscriber)
        })?;
        Ok(Self {
            port: Here::new(port),
            payload_align: limits.message_type_details().payload.alignment(),
            holds: limits.history_size() > 0,
            // Taken after the port exists: a publisher that is younger has seen the port from its
            // start.
            streams: Streams::new(Clock::monotonic_ns()),
            newest: Newest::default(),
            unreached,
            _public: None,
        })
    }

    /// Whether the topic holds its last sample for those who come later.
    pub(crate) fn holds(&self) -> bool {
        self.holds
    }

    /// How many samples can wait for this end.
    pub(crate) fn queue(&self) -> usize {
        self.port.buffer_size()
    }

    /// The next sample, oldest first.
    #[inline(never)]
    pub(crate) fn receive(&mut self) -> Result<Option<Taken>, ReceiveError> {
        match self.port.receive() {
            Ok(Some(sample)) => {
                let header = NonNull::from(sample.user_header());
                let taken = Taken {
                    payload: behind(header, size_of::<Stamp>(), self.payload_align),
                    stamp: header.cast(),
                    _sample: Here::new(sample),
                };
                self.streams.note(taken.stamp(), Clock::monotonic_ns);
                Ok(Some(taken))
            }
            Ok(None) => Ok(None),
            Err(IpcReceiveError::ExceedsMaxBorrows) => {
                Err(ReceiveError::TooManyHeld { limit: MAX_HELD })
            }
            Err(other) => Err(ReceiveError::Transport(other.into())),
        }
    }

    /// The newest sample of all that there are, if it is newer than what this has returned before.
    #[inline(never)]
    pub(crate) fn latest(&mut self) -> Result<Option<Taken>, ReceiveError> {
        let mut latest = None;
        loop {
            match self.receive() {
                Ok(Some(sample)) => {
                    let publish_ns = sample.stamp().publish_time_ns;
                    if self.newest.takes(publish_ns, Clock::monotonic_ns()) {
                        latest = Some(sample);
                    }
                }
                Ok(None) => return Ok(latest),
                Err(error) if latest.is_none() => return Err(error),
                Err(_) => return Ok(latest),
            }
        }
    }

    pub(crate) fn unreached(&self) -> u32 {
        self.unreached.load(Ordering::Relaxed)
    }

    pub(crate) fn streams(&self) -> &Streams {
        &self.streams
    }
}

impl Taken {
    /// The payload's address, valid as long as this is. No process writes to it meanwhile.
    pub(crate) fn payload(&self) -> NonNull<u8> {
        self.payload
    }

    pub(crate) fn stamp(&self) -> &Stamp {
        // SAFETY: the service's header is a `Stamp` (`Kind::header`); the sample is held, and its
        // writer does not touch it before it is given back.
        unsafe { self.stamp.as_ref() }
    }
}

fn observers(service: &TopicService) -> usize {
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

fn no_place(bus: &Bus, name: &str, limit: usize) -> PortError {
    let topic = name.to_owned();
    if bus.role().is_observer() {
        PortError::TooManyObservers {
            topic,
            limit: OBSERVERS,
        }
    } else {
        PortError::TooManyReaders { topic, limit }
    }
}
