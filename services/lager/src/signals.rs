//! The signals that end `lager up`, as something that can be waited for.
//!
//! It is apart from the other commands' handling, which sets a flag: `up` sleeps in one place and
//! must wake there, whichever thread gets the signal.

use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::pipe;

/// The ends that have been asked for.
pub struct Signals {
    wakes: UnixStream,
    interrupted: Arc<AtomicBool>,
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
        self.interrupted.load(Ordering::SeqCst)
    }

    /// Only what comes from now on is another Ctrl-C.
    pub fn forget_interrupt(&mut self) {
        self.interrupted.store(false, Ordering::SeqCst);
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.wakes.as_fd()
    }
}
