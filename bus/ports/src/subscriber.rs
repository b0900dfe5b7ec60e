//! [`Subscriber`]: receives the samples of a topic.

use core::fmt;
use core::marker::PhantomData;
use core::ops::Deref;

use lager_home::Clock;
use lager_sample::{Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::error::{PortError, ReceiveError};
use crate::kind::Kind;
use crate::untyped::{Reader, Taken};
use crate::watcher::Watcher;

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

    /// The next sample, oldest first; `None` when there is no further sample. A state's older
    /// values come first too; to act on a state, call [`Subscriber::latest`].
    ///
    /// # Errors
    /// Too many samples are held, or the transport failed.
    pub fn receive(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        Ok(self.reader.receive()?.map(Sample::of))
    }

    /// Receives all waiting samples and returns the one published last; `None` if none is newer
    /// than the sample returned before. For topics that carry a state.
    ///
    /// If it fails midway, it returns what it found before; a lasting failure comes with the next
    /// call.
    ///
    /// # Errors
    /// As [`Subscriber::receive`], if no newer sample came before the failure. The caller may hold
    /// at most two samples during the call.
    pub fn latest(&mut self) -> Result<Option<Sample<T>>, ReceiveError> {
        Ok(self.reader.latest()?.map(Sample::of))
    }

    /// Lets each of its samples wake the thread of `watcher`. An actor has a
    /// [`Waiter`](lager_wake::Waiter) instead, which is woken first.
    pub fn wakes(&self, watcher: &mut Watcher) {
        watcher.add(T::ID, self.reader.peek());
    }

    /// How many writers this reader could not connect to, now or earlier: a writer was killed, or
    /// this process has no resources left. Samples of such writers do not arrive.
    pub fn unreached(&self) -> u32 {
        self.reader.unreached()
    }

    /// How many samples this reader missed, exactly, over all writers: every number that was
    /// skipped, and for a writer younger than this subscriber also the numbers before the first
    /// sample received. Up to date at each received sample. A restarted writer is not a loss.
    ///
    /// A writer that came and went while this reader received nothing is not counted.
    pub fn lost(&self) -> u64 {
        self.reader.streams().lost()
    }

    /// Samples received.
    pub fn received(&self) -> u64 {
        self.reader.streams().received()
    }

    /// How many writers were heard so far; a restarted writer counts again.
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

/// A received sample, read where the writer wrote it. A reader may hold at most four at a time.
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

    /// The stamp: when, why and by which process the sample was published, and its number.
    pub fn stamp(&self) -> &Stamp {
        self.taken.stamp()
    }

    /// This sample, received now, as the cause of another sample. Call it right after receiving. It
    /// reads the clock, so call it only for samples that cause others.
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
        // SAFETY: the reader was made with `Kind::of::<T>()`, so a payload is there, and any bytes
        // are a valid one. The reader holds the sample, so the writer does not change it.
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
