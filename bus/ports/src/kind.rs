//! [`Kind`] and [`Question`]: a topic and a request as the transport sees them, without Rust types.
//!
//! It is apart from the untyped ports because the code that opens services needs it too.

use iceoryx2::service::marker::{CustomHeaderMarker, CustomPayloadMarker};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use iceoryx2_bb_elementary_traits::type_name::TypeName;
use lager_sample::{
    LARGEST_COPY, Make, Part, Qos, Request, Schema, Stamp, StructInfo, Topic, TopicEntry,
};

use crate::name;

/// One of the services of iceoryx2 that a topic has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The service under the topic's name.
    Public,
    /// The service that the actors read, if the topic serves them first.
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

    /// How many subscribers the service admits.
    pub(crate) const fn places(self, qos: &Qos) -> usize {
        match self {
            Self::Public => qos.max_subscribers(),
            Self::Actors => qos.max_acting(),
        }
    }
}

/// The type that the transport sees as every payload.
pub(crate) type Bytes = [CustomPayloadMarker];

/// The type that the transport sees as every header.
pub(crate) type Header = CustomHeaderMarker;

/// A topic without its type.
#[derive(Clone, Copy)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) id: u32,
    pub(crate) qos: Qos,
    pub(crate) payload: StructInfo,
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
            payload: StructInfo::of::<T::Payload>(),
        }
    }

    /// The kind of a topic in the application's table.
    pub(crate) fn of_entry(entry: &TopicEntry) -> Self {
        Self {
            name: entry.name,
            id: entry.id,
            qos: entry.qos,
            payload: entry.layout,
        }
    }

    /// The payload as the transport compares it between processes.
    pub(crate) fn detail(&self) -> TypeDetail {
        let StructInfo {
            type_name,
            size,
            align,
            ..
        } = self.payload;
        TypeDetail::__internal_new_from_parts(TypeVariant::FixedSize, type_name, size, align)
            .expect("a payload's name fits, as `Kind::of` has found out")
    }

    /// The list of the payload's fields.
    pub(crate) const fn make(&self) -> Make {
        Make::Record(self.payload)
    }

    /// The hashes of payload and header.
    pub(crate) const fn layout(&self) -> [u64; 2] {
        [self.payload.hash, Stamp::HASH]
    }

    /// The service that a process of this part reads.
    pub(crate) fn side(&self, part: Part) -> Side {
        if self.qos.serves_actors_first() && self.qos.actors.contains(&part) {
            Side::Actors
        } else {
            Side::Public
        }
    }

    /// The header that every sample has: its stamp.
    pub(crate) fn header() -> TypeDetail {
        detail::<Stamp>()
    }
}

/// A request without its types.
#[derive(Clone, Copy)]
pub(crate) struct Question {
    pub(crate) name: &'static str,
    pub(crate) id: u32,
    pub(crate) actor: Part,
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
