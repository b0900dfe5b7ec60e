//! A navigator that is told again what one was told: for `bag play --verify`.
//!
//! It reads what the shell's journal has written (`nav/inputs`), and answers as the navigator and
//! its shell did: with the same entry, and the samples that the shell published because of it. Any
//! difference is one of the navigator. It is the same on the same kind of processor only, since the
//! last digit of a fraction need not be the same on another one.

use core::time::Duration;

use lager_topics::{
    Event, NavigatorStatus, SteeringOrder, SteeringReport, Told, ToldKind, WarehouseMap,
};

use crate::navigator::Navigator;
use crate::told::{self, Beginning, Beside};

/// Why something recorded cannot be told again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// A text is not what this build writes.
    #[error("how a navigator began was written by another build: {0}; verify it with that build")]
    Text(#[from] serde_json::Error),
    /// A constant that there is not, or a value that it cannot have.
    #[error("{name}={value} is no constant of the navigator with its value: {why}")]
    Constant {
        /// The constant's name.
        name: String,
        /// What it was to be.
        value: String,
        /// What is wrong.
        why: String,
    },
    /// An entry is no input.
    #[error(
        "an input is not one that this build knows: {0:?}; verify it with the build that wrote it"
    )]
    Entry(Told),
}

/// What a navigator did because of an input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// The input as the navigator's journal writes it down, with the order in force and the proof.
    pub told: Told,
    /// The order that went out.
    pub command: Option<SteeringOrder>,
    /// The status that went out; the shell adds its `frames_lost`.
    pub status: Option<NavigatorStatus>,
    /// The events that went out.
    pub events: heapless::Vec<Event, 6>,
}

/// A navigator that is told again what one was told.
#[derive(Debug)]
pub struct Replay {
    navigator: Navigator,
    processor: String,
    map: Option<Box<WarehouseMap>>,
    sent_order: Option<SteeringOrder>,
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
            sent_order: None,
        })
    }

    /// On what kind of processor the first one ran.
    pub fn processor(&self) -> &str {
        &self.processor
    }

    /// Takes a map (`TextKind::Map`), which the next entries mean.
    ///
    /// # Errors
    /// Another build wrote the text.
    pub fn take_map(&mut self, text: &[u8]) -> Result<(), ReplayError> {
        self.map = Some(serde_json::from_slice(text)?);
        Ok(())
    }

    /// Takes an entry, with the report that it means.
    ///
    /// # Errors
    /// The entry makes no sense.
    pub fn handle(
        &mut self,
        told: &Told,
        report: Option<&SteeringReport>,
    ) -> Result<Answer, ReplayError> {
        let mut answer = Answer::default();
        match told.kind.get() {
            Some(ToldKind::Renewed) => {
                answer.told = told::again(told.time_ns, ToldKind::Renewed);
                answer.command = self.sent_order;
            }
            Some(ToldKind::Repeated) => {
                answer.told = told::again(told.time_ns, ToldKind::Repeated);
                answer.status = Some(self.navigator.status());
            }
            _ => self.tell(told, report, &mut answer)?,
        }
        Ok(answer)
    }

    fn tell(
        &mut self,
        told: &Told,
        report: Option<&SteeringReport>,
        answer: &mut Answer,
    ) -> Result<(), ReplayError> {
        let beside = Beside {
            report,
            map: self.map.as_deref(),
            order: &told::order_of(told),
        };
        let now = Duration::from_nanos(told.time_ns);
        let input = told::input(told, &beside).ok_or(ReplayError::Entry(*told))?;
        let output = self.navigator.handle(now, input);
        answer.told = told::entry(now, &input);
        told::answer(&mut answer.told, &self.navigator, &output);
        let order = self.navigator.current_order();
        if order != self.sent_order {
            (self.sent_order, answer.command) = (order, order);
        }
        answer.status = output.status_changed.then(|| self.navigator.status());
        answer.events = output.events;
        Ok(())
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
