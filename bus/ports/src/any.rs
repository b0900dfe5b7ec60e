//! Writing any topic by its name, for tools that are given payloads as text or as recorded: of the
//! table, or one that this process was not built with and somebody has open.

use core::fmt;

use lager_topics::{Description, Stamp, Topic, TopicVisitor, bytes_of, visit};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::error::{PortError, SendError};
use crate::publisher::Publisher;
use crate::untyped::Foreign;

/// The writing end of a topic by its name; stays in the thread that made it.
pub struct AnyPublisher {
    name: String,
    description: Description,
    blank: Box<[u8]>,
    end: Box<dyn End>,
}

impl AnyPublisher {
    /// `None` if the topic is in no table and no process has it open.
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<Self>, PortError> {
        if let Ok(opened) = visit(name, Open { bus }) {
            return opened.map(Some);
        }
        let found = Foreign::new(bus, name)?;
        Ok(found.map(|(end, description)| Self {
            name: name.to_owned(),
            // Nobody says what a field has that was never written.
            blank: vec![0; description.size()].into(),
            description,
            end: Box::new(end),
        }))
    }

    /// The topic's name behind `lager/<robot>/`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How its samples are laid out.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The bytes of a payload of which no field was written.
    pub fn blank(&self) -> &[u8] {
        &self.blank
    }

    /// Whether the topic holds its last sample for those who come later.
    pub fn holds(&self) -> bool {
        self.end.holds()
    }

    /// Sends a payload as of now, and rings those who act on the topic.
    ///
    /// # Errors
    /// As [`Publisher::send`].
    ///
    /// # Panics
    /// When there are not as many bytes as [`AnyPublisher::blank`] has.
    pub fn send(&self, payload: &[u8]) -> Result<(), SendError> {
        self.end.send(payload)
    }

    /// Sends a recorded payload with the stamp that it had, as [`Publisher::replay`].
    ///
    /// # Errors
    /// As [`AnyPublisher::send`].
    ///
    /// # Panics
    /// As [`AnyPublisher::send`].
    pub fn replay(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        self.end.replay(payload, stamp)
    }

    /// Gives readers that have come since the last sample their history.
    pub fn tick(&self) {
        self.end.tick();
    }
}

impl fmt::Debug for AnyPublisher {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("AnyPublisher")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

struct Open<'a> {
    bus: &'a Bus,
}

impl TopicVisitor for Open<'_> {
    type Output = Result<AnyPublisher, PortError>;

    fn visit<T: Topic>(self) -> Self::Output {
        Ok(AnyPublisher {
            name: T::NAME.to_owned(),
            description: Description::of::<T::Payload>(),
            blank: bytes_of(&T::Payload::default()).into(),
            end: Box::new(Publisher::<T>::new(self.bus)?),
        })
    }
}

/// What takes the bytes.
trait End {
    fn send(&self, payload: &[u8]) -> Result<(), SendError>;

    fn replay(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError>;

    fn tick(&self);

    fn holds(&self) -> bool;
}

impl<T: Topic> End for Publisher<T> {
    fn send(&self, payload: &[u8]) -> Result<(), SendError> {
        Self::send(self, Cause::OWN, typed::<T>(payload))
    }

    fn replay(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        Self::replay(self, typed::<T>(payload), stamp)
    }

    fn tick(&self) {
        Self::tick(self);
    }

    fn holds(&self) -> bool {
        T::QOS.history > 0
    }
}

/// The payload that these bytes are.
#[allow(unsafe_code, reason = "bytes are read as a payload")]
fn typed<T: Topic>(payload: &[u8]) -> T::Payload {
    assert_eq!(payload.len(), size_of::<T::Payload>(), "a payload's bytes");
    // SAFETY: there are as many bytes as a payload has, and any bits are one (`Field`).
    unsafe { payload.as_ptr().cast::<T::Payload>().read_unaligned() }
}

impl End for Foreign {
    fn send(&self, payload: &[u8]) -> Result<(), SendError> {
        let sequence = self.next_sequence.get();
        self.next_sequence.set(sequence + 1);
        let publish_time_ns = Clock::monotonic_ns();
        let stamp = Cause::OWN.stamp(Stamp {
            sequence,
            publish_time_ns,
            epoch: self.epoch,
            writer: std::process::id(),
            ..Stamp::default()
        });
        self.deliver(payload, stamp)
    }

    fn replay(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        self.deliver(payload, stamp)
    }

    fn tick(&self) {
        Self::tick(self);
    }

    fn holds(&self) -> bool {
        self.holds
    }
}
