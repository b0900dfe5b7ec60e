//! Opening services: names, limits, the layout check, and what each refusal means.
//!
//! A topic admits 64 observers, twice its actors and 8 further subscribers
//! ([`Qos::max_subscribers`]). So keepers and restarted services get a place even when observers
//! have taken all of theirs; the 65th observer is counted and refused.

use iceoryx2::node::Node;
use iceoryx2::prelude::{AttributeVerifier, SemanticString, ServiceName};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError, EventOpenOrCreateError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::builder::request_response::{
    RequestResponseCreateError, RequestResponseOpenError, RequestResponseOpenOrCreateError,
};
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use lager_topics::Qos;

use crate::bus::Bus;
use crate::error::PortError;
use crate::name::{self, RobotName};
pub(crate) use crate::patience::{Fault, patiently};
use crate::shortage::Shortage;
use crate::transport::Ipc;
use crate::untyped::{Bytes, Header, Kind, Question};

/// Samples a subscriber may hold at the same time.
pub(crate) const MAX_HELD: usize = 4;

/// Samples a publisher may have on loan at the same time.
pub(crate) const MAX_LOANS: usize = 2;

/// Clients, servers and processes of one request service; a killed one keeps its place until swept.
pub(crate) const MAX_CLIENTS: usize = 32;
pub(crate) const MAX_SERVERS: usize = 4;
const MAX_REQUEST_NODES: usize = MAX_CLIENTS + MAX_SERVERS + 16;

/// Listeners of plain iceoryx2 on one topic, and the highest number an event may have there: each
/// number costs a listener time, and writers use 0 only.
const MAX_STANDARD_LISTENERS: usize = 16;
const MAX_EVENT_ID: usize = 3;

const SCHEMA_KEY: &str = "lager.schema";

pub(crate) type TopicService = publish_subscribe::PortFactory<Ipc, Bytes, Header>;

pub(crate) type RequestService = request_response::PortFactory<Ipc, Bytes, Header, Bytes, Header>;

pub(crate) type EventService = event::PortFactory<Ipc>;

/// Opens or creates the service of a topic with the limits of the table.
pub(crate) fn topic(bus: &Bus, kind: &Kind) -> Result<TopicService, PortError> {
    patiently(bus, kind.name, || {
        let qos = kind.qos;
        builder(bus.node(), bus.robot(), kind)?
            .max_publishers(qos.max_publishers())
            .max_subscribers(qos.max_subscribers())
            .max_nodes(qos.max_nodes())
            .subscriber_max_buffer_size(qos.buffer)
            .subscriber_max_borrowed_samples(MAX_HELD)
            .history_size(qos.history)
            .enable_safe_overflow(true)
            .open_or_create_with_attributes(&layout(kind.layout))
            .map_err(|error| topic_fault(kind.name, &qos, error))
    })
}

/// Opens the service of a robot's topic if it exists. Never creates it.
pub(crate) fn existing_topic(
    bus: &Bus,
    robot: &RobotName,
    kind: &Kind,
) -> Result<Option<TopicService>, PortError> {
    patiently(bus, kind.name, || {
        match builder(bus.node(), robot, kind)?.open_with_attributes(&layout(kind.layout)) {
            Ok(service) => Ok(Some(service)),
            Err(
                PublishSubscribeOpenError::DoesNotExist
                | PublishSubscribeOpenError::IsMarkedForDestruction,
            ) => Ok(None),
            Err(error) => Err(topic_fault(
                kind.name,
                &kind.qos,
                PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(error),
            )),
        }
    })
}

#[allow(
    unsafe_code,
    reason = "the transport believes what it is told of the types"
)]
fn builder(
    node: &Node<Ipc>,
    robot: &RobotName,
    kind: &Kind,
) -> Result<iceoryx2::service::builder::publish_subscribe::Builder<Bytes, Header, Ipc>, Fault> {
    let builder = node
        .service_builder(&service_name(robot, kind.name)?)
        .publish_subscribe::<Bytes>()
        .user_header::<Header>();
    // SAFETY: both are of the types that the typed ports read and write.
    Ok(unsafe {
        builder
            .__internal_set_payload_type_details(&(kind.payload)())
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
            .service_builder(&service_name(bus.robot(), question.name)?)
            .request_response::<Bytes, Bytes>()
            .request_user_header::<Header>()
            .response_user_header::<Header>();
        // SAFETY: all are of the types that the typed ends read and write.
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
            // A request whose asker has given up must not be carried out later.
            .enable_fire_and_forget_requests(false)
            .open_or_create_with_attributes(&layout(question.layout))
            .map_err(|error| request_fault(question.name, error))
    })
}

/// Opens or creates the event service beside a topic, for listeners of plain iceoryx2.
pub(crate) fn event(bus: &Bus, kind: &Kind) -> Result<EventService, PortError> {
    patiently(bus, kind.name, || {
        bus.node()
            .service_builder(&service_name(bus.robot(), kind.name)?)
            .event()
            .max_listeners(MAX_STANDARD_LISTENERS)
            .max_notifiers(kind.qos.max_publishers())
            .max_nodes(kind.qos.max_nodes())
            .event_id_max_value(MAX_EVENT_ID)
            .open_or_create()
            .map_err(|error| event_fault(kind.name, &kind.qos, error))
    })
}

