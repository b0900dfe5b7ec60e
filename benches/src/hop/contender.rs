//! What takes part in the hop, and what is compared with what.

use serde::{Deserialize, Serialize};

use crate::group::Entry;
use crate::report::Mode;

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

impl Contender {
    /// Everything that takes part, in the order of the tables: its row, and what that is compared
    /// with.
    pub(super) const ALL: &[(Entry, Self)] = {
        const SPINNING: &[&str] = &["iceoryx2/header"];
        const SLEEPING: &[&str] = &["iceoryx2/event"];
        const SPIN: &[&str] = &["iceoryx2/header", "iceoryx2/bare", "iceoryx2/defaults"];
        const BLOCK: &[&str] = &["iceoryx2/event", "futex"];
        const fn spins(
            name: &'static str,
            variant: &'static str,
            against: &'static [&'static str],
        ) -> Entry {
            Entry::new(name, variant, Mode::Spin, against)
        }
        const fn sleeps(name: &'static str, against: &'static [&'static str]) -> Entry {
            Entry::new(name, "", Mode::Block, against)
        }
        &[
            (spins("lager", "", SPIN), Self::Lager(Mode::Spin)),
            (spins("iceoryx2", "header", &[]), Self::IceoryxHeader),
            (spins("iceoryx2", "bare", SPINNING), Self::IceoryxBare),
            (
                spins("iceoryx2", "defaults", SPINNING),
                Self::IceoryxDefaults,
            ),
            (spins("cacheline", "", SPINNING), Self::CacheLine),
            (
                Entry::new("lager", "", Mode::Adaptive, SPINNING),
                Self::Lager(Mode::Adaptive),
            ),
            (sleeps("lager", BLOCK), Self::Lager(Mode::Block)),
            (
                Entry::new("iceoryx2", "event", Mode::Block, &[]),
                Self::IceoryxEvent,
            ),
            (sleeps("futex", SLEEPING), Self::Futex),
            (sleeps("eventfd", SLEEPING), Self::EventFd),
            (sleeps("pipe", SLEEPING), Self::Pipe),
            (sleeps("uds", SLEEPING), Self::Uds),
            (sleeps("tcp", SLEEPING), Self::Tcp),
            #[cfg(feature = "zenoh")]
            (sleeps("zenoh", SLEEPING), Self::Zenoh),
        ]
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_compared_with_is_there_once() {
        let labels = || Contender::ALL.iter().map(|(entry, _)| entry.label());
        for (entry, contender) in Contender::ALL {
            for label in entry.against {
                let found = labels().filter(|other| other == label).count();
                assert_eq!(found, 1, "{contender:?} against {label}");
            }
        }
    }
}
