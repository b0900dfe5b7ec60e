//! Whether the peer of a unix socket has read every byte.
//!
//! This file stands apart because only it needs `unsafe`: the request `SIOCOUTQ` has no safe
//! wrapper.
#![allow(unsafe_code)]

use std::ffi::c_int;
use std::os::fd::AsFd;

use rustix::ioctl::{Getter, Opcode, ioctl};

/// A terminal uses the same number under this name.
const SIOCOUTQ: Opcode = 0x5411;

/// Whether the peer has bytes of this socket to read. False if the socket cannot tell, because such
/// a socket has no peer.
pub(crate) fn is_unread(socket: impl AsFd) -> bool {
    // SAFETY: SIOCOUTQ writes one `int` to its argument.
    let waits = unsafe { ioctl(socket, Getter::<SIOCOUTQ, c_int>::new()) };
    waits.is_ok_and(|waits| waits > 0)
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::os::unix::net::UnixStream;

    use super::*;

    #[test]
    fn what_a_peer_has_not_read_is_seen_until_it_has() {
        let (mut ours, mut theirs) = UnixStream::pair().expect("sockets");
        assert!(!is_unread(&ours));
        ours.write_all(b"styrcomm\n").expect("it is there");
        assert!(is_unread(&ours));
        let mut read = [0; 9];
        theirs.read_exact(&mut read[..4]).expect("it is there");
        assert!(is_unread(&ours), "a part of it waits");
        theirs.read_exact(&mut read[4..]).expect("it is there");
        assert!(!is_unread(&ours));
    }
}
