//! Keeping a service's last value for its successor.
//!
//! A killed publisher takes its history with it. So the attendant holds a [`Keeper`] for each state
//! that a service resumes from. The keeper remembers the last value, and when the service has died
//! it publishes the value with history, so that the successor can read it with
//! [`crate::Bus::kept`].
//!
//! ```text
//! supervisor, every tick:   remember(), which tries again what a hand_over() could not; sweep
//! service died:             remember(); hand_over(); start it again
//! successor:                kept(); make its own publisher; publish
//! supervisor, next tick:    remember() sees the successor and withdraws
//! ```

use core::fmt;

use lager_topics::{Stamp, Topic};

use crate::bus::Bus;
use crate::clock::Clock;
use crate::error::{PortError, ReceiveError, SendError};
use crate::publisher::Publisher;
use crate::streams::Newest;
use crate::subscriber::Subscriber;

/// Keeps the last value of a topic for its writer's successor; stays in the thread that made it.
pub struct Keeper<T: Topic> {
    bus: Bus,
    subscriber: Subscriber<T>,
    kept: Option<(T::Payload, Stamp)>,
    newest: Newest,
    /// The kept value is to be handed over and is not yet.
    due: bool,
    stand_in: Option<Publisher<T>>,
}

impl<T: Topic> Keeper<T> {
    pub(crate) fn new(bus: &Bus) -> Result<Self, PortError> {
        Ok(Self {
            bus: bus.clone(),
            subscriber: Subscriber::new(bus)?,
            kept: None,
            newest: Newest::default(),
            due: false,
            stand_in: None,
        })
    }

    /// Drains the topic, keeps what was published last, and withdraws a handed-over value once
    /// the successor speaks. A hand-over that failed is tried again. Call it on a tick, and before
    /// every sweep.
    ///
    /// # Errors
    /// The transport failed; what was kept stays kept, and the next call tries again.
    pub fn remember(&mut self) -> Result<(), KeeperError> {
        let drained = self.drain();
        if self.due {
            self.offer()?;
        }
        if let Some(stand_in) = &self.stand_in {
            stand_in.tick();
        }
        Ok(drained?)
    }

    /// Publishes the kept value with its original times, so that the successor finds it at its
    /// start. It does nothing without a kept value. Further calls only serve late joiners.
    ///
    /// # Errors
    /// No publisher could be made, or it could not send; [`Keeper::remember`] tries again.
    pub fn hand_over(&mut self) -> Result<(), KeeperError> {
        if let Some(stand_in) = &self.stand_in {
            stand_in.tick();
            return Ok(());
        }
        self.due = self.kept.is_some();
        self.offer()
    }

    fn drain(&mut self) -> Result<(), ReceiveError> {
        while let Some(sample) = self.subscriber.receive()? {
            let stamp = *sample.stamp();
            let now_ns = Clock::monotonic_ns();
            if !self.is_own(&stamp) && self.newest.takes(stamp.publish_time_ns, now_ns) {
                // The last sample of the dead writer, found late, is the value to hand over.
                let is_late = self.kept.as_ref().is_some_and(|(_, kept)| {
                    (kept.writer, kept.epoch) == (stamp.writer, stamp.epoch)
                });
                self.due = is_late && (self.due || self.stand_in.is_some());
                self.stand_in = None;
                self.kept = Some((*sample, stamp));
            }
        }
        Ok(())
    }

    fn offer(&mut self) -> Result<(), KeeperError> {
        let Some((payload, stamp)) = &self.kept else {
            return Ok(());
        };
        let stand_in = Publisher::new(&self.bus)?;
        stand_in.resend(*payload, stamp)?;
        self.stand_in = Some(stand_in);
        self.due = false;
        Ok(())
    }

    /// The kept value and when it was published.
    pub fn value(&self) -> Option<(&T::Payload, &Stamp)> {
        self.kept.as_ref().map(|(payload, stamp)| (payload, stamp))
    }

    /// Whether a value is handed over and no successor has taken the topic up yet.
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

/// Why a value could not be remembered or handed over.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeeperError {
    /// The topic could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// No publisher could be made.
    #[error(transparent)]
    Port(#[from] PortError),
    /// It could not send.
    #[error(transparent)]
    Send(#[from] SendError),
}
