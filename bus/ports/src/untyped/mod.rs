//! The transport's ports without their payload's type, compiled here and nowhere else.
//!
//! iceoryx2 is generic over its service type, and every crate that uses generic code compiles it
//! again: some six thousand functions, for a port of any type. So a typed port holds one of these,
//! which knows its payload by size and alignment only, as iceoryx2's bindings for other languages
//! do. What it hands on contains nothing of the transport, not even its drop code (`here`).
//!
//! To other processes the services look typed: name, size and alignment of payload and header are
//! the same, and a typed port of plain iceoryx2 may be at the other end (tests/bus/interop.rs).
//!
//! **Invariant:** a payload's address is only ever read or written as the type whose `Kind` or
//! `Question` the port was made with.
//!
//! What it costs and saves: a publish takes 140 instructions more than the 4 833 it took with
//! generic ports. A cold build of everything took 5 min 19 s before; with this, without line tables
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
pub(crate) use reader::{Reader, Taken};
pub(crate) use writer::{To, Writer};

ends_here!(TopicService);

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
