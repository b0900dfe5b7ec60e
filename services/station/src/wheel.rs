//! Who drives a robot: one person at a time. Everybody else can see who.
//!
//! ```text
//!            take                         leaves, or says nothing for 3 s
//!   nobody ───────> a driver, by name ──────────────────────────────────────> nobody
//!                     │    ▲
//!                     └────┘ each command; anybody else is refused, and told who drives
//! ```
//!
//! A seat is the right to drive and drives nothing. Each command of its driver holds in the robot
//! for its lease unless he repeats it ([`lager_orders::lease::COMMAND`]), so a robot whose driver
//! is lost stands before his seat is free.

use std::time::Duration;

/// How long a driver may say nothing.
const SILENT: Duration = Duration::from_secs(3);

/// Proves that somebody is the driver who has the wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u64);

/// The right to drive a robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wheel {
    driver: Option<Driver>,
    keys: u64,
}

#[derive(Clone, Debug)]
struct Driver {
    name: String,
    key: Key,
    heard: Duration,
    /// The driver's last command turns the wheels.
    drives: bool,
}

impl Wheel {
    /// Who drives.
    pub(crate) fn driver(&self) -> Option<&str> {
        self.driver.as_ref().map(|driver| driver.name.as_str())
    }

    /// Gives the wheel to `name`. `Err` is the driver who has it.
    pub(crate) fn take(&mut self, name: &str, now: Duration) -> Result<Key, String> {
        if let Some(driver) = &self.driver {
            return Err(driver.name.clone());
        }
        self.keys += 1;
        let key = Key(self.keys);
        self.driver = Some(Driver {
            name: name.to_owned(),
            key,
            heard: now,
            drives: false,
        });
        Ok(key)
    }

    /// The driver says something; `drives` says whether the wheels turn by it, if it is about
    /// wheels. Returns whether this is the driver.
    pub(crate) fn word(&mut self, key: Key, now: Duration, drives: Option<bool>) -> bool {
        let Some(driver) = self.driver.as_mut().filter(|driver| driver.key == key) else {
            return false;
        };
        driver.heard = now;
        driver.drives = drives.unwrap_or(driver.drives);
        true
    }

    /// The driver leaves. Returns whether the wheels may still turn by the last command.
    pub(crate) fn leave(&mut self, key: Key) -> bool {
        let left = self.driver.take_if(|driver| driver.key == key);
        left.is_some_and(|driver| driver.drives)
    }

    /// Takes the wheel from a silent driver. Returns whether the wheels may still turn by the last
    /// command.
    pub(crate) fn lapse(&mut self, now: Duration) -> bool {
        let is_silent = |driver: &mut Driver| now.saturating_sub(driver.heard) >= SILENT;
        let left = self.driver.take_if(is_silent);
        left.is_some_and(|driver| driver.drives)
    }
}
