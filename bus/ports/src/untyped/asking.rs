//! Both sides of a request without its types: `Asker` sends the bytes, `Answerer` replies.

use core::ptr::NonNull;
use core::time::Duration;
use std::time::Instant;

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::ReceiveError as IpcReceiveError;
use iceoryx2::port::client::Client;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, CallbackProgression, PortFactory};
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::server::ServerCreateError;
use iceoryx2::service::static_config::message_type_details::TypeDetail;

use super::behind;
use crate::bus::Bus;
use crate::error::{CallError, PortError, ReceiveError};
use crate::fault::TransportFault;
use crate::here::{Here, ends_here};
use crate::kind::{Bytes, Header, Question};
use crate::patience::{Fault, patiently};
use crate::service::{self, MAX_CLIENTS, MAX_SERVERS, RequestService};
use crate::transport::Ipc;
use lager_wake::PartRinger;

/// How often an asker looks for its answer. Askers are not actors, so no ring wakes them.
const LOOK_EVERY: Duration = Duration::from_micros(200);

/// [`crate::Client`] without its types.
pub(crate) struct Asker {
    port: Here<AskingPort>,
    question: Question,
    ringer: PartRinger,
}

struct AskingPort {
    client: Client<Ipc, Bytes, Header, Bytes, Header>,
    service: RequestService,
}

type Pending = PendingResponse<Ipc, Bytes, Header, Bytes, Header>;
type AnsweringPort = Server<Ipc, Bytes, Header, Bytes, Header>;
type Active = ActiveRequest<Ipc, Bytes, Header, Bytes, Header>;

ends_here!(AskingPort, AnsweringPort, Active);

impl Asker {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, question: Question) -> Result<Self, PortError> {
        let ringer = PartRinger::to(bus.board(), question.actor, question.id)
            .map_err(|fault| PortError::of_bell(question.actor, fault))?;
        let service = service::request(bus, &question)?;
        let client = patiently(bus, question.name, || {
            service
                .client_builder()
                .name(bus.port_name())
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    ClientCreateError::ExceedsMaxSupportedClients => {
                        Fault::Full(PortError::TooManyWriters {
                            topic: question.name.to_owned(),
                            limit: MAX_CLIENTS,
                        })
                    }
                    other => service::no_resources(question.name, other),
                })
        })?;
        Ok(Self {
            port: Here::new(AskingPort { client, service }),
            question,
            ringer,
        })
    }

    /// Sends the bytes of a request and waits for those of the reply, at most until `start` +
    /// `timeout`, in real time.
    #[inline(never)]
    pub(crate) fn call(
        &self,
        request: &[u8],
        reply: &mut [u8],
        start: Instant,
        timeout: Duration,
    ) -> Result<(), CallError> {
        let mut asked = Vec::new();
        let mut pending = None;
        loop {
            let present = self.servers();
            if present.iter().any(|server| !asked.contains(server)) {
                // The earlier request is withdrawn before it is sent again.
                drop(pending.take());
                let question = self.ask(request)?;
                if question.number_of_server_connections() > 0 {
                    asked = present;
                    pending = Some(question);
                }
            }
            if let Some(question) = &pending {
                // SAFETY: the reply is read as bytes, and it has as many as the service states.
                match unsafe { question.receive_custom_payload() } {
                    Ok(Some(answer)) => {
                        let details = self.port.service.static_config();
                        let details = details.response_message_type_details();
                        copy_out(answer.user_header(), &details.payload, reply);
                        return Ok(());
                    }
                    Ok(None) => (),
                    Err(error) => return Err(self.failed(error)),
                }
            }
            if start.elapsed() >= timeout {
                let (request, actor) = (self.question.name, self.question.actor);
                return Err(if asked.is_empty() {
                    CallError::NoServer { request, actor }
                } else {
                    CallError::NoAnswer { request, actor }
                });
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn ask(&self, request: &[u8]) -> Result<Pending, CallError> {
        // SAFETY: a payload of a fixed size is one element, and that is how the transport counts.
        let loan = unsafe { self.port.client.loan_custom_payload(1) };
        let mut loan = loan.map_err(|error| self.failed(error))?;
        let details = self.port.service.static_config();
        let details = details.request_message_type_details();
        copy_in(loan.user_header_mut(), &details.payload, request);
        // SAFETY: all of its bytes have been written.
        let loan = unsafe { loan.assume_init() };
        let pending = loan.send().map_err(|error| self.failed(error))?;
        self.ringer.ring();
        Ok(pending)
    }

    fn servers(&self) -> Vec<u128> {
        let mut servers = Vec::new();
        self.port.service.dynamic_config().list_servers(|details| {
            servers.push(details.server_id.value());
            CallbackProgression::Continue
        });
        servers
    }

    fn failed(&self, error: impl Into<TransportFault>) -> CallError {
        CallError::Transport {
            request: self.question.name,
            fault: error.into(),
        }
    }
}

/// [`crate::Server`] without its types.
pub(crate) struct Answerer {
    port: Here<AnsweringPort>,
    request: TypeDetail,
    reply: TypeDetail,
}

/// A request that waits for its reply.
pub(crate) struct Asked<'answerer> {
    active: Here<Active>,
    answerer: &'answerer Answerer,
}

impl Answerer {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, question: &Question) -> Result<Self, PortError> {
        let service = service::request(bus, question)?;
        let port = patiently(bus, question.name, || {
            service
                .server_builder()
                .name(bus.port_name())
                .max_loaned_responses_per_request(1)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
                .map_err(|error| match error {
                    ServerCreateError::ExceedsMaxSupportedServers => {
                        Fault::Full(PortError::TooManyReaders {
                            topic: question.name.to_owned(),
                            limit: MAX_SERVERS,
                        })
                    }
                    other => service::no_resources(question.name, other),
                })
        })?;
        let details = service.static_config();
        Ok(Self {
            port: Here::new(port),
            request: details.request_message_type_details().payload,
            reply: details.response_message_type_details().payload,
        })
    }

    /// The next request.
    #[inline(never)]
    pub(crate) fn next(&self) -> Result<Option<Asked<'_>>, ReceiveError> {
        match self.port.receive() {
            Ok(active) => Ok(active.map(|active| Asked {
                active: Here::new(active),
                answerer: self,
            })),
            Err(IpcReceiveError::ExceedsMaxBorrows) => Err(ReceiveError::TooManyHeld { limit: 1 }),
            Err(other) => Err(ReceiveError::Transport(other.into())),
        }
    }
}

