//! How a service that acts on topics waits for them.

use core::fmt;
use core::str::FromStr;
use core::time::Duration;
use std::time::Instant;

use lager_topics::{BridgeRequest, Request, Role, TOPICS};

use crate::bus::Bus;
use crate::doorbell::{Bell, InsideRope};
use crate::error::PortError;

/// How to wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Sleep until rung: no processor time, some ten microseconds to wake.
    #[default]
    Block,
    /// Look without pause: a whole core, for the shortest wake.
    Spin,
    /// Look without pause for [`Policy::STAY_AWAKE`], then sleep.
    Adaptive,
}

impl Policy {
    /// How long `Adaptive` looks without pause before it sleeps.
    pub const STAY_AWAKE: Duration = Duration::from_micros(50);
}

impl fmt::Display for Policy {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Block => "block",
            Self::Spin => "spin",
            Self::Adaptive => "adaptive",
        })
    }
}

/// A text that is no policy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no way to wait; use block, spin or adaptive")]
pub struct PolicyError(pub String);

impl FromStr for Policy {
    type Err = PolicyError;

    fn from_str(text: &str) -> Result<Self, PolicyError> {
        match text {
            "block" => Ok(Self::Block),
            "spin" => Ok(Self::Spin),
            "adaptive" => Ok(Self::Adaptive),
            other => Err(PolicyError(other.to_owned())),
        }
    }
}

/// Why a wait ended. Either way, drain every subscriber: a ring may stand for many samples, and a
/// sample may have come without one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// Somebody rang.
    Rung,
    /// Nobody did.
    TimedOut,
}

/// What a service that acts on topics waits on; stays in the thread that made it.
pub struct Waiter {
    bell: Bell,
    policy: Policy,
    role: Role,
}

impl Waiter {
    pub(crate) fn new(bus: &Bus, policy: Policy) -> Result<Self, PortError> {
        let role = bus.role();
        if !is_actor(role) {
            return Err(PortError::NotAnActor { role });
        }
        Ok(Self {
            bell: Bell::hang(bus)?,
            policy,
            role,
        })
    }

    /// Waits until rung, at most `timeout` of real time (see [`crate::Clock::real`]).
    pub fn wait(&self, timeout: Duration) -> Wake {
        let rung = match self.policy {
            Policy::Block => self.bell.wait(timeout),
            Policy::Spin => self.look(timeout),
            Policy::Adaptive => {
                let awake = timeout.min(Policy::STAY_AWAKE);
                self.look(awake) || (timeout > awake && self.bell.wait(timeout - awake))
            }
        };
        if rung { Wake::Rung } else { Wake::TimedOut }
    }

    /// What wakes this waiter from other threads of the process.
    ///
    /// # Errors
    /// No resources.
    pub fn ringer(&self) -> Result<Ringer, PortError> {
        Ok(Ringer {
            rope: self.bell.inside_rope(self.role)?,
        })
    }

    fn look(&self, timeout: Duration) -> bool {
        let start = Instant::now();
        loop {
            if self.bell.rung() {
                return true;
            }
            if start.elapsed() >= timeout {
                return false;
            }
            core::hint::spin_loop();
        }
    }
}

impl fmt::Debug for Waiter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Waiter")
            .field("role", &self.role)
            .field("policy", &self.policy)
            .finish_non_exhaustive()
    }
}

/// Wakes a [`Waiter`] of this process from any thread; clones ring the same one.
#[derive(Clone)]
pub struct Ringer {
    rope: InsideRope,
}

impl Ringer {
    /// Rings.
    pub fn ring(&self) {
        self.rope.ring();
    }
}

impl fmt::Debug for Ringer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Ringer").finish_non_exhaustive()
    }
}

fn is_actor(role: Role) -> bool {
    BridgeRequest::ACTOR == role || TOPICS.iter().any(|topic| topic.qos.actors.contains(&role))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_are_read_as_they_are_written() {
        for policy in [Policy::Block, Policy::Spin, Policy::Adaptive] {
            assert_eq!(policy.to_string().parse(), Ok(policy));
        }
        let error = "busy".parse::<Policy>().unwrap_err().to_string();
        assert!(error.contains("block, spin or adaptive"), "{error}");
    }

    #[test]
    fn who_acts_is_an_actor_and_who_looks_is_not() {
        assert!(is_actor(Role::Logic) && is_actor(Role::Bridge));
        assert!(!is_actor(Role::Observer) && !is_actor(Role::Recorder));
    }
}
