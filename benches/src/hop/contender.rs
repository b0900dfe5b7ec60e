//! What takes part in the hop, and what is compared with what.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::group::Entry;
use crate::report::{Mode, Regime};

/// What carries the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Contender {
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
    pub(super) const ALL: [Self; COUNT] = [
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
    pub(super) const fn mode(self) -> Mode {
        self.entry().mode
    }

    /// Whether it works in `regime`: on a shared core, whoever looks without pause keeps the
    /// sender from sending.
    pub(super) fn works_in(self, regime: Regime) -> bool {
        regime != Regime::SameCore || self.mode() == Mode::Block
    }

    /// Its row, and what that is compared with.
    pub(super) const fn entry(self) -> Entry {
        const SPINNING: &[&str] = &["iceoryx2/header"];
        const SLEEPING: &[&str] = &["iceoryx2/event"];
        const SPIN: &[&str] = &["iceoryx2/header", "iceoryx2/bare", "iceoryx2/defaults"];
        const BLOCK: &[&str] = &["iceoryx2/event", "futex"];
        let (name, variant, mode, against): (_, _, _, &[&str]) = match self {
            Self::Lager(Mode::Spin) => ("lager", "", Mode::Spin, SPIN),
            Self::Lager(Mode::Adaptive) => ("lager", "", Mode::Adaptive, SPINNING),
            Self::Lager(Mode::Block) => ("lager", "", Mode::Block, BLOCK),
            Self::IceoryxHeader => ("iceoryx2", "header", Mode::Spin, &[]),
            Self::IceoryxBare => ("iceoryx2", "bare", Mode::Spin, SPINNING),
            Self::IceoryxDefaults => ("iceoryx2", "defaults", Mode::Spin, SPINNING),
            Self::IceoryxEvent => ("iceoryx2", "event", Mode::Block, &[]),
            Self::CacheLine => ("cacheline", "", Mode::Spin, SPINNING),
            Self::Futex => ("futex", "", Mode::Block, SLEEPING),
            Self::EventFd => ("eventfd", "", Mode::Block, SLEEPING),
            Self::Pipe => ("pipe", "", Mode::Block, SLEEPING),
            Self::Uds => ("uds", "", Mode::Block, SLEEPING),
            Self::Tcp => ("tcp", "", Mode::Block, SLEEPING),
            #[cfg(feature = "zenoh")]
            Self::Zenoh => ("zenoh", "", Mode::Block, SLEEPING),
        };
        Entry {
            name,
            variant,
            mode,
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