impl Asked<'_> {
    /// Copies the bytes of the request.
    #[inline(never)]
    pub(crate) fn copy_to(&self, request: &mut [u8]) {
        copy_out(self.active.user_header(), &self.answerer.request, request);
    }

    /// Sends the reply. If the asker is gone by now, it needs none.
    #[inline(never)]
    pub(crate) fn answer(self, reply: &[u8]) {
        // SAFETY: a payload of a fixed size is one element, and that is how the transport counts.
        let Ok(mut loan) = (unsafe { self.active.loan_custom_payload(1) }) else {
            return;
        };
        copy_in(loan.user_header_mut(), &self.answerer.reply, reply);
        // SAFETY: all of its bytes have been written.
        let _ = unsafe { loan.assume_init() }.send();
    }
}

/// Copies the payload. The header is empty.
fn copy_out(header: &Header, payload: &TypeDetail, to: &mut [u8]) {
    assert_eq!(to.len(), payload.size());
    let from = behind(NonNull::from(header), 0, payload.alignment());
    // SAFETY: the payload has as many bytes as the service states, and any bytes are a valid value.
    unsafe { from.copy_to_nonoverlapping(NonNull::from(to).cast(), payload.size()) }
}

/// Writes the payload of a loan. The header is empty.
fn copy_in(header: &mut Header, payload: &TypeDetail, from: &[u8]) {
    assert_eq!(from.len(), payload.size());
    let to = behind(NonNull::from(header), 0, payload.alignment());
    // SAFETY: the loan has room for as many bytes as the service states, and is the caller's alone.
    unsafe { to.copy_from_nonoverlapping(NonNull::from(from).cast(), payload.size()) }
}
