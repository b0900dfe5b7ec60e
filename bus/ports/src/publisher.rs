//! The writing end of a topic.
//!
//! A sample goes to the topic's actors first, then they are rung, and then everybody else gets a
//! copy with the same stamp on the service under the topic's name
//! ([`Qos::copied`](lager_topics::Qos)). So neither the queues of 64 observers nor what they have
//! returned stands between a sample and who acts on it.
//!
//! What a publish costs: for each sample iceoryx2 visits every place for a subscriber of the
//! service three times, whether it is taken or not. With one service of 74 places that was most of
//! the 4 939 instructions of `publish/to-1`; with the 10 places of the actors' service it took
//! 2 957, 2 363 since the places of observers are counted only when one has come or gone
//! (`untyped/anyone`), and 2 272 since the compiler keeps iceoryx2's loop in registers
//! (`untyped/outlet`). With 63 observers beside the actor it takes 35 489; what they cost comes
//! after the ring. The cost is instructions, not cache misses: boxing what stands in the places, so
//! that the places lie side by side, was measured and changes nothing (1.65 and 1.67 us a hop).

use core::fmt;
use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use lager_topics::{Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
use crate::clock::Clock;
use crate::error::{PortError, SendError};
use crate::kind::Kind;
use crate::untyped::{Lent, To, Writer};

/// The writing end of a topic; stays in the thread that made it.
///
/// Sending never waits for a reader and does not allocate, except when a reader has come or gone.
pub struct Publisher<T: Topic> {
    writer: Writer,
    topic: PhantomData<T>,
}

impl<T: Topic> Publisher<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            writer: Writer::new(bus, &Kind::of::<T>())?,
            topic: PhantomData,
        })
    }

    /// Takes a sample to be filled in place; it starts as the payload's blank value.
    ///
    /// # Errors
    /// Too many samples are on loan, or the transport failed.
    pub fn loan(&self) -> Result<Loan<'_, T>, SendError> {
        self.filled(T::Payload::default())
    }

    /// Takes a sample whose payload is whatever lay there: zeros, or an earlier sample. For large
    /// payloads that are filled anyway, which this saves from being blanked first.
    ///
    /// # Errors
    /// As [`Publisher::loan`].
    pub fn loan_uninit(&self) -> Result<Loan<'_, T>, SendError> {
        Ok(self.lent(self.writer.lend()?))
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

    /// Hands the last sample to observers, if it was sent with [`Loan::send_ahead`] and that has
    /// not been done yet.
    ///
    /// # Errors
    /// The transport failed; observers count the sample as lost.
    pub fn catch_up(&self) -> Result<(), SendError> {
        self.writer.catch_up()
    }

    /// Gives readers that have come since the last sample their history. A thread that waits in a
    /// [`crate::Waiter`] need not call it; another writer of a state calls it regularly. It costs
    /// next to nothing when there are no new readers.
    pub fn tick(&self) {
        self.writer.tick();
    }

    /// Start of this publisher's life; with the process it names its stream.
    pub fn epoch(&self) -> u64 {
        self.writer.epoch()
    }

    /// Samples sent so far.
    pub fn sent(&self) -> u64 {
        self.writer.sent()
    }

    /// Sends a recorded sample with the stamp that it had: times, writer, epoch and number. For
    /// players of recordings; readers take it for that writer's, as old as it is.
    ///
    /// # Errors
    /// As [`Publisher::loan`] and [`Loan::send`].
    pub fn replay(&self, payload: T::Payload, stamp: Stamp) -> Result<(), SendError> {
        let loan = self.filled(payload)?;
        self.writer.deliver_stamped(loan.lent, stamp, To::All)
    }

    /// Sends with the times of an earlier sample of another writer.
    pub(crate) fn resend(&self, payload: T::Payload, original: &Stamp) -> Result<(), SendError> {
        let mut loan = self.filled(payload)?;
        loan.cause(Cause::of(original));
        loan.deliver(original.publish_time_ns, To::All)
    }

    /// A sample with `payload` in it.
    #[allow(unsafe_code, reason = "the loan knows where its payload is, not what")]
    fn filled(&self, payload: T::Payload) -> Result<Loan<'_, T>, SendError> {
        let lent = self.writer.lend()?;
        // SAFETY: the writer was made with `Kind::of::<T>()`, so there is room for a payload, which
        // is the loan's alone.
        unsafe { lent.payload().cast::<T::Payload>().write(payload) };
        Ok(self.lent(lent))
    }

    fn lent(&self, lent: Lent) -> Loan<'_, T> {
        Loan {
            lent,
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
            .field("epoch", &self.epoch())
            .field("sent", &self.sent())
            .finish_non_exhaustive()
    }
}

/// A sample that is being written; dropped unsent it leaves no trace.
#[must_use = "a loan that is not sent reaches nobody"]
pub struct Loan<'publisher, T: Topic> {
    lent: Lent,
    publisher: &'publisher Publisher<T>,
    cause: Cause,
}

impl<T: Topic> Loan<'_, T> {
    /// Sets the cause of the sample; without this it is [`Cause::OWN`].
    pub fn cause(&mut self, cause: Cause) {
        self.cause = cause;
    }

    /// Sends the sample to the topic's actors and rings them, then sends it to everybody else.
    ///
    /// # Errors
    /// The transport failed; the sample's number is used up, so those who did not get it count it
    /// as lost.
    pub fn send(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), To::All)
    }

    /// Sends the sample to the topic's actors and rings them. Observers get it with
    /// [`Publisher::catch_up`], with the publisher's next sample, or when the publisher is dropped.
    /// For a thread that has something more urgent to do first; if it is killed before it catches
    /// up, observers miss this sample.
    ///
    /// # Errors
    /// As [`Loan::send`].
    pub fn send_ahead(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), To::Actors)
    }

    /// Sends the sample without ringing: actors find it when another ring or their time-out wakes
    /// them. For samples that no actor has to act upon at once, so that no process is woken in
    /// vain.
    ///
    /// # Errors
    /// As [`Loan::send`].
    pub fn send_quietly(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), To::AllQuietly)
    }

    fn deliver(self, publish_time_ns: u64, to: To) -> Result<(), SendError> {
        let writer = &self.publisher.writer;
        writer.deliver(self.lent, self.cause, publish_time_ns, to)
    }
}

impl<T: Topic> Deref for Loan<'_, T> {
    type Target = T::Payload;

    #[allow(unsafe_code, reason = "the loan knows where its payload is, not what")]
    fn deref(&self) -> &T::Payload {
        // SAFETY: the memory was shared before and so is initialised, any bits are a payload
        // (`Field`), and the loan is ours until it is sent.
        unsafe { self.lent.payload().cast().as_ref() }
    }
}

impl<T: Topic> DerefMut for Loan<'_, T> {
    #[allow(unsafe_code, reason = "the loan knows where its payload is, not what")]
    fn deref_mut(&mut self) -> &mut T::Payload {
        // SAFETY: as in `deref`, and nobody else has the loan.
        unsafe { self.lent.payload().cast().as_mut() }
    }
}
