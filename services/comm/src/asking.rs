//! Requests to other services, put by a thread of their own: an answer may take a while, and the
//! conversation waits for nobody.

use core::time::Duration;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use lager_ports::{Bus, Client, PortError, Ringer};
use lager_topics::Request;

use crate::tasks::Tasks;

/// How long the other service may take to answer, in real time.
const ANSWER: Duration = Duration::from_millis(500);

/// The thread for one kind of request, from outside. It ends when this is dropped.
#[derive(Debug)]
pub(crate) struct Asking<R: Request> {
    to: Option<SyncSender<(u32, R::Request)>>,
    from: Receiver<(u32, Result<R::Reply, String>)>,
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
    /// Its place on the bus cannot be had, or there is no thread.
    pub(crate) fn new(bus: &Bus, ringer: Ringer) -> Result<Self, PortError> {
        // There are never more under way than the conversation lets be.
        let (to, asked) = sync_channel::<(u32, R::Request)>(Tasks::MOST);
        let (answers, from) = sync_channel(Tasks::MOST);
        let (ready, begun) = sync_channel(1);
        let bus = bus.clone();
        let work = move || {
            // A port stays in the thread that made it.
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
                let answer = answer.map_err(|error| error.to_string());
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

    /// Puts a request; whether somebody will answer it.
    pub(crate) fn ask(&self, id: u32, request: R::Request) -> bool {
        let to = self.to.as_ref();
        to.is_some_and(|to| to.try_send((id, request)).is_ok())
    }

    /// The next answer, with what was put.
    pub(crate) fn answer(&self) -> Option<(u32, Result<R::Reply, String>)> {
        self.from.try_recv().ok()
    }
}

impl<R: Request> Drop for Asking<R> {
    fn drop(&mut self) {
        self.to = None;
        // It may wait for a place among the answers.
        while self.from.try_recv().is_ok() {}
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
