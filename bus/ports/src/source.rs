//! [`Source`]: a reading end with a payload of any type, for tools that show or record samples.

use std::any::Any;
use std::marker::PhantomData;

use lager_sample::{Description, Stamp, Topic, bytes_of};
use serde::Serialize;

use crate::error::ReceiveError;
use crate::found::Found;
use crate::subscriber::Subscriber;
use crate::watcher::Watcher;

/// A function to be called with one sample, whose payload serde can serialize.
pub trait Look {
    /// The function's result.
    type Output;

    /// The function. `lost` counts the samples missed so far, including the gap before this one.
    fn look<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P) -> Self::Output;

    /// The same with the payload in its other forms, for functions that need them. Sources call
    /// this one.
    fn look_at<P: Serialize>(
        self,
        stamp: &Stamp,
        lost: u64,
        payload: &P,
        _raw: Raw<'_>,
    ) -> Self::Output
    where
        Self: Sized,
    {
        self.look(stamp, lost, payload)
    }
}

/// Other forms of a payload.
#[derive(Clone, Copy, Debug)]
pub struct Raw<'a> {
    /// As it lies in memory.
    pub bytes: &'a [u8],
    /// As its own type, if this program has that.
    pub typed: Option<&'a dyn Any>,
}

impl<'a> Raw<'a> {
    /// Of a topic's payload.
    pub fn of<T: Topic>(payload: &'a T::Payload) -> Self {
        Self {
            bytes: bytes_of(payload),
            typed: Some(payload),
        }
    }
}

/// Takes the newest sample that waits, with its payload, of a topic whose type this program has.
///
/// # Errors
/// As [`Source::next`].
pub fn newest<T: Topic>(
    from: &mut impl Source,
) -> Result<Option<(Stamp, T::Payload)>, ReceiveError> {
    let mut newest = None;
    while let Some(seen) = from.next(Copied::<T>(PhantomData))? {
        newest = seen.or(newest);
    }
    Ok(newest)
}

struct Copied<T>(PhantomData<T>);

impl<T: Topic> Look for Copied<T> {
    type Output = Option<(Stamp, T::Payload)>;

    fn look<P: Serialize>(self, _stamp: &Stamp, _lost: u64, _payload: &P) -> Self::Output {
        None
    }

    fn look_at<P: Serialize>(
        self,
        stamp: &Stamp,
        _lost: u64,
        _payload: &P,
        raw: Raw<'_>,
    ) -> Self::Output {
        let payload = raw.typed?.downcast_ref::<T::Payload>()?;
        Some((*stamp, *payload))
    }
}

/// A reading end of a topic, whether the topic is in the table or brings its own description.
pub trait Source {
    /// Calls `look` with the next sample, oldest first; `None` when there is no further sample.
    ///
    /// # Errors
    /// The transport failed.
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError>;

    /// The layout of its samples.
    fn description(&self) -> Description;

    /// Samples missed, as [`Subscriber::lost`] counts them.
    fn lost(&self) -> u64;

    /// Whether the topic keeps its last sample for readers that come later.
    fn holds(&self) -> bool;

    /// How many samples can wait for this reader; one more overwrites the oldest.
    fn queue(&self) -> usize;

    /// Lets its samples wake the thread of `watcher`, if they come from this machine's bus.
    fn wakes(&self, _watcher: &mut Watcher) {}
}

impl<T: Topic> Source for Subscriber<T> {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let sample = self.receive()?;
        Ok(sample.map(|sample| {
            let raw = Raw::of::<T>(&sample);
            look.look_at(sample.stamp(), Self::lost(self), &*sample, raw)
        }))
    }

    fn description(&self) -> Description {
        Description::of::<T::Payload>()
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

    fn wakes(&self, watcher: &mut Watcher) {
        Self::wakes(self, watcher);
    }
}

impl Source for Found {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let sample = self.receive_counted()?;
        Ok(sample.map(|(sample, lost)| {
            let payload = sample.payload();
            let raw = Raw {
                bytes: payload.bytes(),
                typed: None,
            };
            look.look_at(sample.stamp(), lost, &payload, raw)
        }))
    }

    fn description(&self) -> Description {
        Self::description(self).clone()
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

    fn wakes(&self, watcher: &mut Watcher) {
        Self::wakes(self, watcher);
    }
}
