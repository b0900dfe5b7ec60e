//! Stands before a way and looks whether it is open. Only distances from after the last turn count
//! (L6).
//!
//! ```text
//!   none, or one from before the turn's end ---> stand and wait
//!   one beyond the limit ----------------------> Done; without standing, where it is there already
//!   nearer ones for as long as the patience ---> Blocked
//! ```

use core::time::Duration;

use lager_floor::Heading;
use lager_wire::Command;

use super::behaviour::Behaviour;
use super::helm::{Helm, STANDBY, Senses};
use crate::config::LogicConfig;
use crate::ending::Ending;

/// An older distance says nothing of what is ahead now.
const STALE: Duration = Duration::from_millis(150);

/// A look at the way ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    /// A thing nearer than this blocks the way, in cm.
    limit_cm: u8,
    /// How long it must be nearer.
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
    fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
        let (heard, centimetres) = helm.senses.distance?;
        let is_young = heard >= helm.senses.turned_at + helm.config.ranger_lag;
        let is_stale = helm.now.saturating_sub(heard) > STALE;
        if !helm.active || !is_young || is_stale {
            return None;
        }
        if centimetres >= self.limit_cm {
            return Some(Ending::Done);
        }
        let (first, last) = self.near.unwrap_or((heard, heard));
        self.near = Some((first, heard));
        // A single distance may be an accident.
        let again = heard > last;
        (again && heard.saturating_sub(first) >= self.patience).then_some(Ending::Blocked)
    }

    fn turns_wheels(&self) -> bool {
        false
    }
}
