//! The two processes of the hop: the sender times each sample's way, the receiver sends back what
//! it receives.

use core::time::Duration;
use std::error::Error;
use std::os::fd::{OwnedFd, RawFd};

use lager_ports::{Clock, Policy};
use lager_rig::{Parent, Shareable, inherit};
use lager_topics::{SensorLine, Stamp, Topic};
use serde::{Deserialize, Serialize};

use super::contender::Contender;
use super::ours::Ours;
use crate::baseline::End;
use crate::baseline::iceoryx::{Header, Listening, Member, Polling};
use crate::baseline::memory::{CacheLine, EventFd, Futex, Lane};
use crate::baseline::stream::Stream;
#[cfg(feature = "zenoh")]
use crate::baseline::zenoh;
use crate::error::BenchError;
use crate::pair::{self, Side};
use crate::report::Mode;
use crate::sample::{self, Ping, Pong, Sample};

/// What sender and receiver write into, in shared memory.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Lanes([Lane<8>; 2]);

// SAFETY: atomics only.
#[allow(unsafe_code)]
unsafe impl Shareable for Lanes {}

/// The descriptors of what goes through the kernel, in the order below.
pub(super) type Lines<Fd> = [[Fd; 2]; 5];

/// From here on a pipe for each of the two to write into: what to read from, what to write into.
const PIPES: usize = 0;
/// What each of the two rings.
const EVENTFDS: usize = 2;
/// The end of each of the two.
const UDS: usize = 3;
/// The end of each of the two.
const TCP: usize = 4;

/// How one way is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Timing {
    /// As half of the round trip, as fast as samples come back. One clock, at one end; a tail shows
    /// by half.
    RoundTrip,
    /// By itself, from the sender's clock to the receiver's, with at least so long from one sample
    /// to the next; zero is as fast as they come back.
    OneWay(Duration),
}

impl Timing {
    pub(super) const fn gap(self) -> Duration {
        match self {
            Self::RoundTrip => Duration::ZERO,
            Self::OneWay(gap) => gap,
        }
    }
}

/// What is measured in a round.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Job {
    /// What carries the samples.
    pub(super) contender: Contender,
    /// How one way is timed.
    pub(super) timing: Timing,
}

type Round = pair::Round<Job>;

/// Which of the two processes this is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Who {
    Sender,
    Receiver,
}

/// The process that times.
pub(super) fn sender(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(
        parent,
        |side| Carriers::of(Who::Sender, side),
        Carriers::round,
    )
}

/// The process that sends back.
pub(super) fn receiver(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(
        parent,
        |side| Carriers::of(Who::Receiver, side),
        Carriers::round,
    )
}

impl Who {
    /// Sends or sends back the samples of a round. The sender returns the times of one way each, in
    /// ns; where only one way is timed, it returns when it sent, and the receiver when it received.
    fn exchange(self, end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
        match self {
            Self::Sender => send_and_time(end, round),
            Self::Receiver => send_back(end, round),
        }
    }
}

fn send_and_time(end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
    let mut times = Vec::with_capacity(round.all().count());
    let timing = round.what.timing;
    let gap_ns = timing.gap().as_nanos() as u64;
    let mut due = Clock::monotonic_ns();
    for number in round.all() {
        if gap_ns > 0 {
            due = (due + gap_ns).max(Clock::monotonic_ns());
            while Clock::monotonic_ns() < due {}
        }
        let sent = Clock::monotonic_ns();
        let sample = end
            .send(&Sample::new(number))
            .and_then(|()| end.receive())
            .map_err(|fault| round.failed(number, fault))?;
        let received = Clock::monotonic_ns();
        check(round, number, &sample)?;
        times.push(match timing {
            Timing::RoundTrip => (received - sent) / 2,
            Timing::OneWay(_) => sent,
        });
    }
    Ok(round.timed(times))
}

fn send_back(end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
    let one_way = round.what.timing != Timing::RoundTrip;
    let mut times = Vec::with_capacity(round.all().count());
    for number in round.all() {
        let sample = end.receive().map_err(|fault| round.failed(number, fault))?;
        if one_way {
            times.push(Clock::monotonic_ns());
        }
        end.send(&sample)
            .map_err(|fault| round.failed(number, fault))?;
        check(round, number, &sample)?;
    }
    Ok(if one_way { round.timed(times) } else { times })
}

