//! The two processes of the hop: the first throws a ball and times its way there and back, the
//! second throws back what it catches.

use core::time::Duration;
use std::os::fd::{OwnedFd, RawFd};
use std::path::PathBuf;

use lager_ports::{BusConfig, Clock, Policy};
use lager_topics::{SensorLine, Stamp, Topic};
use serde::{Deserialize, Serialize};

use super::contender::Contender;
use super::ours;
use crate::ball::Ball;
use crate::baseline::iceoryx::{Listening, Member, Polling};
use crate::baseline::memory::{CacheLine, EventFd, Futex, Lane};
use crate::baseline::stream::Stream;
#[cfg(feature = "zenoh")]
use crate::baseline::zenoh;
use crate::baseline::{End, Fault, LIMIT};
use crate::error::BenchError;
use crate::machine;
use crate::parts::Stage;
use crate::report::Mode;
use crate::shared::{Barrier, Board, Shared, inherit};
use crate::slow;

/// What both processes see without a bus.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Court {
    barrier: Barrier,
    /// There and back.
    lanes: [Lane; 2],
}

// SAFETY: atomics only.
#[allow(unsafe_code)]
unsafe impl Board for Court {}

/// What a player is told once.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Setup {
    /// The core to stay on.
    pub(crate) core: usize,
    /// The bus's folder.
    pub(crate) folder: PathBuf,
    /// The number of the [`Court`].
    pub(crate) court: RawFd,
    /// The numbers of the lines; the first of a pair is the first player's.
    pub(crate) lines: Lines<RawFd>,
}

/// The descriptors of the lines that go through the kernel.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Lines<Fd> {
    /// What to read from and what to write into, there; the same, back.
    pub(crate) pipes: [(Fd, Fd); 2],
    /// There and back.
    pub(crate) eventfds: [Fd; 2],
    /// The first player's and the second's.
    pub(crate) uds: [Fd; 2],
    /// The first player's and the second's.
    pub(crate) tcp: [Fd; 2],
}

impl<Fd> Lines<Fd> {
    pub(crate) fn map<To>(self, to: impl Fn(Fd) -> To) -> Lines<To> {
        Lines {
            pipes: self.pipes.map(|(read, write)| (to(read), to(write))),
            eventfds: self.eventfds.map(&to),
            uds: self.uds.map(&to),
            tcp: self.tcp.map(&to),
        }
    }
}

/// How one way is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Timing {
    /// As half of the way there and back, as fast as balls come back. One clock, at one end; a
    /// tail shows by half.
    ThereAndBack,
    /// By itself, from the first process's clock to the second's.
    OneWay {
        /// From one throw to the next, at least; 0 is as fast as they come back. In ns.
        gap_ns: u64,
    },
}

impl Timing {
    pub(crate) const fn gap_ns(self) -> u64 {
        match self {
            Self::ThereAndBack => 0,
            Self::OneWay { gap_ns } => gap_ns,
        }
    }
}

/// What a player is told for each round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// What carries the balls.
    pub contender: Contender,
    /// Balls that are thrown before any is timed.
    pub warm_up: u32,
    /// Balls that are timed.
    pub balls: u32,
    /// How one way is timed.
    pub timing: Timing,
    /// Which round it is, from 1.
    pub number: u32,
    /// A deliberate slow-down of each sample, in ns.
    pub spin_ns: u64,
}

impl Round {
    fn all(&self) -> impl Iterator<Item = u64> {
        let base = u64::from(self.number) << 32;
        (1..=u64::from(self.warm_up) + u64::from(self.balls)).map(move |ball| base + ball)
    }
}

/// The player that times.
pub(crate) fn first(stage: &mut Stage) -> Result<(), BenchError> {
    play(stage, First)
}

/// The player that throws back.
pub(crate) fn second(stage: &mut Stage) -> Result<(), BenchError> {
    play(stage, Second)
}

/// What tells the two players apart.
trait Player {
    /// 0 or 1.
    const INDEX: usize;

    fn typed_ports(
        &self,
        config: &BusConfig,
        policy: Policy,
        table: &Table<'_>,
        round: &Round,
    ) -> Result<Vec<u64>, BenchError>;

