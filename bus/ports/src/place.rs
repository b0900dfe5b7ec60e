//! [`Place`]: where a unit's samples come from, for tools that show or record them: its bus, or on
//! another computer whatever carries the bus there.

use std::error::Error;
use std::time::Duration;

use lager_home::{BusWatch, Clock, UnitName};
use lager_sample::Topic;

use crate::bus::Bus;
use crate::error::{IntrospectError, PortError};
use crate::found::Found;
use crate::introspect::TopicInfo;
use crate::source::Source;
use crate::subscriber::Subscriber;
use crate::watcher::Watcher;

/// What a watch tells changes of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// Topics that come and go.
    Topics,
    /// Also their writers and readers.
    Ends,
}

/// The time by which a place's samples are stamped, as far as it is known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StampTime {
    /// The clock of the stamps now, in ns.
    pub now_ns: u64,
    /// How far that may be wrong, in ns; 0 if this machine has the same clock.
    pub unsure_ns: u64,
    /// What has to be added to a stamp's time for the ns since 1970.
    pub unix_offset_ns: i64,
}

impl StampTime {
    /// Now, by this machine's own clock.
    pub fn here() -> Self {
        Self {
            now_ns: Clock::monotonic_ns(),
            unsure_ns: 0,
            unix_offset_ns: Clock::unix_offset_ns(),
        }
    }

    /// The present time for a sample that was published at `published_ns`; `None` if nobody can tell
    /// which of both was first.
    pub fn after(&self, published_ns: u64) -> Option<u64> {
        let is_known = self.now_ns.saturating_sub(published_ns) >= self.unsure_ns;
        is_known.then_some(self.now_ns)
    }
}

/// Why a place cannot be read, whichever it is.
#[derive(Debug, thiserror::Error)]
pub enum PlaceError {
    /// A topic of the bus cannot be opened.
    #[error(transparent)]
    Open(PortError),
    /// The state of the bus cannot be read.
    #[error(transparent)]
    Look(IntrospectError),
    /// A place elsewhere says why.
    #[error(transparent)]
    Elsewhere(Box<dyn Error + Send + Sync>),
}

impl PlaceError {
    /// The error of any place.
    pub fn of(error: impl Error + Send + Sync + 'static) -> Self {
        let error: Box<dyn Error + Send + Sync> = Box::new(error);
        let error = match error.downcast() {
            Ok(error) => return Self::Open(*error),
            Err(error) => error,
        };
        match error.downcast() {
            Ok(error) => Self::Look(*error),
            Err(error) => Self::Elsewhere(error),
        }
    }
}

/// A place where the samples of one unit come from.
pub trait Place {
    /// The reading end of a topic whose type this program has.
    type Typed<T: Topic>: Source + 'static;
    /// The reading end of a topic that describes itself.
    type Found: Source + 'static;
    /// Why a topic cannot be opened.
    type OpenError: Error + Send + Sync + 'static;
    /// Why nobody can tell which topics there are.
    type LookError: Error + Send + Sync + 'static;
    /// Remembers what was there.
    type Watch;

    /// The unit whose samples they are.
    fn unit(&self) -> &UnitName;

    /// Whether samples can still come. Once they cannot, they never will.
    fn may_still_tell(&self) -> bool;

    /// Opens a topic by its type; `None` if it is not there, or has another layout there.
    ///
    /// # Errors
    /// It is there and cannot be read.
    fn typed<T: Topic>(&self) -> Result<Option<Self::Typed<T>>, Self::OpenError>;

    /// Opens a topic by its name; `None` if it is not there.
    ///
    /// # Errors
    /// It is there and cannot be read.
    fn described(&self, name: &str) -> Result<Option<Self::Found>, Self::OpenError>;

    /// A watcher, for this thread, which samples of this place can wake; `None` if nobody rings for
    /// them here.
    ///
    /// # Errors
    /// It cannot be made.
    fn watcher(&self) -> Result<Option<Watcher>, Self::OpenError> {
        Ok(None)
    }

