//! Topics and requests without their types: what the transport has to know of them.
//!
//! Apart from the untyped ports, because whoever opens a service needs it as well.

use iceoryx2::service::marker::{CustomHeaderMarker, CustomPayloadMarker};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use iceoryx2_bb_elementary_traits::type_name::TypeName;
use lager_topics::{Field, LARGEST_COPY, Make, Qos, Request, Role, Schema, Stamp, Topic};

use crate::name;

/// One of a topic's services.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The one under the topic's name.
    Public,
    /// The one that the actors read, of a topic that serves them first.
    Actors,
}

impl Side {
    /// The name of that service.
    pub(crate) fn name(self, topic: &str) -> String {
        match self {
            Self::Public => topic.to_owned(),
            Self::Actors => name::of_actors(topic),
        }
    }

    /// Places for subscribers.
    pub(crate) const fn places(self, qos: &Qos) -> usize {
        match self {
            Self::Public => qos.max_subscribers(),
            Self::Actors => qos.max_acting(),
        }
    }
}

/// What a payload is to the transport.
pub(crate) type Bytes = [CustomPayloadMarker];

/// What a header of ours is to the transport.
pub(crate) type Header = CustomHeaderMarker;

/// A topic without its type.
#[derive(Clone, Copy)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) id: u32,
    pub(crate) qos: Qos,
    pub(crate) payload: fn() -> TypeDetail,
    /// What the payload is made of.
    pub(crate) make: Make,
    /// The hashes of payload and header.
    pub(crate) layout: [u64; 2],
}

impl Kind {
    pub(crate) const fn of<T: Topic>() -> Self {
        const {
            assert!(
                name::may_be_topic(T::NAME),
                "a topic's name has no colon; names of the bus's own services have one"
            );
            assert!(
                !T::QOS.serves_actors_first() || size_of::<T::Payload>() <= LARGEST_COPY,
                "a payload so large is not copied for observers: end the QOS with `.uncopied()`"
            );
        }
        Self {
            name: T::NAME,
            id: T::ID,
            qos: T::QOS,
            payload: detail::<T::Payload>,
            make: T::Payload::MAKE,
            layout: [T::Payload::HASH, Stamp::HASH],
        }
    }

    /// The service from which a process of that role reads.
    pub(crate) fn side(&self, role: Role) -> Side {
        if self.qos.serves_actors_first() && self.qos.actors.contains(&role) {
            Side::Actors
        } else {
            Side::Public
        }
    }

    /// The header of every topic.
    pub(crate) fn header() -> TypeDetail {
        detail::<Stamp>()
    }
}

/// A request without its types.
#[derive(Clone, Copy)]
pub(crate) struct Question {
    pub(crate) name: &'static str,
    pub(crate) id: u32,
    pub(crate) actor: Role,
    pub(crate) request: fn() -> TypeDetail,
    pub(crate) reply: fn() -> TypeDetail,
    /// The hashes of request and reply.
    pub(crate) layout: [u64; 2],
}

impl Question {
    pub(crate) const fn of<R: Request>() -> Self {
        Self {
            name: R::NAME,
            id: R::ID,
            actor: R::ACTOR,
            request: detail::<R::Request>,
            reply: detail::<R::Reply>,
            layout: [R::Request::HASH, R::Reply::HASH],
        }
    }

    /// Requests and replies have no header.
    pub(crate) fn header() -> TypeDetail {
        detail::<()>()
    }
}

/// A type as the transport compares it between processes.
fn detail<T: TypeName>() -> TypeDetail {
    TypeDetail::new::<T>(TypeVariant::FixedSize)
}
