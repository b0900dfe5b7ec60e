//! Writes samples to any topic by its name. For tools that send typed or recorded payloads. The
//! topic is in the application's table, or else another process has it open.

use core::fmt;

use lager_home::Clock;
use lager_sample::{Description, Stamp};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::error::{PortError, SendError};
use crate::kind::Kind;
use crate::untyped::{Foreign, Lent, To, Writer};

/// The writing end of a topic given by its name; stays in the thread that made it.
pub struct AnyPublisher {
    name: String,
    description: Description,
    blank: Vec<u8>,
    holds: bool,
    end: End,
}

/// The writer that takes the payload's bytes.
enum End {
    /// For a topic in the application's table.
    Known(Box<Writer>),
    /// For a topic that is not in the table.
    Foreign(Foreign),
}

impl AnyPublisher {
    /// `None` if the topic is not in the table and no process has it open.
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<Self>, PortError> {
        if let Some(entry) = bus.application().entry(name) {
            let kind = Kind::of_entry(entry);
            return Ok(Some(Self {
                name: name.to_owned(),
                description: Description::of_make(&kind.make()),
                blank: (entry.blank)(),
                holds: kind.qos.history > 0,
                end: End::Known(Box::new(Writer::new(bus, &kind)?)),
            }));
        }
        let found = Foreign::new(bus, name)?;
        Ok(found.map(|(end, description)| Self {
            name: name.to_owned(),
            // Such a topic states no default values, so a field that nobody writes is 0.
            blank: vec![0; description.size()],
            description,
            holds: end.holds,
            end: End::Foreign(end),
        }))
    }

    /// The topic's name behind `<family>/<unit>/`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The layout of the topic's samples.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The bytes of a payload in which no field has been written.
    pub fn blank(&self) -> &[u8] {
        &self.blank
    }

    /// Whether the topic keeps its last sample for readers that come later.
    pub fn holds(&self) -> bool {
        self.holds
    }

    /// Sends a payload, stamped with the present time, and rings the topic's actors.
    ///
    /// # Errors
    /// As [`Publisher::send`](crate::Publisher::send).
    ///
    /// # Panics
    /// If `payload` has not as many bytes as [`AnyPublisher::blank`].
    pub fn send(&self, payload: &[u8]) -> Result<(), SendError> {
        let now_ns = Clock::monotonic_ns();
        match &self.end {
            End::Known(writer) => {
                let lent = self.filled(writer, payload)?;
                writer.deliver(lent, Cause::OWN, now_ns, To::All)
            }
            End::Foreign(end) => end.send(payload, now_ns),
        }
    }

    /// Sends a recorded payload with its recorded stamp, as
    /// [`Publisher::replay`](crate::Publisher::replay) does.
    ///
    /// # Errors
    /// As [`AnyPublisher::send`].
    ///
    /// # Panics
    /// As [`AnyPublisher::send`].
    pub fn replay(&self, payload: &[u8], stamp: Stamp) -> Result<(), SendError> {
        match &self.end {
            End::Known(writer) => {
                let lent = self.filled(writer, payload)?;
                writer.deliver_stamped(lent, stamp, To::All)
            }
            End::Foreign(end) => end.deliver(payload, stamp),
        }
    }

    /// Sends their history to readers that have come since the last sample.
    pub fn tick(&self) {
        match &self.end {
            End::Known(writer) => writer.tick(),
            End::Foreign(end) => end.tick(),
        }
    }

    fn filled(&self, writer: &Writer, payload: &[u8]) -> Result<Lent, SendError> {
        assert_eq!(payload.len(), self.blank.len(), "a payload's bytes");
        let lent = writer.lend()?;
        lent.fill(payload);
        Ok(lent)
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
