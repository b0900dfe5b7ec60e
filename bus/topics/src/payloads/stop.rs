//! Why a robot is stopped. The stop itself is a word in memory and no sample; see
//! `lager_ports::StopWord`.

use core::fmt;

use crate::tag::coded;

coded! {
    /// Why a stop was set.
    pub enum StopCause {
        /// There is no stop.
        None = 0,
        /// Somebody ordered it.
        Ordered = 1,
        /// Real boards have just been taken into service.
        FreshStart = 2,
        /// A restarted service found nothing of the state it was to take up.
        StateLost = 3,
        /// A board restarted again and again.
        BoardResets = 4,
        /// The file of the stop word was removed or replaced.
        WordRemoved = 5,
        /// The file of the stop word was cut short or overwritten.
        WordDamaged = 6,
    }
}

impl StopCause {
    /// The cause in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::None => "not stopped",
            Self::Ordered => "it was ordered",
            Self::FreshStart => "real boards start stopped",
            Self::StateLost => "the state of the bridge before was lost",
            Self::BoardResets => "a board restarted again and again",
            Self::WordRemoved => "the stop word was removed",
            Self::WordDamaged => "the stop word was damaged",
        }
    }
}

impl fmt::Display for StopCause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}
