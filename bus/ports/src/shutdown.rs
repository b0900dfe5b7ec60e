//! The wish to stop, as a value that is passed in.

use core::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::waiter::Ringer;

/// The wish to stop; clones share it. Services look at it at least once per time-out.
#[derive(Clone, Default)]
pub struct Shutdown {
    requested: Arc<AtomicBool>,
    ringers: Arc<Mutex<Vec<Ringer>>>,
}

impl Shutdown {
    /// No stop is wished for yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Wishes to stop, and wakes the waiters. Not for signal handlers: those set
    /// [`Shutdown::flag`].
    pub fn request(&self) {
        self.requested.store(true, Ordering::SeqCst);
        for ringer in self.ringers().iter() {
            ringer.ring();
        }
    }

    /// Whether somebody wishes to stop.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst)
    }

    /// Has `ringer` rung when the wish comes.
    pub fn wake(&self, ringer: Ringer) {
        self.ringers().push(ringer);
        if self.is_requested() {
            self.request();
        }
    }

    /// The bare flag; a signal handler may set it. A waiter sees it at its next time-out.
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
