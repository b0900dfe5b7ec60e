//! What the supervisor remembers for its services: the last state each one published, handed to
//! its successor when it has to be restarted.
//!
//! A service restarted with `--resume` reads the last value of its own topic; this is where that
//! value comes from once the process that published it is gone.

use anyhow::Result;
use lager_ports::{Bus, Keeper};
use lager_topics::{LinkHealth, NavStatus, TruthPose};

/// One keeper for each service that has a state to go on with.
pub struct Keepers {
    bridge: Keeper<LinkHealth>,
    logic: Keeper<NavStatus>,
    simulator: Keeper<TruthPose>,
}

impl Keepers {
    /// Starts to listen; nothing is remembered yet.
    pub fn new(bus: &Bus) -> Result<Self> {
        Ok(Self {
            bridge: bus.keeper()?,
            logic: bus.keeper()?,
            simulator: bus.keeper()?,
        })
    }

    /// Remembers the newest value of every service. A killed service's last value is still
    /// there until its node is swept, so this runs before each sweep. Successors that have just
    /// started are served too.
    pub fn remember(&mut self) -> Result<()> {
        self.bridge.remember()?;
        self.logic.remember()?;
        self.simulator.remember()?;
        Ok(())
    }

    /// Offers what `service` was doing to its successor.
    pub fn hand_over(&mut self, service: &str) -> Result<()> {
        // Its last word may have come since the last look.
        self.remember()?;
        match service {
            "bridge" => self.bridge.hand_over()?,
            "logic" => self.logic.hand_over()?,
            "simulator" | "emulator" => self.simulator.hand_over()?,
            _ => {}
        }
        Ok(())
    }
}