    /// Every topic that is there, of this unit.
    ///
    /// # Errors
    /// Nobody can tell.
    fn every_topic(&self) -> Result<Vec<TopicInfo>, Self::LookError>;

    /// A watch over the topics.
    fn watch(&self, of: Watched) -> Self::Watch;

    /// Whether something has come or gone; also true at the first call.
    fn has_changed(&self, watch: &mut Self::Watch) -> bool;

    /// The part that a process plays there, if that is known.
    fn role_of(&self, pid: u32) -> Option<String>;

    /// Whether the unit's processes are those of this machine.
    fn is_here(&self) -> bool;

    /// The time of the stamps.
    fn time(&self) -> StampTime;

    /// The unit's own time, which may be slower or faster, at a moment of the stamps' clock in ns;
    /// `None` before that is known.
    fn unit_time(&self) -> Option<(u64, Duration)>;

    /// How long a span of the unit's own time takes.
    fn real(&self, unit: Duration) -> Duration;
}

impl Place for Bus {
    type Typed<T: Topic> = Subscriber<T>;
    type Found = Found;
    type OpenError = PortError;
    type LookError = IntrospectError;
    type Watch = [Option<BusWatch>; 2];

    fn unit(&self) -> &UnitName {
        Self::unit(self)
    }

    fn may_still_tell(&self) -> bool {
        self.is_listed()
    }

    fn typed<T: Topic>(&self) -> Result<Option<Subscriber<T>>, PortError> {
        self.subscriber().map(Some)
    }

    fn described(&self, name: &str) -> Result<Option<Found>, PortError> {
        self.found(name)
    }

    fn watcher(&self) -> Result<Option<Watcher>, PortError> {
        Self::watcher(self).map(Some)
    }

    fn every_topic(&self) -> Result<Vec<TopicInfo>, IntrospectError> {
        let mut topics = self.topics()?;
        topics.retain(|topic| topic.unit == *self.unit());
        Ok(topics)
    }

    fn watch(&self, of: Watched) -> Self::Watch {
        let ends = (of == Watched::Ends).then(BusWatch::of_ports);
        [Some(BusWatch::of_services()), ends]
    }

    fn has_changed(&self, watch: &mut Self::Watch) -> bool {
        let mut is_other = false;
        // All of them, so that each knows what is there now.
        for watch in watch.iter_mut().flatten() {
            is_other |= watch.has_changed(self.home());
        }
        is_other
    }

    fn role_of(&self, pid: u32) -> Option<String> {
        let nodes = self.nodes().unwrap_or_default().into_iter();
        let mut parts = nodes.filter_map(|node| node.part.filter(|_| node.pid == pid));
        parts.next()
    }

    fn is_here(&self) -> bool {
        true
    }

    fn time(&self) -> StampTime {
        StampTime::here()
    }

    fn unit_time(&self) -> Option<(u64, Duration)> {
        let now_ns = Clock::monotonic_ns();
        Some((now_ns, self.clock().now()))
    }

    fn real(&self, unit: Duration) -> Duration {
        self.clock().real(unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_the_bus_is_known_among_those_of_any_place() {
        let topic = "a/b".to_owned();
        let error = PlaceError::of(PortError::OtherVersion { topic });
        assert!(matches!(
            error,
            PlaceError::Open(PortError::OtherVersion { .. })
        ));
        let error = PlaceError::of(std::io::Error::other("no link"));
        assert_eq!(error.to_string(), "no link");
        assert!(matches!(error, PlaceError::Elsewhere(_)));
    }

    #[test]
    fn a_sample_that_may_be_of_the_future_has_no_age() {
        let time = StampTime {
            now_ns: 1_000,
            unsure_ns: 100,
            unix_offset_ns: 0,
        };
        assert_eq!(time.after(900), Some(1_000));
        assert_eq!(time.after(901), None);
        assert_eq!(time.after(2_000), None);
        let exact = StampTime {
            unsure_ns: 0,
            ..time
        };
        assert_eq!(exact.after(1_000), Some(1_000));
    }
}
