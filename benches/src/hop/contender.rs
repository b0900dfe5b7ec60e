//! What takes part in the hop, and what is compared with what.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::report::{Mode, Regime};
use crate::run::Entry;

/// What carries the balls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contender {
    /// The typed ports, waiting that way.
    Lager(Mode),
    /// Bare iceoryx2 with the typed ports' header and limits, polled without pause.
    IceoryxHeader,
    /// Bare iceoryx2 with the typed ports' limits but without header and clock, polled.
    IceoryxBare,
    /// Bare iceoryx2 with its own default limits, without header and clock, polled.
    IceoryxDefaults,
    /// Bare iceoryx2 with the typed ports' header and limits, and an event to sleep on.
    IceoryxEvent,
    /// A cache line, watched without pause.
    CacheLine,
    /// A cache line and a futex to sleep on.
    Futex,
    /// A cache line and an eventfd to sleep on.
    EventFd,
    /// A pipe.
    Pipe,
    /// A Unix datagram socket.
    Uds,
    /// A TCP connection over loopback.
    Tcp,
    /// Two Zenoh peers on a Unix socket, each with a channel to sleep on.
    #[cfg(feature = "zenoh")]
    Zenoh,
}

/// How many take part; one is there only with its feature.
const COUNT: usize = if cfg!(feature = "zenoh") { 14 } else { 13 };

impl Contender {
    /// Everything that takes part, in the order of the tables.
    pub const ALL: [Self; COUNT] = [
        Self::Lager(Mode::Spin),
        Self::IceoryxHeader,
        Self::IceoryxBare,
        Self::IceoryxDefaults,
        Self::CacheLine,
        Self::Lager(Mode::Adaptive),
        Self::Lager(Mode::Block),
        Self::IceoryxEvent,
        Self::Futex,
        Self::EventFd,
        Self::Pipe,
        Self::Uds,
        Self::Tcp,
        #[cfg(feature = "zenoh")]
        Self::Zenoh,
    ];

    /// How its receiver waits.
    #[must_use]
    pub const fn mode(self) -> Mode {
        match self {
            Self::Lager(mode) => mode,
            Self::IceoryxHeader | Self::IceoryxBare | Self::IceoryxDefaults | Self::CacheLine => {
                Mode::Spin
            }
            Self::IceoryxEvent
            | Self::Futex
            | Self::EventFd
            | Self::Pipe
            | Self::Uds
            | Self::Tcp => Mode::Block,
            #[cfg(feature = "zenoh")]
            Self::Zenoh => Mode::Block,
        }
    }

    /// What the rows of a report call it.
    #[must_use]
    pub fn label(self) -> String {
        self.entry().label()
    }

    /// Whether it works in `regime`: on a shared core, whoever looks without pause keeps the
    /// sender from sending.
    #[must_use]
    pub fn works_in(self, regime: Regime) -> bool {
        regime != Regime::SameCore || self.mode() == Mode::Block
    }

    pub(crate) fn entry(self) -> Entry {
        let (name, variant) = match self {
            Self::Lager(_) => ("lager", ""),
            Self::IceoryxHeader => ("iceoryx2", "header"),
            Self::IceoryxBare => ("iceoryx2", "bare"),
            Self::IceoryxDefaults => ("iceoryx2", "defaults"),
            Self::IceoryxEvent => ("iceoryx2", "event"),
            Self::CacheLine => ("cacheline", ""),
            Self::Futex => ("futex", ""),
            Self::EventFd => ("eventfd", ""),
            Self::Pipe => ("pipe", ""),
            Self::Uds => ("uds", ""),
            Self::Tcp => ("tcp", ""),
            #[cfg(feature = "zenoh")]
            Self::Zenoh => ("zenoh", ""),
        };
        let against: &[&str] = match self {
            Self::Lager(Mode::Spin) => &["iceoryx2/header", "iceoryx2/bare", "iceoryx2/defaults"],
            Self::Lager(Mode::Adaptive) => &["iceoryx2/header"],
            Self::Lager(Mode::Block) => &["iceoryx2/event", "futex"],
            Self::IceoryxHeader | Self::IceoryxEvent => &[],
            Self::IceoryxBare | Self::IceoryxDefaults | Self::CacheLine => &["iceoryx2/header"],
            Self::Futex | Self::EventFd | Self::Pipe | Self::Uds | Self::Tcp => &["iceoryx2/event"],
            #[cfg(feature = "zenoh")]
            Self::Zenoh => &["iceoryx2/event"],
        };
        Entry {
            name,
            variant,
            mode: self.mode(),
            against,
        }
    }
}

impl fmt::Display for Contender {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.entry().label(), self.mode())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_compared_with_is_there_once() {
        let labels: Vec<String> = Contender::ALL
            .iter()
            .map(|one| one.entry().label())
            .collect();
        for contender in Contender::ALL {
            for label in contender.entry().against {
                let found = labels.iter().filter(|other| other == label).count();
                assert_eq!(found, 1, "{contender} against {label}");
            }
        }
    }

    #[test]
    fn nobody_spins_on_a_shared_core() {
        for contender in Contender::ALL {
            assert_eq!(
                contender.works_in(Regime::SameCore),
                contender.mode() == Mode::Block
            );
            assert!(contender.works_in(Regime::Plain));
        }
    }
}
