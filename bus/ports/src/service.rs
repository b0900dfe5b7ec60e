//! Opens services of iceoryx2: their names, limits and layout check, and what each refusal means.
//!
//! The public service of a topic has places for its observers, two for each actor, and some for
//! further readers (`Qos::max_subscribers`). So keepers and restarted services get a place even
//! when all places of observers are taken. A process counts the observers, itself included, and
//! gives up its place if there are too many. The actors' own service, if a topic has one, admits
//! actors only (`Qos::max_acting`). Both services have the same layout, queue and history. A
//! process that has the actors' service open has the public one open too, so a tool finds each
//! topic in use by its name.

use iceoryx2::prelude::{PortFactory, Service, ServiceName};
use iceoryx2::service::builder::event::EventOpenOrCreateError;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use iceoryx2::service::builder::request_response::RequestResponseOpenOrCreateError;
use iceoryx2::service::messaging_pattern::MessagingPattern;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use lager_home::{Shortage, UnitName};
use lager_sample::Description;

use crate::bus::Bus;
use crate::error::PortError;
use crate::fault::{Difference, Refusal, TransportFault};
use crate::kind::{Bytes, Header, Kind, Question, Side};
use crate::name;
use crate::patience::{Fault, patiently};
use crate::schema::{self, required};
use crate::transport::Ipc;

/// Samples a subscriber may hold at the same time.
pub(crate) const MAX_HELD: usize = 4;

/// Samples a publisher may have on loan at the same time.
pub(crate) const MAX_LOANS: usize = 2;

/// Places for clients, servers and processes of a request; a sweep frees those of killed processes.
pub(crate) const MAX_CLIENTS: usize = 32;
pub(crate) const MAX_SERVERS: usize = 4;
const MAX_REQUEST_NODES: usize = MAX_CLIENTS + MAX_SERVERS + 16;

/// Places for listeners of plain iceoryx2 on one topic, and the highest event number there. Each
/// number costs a listener time, and writers use only the number 0.
const MAX_STANDARD_LISTENERS: usize = 16;
const MAX_EVENT_ID: usize = 3;

pub(crate) type TopicService = publish_subscribe::PortFactory<Ipc, Bytes, Header>;

pub(crate) type RequestService = request_response::PortFactory<Ipc, Bytes, Header, Bytes, Header>;

pub(crate) type EventService = event::PortFactory<Ipc>;

/// Opens a service of a topic, or creates it with the limits that the table gives.
pub(crate) fn topic(bus: &Bus, kind: &Kind, side: Side) -> Result<TopicService, PortError> {
    let name = side.name(kind.name);
    patiently(bus, kind.name, || {
        let qos = kind.qos;
        let nodes = qos.max_nodes();
        let limited = || {
            Ok(builder(bus, bus.unit(), &name, &kind.detail())?
                .max_publishers(qos.max_publishers())
                .max_subscribers(side.places(&qos))
                .max_nodes(nodes)
                .subscriber_max_buffer_size(qos.buffer)
                .subscriber_max_borrowed_samples(MAX_HELD)
                .history_size(qos.history)
                .enable_safe_overflow(true))
        };
        match limited()?.open_with_attributes(&required(kind.layout())) {
            Err(PublishSubscribeOpenError::DoesNotExist) => limited()?
                .create_with_attributes(&schema::stated(&kind.make(), kind.layout()))
                .map_err(|error| meant(kind.name, nodes, error)),
            opened => opened.map_err(|error| meant(kind.name, nodes, error)),
        }
    })
}

/// Opens a service of a unit's topic if it exists. Never creates it.
pub(crate) fn existing_topic(
    bus: &Bus,
    unit: &UnitName,
    kind: &Kind,
    side: Side,
) -> Result<Option<TopicService>, PortError> {
    let name = side.name(kind.name);
    patiently(bus, kind.name, || {
        match builder(bus, unit, &name, &kind.detail())?
            .open_with_attributes(&required(kind.layout()))
        {
            Ok(service) => Ok(Some(service)),
            Err(
                PublishSubscribeOpenError::DoesNotExist
                | PublishSubscribeOpenError::IsMarkedForDestruction,
            ) => Ok(None),
            Err(error) => Err(meant(kind.name, kind.qos.max_nodes(), error)),
        }
    })
}

/// Opens a service of a topic that need not be in this process's table, and returns the description
/// that the topic's creator stated. `None` if the topic does not exist.
pub(crate) fn found(
    bus: &Bus,
    unit: &UnitName,
    topic: &str,
    side: Side,
) -> Result<Option<(TopicService, Description)>, PortError> {
    if !name::may_be_topic(topic) {
        return Ok(None);
    }
    let service = side.name(topic);
    let name = service.as_str();
    let differs = |difference| {
        let topic = name.to_owned();
        Fault::Lasting(PortError::OtherLayout { topic, difference })
    };
    patiently(bus, name, || {
        let full = service_name(bus, unit, name)?;
        let pattern = MessagingPattern::PublishSubscribe;
        let details = Ipc::details(&full, bus.transport(), pattern)
            .map_err(|_| Fault::Passing(TransportFault::InMotion))?;
        let Some(details) = details.map(|found| found.static_details) else {
            return Ok(None);
        };
        let description = schema::described(details.attributes()).map_err(differs)?;
        let types = details.publish_subscribe().message_type_details();
        let is_as_described = types.payload.variant() == TypeVariant::FixedSize
            && types.payload.size() == description.size()
            && types.user_header == Kind::header();
        if !is_as_described {
            return Err(differs(Difference::Type));
        }
        match builder(bus, unit, name, &types.payload)?.open() {
            Ok(service) if service.attributes() == details.attributes() => {
                Ok(Some((service, description)))
            }
            Ok(_) => Err(Fault::Passing(TransportFault::InMotion)),
            Err(
                PublishSubscribeOpenError::DoesNotExist
                | PublishSubscribeOpenError::IsMarkedForDestruction,
            ) => Ok(None),
            Err(error) => Err(meant(name, 0, error)),
        }
    })
}

