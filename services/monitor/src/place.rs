//! [`Place`]: where the samples come from that the tools show.

use lager_home::Clock;
use lager_ports::Bus;

use crate::ToolError;

/// A place where samples come from: the bus, or a robot's gateway.
pub trait Place {
    /// Asks, after a silence, whether samples can still come.
    ///
    /// # Errors
    /// None will come any more.
    fn may_still_tell(&self) -> Result<(), ToolError>;

    /// The part that a process plays on the robot, if that is known here.
    fn role_of(&self, pid: u32) -> Option<String>;

    /// The clock of the samples' stamps in ns; `None` if this machine does not have it.
    fn now_ns(&self) -> Option<u64>;
}

impl Place for Bus {
    fn may_still_tell(&self) -> Result<(), ToolError> {
        match self.is_listed() {
            true => Ok(()),
            false => Err(ToolError::Cleared),
        }
    }

    fn role_of(&self, pid: u32) -> Option<String> {
        let nodes = self.nodes().unwrap_or_default().into_iter();
        let mut parts = nodes.filter_map(|node| node.part.filter(|_| node.pid == pid));
        parts.next()
    }

    fn now_ns(&self) -> Option<u64> {
        Some(Clock::monotonic_ns())
    }
}
