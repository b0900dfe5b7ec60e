//! `[bus]`: where the bus lives, and how its services wait.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use lager_wake::Policy;
use serde::{Deserialize, Serialize};

use super::section::section;

/// A service waits at most this long before it looks at its clock, so a longer spin would never
/// end.
const LONGEST_SPIN_US: u64 = 20_000;

section! {
    "bus"
    /// Where the bus lives, and how its services wait.
    pub struct BusSection {
        /// The folder of the bus, at most 37 bytes. Unset, /run/lager if this user owns it, else
        /// /dev/shm/lager-UID. Robots in different folders never meet.
        pub folder: Option<PathBuf> = None,
        /// How bridge and logic wait for samples: "block" (sleep), "spin" (a core for each) or
        /// "adaptive" (look without pause while samples come fast, sleep when they do not) ...
        pub waiting: Waiting = Waiting::Block,
        /// ... and the longest that "adaptive" looks without pause for one sample, in microseconds.
        pub longest_spin_us: u64 = usual_spin_us(),
    }
}

fn usual_spin_us() -> u64 {
    match Policy::ADAPTIVE {
        Policy::Adaptive { longest_spin } => longest_spin.as_micros() as u64,
        Policy::Block | Policy::Spin => 0,
    }
}

impl BusSection {
    /// Refuses a time that is too long for any service.
    pub fn validate(&self) -> Result<()> {
        if self.longest_spin_us > LONGEST_SPIN_US {
            bail!(
                "[bus] longest_spin_us is {}; it must be from 0 to {LONGEST_SPIN_US} (waiting = \"spin\" never sleeps)",
                self.longest_spin_us
            );
        }
        Ok(())
    }

    /// How bridge and logic wait, in the form of their ports.
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

/// How a service waits: `lager_wake::Policy` as a word of the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Waiting {
    /// Sleep until something comes.
    Block,
    /// Look without pause; costs a core for each service.
    Spin,
    /// Look without pause while samples come fast, sleep when they do not.
    Adaptive,
}