    /// Plays a round. The first player returns the times of one way each, in ns; where only one
    /// way is timed, it returns when it threw, and the second player when it caught.
    fn play(&self, end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError>;
}

struct First;
struct Second;

impl Player for First {
    const INDEX: usize = 0;

    fn typed_ports(
        &self,
        config: &BusConfig,
        policy: Policy,
        table: &Table<'_>,
        round: &Round,
    ) -> Result<Vec<u64>, BenchError> {
        table.with(self, ours::first(config, policy)?, round)
    }

    fn play(&self, end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
        let mut samples = Vec::with_capacity(round.balls as usize);
        let gap_ns = round.timing.gap_ns();
        let mut due = Clock::monotonic_ns();
        for (index, number) in round.all().enumerate() {
            if gap_ns > 0 {
                due = (due + gap_ns).max(Clock::monotonic_ns());
                while Clock::monotonic_ns() < due {}
            }
            let thrown = Clock::monotonic_ns();
            let ball = end
                .send(&Ball::new(number))
                .and_then(|()| end.receive())
                .map_err(|fault| round.failed(number, fault))?;
            let caught = Clock::monotonic_ns();
            round.check(number, &ball)?;
            if index >= round.warm_up as usize {
                samples.push(match round.timing {
                    Timing::ThereAndBack => (caught - thrown) / 2,
                    Timing::OneWay { .. } => thrown,
                });
            }
        }
        Ok(samples)
    }
}

impl Player for Second {
    const INDEX: usize = 1;

    fn typed_ports(
        &self,
        config: &BusConfig,
        policy: Policy,
        table: &Table<'_>,
        round: &Round,
    ) -> Result<Vec<u64>, BenchError> {
        table.with(self, ours::second(config, policy)?, round)
    }

    fn play(&self, end: &mut impl End, round: &Round) -> Result<Vec<u64>, BenchError> {
        let one_way = round.timing != Timing::ThereAndBack;
        let mut samples = Vec::with_capacity(if one_way { round.balls as usize } else { 0 });
        for (index, number) in round.all().enumerate() {
            let ball = end.receive().map_err(|fault| round.failed(number, fault))?;
            if one_way && index >= round.warm_up as usize {
                samples.push(Clock::monotonic_ns());
            }
            end.send(&ball)
                .map_err(|fault| round.failed(number, fault))?;
            round.check(number, &ball)?;
        }
        Ok(samples)
    }
}

impl Round {
    fn check(&self, expected: u64, ball: &Ball) -> Result<(), BenchError> {
        if ball.number == expected && ball.is_whole() {
            return Ok(());
        }
        Err(BenchError::WrongSample {
            contender: self.contender.to_string(),
            expected: expected & u64::from(u32::MAX),
            got: ball.number & u64::from(u32::MAX),
        })
    }

    fn failed(&self, expected: u64, fault: Fault) -> BenchError {
        let contender = self.contender.to_string();
        match fault {
            Fault::Silent => BenchError::NoSample {
                contender,
                expected: expected & u64::from(u32::MAX),
                limit: LIMIT,
            },
            Fault::Broken(detail) => BenchError::Carrier { contender, detail },
        }
    }
}

/// What a player has at hand all the time.
struct Table<'court> {
    court: &'court Court,
    lines: &'court Lines<OwnedFd>,
    config: BusConfig,
}

fn play<P: Player>(stage: &mut Stage, player: P) -> Result<(), BenchError> {
    let Some(setup) = stage.hear::<Setup>()? else {
        return Ok(());
    };
    machine::pin(setup.core)?;
    let court = Shared::<Court>::inherited(setup.court)?;
    let lines = setup.lines.map(inherit);
    let table = Table {
        court: &court,
        lines: &lines,
        config: BusConfig {
            folder: Some(setup.folder),
            ..BusConfig::default()
        },
    };
    stage.tell(&())?;
    while let Some(round) = stage.hear::<Round>()? {
        slow::spins_for(round.spin_ns);
        stage.tell(&table.round(&player, &round)?)?;
    }
    Ok(())
}

