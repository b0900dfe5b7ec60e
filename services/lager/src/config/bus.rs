//! `[bus]`: where the bus lives, and how its services wait.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use lager_ports::Policy;
use serde::{Deserialize, Serialize};

/// A service waits at most this long before it looks at its clock, so a longer spin never comes
/// to its end.
const LONGEST_SPIN_US: u64 = 20_000;

/// `[bus]`: where it lives, and how it is waited for.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BusSection {
    /// Its folder; unset, it is the system's or the user's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// How bridge and logic wait for samples.
    pub waiting: Waiting,
    /// The longest that `waiting = "adaptive"` looks without pause for one sample, in µs.
    pub longest_spin_us: u64,
}

impl BusSection {
    /// Refuses a time that no service could wait for.
    pub fn validate(&self) -> Result<()> {
        if self.longest_spin_us > LONGEST_SPIN_US {
            bail!(
                "[bus] longest_spin_us is {}; it must be from 0 to {LONGEST_SPIN_US} (waiting = \"spin\" never sleeps)",
                self.longest_spin_us
            );
        }
        Ok(())
    }

    /// How bridge and logic wait, as their ports want it.
    pub fn policy(&self) -> Policy {
        match self.waiting {
            Waiting::Block => Policy::Block,
            Waiting::Spin => Policy::Spin,
            Waiting::Adaptive => Policy::Adaptive {
                longest_spin: Duration::from_micros(self.longest_spin_us),
            },
        }
    }
}

/// How a service waits: `lager_ports::Policy` as a word of the configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Waiting {
    /// Sleep until something comes.
    #[default]
    Block,
    /// Look without pause; costs a core for each service.
    Spin,
    /// Look without pause while samples come fast, sleep when they do not.
    Adaptive,
}

impl Default for BusSection {
    fn default() -> Self {
        let longest_spin = match Policy::ADAPTIVE {
            Policy::Adaptive { longest_spin } => longest_spin,
            Policy::Block | Policy::Spin => Duration::ZERO,
        };
        Self {
            folder: None,
            waiting: Waiting::default(),
            longest_spin_us: longest_spin.as_micros() as u64,
        }
    }
}
