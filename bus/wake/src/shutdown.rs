//! [`Shutdown`]: a request to stop, as a value that is passed to the threads that must stop.

use core::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::waiter::Ringer;

/// A request to stop; clones share it. Services look at it at least once in each time-out.
#[derive(Clone, Default)]
pub struct Shutdown {
    requested: Arc<AtomicBool>,
    ringers: Arc<Mutex<Vec<Ringer>>>,
}

impl Shutdown {
    /// Nobody has requested a stop yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Requests a stop and wakes the waiters. A signal handler must set [`Shutdown::flag`] instead.
    pub fn request(&self) {
        self.requested.store(true, Ordering::SeqCst);
        for ringer in self.ringers().iter() {
            ringer.ring();
        }
    }

    /// Whether a stop has been requested.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst)
    }

    /// Rings `ringer` when a stop is requested.
    pub fn wake(&self, ringer: Ringer) {
        self.ringers().push(ringer);
        if self.is_requested() {
            self.request();
        }
    }

    /// The flag alone, which a signal handler may set. A waiter sees it at its next time-out.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.requested)
    }

    fn ringers(&self) -> std::sync::MutexGuard<'_, Vec<Ringer>> {
        self.ringers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Shutdown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_tuple("Shutdown")
            .field(&self.is_requested())
            .finish()
    }
}
