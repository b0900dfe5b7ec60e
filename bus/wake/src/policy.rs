//! [`Policy`]: how a service waits for the topics on which it acts, as its configuration says.
//!
//! It is apart from the waiter because a thread's urgency depends on it too ([`crate::urgency`]).

use core::fmt;
use core::str::FromStr;
use core::time::Duration;

/// How to wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Sleep until rung. This takes no processor time; to wake takes some microseconds on the
    /// ringer's core and about ten on another.
    #[default]
    Block,
    /// Look without pause. This takes a whole core and gives the shortest wake.
    Spin,
    /// Look without pause around the time when a ring is due, if rings come close enough to each
    /// other, and sleep otherwise. At most as many waiters of a unit look at a time as the machine
    /// has cores, and one less if a thread under a real-time scheduler makes the waiter; the others
    /// sleep. On a single core none looks. The thread's timers become exact (slack 1 ns).
    Adaptive {
        /// How long after a ring the waiter may look for the next one. For later rings it sleeps.
        longest_spin: Duration,
    },
}

impl Policy {
    /// `Adaptive` with a bound that is long enough for sensor frames one millisecond apart.
    pub const ADAPTIVE: Self = Self::Adaptive {
        longest_spin: Duration::from_millis(2),
    };
}

impl fmt::Display for Policy {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Block => "block",
            Self::Spin => "spin",
            Self::Adaptive { .. } => "adaptive",
        })
    }
}

/// The text names no policy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a way to wait; use block, spin or adaptive")]
pub struct PolicyError(pub String);

impl FromStr for Policy {
    type Err = PolicyError;

    fn from_str(text: &str) -> Result<Self, PolicyError> {
        match text {
            "block" => Ok(Self::Block),
            "spin" => Ok(Self::Spin),
            "adaptive" => Ok(Self::ADAPTIVE),
            other => Err(PolicyError(other.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_are_read_as_they_are_written() {
        for policy in [Policy::Block, Policy::Spin, Policy::ADAPTIVE] {
            assert_eq!(policy.to_string().parse(), Ok(policy));
        }
        let error = "busy".parse::<Policy>().unwrap_err().to_string();
        assert!(error.contains("block, spin or adaptive"), "{error}");
    }
}
