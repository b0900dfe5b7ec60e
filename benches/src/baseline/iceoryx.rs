//! The baseline of bare iceoryx2, used as in its own examples: its `ipc` service and its ports.
//!
//! It comes in three variants. The first has the typed ports' header ([`Stamp`]) and limits; the
//! second has their limits, but neither header nor clock; the third has iceoryx2's own defaults.
//! The limits include the transport's configuration, which is the robot's ([`Member::join`]). A
//! receiver looks without pause, or sleeps on an iceoryx2 event that the sender notifies after
//! publishing.
//! that the sender notifies after publishing.

use core::fmt::Debug;
use core::mem::MaybeUninit;
use core::time::Duration;
use std::error::Error;
use std::time::Instant;

use iceoryx2::config::Config;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    LogLevel, Node, NodeBuilder, ServiceName, SignalHandlingMode, ZeroCopySend, ipc, set_log_level,
};
use iceoryx2::service::port_factory::{event, publish_subscribe};
use lager_home::Clock;
use lager_ports::BusConfig;
use lager_sample::{Qos, Stamp};

use super::{End, Slept, TIME_OUT, sleep_until, spin};
use crate::error::{BenchError, Fault, broken};
use crate::sample::Sample;

/// The listeners of an event: iceoryx2's default.
pub(crate) const LISTENERS: usize = 16;

/// The number of samples that a subscriber may hold, as in the typed ports.
const MAX_HELD: usize = 4;

/// The header in front of each sample.
pub(crate) trait Header: Copy + Debug + Default + ZeroCopySend + 'static {
    /// The header of the first sample of a stream that this process begins now.
    fn first() -> Self {
        Self::default()
    }

    /// The header of the next sample.
    fn next(self) -> Self {
        self
    }
}

impl Header for Stamp {
    fn first() -> Self {
        Self {
            epoch: Clock::monotonic_ns(),
            writer: std::process::id(),
            ..Self::default()
        }
    }

    fn next(self) -> Self {
        let now = Clock::monotonic_ns();
        Self {
            sequence: self.sequence + 1,
            source_time_ns: now,
            publish_time_ns: now,
            ..self
        }
    }
}

impl Header for () {}

/// A process's membership in the transport.
pub(crate) struct Member {
    node: Node<ipc::Service>,
    limits: Option<Qos>,
}

impl Member {
    /// Joins the transport of that bus. Its configuration is that of the typed ports, with as many
    /// places for unread samples of writers that have ended. Topics get the limits `limits`; `None`
    /// = iceoryx2's own defaults, except for the folders.
    pub(crate) fn join(bus: &BusConfig, limits: Option<Qos>) -> Result<Self, BenchError> {
        set_log_level(LogLevel::Fatal);
        let mut config = config(bus)?;
        if limits.is_none() {
            config.defaults = Config::default().defaults;
        }
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create()
            .map_err(|error| failed("a node", error))?;
        Ok(Self { node, limits })
    }

    /// A publisher of the payload `P`.
    pub(crate) fn sender<P: Debug + ZeroCopySend + 'static, H: Header>(
        &self,
        name: &str,
    ) -> Result<Sender<P, H>, BenchError> {
        let publisher = patiently("a publisher", || {
            Ok(self.topic(name)?.publisher_builder().create()?)
        })?;
        let header = H::first();
        Ok(Sender { publisher, header })
    }

    /// A subscriber to the payload `P`.
    pub(crate) fn subscriber<P: Debug + ZeroCopySend, H: Header>(
        &self,
        name: &str,
    ) -> Result<Subscriber<ipc::Service, P, H>, BenchError> {
        patiently("a subscriber", || {
            Ok(self.topic(name)?.subscriber_builder().create()?)
        })
    }

    /// The notifier of an event, which wakes all its listeners.
    pub(crate) fn notifier(
        &self,
        name: &str,
        listeners: usize,
    ) -> Result<Notifier<ipc::Service>, BenchError> {
        patiently("a notifier", || {
            Ok(self.event(name, listeners)?.notifier_builder().create()?)
        })
    }

    /// A listener of an event.
    pub(crate) fn listener(
        &self,
        name: &str,
        listeners: usize,
    ) -> Result<Listener<ipc::Service>, BenchError> {
        patiently("a listener", || {
            Ok(self.event(name, listeners)?.listener_builder().create()?)
        })
    }

    fn topic<P: Debug + ZeroCopySend, H: Header>(
        &self,
        name: &str,
    ) -> Result<publish_subscribe::PortFactory<ipc::Service, P, H>, Box<dyn Error>> {
        let builder = self
            .node
            .service_builder(&ServiceName::new(name)?)
            .publish_subscribe::<P>()
            .user_header::<H>();
        let builder = match &self.limits {
            None => builder,
            Some(qos) => builder
                .max_publishers(qos.max_publishers())
                .max_subscribers(qos.max_subscribers())
                .max_nodes(qos.max_nodes())
                .subscriber_max_buffer_size(qos.buffer)
                .subscriber_max_borrowed_samples(MAX_HELD)
                .history_size(qos.history)
                .enable_safe_overflow(true),
        };
        Ok(builder.open_or_create()?)
    }

    fn event(
        &self,
        name: &str,
        listeners: usize,
    ) -> Result<event::PortFactory<ipc::Service>, Box<dyn Error>> {
        Ok(self
            .node
            .service_builder(&ServiceName::new(name)?)
            .event()
            .max_listeners(listeners)
            // A listener looks at every possible id on each wake, so one id is the fastest.
            .event_id_max_value(0)
            .open_or_create()?)
    }
}

