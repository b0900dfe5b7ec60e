//! The navigator as the verifier sees it. This crate does not know the navigator; the program that
//! knows both joins them.

use lager_topics::{Beside, Event, NavigatorInput, NavigatorStatus, SteeringOrder};

/// What a navigator did after an input.
#[derive(Clone, Debug, Default)]
pub struct Did {
    /// The entry that this navigator writes.
    pub entry: NavigatorInput,
    /// The order that it sent.
    pub command: Option<SteeringOrder>,
    /// The status that it sent.
    pub status: Option<NavigatorStatus>,
    /// The events that it sent.
    pub events: Vec<Event>,
}

/// A navigator that gets recorded inputs again. Errors are sentences.
pub trait Rerun {
    /// A navigator starts, with the state in the text.
    ///
    /// # Errors
    /// This build cannot read the text.
    fn begin(&mut self, text: &[u8]) -> Result<(), String>;

    /// Takes the map to which the next entries refer.
    ///
    /// # Errors
    /// This build cannot read the text.
    fn take_map(&mut self, text: &[u8]) -> Result<(), String>;

    /// Takes an entry, with the sample to which it refers.
    ///
    /// # Errors
    /// The entry makes no sense.
    fn handle(&mut self, entry: &NavigatorInput, beside: Beside<'_>) -> Result<Did, String>;
}
