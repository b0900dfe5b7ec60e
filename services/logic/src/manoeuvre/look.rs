//! Standing before a way and looking whether it is open, by distances that are younger than the
//! last turn (L6).
//!
//! ```text
//!   none, or one from before the turn's end ---> stand and wait
//!   one beyond the limit ----------------------> Done; without standing, where it is there already
//!   nearer ones for as long as the patience ---> Blocked
//! ```

use core::time::Duration;

use lager_topics::Heading;
use lager_wire::Command;

use super::behaviour::Behaviour;
use super::helm::{Helm, STANDBY, Senses};
use crate::config::LogicConfig;
use crate::outcome::Outcome;

/// Age from which a distance says nothing of what is ahead now.
const STALE: Duration = Duration::from_millis(150);

/// A look at the way ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    /// A thing that is nearer than this blocks the way, in cm.
    limit_cm: u8,
    /// For how long it must be nearer.
    patience: Duration,
    /// The first and the last of the distances that were nearer.
    near: Option<(Duration, Duration)>,
}

impl Look {
    pub(crate) fn new(limit_cm: u8, patience: Duration) -> Self {
        Self {
            limit_cm,
            patience,
            near: None,
        }
    }
}

impl Behaviour for Look {
    fn wanted(&self, _: &Senses, _: Heading, _: &LogicConfig) -> Command {
        STANDBY
    }

    /// Judges the last distance.
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Outcome> {
        let (heard, centimetres) = helm.senses.distance?;
        let is_young = heard >= helm.senses.turned_at + helm.config.ranger_lag;
        let is_stale = helm.now.saturating_sub(heard) > STALE;
        if !helm.active || !is_young || is_stale {
            return None;
        }
        if centimetres >= self.limit_cm {
            return Some(Outcome::Done);
        }
        let (first, last) = self.near.unwrap_or((heard, heard));
        self.near = Some((first, heard));
        // One distance alone may be an accident.
        let again = heard > last;
        (again && heard.saturating_sub(first) >= self.patience).then_some(Outcome::Blocked)
    }

    fn turns_wheels(&self) -> bool {
        false
    }
}
