//! Asking and answering: for what must be confirmed, such as a change of mode.
//!
//! Both sides may be killed and restarted at any time. A question is put again to an answering
//! process that appears while its asker waits, and is forgotten when its asker gives up.

use core::fmt;
use core::time::Duration;
use std::time::Instant;

use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::ReceiveError as IpcReceiveError;
use iceoryx2::port::client::Client as IpcClient;
use iceoryx2::port::server::Server as IpcServer;
use iceoryx2::prelude::{BackpressureStrategy, CallbackProgression, PortFactory};
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::server::ServerCreateError;
use lager_topics::Request;

use crate::bus::Bus;
use crate::doorbell::Rope;
use crate::error::{CallError, PortError, ReceiveError};
use crate::service::{self, Fault, MAX_CLIENTS, MAX_SERVERS, RequestService, patiently};
use crate::transport::Ipc;

type Ask<R> = <R as Request>::Request;
type Answer<R> = <R as Request>::Reply;

/// The asking side of a request; stays in the thread that made it.
pub struct Client<R: Request> {
    inner: IpcClient<Ipc, Ask<R>, (), Answer<R>, ()>,
    service: RequestService<R>,
    rope: Rope,
}

/// How often an asker looks for its answer. Nobody wakes it, since askers are not actors.
const LOOK_EVERY: Duration = Duration::from_micros(200);

impl<R: Request> Client<R> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        let rope = Rope::to(bus, R::ACTOR, R::ID)?;
        let service = service::request::<R>(bus)?;
        let inner = patiently(bus, R::NAME, || {
            service
                .client_builder()
                .name(bus.port_name())
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    ClientCreateError::ExceedsMaxSupportedClients => {
                        Fault::Full(PortError::TooManyWriters {
                            topic: R::NAME.to_owned(),
                            limit: MAX_CLIENTS,
                        })
                    }
                    other => service::no_resources(R::NAME, other),
                })
        })?;
        Ok(Self {
            inner,
            service,
            rope,
        })
    }

    /// Asks and waits for the answer, at most `timeout` of real time.
    ///
    /// A question that was put to a process which then died is put again to its successor, if
    /// that appears in time; so a request must be harmless when carried out twice.
    ///
    /// # Errors
    /// Nobody answers such requests, or not in time.
    pub fn call(&self, request: Ask<R>, timeout: Duration) -> Result<Answer<R>, CallError> {
        let start = Instant::now();
        let mut asked = Vec::new();
        let mut pending = None;
        loop {
            let present = self.servers();
            if present.iter().any(|server| !asked.contains(server)) {
                // The earlier question is withdrawn before it is put again.
                drop(pending.take());
                let question = self.ask(request)?;
                if question.number_of_server_connections() > 0 {
                    asked = present;
                    pending = Some(question);
                }
            }
            if let Some(question) = &pending {
                match question.receive() {
                    Ok(Some(answer)) => return Ok(*answer.payload()),
                    Ok(None) => (),
                    Err(error) => return Err(transport::<R>(error)),
                }
            }
            if start.elapsed() >= timeout {
                return Err(if asked.is_empty() {
                    CallError::NoServer {
                        request: R::NAME,
                        actor: R::ACTOR,
                    }
                } else {
                    CallError::NoAnswer {
                        request: R::NAME,
                        actor: R::ACTOR,
                    }
                });
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    #[allow(clippy::type_complexity)]
    fn ask(
        &self,
        request: Ask<R>,
    ) -> Result<PendingResponse<Ipc, Ask<R>, (), Answer<R>, ()>, CallError> {
        let question = self.inner.send_copy(request).map_err(transport::<R>)?;
        self.rope.ring();
        Ok(question)
    }

    fn servers(&self) -> Vec<u128> {
        let mut servers = Vec::new();
        self.service.dynamic_config().list_servers(|details| {
            servers.push(details.server_id.value());
            CallbackProgression::Continue
        });
        servers
    }
}

fn transport<R: Request>(error: impl fmt::Debug) -> CallError {
    CallError::Transport {
        request: R::NAME,
        detail: format!("{error:?}"),
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
    inner: IpcServer<Ipc, Ask<R>, (), Answer<R>, ()>,
}

impl<R: Request> Server<R> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        let service = service::request::<R>(bus)?;
        let inner = patiently(bus, R::NAME, || {
            service
                .server_builder()
                .name(bus.port_name())
                .max_loaned_responses_per_request(1)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    ServerCreateError::ExceedsMaxSupportedServers => {
                        Fault::Full(PortError::TooManyReaders {
                            topic: R::NAME.to_owned(),
                            limit: MAX_SERVERS,
                        })
                    }
                    other => service::no_resources(R::NAME, other),
                })
        })?;
        Ok(Self { inner })
    }

    /// Answers everything that has been asked; returns how much that was.
    ///
    /// # Errors
    /// The transport failed; what was answered before stays answered.
    pub fn serve(
        &self,
        mut answer: impl FnMut(&Ask<R>) -> Answer<R>,
    ) -> Result<usize, ReceiveError> {
        let mut answered = 0;
        loop {
            match self.inner.receive() {
                Ok(Some(question)) => {
                    let reply = answer(question.payload());
                    // An asker that is gone by now needs no answer.
                    let _ = question.send_copy(reply);
                    answered += 1;
                }
                Ok(None) => return Ok(answered),
                Err(IpcReceiveError::ExceedsMaxBorrows) => {
                    return Err(ReceiveError::TooManyHeld { limit: 1 });
                }
                Err(other) => return Err(ReceiveError::Transport(format!("{other:?}"))),
            }
        }
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
