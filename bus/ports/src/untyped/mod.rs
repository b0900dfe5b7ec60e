//! The transport's ports without their payload's type, compiled here and nowhere else.
//!
//! iceoryx2 is generic over its service type, and every crate that uses generic code compiles it
//! again: some six thousand functions, for a port of any type. So a typed port holds one of these,
//! which knows its payload by size and alignment only, as iceoryx2's bindings for other languages
//! do. What it hands on contains nothing of the transport, not even its drop code ([`Here`]).
//!
//! To other processes the services look typed: name, size and alignment of payload and header are
//! the same, and a typed port of plain iceoryx2 may be at the other end (tests/bus/interop.rs).
//!
//! **Invariant:** a payload's address is only ever read or written as the type whose [`Kind`] or
//! [`Question`] the port was made with.
//!
//! What it costs and saves: a publish takes 140 instructions more than the 4 833 it took with
//! generic ports. A cold build of everything took 5 min 19 s before; with this, without line tables
//! and without the regular expressions of a log filter it takes 3 min 7 s (one machine, within one
//! hour).

#![allow(
    unsafe_code,
    reason = "the transport leaves it to its caller that bytes are of the stated type"
)]

mod asking;
mod copies;
mod foreign;
mod outlet;
mod reader;
mod writer;

use core::mem::ManuallyDrop;
use core::ops::{Deref, DerefMut};
use core::ptr::NonNull;

use iceoryx2::node::Node;
use iceoryx2::service::marker::{CustomHeaderMarker, CustomPayloadMarker};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use iceoryx2_bb_elementary_traits::type_name::TypeName;
use lager_topics::{Field, LARGEST_COPY, Make, Qos, Request, Role, Schema, Stamp, Topic};

use crate::name;
use crate::service::{Side, TopicService};
use crate::transport::Ipc;

pub(crate) use asking::{Answerer, Asker};
pub(crate) use foreign::Foreign;
pub(crate) use outlet::{Lent, republish_states};
pub(crate) use reader::{Reader, Taken};
pub(crate) use writer::{To, Writer};

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

/// Where a payload is: behind its header of `size` bytes, at the next multiple of `align`.
///
/// The transport would return it as a slice, but its length stands in shared memory, where others
/// can write anything. So only the address is taken from it.
fn behind(header: NonNull<Header>, size: usize, align: usize) -> NonNull<u8> {
    let header = header.cast::<u8>();
    // SAFETY: header and payload are of one chunk, whose layout this is
    // (`MessageTypeDetails::payload_ptr_from_header`).
    unsafe {
        let end = header.add(size);
        end.add(end.align_offset(align))
    }
}

/// A value of the transport whose drop code is compiled in this crate, wherever it is dropped.
pub(crate) struct Here<T: Ends>(ManuallyDrop<T>);

/// How a [`Here`] ends. Implemented for each type by [`ends_here!`], since a function for any type
/// would be compiled where it is used.
pub(crate) trait Ends: Sized {
    /// Drops it.
    ///
    /// # Safety
    /// It is not used after this.
    unsafe fn end(this: &mut ManuallyDrop<Self>);
}

macro_rules! ends_here {
    ($($type:ty),+) => {$(
        impl $crate::untyped::Ends for $type {
            #[inline(never)]
            unsafe fn end(this: &mut core::mem::ManuallyDrop<Self>) {
                // SAFETY: the caller promises that it is not used after this.
                unsafe { core::mem::ManuallyDrop::drop(this) }
            }
        }
    )+};
}
use ends_here;

ends_here!(Node<Ipc>, TopicService);

impl<T: Ends> Here<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(ManuallyDrop::new(value))
    }

    /// What it holds, which then ends where the caller lets it.
    pub(crate) fn take(self) -> T {
        let mut this = ManuallyDrop::new(self);
        // SAFETY: `this` is neither used nor dropped after this.
        unsafe { ManuallyDrop::take(&mut this.0) }
    }
}

impl<T: Ends> Drop for Here<T> {
    fn drop(&mut self) {
        // SAFETY: what is being dropped is not used any more.
        unsafe { T::end(&mut self.0) }
    }
}

impl<T: Ends> Deref for Here<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Ends> DerefMut for Here<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}
