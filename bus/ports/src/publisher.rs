//! [`Publisher`]: sends the samples of a topic.
//!
//! A sample first goes to the topic's actors. Then the publisher rings them. Then everybody else
//! gets a copy with the same stamp from the service under the topic's name
//! ([`Qos::copied`](lager_sample::Qos)). So the actors do not wait while the writer fills the
//! queues of 64 observers and takes back the samples that they have returned.
//!
//! What a publish costs: for each sample, iceoryx2 visits every place for a subscriber of the
//! service three times, whether the place is taken or not. With one service of 74 places that was
//! most of the 4 939 instructions of `publish/to-1`. With the 10 places of the actors' service it
//! was 2 957; with observers counted only when one has come or gone (`untyped/anyone`), 2 363; with
//! iceoryx2's loop kept in registers (`untyped/outlet`), 2 272. With 63 observers too it is 35 489,
//! but their part comes after the ring. The cost is instructions, not cache misses: boxing the
//! places' contents, so that these lie side by side, changed nothing (1.65 and 1.67 us a hop).

use core::fmt;
use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use lager_home::Clock;
use lager_sample::{Stamp, Topic};

use crate::bus::Bus;
use crate::cause::Cause;
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

    /// Takes a sample that the caller fills in place. It starts as the payload's blank value.
    ///
    /// # Errors
    /// Too many samples are on loan, or the transport failed.
    pub fn loan(&self) -> Result<Loan<'_, T>, SendError> {
        self.filled(T::Payload::default())
    }

    /// Takes a sample with whatever payload lay there: zeros, or an earlier sample. For large
    /// payloads that the caller fills completely, so that they need not be made blank first.
    ///
    /// # Errors
    /// As [`Publisher::loan`].
    pub fn loan_uninit(&self) -> Result<Loan<'_, T>, SendError> {
        Ok(self.lent(self.writer.lend()?))
    }

    /// Sends a copy of `payload` with the cause `cause`.
    ///
    /// # Errors
    /// As [`Publisher::loan`] and [`Loan::send`].
    pub fn send(&self, cause: Cause, payload: T::Payload) -> Result<(), SendError> {
        let mut loan = self.filled(payload)?;
        loan.cause(cause);
        loan.send()
    }

    /// Sends the last sample to observers, if [`Loan::send_ahead`] has kept it back from them.
    ///
    /// # Errors
    /// The transport failed. Observers count the sample as lost.
    pub fn catch_up(&self) -> Result<(), SendError> {
        self.writer.catch_up()
    }

    /// Sends their history to readers that have come since the last sample. A thread that waits in
    /// a [`lager_wake::Waiter`] need not call this; any other writer of a state must call it
    /// regularly. It costs next to nothing when there are no new readers.
    pub fn tick(&self) {
        self.writer.tick();
    }

    /// When this publisher was made; with the process id it identifies the publisher's stream.
    pub fn epoch(&self) -> u64 {
        self.writer.epoch()
    }

    /// Samples sent so far.
    pub fn sent(&self) -> u64 {
        self.writer.sent()
    }

    /// Sends a recorded sample with its recorded stamp: times, writer, epoch and number. For
    /// players of recordings: readers see the original writer's sample, as old as it is.
    ///
    /// # Errors
    /// As [`Publisher::loan`] and [`Loan::send`].
    pub fn replay(&self, payload: T::Payload, stamp: Stamp) -> Result<(), SendError> {
        let loan = self.filled(payload)?;
        self.writer.deliver_stamped(loan.lent, stamp, To::All)
    }

    /// Sends a sample of another writer again, with its original times.
    pub(crate) fn resend(&self, payload: T::Payload, original: &Stamp) -> Result<(), SendError> {
        let mut loan = self.filled(payload)?;
        loan.cause(Cause::of(original));
        loan.deliver(original.publish_time_ns, To::All)
    }

    /// A sample with `payload` in it.
    #[allow(unsafe_code, reason = "the loan knows where its payload is, not what")]
    fn filled(&self, payload: T::Payload) -> Result<Loan<'_, T>, SendError> {
        let lent = self.writer.lend()?;
        // SAFETY: the writer was made with `Kind::of::<T>()`, so there is room for a payload, and
        // only this loan uses that room.
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

/// A sample that the caller is writing. If it is dropped unsent, nobody notices.
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
    /// The transport failed. The sample's number is used up, so readers count it as lost.
    pub fn send(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), To::All)
    }

    /// Sends the sample to the topic's actors and rings them. Observers get it with
    /// [`Publisher::catch_up`], with the publisher's next sample, or when the publisher is dropped.
    /// For a thread that must do something more urgent first. If it is killed before it catches up,
    /// observers miss this sample.
    ///
    /// # Errors
    /// As [`Loan::send`].
    pub fn send_ahead(self) -> Result<(), SendError> {
        self.deliver(Clock::monotonic_ns(), To::Actors)
    }

    /// Sends the sample without ringing. Actors find it when another ring or their time-out wakes
    /// them. For samples that no actor must act upon at once, so that no process wakes in vain.
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
        // SAFETY: the memory was shared before, so it is initialised; any bits are a valid payload
        // (`Field`); and nobody else uses the loan until it is sent.
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
