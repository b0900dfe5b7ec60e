//! The boards that tests play behind pseudo terminals. `steering` and `sensor` are this project's
//! boards, whose only code in common with the real programs is the link. `original` are the
//! original ones, written from the document alone. [`Plugged`] runs a board in a thread and can
//! pull its cable.

mod built;
mod original;
mod pty;
mod register;
mod sensor;
mod steering;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use built::Built;
pub use original::{OriginalSensor, OriginalSteering};
pub use pty::Pty;
pub use register::Register;
pub use sensor::SensorBoard;
pub use steering::SteeringBoard;

/// A device at the other end of a serial line.
pub trait Peer: Send + 'static {
    /// Takes one byte from the Pi.
    fn take(&mut self, byte: u8, now_us: u32);
    /// Does what is due and appends the bytes that it sends.
    fn step(&mut self, now_us: u32, out: &mut Vec<u8>);
}

struct Inner<P> {
    peer: P,
    pty: Option<Pty>,
    /// Bytes on their way to the Pi.
    out: Vec<u8>,
    /// The peer does nothing, as if its processor stood still.
    frozen: bool,
    stop: bool,
}

/// A peer that runs in a thread, with its port.
pub struct Plugged<P: Peer> {
    inner: Arc<Mutex<Inner<P>>>,
    thread: Option<JoinHandle<()>>,
    link: PathBuf,
}

impl<P: Peer> Plugged<P> {
    /// Starts a peer whose port is at `link`. Its clock runs `speed` times as fast as real time.
    ///
    /// # Panics
    /// When the kernel gives no pseudo terminal or no thread.
    pub fn new(peer: P, link: PathBuf, speed: f64) -> Self {
        let inner = Arc::new(Mutex::new(Inner {
            peer,
            pty: Some(Pty::new(&link)),
            out: Vec::with_capacity(1 << 12),
            frozen: false,
            stop: false,
        }));
        let shared = Arc::clone(&inner);
        let thread = std::thread::Builder::new()
            .name("board".to_owned())
            .spawn(move || run(&shared, speed))
            .unwrap();
        Self {
            inner,
            thread: Some(thread),
            link,
        }
    }

    /// The path of its port.
    pub fn path(&self) -> &Path {
        &self.link
    }

    /// Gives `work` the peer, to look at or to change.
    pub fn with<R>(&self, work: impl FnOnce(&mut P) -> R) -> R {
        work(&mut self.lock().peer)
    }

    /// Pulls the cable: the port disappears.
    pub fn unplug(&self) {
        let mut inner = self.lock();
        inner.pty = None;
        inner.out.clear();
    }

    /// Puts the cable in again: a new port appears under the same path.
    pub fn plug(&self) {
        self.plug_at(&self.link);
    }

    /// Puts the cable in again: a new port appears at `link`.
    pub fn plug_at(&self, link: &Path) {
        self.lock().pty = Some(Pty::new(link));
    }

    /// Stops the peer as if its processor stood still, or lets it go on.
    pub fn freeze(&self, frozen: bool) {
        self.lock().frozen = frozen;
    }

    /// Sends bytes that are no packets, and returns when the reader has taken all of them; false =
    /// nobody took them for a minute.
    ///
    /// # Panics
    /// When it is unplugged.
    pub fn send_noise(&self, mut next: impl FnMut() -> u8, count: usize) -> bool {
        let (mut left, start) = (count, Instant::now());
        while start.elapsed().as_secs() < 60 {
            let mut inner = self.lock();
            let inner = &mut *inner;
            let pty = inner.pty.as_ref().expect("a plugged board");
            if inner.out.is_empty() {
                if left == 0 {
                    return true;
                }
                inner.out.extend((0..left.min(512)).map(|_| next()));
                left -= inner.out.len();
            }
            let sent = pty.write(&inner.out);
            inner.out.drain(..sent);
            if sent == 0 {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        false
    }

    fn lock(&self) -> MutexGuard<'_, Inner<P>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<P: Peer> Drop for Plugged<P> {
    fn drop(&mut self) {
        self.lock().stop = true;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run<P: Peer>(inner: &Mutex<Inner<P>>, speed: f64) {
    crate::allocations::exempt_this_thread();
    let start = Instant::now();
    let mut buffer = [0; 512];
    loop {
        {
            let mut inner = inner.lock().unwrap_or_else(PoisonError::into_inner);
            if inner.stop {
                return;
            }
            if inner.frozen || inner.pty.is_none() {
                // An unplugged board still runs, but nobody hears it.
                if !inner.frozen {
                    let mut lost = Vec::new();
                    inner.peer.step(micros(start, speed), &mut lost);
                }
            } else {
                let Inner { peer, pty, out, .. } = &mut *inner;
                let pty = pty.as_ref().expect("it is plugged");
                let count = pty.read(&mut buffer);
                let now_us = micros(start, speed);
                for byte in &buffer[..count] {
                    peer.take(*byte, now_us);
                }
                if out.is_empty() {
                    peer.step(now_us, out);
                } else {
                    // A board whose line is full loses the bytes that it sends.
                    peer.step(now_us, &mut Vec::new());
                }
                let sent = pty.write(out);
                out.drain(..sent);
            }
        }
        std::thread::sleep(Duration::from_micros(500));
    }
}

/// The board's clock, which runs at the robot's speed.
fn micros(start: Instant, speed: f64) -> u32 {
    start.elapsed().mul_f64(speed).as_micros() as u32
}
