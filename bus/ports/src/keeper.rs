//! [`Keeper`]: keeps the last value of a service, so that the service can resume after a restart.
//!
//! The transport removes a killed publisher's history with it. So the supervisor's attendant has a
//! [`Keeper`] for each state from which a service resumes. The keeper reads every value and
//! remembers the last one. When the service has died, the keeper publishes that value with history,
//! and the restarted service (the successor) reads it with [`crate::Bus::kept`].
//!
//! ```text
//! supervisor, every tick:   remember(), which repeats a failed hand_over(); then sweep
//! service died:             remember(); hand_over(); start it again
//! successor:                kept(); make its own publisher; publish
//! supervisor, next tick:    remember() reads the successor's value and withdraws its own
//! ```

use core::fmt;

use lager_home::Clock;
use lager_sample::{Stamp, Topic};

use crate::bus::Bus;
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
    /// The keeper must hand the kept value over and has not yet done so.
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

    /// Reads all samples of the topic, keeps the value published last, and withdraws a handed-over
    /// value once the successor has published. Repeats a hand-over that failed. Call it at every
    /// tick, and before every sweep.
    ///
    /// # Errors
    /// The transport failed. The kept value stays, and the next call tries again.
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

    /// Publishes the kept value with its original times, so that the successor finds it when it
    /// starts. Without a kept value it does nothing. Further calls only serve new readers.
    ///
    /// # Errors
    /// The publisher could not be made or could not send; [`Keeper::remember`] tries again.
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
                // If the dead writer's last sample is found only now, it is the value to hand over.
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

    /// The kept value and its stamp.
    pub fn value(&self) -> Option<(&T::Payload, &Stamp)> {
        self.kept.as_ref().map(|(payload, stamp)| (payload, stamp))
    }

    /// Whether this keeper has handed a value over and no successor has published yet.
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
    /// The publisher could not send.
    #[error(transparent)]
    Send(#[from] SendError),
}
