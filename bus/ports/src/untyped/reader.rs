//! [`Reader`]: receives a topic's samples without the payload's type.

use core::ptr::NonNull;
use std::rc::{Rc, Weak};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::{DegradationAction, ReceiveError as IpcReceiveError};
use iceoryx2::prelude::{CallbackProgression, PortFactory};
use iceoryx2::sample::Sample;
use lager_home::Clock;
use lager_sample::Stamp;

use super::behind;
use crate::bus::Bus;
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
    port: Rc<Here<Port>>,
    payload_align: usize,
    holds: bool,
    streams: Streams,
    newest: Newest,
    /// How many writers this reader could not connect to.
    unreached: Arc<AtomicU32>,
    /// The public service. An actor does not read it, but keeps it open so that tools find the
    /// topic.
    _public: Option<Here<TopicService>>,
}

type Port = Subscriber<Ipc, Bytes, Header>;
type Received = Sample<Ipc, Bytes, Header>;

ends_here!(Port, Received);

/// Tells whether samples wait for a reader; may outlive it.
pub(crate) struct Peek(Weak<Here<Port>>);

impl Peek {
    /// Whether a sample waits. Also true if that cannot be told, so that the reader is asked.
    pub(crate) fn has_samples(&self) -> bool {
        let port = self.0.upgrade();
        port.is_some_and(|port| port.has_samples().unwrap_or(true))
    }

    /// Whether the reader is gone.
    pub(crate) fn is_over(&self) -> bool {
        self.0.strong_count() == 0
    }
}

/// A received sample. The reader holds it until this is dropped.
pub(crate) struct Taken {
    _sample: Here<Received>,
    payload: NonNull<u8>,
    stamp: NonNull<Stamp>,
}

impl Reader {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let public = service::topic(bus, kind, Side::Public)?;
        match kind.side(bus.part()) {
            Side::Public => Self::of(bus, kind.name, &public, kind.qos.observers),
            Side::Actors => Ok(Self {
                _public: Some(Here::new(public)),
                ..Self::of(
                    bus,
                    kind.name,
                    &service::topic(bus, kind, Side::Actors)?,
                    kind.qos.observers,
                )?
            }),
        }
    }

    /// A reader of a topic that another process has described. The description does not say how
    /// many observers the topic admits, so observers leave an eighth of the places free for actors.
    pub(crate) fn of_found(
        bus: &Bus,
        name: &str,
        service: &TopicService,
    ) -> Result<Self, PortError> {
        let places = service.static_config().max_subscribers();
        Self::of(bus, name, service, places - places / 8)
    }

    /// A reader of `service`, which belongs to the topic called `name`.
    #[inline(never)]
    fn of(
        bus: &Bus,
        name: &str,
        service: &TopicService,
        observers: usize,
    ) -> Result<Self, PortError> {
        let limits = service.static_config();
        let no_place = || {
            let topic = name.to_owned();
            Fault::Full(if bus.part().is_observer() {
                let limit = observers;
                PortError::TooManyObservers { topic, limit }
            } else {
                let limit = limits.max_subscribers();
                PortError::TooManyReaders { topic, limit }
            })
        };
        let unreached = Arc::new(AtomicU32::new(0));
        let port = patiently(bus, name, || {
            unreached.store(0, Ordering::Relaxed);
            let missed = Arc::clone(&unreached);
            let subscriber = service
                .subscriber_builder()
                .name(bus.port_name())
                // The samples of other writers are received all the same.
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
            // Counts when the new reader has its place, so that two readers that come at once
            // cannot both get the last place.
            if bus.part().is_observer() && observing(service) > observers {
                return Err(no_place());
            }
            Ok(subscriber)
        })?;
        Ok(Self {
            port: Rc::new(Here::new(port)),
            payload_align: limits.message_type_details().payload.alignment(),
            holds: limits.history_size() > 0,
            // Taken after the port exists: a publisher that is younger has seen the port since its
            // start.
            streams: Streams::new(Clock::monotonic_ns()),
            newest: Newest::default(),
            unreached,
            _public: None,
        })
    }

    /// Whether the topic keeps its last sample for readers that come later.
    pub(crate) fn holds(&self) -> bool {
        self.holds
    }

    /// How many samples can wait for this reader.
    pub(crate) fn queue(&self) -> usize {
        self.port.buffer_size()
    }

    /// To be asked whether samples wait.
    pub(crate) fn peek(&self) -> Peek {
        Peek(Rc::downgrade(&self.port))
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

    /// The newest of all waiting samples, if it is newer than any that this has returned before.
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
    /// The payload's address, valid while this is. No process writes to it meanwhile.
    pub(crate) fn payload(&self) -> NonNull<u8> {
        self.payload
    }

    pub(crate) fn stamp(&self) -> &Stamp {
        // SAFETY: the service's header is a `Stamp` (`Kind::header`). The reader holds the sample,
        // and its writer does not change it before it is given back.
        unsafe { self.stamp.as_ref() }
    }
}

fn observing(service: &TopicService) -> usize {
    let mut observers = 0;
    service.dynamic_config().list_subscribers(|details| {
        if name::parse_port(details.subscriber_name.as_str())
            .is_some_and(|(_, _, observes)| observes)
        {
            observers += 1;
        }
        CallbackProgression::Continue
    });
    observers
}
