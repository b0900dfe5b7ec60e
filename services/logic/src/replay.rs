//! A navigator that gets recorded inputs again, for `bag play --verify`.
//!
//! It reads the shell's journal (`nav/inputs`), and answers as the navigator and its shell did:
//! with the same entry, and the samples that the shell published after it. Any difference comes
//! from the navigator. The answers are equal only on the same kind of processor, because the last
//! digit of a fraction may differ on another one.

use core::time::Duration;

use lager_topics::{
    Beside, Event, NavigatorInput, NavigatorInputKind, NavigatorStatus, SteeringOrder, WarehouseMap,
};

use crate::entry::{self, Beginning};
use crate::navigator::Navigator;
use crate::outgoing::{Outgoing, Part};

/// Why recorded input cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// A text that this build does not write.
    #[error("how a navigator began was written by another build: {0}; verify it with that build")]
    Text(#[from] serde_json::Error),
    /// There is no such constant, or it cannot have this value.
    #[error("{name}={value} is no constant of the navigator with its value: {why}")]
    Constant {
        /// The constant's name.
        name: String,
        /// The wished value.
        value: String,
        /// What is wrong.
        why: String,
    },
    /// An entry is not an input.
    #[error(
        "an input is not one that this build knows: {0:?}; verify it with the build that wrote it"
    )]
    Entry(NavigatorInput),
}

/// What a navigator did after an input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replayed {
    /// The entry as the navigator's journal writes it, with the order in force and the proof.
    pub entry: NavigatorInput,
    /// The order that went out.
    pub command: Option<SteeringOrder>,
    /// The status that went out; the shell adds its `frames_lost`.
    pub status: Option<NavigatorStatus>,
    /// The events that went out.
    pub events: heapless::Vec<Event, 6>,
}

/// A navigator that gets recorded inputs.
#[derive(Debug)]
pub struct Replay {
    navigator: Navigator,
    processor: String,
    map: Option<Box<WarehouseMap>>,
    outgoing: Outgoing,
}

impl Replay {
    /// Begins as the text says (`TextKind::Began`), with other values for some constants of
    /// [`LogicConfig`](crate::LogicConfig), by name and in JSON.
    ///
    /// # Errors
    /// Another build wrote the text, or there is no such constant.
    pub fn begin(text: &[u8], changes: &[(String, String)]) -> Result<Self, ReplayError> {
        let mut beginning: Beginning = serde_json::from_slice(text)?;
        for (name, value) in changes {
            change(&mut beginning, name, value).map_err(|why| ReplayError::Constant {
                name: name.clone(),
                value: value.clone(),
                why,
            })?;
        }
        Ok(Self {
            navigator: beginning.navigator(),
            processor: beginning.processor,
            map: None,
            outgoing: Outgoing::default(),
        })
    }

    /// The kind of processor of the first run.
    pub fn processor(&self) -> &str {
        &self.processor
    }

    /// Takes a map (`TextKind::Map`), to which the next entries refer.
    ///
    /// # Errors
    /// Another build wrote the text.
    pub fn take_map(&mut self, text: &[u8]) -> Result<(), ReplayError> {
        self.map = Some(serde_json::from_slice(text)?);
        Ok(())
    }

    /// Takes an entry, with the sample to which it refers.
    ///
    /// # Errors
    /// The entry makes no sense.
    pub fn handle(
        &mut self,
        entry: &NavigatorInput,
        beside: Beside<'_>,
    ) -> Result<Replayed, ReplayError> {
        let now = Duration::from_nanos(entry.time_ns);
        let mut answer = Replayed::default();
        match entry.kind.get() {
            Some(kind @ NavigatorInputKind::Renewed) => {
                answer.entry = entry::again(now, kind);
                answer.command = self.outgoing.order();
            }
            Some(kind @ NavigatorInputKind::Repeated) => {
                answer.entry = entry::again(now, kind);
                answer.status = Some(self.navigator.status());
            }
            _ => {
                let input = entry::input(entry, beside, self.map.as_deref());
                let input = input.ok_or(ReplayError::Entry(*entry))?;
                let output = self.navigator.handle(now, input);
                (answer.entry, _) = entry::of_input(now, &input);
                entry::answer(&mut answer.entry, &self.navigator, &output);
                let order = self.navigator.current_order();
                for part in self.outgoing.after(now, order, &output) {
                    match part {
                        Part::Order => answer.command = order,
                        Part::Status => answer.status = Some(self.navigator.status()),
                        _ => {}
                    }
                }
                answer.events = output.events;
            }
        }
        Ok(answer)
    }
}

/// Gives a constant another value.
fn change(beginning: &mut Beginning, name: &str, value: &str) -> Result<(), String> {
    let mut config = serde_json::to_value(beginning.config).map_err(|error| error.to_string())?;
    let constant = config.get_mut(name).ok_or("there is no such constant")?;
    *constant = serde_json::from_str(value).map_err(|error| error.to_string())?;
    beginning.config = serde_json::from_value(config).map_err(|error| error.to_string())?;
    Ok(())
}