fn check(round: &Round, expected: u64, sample: &Sample) -> Result<(), BenchError> {
    if sample.number() == expected && sample.is_whole() {
        Ok(())
    } else {
        Err(round.wrong(expected, sample.number()))
    }
}

/// What one of the two has at hand to carry samples with.
struct Carriers {
    who: Who,
    lines: Lines<OwnedFd>,
    side: Side<Lanes, Lines<RawFd>>,
}

impl Carriers {
    fn of(who: Who, side: Side<Lanes, Lines<RawFd>>) -> Self {
        Self {
            who,
            lines: side.more.map(|pair| pair.map(inherit)),
            side,
        }
    }

    /// One round, with ends of its own.
    fn round(&self, round: &Round) -> Result<Vec<u64>, BenchError> {
        let is_sender = self.who == Who::Sender;
        let (own, other) = if is_sender { (0, 1) } else { (1, 0) };
        let lanes = &self.side.memory().0;
        let (out, back) = (&lanes[own], &lanes[other]);
        let bells = &self.lines[EVENTFDS];
        let pipes = &self.lines[PIPES..];
        match round.what.contender {
            Contender::Lager(mode) => {
                let policy = match mode {
                    // One of two cores at most is given to adaptive spinning, and it is the
                    // receiver's wait that is timed.
                    Mode::Adaptive if is_sender => Policy::Spin,
                    _ => mode.policy(),
                };
                if is_sender {
                    let bus = self.side.bus(sample::SENDER)?;
                    self.with(Ours::<Ping, Pong>::open(&bus, policy)?, round)
                } else {
                    let bus = self.side.bus(sample::RECEIVER)?;
                    self.with(Ours::<Pong, Ping>::open(&bus, policy)?, round)
                }
            }
            Contender::IceoryxHeader => self.with(self.polling::<Stamp>()?, round),
            Contender::IceoryxBare => self.with(self.polling::<()>()?, round),
            Contender::IceoryxDefaults => {
                let member = Member::join_with_defaults(&self.side.config)?;
                self.with(Polling::<()>::new(member, self.names(), None)?, round)
            }
            Contender::IceoryxEvent => {
                let member = Member::join(&self.side.config)?;
                let end = Listening::new(member, self.names(), &SensorLine::QOS)?;
                self.with(end, round)
            }
            Contender::CacheLine => self.with(CacheLine::new(out, back), round),
            Contender::Futex => self.with(Futex::new(out, back), round),
            Contender::EventFd => {
                let end = EventFd::new((out, &bells[own]), (back, &bells[other]));
                self.with(end, round)
            }
            Contender::Pipe => self.through(&pipes[own][1], &pipes[other][0], round),
            Contender::Uds => self.through(&self.lines[UDS][own], &self.lines[UDS][own], round),
            Contender::Tcp => self.through(&self.lines[TCP][own], &self.lines[TCP][own], round),
            #[cfg(feature = "zenoh")]
            Contender::Zenoh => self.with(self.peer(is_sender, round)?, round),
        }
    }

    fn polling<H: Header>(&self) -> Result<Polling<H>, BenchError> {
        let member = Member::join(&self.side.config)?;
        Polling::new(member, self.names(), Some(&SensorLine::QOS))
    }

    #[cfg(feature = "zenoh")]
    fn peer(&self, is_sender: bool, round: &Round) -> Result<zenoh::Peer, BenchError> {
        let folder = self.side.config.folder.as_deref().unwrap_or("".as_ref());
        // A name of its own for each round: the one before may still be closing.
        let socket = folder.join(format!("zenoh-{}", round.number));
        let side = if is_sender {
            zenoh::Side::Listens
        } else {
            zenoh::Side::Connects
        };
        zenoh::Peer::meet(&socket, side, self.names())
    }

    fn through(
        &self,
        out: &OwnedFd,
        back: &OwnedFd,
        round: &Round,
    ) -> Result<Vec<u64>, BenchError> {
        self.with(Stream { out, back }, round)
    }

    /// Keeps the end until the other process is done with its own.
    fn with(&self, mut end: impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
        self.side
            .together(round, || self.who.exchange(&mut end, round))
    }

    /// What to publish to and what to subscribe to.
    fn names(&self) -> (&'static str, &'static str) {
        match self.who {
            Who::Sender => ("bench/bare-ping", "bench/bare-pong"),
            Who::Receiver => ("bench/bare-pong", "bench/bare-ping"),
        }
    }
}