/// The configuration that `lager config --iceoryx2` shows.
fn config(bus: &BusConfig) -> Result<Config, BenchError> {
    const WHAT: &str = "its configuration";
    let shown = bus.iceoryx2_toml().map_err(|error| failed(WHAT, error))?;
    toml::from_str(&shown).map_err(|error| failed(WHAT, error))
}

fn failed(what: &str, detail: impl Debug) -> BenchError {
    BenchError::Bus(format!(
        "bare iceoryx2: {what} could not be had: {detail:?}"
    ))
}

/// Tries again while the other process is creating or removing the same thing.
fn patiently<T>(
    what: &str,
    mut attempt: impl FnMut() -> Result<T, Box<dyn Error>>,
) -> Result<T, BenchError> {
    const PATIENCE: Duration = Duration::from_secs(3);
    let start = Instant::now();
    loop {
        match attempt() {
            Ok(made) => return Ok(made),
            Err(error) if start.elapsed() >= PATIENCE => return Err(failed(what, error)),
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

/// A publisher that fills in a header.
pub(crate) struct Sender<P: Debug + ZeroCopySend + 'static, H: Header> {
    publisher: Publisher<ipc::Service, P, H>,
    header: H,
}

impl<P: Copy + Debug + ZeroCopySend + 'static, H: Header> Sender<P, H> {
    pub(crate) fn send(&mut self, payload: &P) -> Result<(), Fault> {
        self.send_written(|place| {
            place.write(*payload);
        })
    }

    /// Sends a sample of which `write` writes every byte.
    #[allow(unsafe_code)]
    pub(crate) fn send_written(
        &mut self,
        write: impl FnOnce(&mut MaybeUninit<P>),
    ) -> Result<(), Fault> {
        let mut loan = self.publisher.loan_uninit().map_err(broken)?;
        self.header = self.header.next();
        *loan.user_header_mut() = self.header;
        write(loan.payload_mut());
        // SAFETY: the payload was written just now.
        let loan = unsafe { loan.assume_init() };
        loan.send().map_err(broken)?;
        Ok(())
    }
}

/// Publishes to `out` and subscribes to `back`, with a receiver that looks without pause.
pub(crate) fn polling<H: Header>(
    member: &Member,
    [out, back]: [&str; 2],
) -> Result<impl End + use<H>, BenchError> {
    let subscriber = member.subscriber::<Sample, H>(back)?;
    let mut sender = member.sender::<Sample, H>(out)?;
    let send = move |sample: &Sample| sender.send(sample);
    Ok((send, move || spin(|| receive(&subscriber))))
}

/// The same with a receiver that sleeps on an event.
pub(crate) fn listening(
    member: &Member,
    [out, back]: [&str; 2],
) -> Result<impl End + use<>, BenchError> {
    let listener = member.listener(back, LISTENERS)?;
    let notifier = member.notifier(out, LISTENERS)?;
    let subscriber = member.subscriber::<Sample, Stamp>(back)?;
    let mut sender = member.sender::<Sample, Stamp>(out)?;
    let send = move |sample: &Sample| {
        sender.send(sample)?;
        notifier.notify().map_err(broken)?;
        Ok(())
    };
    Ok((send, move || {
        sleep_until(|| receive(&subscriber), asleep_on(&listener))
    }))
}

/// Sleeps until the event is notified.
pub(crate) fn asleep_on(
    listener: &Listener<ipc::Service>,
) -> impl FnMut() -> Result<Slept, Fault> + use<'_> {
    || match listener.timed_wait(|_| (), TIME_OUT) {
        Ok(0) => Ok(Slept::TimedOut),
        Ok(_) => Ok(Slept::Woken),
        Err(error) => Err(broken(error)),
    }
}

/// The next sample, if there is one.
fn receive<H: Header>(
    subscriber: &Subscriber<ipc::Service, Sample, H>,
) -> Result<Option<Sample>, Fault> {
    let received = subscriber.receive().map_err(broken)?;
    Ok(received.map(|received| *received.payload()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_rig::Domain;

    #[test]
    fn the_same_limits_are_those_of_the_typed_ports_and_not_the_defaults() {
        let domain = Domain::new(crate::FAMILY).unwrap();
        let ours = config(&domain.config()).unwrap();
        let places = |config: &Config| {
            let streams = &config.defaults.publish_subscribe;
            streams.subscriber_expired_connection_buffer
        };
        assert_eq!(places(&ours), 16);
        assert_ne!(places(&Config::default()), 16);
        assert_eq!(
            toml::to_string(&ours).unwrap(),
            domain.config().iceoryx2_toml().unwrap()
        );
    }
}
