//! Reading ends whatever their payload is, for tools that show or keep samples.

use lager_topics::{Stamp, Topic};
use serde::Serialize;

use crate::error::ReceiveError;
use crate::found::Found;
use crate::subscriber::Subscriber;

/// Work to be done with one sample, whose payload serde writes.
pub trait Look {
    /// What the work yields.
    type Output;

    /// Does it. `lost` samples were missed so far, this one's own gap included.
    fn look<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P) -> Self::Output;
}

/// A reading end: of a topic of the table, or of one that brings its description along.
pub trait Source {
    /// Looks at the next sample, oldest first; `None` when there is nothing more.
    ///
    /// # Errors
    /// The transport failed.
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError>;

    /// Samples missed, as [`Subscriber::lost`] counts them.
    fn lost(&self) -> u64;

    /// Whether the topic holds its last sample for those who come later.
    fn holds(&self) -> bool;

    /// How many samples can wait for this end; one more overwrites the oldest.
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
