//! The door of a web server: how many may ask at once, and for how long. The panel and the figures
//! for Prometheus stand behind one each.
//!
//! Somebody who connects and says nothing, or his request a byte at a time, must not keep others
//! out, and must not use up this process's open files:
//!
//! - There is room for [`Limits::most`] connections. Where all of it is taken, whoever comes gets
//!   the place of another (`room`): of one that has not been admitted, at the address that has most
//!   of them, the one that came first.
//! - A connection ends when it has not asked a whole question within [`ASKS`] of its beginning, and
//!   in any case after [`STAYS`], unless it has been allowed to stay.
//! - Where the system has no file to open for whoever comes, he waits in the system's queue; that
//!   is said once a minute.
//!
//! It knows nothing of what is asked.

#![forbid(unsafe_code)]

mod room;

use std::future::Future;
use std::io;
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use rustix::io::Errno;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::time::{Instant, Sleep, sleep, sleep_until};

use room::Room;

/// How long a connection may be there before it has asked a whole question.
pub const ASKS: Duration = Duration::from_secs(3);
/// How long it may be there in all, unless it is allowed to stay.
pub const STAYS: Duration = Duration::from_secs(10);
/// How long nobody is let in after the system had no file to open for him.
const REST: Duration = Duration::from_millis(250);
/// When that is said again, if it is still so.
const AGAIN: Duration = Duration::from_secs(60);

/// What may come through one door.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at a time.
    pub most: usize,
    /// What stands behind it, as the subject of a sentence.
    pub whose: &'static str,
}

/// The socket that listens.
#[derive(Debug)]
pub struct Door {
    listener: TcpListener,
    limits: Limits,
    room: Arc<Mutex<Room<oneshot::Sender<()>>>>,
    /// When it was said last that nobody is let in.
    told: Option<Instant>,
}

impl Door {
    /// A door in front of this socket.
    pub fn new(listener: TcpListener, limits: Limits) -> Self {
        Self {
            listener,
            limits,
            room: Arc::new(Mutex::new(Room::new(limits.most))),
            told: None,
        }
    }

    /// Lets one in, in the place of another if there is no other.
    fn let_in(&self, stream: TcpStream, from: IpAddr) -> Option<(Guest, Visitor)> {
        let visitor = Visitor::default();
        let (leaves, over) = oneshot::channel();
        let mut room = lock(&self.room);
        let number = room.comes(from, visitor.clone(), leaves)?;
        drop(room);
        let began = Instant::now();
        let guest = Guest {
            stream,
            visitor: visitor.clone(),
            began,
            ends: Box::pin(sleep_until(began + ASKS)),
            over,
            _place: Place {
                room: Arc::clone(&self.room),
                number,
            },
        };
        Some((guest, visitor))
    }
}

impl Listener for Door {
    type Io = Guest;
    type Addr = Visitor;

    async fn accept(&mut self) -> (Guest, Visitor) {
        loop {
            match self.listener.accept().await {
                Ok((stream, from)) => {
                    if let Some(guest) = self.let_in(stream, from.ip()) {
                        return guest;
                    }
                }
                Err(error) if is_short(&error) => {
                    // To ask for him at once would be in vain.
                    if self.told.is_none_or(|told| told.elapsed() >= AGAIN) {
                        self.told = Some(Instant::now());
                        tracing::warn!(
                            "{} lets nobody else in for now: {error}; `ulimit -n 4096` or \
                             LimitNOFILE= in the unit allows more open files",
                            self.limits.whose
                        );
                    }
                    sleep(REST).await;
                }
                // It was gone before it was let in.
                Err(error) => tracing::debug!("a connection failed: {error}"),
            }
        }
    }

    fn local_addr(&self) -> io::Result<Visitor> {
        Ok(Visitor::default())
    }
}

/// Whether this process or the machine has no file left to open.
fn is_short(error: &io::Error) -> bool {
    let short = [Errno::MFILE, Errno::NFILE, Errno::NOBUFS, Errno::NOMEM];
    error
        .raw_os_error()
        .is_some_and(|raw| short.contains(&Errno::from_raw_os_error(raw)))
}

fn lock<T>(room: &Mutex<Room<T>>) -> MutexGuard<'_, Room<T>> {
    room.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Who is at the other end of a connection, as far as whoever answers it has found out. It takes
/// the place of the address, which nobody asks for.
#[derive(Clone, Debug, Default)]
pub struct Visitor(Arc<AtomicU8>);

/// What is known of him, from least to most; 0 is nothing.
mod known {
    /// He has asked a whole question.
    pub(crate) const ASKED: u8 = 1;
    /// He is one of those for whom this is here.
    pub(crate) const ADMITTED: u8 = 2;
    /// He may stay for as long as he likes.
    pub(crate) const STAYS: u8 = 3;
}

impl Visitor {
    /// He has asked a whole question.
    pub fn has_asked(&self) {
        self.0.fetch_max(known::ASKED, Ordering::Relaxed);
    }

    /// He is one of those for whom this is here, so others go before him where room is needed.
    pub fn admit(&self) {
        self.0.fetch_max(known::ADMITTED, Ordering::Relaxed);
    }

    /// He may stay; whoever says so has limits of his own for him.
    pub fn let_stay(&self) {
        self.0.fetch_max(known::STAYS, Ordering::Relaxed);
    }

    fn known(&self) -> u8 {
        self.0.load(Ordering::Relaxed)
    }
}

impl Connected<IncomingStream<'_, Door>> for Visitor {
    fn connect_info(stream: IncomingStream<'_, Door>) -> Self {
        stream.remote_addr().clone()
    }
}

/// A place in the room; it is free again when this is dropped.
#[derive(Debug)]
struct Place {
    room: Arc<Mutex<Room<oneshot::Sender<()>>>>,
    number: u64,
}

impl Drop for Place {
    fn drop(&mut self) {
        lock(&self.room).goes(self.number);
    }
}

/// A connection.
#[derive(Debug)]
pub struct Guest {
    stream: TcpStream,
    visitor: Visitor,
    began: Instant,
    ends: Pin<Box<Sleep>>,
    /// Told when somebody else gets its place.
    over: oneshot::Receiver<()>,
    _place: Place,
}

impl Guest {
    /// Fails when its time is over, or its place is somebody else's.
    fn look(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if Pin::new(&mut self.over).poll(context).is_ready() {
            return Err(io::ErrorKind::ConnectionAborted.into());
        }
        while self.visitor.known() < known::STAYS && self.ends.as_mut().poll(context).is_ready() {
            let longest = self.began + STAYS;
            if self.visitor.known() < known::ASKED || self.ends.deadline() >= longest {
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.ends.as_mut().reset(longest);
        }
        Ok(())
    }
}

impl AsyncRead for Guest {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.look(context)?;
        Pin::new(&mut self.stream).poll_read(context, into)
    }
}

impl AsyncWrite for Guest {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.look(context)?;
        Pin::new(&mut self.stream).poll_write(context, from)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
