//! [`LastHeard`]: when something last came from a gateway, whichever topic or sign of life it was.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Shared by a connection and the topics that are listened to over it.
#[derive(Clone, Debug, Default)]
pub(crate) struct LastHeard(Arc<Mutex<Option<Instant>>>);

impl LastHeard {
    /// Something has come.
    pub(crate) fn now(&self) {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *last = Some(Instant::now());
    }

    /// How long nothing has come; `None` if nothing ever has.
    pub(crate) fn silence(&self) -> Option<Duration> {
        let last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        last.map(|last| last.elapsed())
    }
}