impl Table<'_> {
    /// Plays one round with ends of its own, so that what a place in memory does to the times
    /// differs from round to round.
    fn round<P: Player>(&self, player: &P, round: &Round) -> Result<Vec<u64>, BenchError> {
        let [there, back] = &self.court.lanes;
        let [bell_there, bell_back] = &self.lines.eventfds;
        let [pipe_there, pipe_back] = &self.lines.pipes;
        let first = P::INDEX == 0;
        let (out, back) = if first { (there, back) } else { (back, there) };
        let (ring, bell) = if first {
            (bell_there, bell_back)
        } else {
            (bell_back, bell_there)
        };
        let (write, read) = if first {
            (&pipe_there.1, &pipe_back.0)
        } else {
            (&pipe_back.1, &pipe_there.0)
        };
        match round.contender {
            Contender::Lager(mode) => {
                let policy = match mode {
                    Mode::Spin => Policy::Spin,
                    // One of two cores at most is given to adaptive spinning, and it is the second
                    // player's wait that is timed.
                    Mode::Adaptive if first => Policy::Spin,
                    Mode::Adaptive => Policy::ADAPTIVE,
                    Mode::Block => Policy::Block,
                };
                player.typed_ports(&self.config, policy, self, round)
            }
            Contender::IceoryxHeader => {
                let end = self.polling::<Stamp>(first)?;
                self.with(player, end, round)
            }
            Contender::IceoryxBare => {
                let end = self.polling::<()>(first)?;
                self.with(player, end, round)
            }
            Contender::IceoryxDefaults => {
                let member = Member::join_with_defaults(&self.config)?;
                let end = Polling::<()>::new(member, names(first), None)?;
                self.with(player, end, round)
            }
            Contender::IceoryxEvent => {
                let end = Listening::new(self.member()?, names(first), &SensorLine::QOS)?;
                self.with(player, end, round)
            }
            Contender::CacheLine => self.with(player, CacheLine::new(out, back), round),
            Contender::Futex => self.with(player, Futex::new(out, back), round),
            Contender::EventFd => self.with(player, EventFd::new((out, ring), (back, bell)), round),
            Contender::Pipe => {
                let end = Stream {
                    out: write,
                    back: read,
                };
                self.with(player, end, round)
            }
            Contender::Uds => self.both_ways(player, &self.lines.uds, round),
            Contender::Tcp => self.both_ways(player, &self.lines.tcp, round),
            #[cfg(feature = "zenoh")]
            Contender::Zenoh => self.with(player, self.peer(first, round)?, round),
        }
    }

    fn member(&self) -> Result<Member, BenchError> {
        Member::join(&self.config)
    }

    fn polling<H: crate::baseline::iceoryx::Header>(
        &self,
        first: bool,
    ) -> Result<Polling<H>, BenchError> {
        Polling::new(self.member()?, names(first), Some(&SensorLine::QOS))
    }

    #[cfg(feature = "zenoh")]
    fn peer(&self, first: bool, round: &Round) -> Result<zenoh::Peer, BenchError> {
        let folder = self.config.folder.as_deref().unwrap_or("".as_ref());
        // A name of its own for each round: the one before may still be closing.
        let socket = folder.join(format!("zenoh-{}", round.number));
        let side = if first {
            zenoh::Side::Listens
        } else {
            zenoh::Side::Connects
        };
        zenoh::Peer::meet(&socket, side, names(first))
    }

    fn both_ways<P: Player>(
        &self,
        player: &P,
        ends: &[OwnedFd; 2],
        round: &Round,
    ) -> Result<Vec<u64>, BenchError> {
        let own = &ends[P::INDEX];
        let end = Stream {
            out: own,
            back: own,
        };
        self.with(player, end, round)
    }

    /// Plays when the other player is ready, and keeps the end until the other is done with it.
    fn with<P: Player>(
        &self,
        player: &P,
        mut end: impl End,
        round: &Round,
    ) -> Result<Vec<u64>, BenchError> {
        const LIMIT: Duration = Duration::from_secs(8);
        let arrive = |count| {
            if self.court.barrier.pass(2, count, LIMIT) {
                Ok(())
            } else {
                Err(BenchError::Alone { limit: LIMIT })
            }
        };
        arrive(2 * round.number - 1)?;
        let samples = player.play(&mut end, round)?;
        arrive(2 * round.number)?;
        Ok(samples)
    }
}

/// What to publish to and what to subscribe to.
fn names(first: bool) -> (&'static str, &'static str) {
    if first {
        ("bench/bare-ping", "bench/bare-pong")
    } else {
        ("bench/bare-pong", "bench/bare-ping")
    }
}
