//! Keeping a service's last value for its successor.
//!
//! A killed publisher takes its history with it. The supervisor holds a [`Keeper`] for each state
//! a service resumes from: it remembers the last value, and when the service has died it hands
//! the value over, with history, so that the successor reads it with [`crate::Bus::kept`].
//!
//! ```text
//! supervisor, every tick:   remember(); sweep
//! service died:             remember(); hand_over(); start it again
//! successor:                kept(); make its own publisher; publish
//! supervisor, next tick:    remember() sees the successor and withdraws
//! ```

use core::fmt;
use core::time::Duration;
use std::time::Instant;

use lager_topics::{Stamp, Topic};

use crate::bus::Bus;
use crate::error::{PortError, ReceiveError, SendError};
use crate::publisher::Publisher;
use crate::subscriber::Subscriber;

/// Keeps the last value of a topic for its writer's successor; stays in the thread that made it.
pub struct Keeper<T: Topic> {
    bus: Bus,
    subscriber: Subscriber<T>,
    kept: Option<(T::Payload, Stamp)>,
    stand_in: Option<Publisher<T>>,
}

impl<T: Topic> Keeper<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            bus: bus.clone(),
            subscriber: Subscriber::new(bus)?,
            kept: None,
            stand_in: None,
        })
    }

    /// Drains the topic, keeps what was published last, and withdraws a handed-over value once
    /// the successor speaks. Call it on a tick, and before every sweep.
    ///
    /// # Errors
    /// The transport failed; what was kept stays kept.
    pub fn remember(&mut self) -> Result<(), ReceiveError> {
        while let Some(sample) = self.subscriber.receive()? {
            let stamp = *sample.stamp();
            if self.is_own(&stamp) {
                continue;
            }
            let newer = self
                .kept
                .as_ref()
                .is_none_or(|(_, kept)| stamp.publish_time_ns >= kept.publish_time_ns);
            if newer {
                self.kept = Some((*sample, stamp));
                self.stand_in = None;
            }
        }
        if let Some(stand_in) = &self.stand_in {
            stand_in.tick();
        }
        Ok(())
    }

    /// Publishes the kept value with its original times, for the successor to find at its start.
    /// Without a kept value it does nothing; again and again it only serves late joiners.
    ///
    /// # Errors
    /// No publisher could be made, or it could not send.
    pub fn hand_over(&mut self) -> Result<(), HandOverError> {
        let Some((payload, stamp)) = &self.kept else {
            return Ok(());
        };
        if let Some(stand_in) = &self.stand_in {
            stand_in.tick();
            return Ok(());
        }
        let stand_in = Publisher::new(&self.bus)?;
        stand_in.resend(*payload, stamp)?;
        self.stand_in = Some(stand_in);
        Ok(())
    }

    /// The kept value and when it was published.
    pub fn value(&self) -> Option<(&T::Payload, &Stamp)> {
        self.kept.as_ref().map(|(payload, stamp)| (payload, stamp))
    }

    /// Whether a value is handed over and nobody has taken the topic up yet.
    pub fn is_standing_in(&self) -> bool {
        self.stand_in.is_some()
    }

    fn is_own(&self, stamp: &Stamp) -> bool {
        stamp.writer == std::process::id()
            && self
                .stand_in
                .as_ref()
                .is_some_and(|stand_in| stand_in.epoch() == stamp.epoch)
    }
}

impl<T: Topic> fmt::Debug for Keeper<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Keeper")
            .field("topic", &T::NAME)
            .field("kept", &self.kept)
            .field("standing_in", &self.is_standing_in())
            .finish_non_exhaustive()
    }
}

/// Why a kept value could not be handed over.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HandOverError {
    /// No publisher could be made.
    #[error(transparent)]
    Port(#[from] PortError),
    /// It could not send.
    #[error(transparent)]
    Send(#[from] SendError),
}

/// Waits for a value of a topic this process is about to write.
pub(crate) fn kept<T: Topic>(
    bus: &Bus,
    timeout: Duration,
) -> Result<Option<T::Payload>, PortError> {
    let mut subscriber = Subscriber::<T>::new(bus)?;
    let start = Instant::now();
    loop {
        match subscriber.latest() {
            Ok(Some(sample)) => return Ok(Some(*sample)),
            // A writer that cannot be reached is most likely the killed one.
            Ok(None) | Err(_) if start.elapsed() >= timeout => return Ok(None),
            Ok(None) | Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}
