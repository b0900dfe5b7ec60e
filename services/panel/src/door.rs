//! The socket at which the panel is asked: how many may be in at once, and for how long.
//!
//! Somebody who connects and says nothing, or his request a byte at a time, must not keep others
//! out. So there is room for [`MOST`] connections, and each ends after [`STAY`] unless it has
//! become a page's socket, which has limits of its own (`socket`).

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Sleep, sleep};

/// Connections at once: those of the pages, and as many again for their files.
const MOST: usize = 96;
/// How long a connection may be there that is no page's socket.
const STAY: Duration = Duration::from_secs(10);
/// How long it waits after an error that is none of a guest's, such as too many open files.
const REST: Duration = Duration::from_millis(100);

/// The socket that listens.
#[derive(Debug)]
pub(crate) struct Door {
    listener: TcpListener,
    room: Arc<Semaphore>,
}

impl Door {
    pub(crate) fn new(listener: TcpListener) -> Self {
        let room = Arc::new(Semaphore::new(MOST));
        Self { listener, room }
    }
}

impl Listener for Door {
    type Io = Guest;
    type Addr = Stays;

    async fn accept(&mut self) -> (Guest, Stays) {
        loop {
            // Whoever comes meanwhile waits in the system's queue.
            let Ok(place) = Arc::clone(&self.room).acquire_owned().await else {
                sleep(REST).await;
                continue;
            };
            match self.listener.accept().await {
                Ok((stream, _)) => {
                    let stays = Stays::default();
                    let guest = Guest {
                        stream,
                        stays: stays.clone(),
                        over: Box::pin(sleep(STAY)),
                        _place: place,
                    };
                    return (guest, stays);
                }
                Err(error) => {
                    tracing::debug!("a connection to the panel failed: {error}");
                    drop(place);
                    sleep(REST).await;
                }
            }
        }
    }

    fn local_addr(&self) -> io::Result<Stays> {
        Ok(Stays::default())
    }
}

/// Whether a connection may stay. It takes the place of the guest's address, which nobody asks for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stays(Arc<AtomicBool>);

impl Stays {
    /// It has become a page's socket.
    pub(crate) fn allow(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Connected<IncomingStream<'_, Door>> for Stays {
    fn connect_info(stream: IncomingStream<'_, Door>) -> Self {
        stream.remote_addr().clone()
    }
}

/// A connection.
#[derive(Debug)]
pub(crate) struct Guest {
    stream: TcpStream,
    stays: Stays,
    over: Pin<Box<Sleep>>,
    _place: OwnedSemaphorePermit,
}

impl Guest {
    /// Fails when its time is over.
    fn look(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if self.stays.0.load(Ordering::Relaxed) || self.over.as_mut().poll(context).is_pending() {
            return Ok(());
        }
        Err(io::ErrorKind::TimedOut.into())
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
