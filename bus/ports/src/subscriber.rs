//! The reading end of a topic.

use core::fmt;
use core::marker::PhantomData;
use core::ops::Deref;

use lager_topics::{Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::error::{PortError, ReceiveError};
use crate::kind::Kind;
use crate::untyped::{Reader, Taken};

/// The reading end of a topic; stays in the thread that made it.
pub struct Subscriber<T: Topic> {
    reader: Reader,
    topic: PhantomData<T>,
}

impl<T: Topic> Subscriber<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            reader: Reader::new(bus, &Kind::of::<T>())?,
            topic: PhantomData,
        })
    }

    /// The next sample, oldest first; `None` when there is nothing more. Of a state the older
    /// values come first, too: whoever acts on it calls [`Subscriber::latest`].
    ///
    /// # Errors
    /// Too many samples are held, or the transport failed.
    pub fn receive(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        Ok(self.reader.receive()?.map(Sample::of))
    }

    /// Drains the topic and returns what was published last; `None` if there is nothing newer
    /// than what this returned before. For topics that carry a state.
    ///
    /// A failure on the way leaves what was drained before it; if it lasts, the next call tells.
    ///
    /// # Errors
    /// As [`Subscriber::receive`], if nothing newer came before the failure; at most two samples
    /// may be held meanwhile.
    pub fn latest(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        Ok(self.reader.latest()?.map(Sample::of))
    }

    /// Writers that this reader could not connect to, now or earlier: they were killed, or this
    /// process has no resources left. Their samples do not arrive.
    pub fn unreached(&self) -> u32 {
        self.reader.unreached()
    }

    /// Samples missed, exactly, over all writers: every number that was skipped, and for a writer
    /// younger than this subscriber also what came before the first sample received. Known up to
    /// the last sample received. A restarted writer is no loss.
    ///
    /// A writer that came and went while nothing was received is not counted.
    pub fn lost(&self) -> u64 {
        self.reader.streams().lost()
    }

    /// Samples received.
    pub fn received(&self) -> u64 {
        self.reader.streams().received()
    }

    /// Writers heard so far, a restarted one counting again.
    pub fn writers_heard(&self) -> usize {
        self.reader.streams().heard()
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
    taken: Taken,
    topic: PhantomData<T>,
}

impl<T: Topic> Sample<T> {
    fn of(taken: Taken) -> Self {
        Self {
            taken,
            topic: PhantomData,
        }
    }

    /// The stamp: when, why and by whom it was published, and its number.
    pub fn stamp(&self) -> &Stamp {
        self.taken.stamp()
    }

    /// This sample as the cause of others, received now. Call it right after receiving. It reads
    /// the clock, so do not call it for samples that are only looked at.
    pub fn cause(&self) -> Cause {
        Cause::sample::<T>(self.stamp(), Clock::monotonic_ns())
    }
}

impl<T: Topic> Deref for Sample<T> {
    type Target = T::Payload;

    #[allow(
        unsafe_code,
        reason = "the sample knows where its payload is, not what"
    )]
    fn deref(&self) -> &T::Payload {
        // SAFETY: the reader was made with `Kind::of::<T>()`, so a payload is there, of which any
        // bytes are one; the sample is held, and its writer does not touch it meanwhile.
        unsafe { self.taken.payload().cast().as_ref() }
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
