//! The signals that end this program in order: Ctrl-C, SIGTERM and a closed terminal. A second Ctrl-C
//! does not wait for that end, should it hang.
//!
//! `lager up` waits for them ([`Signals`]): it sleeps in one place and must wake there, whichever
//! thread gets the signal. For all other commands they set a flag ([`end_in_order`]).

use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_ports::{Clock, Shutdown};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::{self, pipe};

use crate::exit;

/// A second Ctrl-C that comes sooner is the first one: `timeout -s INT` sends each signal twice.
const ONE_PRESS: Duration = Duration::from_millis(300);

/// From now on the signals request `shutdown`, and a second Ctrl-C ends this process at once.
#[allow(unsafe_code, reason = "a handler of signals has no safe binding")]
pub fn end_in_order(shutdown: &Shutdown) -> Result<()> {
    let listen = || -> std::io::Result<()> {
        let first_ns = AtomicU64::new(0);
        let interrupted = move || {
            let now_ns = Clock::monotonic_ns();
            let relaxed = Ordering::Relaxed;
            if let Err(first_ns) = first_ns.compare_exchange(0, now_ns, relaxed, relaxed)
                && now_ns.saturating_sub(first_ns) >= ONE_PRESS.as_nanos() as u64
            {
                low_level::exit(exit::INTERRUPTED);
            }
        };
        // SAFETY: it reads a clock and a number, and may end the process, all of which a handler of
        // signals may.
        unsafe { low_level::register(SIGINT, interrupted) }?;
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, shutdown.flag())?;
        }
        Ok(())
    };
    listen().context("cannot listen to signals")
}

/// The ends that have been asked for.
pub struct Signals {
    wakes: UnixStream,
    interrupted: Arc<AtomicBool>,
    forgotten: Option<Instant>,
    asked: bool,
}

impl Signals {
    /// From now on Ctrl-C, SIGTERM and a closed terminal are asked of this.
    pub fn listen() -> Result<Self> {
        let listen = || -> std::io::Result<Self> {
            let (wakes, wake) = UnixStream::pair()?;
            wakes.set_nonblocking(true)?;
            let interrupted = Arc::new(AtomicBool::new(false));
            signal_hook::flag::register(SIGINT, Arc::clone(&interrupted))?;
            for signal in [SIGINT, SIGTERM, SIGHUP] {
                pipe::register(signal, wake.try_clone()?)?;
            }
            Ok(Self {
                wakes,
                interrupted,
                forgotten: None,
                asked: false,
            })
        };
        listen().context("cannot listen to signals")
    }

    /// Whether an end has been asked for.
    pub fn end_asked(&mut self) -> bool {
        let mut some = [0; 64];
        while matches!(self.wakes.read(&mut some), Ok(count) if count > 0) {
            self.asked = true;
        }
        self.asked
    }

    /// Whether Ctrl-C has come since it was forgotten.
    pub fn interrupted(&mut self) -> bool {
        self.end_asked();
        if self.forgotten.is_some_and(|at| at.elapsed() < ONE_PRESS) {
            self.interrupted.store(false, Ordering::SeqCst);
        }
        self.interrupted.load(Ordering::SeqCst)
    }

    /// Only what comes from now on is another Ctrl-C.
    pub fn forget_interrupt(&mut self) {
        self.forgotten = Some(Instant::now());
        self.interrupted.store(false, Ordering::SeqCst);
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.wakes.as_fd()
    }
}
