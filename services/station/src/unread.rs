//! Whether the peer of a unix socket has read what it was told.
//!
//! It is apart because it is the one place of the station that needs `unsafe`: the request
//! `SIOCOUTQ` has no safe wrapper.
#![allow(unsafe_code)]

use std::ffi::c_int;
use std::os::fd::AsFd;

use rustix::ioctl::{Getter, Opcode, ioctl};

/// The same number for a terminal, where it has its name from.
const SIOCOUTQ: Opcode = 0x5411;

/// Whether something that was written to this socket is still to be read by its peer. A socket that
/// does not tell has no peer that could be asked.
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
