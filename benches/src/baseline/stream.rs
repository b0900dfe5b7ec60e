//! Bytes through the kernel: a pipe each way, a Unix datagram socket, a TCP connection over
//! loopback. The descriptors are inherited; receivers sleep in `read`, without a time-out.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::os::fd::OwnedFd;

use lager_topics::bytes_of;
use rustix::io::{Errno, FdFlags, fcntl_setfd, read, write};
use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};
use rustix::pipe::pipe;

use super::{End, Fault};
use crate::sample::{SIZE, Sample};

/// An end that writes into one descriptor and reads from one.
pub(crate) struct Stream<'line> {
    pub(crate) out: &'line OwnedFd,
    pub(crate) back: &'line OwnedFd,
}

impl End for Stream<'_> {
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        // All three take 64 bytes whole while there is room, and one sample is on its way at a time.
        match write(self.out, bytes_of(sample))? {
            SIZE => Ok(()),
            short => Err(Fault::Broken(format!(
                "only {short} of {SIZE} bytes went out"
            ))),
        }
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let mut bytes = [0; SIZE];
        let mut filled = 0;
        while filled < SIZE {
            match read(self.back, &mut bytes[filled..]) {
                Ok(0) => return Err(Fault::Broken("the other end is closed".to_owned())),
                Ok(some) => filled += some,
                Err(Errno::INTR) => {}
                Err(other) => return Err(other.into()),
            }
        }
        Ok(Sample::from_bytes(&bytes))
    }
}

/// A pipe: what to read from, what to write into. Children inherit both.
pub(crate) fn a_pipe() -> rustix::io::Result<(OwnedFd, OwnedFd)> {
    pipe()
}

/// Both ends of a Unix datagram socket. Children inherit them.
pub(crate) fn datagrams() -> rustix::io::Result<(OwnedFd, OwnedFd)> {
    socketpair(
        AddressFamily::UNIX,
        SocketType::DGRAM,
        SocketFlags::empty(),
        None,
    )
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

    fn a_sample_passes(out: &OwnedFd, back: &OwnedFd) {
        let mut sender = Stream { out, back: out };
        let mut receiver = Stream { out: back, back };
        sender.send(&Sample::new(5)).unwrap();
        assert_eq!(receiver.receive().unwrap(), Sample::new(5));
    }

    #[test]
    fn a_sample_passes_through_each_of_them() {
        let (reader, writer) = a_pipe().unwrap();
        a_sample_passes(&writer, &reader);
        let (one, other) = datagrams().unwrap();
        a_sample_passes(&one, &other);
        a_sample_passes(&other, &one);
        let (one, other) = loopback().unwrap();
        a_sample_passes(&one, &other);
        a_sample_passes(&other, &one);
    }

    #[test]
    fn an_end_whose_other_end_is_gone_says_so() {
        let (reader, writer) = a_pipe().unwrap();
        drop(writer);
        let mut end = Stream {
            out: &reader,
            back: &reader,
        };
        assert!(matches!(end.receive(), Err(Fault::Broken(_))));
    }
}
