//! [`StopCause`]: why a robot is stopped. The stop itself is a word in memory and not a sample; see
//! `lager_stop::StopWord`.

use core::fmt;

use lager_orders::Reason;
use lager_sample::{Tag, coded};

use super::said;

coded! {
    /// Why a stop was set.
    pub enum StopCause {
        /// There is no stop.
        None = 0,
        /// A person or a program ordered it.
        Ordered = 1,
        /// Real boards have just been taken into service.
        FreshStart = 2,
        /// A restarted service could not find its earlier state.
        StateLost = 3,
        /// A board restarted again and again.
        BoardResets = 4,
        /// The file of the stop word was removed or replaced.
        WordRemoved = 5,
        /// The file of the stop word was cut short or overwritten.
        WordDamaged = 6,
        /// Somebody works on the boards with `lager board`.
        BoardWork = 7,
    }
}

impl From<StopCause> for Reason {
    fn from(cause: StopCause) -> Self {
        said::reason("stop_cause", Tag::from(cause))
    }
}

impl fmt::Display for StopCause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Reason::from(*self).fmt(formatter)
    }
}
