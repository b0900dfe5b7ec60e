//! Sends requests to other services in a thread of its own: an answer may take a while, and the
//! conversation must not wait.

use core::time::Duration;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use lager_operator::Orders;
use lager_orders::{Code, Reason};
use lager_ports::{Bus, CallError, Client, PortError};
use lager_sample::Request;
use lager_wake::Ringer;

/// How many requests may be under way; there are never more actions.
const MOST: usize = Orders::<()>::MOST;

/// How long the other service may take to answer, in real time.
const ANSWER: Duration = Duration::from_millis(500);

/// The thread for one kind of request, seen from outside. It ends when this is dropped.
#[derive(Debug)]
pub(crate) struct Asking<R: Request> {
    to: Option<SyncSender<(u32, R::Request)>>,
    from: Receiver<(u32, Result<R::Reply, Reason>)>,
    thread: Option<JoinHandle<()>>,
}

impl<R: Request> Asking<R>
where
    R::Request: Send,
    R::Reply: Send,
{
    /// Starts the thread. Each answer rings.
    ///
    /// # Errors
    /// The client cannot be opened on the bus, or the system gives no thread.
    pub(crate) fn new(bus: &Bus, ringer: Ringer) -> Result<Self, PortError> {
        // The conversation never has more under way.
        let (to, asked) = sync_channel::<(u32, R::Request)>(MOST);
        let (answers, from) = sync_channel(MOST);
        let (ready, begun) = sync_channel(1);
        let bus = bus.clone();
        let work = move || {
            // A port must stay in the thread that made it.
            let client: Client<R> = match bus.client() {
                Ok(client) => {
                    let _ = ready.send(Ok(()));
                    client
                }
                Err(error) => {
                    let _ = ready.send(Err(error));
                    return;
                }
            };
            while let Ok((id, request)) = asked.recv() {
                let answer = client.call(request, ANSWER);
                let answer = answer.map_err(unanswered);
                if answers.send((id, answer)).is_err() {
                    return;
                }
                ringer.ring();
            }
        };
        let thread = Builder::new()
            .spawn(work)
            .map_err(|error| PortError::Thread {
                what: "requests",
                fault: error.into(),
            })?;
        if let Ok(begun) = begun.recv() {
            begun?;
        }
        Ok(Self {
            to: Some(to),
            from,
            thread: Some(thread),
        })
    }

    /// Sends a request. Returns whether an answer will come.
    pub(crate) fn ask(&self, id: u32, request: R::Request) -> bool {
        let to = self.to.as_ref();
        to.is_some_and(|to| to.try_send((id, request)).is_ok())
    }

    /// The next answer, with its request.
    pub(crate) fn answer(&self) -> Option<(u32, Result<R::Reply, Reason>)> {
        self.from.try_recv().ok()
    }
}

/// Why nobody has answered.
fn unanswered(error: CallError) -> Reason {
    match error {
        CallError::NoServer { actor, .. } => Reason::new(Code::NotRunning, &[&actor]),
        CallError::NoAnswer { actor, .. } => Reason::new(Code::Unanswered, &[&actor]),
        CallError::Transport { .. } => Reason::new(Code::Misread, &[&error]),
    }
}

impl<R: Request> Drop for Asking<R> {
    fn drop(&mut self) {
        self.to = None;
        // The thread may wait for room among the answers.
        while self.from.try_recv().is_ok() {}
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
