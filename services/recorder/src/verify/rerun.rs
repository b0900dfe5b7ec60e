//! What the verifier runs: a navigator, which this crate knows nothing of. Whoever knows both joins
//! them.

use lager_topics::{Event, NavigatorStatus, SteeringOrder, SteeringReport, Told};

/// What a navigator did because of an input.
#[derive(Clone, Debug, Default)]
pub struct Did {
    /// The entry, as this navigator writes it.
    pub told: Told,
    /// The order that went out.
    pub command: Option<SteeringOrder>,
    /// The status that went out.
    pub status: Option<NavigatorStatus>,
    /// The events that went out.
    pub events: Vec<Event>,
}

/// A navigator that is told again what one was told. Errors are sentences.
pub trait Rerun {
    /// A navigator begins, as the text says.
    ///
    /// # Errors
    /// This build cannot read the text.
    fn begin(&mut self, text: &[u8]) -> Result<(), String>;

    /// Takes the map that the next entries mean.
    ///
    /// # Errors
    /// This build cannot read the text.
    fn take_map(&mut self, text: &[u8]) -> Result<(), String>;

    /// Takes an entry with the report that it means.
    ///
    /// # Errors
    /// The entry makes no sense.
    fn handle(&mut self, told: &Told, report: Option<&SteeringReport>) -> Result<Did, String>;
}
