//! [`Door`]: how many clients may be connected to a web server at once, and for how long. The panel
//! and the gateway have one each.
//!
//! A client that connects and sends nothing, or one byte at a time, must not keep others out, and
//! must not use up this process's open files:
//!
//! - There is room for [`Limits::most`] connections. When the room is full, a new client takes the
//!   place of another client (`room`): of one that the server has not admitted. If there are
//!   several, the door takes the oldest one at the address that has most of them.
//! - A connection ends if it has not sent a whole request within [`ASKS`]. It ends after [`STAYS`]
//!   in any case, unless the server lets it stay.
//! - When the system has no open file left, new clients wait in the system's queue, and the door
//!   says so once a minute.
//!
//! The door does not read the requests.

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

/// How long a connection may take for its first whole request.
pub const ASKS: Duration = Duration::from_secs(3);
/// How long a connection may last, unless the server lets it stay.
pub const STAYS: Duration = Duration::from_secs(10);
/// How long the door lets nobody in after the system had no open file left.
const REST: Duration = Duration::from_millis(250);
/// How often the door reports this, while it lasts.
const AGAIN: Duration = Duration::from_secs(60);

/// The limits of one door.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// The most connections at a time.
    pub most: usize,
    /// Name of the server behind the door, as the subject of a sentence.
    pub whose: &'static str,
}

/// The socket that listens.
#[derive(Debug)]
pub struct Door {
    listener: TcpListener,
    limits: Limits,
    room: Arc<Mutex<Room<oneshot::Sender<()>>>>,
    /// When the door last reported that it lets nobody in.
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

    /// Lets one client in, if need be in the place of another.
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
            _seat: Seat {
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
                    // To accept again at once would fail again.
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
                // The client was gone before it was let in.
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

/// The client of a connection, with what the server knows about it. axum gives this to the server
/// in place of the client's address.
#[derive(Clone, Debug, Default)]
pub struct Visitor(Arc<AtomicU8>);

/// How much is known of a client, from least to most; 0 is nothing.
mod known {
    /// The client has sent a whole request.
    pub(crate) const ASKED: u8 = 1;
    /// The server is meant for this client.
    pub(crate) const ADMITTED: u8 = 2;
    /// The client may stay for any time.
    pub(crate) const STAYS: u8 = 3;
}

impl Visitor {
    /// To be called when the client has sent a whole request.
    pub fn has_asked(&self) {
        self.0.fetch_max(known::ASKED, Ordering::Relaxed);
    }

    /// To be called when the server is meant for this client, so that others make room before it.
    pub fn admit(&self) {
        self.0.fetch_max(known::ADMITTED, Ordering::Relaxed);
    }

    /// Lets the client stay. The caller must limit it in another way.
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

/// A place in the room; dropping it frees the place.
#[derive(Debug)]
struct Seat {
    room: Arc<Mutex<Room<oneshot::Sender<()>>>>,
    number: u64,
}

impl Drop for Seat {
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
    /// Reports that another client gets this place.
    over: oneshot::Receiver<()>,
    _seat: Seat,
}

impl Guest {
    /// Fails when the connection's time is over, or another client has its place.
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