#[allow(
    unsafe_code,
    reason = "the transport believes what it is told of the types"
)]
fn builder(
    bus: &Bus,
    unit: &UnitName,
    name: &str,
    payload: &TypeDetail,
) -> Result<iceoryx2::service::builder::publish_subscribe::Builder<Bytes, Header, Ipc>, Fault> {
    let builder = bus
        .node()
        .service_builder(&service_name(bus, unit, name)?)
        .publish_subscribe::<Bytes>()
        .user_header::<Header>();
    // SAFETY: the header is the one that the typed ports use. The payload is theirs too, or the one
    // that the service itself states.
    Ok(unsafe {
        builder
            .__internal_set_payload_type_details(payload)
            .__internal_set_user_header_type_details(&Kind::header())
    })
}

/// Opens or creates the service of a request.
#[allow(
    unsafe_code,
    reason = "the transport believes what it is told of the types"
)]
pub(crate) fn request(bus: &Bus, question: &Question) -> Result<RequestService, PortError> {
    patiently(bus, question.name, || {
        let builder = bus
            .node()
            .service_builder(&service_name(bus, bus.unit(), question.name)?)
            .request_response::<Bytes, Bytes>()
            .request_user_header::<Header>()
            .response_user_header::<Header>();
        // SAFETY: the typed ends read and write exactly these types.
        let builder = unsafe {
            builder
                .__internal_set_request_payload_type_details(&(question.request)())
                .__internal_set_response_payload_type_details(&(question.reply)())
                .__internal_set_request_header_type_details(&Question::header())
                .__internal_set_response_header_type_details(&Question::header())
        };
        builder
            .max_clients(MAX_CLIENTS)
            .max_servers(MAX_SERVERS)
            .max_nodes(MAX_REQUEST_NODES)
            .max_active_requests_per_client(2)
            .max_loaned_requests(1)
            .max_response_buffer_size(1)
            .max_borrowed_responses_per_pending_response(1)
            .enable_safe_overflow_for_requests(true)
            .enable_safe_overflow_for_responses(true)
            // So that no server carries out a request whose asker has given up.
            .enable_fire_and_forget_requests(false)
            .open_or_create_with_attributes(&required(question.layout))
            .map_err(|error| {
                use RequestResponseOpenOrCreateError as Either;
                let refusal = match error {
                    Either::RequestResponseOpenError(error) => error.into(),
                    Either::RequestResponseCreateError(error) => error.into(),
                    Either::SystemInFlux => Refusal::Passing(TransportFault::InMotion),
                };
                meant(question.name, MAX_REQUEST_NODES, refusal)
            })
    })
}

/// Opens or creates the event service beside a topic, for listeners of plain iceoryx2.
pub(crate) fn event(bus: &Bus, kind: &Kind) -> Result<EventService, PortError> {
    patiently(bus, kind.name, || {
        bus.node()
            .service_builder(&service_name(bus, bus.unit(), kind.name)?)
            .event()
            .max_listeners(MAX_STANDARD_LISTENERS)
            .max_notifiers(kind.qos.max_publishers())
            .max_nodes(kind.qos.max_nodes())
            .event_id_max_value(MAX_EVENT_ID)
            .open_or_create()
            .map_err(|error| {
                use EventOpenOrCreateError as Either;
                let refusal = match error {
                    Either::EventOpenError(error) => error.into(),
                    Either::EventCreateError(error) => error.into(),
                    Either::SystemInFlux => Refusal::Passing(TransportFault::InMotion),
                };
                meant(kind.name, kind.qos.max_nodes(), refusal)
            })
    })
}

fn service_name(bus: &Bus, unit: &UnitName, topic: &str) -> Result<ServiceName, Fault> {
    let name = name::service(bus.application(), unit, topic);
    ServiceName::new(&name).map_err(|_| {
        Fault::Lasting(PortError::Transport {
            topic: topic.to_owned(),
            fault: TransportFault::NameTooLong,
        })
    })
}

/// The error that a refusal means for the topic or request called `name`.
fn meant(name: &str, nodes: usize, refusal: impl Into<Refusal>) -> Fault {
    let topic = name.to_owned();
    match refusal.into() {
        Refusal::Passing(fault) => Fault::Passing(fault),
        Refusal::Differs(difference) => {
            Fault::Lasting(PortError::OtherLayout { topic, difference })
        }
        Refusal::Permission => Fault::Lasting(PortError::Permission { topic }),
        Refusal::Version => Fault::Lasting(PortError::OtherVersion { topic }),
        Refusal::Crowded => Fault::Full(PortError::TooManyProcesses {
            topic,
            limit: nodes,
        }),
    }
}

/// The error of a port that could not be made because a resource is used up.
pub(crate) fn no_resources(topic: &str, fault: impl Into<TransportFault>) -> Fault {
    let topic = topic.to_owned();
    Fault::Lasting(match Shortage::now() {
        Some(shortage) => PortError::Short { topic, shortage },
        None => PortError::Transport {
            topic,
            fault: fault.into(),
        },
    })
}
