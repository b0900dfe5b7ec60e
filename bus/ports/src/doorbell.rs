//! How one thread wakes another process: a bell at the actor, ropes at those who wake it.
//!
//! Apart, because the mechanism is meant to change without anybody noticing: today it is one
//! iceoryx2 event service per actor role, and an eventfd for threads of the actor's own process.
//! A rope holds the service open, so an actor that starts later, restarts or replaces a killed one
//! is reached without the rope being made anew.
//!
//! The bell sleeps in `ppoll` on the listener's socket, since the listener's own wait counts its
//! time-out in kernel ticks (4 ms each at 250 Hz), which a hurried robot cannot afford. The
//! listener is asked before and after each sleep: it may know of a ring whose datagram it has
//! already taken from the socket, and asking puts that right.
//!
//! **Invariant:** a ring is a hint. It may be missed while the bell is being hung and it never
//! says what happened; whoever waits has a time-out and looks at everything after it.

use core::cell::OnceCell;
use core::time::Duration;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use iceoryx2::port::listener::{Listener, ListenerCreateError};
use iceoryx2::port::notifier::{Notifier, NotifierCreateError};
use iceoryx2::prelude::FileDescriptorBased;
use lager_topics::Role;
use rustix::event::{EventfdFlags, PollFd, PollFlags, eventfd, poll};
use rustix::time::Timespec;

use crate::bus::Bus;
use crate::error::PortError;
use crate::service::{self, Fault, patiently};
use crate::transport::Ipc;

/// The actor's end.
pub(crate) struct Bell {
    listener: Listener<Ipc>,
    inside: OnceCell<InsideRope>,
}

impl Bell {
    /// Hangs the bell of this process's role.
    pub(crate) fn hang(bus: &Bus) -> Result<Self, PortError> {
        let service = service::wake(bus, bus.role())?;
        let name = service::wake_name(bus.role());
        let listener = patiently(bus, &name, || {
            service
                .listener_builder()
                .name(bus.port_name())
                .create()
                .map_err(|error| match error {
                    ListenerCreateError::ExceedsMaxSupportedListeners => {
                        Fault::Full(PortError::TooManyReaders {
                            topic: name.clone(),
                            limit: service::MAX_LISTENERS,
                        })
                    }
                    other => service::no_resources(&name, other),
                })
        })?;
        Ok(Self {
            listener,
            inside: OnceCell::new(),
        })
    }

    /// A rope for the threads of this process.
    pub(crate) fn inside_rope(&self, role: Role) -> Result<InsideRope, PortError> {
        if let Some(rope) = self.inside.get() {
            return Ok(rope.clone());
        }
        let rope = InsideRope::new().map_err(|error| PortError::Transport {
            topic: service::wake_name(role),
            detail: error.to_string(),
        })?;
        Ok(self.inside.get_or_init(|| rope).clone())
    }

    /// Whether it has rung since it was last asked. Does not wait.
    pub(crate) fn rung(&self) -> bool {
        let inside = self.inside.get().is_some_and(InsideRope::was_pulled);
        // A signal in between counts as a ring: a wake too many is harmless.
        let outside = self
            .listener
            .try_wait(|_| ())
            .map_or(true, |rings| rings > 0);
        inside || outside
    }

    /// Waits for a ring, at most `timeout`; false if there was none.
    pub(crate) fn wait(&self, timeout: Duration) -> bool {
        let start = Instant::now();
        loop {
            if self.rung() {
                return true;
            }
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return false;
            }
            if self.sleep(left).is_err() {
                // A signal: whoever waits should look around.
                return true;
            }
        }
    }

    /// Sleeps until something is in the socket or the eventfd, at most `timeout`.
    fn sleep(&self, timeout: Duration) -> rustix::io::Result<()> {
        // Beyond the type's range a time-out is for ever in any case, and nobody asks for that.
        let timeout = Timespec::try_from(timeout).unwrap_or(Timespec {
            tv_sec: 3600,
            tv_nsec: 0,
        });
        let socket = PollFd::from_borrowed_fd(self.socket(), PollFlags::IN);
        match self.inside.get() {
            None => poll(&mut [socket], Some(&timeout))?,
            Some(rope) => {
                let eventfd = PollFd::new(&*rope.eventfd, PollFlags::IN);
                poll(&mut [socket, eventfd], Some(&timeout))?
            }
        };
        Ok(())
    }

    #[allow(unsafe_code)]
    fn socket(&self) -> BorrowedFd<'_> {
        // SAFETY: the descriptor is only polled, never read or closed; it belongs to the listener
        // and stays open as long as that, which the returned lifetime borrows.
        unsafe { BorrowedFd::borrow_raw(self.listener.file_descriptor().native_handle()) }
    }
}

/// One waker's end; stays in its thread.
pub(crate) struct Rope {
    notifier: Notifier<Ipc>,
}

impl Rope {
    /// A rope to the bell of `role`, whether it hangs already or not.
    pub(crate) fn to(bus: &Bus, role: Role) -> Result<Self, PortError> {
        Ok(Self {
            notifier: notifier(bus, role)?,
        })
    }

    /// Rings. Costs a system call per waiting process, and next to nothing if the bell has not
    /// been answered since the last ring.
    pub(crate) fn ring(&self) {
        // Nobody there, or a full socket: there is nothing to wake, or it is awake.
        let _ = self.notifier.notify();
    }
}

/// A rope for the threads of the actor's own process; clones pull the same bell.
#[derive(Clone)]
pub(crate) struct InsideRope {
    pulled: Arc<AtomicBool>,
    eventfd: Arc<OwnedFd>,
}

impl InsideRope {
    fn new() -> rustix::io::Result<Self> {
        Ok(Self {
            pulled: Arc::new(AtomicBool::new(false)),
            eventfd: Arc::new(eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?),
        })
    }

    /// Rings.
    pub(crate) fn ring(&self) {
        self.pulled.store(true, Ordering::SeqCst);
        // It fails only when 2^64 - 2 rings are unanswered.
        let _ = rustix::io::write(&*self.eventfd, &1_u64.to_ne_bytes());
    }

    /// Whether it was pulled since it was last asked.
    fn was_pulled(&self) -> bool {
        // The flag spares the system call while spinning. A pull whose flag is seen before its
        // count is written wakes once more, which is harmless.
        let pulled = self.pulled.swap(false, Ordering::SeqCst);
        let mut count = [0; 8];
        pulled | rustix::io::read(self.eventfd.as_fd(), &mut count).is_ok()
    }
}

fn notifier(bus: &Bus, role: Role) -> Result<Notifier<Ipc>, PortError> {
    let service = service::wake(bus, role)?;
    let name = service::wake_name(role);
    patiently(bus, &name, || {
        service
            .notifier_builder()
            .name(bus.port_name())
            .create()
            .map_err(|error| match error {
                NotifierCreateError::ExceedsMaxSupportedNotifiers => {
                    Fault::Full(PortError::TooManyWriters {
                        topic: name.clone(),
                        limit: service::MAX_NOTIFIERS,
                    })
                }
                other => service::no_resources(&name, other),
            })
    })
}
