//! Who drives a robot: one person at a time, who is named to everybody else.
//!
//! ```text
//!            take                         leaves, or says nothing for 3 s
//!   nobody ───────> a driver, by name ──────────────────────────────────────> nobody
//!                     │    ▲
//!                     └────┘ each word of his; anybody else is refused with his name
//! ```
//!
//! A seat is the right to drive and drives nothing. Each command of its driver holds for
//! [`LEASE`] in the robot unless he repeats it, so a robot whose driver is lost stands before his
//! seat is free.

use std::time::Duration;

use lager_lines::extension::LeaseMs;

/// How long a command to the wheels holds in the robot.
pub(crate) const LEASE: LeaseMs = LeaseMs::new(150).expect("a time in ms");

/// How long a driver may say nothing.
const SILENT: Duration = Duration::from_secs(3);

/// What shows that somebody is the driver whom a seat was given to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u64);

/// A robot's seat.
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
    /// His last command has turned the wheels.
    drives: bool,
}

impl Wheel {
    /// Who drives.
    pub(crate) fn driver(&self) -> Option<&str> {
        self.driver.as_ref().map(|driver| driver.name.as_str())
    }

    /// Gives the seat to `name`; `Err` is who has it.
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

    /// The driver says something; `drives` is whether his wheels turn by it, if it is about wheels.
    /// Whether he is the driver.
    pub(crate) fn word(&mut self, key: Key, now: Duration, drives: Option<bool>) -> bool {
        let Some(driver) = self.driver.as_mut().filter(|driver| driver.key == key) else {
            return false;
        };
        driver.heard = now;
        driver.drives = drives.unwrap_or(driver.drives);
        true
    }

    /// He leaves; whether the wheels may still turn by his word.
    pub(crate) fn leave(&mut self, key: Key) -> bool {
        let left = self.driver.take_if(|driver| driver.key == key);
        left.is_some_and(|driver| driver.drives)
    }

    /// Takes the seat from one who is silent; whether the wheels may still turn by his word.
    pub(crate) fn lapse(&mut self, now: Duration) -> bool {
        let is_silent = |driver: &mut Driver| now.saturating_sub(driver.heard) >= SILENT;
        let left = self.driver.take_if(is_silent);
        left.is_some_and(|driver| driver.drives)
    }
}
