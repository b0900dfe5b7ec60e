//! The baselines through the kernel: a pipe each way, a Unix datagram socket, and TCP over
//! loopback. Children inherit the descriptors. Receivers sleep in `read`, without a time-out.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::os::fd::OwnedFd;

use lager_sample::bytes_of;
use rustix::io::{Errno, FdFlags, fcntl_setfd, read, write};
use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};

use super::End;
use crate::error::Fault;
use crate::sample::{SIZE, Sample};

/// An end that writes to one descriptor and reads from the other.
pub(crate) fn end(out: &OwnedFd, back: &OwnedFd) -> impl End {
    // Each of the three takes 64 bytes in one piece, because only one sample is on its way.
    let send = move |sample: &Sample| match write(out, bytes_of(sample))? {
        SIZE => Ok(()),
        short => Err(Fault::Broken(format!(
            "only {short} of {SIZE} bytes went out"
        ))),
    };
    let receive = move || {
        let mut bytes = [0; SIZE];
        read_whole(back, &mut bytes)?;
        Ok(Sample::from_bytes(&bytes))
    };
    (send, receive)
}

/// Reads, asleep, until `bytes` is full.
pub(crate) fn read_whole(from: &OwnedFd, mut bytes: &mut [u8]) -> Result<(), Fault> {
    while !bytes.is_empty() {
        match read(from, &mut *bytes) {
            Ok(0) => return Err(Fault::Broken("the other end is closed".to_owned())),
            Ok(some) => bytes = &mut bytes[some..],
            Err(Errno::INTR) => {}
            Err(other) => return Err(other.into()),
        }
    }
    Ok(())
}

/// Both ends of a Unix datagram socket. Children inherit them.
pub(crate) fn datagrams() -> rustix::io::Result<(OwnedFd, OwnedFd)> {
    let (unix, datagrams) = (AddressFamily::UNIX, SocketType::DGRAM);
    socketpair(unix, datagrams, SocketFlags::empty(), None)
}

/// Both ends of a TCP connection over loopback, without delay. Children inherit them.
pub(crate) fn loopback() -> std::io::Result<(OwnedFd, OwnedFd)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let one = TcpStream::connect(listener.local_addr()?)?;
    let (other, _) = listener.accept()?;
    let inheritable = |stream: TcpStream| {
        stream.set_nodelay(true)?;
        fcntl_setfd(&stream, FdFlags::empty())?;
        Ok::<OwnedFd, std::io::Error>(stream.into())
    };
    Ok((inheritable(one)?, inheritable(other)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::tests::pass;
    use rustix::pipe::pipe;

    #[test]
    fn samples_come_back_over_each_of_them() {
        let (there, back) = (pipe().unwrap(), pipe().unwrap());
        pass(end(&there.1, &back.0), end(&back.1, &there.0));
        for (one, other) in [datagrams().unwrap(), loopback().unwrap()] {
            pass(end(&one, &one), end(&other, &other));
        }
    }

    #[test]
    fn an_end_whose_other_end_is_gone_says_so() {
        let (reader, writer) = pipe().unwrap();
        drop(writer);
        let gone = end(&reader, &reader).receive();
        assert!(matches!(gone, Err(Fault::Broken(_))));
    }
}
