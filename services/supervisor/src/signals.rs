//! The signals that end this program in order: Ctrl-C, SIGTERM, a closed terminal, and the
//! machine's limit on processor time. A second Ctrl-C ends it at once, in case that end hangs. The
//! limit on the length of files ends nothing: the write returns an error instead
//! ([`outlive_long_files`]).
//!
//! `lager up` waits for the signals ([`Signals`]): it sleeps in one place and must wake there,
//! whichever thread gets the signal. For all other commands they set a flag ([`end_in_order`]).

use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use lager_home::Clock;
use lager_wake::Shutdown;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXCPU, SIGXFSZ};
use signal_hook::low_level::{self, pipe};

/// The exit code of a process that Ctrl-C has ended, as in shells.
pub const INTERRUPTED: i32 = 130;

/// A signal that comes this soon after a Ctrl-C belongs to it: `timeout -s INT` sends each twice.
const ONE_PRESS: Duration = Duration::from_millis(300);

/// The signals that ask for an end. The kernel sends the last one when the process has used all the
/// processor time that `ulimit -t` or a service's `LimitRTTIME=` allows. It kills the process a
/// little later.
const ENDS: [i32; 4] = [SIGINT, SIGTERM, SIGHUP, SIGXCPU];

/// The sentence for that, made beforehand because a signal handler must not allocate.
const USED_UP: &[u8] =
    b"lager: the processor time of this process is used up (SIGXCPU; `ulimit -t`, \
or LimitCPU= and LimitRTTIME= of a service), so it ends\n";

/// From now on a file that may not become longer is an error of its writer, and does not end this
/// process (SIGXFSZ; `ulimit -f`).
pub fn outlive_long_files() -> Result<()> {
    let registered = signal_hook::flag::register(SIGXFSZ, Arc::default());
    registered.map(drop).context("cannot listen to signals")
}

/// From now on the signals request `shutdown`. A second Ctrl-C ends this process at once.
pub fn end_in_order(shutdown: &Shutdown) -> Result<()> {
    let listen = || -> std::io::Result<()> {
        let flag = shutdown.flag();
        on_press(move || {
            if flag.load(Ordering::SeqCst) {
                low_level::exit(INTERRUPTED);
            }
        })?;
        say_used_up()?;
        for signal in ENDS {
            signal_hook::flag::register(signal, shutdown.flag())?;
        }
        Ok(())
    };
    listen().context("cannot listen to signals")
}

/// Makes the limit on processor time say why this process ends.
#[allow(unsafe_code, reason = "a handler of signals has no safe binding")]
fn say_used_up() -> std::io::Result<()> {
    let say = || {
        // SAFETY: the pointer and the length are those of a constant.
        unsafe { libc::write(libc::STDERR_FILENO, USED_UP.as_ptr().cast(), USED_UP.len()) };
    };
    // SAFETY: it only calls `write`, which may be called in a handler.
    unsafe { low_level::register(SIGXCPU, say) }?;
    Ok(())
}

/// Calls a function at every Ctrl-C. It may only do what a signal handler may do.
#[allow(unsafe_code, reason = "a handler of signals has no safe binding")]
fn on_press(act: impl Fn() + Send + Sync + 'static) -> std::io::Result<()> {
    let last = Press::default();
    let handler = move || {
        if last.begins(Clock::monotonic_ns()) {
            act();
        }
    };
    // SAFETY: it reads a clock, swaps a number, and does what its caller may have it do.
    unsafe { low_level::register(SIGINT, handler) }?;
    Ok(())
}

/// When Ctrl-C was pressed last, in ns of `CLOCK_MONOTONIC`; 0 if never.
#[derive(Debug, Default)]
struct Press(AtomicU64);

impl Press {
    /// Whether a signal that comes now begins another press.
    fn begins(&self, now_ns: u64) -> bool {
        let began_ns = self.0.load(Ordering::Relaxed);
        let is_another =
            began_ns == 0 || now_ns.saturating_sub(began_ns) >= ONE_PRESS.as_nanos() as u64;
        let order = Ordering::Relaxed;
        is_another
            && self
                .0
                .compare_exchange(began_ns, now_ns, order, order)
                .is_ok()
    }
}

/// The requests to end, and those to start again.
pub struct Signals {
    wakes: UnixStream,
    interrupted: Arc<AtomicBool>,
    asked: bool,
    /// Wakes a sleeping robot only.
    renews: UnixStream,
}

impl Signals {
    /// From now on Ctrl-C, SIGTERM and a closed terminal come here.
    pub fn listen() -> Result<Self> {
        let listen = || -> std::io::Result<Self> {
            let (wakes, wake) = UnixStream::pair()?;
            wakes.set_nonblocking(true)?;
            let interrupted = Arc::new(AtomicBool::new(false));
            let pressed = Arc::clone(&interrupted);
            on_press(move || pressed.store(true, Ordering::SeqCst))?;
            say_used_up()?;
            for signal in ENDS {
                pipe::register(signal, wake.try_clone()?)?;
            }
            let (renews, renew) = UnixStream::pair()?;
            renews.set_nonblocking(true)?;
            pipe::register(SIGUSR1, renew)?;
            Ok(Self {
                renews,
                wakes,
                interrupted,
                asked: false,
            })
        };
        listen().context("cannot listen to signals")
    }

    /// Whether somebody has requested an end.
    pub fn end_asked(&mut self) -> bool {
        let mut some = [0; 64];
        while matches!(self.wakes.read(&mut some), Ok(count) if count > 0) {
            self.asked = true;
        }
        self.asked
    }

    /// Whether somebody has asked since the last call that the robot starts again with what is saved
    /// (SIGUSR1).
    pub fn renewal_asked(&mut self) -> bool {
        let mut some = [0; 64];
        let mut is_asked = false;
        while matches!(self.renews.read(&mut some), Ok(count) if count > 0) {
            is_asked = true;
        }
        is_asked
    }

    /// What becomes readable when somebody asks for that.
    pub fn renewal(&self) -> BorrowedFd<'_> {
        self.renews.as_fd()
    }

    /// Whether Ctrl-C has come since it was last forgotten.
    pub fn interrupted(&mut self) -> bool {
        self.end_asked();
        self.interrupted.load(Ordering::SeqCst)
    }

    /// Forgets a Ctrl-C. Only a later one counts as another.
    pub fn forget_interrupt(&mut self) {
        self.interrupted.store(false, Ordering::SeqCst);
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.wakes.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_shortly_after_a_press_is_the_same_press() {
        let ms = |count: u64| count * 1_000_000;
        let press = Press::default();
        let begun = [1_000, 1_002, 1_299, 1_300, 1_599, 5_000].map(|now| press.begins(ms(now)));
        assert_eq!(begun, [true, false, false, true, false, true]);
    }
}
