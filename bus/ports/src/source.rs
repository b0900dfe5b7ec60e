//! [`Source`]: a reading end with a payload of any type, for tools that show or record samples.

use lager_sample::{Stamp, Topic};
use serde::Serialize;

use crate::error::ReceiveError;
use crate::found::Found;
use crate::subscriber::Subscriber;

/// A function to be called with one sample, whose payload serde can serialize.
pub trait Look {
    /// The function's result.
    type Output;

    /// The function. `lost` counts the samples missed so far, including the gap before this one.
    fn look<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P) -> Self::Output;
}

/// A reading end of a topic, whether the topic is in the table or brings its own description.
pub trait Source {
    /// Calls `look` with the next sample, oldest first; `None` when there is no further sample.
    ///
    /// # Errors
    /// The transport failed.
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError>;

    /// Samples missed, as [`Subscriber::lost`] counts them.
    fn lost(&self) -> u64;

    /// Whether the topic keeps its last sample for readers that come later.
    fn holds(&self) -> bool;

    /// How many samples can wait for this reader; one more overwrites the oldest.
    fn queue(&self) -> usize;
}

impl<T: Topic> Source for Subscriber<T> {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let sample = self.receive()?;
        Ok(sample.map(|sample| look.look(sample.stamp(), Self::lost(self), &*sample)))
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }

    fn holds(&self) -> bool {
        T::QOS.history > 0
    }

    fn queue(&self) -> usize {
        T::QOS.buffer
    }
}

impl Source for Found {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let sample = self.receive_counted()?;
        Ok(sample.map(|(sample, lost)| look.look(sample.stamp(), lost, &sample.payload())))
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }

    fn holds(&self) -> bool {
        Self::holds(self)
    }

    fn queue(&self) -> usize {
        Self::queue(self)
    }
}
