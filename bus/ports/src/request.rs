//! [`Client`] and [`Server`]: a request and its reply, for orders that the receiver must confirm,
//! such as a change of mode.
//!
//! Either process may be killed and restarted at any time. If an answering process appears while
//! the asker waits, the asker sends its request again. A request whose asker gives up is dropped.

use core::fmt;
use core::marker::PhantomData;
use core::time::Duration;
use std::time::Instant;

use lager_home::Clock;
use lager_sample::{Payload, Request};

use crate::bus::Bus;
use crate::error::{CallError, PortError, ReceiveError};
use crate::kind::Question;
use crate::untyped::{Answerer, Asker};

type Ask<R> = <R as Request>::Request;
type Reply<R> = <R as Request>::Reply;

/// The asking side of a request; stays in the thread that made it.
pub struct Client<R: Request> {
    asker: Asker,
    request: PhantomData<R>,
}

impl<R: Request> Client<R> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            asker: Asker::new(bus, Question::of::<R>())?,
            request: PhantomData,
        })
    }

    /// Asks and waits for the answer, at most `timeout` of real time. The request carries that
    /// deadline: an actor that finds the request later must not act on it any more.
    ///
    /// If the answering process dies and a successor appears in time, this asks the successor. So a
    /// request that is carried out twice must do no harm.
    ///
    /// # Errors
    /// No process answers such requests, or none answers in time.
    pub fn call(&self, mut request: Ask<R>, timeout: Duration) -> Result<Reply<R>, CallError> {
        let start = Instant::now();
        let lifetime_ms = u32::try_from(timeout.as_millis()).unwrap_or(u32::MAX);
        R::date(&mut request, Clock::monotonic_ns(), lifetime_ms);
        let mut reply = Reply::<R>::default();
        self.asker
            .call(bytes(&request), bytes_mut(&mut reply), start, timeout)?;
        Ok(reply)
    }
}

impl<R: Request> fmt::Debug for Client<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Client")
            .field("request", &R::NAME)
            .finish_non_exhaustive()
    }
}

/// The answering side of a request; stays in the thread that made it. Askers ring the waiter of
/// the request's actor.
pub struct Server<R: Request> {
    answerer: Answerer,
    request: PhantomData<R>,
}

impl<R: Request> Server<R> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            answerer: Answerer::new(bus, &Question::of::<R>())?,
            request: PhantomData,
        })
    }

    /// Answers all requests that are waiting; returns their number.
    ///
    /// # Errors
    /// The transport failed. Requests answered before that stay answered.
    pub fn serve(
        &self,
        mut answer: impl FnMut(&Ask<R>) -> Reply<R>,
    ) -> Result<usize, ReceiveError> {
        let mut answered = 0;
        while let Some(asked) = self.answerer.next()? {
            let mut request = Ask::<R>::default();
            asked.copy_to(bytes_mut(&mut request));
            asked.answer(bytes(&answer(&request)));
            answered += 1;
        }
        Ok(answered)
    }
}

impl<R: Request> fmt::Debug for Server<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Server")
            .field("request", &R::NAME)
            .finish_non_exhaustive()
    }
}

/// A payload as the bytes that other processes see.
#[allow(unsafe_code, reason = "a payload is its bytes")]
fn bytes<P: Payload>(payload: &P) -> &[u8] {
    // SAFETY: a payload has no padding (`lager_sample::payload!`), so all of its bytes have values.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(payload).cast(), size_of::<P>()) }
}

/// A payload to be filled with the bytes that another process has sent.
#[allow(unsafe_code, reason = "a payload is its bytes")]
fn bytes_mut<P: Payload>(payload: &mut P) -> &mut [u8] {
    // SAFETY: a payload has no padding, and any bytes are a valid one (`lager_sample::Field`).
    unsafe { core::slice::from_raw_parts_mut(core::ptr::from_mut(payload).cast(), size_of::<P>()) }
}
