//! The transport's ports without the payload's type, so that only this crate compiles them.
//!
//! iceoryx2 is generic over its service type, and every crate that uses generic code compiles it
//! again: about six thousand functions for a port of any type. So a typed port holds one of the
//! ports of this module, which knows the size and alignment of its payload only, like iceoryx2's
//! bindings for other languages. What such a port returns contains nothing of the transport, not
//! even drop code (`here`).
//!
//! To other processes the services look typed: name, size and alignment of payload and header are
//! the same, and a typed port of plain iceoryx2 may be at the other end (tests/bus/interop.rs).
//!
//! **Invariant:** a payload's address is only ever read or written as the type whose `Kind` or
//! `Question` the port was made with.
//!
//! Costs and savings: a publish takes 140 instructions more than the 4 833 that it took with
//! generic ports. A cold build of everything took 5 min 19 s before. With this, without line tables
//! and without the regular expressions of a log filter it takes 3 min 7 s (one machine, within one
//! hour).

#![allow(
    unsafe_code,
    reason = "the transport leaves it to its caller that bytes are of the stated type"
)]

mod anyone;
mod asking;
mod copies;
mod foreign;
mod outlet;
mod reader;
mod standard;
mod writer;

use core::ptr::NonNull;

use crate::here::ends_here;
use crate::kind::Header;
use crate::service::TopicService;

pub(crate) use asking::{Answerer, Asker};
pub(crate) use foreign::Foreign;
pub(crate) use outlet::{Lent, republish_states};
pub(crate) use reader::{Peek, Reader, Taken};
pub(crate) use writer::{To, Writer};

ends_here!(TopicService);

/// The address of a payload: behind its header of `size` bytes, at the next multiple of `align`.
///
/// The transport would return the payload as a slice, but the slice's length stands in shared
/// memory, where another process may write anything. So only the address comes from the transport.
fn behind(header: NonNull<Header>, size: usize, align: usize) -> NonNull<u8> {
    let header = header.cast::<u8>();
    // SAFETY: header and payload lie in one chunk, and its layout is the one computed here
    // (`MessageTypeDetails::payload_ptr_from_header`).
    unsafe {
        let end = header.add(size);
        end.add(end.align_offset(align))
    }
}
