//! Where samples come from: a topic of the table, or one that brings its description along.

use lager_ports::{Found, ReceiveError, Subscriber};
use lager_topics::{Stamp, Topic};
use serde_json::{Value, to_value};

/// The next sample's stamp and payload.
type Shown = (Stamp, serde_json::Result<Value>);

/// A reading end, whatever its payload is.
pub(crate) trait Source {
    /// The next sample, if there is one.
    fn next_as_json(&mut self) -> Result<Option<Shown>, ReceiveError>;

    /// The stamp of the next sample, if there is one.
    fn next_stamp(&mut self) -> Result<Option<Stamp>, ReceiveError>;

    /// Samples missed.
    fn lost(&self) -> u64;
}

impl<T: Topic> Source for Subscriber<T> {
    fn next_as_json(&mut self) -> Result<Option<Shown>, ReceiveError> {
        let sample = self.receive()?;
        Ok(sample.map(|sample| (*sample.stamp(), to_value(*sample))))
    }

    fn next_stamp(&mut self) -> Result<Option<Stamp>, ReceiveError> {
        Ok(self.receive()?.map(|sample| *sample.stamp()))
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }
}

impl Source for Found {
    fn next_as_json(&mut self) -> Result<Option<Shown>, ReceiveError> {
        let sample = self.receive()?;
        Ok(sample.map(|sample| (*sample.stamp(), to_value(sample.payload()))))
    }

    fn next_stamp(&mut self) -> Result<Option<Stamp>, ReceiveError> {
        Ok(self.receive()?.map(|sample| *sample.stamp()))
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }
}
