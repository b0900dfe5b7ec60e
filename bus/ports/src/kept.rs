//! Reads the value that a predecessor left for this process, and tells "no keeper has a value" from
//! "the topic cannot be read".
//!
//! It is apart from the [`Keeper`](crate::Keeper), which lives in another process.

use core::time::Duration;
use std::time::Instant;

use lager_sample::{Stamp, Topic};

use crate::bus::Bus;
use crate::error::{PortError, ReceiveError};
use crate::fault::TransportFault;
use crate::subscriber::Subscriber;

/// How long a restarted service waits for the value that its predecessor left, in real time.
pub const KEPT_WAIT: Duration = Duration::from_millis(500);

/// Why it is not known whether a value was kept.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeptError {
    /// The topic could not be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The topic could not be read.
    #[error(
        "what an earlier process left on `{topic}` cannot be read ({fault}), so its last state is not known; check that /dev/shm is not full and that the limit of open files (ulimit -n) is not reached"
    )]
    Unreadable {
        /// The topic.
        topic: &'static str,
        /// The fault of the last attempt.
        fault: TransportFault,
    },
}

impl From<KeptError> for PortError {
    /// For a process that cannot start without the kept value.
    fn from(error: KeptError) -> Self {
        match error {
            KeptError::Port(error) => error,
            KeptError::Unreadable { topic, fault } => Self::Transport {
                topic: topic.to_owned(),
                fault,
            },
        }
    }
}

/// How often a topic that cannot be read is opened before the error is returned. The sweep after
/// the first attempt removes a killed writer.
const ATTEMPTS: u32 = 5;

/// Pause between attempts, in real time.
const PAUSE: Duration = Duration::from_millis(10);

/// Waits for a value of a topic that this process is about to write.
pub(crate) fn kept<T: Topic>(
    bus: &Bus,
    timeout: Duration,
) -> Result<Option<(T::Payload, Stamp)>, KeptError> {
    let start = Instant::now();
    let mut attempt = 1;
    loop {
        let fault = match look_for::<T>(bus, start, timeout) {
            Ok(kept) => return Ok(kept),
            Err(fault) => fault,
        };
        if attempt == ATTEMPTS || matches!(fault, KeptError::Port(_)) {
            return Err(fault);
        }
        attempt += 1;
        bus.sweep();
        std::thread::sleep(PAUSE);
    }
}

/// Waits with one subscriber, which connects to each writer once.
fn look_for<T: Topic>(
    bus: &Bus,
    start: Instant,
    timeout: Duration,
) -> Result<Option<(T::Payload, Stamp)>, KeptError> {
    let mut subscriber = Subscriber::<T>::new(bus)?;
    loop {
        let unreadable = |fault| KeptError::Unreadable {
            topic: T::NAME,
            fault,
        };
        match subscriber.latest() {
            Ok(Some(sample)) => return Ok(Some((*sample, *sample.stamp()))),
            Ok(None) => (),
            Err(ReceiveError::Transport(fault)) => return Err(unreadable(fault)),
            Err(ReceiveError::TooManyHeld { .. }) => return Err(unreadable(TransportFault::Limit)),
        }
        if subscriber.unreached() > 0 {
            return Err(unreadable(TransportFault::NoConnection));
        }
        if start.elapsed() >= timeout {
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