/// The layout both sides must share: a difference refuses the service.
fn layout([first, second]: [u64; 2]) -> AttributeVerifier {
    let key = AttributeKey::new(SCHEMA_KEY.as_bytes()).expect("the key is short and not empty");
    let value = AttributeValue::new(format!("{first:016x}.{second:016x}").as_bytes())
        .expect("two hashes are short and not empty");
    AttributeVerifier::new()
        .require(&key, &value)
        .expect("one attribute fits")
}

fn service_name(robot: &RobotName, topic: &str) -> Result<ServiceName, Fault> {
    let full = name::service(robot, topic);
    ServiceName::new(&full).map_err(|_| {
        Fault::Lasting(PortError::Transport {
            topic: topic.to_owned(),
            detail: format!("`{full}` is too long for a service's name"),
        })
    })
}

fn topic_fault(topic: &str, qos: &Qos, error: PublishSubscribeOpenOrCreateError) -> Fault {
    use PublishSubscribeCreateError as Create;
    use PublishSubscribeOpenError as Open;
    use PublishSubscribeOpenOrCreateError as Either;
    let detail = match error {
        Either::PublishSubscribeOpenError(open) => match open {
            Open::IncompatibleTypes
            | Open::IncompatibleMessagingPattern
            | Open::IncompatibleAttributes
            | Open::DoesNotSupportRequestedMinBufferSize
            | Open::DoesNotSupportRequestedMinHistorySize
            | Open::DoesNotSupportRequestedMinSubscriberBorrowedSamples
            | Open::DoesNotSupportRequestedAmountOfPublishers
            | Open::DoesNotSupportRequestedAmountOfSubscribers
            | Open::DoesNotSupportRequestedAmountOfNodes
            | Open::IncompatibleOverflowBehavior => {
                return other_layout(topic, &format!("{open:?}"));
            }
            Open::InsufficientPermissions => return no_permission(topic),
            Open::VersionMismatch => return other_version(topic),
            Open::ExceedsMaxNumberOfNodes => return crowded(topic, qos.max_nodes()),
            passing => format!("{passing:?}"),
        },
        Either::PublishSubscribeCreateError(create) => match create {
            Create::InsufficientPermissions => return no_permission(topic),
            passing => format!("{passing:?}"),
        },
        Either::SystemInFlux => "SystemInFlux".to_owned(),
    };
    Fault::Passing(detail)
}

fn request_fault(request: &str, error: RequestResponseOpenOrCreateError) -> Fault {
    use RequestResponseCreateError as Create;
    use RequestResponseOpenError as Open;
    use RequestResponseOpenOrCreateError as Either;
    let detail = match error {
        Either::RequestResponseOpenError(open) => match open {
            Open::InsufficientPermissions => return no_permission(request),
            Open::VersionMismatch => return other_version(request),
            Open::ExceedsMaxNumberOfNodes => return crowded(request, MAX_REQUEST_NODES),
            Open::Interrupt
            | Open::DoesNotExist
            | Open::HangsInCreation
            | Open::InternalFailure
            | Open::IsMarkedForDestruction
            | Open::ServiceInCorruptedState
            | Open::UnableToCreateServiceTag => format!("{open:?}"),
            incompatible => return other_layout(request, &format!("{incompatible:?}")),
        },
        Either::RequestResponseCreateError(create) => match create {
            Create::InsufficientPermissions => return no_permission(request),
            passing => format!("{passing:?}"),
        },
        Either::SystemInFlux => "SystemInFlux".to_owned(),
    };
    Fault::Passing(detail)
}

fn event_fault(name: &str, qos: &Qos, error: EventOpenOrCreateError) -> Fault {
    use EventCreateError as Create;
    use EventOpenError as Open;
    use EventOpenOrCreateError as Either;
    let detail = match error {
        Either::EventOpenError(open) => match open {
            Open::InsufficientPermissions => return no_permission(name),
            Open::VersionMismatch => return other_version(name),
            Open::ExceedsMaxNumberOfNodes => return crowded(name, qos.max_nodes()),
            Open::Interrupt
            | Open::DoesNotExist
            | Open::HangsInCreation
            | Open::InternalFailure
            | Open::IsMarkedForDestruction
            | Open::ServiceInCorruptedState
            | Open::UnableToCreateServiceTag => format!("{open:?}"),
            incompatible => return other_layout(name, &format!("{incompatible:?}")),
        },
        Either::EventCreateError(create) => match create {
            Create::InsufficientPermissions => return no_permission(name),
            passing => format!("{passing:?}"),
        },
        Either::SystemInFlux => "SystemInFlux".to_owned(),
    };
    Fault::Passing(detail)
}

fn other_layout(topic: &str, detail: &str) -> Fault {
    Fault::Lasting(PortError::OtherLayout {
        topic: topic.to_owned(),
        detail: detail.to_owned(),
    })
}

fn other_version(topic: &str) -> Fault {
    Fault::Lasting(PortError::OtherVersion {
        topic: topic.to_owned(),
    })
}

fn no_permission(topic: &str) -> Fault {
    Fault::Lasting(PortError::Permission {
        topic: topic.to_owned(),
    })
}

fn crowded(topic: &str, limit: usize) -> Fault {
    Fault::Full(PortError::TooManyProcesses {
        topic: topic.to_owned(),
        limit,
    })
}

/// A port that could not be made for want of resources.
pub(crate) fn no_resources(topic: &str, detail: impl core::fmt::Debug) -> Fault {
    let topic = topic.to_owned();
    Fault::Lasting(match Shortage::now() {
        Some(shortage) => PortError::Short { topic, shortage },
        None => PortError::Transport {
            topic,
            detail: format!("{detail:?}"),
        },
    })
}
